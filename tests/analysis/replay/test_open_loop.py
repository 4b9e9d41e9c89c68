"""What a law would have commanded: the order of its messages, its limits, its gains, refusals."""

import json
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import rclpy
import yaml
from helpers.made_messages import Bag, health, odometry, serialized, stamped
from helpers.shown import document_lines

from auv_analysis.bag.step_topics import ACCEL, ODOMETRY, TWIST, WRENCH
from auv_analysis.cli import main
from auv_analysis.replay import compared as comparing
from auv_analysis.replay import open_loop as opening
from auv_analysis.replay.compared import ask_law, compared, metrics_of, reproduction
from auv_analysis.replay.open_loop import OpenLoop, open_loop, recorded_loop, recorded_settings
from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.files.shipped import shipped
from auv_dynamics.ros.settings import name_of
from auv_gvc_controller.control.sampled_law import SampledLaw
from auv_gvc_controller.laws.law import make_gains
from auv_gvc_controller.laws.model import control_model

STEP = 10_000_000
GAINS = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
SETTINGS = {  # as `auv run` writes them
    'law': 'gvc', 'lockstep': True, 'setpoint_pairing': 'exact', 'setpoint_acceleration': 'topic'
}  # fmt: skip
COUNT = 40
VEHICLE = 'bluerov2_heavy'


def rows(count: int, width: int) -> np.ndarray:
    values = 0.3 * np.sin(np.add.outer(0.05 * np.arange(count), np.arange(1.0, width + 1.0)))
    if width == 13:
        values[:, 3:7] /= np.linalg.norm(values[:, 3:7], axis=1)[:, None]
    return values


def write(
    path: Path, *, late: int = 0, accel: bool = True, lost: tuple = (), params: dict | None = None,
    namespace: str = '', first: int = 0, told: bool = True, changed: dict | None = None,
) -> Path:  # fmt: skip
    """Bag of a controller's messages; set-points are logged `late` steps behind their stamps.

    `first`: number of its first step by its stamps; `told`: whether it has parameters; `changed`:
    which of its settings it says to have changed, from a step on.
    """
    bag = Bag(path)
    bag.attach('vehicle.yaml', shipped('vehicles', VEHICLE).read_text())
    own = {**SETTINGS, **{f'gains.{k}': [v] for k, v in GAINS.items()}}
    nodes = {'controller_node': {**own, **(params or {})}}
    text = yaml.safe_dump({n: {'ros__parameters': v} for n, v in nodes.items()})
    if told:
        bag.attach('params.yaml', text)
    x, nu_d, slope = rows(COUNT, 13), rows(COUNT, 6), rows(COUNT, 6)
    for k in range(COUNT):
        ns = (first + k) * STEP
        if k not in lost:
            bag.add(f'{namespace}/odom', ODOMETRY, ns, serialized(odometry(ns, x[k])))
        bag.add(
            f'{namespace}/wrench',
            WRENCH,
            ns,
            serialized(stamped('Wrench', ns, np.full(6, 1.0 * k))),
        )
    for k in range(COUNT):
        ns = (first + k) * STEP
        data = serialized(stamped('Twist', ns, nu_d[k]))
        bag.add(f'{namespace}/cmd_vel', TWIST, ns + late * STEP, data)
        if accel:
            data = serialized(stamped('Accel', ns, slope[k]))
            bag.add(f'{namespace}/cmd_accel', ACCEL, ns, data)
    for k, settings in (changed or {}).items():
        facts = {'law': 'gvc', 'gains': json.dumps({name: [v] for name, v in GAINS.items()})}
        said = health('/steersman', k * STEP, {**facts, 'changed': json.dumps(settings)})
        bag.add('/diagnostics', said.__msgtype__, 10**18 + k, serialized(said))
    return bag.close()


def by_hand(law: str, slope: np.ndarray, keep: list[int]) -> np.ndarray:
    """The sampled law on the rows, a sample after the other."""
    sampled = SampledLaw(make_gains(law, GAINS), control_model(load_vehicle(VEHICLE)))
    x, nu_d = rows(COUNT, 13).tolist(), rows(COUNT, 6).tolist()
    found, last = [], None
    for k in keep:
        dt = 0.0 if last is None else (k - last) * STEP / 1e9
        arguments = (x[k][7:], x[k][3:7], nu_d[k], slope[k].tolist())
        found.append(sampled.sample(k * STEP / 1e9, dt, *map(tuple, arguments))[0])
        last = k
    return np.array(found)


@pytest.mark.parametrize('law', ['gvc', 'cl'])
@pytest.mark.parametrize('late', [0, 5])
def test_it_is_the_sampled_law(tmp_path: Path, law: str, late: int) -> None:
    loop = recorded_loop(write(tmp_path / 'bag.mcap', late=late))
    done: list[int] = []
    found = open_loop(loop, law, GAINS, done.append)
    assert done[-1] == loop.samples == COUNT
    assert np.array_equal(found.tau, by_hand(law, rows(COUNT, 6), list(range(COUNT))))
    assert found.ns.tolist() == [k * STEP for k in range(COUNT)]
    assert not found.trouble


def test_files_in_another_order_are_put_in_order(tmp_path: Path) -> None:
    whole = open_loop(recorded_loop(write(tmp_path / 'whole.mcap')), 'gvc', GAINS)
    split = tmp_path / 'split'
    split.mkdir()
    write(split / 'bag_0.mcap', lost=tuple(range(COUNT // 2)))
    write(split / 'bag_1.mcap', lost=tuple(range(COUNT // 2, COUNT)))
    np.testing.assert_array_equal(open_loop(recorded_loop(split), 'gvc', GAINS).tau, whole.tau)
    write(split / 'bag_0.mcap', params=REAL_TIME, first=200)  # of a clock that begins anew
    write(split / 'bag_1.mcap', params=REAL_TIME)
    again = recorded_loop(split)
    assert again.samples == COUNT
    assert again.notes[-1].startswith('odom: the clock jumps back 1 times; read the longest of 2')


def test_odometry_that_is_missing_is_integrated_over(tmp_path: Path) -> None:
    loop = recorded_loop(write(tmp_path / 'bag.mcap', lost=(3, 4)))
    keep = [k for k in range(COUNT) if k not in (3, 4)]
    assert np.array_equal(open_loop(loop, 'gvc', GAINS).tau, by_hand('gvc', rows(COUNT, 6), keep))


REAL_TIME = {
    'lockstep': False, 'setpoint_pairing': 'latest', 'limits.wrench': [1e4], 'ramp': 0.0
}  # fmt: skip


@pytest.mark.parametrize('told', ['zero wrench', 'nothing', 'zero wrench after the last'])
def test_in_real_time_a_law_is_asked_while_it_was_in_charge(tmp_path: Path, told: str) -> None:
    """Activated late, and without charge for a while: its integrals know nothing else."""
    loop = recorded_loop(write(tmp_path / 'bag.mcap', params=REAL_TIME))
    ns, x = loop.series['odom']

    def told_by(odometry: slice, stamps: np.ndarray, tau: np.ndarray) -> OpenLoop:
        series = {'odom': (ns[odometry], x[odometry]), 'wrench': (stamps, tau)}
        return open_loop(replace(loop, series={**loop.series, **series}), 'gvc', GAINS)

    def part(here: slice) -> OpenLoop:
        return told_by(here, ns[here], np.ones((len(ns[here]), 6)))

    first, last = part(slice(12, 20)), part(slice(26, 40) if told != 'nothing' else slice(20, 40))
    stamps, tau = [first.ns, last.ns], [first.tau, last.tau]
    if told == 'zero wrench':
        stamps.insert(1, ns[20:26])
    elif told == 'nothing':  # the same odometry as deactivation leaves it
        stamps.insert(1, ns[19:20])
    else:
        stamps.insert(1, ns[[19, 19]])
    tau.insert(1, np.zeros((len(stamps[1]), 6)))
    both = np.concatenate(stamps), np.concatenate(tau)
    found = told_by(slice(0, None), *both)
    assert np.array_equal(found.ns, np.concatenate([first.ns, last.ns]))
    assert np.array_equal(found.tau, np.concatenate([first.tau, last.tau]))
    recorded = replace(loop, series={**loop.series, 'wrench': both})
    assert reproduction(recorded, found).relative == 0.0
    wrong = replace(found, tau=1.1 * found.tau)
    assert reproduction(recorded, wrong).relative == pytest.approx(0.1)
    assert not reproduction(recorded, wrong).holds
    assert reproduction(recorded, replace(found, tau=1.04 * found.tau)).holds
    begun = np.arange(len(found.ns)) < 3
    ramped = replace(found, tau=np.where(begun[:, None], 9.0, found.tau), ramps=begun)
    assert reproduction(recorded, ramped).relative == 0.0, 'ramps follow the clock of the node'
    apart = reproduction(recorded, replace(found, ns=found.ns + 1))
    assert (apart.relative, apart.within) == (None, None)
    still = replace(loop, series={**loop.series, 'wrench': (both[0], 0.0 * both[1])})
    apart = reproduction(still, found)
    assert (apart.relative, apart.within) == (None, np.abs(found.tau).max())


@pytest.mark.parametrize(
    ('ramp', 'answers', 'silenced'), [(0.05, 15, 0), (0.16, 24, 0), (0.05, 15, 1)]
)
def test_a_law_that_takes_over_is_on_its_ramp_for_a_while(
    tmp_path: Path, ramp: float, answers: int, silenced: int
) -> None:
    """Half as long again as it is, and half as many answers again as it has at least."""
    loop = recorded_loop(write(tmp_path / 'bag.mcap', params={**REAL_TIME, 'ramp': ramp}))
    ns, tau = loop.series['wrench']
    tau = np.where(np.arange(COUNT)[:, None] < 6, 0.0, 1.0) * np.ones(6)  # its ramp begins with 0
    again = np.sort([*range(COUNT), *[5] * silenced])  # but not with one that a watchdog repeats
    series = {**loop.series, 'wrench': (ns[again], tau[again])}
    found, first = open_loop(replace(loop, series=series), 'gvc', GAINS), 5 + silenced
    assert np.array_equal(found.ns, ns[first:])
    assert found.ramps.tolist() == [k < answers for k in range(COUNT - first)]
    assert found.notes[0].startswith(f'{first} odometry messages left out')


@pytest.mark.parametrize(('ramp', 'at_first', 'said'), [(0.1, 1, 1), (0.1, 0, 0), (0.0, 1, 0)])
def test_a_bag_that_begins_while_the_law_is_in_charge_says_so(tmp_path, ramp, at_first, said):
    loop = recorded_loop(write(tmp_path / 'bag.mcap', params={**REAL_TIME, 'ramp': ramp}))
    ns, tau = loop.series['wrench'][0], np.ones((COUNT, 6))
    tau[0] = at_first
    found = open_loop(replace(loop, series={**loop.series, 'wrench': (ns, tau)}), 'gvc', GAINS)
    begin = 'the recorded law was in charge before the bag begins'
    assert sum(note.startswith(begin) for note in found.notes) == said


@pytest.mark.parametrize(('more', 'times'), [(0, 1), (1, 2)])
def test_after_a_silence_that_a_watchdog_hears_a_law_begins_anew(
    tmp_path: Path, more: int, times: int
) -> None:
    told = {**REAL_TIME, 'ramp': 0.05, 'odometry_timeout': 0.4}
    loop = recorded_loop(write(tmp_path / 'bag.mcap', params=told))
    series = {
        role: (np.where(ns < 20 * STEP, ns, ns + 400_000_000 - STEP + more), x)
        for role, (ns, x) in loop.series.items()
    }
    found = open_loop(replace(loop, series=series), 'gvc', GAINS)
    assert np.count_nonzero(found.ramps) == 15 * times


def test_a_law_is_in_charge_from_the_answer_before_its_first_estimate(tmp_path: Path) -> None:
    loop = recorded_loop(write(tmp_path / 'bag.mcap', params=REAL_TIME))
    ns, tau = loop.series['wrench'][0], np.ones((COUNT, 6))
    f = np.where(np.arange(COUNT)[:, None] < 10, 0.0, np.eye(6)[2])
    series = {**loop.series, 'wrench': (ns, tau), 'disturbance_estimate': (ns, f)}
    found = open_loop(replace(loop, series=series), 'gvc', GAINS)
    assert np.array_equal(found.ns, ns[9:])
    series['disturbance_estimate'] = ns, 0.0 * f  # a law without one
    assert len(open_loop(replace(loop, series=series), 'gvc', GAINS).ns) == COUNT


def test_settings_that_were_changed_hold_from_the_next_activation_on(tmp_path: Path) -> None:
    """The controller has another name, and its computer another clock than the vehicle."""
    changed = {0: {}, 9: {'limits.wrench': [0.5] * 6}, 24: {}, 39: {'limits.wrench': [0.1] * 6}}
    loop = recorded_loop(write(tmp_path / 'bag.mcap', params=REAL_TIME, changed=changed))
    (note,) = loop.notes
    assert note.startswith('settings of the controller were changed'), 'and nothing of the law'
    assert loop.controller.law == 'gvc'
    ns, tau = loop.series['wrench'][0], np.ones((COUNT, 6))
    again = np.sort([*range(COUNT), 9, 24])  # zero: deactivated
    tau = np.where(np.isin(np.arange(COUNT + 2), [10, 26])[:, None], 0.0, 1.0) * np.ones(6)
    series = {**loop.series, 'wrench': (ns[again], tau)}
    found = open_loop(replace(loop, series=series), 'gvc', GAINS)
    most = np.abs(found.tau).max(axis=1)
    assert found.ns.tolist() == ns.tolist()
    assert (most[10:25] == 0.5).all()
    assert most[:10].min() > 0.5 < most[25:].min()


def test_where_no_wrench_answers_a_recorded_odometry_all_are_asked(tmp_path: Path) -> None:
    loop = recorded_loop(write(tmp_path / 'bag.mcap', params=REAL_TIME))
    ns, tau = loop.series['wrench']
    other = replace(loop, series={**loop.series, 'wrench': (ns + 1, tau)})
    found = open_loop(other, 'gvc', GAINS)
    assert (len(found.ns), found.notes) == (COUNT, ())
    assert reproduction(other, found).holds is None


def test_in_lock_step_only_rounding_is_a_reproduction(tmp_path: Path) -> None:
    loop = recorded_loop(write(tmp_path / 'bag.mcap'))
    found = open_loop(loop, 'gvc', GAINS)
    for scale in (1.0, 1e200):  # its square is no number
        same = replace(loop, series={**loop.series, 'wrench': (found.ns, scale * found.tau)})
        for size, holds in ((0.0, True), (5e-10, True), (2e-9, False)):
            wrong = replace(found, tau=(1.0 + size) * scale * found.tau)
            assert reproduction(same, wrong).holds == holds, size


def test_settings_that_the_bag_does_not_tell_are_said(tmp_path: Path) -> None:
    untold = recorded_loop(write(tmp_path / 'untold.mcap', told=False))
    assert untold.notes == (opening.UNTOLD,)
    assert recorded_loop(write(tmp_path / 'told.mcap')).notes == ()


def test_behind_a_hole_of_lock_step_nothing_is_reproduced(tmp_path: Path) -> None:
    own = {'limits.gap': 0.05}
    loop = recorded_loop(write(tmp_path / 'bag.mcap', lost=tuple(range(20, 30)), params=own))
    found = reproduction(loop, open_loop(loop, 'gvc', GAINS))
    assert (found.holds, found.missing) == (False, COUNT - 30)
    assert found.sentence() == 'NOT reproduced: 10 recorded wrenches are not answered again'
    ns, tau = loop.series['wrench']
    still = replace(loop, series={**loop.series, 'wrench': (ns, 0.0 * tau)})
    assert reproduction(still, open_loop(loop, 'gvc', GAINS)).missing == found.missing
    free = recorded_loop(write(tmp_path / 'free.mcap', params=REAL_TIME))
    assert reproduction(free, open_loop(free, 'gvc', GAINS)).missing == 0


def test_a_lock_step_bag_without_its_beginning_says_so(tmp_path: Path) -> None:
    loop = recorded_loop(write(tmp_path / 'bag.mcap', first=70))
    (note,) = open_loop(loop, 'gvc', GAINS).notes
    assert note.startswith('the bag begins at 0.7 s of its clock: this law begins without')


def test_the_recorded_law_is_asked_again_where_it_is_known(tmp_path: Path) -> None:
    def asked(law: str, given: dict, params: dict | None = None) -> tuple[list, dict]:
        loop, told = recorded_loop(write(tmp_path / 'bag.mcap', params=params)), []
        loop = replace(loop, notes=('as recorded',))

        def ask(recorded, law, gains):
            told.append((law, gains))
            return open_loop(recorded, law, gains)

        return told, ask_law(loop, law, given, ask)[0]

    once, twice = ('gvc', GAINS), {**GAINS, 'k_D': 3.0}
    assert asked('gvc', {})[0] == [once]
    assert asked('gvc', {'k_D': 3.0})[0] == [('gvc', twice), once]
    assert asked('cl', {})[0] == [('cl', GAINS), once]
    told, document = asked('cl', {'k_D': 3.0}, {**REAL_TIME, 'limits.speed': 0.2})
    assert told == [('cl', twice), once]
    assert (document['recorded']['law'], document['answered']['law']) == ('gvc', 'cl')
    assert document['recorded']['gains'] == GAINS
    first, *_, last = document['notes']
    assert first == 'as recorded'
    assert last.startswith(f'{document["not_used"]} messages without an answer')
    for name, law in (('my.module:Law', 'my.module:Law'), (None, None)):
        told, document = asked('gvc', GAINS, {'law': name})
        assert (told, document['recorded']) == ([once], {'law': law, 'gains': {}})
        assert (document['reproduced'], document['notes']) == (None, ['as recorded'])
        assert document['reproduction'].startswith('reproduction not checked')


def test_of_a_bag_that_was_not_finished_it_is_said(tmp_path: Path) -> None:
    bag = write(tmp_path / 'bag.mcap')
    bag.write_bytes(bag.read_bytes()[:-100])  # its summary is gone
    assert any('was not finished' in note for note in recorded_loop(bag).notes)


def test_odometry_that_only_the_controller_heard_is_counted(tmp_path: Path) -> None:
    lost = tuple(range(20, 24))
    loop = recorded_loop(write(tmp_path / 'bag.mcap', params=REAL_TIME, lost=lost))
    found = open_loop(loop, 'gvc', GAINS)
    assert found.notes[-1].startswith('4 odometry messages that it answered are not in the bag')
    assert len(found.ns) == COUNT - len(lost) - 1, 'the first wrench of this bag is zero'


def test_odometry_outside_of_the_bag_is_not_said_to_be_integrated_over(tmp_path: Path) -> None:
    lost = *range(5), COUNT - 1
    loop = recorded_loop(write(tmp_path / 'bag.mcap', params=REAL_TIME, lost=lost))
    assert open_loop(loop, 'gvc', GAINS).notes == (
        '4 odometry messages that it answered came before the first one of the bag: this law '
        'begins without their integrals',
        '1 odometry messages that it answered came after the last one of the bag',
    )


def test_without_derivatives_differences_are_taken(tmp_path: Path) -> None:
    loop = recorded_loop(write(tmp_path / 'bag.mcap', accel=False))
    slope = np.diff(rows(COUNT, 6), axis=0, prepend=rows(1, 6)) / (STEP / 1e9)
    assert np.array_equal(
        open_loop(loop, 'gvc', GAINS).tau, by_hand('gvc', slope, list(range(COUNT)))
    )


def test_limits_of_the_recorded_controller_hold(tmp_path: Path) -> None:
    free = recorded_loop(write(tmp_path / 'free.mcap'))
    bound = recorded_loop(
        write(tmp_path / 'bound.mcap', params={'limits.wrench': [2.0], 'anti_windup': False})
    )
    tau = open_loop(free, 'gvc', GAINS).tau
    assert np.abs(tau).max() > 4.0
    assert np.array_equal(open_loop(bound, 'gvc', GAINS).tau, tau.clip(-2.0, 2.0))


def test_anti_windup_knows_the_recorded_limits(tmp_path: Path) -> None:
    told = {'limits.wrench': [2.0]}
    with_it, without = (
        open_loop(
            recorded_loop(write(tmp_path / f'{on}.mcap', params={**told, 'anti_windup': on})),
            'gvc',
            GAINS,
        ).f
        for on in (True, False)
    )
    assert np.abs(with_it).max() < np.abs(without).max()


def test_unusable_messages_are_counted(tmp_path: Path) -> None:
    loop = recorded_loop(write(tmp_path / 'bag.mcap', params={'limits.speed': 0.2}))
    found = open_loop(loop, 'gvc', GAINS)
    assert found.refused > 0
    assert 'twist.linear: expected at most 0.2 m/s' in found.trouble
    assert len(found.ns) < COUNT


@pytest.mark.parametrize('lockstep', [True, False])
def test_what_is_not_written_is_what_the_node_takes(tmp_path, lockstep, monkeypatch) -> None:
    from auv_dynamics.ros.node_interface import NodeInterface
    from auv_dynamics.ros.node_main import BulkNode
    from auv_gvc_controller.nodes.controller_node import ControllerParameters

    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF')
    context = rclpy.Context()
    rclpy.init(context=context, args=['--ros-args', '-p', f'lockstep:={str(lockstep).lower()}'])
    try:
        node = BulkNode('controller_node', context=context)
        NodeInterface(node)
        taken = ControllerParameters(node).settings
        node.destroy_node()
    finally:
        rclpy.shutdown(context=context)
    replayed = recorded_settings({'lockstep': lockstep}, 'controller_node')
    assert replayed == taken
    assert {name_of(entry) for entry in fields(taken) if entry.metadata} | {
        'law', 'vehicle', 'autostart', 'use_sim_time', 'start_type_description_service',
        'base_frame', 'odom_frame', 'expected_subscribers',
    } == {name for name in node._parameters if not name.startswith('gains.')}  # fmt: skip


def test_gains_as_recorded_but_for_those_that_are_given(tmp_path: Path) -> None:
    own = recorded_loop(write(tmp_path / 'bag.mcap')).controller
    assert (own.law, own.gains) == ('gvc', GAINS)
    assert own.gains_of('cl', {'k_D': [1.0] * 6}) == {**GAINS, 'k_D': [1.0] * 6}
    assert own.gains_of('smc', {}).keys() <= GAINS.keys()


def test_wrenches_are_compared_where_there_are_both(tmp_path: Path) -> None:
    loop = recorded_loop(write(tmp_path / 'bag.mcap', lost=(0,)))
    ns = np.array([2, 3, 90]) * STEP
    both = compared(
        loop, OpenLoop(ns, np.array([[5.0] * 6, [7.0] * 6, [0.0] * 6]), np.zeros((3, 6)))
    )
    assert both.t.tolist() == [0.01, 0.02], 'since the first odometry'
    assert both.recorded[:, 0].tolist() == [2.0, 3.0]
    figures = metrics_of(both)
    assert figures['difference']['max'] == [4.0] * 6
    assert figures['difference']['rms'] == [12.5**0.5] * 6
    none = compared(loop, OpenLoop(ns[2:], np.zeros((1, 6)), np.zeros((1, 6))))
    assert metrics_of(none)['answered'] == {'rms': None, 'max': None}


@pytest.mark.parametrize(
    ('law', 'gains', 'words'),
    [
        ('warp', GAINS, '--law: expected gvc, cl, pid, smc, multisine or module:Class'),
        ('cl', {'k_D': 1.0}, '--gain: k_I: expected .* found nothing'),
        ('cl', {**GAINS, 'k_P': 1.0}, '--gain: k_P: expected one of'),
        ('cl', {**GAINS, 'k_D': [1.0, 2.0]}, '--gain: k_D: expected'),
    ],
)
def test_refuses_other_laws_and_gains(tmp_path: Path, law: str, gains: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        open_loop(recorded_loop(write(tmp_path / 'bag.mcap')), law, gains)


def test_a_law_is_tried_at_rest_before_it_is_asked(tmp_path: Path, monkeypatch) -> None:
    def fails(*_: object) -> None:
        raise ValueError('expected wrench of Mine to answer at rest, found nothing')

    monkeypatch.setattr(opening, 'try_law', fails)
    with pytest.raises(InputError, match='--law: expected wrench of Mine to answer at rest'):
        open_loop(recorded_loop(write(tmp_path / 'bag.mcap')), 'gvc', GAINS)


@pytest.mark.parametrize(
    'params', [{'limits.wrench': [1.0, 2.0]}, {'limits.gap': 'x'}, {'limits.wrench': [-1.0]}]
)
def test_refuses_parameters_that_are_none(tmp_path: Path, params: dict) -> None:
    with pytest.raises(InputError, match=r'params\.yaml: controller_node: limits'):
        recorded_loop(write(tmp_path / 'bag.mcap', params=params))


@pytest.mark.parametrize(('name', 'value', 'is_one'), [
    ('setpoint_filter.omega', 20, True), ('setpoint_filter.omega', 20.1, False),
    ('setpoint_filter.omega', 0.01, True), ('setpoint_filter.omega', 0.009, False),
    ('ramp', 0, True), ('ramp', -0.1, False), ('ramp', True, False), ('ramp', np.inf, False),
    ('setpoint_pairing', 'exact', True), ('setpoint_pairing', 'newest', False),
    ('anti_windup', False, True), ('anti_windup', 1, False), ('limits.wrench', 5.0, False),
    ('ramp', 10**309, False),
])  # fmt: skip
def test_a_parameter_is_of_its_type_and_within_its_range(name, value, is_one) -> None:
    if is_one:
        found = recorded_settings({name: value}, 'somewhere')
        (field,) = (entry for entry in fields(found) if entry.metadata and name_of(entry) == name)
        assert getattr(found, field.name) == value
        assert type(getattr(found, field.name)) is {int: float}.get(type(value), type(value))
    else:
        with pytest.raises(InputError, match=f'^somewhere: {name}: expected '):
            recorded_settings({name: value}, 'somewhere')


def test_the_command_leaves_figures_and_refuses_a_taken_folder(tmp_path, capsys, approved) -> None:
    bag, out = write(tmp_path / 'bag.mcap'), tmp_path / 'out'
    command = ['replay', str(bag), '--law', 'cl', '--gain', 'k_D=1,2,3,4,5,6', '--out', str(out)]
    with pytest.raises(SystemExit) as ended:
        main.main([*command, '--json'])
    assert ended.value.code == 1
    document = json.loads(capsys.readouterr().out)
    approved.add(document_lines(document))
    assert document['answered']['gains']['k_D'] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert document == json.loads((out / 'open_loop.json').read_text())
    assert next(iter(document)) == 'reproduced'
    assert document['reproduced'] is False, 'the wrenches of this bag are no law of ours'
    assert document['reproduced_within'] > 1.0
    assert document['reproduction'].startswith('NOT reproduced')
    with pytest.raises(SystemExit) as ended:
        main.main(command)
    assert ended.value.code == 2
    assert 'a new folder, or --overwrite' in capsys.readouterr().err


def test_a_law_is_asked_with_the_vehicle_that_is_given(tmp_path, monkeypatch) -> None:
    asked = []

    def ask(recorded, law, gains, _):
        asked.append(recorded.controller._vehicle.name)
        raise FailedError('enough')

    monkeypatch.setattr(comparing, 'ask_law', ask)
    bag = write(tmp_path / 'bag.mcap')
    with pytest.raises(SystemExit):
        main.main(['replay', str(bag), '--law', 'cl', '--vehicle', 'rexrov'])
    assert asked == ['rexrov']


@pytest.mark.usefixtures('undrawn')
def test_of_several_vehicles_one_is_named(tmp_path: Path, capsys) -> None:
    bag = tmp_path / 'bag'
    bag.mkdir()
    write(bag / 'bag_0.mcap', namespace='/auv1')
    write(bag / 'bag_1.mcap', namespace='/auv2')
    asked = ['replay', str(bag), '--law', 'gvc', '--out', str(tmp_path / 'out')]
    with pytest.raises(SystemExit) as ended:
        main.main(asked)
    assert ended.value.code == 2
    assert '--namespace with that of one, found /auv1, /auv2' in capsys.readouterr().err
    assert recorded_loop(bag, namespace='/auv2').samples == COUNT
    with pytest.raises(SystemExit) as ended:
        main.main([*asked, '--namespace', '/auv2', '--json'])
    assert json.loads(capsys.readouterr().out)['samples'] == COUNT


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        (['--law', 'cl', '--gain', 'k_D'], '--gain: expected NAME=VALUE'),
        (['--law', 'cl', '--gain', 'k_D=nan'], '--gain: expected NAME=VALUE'),
        (['--gain', 'k_D=1'], '--gain: expected --law beside it'),
        (['--vehicle', 'rexrov'], '--vehicle: expected --law beside it'),
        (['--rate', '-1'], '--rate: expected a number of at least 0 or max, found -1'),
        (['--duration', '0'], '--duration: expected a number above 0, found 0'),
        (['--start', 'soon'], '--start: expected a number of at least 0, found soon'),
    ],
)
def test_wrong_options_are_named(tmp_path: Path, options: list[str], words: str, capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        main.main(['replay', str(write(tmp_path / 'bag.mcap')), *options])
    assert ended.value.code == 2
    assert words in capsys.readouterr().err
