"""The set-point node against the independent implementation, every axis different."""

import itertools
from pathlib import Path

import herman_reference as reference
import numpy as np
import pytest
from helpers import nodes_in_process as by_hand
from helpers.nodes_in_process import program
from numpy.testing import assert_allclose
from reference_cases import SIX

from auv_dynamics.files.errors import InputError
from auv_dynamics.ros import topics
from auv_gvc_controller.nodes import setpoint_node
from auv_gvc_controller.nodes.setpoint_node import SetpointNode

STEP = 20_000_000
START = 5 * 10**9 + 7
ROWS = np.column_stack([np.linspace(0, 12, 7), np.random.default_rng(3).uniform(-1, 1, (7, 6))])
WAVES = {
    f'setpoint.{axis}.{key}': value if key == 'offset' else [value]
    for axis, spec in SIX.items()
    for key, value in [('offset', spec['offset']), *spec['terms'][0].items()]
}


@pytest.mark.parametrize('kind', ['waves', 'file'])
@pytest.mark.parametrize('lockstep', [True, False])
def test_every_axis_is_that_of_the_independent_implementation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, lockstep: bool
) -> None:
    monkeypatch.setattr(setpoint_node, 'steady_timer', lambda *_: None)  # odometry asks by itself
    path = tmp_path / 'table.csv'
    names = 't,surge,sway,heave,roll,pitch,yaw'
    np.savetxt(path, ROWS, delimiter=',', header=names, comments='', fmt='%.17g')
    told = WAVES if kind == 'waves' else {'setpoint.file': str(path)}
    spec = SIX if kind == 'waves' else {'table': ROWS}
    grid = {'step': 0.02, 'duration': 12.0, 'horizon': 5, 'lockstep': lockstep}
    with program() as made:
        made.add(SetpointNode, {**grid, **told})
        made.listen(topics.CMD_VEL, topics.CMD_ACCEL)
        made.until(lambda: made.node.count_publishers('cmd_accel'), 'a publisher')
        stride, last = (40, 600) if lockstep else (2, 40)
        for at in range(0, last + 1, stride):
            wanted = min(at + 5, 600)
            made.publish(topics.ODOM, by_hand.odometry(START + at * STEP, [0, 0, 0, 1, *[0] * 9]))
            made.until(
                lambda n=wanted: START + n * STEP in map(by_hand.ns_of, made.heard['cmd_accel']),
                f'set-point {wanted}',
            )
        made.spin(0.1)  # nothing comes behind the last one
        steps = [(by_hand.ns_of(m) - START) / STEP for m in made.heard['cmd_vel']]
        assert steps == [*range(wanted + 1)], 'each once, up to the end'
        assert steps == [(by_hand.ns_of(m) - START) / STEP for m in made.heard['cmd_accel']]
        pairs = zip(made.heard['cmd_vel'], made.heard['cmd_accel'], strict=True)
        for k, (velocity, acceleration) in enumerate(pairs):
            value, slope = reference.setpoint(spec, k * 0.02)
            assert_allclose(by_hand.six_of(velocity), value, rtol=0, atol=1e-12)
            assert_allclose(by_hand.six_of(acceleration), slope, rtol=0, atol=1e-12)
            assert by_hand.frames_of(velocity) == by_hand.frames_of(acceleration)
            assert by_hand.frames_of(velocity) == ('base_link_fsd',)


def test_without_a_horizon_it_is_ahead_by_the_usual_gap_between_odometries() -> None:
    with program() as made:
        made.add(SetpointNode, {'step': 0.02, 'lockstep': False, **WAVES})
        made.listen(topics.CMD_VEL)
        made.until(lambda: made.node.count_publishers('cmd_vel'), 'a publisher')
        heard = made.heard['cmd_vel']

        def newest() -> float:
            return (by_hand.ns_of(heard[-1]) - START) / STEP if heard else -1

        # two within a step are one apart, for there is always a next; after 5, which is late, as
        # before; every other one from 6 on is usual when it is so twice
        for at, until in ((0, 1), (0.5, 1), (1, 2), (5, 6), (6, 7), (8, 9), (10, 12), (12, 14)):
            ns = START + int(at * STEP)
            made.publish(topics.ODOM, by_hand.odometry(ns, [0, 0, 0, 1, *[0] * 9]))
            made.until(lambda n=until: newest() >= n, f'set-point {until}')
            made.spin(0.05)
            assert newest() == until


def test_no_step_is_published_twice_where_the_clock_jumps_by_hardly_more_than_is_believed() -> None:
    with program() as made:
        made.add(SetpointNode, {'step': 0.02, 'lockstep': False, **WAVES})
        made.listen(topics.CMD_VEL)
        made.until(lambda: made.node.count_publishers('cmd_vel'), 'a publisher')
        heard = made.heard['cmd_vel']

        def says(at: float, until: int) -> bool:
            ns = START + int(at * STEP)
            made.publish(topics.ODOM, by_hand.odometry(ns, [0, 0, 0, 1, *[0] * 9]))
            made.spin(0.05)
            return bool(heard) and by_hand.ns_of(heard[-1]) == START + until * STEP

        for at, until in ((0, 1), (50, 51), (100, 150)):  # a second is believed
            made.until(lambda at=at, until=until: says(at, until), 'a set-point')
        later = itertools.count(150_100)  # two in a row are a jump
        made.until(lambda: says(next(later) / 1000, 200), 'those after the jump')
        steps = [(by_hand.ns_of(m) - START) / STEP for m in heard]
        assert steps == [0, 1, *range(50, 52), *range(100, 201)], 'each once'


@pytest.mark.parametrize('lockstep', [True, False])
def test_what_odometry_asks_for_comes_once_its_subscribers_are_there(lockstep: bool) -> None:
    grid = {'step': 0.02, 'duration': 1.0, 'horizon': 3, 'lockstep': lockstep}
    with program() as made:
        node = made.add(SetpointNode, {**grid, **WAVES, 'expected_subscribers': ['cmd_vel=1']})
        made.listen(topics.DIAGNOSTICS)
        said = made.heard[topics.DIAGNOSTICS.name]

        def fact(key: str) -> str:
            return {one.key: one.value for one in said[-1].status[0].values}[key]

        made.until(lambda: said and said[-1].status[0].message != 'ok', 'no odometry yet')
        assert said[-1].status[0].level == b'\x03', 'STALE'
        made.publish(topics.ODOM, by_hand.odometry(START, [0, 0, 0, 1, *[0] * 9]))
        made.until(lambda: said[-1].status[0].message == 'ok', 'odometry')
        assert said[-1].status[0].level == b'\x00', 'OK'
        assert by_hand.ns_of(said[-1]) == 0, 'nothing before there is a subscriber'
        assert said[-1].header.frame_id == 'base_link_fsd'
        assert fact('ready') == 'False'
        made.listen(topics.CMD_VEL)
        made.until(lambda: by_hand.ns_of(said[-1]) == START + 3 * STEP, 'the horizon')
        assert fact('ready') == 'True'
        made.until(lambda: len(made.heard['cmd_vel']) >= 4, 'all of them')
        found = [by_hand.ns_of(m) for m in made.heard['cmd_vel']]
        assert found == [START + k * STEP for k in range(4)]
        (heard,) = [one for one in made.node.subscriptions if one.topic_name == '/cmd_vel']
        made.node.destroy_subscription(heard)
        left = node.graph.publishers['cmd_vel'].get_subscription_count
        made.until(lambda: not left(), 'the end of the subscriber')
        made.publish(topics.ODOM, by_hand.odometry(START + STEP, [0, 0, 0, 1, *[0] * 9]))
        made.until(lambda: by_hand.ns_of(said[-1]) == START + 4 * STEP, 'one for all others')


def test_a_file_that_ends_too_early_and_a_run_between_two_steps_are_refused(tmp_path: Path) -> None:
    path = tmp_path / 'table.csv'
    names = 't,surge,sway,heave,roll,pitch,yaw'
    np.savetxt(path, ROWS, delimiter=',', header=names, comments='', fmt='%.17g')
    for duration, file, key, expected in (
        (13.0, str(path), 't', '0 to 13 s covered'),
        (1.01, 'setpoint_node', 'duration', 'a multiple of step'),
    ):
        with program() as made, pytest.raises(InputError) as caught:
            made.add(SetpointNode, {'step': 0.02, 'duration': duration, 'setpoint.file': str(path)})
        assert (caught.value.file, caught.value.key) == (file, key)
        assert expected in caught.value.expected
