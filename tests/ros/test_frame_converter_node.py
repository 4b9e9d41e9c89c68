"""The frame converter node: a vehicle behind two mirrors is the same vehicle, step by step."""

from contextlib import ExitStack

import numpy as np
import pytest
from helpers.node_processes import (
    CONTROLLER,
    assert_one_line,
    fresh_domain,
    graph,
    parameters,
    run_node,
    stop,
)
from helpers.nodes_in_process import ns_of, program, state_of
from helpers.patience import patience
from numpy.testing import assert_allclose
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from std_srvs.srv import SetBool, Trigger

from auv_dynamics.files.errors import InputError
from auv_dynamics.nodes import frame_converter_node
from auv_dynamics.nodes.frame_converter_node import FrameConverterNode, mirrored_odometry
from auv_dynamics.ros import convert, interface, topics
from auv_dynamics.ros.interface import Frames
from auv_dynamics.ros.topics import Topic

ENU, NED = Frames('odom', 'base_link'), Frames()
ENU_ODOM = Topic('enu_flu/odom', topics.ODOM.type)
ENU_WRENCH = Topic('enu_flu/wrench', topics.WRENCH.type)
ENU_CMD_VEL = Topic('enu_flu/cmd_vel', topics.CMD_VEL.type)
ENU_CMD_ACCEL = Topic('enu_flu/cmd_accel', topics.CMD_ACCEL.type)
STEPS = 60
UPRIGHT = np.array([0, 0, 0, 1, 0, 0, 0, 0.1, 0.2, 0.3, 0.01, 0.02, 0.03], float)
PLANT = [
    *parameters(vehicle='rexrov', lockstep=True, duration=STEPS * 0.01),
    '-p', 'initial.eta:=[1.0, -2.0, 3.0, 0.3, -0.4, 2.0]',
    '-p', 'initial.nu:=[0.4, -0.2, 0.3, 0.1, -0.2, 0.15]',
]  # fmt: skip
SETPOINT = [
    *parameters(duration=STEPS * 0.01, setpoint__surge__offset=0.5, setpoint__heave__offset=-0.3),
    *('-p', 'setpoint.sway.amplitude:=[0.2]', '-p', 'setpoint.sway.omega:=[0.5]'),
    *('-p', 'setpoint.sway.phase:=[0.0]', '-p', 'setpoint.yaw.offset:=0.1'),
    *('-p', 'expected_subscribers:=["cmd_vel=1", "cmd_accel=1"]'),
]
LAW = [
    *[word.replace('herman2018', 'rexrov') for word in CONTROLLER],
    *parameters(lockstep=True, setpoint_pairing='exact', setpoint_acceleration='topic'),
    *('-p', 'expected_subscribers:=["wrench=2"]'),
]


def remapped(**names: str) -> list[str]:
    return [word for a, b in names.items() for word in ('-r', f'{a.replace("__", "/")}:={b}')]


def run(*, mirrored: bool) -> dict[str, np.ndarray]:
    """Odometry and wrenches of a run, those of the plant and those of the controller."""
    domain = fresh_domain()
    waits = ['setpoint_node', 'controller_node']
    plant, nodes = list(PLANT), [('setpoint_node', SETPOINT), ('controller_node', LAW)]
    with ExitStack() as stack:
        if mirrored:
            waits += ['mirror', 'frame_converter_node']
            plant += remapped(odom='plant/odom', wrench='plant/wrench')
            plant += parameters(odom_frame='inertial', base_frame='body')
            there = [
                *parameters(enu_frame='inertial', flu_frame='body', lockstep=True),
                *parameters(odom_frame='odom', base_frame='base_link'),
                *remapped(enu_flu__odom='plant/odom', odom='enu_flu/odom'),
                *remapped(wrench='enu_flu/wrench', enu_flu__wrench='plant/wrench'),
                *remapped(cmd_vel='unused/cmd_vel', cmd_accel='unused/cmd_accel'),
                *('-r', '__node:=mirror', '-p', 'expected_subscribers:=["odom=1"]'),
            ]
            stack.enter_context(graph(('frame_converter_node', there), domain=domain))
            here = [*parameters(lockstep=True), '-p', 'expected_subscribers:=["odom=3"]']
            nodes.append(('frame_converter_node', here))
        plant += ['-p', f'start_after:={waits}'.replace("'", '"')]
        plant += ['-p', f'expected_subscribers:=["odom={2 if mirrored else 3}"]']
        plant += parameters(start_paused=True)
        nodes += [('plant_node', plant)]
        peer, processes = stack.enter_context(graph(*nodes, domain=domain))
        names = ('plant/odom', 'plant/wrench') if mirrored else ('odom', 'wrench')
        kinds = (topics.ODOM, topics.WRENCH)
        heard = [Topic(n, k.type) for n, k in zip(names, kinds, strict=True)]
        if mirrored:  # before we hear its wrench as well: it has met the plant
            peer.until(lambda: peer.call(Trigger, 'mirror/ready').success, 'the mirror')
        peer.listen(*{topic.name: topic for topic in (*heard, *kinds)}.values())
        if mirrored:
            peer.call(GetParameters, 'mirror/get_parameters')  # who answers knows what we hear
        run = SetBool.Request(data=True)
        peer.until(lambda: peer.call(SetBool, 'plant_node/run', run).success, 'the start')
        peer.until(lambda: all(len(m) == STEPS + 1 for m in peer.heard.values()), 'all steps')
        peer.until(lambda: processes['plant_node'].poll() is not None, 'the end of the plant')
        assert processes['plant_node'].returncode == 0
        plant_frames = Frames('inertial', 'body') if mirrored else NED
        return {
            'plant odom': rows(peer.heard[names[0]], interface.read_odometry, plant_frames),
            'plant wrench': rows(peer.heard[names[1]], wrench, plant_frames),
            'odom': rows(peer.heard['odom'], interface.read_odometry, NED),
            'wrench': rows(peer.heard['wrench'], wrench, NED),
        }


def wrench(message, frames: Frames) -> tuple:
    return interface.read_wrench(message, frames, 'wrench')


def rows(messages: list, read, frames: Frames) -> np.ndarray:
    """Stamps and numbers (n, 1 + m) of messages; a quaternion's sign makes no difference."""
    table = np.array([[ns, *values] for ns, values in (read(m, frames) for m in messages)])
    if table.shape[1] == 14:
        table[:, 4:8] *= np.sign(table[:, 4:5])
    return table


def test_a_run_behind_two_mirrors_is_the_run_without() -> None:
    straight, mirrored = run(mirrored=False), run(mirrored=True)
    assert len(straight['odom']) == STEPS + 1
    x = straight['odom'][:, 1:]
    assert np.abs(x - x[0]).max(axis=0).min() > 1e-4, 'everything moves'
    assert np.abs(straight['wrench'][-1, 1:]).min() > 1.0, 'every axis is commanded'
    for name, table in straight.items():
        assert_allclose(mirrored[name], table, rtol=1e-9, atol=1e-9, err_msg=name)


def test_a_quaternion_comes_out_with_a_norm_of_1() -> None:
    q = np.array([0.1, 0.3, -0.2, 0.9]) / np.linalg.norm([0.1, 0.3, -0.2, 0.9])
    turned = []
    for norm in (1.0, 1.0 + 0.9 * interface.UNIT):
        x = np.concatenate([UPRIGHT[:3], norm * q, UPRIGHT[7:]])
        found = mirrored_odometry(convert.odometry(5, x, ENU), ENU, NED, 'odom').pose.pose
        turned.append([getattr(found.orientation, axis) for axis in 'xyzw'])
    assert_allclose(turned[1], turned[0], rtol=0.0, atol=1e-15)
    assert np.linalg.norm(turned[0]) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize('lockstep', [True, False])
def test_what_is_converted_before_it_is_heard_waits_in_lock_step_alone(lockstep: bool) -> None:
    given = {'lockstep': lockstep, 'expected_subscribers': ['cmd_vel=1']}
    stamps = [1_000_000_001, 1_000_000_002, 1_000_000_003]
    with program() as made:
        node = made.add(FrameConverterNode, given)
        made.listen(topics.DIAGNOSTICS)
        said = made.heard[topics.DIAGNOSTICS.name]

        def converted() -> dict[str, str]:
            values = said[-1].status[0].values if said else []
            return {v.key: v.value for v in values if v.key.endswith(' converted')}

        for ns in stamps:
            made.publish(ENU_CMD_VEL, convert.twist(ns, UPRIGHT[7:], ENU))
        made.until(lambda: converted().get('cmd_vel converted') == '3', 'three that are converted')
        kinds = ('odom', 'cmd_accel', 'enu_flu/wrench')
        others = {f'{name} converted': '0' for name in kinds}
        assert converted() == {'cmd_vel converted': '3', **others}
        assert ns_of(said[-1]) == 0, 'nothing before there is a subscriber'
        made.listen(topics.CMD_VEL)
        if not lockstep:
            made.until(node.graph.ready, 'the subscriber')
            stamps = [2_000_000_000]
            made.publish(ENU_CMD_VEL, convert.twist(*stamps, UPRIGHT[7:], ENU))
        made.until(lambda: ns_of(said[-1]) == stamps[-1], 'the last of them')
        made.until(lambda: len(made.heard['cmd_vel']) >= len(stamps), 'all of them')
        assert [ns_of(m) for m in made.heard['cmd_vel']] == stamps


def test_a_twist_in_the_world_frame_is_that_of_the_body_where_the_node_is_told_so() -> None:
    # it heads north, and goes there with 2 m/s, 1 m/s to the west and 0.5 m/s up
    x = np.array([0, 0, 0, 0.5**0.5, 0, 0, 0.5**0.5, -1.0, 2.0, 0.5, 0, 0, 0.3])
    with program() as made:
        made.add(FrameConverterNode, {'twist_frame': 'world'})
        made.listen(topics.ODOM)
        made.publish(ENU_ODOM, convert.odometry(5, x, ENU))
        (found,) = made.until(lambda: made.heard['odom'], 'converted odometry')
        assert_allclose(state_of(found)[7:], [2.0, -1.0, -0.5, 0.0, 0.0, -0.3], atol=1e-12)


def test_what_arrives_is_passed_on_at_once(monkeypatch) -> None:
    monkeypatch.setattr(frame_converter_node, 'steady_timer', lambda *_: None)
    with program() as made:
        made.add(FrameConverterNode, {'lockstep': False})
        made.listen(topics.CMD_VEL)
        made.publish(ENU_CMD_VEL, convert.twist(7, [0.1] * 6, ENU))
        made.until(lambda: made.heard['cmd_vel'], 'a converted set-point')


@pytest.mark.parametrize('name', ['rosbag2_recorder', interface.RECORDER])
def test_a_recorder_of_the_wrench_is_no_driver(name: str) -> None:
    with program() as made:
        node = made.add(FrameConverterNode, {'lockstep': False})
        recorder = Node(name, context=made.context)
        try:
            recorder.create_subscription(ENU_WRENCH.type, ENU_WRENCH.name, print, 1)
            made.until(node._commanded.get_subscription_count, 'the recorder')
            made.until(lambda: name in node.get_node_names(), 'its name')
            assert node._untaken() == 'enu_flu/wrench: expected a subscriber, found none'
            made.listen(ENU_WRENCH)
            made.until(lambda: not node._untaken(), 'a driver')
        finally:
            recorder.destroy_node()


@pytest.fixture(scope='module')
def running():
    with graph(('frame_converter_node', [])) as (peer, processes):
        answer = peer.call(Trigger, 'frame_converter_node/ready')
        assert (answer.success, answer.message) == (
            False, 'enu_flu/wrench: expected a subscriber, found none'
        )  # fmt: skip
        peer.listen(topics.ODOM, topics.CMD_VEL, topics.CMD_ACCEL, topics.DIAGNOSTICS, ENU_WRENCH)
        yield peer
        assert stop(processes['frame_converter_node'])[0] == 0


@pytest.fixture
def peer(running):
    running.spin(patience(0.1))  # what is still under way
    for heard in running.heard.values():
        heard.clear()
    return running


def test_set_points_and_wrenches_pass_and_stamps_are_kept(peer) -> None:
    there, here = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0), (1.0, -2.0, -3.0, 4.0, -5.0, -6.0)
    for source, target, make, read, frames in (
        (ENU_CMD_VEL, 'cmd_vel', convert.twist, interface.read_twist, (ENU, NED)),
        (ENU_CMD_ACCEL, 'cmd_accel', convert.accel, interface.read_accel, (ENU, NED)),
        (topics.WRENCH, 'enu_flu/wrench', convert.wrench, interface.read_wrench, (NED, ENU)),
    ):
        peer.publish(source, make(1_234_567_890, there, frames[0]))
        found = peer.until(lambda name=target: peer.heard[name], target)[0]
        assert read(found, frames[1], target) == (1_234_567_890, here)
    assert peer.call(Trigger, 'frame_converter_node/ready').success


@pytest.mark.parametrize(
    ('spoil', 'said'),
    [
        (lambda m: setattr(m.pose.pose.orientation, 'w', 0.5), 'orientation: expected a unit'),
        (lambda m: setattr(m.header, 'frame_id', 'odom_ned'), "header.frame_id: expected 'odom',"),
        (lambda m: setattr(m.twist.twist.linear, 'y', np.nan), 'not finite: expected finite'),
        (lambda m: bytes(serialize_message(m))[:50], 'not a message: expected a serialized Odom'),
    ],
    ids=['quaternion', 'frame', 'nan', 'cut'],
)
def test_broken_odometry_is_refused_counted_and_reported(peer, spoil, said) -> None:
    broken = convert.odometry(1, UPRIGHT, ENU)
    broken = spoil(broken) or broken
    said = f'refused: enu_flu/odom: {said}'

    def reported() -> bool:
        peer.publish(ENU_ODOM, broken)  # best effort: the first ones may be lost
        peer.spin(0.1)
        found = [status for array in peer.heard['/diagnostics'] for status in array.status]
        counts = [int({v.key: v.value for v in s.values}['refused']) for s in found]
        return max(counts, default=0) > 1 and any(said in s.message for s in found)

    peer.until(reported, f'"{said}" in the diagnostics')
    assert not peer.heard['odom'], 'nothing broken is forwarded'
    peer.publish(ENU_ODOM, convert.odometry(4, UPRIGHT, ENU))
    peer.until(lambda: peer.heard['odom'], 'odometry that is right again')
    assert interface.nanoseconds(peer.heard['odom'][0].header.stamp) == 4


def test_a_driver_with_best_effort_is_heard(peer) -> None:
    qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
    output = peer.node.create_publisher(topics.ODOM.type, 'enu_flu/odom', qos)

    def heard() -> bool:
        output.publish(convert.odometry(9, UPRIGHT, ENU))
        return bool(peer.heard['odom'])

    peer.until(heard, 'converted odometry')


@pytest.mark.parametrize(
    ('key', 'value'),
    [('flu_frame', 'base_frd'), ('odom_frame', 'odom_enu'), ('enu_frame', 'odom_ned'),
     ('base_frame', 'base_link_flu')],
)  # fmt: skip
def test_frames_that_name_the_other_side_are_refused(key: str, value: str) -> None:
    with program() as made, pytest.raises(InputError) as caught:
        made.add(FrameConverterNode, {key: value})
    assert (caught.value.key, caught.value.found) == (key, value)


def test_another_twist_frame_is_refused() -> None:
    ended = run_node('frame_converter_node', *parameters(twist_frame='body'))
    assert_one_line(ended, 'twist_frame', 'child, world', 'body')
