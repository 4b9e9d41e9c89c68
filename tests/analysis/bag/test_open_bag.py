"""A bag in mapped files is the run that reading it into memory gives, whatever its messages."""

import json
import mmap
import tempfile
import tracemalloc
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.block_runs import joined
from helpers.made_messages import ODOMETRY, Bag, health, odometry, serialized, stamped
from helpers.strategies import examples
from hypothesis import given
from hypothesis import strategies as st
from made_bags import make_bag
from numpy.testing import assert_allclose

from auv_analysis import load_scenario, summarize
from auv_analysis.bag import load
from auv_analysis.bag.load import load_run, open_bag
from auv_analysis.bag.reading import slices
from auv_analysis.report.digest import digest
from auv_analysis.runs.run import Run
from auv_dynamics.files.errors import FailedError, InputError

STEP = 10_000_000
GAINS = ('k_D', 'k_I', 'Lambda', 'Gamma')
ROLES = {
    'odom': '', 'wrench': 'Wrench', 'cmd_vel': 'Twist', 'cmd_accel': 'Accel',
    'disturbance': 'Wrench', 'wrench_applied': 'Wrench', 'ground_truth/odom': '',
}  # fmt: skip
VEHICLE = load_scenario('case1').attachments['vehicle.yaml']
quick = examples(15)


def turning(k: int) -> np.ndarray:
    """State number k of a vehicle that yaws on and on."""
    psi = 0.7 * k
    return np.array([k, -k, 0.5 * k, np.cos(psi / 2), 0, 0, np.sin(psi / 2), *range(6)], float)


@st.composite
def recordings(draw: st.DrawFn) -> Any:
    """A function that writes a bag with steps lost, doubled and late."""
    n, space = draw(st.integers(0, 30)), draw(st.sampled_from(['/', '/a/']))
    others = [role for role in ROLES if role not in ('odom', 'wrench')]
    roles = ['odom', 'wrench', *draw(st.lists(st.sampled_from(others), unique=True))]
    ahead = draw(st.sampled_from([0, 5, 100]))
    stamps = np.cumsum(draw(st.lists(st.sampled_from([1, 1, 1, 2, 7]), min_size=n, max_size=n)))
    plan = [(k - ahead * (role == 'cmd_vel'), role, k) for k in range(n) for role in roles]
    plan = [(when, role, k) for when, role, k in sorted(plan)]
    for i in sorted(draw(st.sets(st.integers(0, 300), max_size=3)), reverse=True):
        del plan[i : i + 1]
    for i in draw(st.lists(st.integers(0, 300), max_size=2)):
        plan[i:i] = plan[i : i + 1]  # the same message twice
    if draw(st.booleans()) and len(plan) > 8:
        i, j = draw(st.integers(0, len(plan) - 1)), draw(st.integers(0, len(plan) - 1))
        plan[i], plan[j] = plan[j], plan[i]
    size = draw(st.sampled_from([1, 2000, 100_000]))

    def write(folder: Path) -> Path:
        bag = Bag(folder / 'bag.mcap', chunk_size=size)
        bag.attach('vehicle.yaml', VEHICLE)
        for role in roles:
            kind = f'geometry_msgs/msg/{ROLES[role]}Stamped' if ROLES[role] else ODOMETRY
            bag.channel(f'{space}{role}', kind)
        for _, role, k in plan:
            ns = int(stamps[k]) * STEP
            made = stamped(ROLES[role], ns, np.arange(6.0) * k) if ROLES[role] else None
            made = made or odometry(ns, turning(k))
            bag.add(f'{space}{role}', made.__msgtype__, ns, serialized(made))
        return bag.close()

    return write


def outcome(reader: Any, *arguments: Any, **options: Any) -> Any:
    try:
        return reader(*arguments, **options)
    except InputError as error:
        return str(error)


def assert_same(found: Run, expected: Run) -> None:
    assert found.notes == expected.notes
    assert found.step == expected.step
    assert found.arrays().keys() == expected.arrays().keys()
    for name, values in expected.arrays().items():
        if name == 'eta':  # psi is unwrapped from block to block
            np.testing.assert_allclose(found.eta, values, rtol=0, atol=1e-9)
        else:
            np.testing.assert_array_equal(found.arrays()[name], values)


@given(recordings(), st.integers(1, 40), st.integers(0, 12))
@quick
def test_blocks_of_a_bag(write: Any, rows: int, whole: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = write(Path(folder))
        expected = outcome(load_run, path)
        if isinstance(expected, str):
            assert outcome(open_bag, path, whole=whole) == expected
            return
        run, attachments = open_bag(path, whole=whole)
        assert attachments == {'vehicle.yaml': VEHICLE}
        assert run.extent == expected.extent
        blocks = [*run.blocks(rows)]
        assert [len(block.t) for block in blocks[:-1]] == [rows] * (len(blocks) - 1)
        assert_same(joined(blocks), expected)


def test_each_topic_is_a_part_of_the_run_and_attachments_name_it(tmp_path) -> None:
    bag, rows = Bag(tmp_path / 'dive' / 'bag.mcap'), {}
    bag.attach('vehicle.yaml', VEHICLE)
    for i, (role, name) in enumerate((ROLES | {'disturbance_estimate': 'Wrench'}).items()):
        rows[role] = np.arange(24.0).reshape(4, 6) + 100.0 * i
        for k, row in enumerate(rows[role]):
            x, *pose = turning(k)[:7]
            state = [x + 1e3 * i, *pose, *row]
            made = stamped(name, k * STEP, row) if name else odometry(k * STEP, state)
            bag.add(f'/{role}', made.__msgtype__, k * STEP, serialized(made))
    parameters = 'recorder_node: {ros__parameters: {bag: runs/dive/cl}}\n'
    bag.attach('params.yaml', parameters)
    run = open_bag(bag.close(), vehicle='rexrov').run
    parts = {
        'measured': 'odom', 'tau': 'wrench', 'nu_d': 'cmd_vel', 'nu_d_dot': 'cmd_accel',
        'disturbance': 'disturbance', 'applied': 'wrench_applied', 'nu': 'ground_truth/odom',
        'disturbance_estimate': 'disturbance_estimate',
    }  # fmt: skip
    for part, role in parts.items():
        np.testing.assert_array_equal(getattr(run, part), rows[role], err_msg=part)
    np.testing.assert_array_equal(run.eta[:, 0], 6e3 + np.arange(4))
    assert (run.scenario, run.controller, run.vehicle.name) == ('dive', 'cl', 'rexrov')


def test_without_f_nothing_is_said_of_its_error(tmp_path) -> None:
    bag = Bag(tmp_path / 'bag.mcap')
    bag.attach('vehicle.yaml', VEHICLE)
    roles = {'odom': '', 'wrench': 'Wrench', 'disturbance': 'Wrench'}
    for k, (role, name) in product(range(4), roles.items()):
        made = stamped(name, k * STEP, [5.0] * 6) if name else odometry(k * STEP, turning(k))
        bag.add(f'/{role}', made.__msgtype__, k * STEP, serialized(made))
    run = load_run(bag.close(), vehicle='rexrov')
    assert np.isnan(run.disturbance_estimate).all()
    np.testing.assert_array_equal(run.disturbance, np.full((4, 6), 5.0))
    assert not run.knows_disturbance
    assert summarize(run)['lumped_error'] == {'rms': None, 'max_after_2s': None}
    assert run.notes == ('disturbance_estimate: no messages: f and its error are unknown',)
    assert not digest(run).estimates


def test_a_law_that_was_changed_while_it_was_recorded_is_not_that_of_its_file(tmp_path) -> None:
    bag = Bag(tmp_path / 'bag.mcap')
    bag.attach('vehicle.yaml', VEHICLE)
    gains = 'gains.k_D: [1.0], gains.k_I: [1.0], gains.Lambda: [1.0], gains.Gamma: [1.0]'
    bag.attach('params.yaml', f'controller_node: {{ros__parameters: {{law: gvc, {gains}}}}}')
    for k in range(9):
        for made in (odometry(k * STEP, turning(k)), stamped('Wrench', k * STEP, np.ones(6))):
            topic = '/odom' if made.__msgtype__ == ODOMETRY else '/wrench'
            bag.add(topic, made.__msgtype__, k * STEP, serialized(made))
        for name, law in (('/other/controller_node', 'pid'),
                          ('/controller_node', 'gvc' if k < 5 else 'cl')):  # fmt: skip
            facts = {'law': law, 'gains': json.dumps({name: [1.0] for name in GAINS})}
            said = health(name, k * STEP, facts)
            bag.add('/diagnostics', said.__msgtype__, k * STEP, serialized(said))
    run = load_run(bag.close())
    assert (run.law, run.gains) == ('unknown', {})
    assert [note for note in run.notes if 'gvc from 0 s, cl from 0.05 s' in note]
    assert summarize(run)['gains'] == {'K_D': None, 'K_f': None}


@pytest.mark.parametrize(('names', 'law'), [
    (['steersman', 'steersman'], 'gvc'), (['steersman', 'shadow'], 'gvc'),
    (['shadow', 'controller_node'], 'cl'), (['controller_node', 'shadow'], 'gvc'),
])  # fmt: skip
def test_a_controller_of_another_name_says_its_law_as_well(tmp_path, names, law) -> None:
    bag = Bag(tmp_path / 'bag.mcap')
    bag.attach('vehicle.yaml', VEHICLE)
    for k in range(9):
        for made in (odometry(k * STEP, turning(k)), stamped('Wrench', k * STEP, np.ones(6))):
            topic = '/odom' if made.__msgtype__ == ODOMETRY else '/wrench'
            bag.add(topic, made.__msgtype__, k * STEP, serialized(made))
        for name, said in zip(names, ('gvc', 'gvc' if names[0] == names[1] else 'cl'), strict=True):
            facts = {'law': said, 'gains': json.dumps({gain: [1.0] for gain in GAINS})}
            told = health(f'/{name}', k * STEP, facts)
            bag.add('/diagnostics', told.__msgtype__, k * STEP, serialized(told))
    assert load_run(bag.close()).law == law


def test_a_step_that_nobody_says_is_the_usual_one(tmp_path) -> None:
    bag = Bag(tmp_path / 'bag.mcap')
    bag.attach('vehicle.yaml', VEHICLE)
    for k in (0, 1, 2, 3, 50):
        for made in (odometry(k * STEP, turning(k)), stamped('Wrench', k * STEP, np.ones(6))):
            topic = '/odom' if made.__msgtype__ == ODOMETRY else '/wrench'
            bag.add(topic, made.__msgtype__, k * STEP, serialized(made))
    assert load_run(bag.close()).step == pytest.approx(STEP / 1e9)


def mapped(run: Run) -> set[str]:
    """Names of the arrays that lie in files."""
    return {name for name, values in run.arrays().items() if isinstance(root(values), mmap.mmap)}


def root(values: Any) -> Any:
    while getattr(values, 'base', None) is not None:
        values = values.base
    return values


def test_a_short_bag_is_kept_in_memory_and_a_long_one_in_files(tmp_path) -> None:
    bag = make_bag(tmp_path / 'bag', 100)
    assert not mapped(open_bag(bag).run)
    assert not mapped(open_bag(bag, whole=101).run)
    long = open_bag(bag, whole=100).run
    assert {'t', 'eta', 'nu', 'nu_d', 'nu_d_dot', 'tau'} <= mapped(long)
    assert not mapped(long.part(slice(0, 10))), 'a copy, so that its pages can go again'


def test_no_room_for_the_files_of_a_long_bag(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(tempfile, 'tempdir', '/dev/full')
    with pytest.raises(FailedError, match='/dev/full: '):
        open_bag(make_bag(tmp_path / 'bag', 100), whole=10)


def test_summaries_do_not_depend_on_how_a_bag_is_read(tmp_path) -> None:
    bag = make_bag(tmp_path / 'bag', 300, 'case1_rexrov')
    assert summarize(open_bag(bag, whole=10).run) == summarize(load_run(bag))


def test_a_bag_with_bad_messages_is_refused_when_it_is_opened(tmp_path) -> None:
    bag = Bag(tmp_path / 'bag.mcap')
    bag.attach('vehicle.yaml', VEHICLE)
    for k in range(50):
        bag.add('/odom', ODOMETRY, k * STEP, serialized(odometry(k * STEP, turning(k))))
        row = np.full(6, np.nan if k == 40 else 1.0)
        wrench = stamped('Wrench', k * STEP, row)
        bag.add('/wrench', wrench.__msgtype__, k * STEP, serialized(wrench))
    path = bag.close()
    with pytest.raises(InputError, match='/wrench: expected usable messages, found wrench: '):
        open_bag(path, whole=3)


@pytest.mark.long
def test_memory_does_not_grow_with_the_bag(tmp_path) -> None:
    """Four times the steps: what is held more are stamps, and the entries of more chunks."""
    peaks = []
    for steps in (20_000, 80_000):
        bag = make_bag(tmp_path / f'{steps}', steps, chunk_size=1 << 17)
        tracemalloc.start()
        run = open_bag(bag, whole=10).run
        for block in run.blocks(512):
            del block
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert run.samples == steps + 1
    assert peaks[1] < 1.2 * peaks[0], peaks


def test_a_sketch_of_a_long_run_holds_few_points(tmp_path) -> None:
    bag = make_bag(tmp_path / 'bag', 6000)
    drawn = digest(open_bag(bag, whole=10).run)
    lines = [t.line()[0] for traces in drawn.traces.values() for t in traces]
    assert max(map(len, lines)) <= 4000
    assert max(map(len, lines)) > 2000


def test_the_heading_goes_on_from_block_to_block(monkeypatch) -> None:
    monkeypatch.setattr(load, 'slices', lambda count: slices(count, 7))
    psi = np.concatenate([np.linspace(0.0, 20.0, 60), np.linspace(20.0, -20.0, 90)])
    x = np.zeros((len(psi), 13))
    x[:, 3], x[:, 6] = np.cos(psi / 2), np.sin(psi / 2)
    assert_allclose(np.concatenate([*load._unrolled(x)])[:, 5], psi, atol=1e-9)
