"""The set-point node: silent before the first odometry, ahead of it, and at an end."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from helpers.node_processes import Peer, parameters
from helpers.nodes_in_process import assert_refused, program
from helpers.patience import patience
from rcl_interfaces.srv import GetParameters

from auv_dynamics.ros import convert, interface, topics
from auv_dynamics.ros.interface import Frames
from auv_gvc_controller.nodes import setpoint_node
from auv_gvc_controller.nodes.setpoint_node import SetpointNode

STEP = 10_000_000
UPRIGHT = np.array([0, 0, 0, 1, *[0] * 9], float)
SURGE = [
    *parameters(setpoint__surge__offset=0.2, horizon=5),
    *['-p', 'setpoint.surge.amplitude:=[1.0]', '-p', 'setpoint.surge.omega:=[2.0]'],
]


@contextmanager
def started(arguments: list[str]) -> Iterator[Peer]:
    """The node in this process, and who talks to it."""
    with program() as made:
        made.add(SetpointNode, arguments)
        yield made


def odometry(ns: int):
    return convert.odometry(ns, UPRIGHT, Frames())


def stamps(peer, topic: str) -> list[int]:
    return [interface.nanoseconds(m.header.stamp) for m in peer.heard[topic]]


def followed(peer: Peer, ns: int) -> None:
    """Publish an odometry; set-points up to five steps ahead of it have come."""
    peer.publish(topics.ODOM, odometry(ns))
    peer.until(lambda: ns + 5 * STEP in stamps(peer, 'cmd_vel'), f'those of {ns} ns')


def refused(peer: Peer, ns: int, word: str) -> None:
    """Publish an odometry that is not believed yet; the node says so."""
    peer.publish(topics.ODOM, odometry(ns))
    said = peer.heard[topics.DIAGNOSTICS.name]
    peer.until(lambda: any(word in m.status[0].message for m in said), word)


def test_runs_ahead_of_the_odometry_on_its_grid() -> None:
    start = 7 * 10**9 + 123
    with started(SURGE) as peer:
        peer.listen(topics.CMD_VEL, topics.CMD_ACCEL, topics.DIAGNOSTICS)
        peer.until(lambda: peer.node.count_publishers('cmd_vel'), 'a publisher')
        said = peer.heard[topics.DIAGNOSTICS.name]
        for text in ('nobody publishes /odom', 'no odometry yet'):
            peer.until(lambda text=text: said and said[-1].status[0].message == text, text)
            peer.node.create_publisher(topics.ODOM.type, topics.ODOM.name, 1)
        assert not peer.heard['cmd_vel'], 'nothing before the first odometry'
        peer.publish(topics.ODOM, odometry(start))
        peer.until(lambda: len(peer.heard['cmd_vel']) >= 6, 'five steps ahead')
        peer.spin(0.2)
        assert stamps(peer, 'cmd_vel') == [start + k * STEP for k in range(6)]
        peer.publish(topics.ODOM, odometry(start + 2 * STEP))
        both = [peer.heard[name] for name in ('cmd_vel', 'cmd_accel')]
        peer.until(lambda: min(map(len, both)) >= 8, 'two more')
        assert stamps(peer, 'cmd_vel') == stamps(peer, 'cmd_accel')
    t = np.arange(8) * 0.01
    surge = [m.twist.linear.x for m in peer.heard['cmd_vel']]
    slope = [m.accel.linear.x for m in peer.heard['cmd_accel']]
    assert np.allclose(surge, 0.2 + np.sin(2 * t), atol=1e-15)
    assert np.allclose(slope, 2 * np.cos(2 * t), atol=1e-15)
    assert peer.heard['cmd_vel'][0].header.frame_id == 'base_link_fsd'


def test_without_a_horizon_the_next_odometry_finds_its_set_point() -> None:
    with started(parameters(setpoint__surge__offset=0.2)) as peer:
        peer.listen(topics.CMD_VEL)
        for at, last in ((0, 1), (1, 2), (6, 7), (11, 16), (16, 21), (18, 21), (21, 23)):  # steps
            peer.publish(topics.ODOM, odometry(10**9 + at * STEP))
            newest = 10**9 + last * STEP
            peer.until(lambda newest=newest: newest in stamps(peer, 'cmd_vel'), 'the next')
            assert stamps(peer, 'cmd_vel')[-1] == newest


def test_odometry_within_the_horizon_is_no_jump_however_late_it_is_looked_at() -> None:
    far = 160  # steps, of more than a second
    with started(parameters(setpoint__surge__offset=0.2, horizon=150)) as peer:
        peer.listen(topics.CMD_VEL)
        for at in (0, far, 2 * far):
            peer.publish(topics.ODOM, odometry(at * STEP))
            newest = (at + 150) * STEP
            peer.until(lambda newest=newest: newest in stamps(peer, 'cmd_vel'), 'the horizon')
        assert stamps(peer, 'cmd_vel') == [k * STEP for k in range(2 * far + 151)]
        peer.listen(topics.DIAGNOSTICS)
        refused(peer, (3 * far + 1) * STEP, 'stamp jumped')


@pytest.mark.parametrize('more', [{}, {'duration': 60.0}, {'lockstep': True}], ids=str)
def test_what_lies_behind_the_odometry_by_more_than_the_horizon_is_left_out(more: dict) -> None:
    with started([*SURGE, *parameters(**more)]) as peer:
        peer.listen(topics.CMD_VEL)
        for at in (0, 40):
            peer.publish(topics.ODOM, odometry(10**9 + at * STEP))
            newest = 10**9 + (at + 5) * STEP
            peer.until(lambda newest=newest: newest in stamps(peer, 'cmd_vel'), 'the horizon')
    steps = [(ns - 10**9) // STEP for ns in stamps(peer, 'cmd_vel')]
    assert steps == [*range(6), *range(35, 46)]


def test_a_jump_of_the_clock_is_no_burst() -> None:
    with started([*SURGE, *parameters(duration=3600.0)]) as peer:
        peer.listen(topics.CMD_VEL, topics.DIAGNOSTICS)
        followed(peer, 0)
        refused(peer, 1800 * 10**9, 'stamp jumped')
        first = 1800 * 10**9 + STEP
        followed(peer, first)
        followed(peer, first + STEP)
        assert stamps(peer, 'cmd_vel') == [
            *(k * STEP for k in range(6)), *(first + k * STEP for k in range(7))
        ]  # fmt: skip


def test_ends_with_its_duration() -> None:
    with started([*SURGE, *parameters(duration=0.03)]) as peer:
        peer.listen(topics.CMD_VEL)
        peer.publish(topics.ODOM, odometry(0))
        peer.until(lambda: len(peer.heard['cmd_vel']) >= 4, 'four set-points')
        peer.publish(topics.ODOM, odometry(3 * STEP))
        peer.call(GetParameters, 'setpoint_node/get_parameters')  # it has taken what came before
        peer.spin(0.3)
        assert stamps(peer, 'cmd_vel') == [k * STEP for k in range(4)]


def test_refuses_odometry_in_another_frame() -> None:
    with started(SURGE) as peer:
        peer.listen(topics.CMD_VEL, topics.DIAGNOSTICS)
        said = peer.heard[topics.DIAGNOSTICS.name]
        foreign = convert.odometry(0, UPRIGHT, Frames(odom='odom', base='base_link'))

        def refused() -> bool:
            peer.publish(topics.ODOM, foreign)
            peer.spin(0.1)
            return any('header.frame_id' in one.status[0].message for one in said)

        peer.until(refused, 'the refusal')
        assert not peer.heard['cmd_vel']


@pytest.mark.parametrize(
    ('arguments', 'key', 'expected'),
    [
        (parameters(horizon=3000), 'horizon', '2999'),
        (
            [*parameters(horizon=50), '-p', 'qos_overrides./cmd_vel.publisher.depth:=50'],
            'qos_overrides./cmd_vel.publisher.depth',
            'more than 50',
        ),
        (parameters(setpoint__warp__offset=1.0), 'setpoint.warp.offset', 'one of'),
        (['-p', 'setpoint.surge.amplitude:=[1.0]'], 'setpoint', 'of equal length'),
        (parameters(setpoint__file='none.csv'), 'none.csv', 'a CSV set-point file'),
        (parameters(setpoint__file='none.csv', setpoint__yaw__offset=1.0), 'setpoint', 'alone'),
    ],
)
def test_wrong_parameters_end_in_one_line(arguments: list[str], key: str, expected: str) -> None:
    assert_refused(SetpointNode, arguments, key, expected)


def test_goes_on_when_the_driver_starts_again_with_its_clock_at_zero(monkeypatch) -> None:
    """What it says next belongs to the time of the vehicle that it was at."""
    monkeypatch.setattr(setpoint_node, 'BLOCK', 4)  # it had gone on to the next one
    with started(SURGE) as peer:
        peer.listen(topics.CMD_VEL, topics.DIAGNOSTICS)
        old = 100 * 10**9
        for k in range(3):
            followed(peer, old + k * STEP)
        peer.spin(patience(0.5))  # it was away
        refused(peer, 10**9, 'stamp went back')
        for k in (1, 2):
            followed(peer, 10**9 + k * STEP)
        new = [m for m in peer.heard['cmd_vel'] if interface.nanoseconds(m.header.stamp) < old]
        assert [interface.nanoseconds(m.header.stamp) for m in new] == [
            10**9 + k * STEP for k in range(1, 8)
        ]
        t = np.arange(2, 9) * 0.01
        assert np.allclose([m.twist.linear.x for m in new], 0.2 + np.sin(2 * t), atol=1e-15)


def test_a_clock_that_is_set_takes_no_time_of_the_run() -> None:
    """A first odometry without a stamp, and a computer that learns the date, end nothing."""
    with started([*SURGE, *parameters(duration=30.0)]) as peer:
        peer.listen(topics.CMD_VEL, topics.DIAGNOSTICS)
        followed(peer, 0)
        now = 1_700_000_000 * 10**9
        refused(peer, now, 'stamp jumped')
        followed(peer, now + STEP)
    assert stamps(peer, 'cmd_vel') == [
        *(k * STEP for k in range(6)),
        *(now + k * STEP for k in range(1, 7)),
    ]
