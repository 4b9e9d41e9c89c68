"""The order of what is played: by log time whatever the bag, in little memory."""

import tracemalloc
from itertools import pairwise
from pathlib import Path

import pytest
from helpers.made_messages import STRING, Bag, new, serialized
from helpers.strategies import examples
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from auv_analysis.bag.metadata import Definition
from auv_analysis.replay import played_bag
from auv_analysis.replay.played_bag import index_bag, messages
from auv_dynamics.files.errors import InputError

TOPICS = ('/a', '/b', '/c')
quick = examples(15, suppress_health_check=[HealthCheck.function_scoped_fixture])
TIMES = st.lists(st.tuples(st.integers(0, 30), st.integers(0, 2)), max_size=40)


def write(folder: Path, files: list[list[tuple[int, int]]], **options) -> list:
    """Bag of files with (log time, topic) each; its messages in the order of the bag."""
    everything = []
    for path in folder.glob('*.mcap'):
        path.unlink()
    for number, entries in enumerate(files):
        bag = Bag(folder / f'bag_{number}.mcap', **options)
        for ns, topic in entries:
            data = serialized(new(STRING, f'{len(everything)}'))
            bag.add(TOPICS[topic], STRING, ns, data)
            everything.append((ns, TOPICS[topic], data))
        bag.close()
    return everything


@quick
@given(
    st.lists(TIMES, min_size=1, max_size=4).filter(any),
    st.sets(st.sampled_from(TOPICS)),
    st.integers(0, 30),
    st.integers(0, 30),
    st.sampled_from([{'chunk_size': 200}, {'chunk_size': 1}, {'use_chunking': False}]),
)
def test_by_log_time_and_then_as_in_the_bag(tmp_path, files, topics, begin, end, options) -> None:
    everything = write(tmp_path, files, **options)
    wanted = [one for one in everything if one[1] in topics and begin <= one[0] <= end]
    index = index_bag(tmp_path)
    found = [tuple(one) for one in messages(index, topics, begin, end)]
    assert found == sorted(wanted, key=lambda one: one[0])
    assert (index.first, index.last) == (
        min(ns for ns, *_ in everything), max(ns for ns, *_ in everything)
    )  # fmt: skip


@pytest.mark.parametrize('beside', [False, True], ids=['one file', 'two files of the same time'])
def test_memory_does_not_grow_with_the_bag(tmp_path: Path, beside: bool) -> None:
    text, most = 'x' * 2000, {}
    for count in (200, 1200):
        folder = tmp_path / f'{count}'
        for number in range(1 + beside):
            bag = Bag(folder / f'bag_{number}.mcap', chunk_size=20_000)
            data = serialized(new(STRING, text))
            for k in range(count):
                bag.add('/a', STRING, k, data)
            bag.close()
        tracemalloc.start()
        stream = messages(index_bag(folder), TOPICS)
        assert all(one.ns == k // (1 + beside) for k, one in enumerate(stream))
        most[count] = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert most[1200] - most[200] < 0.05 * 1000 * len(text)  # the index of a chunk, no message


@quick
@given(
    st.lists(TIMES, min_size=1, max_size=4).filter(any),
    st.sets(st.sampled_from(TOPICS)),
    st.sampled_from([{'chunk_size': 200}, {'chunk_size': 1}]),
)
def test_gaps_of_what_is_played_are_those_between_its_log_times(
    tmp_path, files, topics, options
) -> None:
    apart = 50 * 10**9
    listed = [[(k * apart, topic) for k, topic in entries] for entries in files]
    everything = write(tmp_path, listed, **options)
    times = sorted({ns for ns, topic, _ in everything if topic in topics})
    gaps = [(a, b) for a, b in pairwise(times) if b - a > apart]
    index = index_bag(tmp_path)
    assert index.gaps(topics, 0, 2**63) == gaps
    for begin, end in gaps[:1]:
        assert index.gaps(topics, begin, end) == [(begin, end)]
        assert index.gaps(topics, begin + 1, 2**63) == gaps[1:]
        assert index.gaps(topics, 0, end - 1) == []


def test_a_file_is_opened_when_its_time_has_come(tmp_path: Path, monkeypatch) -> None:
    write(tmp_path, [[(k * 10 + i, 0) for i in range(10)] for k in range(20)])
    index = index_bag(tmp_path)
    opened = []
    real = played_bag.McapFile
    monkeypatch.setattr(played_bag, 'McapFile', lambda p: (opened.append(p.name), real(p))[1])
    played = messages(index, TOPICS)
    for _ in range(55):
        next(played)
    assert opened == [f'bag_{k}.mcap' for k in range(6)]


def test_a_bag_that_grows_is_played_up_to_where_it_was(tmp_path: Path) -> None:
    write(tmp_path, [[(k, 0) for k in range(50)]], chunk_size=200)
    whole = (tmp_path / 'bag_0.mcap').read_bytes()
    (tmp_path / 'bag_0.mcap').write_bytes(whole[: len(whole) // 2])
    index = index_bag(tmp_path)
    assert 'not finished' in index.notes[0]
    known = index.last + 1
    assert 0 < known < 50
    (tmp_path / 'bag_0.mcap').write_bytes(whole)
    assert [one.ns for one in messages(index, TOPICS, end=index.last)] == list(range(known))


def test_a_gap_is_more_than_a_minute_without_any_of_the_topics(tmp_path: Path) -> None:
    second = 10**9
    spread = [(ns * second, topic) for ns, topic in [(0, 0), (10, 1), (50, 0), (100, 0), (160, 2)]]
    write(tmp_path, [spread], chunk_size=1)
    index = index_bag(tmp_path)
    assert index.gaps(TOPICS, 0, 2**63) == [], 'a minute is none'
    assert index.gaps(['/b', '/c'], 0, 2**63) == [(10 * second, 160 * second)]


def test_the_first_and_the_last_message_that_are_asked_for_are_played(tmp_path: Path) -> None:
    write(tmp_path, [[(k, 0) for k in range(4)]], chunk_size=1)
    assert [one.ns for one in messages(index_bag(tmp_path), TOPICS, 1, 2)] == [1, 2]


def test_further_gaps_than_are_told_apart_are_none(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(played_bag, 'MOST_SPANS', 2)
    write(tmp_path, [[(k * 100 * 10**9, 0) for k in range(4)]], chunk_size=1)
    assert index_bag(tmp_path).gaps(['/a'], 0, 2**63) == [(0, 100 * 10**9)]


def test_says_how_a_topic_was_recorded(tmp_path: Path) -> None:
    write(tmp_path, [[(2**31 * 10**9 - 1, 0)]])
    text, known = '- {depth: 7}', 'RIHS01_7'
    bag = Bag(tmp_path / 'bag_1.mcap')
    about = {'offered_qos_profiles': text, 'topic_type_hash': known}
    channel = bag._writer.register_channel('/qos', 'cdr', 0, about)
    bag._writer.add_message(channel, 0, b'\0\1\0\0', 0)
    bag._writer.register_channel('/qos', 'cdr', 0, {'topic_type_hash': known})
    schema = bag._writer.register_schema('std_msgs/msg/Header', 'ros2msg', b'uint8 x')
    channel = bag._writer.register_channel('/a', 'cdr', schema)
    bag._writer.add_message(channel, 0, b'\0\1\0\0', 0)
    bag.close()
    index = index_bag(tmp_path)
    assert index.topics['/a'].kind == STRING
    assert index.clashes == {'/a'}
    assert index.topics['/qos'] == Definition('/qos', '', 'cdr', text, known)


@pytest.mark.parametrize(
    ('files', 'words'),
    [
        ([[]], 'expected a bag with messages'),
        ([[(2**31 * 10**9, 0)]], 'what a ROS time can hold, found 2147483648000000000 ns'),
    ],
)
def test_refuses_what_cannot_be_played(tmp_path: Path, files: list, words: str) -> None:
    write(tmp_path, files)
    with pytest.raises(InputError, match=words):
        index_bag(tmp_path)
