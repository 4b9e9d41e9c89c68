"""Bags of a driver: stamps of its own, set-points on another grid, topics under other names."""

import json
import tempfile
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.block_runs import joined
from helpers.made_messages import FRAMES, ODOMETRY, SECOND, Bag, new, odometry, serialized, stamped
from helpers.strategies import examples
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis import load_scenario, summarize
from auv_analysis.bag.load import _slopes, _without, load_run, obeyed, open_bag
from auv_analysis.bag.metadata import RECORDING, recording_text
from auv_analysis.bag.reading import BagContents, read_bag, stretches
from auv_analysis.bag.step_topics import NotOursError
from auv_analysis.cli.main import main
from auv_analysis.nodes.recorder_node import StepLedger
from auv_analysis.runs.run import Run
from auv_analysis.studies.compare.sources import open_source, sources_of
from auv_dynamics.files.errors import InputError

MS = 1_000_000
VEHICLE = load_scenario('case1').attachments['vehicle.yaml']
GRID = 20  # ms between set-points
quick = examples(15)
EXACT = '/**/controller_node:\n  ros__parameters: {setpoint_pairing: exact}\n'
STEPS = '/**/plant_node:\n  ros__parameters: {step: 0.02}\n'
GVC = (
    '/**/controller_node:\n  ros__parameters: {law: gvc, gains.k_D: [12.0], gains.k_I: [1.0], '
    'gains.Lambda: [0.8], gains.Gamma: [60.0]}\n'
)


def state(k: int) -> np.ndarray:
    return np.array([k, -k, 0.5 * k, 1.0, 0, 0, 0, *range(6)], float)


def write(
    folder: Path, stamps: list[int], setpoints: list[int], names: Any = None, *, ahead: int = 300,
    unanswered: Any = (), as_given: bool = False, **attached: str,
) -> Path:  # fmt: skip
    """Bag of odometry and wrenches at `stamps` in ms, and set-points, logged `ahead` of them.

    `recording`: what its recorder says of it, '': nothing; `as_given`: in the order of the lists.
    """
    names = names or {}
    bag = Bag(folder / 'bag.mcap', chunk_size=2000)
    bag.attach('vehicle.yaml', VEHICLE)
    if recording := attached.pop('recording', recording_text(False, {})):
        bag.attach(RECORDING, recording)
    for name, text in attached.items():
        bag.attach(f'{name}.yaml', text)
    plan = [(ms, 'odom', k, ms) for k, ms in enumerate(stamps)]
    plan += [(ms, 'wrench', k, ms) for k, ms in enumerate(stamps) if k not in unanswered]
    plan += [(ms - ahead, 'cmd_vel', k, ms) for k, ms in enumerate(setpoints)]
    for _, role, k, ms in plan if as_given else sorted(plan, key=lambda entry: entry[0]):
        kind = {'wrench': 'Wrench', 'cmd_vel': 'Twist'}.get(role)
        made = stamped(kind, ms * MS, [float(k)] * 6) if kind else odometry(ms * MS, state(k))
        topic = names.get(role, f'/{role}')
        bag.add(topic, made.__msgtype__ if kind else ODOMETRY, ms * MS, serialized(made))
    return bag.close()


def held_by_hand(stamps: list[int], setpoints: list[int]) -> dict[int, int]:
    """Stamp of the odometry -> number of the newest set-point at or before it."""
    earlier = {ms: [k for k, s in enumerate(setpoints) if s <= ms] for ms in stamps}
    return {ms: ks[-1] for ms, ks in earlier.items() if ks}


@given(
    apart=st.lists(st.integers(5, 60), min_size=2, max_size=60),
    first=st.integers(-50, 50),
    lost=st.sets(st.integers(0, 90), max_size=40),
    ahead=st.sampled_from([0, 7, 300, -30]),
    rows=st.integers(1, 40),
    unanswered=st.sets(st.integers(1, 60), max_size=5),
)
@quick
def test_each_odometry_has_the_newest_set_point_before_it(
    apart, first, lost, ahead, rows, unanswered
) -> None:
    stamps = (1000 + np.cumsum(apart)).tolist()
    grid = range(stamps[0] + first, stamps[-1] + 200, GRID)
    setpoints = [ms for i, ms in enumerate(grid) if i not in lost]
    answered = [ms for k, ms in enumerate(stamps) if k not in unanswered]
    expected = held_by_hand(answered, setpoints)
    with tempfile.TemporaryDirectory() as folder:
        path = write(Path(folder), stamps, setpoints, ahead=ahead, unanswered=unanswered)
        if not setpoints:
            expected = dict.fromkeys(answered, np.nan)
        if len(expected) < 2:
            with pytest.raises(InputError, match='at least two steps'):
                load_run(path)
            return
        run = load_run(path)
        found = joined([*open_bag(path, whole=1).run.blocks(rows)])
    assert_array_equal(run.nu_d[:, 0], [*expected.values()])
    assert_array_equal(run.t, (np.array([*expected]) - next(iter(expected))) / 1000)
    assert_array_equal(run.tau[:, 0], [stamps.index(ms) for ms in expected])
    assert found.notes == run.notes
    for name, values in run.arrays().items():
        assert_array_equal(found.arrays()[name], values, err_msg=name)


def test_what_is_missing_at_the_start_is_said(tmp_path: Path) -> None:
    run = load_run(write(tmp_path, [1000, 1021, 1039, 1060], [1020, 1040, 1060]))
    assert len(run.t) == 3
    assert run.notes == (
        'odom: 1 of 4 messages are not complete on all topics',
        'wrench: 1 of 4 messages are not complete on all topics',
    )


def test_without_a_set_point_there_is_no_error_of_it(tmp_path: Path) -> None:
    run = load_run(write(tmp_path, [1000, 1020, 1040, 1060], [], params=GVC))
    assert np.isnan(run.nu_d_dot).all()
    found = summarize(run)
    assert found['settling'] is None
    assert not any(found['velocity_error'].values())
    assert found['lyapunov']['share_bound_28'] is None
    assert 'the set-point were recorded' in found['lyapunov']['reason']


def test_damage_before_the_first_odometry_is_said(tmp_path: Path) -> None:
    bag = write(tmp_path, [1000, 1020, 1040], [])
    data = bag.read_bytes()
    at = data.index(b'zstd') + 20
    bag.write_bytes(data[:at] + b'\xff' + data[at + 1 :])
    with pytest.raises(InputError, match=r'odom: .*found bag.mcap: damaged from .*recover'):
        load_run(bag)
    kinds = dict.fromkeys(['/odom', '/a/wrench'], '')
    lost = BagContents(types=kinds, notes=['bag.mcap: damaged from byte 9, read up to there'])
    assert '/a/wrench: expected messages, found bag.mcap: dam' in str(_without('wrench', lost, bag))
    for role, contents in (('cmd_vel', lost), ('wrench', BagContents(types=kinds))):
        assert isinstance(_without(role, contents, bag), NotOursError)


def test_one_step_is_no_run(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r'at least two steps .*, found 1$'):
        load_run(write(tmp_path, [1000], []))


def test_a_pause_is_a_gap_in_lock_step_too(tmp_path: Path) -> None:
    stamps = [1000, 1020, 1041, 1060, 1080, 61080, 61100, 61121, 61140]
    run = load_run(write(tmp_path, stamps, SETPOINTS, params=STEPS))
    assert run.gaps == ((0.08, 60.08),)
    assert run.valid_share == pytest.approx(9 * 0.02 / 60.16)
    assert run.notes == ('no samples in 1 gap, 60 s together',)
    strict = write(tmp_path / 'strict', stamps, stamps, recording=recording_text(True, {}))
    assert load_run(strict).gaps == run.gaps
    assert load_run(write(tmp_path / 'unknown', stamps, stamps, recording='')).gaps == run.gaps


def begun_anew(folder: Path, old: int, new: int, wrenches: int, *, told: bool = True) -> Path:
    """Two motions of one time, of so many steps; the second one has set-points and wrenches."""
    bag = Bag(folder / 'bag.mcap', chunk_size=2000)
    bag.attach('vehicle.yaml', VEHICLE)
    if told:
        bag.attach(RECORDING, recording_text(False, {}))
    for first, count in ((0, old), (100, new)):
        for k in range(count):
            ns = (1000 + 10 * k) * MS
            bag.add('/odom', ODOMETRY, ns, serialized(odometry(ns, state(first + k))))
            if first or k < wrenches:
                made = stamped('Wrench', ns, [float(first + k)] * 6)
                bag.add('/wrench', made.__msgtype__, ns, serialized(made))
    return bag.close()


@pytest.mark.parametrize(
    ('old', 'new', 'first', 'told'),
    [(200, 150, 0, True), (150, 200, 100, True), (150, 200, 100, False)],
)
def test_of_a_clock_that_begins_anew_the_longest_stretch_is_read(
    tmp_path: Path, old: int, new: int, first: int, told: bool
) -> None:
    path = begun_anew(tmp_path, old, new, old, told=told)
    run, mapped = load_run(path), open_bag(path, whole=1).run
    assert run.samples == 200
    for one in (run, joined([*mapped.blocks(50)])):
        assert_array_equal(one.eta[:, 0], first + np.arange(200.0))
        assert_array_equal(one.tau[:, 0], first + np.arange(200.0))
    assert run.notes == (
        'odom: the clock jumps back 1 times; read the longest of 2 stretches, left 150 messages',
    )


def test_parts_that_only_stand_in_another_order_are_no_clock_that_begins_anew(tmp_path) -> None:
    numbers = [*range(100), *range(200, 300), *range(100, 200), *range(300, 400)]
    path = write(tmp_path, [1000 + GRID * k for k in range(400)], [])
    bag = Bag(tmp_path / 'swapped.mcap', chunk_size=2000)
    bag.attach('vehicle.yaml', VEHICLE)
    bag.attach(RECORDING, recording_text(False, {}))
    for k in numbers:
        ns = (1000 + GRID * k) * MS
        made = stamped('Wrench', ns, [float(k)] * 6)
        bag.add('/odom', ODOMETRY, ns, serialized(odometry(ns, state(k))))
        bag.add('/wrench', made.__msgtype__, ns, serialized(made))
    plain, swapped = load_run(path), bag.close()
    for one in (load_run(swapped), joined([*open_bag(swapped, whole=1).run.blocks(90)])):
        assert (one.notes, one.gaps) == ((), ())
        for name, values in plain.arrays().items():
            assert_array_equal(one.arrays()[name], values, err_msg=name)


@pytest.mark.parametrize('ms', [0, 10**9])
def test_an_odometry_of_another_time_is_left_out_and_counted(tmp_path: Path, ms: int) -> None:
    bag = Bag(tmp_path / 'bag.mcap', chunk_size=2000)
    bag.attach('vehicle.yaml', VEHICLE)
    bag.attach(RECORDING, recording_text(False, {}))
    for k in range(100):
        ns = (1000 + GRID * k) * MS
        made = stamped('Wrench', ns, [float(k)] * 6)
        bag.add('/odom', ODOMETRY, ns, serialized(odometry(ms * MS if k == 50 else ns, state(k))))
        bag.add('/wrench', made.__msgtype__, ns, serialized(made))
    path = bag.close()
    run, mapped = load_run(path), open_bag(path, whole=1).run
    for one in (run, joined([*mapped.blocks(30)])):
        assert_array_equal(one.eta[:, 0], [k for k in range(100) if k != 50])
    assert run.notes == (
        'odom: 1 of 100 messages were left out: their stamps are far off those around them',
        'wrench: 1 of 100 messages are not complete on all topics',
    )


def test_a_clock_that_was_set_back_by_less_than_a_second_has_begun_anew(tmp_path: Path) -> None:
    """Sorted by their stamps, two motions would lie between each other."""
    ms = [*range(1000, 4000, GRID), *range(3507, 5000, GRID)]
    bag = Bag(tmp_path / 'bag.mcap', chunk_size=2000)
    bag.attach('vehicle.yaml', VEHICLE)
    bag.attach(RECORDING, recording_text(False, {}))
    for k, stamp in enumerate(ms):
        made = stamped('Wrench', stamp * MS, [float(k)] * 6)
        bag.add('/odom', ODOMETRY, k * MS, serialized(odometry(stamp * MS, state(k))))
        bag.add('/wrench', made.__msgtype__, k * MS, serialized(made))
    run = load_run(bag.close())
    assert_array_equal(run.tau[:, 0], np.arange(150.0))
    assert run.notes == (
        'odom: the clock jumps back 1 times; read the longest of 2 stretches, left 75 messages',
    )


@pytest.mark.parametrize(('order', 'edges'), [
    ([*range(60), *range(30, 100)], [0, 60, 130]),
    ([*range(20), *range(40, 60), *range(20, 40), *range(60, 100)], [0, 100]),  # they came late
    ([*range(0, 60, 20), *range(30, 60)], [0, 33]), ([*range(40), 10, *range(40, 60)], [0, 61]),
    ([5, 5, 5], [0, 3]), ([3, 2, 1], [0, 3]), ([], [0, 0]),
])  # fmt: skip
def test_where_a_clock_begins_anew(order: list[int], edges: list[int]) -> None:
    assert stretches(np.array(order, np.int64) * 10 * MS) == edges


def test_a_topic_with_another_clock_is_said(tmp_path: Path) -> None:
    run = load_run(begun_anew(tmp_path, 200, 150, 0))
    assert 'wrench: its clock jumps back 0 times: what it says may be of another time' in run.notes


def test_a_controller_that_pairs_exactly_has_its_own_stamps(tmp_path: Path) -> None:
    path = write(tmp_path, [1000, 1020, 1041, 1060], [1000, 1020, 1040, 1060], params=EXACT)
    assert_array_equal(load_run(path).t, [0.0, 0.02, 0.06])


@pytest.mark.parametrize(('told', 'kept'), [
    ('lockstep: false, setpoint_timeout: 0.05', 6), ('lockstep: true, setpoint_timeout: 0.05', 10),
    ('lockstep: false', 10), ('setpoint_timeout: lots', 10),
])  # fmt: skip
def test_a_set_point_holds_no_longer_than_the_controller_holds_it(tmp_path, told, kept) -> None:
    stamps, last = range(1000, 1200, GRID), [1000, 1020, 1040, 1060]
    params = f'/**/controller_node:\n  ros__parameters: {{setpoint_pairing: latest, {told}}}\n'
    run = load_run(write(tmp_path, stamps, last, params=params, ahead=0))
    assert run.samples == kept
    text = 'cmd_vel: older than 0.05 s, the timeout of the controller, at 4 of 10 odometry messages'
    assert any(text in note for note in run.notes) == (kept == 6)


@pytest.mark.parametrize(('stamps', 'kept'), [
    ([0, 1, 2, 3], [0, 1, 2, 3]), ([0, 10, 20, 30, 5, 15], [0, 4, 5]), ([0, 10, 10], [0, 1]),
    ([0, 20, 40, 10, 30, 15], [0, 3, 5]), ([100_000, 0, 100_010, 0], [0, 1, 2, 3]), ([], []),
])  # fmt: skip
def test_a_set_point_takes_the_place_of_those_that_lie_ahead_of_it(stamps, kept) -> None:
    ns, rows = np.array(stamps, np.int64) * 1000 * MS, np.arange(6.0 * len(stamps)).reshape(-1, 6)
    found = obeyed({'odom': (ns, rows), 'cmd_vel': (ns, rows)})
    assert_array_equal(found['cmd_vel'][0], ns[kept])
    assert_array_equal(found['cmd_vel'][1], rows[kept])
    assert found['odom'][0] is ns


@pytest.mark.parametrize('params', ['lockstep: true', 'lockstep: false'])
def test_a_set_point_that_repeats_a_stamp_was_refused(tmp_path, params) -> None:
    stamps, given = range(1000, 1060, GRID), [1000, 1000, 1020, 1040, 1040]
    told = f'/**/controller_node:\n  ros__parameters: {{setpoint_pairing: latest, {params}}}\n'
    run = load_run(write(tmp_path, stamps, given, params=told))
    assert_array_equal(run.nu_d[:, 0], [0, 2, 3])


@pytest.mark.parametrize('lockstep', ['false', 'true'])
def test_what_another_publisher_left_ahead_was_not_followed(tmp_path, lockstep) -> None:
    stamps, given = range(1000, 1200, GRID), [*range(1000, 1200, GRID), 1090, 1190]
    params = '/**/controller_node:\n  ros__parameters: {setpoint_pairing: latest, '
    params += f'lockstep: {lockstep}}}\n'
    run = load_run(write(tmp_path, stamps, given, params=params, as_given=True))
    later = [10] * 5 if lockstep == 'false' else range(5, 10)
    assert_array_equal(run.nu_d[:, 0], [*range(5), *later])


def test_a_single_set_point_of_another_operator_is_no_stray(tmp_path) -> None:
    """Amid a plan that lies more than a second ahead of it, whose place it takes."""
    stamps, given = range(1000, 1400, GRID), [*range(1000, 1400, GRID), 3000, 3020, 1090, 3040]
    params = '/**/controller_node:\n  ros__parameters: {setpoint_pairing: latest, '
    params += 'lockstep: false}\n'
    run = load_run(write(tmp_path, stamps, given, params=params, as_given=True))
    assert_array_equal(run.nu_d[:, 0], [*range(5), *[22] * 15])


def test_set_points_that_were_always_too_old_are_none(tmp_path: Path) -> None:
    told = 'setpoint_pairing: latest, setpoint_timeout: 0.05'
    params = f'/**/controller_node:\n  ros__parameters: {{{told}}}\n'
    run = load_run(write(tmp_path, range(1000, 1200, GRID), [0], params=params, ahead=0))
    assert (run.samples, run.knows_setpoint) == (10, False)
    assert any('at 10 of 10 odometry messages' in note for note in run.notes)


def test_of_an_unknown_recorder_set_points_with_stamps_of_their_own_are_held(
    tmp_path: Path,
) -> None:
    own = load_run(write(tmp_path / 'own', STAMPS, SETPOINTS, recording=''))
    assert_array_equal(own.nu_d[:, 0], [1.0, 2.0, 2.0, 4.0])
    held = 'cmd_vel: taken as held until the next one, since {} odometry messages have none of'
    assert any(held.format('2 of 4') in note for note in own.notes)
    often, seldom = list(range(1000, 1110, 10)), [1000, 1030, 1060, 1090]
    sparse = load_run(write(tmp_path / 'sparse', often, seldom, recording=''))
    assert_array_equal(sparse.nu_d[:, 0], [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3])
    assert any(held.format('6 of 10') in note for note in sparse.notes)
    four, three = [1000, 1020, 1040, 1060], [1000, 1020, 1060]
    quarter = load_run(write(tmp_path / 'quarter', four, three, recording=''))
    assert_array_equal(quarter.nu_d[:, 0], [0.0, 1.0, 2.0])
    same = load_run(write(tmp_path / 'same', STAMPS, STAMPS[:3], recording=''))
    assert_array_equal(same.nu_d[:, 0], [0.0, 1.0, 2.0])
    assert not any('taken as held' in note for note in same.notes)
    another = write(tmp_path / 'another', STAMPS, [10, 20, 30], ahead=0, recording='')
    with pytest.raises(InputError, match='at least two steps'):
        load_run(another)


NAMES = {'odom': '/rov/nav/odometry', 'wrench': '/rov/thrust'}
OURS = {'/rov/nav/odometry': '/odom', '/rov/thrust': '/wrench'}
STAMPS, SETPOINTS = [1000, 1021, 1039, 1060], [980, 1000, 1020, 1040, 1060]


def test_remapped_topics_are_found_and_counted_by_their_own_names(tmp_path: Path) -> None:
    plain = load_run(write(tmp_path / 'plain', STAMPS, SETPOINTS))
    text = recording_text(False, OURS)
    path = write(tmp_path / 'other', STAMPS, SETPOINTS, NAMES, recording=text)
    found = load_run(path)
    for name, values in plain.arrays().items():
        assert_array_equal(found.arrays()[name], values, err_msg=name)
    assert read_bag(path).counts == {'/cmd_vel': 5, '/rov/nav/odometry': 4, '/rov/thrust': 4}
    assert isinstance(found, Run)


def test_without_the_note_they_are_not_guessed(tmp_path: Path) -> None:
    path = write(tmp_path, STAMPS, SETPOINTS, NAMES)
    found = '/cmd_vel, /rov/nav/odometry, /rov/thrust'
    with pytest.raises(InputError, match=f'odom: expected messages, found {found}$'):
        load_run(path)


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('topics: 3', 'topics: expected a mapping of topics to names, found 3'),
        ('topics: {/a: [1]}', 'topics: expected a mapping of topics to names'),
        ('topics: {/a: /odom, /b: /odom}', 'topics: expected each name once'),
        ('namespace: 3', 'namespace: expected the name of a namespace, found 3'),
    ],
)
def test_a_note_that_is_none_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = write(tmp_path, STAMPS, SETPOINTS, recording=text)
    with pytest.raises(InputError, match=f'{RECORDING}: {said}'):
        load_run(path)


def test_steps_that_are_not_of_one_length_are_no_gaps() -> None:
    ledger = StepLedger(['odom'], 20 * MS, strict=False)
    for ms in (0, 15, 40, 55, 80, 100):
        ledger.add('odom', ms * MS)
    assert ledger.gaps == {'odom': 0}
    assert ledger.complete == 5
    ledger.add('odom', 165 * MS)
    assert ledger.gaps == {'odom': 2}


def with_unusable_messages(path: Path, *, strict: bool) -> Path:
    """Sixty steps: odometry in another frame, of NaN and cut, a wrench of inf and an absurd one."""
    wrong = {40: np.inf, 50: 1e200}
    bag = Bag(path, chunk_size=100_000)
    bag.attach('vehicle.yaml', VEHICLE)
    bag.attach(RECORDING, recording_text(strict, {}))
    for k in range(60):
        ns, values = k * 10 * MS, state(k)
        values[7] = np.nan if k == 20 else 1.0
        made = odometry(ns, values, ('elsewhere', FRAMES[1]) if k == 30 else FRAMES)
        data = serialized(made)
        bag.add('/odom', ODOMETRY, ns, data[: len(data) // 2] if k == 0 else data)
        for topic, kind in (('/wrench', 'Wrench'), ('/cmd_vel', 'Twist')):
            made = stamped(kind, ns, [wrong.get(k, k) if kind == 'Wrench' else float(k)] * 6)
            bag.add(topic, made.__msgtype__, ns, serialized(made))
    return bag.close()


def test_messages_that_nobody_could_use_are_left_out_and_counted(tmp_path: Path) -> None:
    """As the controller did that heard them."""
    bag = with_unusable_messages(tmp_path / 'bag.mcap', strict=False)
    run = load_run(bag)
    kept = [k for k in range(60) if k not in (0, 20, 30, 40, 50)]
    assert_array_equal(run.tau[:, 0], np.array(kept, float))
    notes = ' '.join(run.notes)
    assert 'bag.mcap: /odom: 3 unusable messages left out, the first one: ' in notes
    assert 'bag.mcap: /wrench: 2 unusable messages left out, the first one: ' in notes
    assert 'elsewhere' not in notes, 'the third one'
    assert_array_equal(joined([*open_bag(bag, whole=16).run.blocks(7)]).tau, run.tau)


@pytest.mark.parametrize('channels', [('/odom', '/ground_truth/odom'), ('/ground_truth/odom',)])
def test_the_first_odometry_says_which_frames_hold(tmp_path: Path, channels: tuple) -> None:
    """In whatever order the topics were registered."""
    bag = Bag(tmp_path / 'bag.mcap')
    bag.attach(RECORDING, recording_text(False, {}))
    for topic in channels:
        bag.channel(topic, ODOMETRY)
    for k in range(3):
        for topic, frames in (('/odom', FRAMES), ('/ground_truth/odom', ('other', FRAMES[1]))):
            data = serialized(odometry(k * MS, state(k), frames))
            bag.add(topic, ODOMETRY, k * MS, data)
    contents = read_bag(bag.close())
    assert contents.frames['/'].odom == FRAMES[0]
    assert {topic: len(ns) for topic, (ns, _) in contents.messages.items()} == {'/odom': 3}


def test_in_lock_step_they_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match='/odom: expected messages of its type, found'):
        load_run(with_unusable_messages(tmp_path / 'bag.mcap', strict=True))


def test_without_accelerations_they_are_the_slopes_of_the_set_points(tmp_path: Path) -> None:
    stamps = range(1000, 1200, GRID)
    run = load_run(write(tmp_path, stamps, stamps, ahead=0))  # one more m/s in each 20 ms
    assert_allclose(run.nu_d_dot, 50.0)
    many = np.arange(70_000.0)[:, None] ** 2 * np.ones(6)  # in blocks: their seams do not show
    slopes = np.concatenate(list(_slopes(many, 2 * SECOND * np.arange(70_000))))
    assert_allclose(slopes[1:-1, 0], np.arange(1.0, 69_999.0))
    (uneven,) = _slopes(many[[0, 1, 3, 4, 6]], np.array([0, 1, 3, 4, 6]) * SECOND)
    assert_allclose(uneven[1:-1, 0], [2.0, 6.0, 8.0])


def test_of_two_messages_of_a_stamp_the_first_counts(tmp_path: Path) -> None:
    bag = Bag(tmp_path / 'bag.mcap')
    bag.attach('vehicle.yaml', VEHICLE)
    bag.attach(RECORDING, recording_text(False, {}))
    for k in range(10):
        wrench = stamped('Wrench', k * GRID * MS, [1.0] * 6)
        for other in (0, 100):
            moved = odometry(k * GRID * MS, state(k + other))
            bag.add('/odom', ODOMETRY, k * GRID * MS, serialized(moved))
        bag.add('/wrench', wrench.__msgtype__, k * GRID * MS, serialized(wrench))
    run = load_run(bag.close())
    assert_array_equal(run.eta[:, 0], np.arange(10.0))
    assert run.notes == ('odom: 10 stamps came again, the first of each is kept',)


@pytest.mark.parametrize('stranger', ['/dvl/odom', '/nav/cmd_vel'])
def test_what_is_wrong_beside_a_complete_vehicle_does_not_matter(
    tmp_path: Path, stranger: str
) -> None:
    """But to a recorder that says it is its vehicle."""

    def bag(name: str, namespace: str = '') -> Path:
        made = Bag(tmp_path / f'{name}.mcap')
        made.attach('vehicle.yaml', VEHICLE)
        if namespace:
            made.attach(RECORDING, recording_text(True, {}, namespace))
        for k in range(5):
            ns = k * GRID * MS
            still = odometry(ns, np.zeros(13), ('odom', 'base_link'))
            odd = still if stranger == '/dvl/odom' else new('std_msgs/msg/String', 'x')
            wrench = stamped('Wrench', ns, [float(k)] * 6)
            made.add(stranger, odd.__msgtype__, ns, serialized(odd))
            made.add('/odom', ODOMETRY, ns, serialized(odometry(ns, state(k))))
            made.add('/wrench', wrench.__msgtype__, ns, serialized(wrench))
        return made.close()

    run = load_run(bag('untold'))
    assert_array_equal(run.eta[:, 0], np.arange(5.0))
    assert f'read the vehicle in / alone: {tmp_path}/untold.mcap: {stranger}: exp' in run.notes[-1]
    for path, namespace in ((bag('told', stranger.rpartition('/')[0]), None), (bag('asked'), '/x')):
        with pytest.raises(InputError):
            load_run(path, namespace=namespace)


def test_the_namespace_of_the_recorder_is_the_one_that_is_read(tmp_path: Path, capsys) -> None:
    """Two vehicles in a bag; without a word of the recorder nobody chooses one."""

    def bag(namespace: str | None) -> Path:
        path = tmp_path / f'{namespace}'.replace('/', '_')
        path.mkdir()
        made = Bag(path / 'bag.mcap')
        made.attach('vehicle.yaml', VEHICLE)
        if namespace is not None:
            made.attach(RECORDING, recording_text(False, {}, namespace))
        for ms, (k, space) in product(range(0, 50, 10), enumerate(('/auv1', '/auv2', '/auv3'))):
            odom = serialized(odometry(ms * MS, state(k)))
            made.add(f'{space}/odom', ODOMETRY, ms * MS, odom)
            if k < 2:
                wrench = stamped('Wrench', ms * MS, [float(k)] * 6)
                made.add(f'{space}/wrench', wrench.__msgtype__, ms * MS, serialized(wrench))
        return made.close()

    told, untold = bag('/auv2'), bag(None)
    assert load_run(told).tau[0, 0] == 1.0
    assert joined(list(open_bag(told, whole=2).run.blocks())).tau[0, 0] == 1.0
    assert load_run(told, namespace='auv1').tau[0, 0] == 0.0
    assert load_run(untold, namespace='/auv2').tau[0, 0] == 1.0
    main(['analyze', str(told), '--namespace', '/auv1', '--json', '--no-report',
          '--out', str(tmp_path / 'out')])  # fmt: skip
    (summary,) = json.loads(capsys.readouterr().out).values()
    assert summary['effort']['rms'] == [0.0] * 6
    (asked,) = sources_of([str(told)], namespace='/auv1')
    assert open_source(asked).run.tau[0, 0] == 0.0
    with pytest.raises(InputError, match=r'/auv1, /auv2$'):
        load_run(untold)
    for path, space in ((bag('/'), None), (told, '/auv4')):
        with pytest.raises(InputError, match=r'namespace /.*--namespace.*/auv1, /auv2, /auv3'):
            open_bag(path, namespace=space)


def test_parameters_are_of_the_vehicle_that_is_read(tmp_path: Path) -> None:
    """A file for two vehicles, and a bag of both whose recorder was that of the first."""
    pid = '/auv2/controller_node:\n  ros__parameters: {law: pid, gains.k_P: [40.0], '
    pid += 'gains.k_I: [2.0], gains.k_D: [0.5]}\n'

    def bag(name: str, params: str) -> Path:
        made = Bag(tmp_path / f'{name}.mcap')
        texts = {'vehicle.yaml': VEHICLE, 'params.yaml': params, 'scenario.yaml': 'name: first\n'}
        texts[RECORDING] = recording_text(False, {}, '/auv1')
        for file, text in texts.items():
            made.attach(file, text)
        for ms, space in product(range(0, 50, 10), ('/auv1', '/auv2')):
            odom, wrench = odometry(ms * MS, state(1)), stamped('Wrench', ms * MS, [1.0] * 6)
            made.add(f'{space}/odom', ODOMETRY, ms * MS, serialized(odom))
            made.add(f'{space}/wrench', wrench.__msgtype__, ms * MS, serialized(wrench))
        return made.close()

    both = bag('both', GVC.replace('**', 'auv1') + pid)
    turned = bag('turned', pid + GVC.replace('**', 'auv1'))
    recorders = bag('recorders', GVC + STEPS)
    for path in (both, turned, bag('any', pid + GVC), bag('any_turned', GVC + pid), recorders):
        run = load_run(path)
        assert (run.law, run.scenario) == ('gvc', 'first')
        assert not run.notes
    for path in (both, turned):
        assert load_run(path, namespace='auv2').gains == {'k_P': 40.0, 'k_I': 2.0, 'k_D': 0.5}
    other = load_run(recorders, namespace='/auv2')
    assert (other.law, other.gains, other.step) == ('unknown', {}, 0.01)
    assert other.scenario == tmp_path.name
    said = 'vehicle.yaml is of the vehicle in /auv1, whose recorder this was: --vehicle FILE names'
    assert other.notes == (f'{said} that of /auv2',)
    assert not load_run(recorders, 'rexrov', '/auv2').notes
    assert load_run(recorders, namespace='/auv1/').law == 'gvc'
