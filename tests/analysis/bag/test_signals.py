"""Stamps as bags have them: out of order, doubled, begun anew, missing, on another clock."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.foreign_bags import (
    SECOND,
    UNNAMED,
    Maker,
    loaded,
    motion,
    simple,
    simulated,
    write,
)
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis.bag.foreign_messages import (
    Recorded,
    longest_stretch,
    on_the_clock,
    ordered,
    read_sources,
)
from auv_analysis.bag.foreign_topics import MappedTopic, read_mapping
from auv_analysis.bag.foreign_tracks import (
    _on_one_clock,
    _retimed,
    _track,
    axes_of,
    with_rates,
)
from auv_analysis.bag.tracks import Track
from auv_analysis.runs.run import Run
from auv_dynamics.files.errors import InputError

KEYS = {'odometry': '/o', 'wrench': '/w', 'frames': 'enu_flu', 'step': 0.01}


@pytest.fixture(scope='module')
def run() -> Run:
    return simulated(duration=1.0)


def recorded(stamps, role: str = 'twist', log=None, *, stamped: bool = True) -> Recorded:
    stamps = np.array(stamps, np.int64)
    log = stamps if log is None else np.array(log, np.int64)
    rows = np.arange(len(stamps), dtype=float)[:, None]
    return Recorded(Path('bag'), MappedTopic(role, f'/{role}'), '', '', log, stamps, stamped, rows)


def test_late_messages_are_sorted_and_counted() -> None:
    notes: list[str] = []
    found = ordered(recorded([1, 4, 2, 3, 5]), notes)
    assert_array_equal(found.stamps, [1, 2, 3, 4, 5])
    assert_array_equal(found.rows[:, 0], [0, 2, 3, 1, 4])
    assert notes == ['/twist: 2 messages came out of order and were sorted']


@pytest.mark.parametrize(('role', 'kept', 'word'), [('twist', 1, 'first'), ('wrench', 2, 'last')])
def test_of_doubled_stamps_the_first_measurement_and_the_last_command_count(role, kept, word):
    notes: list[str] = []
    found = ordered(recorded([1, 4, 4, 5], role), notes)
    assert_array_equal(found.stamps, [1, 4, 5])
    assert_array_equal(found.rows[:, 0], [0, kept, 3])
    assert notes == [f'/{role}: 1 stamps came again, the {word} of each is kept']


def test_of_a_clock_that_begins_anew_the_longest_stretch_is_read() -> None:
    notes: list[str] = []
    seconds = np.array([7, 8, 9, 2, 3, 4, 5, 1, 2])
    found = longest_stretch(recorded(seconds * SECOND), notes)
    assert_array_equal(found.stamps, np.array([2, 3, 4, 5]) * SECOND)
    assert notes == ['/twist: the clock jumps back 2 times, by up to 7 s; read the longest of 3 '
                     'stretches, left 5 messages']  # fmt: skip
    small = recorded([0, SECOND, SECOND // 2, 2 * SECOND])
    assert longest_stretch(small, notes) is small, 'a late message is no new beginning'


def test_parts_that_stand_in_another_order_are_one_recording() -> None:
    parts, notes = [5, 6, 7, 2, 3, 4, 8, 9, 10], list[str]()
    swapped = recorded(np.array(parts) * SECOND)
    assert longest_stretch(swapped, notes) is swapped
    assert not notes
    paused = recorded(np.array([12, 13, 14, *parts]) * SECOND)
    assert len(longest_stretch(paused, notes).stamps) < 12, 'two seconds later: another run'
    overlapping = recorded(np.array([10, 12, 14, 16, 4, 6, 8, 11]) * SECOND // 2)
    assert len(longest_stretch(overlapping, notes).stamps) == 4, 'of the same time: another run'
    touching = recorded(np.array([5, 6, 7, 2, 3, 4, 5]) * SECOND)
    assert len(longest_stretch(touching, notes).stamps) == 4, 'at one time: another run'


def test_a_single_message_of_another_time_is_left_out_and_counted() -> None:
    notes: list[str] = []
    seconds = np.array([10, 11, 12, 0, 14, 15, 900, 17, 18])
    found = longest_stretch(recorded(seconds * SECOND), notes)
    assert_array_equal(found.rows[:, 0], [0, 1, 2, 4, 5, 7, 8])
    assert notes == ['/twist: 2 of 9 messages were left out: their stamps are far off those around '
                     'them']  # fmt: skip
    in_turn = longest_stretch(recorded(np.array([0, 900, 1, 901, 2, 902]) * SECOND), notes)
    assert_array_equal(in_turn.rows[:, 0], [0, 1])
    little = np.array([990, 1000, 885, 910, 940]) * SECOND // 100
    found = longest_stretch(recorded(little, log=990 + np.arange(5)), notes)
    assert len(found.rows) == 3, 'a clock that begins anew by little'


@pytest.mark.parametrize(('seconds', 'kept'), [
    ([10, 11, 0, 0, 14, 900, 901, 17, 18], [0, 1, 4, 7, 8]), ([10], [0]),
    ([10, 0, 0, 13, 14, 0, 16], [0, 3, 4, 6]),
    ([0, 1, 900, 901, 2, 3, 902, 903], [0, 1, 2, 3]), ([10, 11, 0, 1, 2, 15, 16], [0, 1, 5, 6]),
    ([10, 11, *range(5), 18, 19], [0, 1, 7, 8]), ([10, 11, *range(6), 18, 19], [*range(2, 10)]),
    ([7, 8, 9, 4, 5, 6, 10, 11], [*range(8)]),
    ([0, 0, 12, 13], [0, 1, 2, 3]), ([10, 11, 12, 0, 0], [0, 1, 2]),
])  # fmt: skip
def test_so_are_five_in_a_row_but_no_clocks_in_turn_nor_swapped_parts(seconds, kept) -> None:
    found = longest_stretch(recorded(np.array(seconds) * SECOND), [])
    assert_array_equal(found.rows[:, 0], kept)


def test_a_pause_makes_no_bursts() -> None:
    notes: list[str] = []
    _retimed(recorded(np.r_[np.arange(50), 10**6 + np.arange(50)] * 10**7), notes)
    assert not notes


@pytest.mark.parametrize(('short', 'count', 'said'), [
    (20, 100, []), (21, 100, ['21 %']), (6, 12, ['50 %']), (6, 11, []),
])  # fmt: skip
def test_bursts_are_said_from_a_fifth_of_many_intervals_on(short, count, said) -> None:
    apart = np.where(np.arange(count) < short, 1, 100) * 10**6
    notes: list[str] = []
    _retimed(recorded(np.cumsum([0, *apart])), notes)
    assert [note.split('in bursts, ')[1][:4] for note in notes] == said


def test_logged_times_are_put_on_another_clock() -> None:
    clock = recorded(np.arange(5) * SECOND, log=(100 + 2 * np.arange(5)) * SECOND)
    notes: list[str] = []
    logged = recorded(np.array([99, 101, 104, 110]) * SECOND, stamped=False)
    found = on_the_clock(logged, clock, notes)
    assert_allclose(found.stamps / SECOND, [-1.0, 0.5, 2.0, 6.0])
    assert 'logged 102 s off the stamps of /twist' in notes[0]
    ahead = recorded(900 * SECOND + clock.stamps, log=clock.log).part(np.array([2, 0, 1, 4, 3]))
    found = on_the_clock(logged, ahead, notes)  # whatever order it was logged in
    assert_allclose(found.stamps / SECOND, [899.0, 900.5, 902.0, 906.0])
    late = recorded(np.array([0, 10, 5, 30, 40]) * SECOND // 10, log=(100 + np.arange(5)) * SECOND)
    again = recorded(np.array([102, 103]) * SECOND, stamped=False)
    assert_allclose(on_the_clock(again, late, notes).stamps / SECOND, [1.0, 3.0])
    near = recorded(np.arange(5) * SECOND, log=np.arange(5) * SECOND + SECOND // 10)
    assert on_the_clock(logged, near, []) is logged, 'one clock and a delay'


@pytest.mark.parametrize('role', ['odometry', 'pose'])
def test_logged_times_follow_the_stretch_of_the_clock_that_is_read(role) -> None:
    seconds = np.array([*range(6), *range(9)])
    log = (100 + np.arange(15)) * SECOND
    clock = recorded(seconds * SECOND, role, log)
    others = {other: recorded(log, other, stamped=False) for other in ('twist', 'wrench')}
    found = _on_one_clock({**others, role: clock}, [])
    for other in others:
        assert_array_equal(found[other].stamps, np.arange(9) * SECOND)
        assert_array_equal(found[other].rows[:, 0], np.arange(6, 15))


def test_no_line_leads_from_a_single_message() -> None:
    with pytest.raises(InputError, match=r'/wrench: expected at least 2 messages .*, found 1'):
        _track('wrench', recorded([1], 'wrench'), 'ned_fsd')
    held = MappedTopic('wrench', '/wrench', between='hold')
    assert _track('wrench', replace(recorded([1]), source=held), 'ned_fsd').held


def test_the_rate_of_an_attitude_is_none_in_its_gaps() -> None:
    t = np.r_[np.arange(0, 21), np.arange(40, 49)] * SECOND // 10  # nine, for a cubic
    psi = 0.5 * t / SECOND
    rows = np.column_stack([np.zeros((len(t), 3)), np.cos(psi / 2), np.zeros((len(t), 2)),
                            np.sin(psi / 2)])  # fmt: skip
    pose = Track('pose', '/p', t, rows, 0.5 * SECOND, held=False)
    ns = np.arange(-3, 60) * SECOND // 10
    moved = np.arange(63.0)[:, None] + 100.0 * np.arange(6)
    twist = Track('twist', '/v', ns, moved, np.inf, held=False)
    notes: list[str] = []
    found = with_rates(twist, pose, notes)
    kept = np.r_[np.arange(3, 24), np.arange(43, 52)]
    assert_array_equal(found.ns, ns[kept])
    assert_array_equal(found.rows[:, :3], moved[kept, :3])
    assert_allclose(found.rows[:, 3:], [[0, 0, 0.5]] * len(kept), atol=1e-9)
    assert notes[0].startswith('/p: the angular velocity is the rate of its attitude')


def test_the_rate_of_an_attitude_is_none_across_a_reset() -> None:
    t = np.arange(60) * SECOND // 10
    half = 0.25 * t / SECOND - 0.5 * (np.arange(60) >= 30)
    rows = np.column_stack([np.zeros((60, 3)), np.cos(half), np.zeros((60, 2)), np.sin(half)])
    pose = Track('pose', '/p', t, rows, SECOND, held=False)
    ns = np.arange(119) * SECOND // 20
    found = with_rates(Track('twist', '/v', ns, np.zeros((119, 6)), SECOND, held=False), pose, [])
    assert_array_equal(found.ns, np.delete(ns, 59))
    assert_allclose(found.rows[:, 3:], [[0, 0, 0.5]] * 118, atol=1e-9)


@pytest.mark.parametrize(('frames', 'ids', 'axes', 'said'), [
    (None, ('odom_ned', 'base_frd'), 'ned_fsd', 0), (None, ('odom_ned', ''), 'ned_fsd', 0),
    ('enu_flu', ('odom_ned', 'base'), 'enu_flu', 1), ('ned_fsd', ('odom_ned', 'x'), 'ned_fsd', 0),
    ('ned_fsd', ('odom', 'base_flu'), 'ned_fsd', 1),
])  # fmt: skip
def test_axes_are_those_that_were_told_else_by_all_frame_ids(frames, ids, axes, said) -> None:
    notes: list[str] = []
    source = MappedTopic('twist', '/t', frames=frames)
    one = replace(recorded([1, 2]), source=source, frame=ids[0], child=ids[1])
    assert axes_of(one, notes) == axes
    assert len(notes) == said
    for named in (('odom_ned', 'base'), ('map_enu', 'base_flu'), ('', '')):
        half = replace(one, source=MappedTopic('twist', '/t'), frame=named[0], child=named[1])
        with pytest.raises(InputError, match='expected --frames ned_fsd or enu_flu'):
            axes_of(half, [])


def messages(run: Run) -> list:
    seen = motion(run, enu=True)
    return simple(seen, Maker(), '/o', '/w', UNNAMED)


def test_shuffled_and_doubled_messages_make_the_same_run(run, tmp_path) -> None:
    listed = messages(run)
    rng = np.random.default_rng(5)
    late = [(topic, log + int(rng.integers(0, 40_000_000)), m) for topic, log, m in listed]
    doubled = late + [late[i] for i in rng.integers(0, len(late), 20)]
    found = loaded(write(tmp_path / 'other', doubled, Maker()), **KEYS)
    assert_allclose(found.nu, run.nu, atol=1e-9)
    assert_allclose(found.tau, run.tau, rtol=1e-9)
    said = ' '.join(found.notes)
    assert 'came out of order' in said
    assert 'stamps came again' in said


def test_a_simulation_that_was_reset_is_read_as_one_of_its_runs(run, tmp_path) -> None:
    maker = Maker()
    short = messages(run.part(slice(0, 40)))
    second = messages(run)
    for _, log, message in second:  # later, but stamped five seconds before
        ns = log - 2_000_000 - 5 * SECOND
        message.header.stamp = maker.header(ns, '').stamp
    again = [(topic, log + 2 * SECOND, message) for topic, log, message in second]
    found = loaded(write(tmp_path / 'other', short + again, maker), **KEYS)
    assert_allclose(found.nu, run.nu, atol=1e-9)
    assert_allclose(found.tau, run.tau, rtol=1e-9)
    assert sum('the clock jumps back 1 times, by up to 5.39 s' in n for n in found.notes) == 1


def test_jitter_of_the_stamps_moves_values_by_no_more_than_it_is(run, tmp_path) -> None:
    seen = motion(run, enu=True)
    t = seen.t + np.random.default_rng(1).uniform(0.0, 0.004, len(seen.t))
    maker = Maker()
    listed = simple(seen._replace(t=t), maker, '/o', '/w', UNNAMED, seen)
    found = loaded(write(tmp_path / 'other', listed, maker), **KEYS)
    truth = np.stack([np.interp(found.t + t[0], run.t, column) for column in run.nu.T], axis=1)
    rate = np.abs(np.diff(run.nu, axis=0)).max(axis=0) / run.step
    assert np.all(np.abs(found.nu - truth) <= 0.0141 * rate)


def test_zero_stamps_give_way_to_the_time_of_logging(run, tmp_path) -> None:
    maker, listed = Maker(), messages(run)
    for _, _, message in listed:
        message.header.stamp = maker.header(0, '').stamp
    found = loaded(write(tmp_path / 'other', listed, maker), **KEYS)
    assert_allclose(found.nu, run.nu, atol=1e-9)
    assert sum('every stamp is zero' in note for note in found.notes) == 2


def test_the_time_of_logging_is_taken_where_that_was_told(run, tmp_path) -> None:
    maker, listed = Maker(), messages(run)
    for i, (_, _, message) in enumerate(listed):
        message.header.stamp = maker.header(5 * SECOND + 7 * i, '').stamp
    told = {role: {'topic': KEYS[role], 'stamps': 'log'} for role in ('odometry', 'wrench')}
    found = loaded(write(tmp_path / 'other', listed, maker), **KEYS | told)
    assert_allclose(found.nu, run.nu, atol=1e-9)
    assert_allclose(found.tau, run.tau, rtol=1e-9)


def test_messages_that_must_not_be_used_are_left_out(run, tmp_path) -> None:
    seen = motion(run, enu=True)
    seen.twist[50, 2], seen.attitude[70] = np.nan, 0.0
    seen.attitude[80] *= 1.02
    bag = write(tmp_path / 'other', simple(seen, Maker(), '/o', '/w', UNNAMED), Maker())
    found = loaded(bag, **KEYS)
    assert found.notes[0] == ('/o: 3 of 101 messages were left out: not finite, or without a unit '
                              'quaternion')  # fmt: skip
    good = np.delete(np.arange(101), [50, 70, 80])
    assert_allclose(found.nu[good], run.nu[good], atol=1e-9)
    assert np.isfinite(found.nu).all()


def test_topics_that_never_meet_are_refused(run, tmp_path) -> None:
    seen = motion(run, enu=True)
    later = seen._replace(t=seen.t + 100.0)
    bag = write(tmp_path / 'other', simple(seen, Maker(), '/o', '/w', UNNAMED, later), Maker())
    found = r'a time with all mapped topics .*found /o 0 to 1 s, /w 100 to 101 s'
    with pytest.raises(InputError, match=found):
        loaded(bag, **KEYS)


def test_velocities_of_a_time_without_wrench_are_counted(run, tmp_path) -> None:
    seen, forces = motion(run, enu=True), motion(run, enu=True, keep=slice(20, 71))
    listed = simple(seen, Maker(), '/o', '/w', UNNAMED, forces)
    notes = loaded(write(tmp_path / 'other', listed, Maker()), **KEYS).notes
    assert any('velocities of 0.2 s before and 0.3 s behind the samples' in n for n in notes)


def read(listed: list, folder: Path, notes: list[str]) -> dict[str, Recorded]:
    mapping = read_mapping(None, {'odometry': '/o', 'wrench': '/w'})
    return read_sources(write(folder, listed, Maker()), mapping, notes)


def test_a_topic_of_two_frames_is_refused(run, tmp_path) -> None:
    listed = messages(run.part(slice(3)))
    listed[1][2].header.frame_id = 'map'
    line = '/o: expected the same frame_id in all messages, found map base_link; odom base_link'
    with pytest.raises(InputError, match=line):
        read(listed, tmp_path / 'other', [])


def test_an_odometry_of_zeros_is_said_and_one_that_stands_still_is_none(run, tmp_path) -> None:
    m = motion(run.part(slice(3)), enu=True)
    for share, said in ((0.0, 1), (0.5, 0)):
        still = m._replace(twist=0.0 * m.twist, position=share * m.position)
        notes: list[str] = []
        read(simple(still, Maker(), '/o', '/w', UNNAMED), tmp_path / f'{said}', notes)
        assert sum('/o: position and velocity are zero' in note for note in notes) == said


@pytest.mark.parametrize(('keys', 'line'), [
    ({'odometry': {'topic': '/o', 'stamp': 'at'}}, r'odometry.stamp: expected a path in its mess'),
    ({'odometry': '/x'}, r'odometry: expected a topic of the bag: /o, found /x'),
    ({'odometry': '/w'}, r'/w: expected nav_msgs/msg/Odometry, found geometry_msgs/msg/WrenchStam'),
    ({'wrench': '/o'}, r'/o: expected geometry_msgs/msg/WrenchStamped or geometry_msgs/msg/Wr'),
    ({'frames': None}, r"/o: frame_id: expected --frames ned_fsd or enu_flu.*'odom', 'base_link'$"),
    ({'step': 4e-5}, r'options: step: expected at least 5e-05 s, of which 200 .*, found 4e-05$'),
    ({'vehicle': None}, r'^options: vehicle \(--vehicle\): expected a vehicle file or a shipped'),
    ({'rates': 'from attitude', 'gap': 1e-3}, r'/o: expected 9 attitudes without a .* none$'),
])  # fmt: skip
def test_what_does_not_fit_is_refused_in_one_line(keys, line, run, tmp_path) -> None:
    bag = write(tmp_path / 'other', messages(run), Maker())
    with pytest.raises(InputError, match=line):
        loaded(bag, **{**KEYS, **keys})
