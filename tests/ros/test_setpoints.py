"""The set-point node against the independent implementation, every axis different."""

from pathlib import Path

import herman_reference as reference
import numpy as np
import pytest
from helpers import nodes_in_process as by_hand
from helpers.nodes_in_process import program
from numpy.testing import assert_allclose
from reference_cases import SIX

from auv_dynamics.ros import topics
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
    tmp_path: Path, kind: str, lockstep: bool
) -> None:
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

        # after 5, which is late, as before; every other one from 6 on is usual when it is so twice
        for at, until in ((0, 1), (1, 2), (5, 6), (6, 7), (8, 9), (10, 12), (12, 14)):
            made.publish(topics.ODOM, by_hand.odometry(START + at * STEP, [0, 0, 0, 1, *[0] * 9]))
            made.until(lambda n=until: newest() >= n, f'set-point {until}')
            made.spin(0.05)
            assert newest() == until
