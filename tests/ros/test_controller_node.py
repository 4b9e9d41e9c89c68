"""The controller node: what it answers, what it refuses, how it disengages."""

import json
import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Twist
from helpers.node_processes import (
    CONTROLLER,
    GAINS,
    assert_one_line,
    change,
    fresh_domain,
    graph,
    parameters,
    run_node,
    start_node,
    stop,
)
from helpers.nodes_in_process import program
from helpers.patience import patience
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import GetState
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from auv_dynamics.files.errors import ENDING, InputError
from auv_dynamics.ros import convert, interface, topics
from auv_dynamics.ros.interface import Frames
from auv_dynamics.ros.node_interface import ERROR, OK, WARN
from auv_gvc_controller.nodes.controller_node import ControllerNode, Idle

FRAMES = Frames()
STEP = 10_000_000
X = np.array([0, 0, 0, 1, 0, 0, 0, 0.1, 0, 0, 0, 0, 0], float)
GIVEN = {
    'law': 'gvc', 'vehicle': 'herman2018', 'limits.wrench': [1e5], 'gains.k_D': [12.0],
    'gains.k_I': [1.0], 'gains.Lambda': [0.8], 'gains.Gamma': [60.0],
}  # fmt: skip
UNLIMITED = parameters(law='gvc', vehicle='herman2018')
LOCKSTEP = [*CONTROLLER, *parameters(lockstep=True, setpoint_pairing='exact')]


def odometry(k: int, x: np.ndarray = X):
    return convert.odometry(k * STEP, x, FRAMES)


def setpoint(k: int, surge: float = 0.2):
    return convert.twist(k * STEP, (surge, 0, 0, 0, 0, 0), FRAMES)


def stamps(messages: list) -> list[int]:
    return [interface.nanoseconds(m.header.stamp) // STEP for m in messages]


def offer(peer):
    """Answer to an odometry of now; best effort may lose one, so a few follow each other."""

    def answers() -> list:
        ns = time.time_ns()
        peer.publish(topics.ODOM, convert.odometry(ns, X, FRAMES))
        peer.spin(0.1)
        heard = peer.heard['wrench']
        return [m for m in heard if interface.nanoseconds(m.header.stamp) == ns]

    return peer.until(answers, 'an answer')[-1]


def setpoint_of_now(surge: float = 0.2):
    return convert.twist(time.time_ns(), (surge, 0, 0, 0, 0, 0), FRAMES)


@pytest.fixture
def lockstep():
    with graph(('controller_node', LOCKSTEP)) as (peer, processes):
        peer.listen(topics.WRENCH, topics.DISTURBANCE_ESTIMATE)
        peer.until(lambda: peer.node.count_publishers('wrench'), 'a wrench publisher')
        yield peer, processes['controller_node']


def answered(peer, count: int) -> list:
    peer.until(lambda: len(peer.heard['wrench']) >= count, f'{count} wrenches')
    return peer.heard['wrench']


def test_answers_the_odometry_whose_setpoint_has_come(lockstep) -> None:
    peer, _ = lockstep
    peer.publish(topics.ODOM, odometry(0))
    peer.spin(0.3)
    assert not peer.heard['wrench'], 'exact pairing answers nothing before the set-point'
    peer.publish(topics.CMD_VEL, setpoint(0))
    wrench = answered(peer, 1)[0]
    assert stamps([wrench]) == [0]
    assert wrench.header.frame_id == 'base_link_fsd'
    assert wrench.wrench.force.x > 0
    peer.until(lambda: peer.heard['disturbance_estimate'], 'an estimate')


def changed(**parts: float) -> np.ndarray:
    """The state with some of its numbers changed: `x7=1.0`."""
    return np.array([parts.get(f'x{i}', value) for i, value in enumerate(X)])


BAD: dict[str, Callable[[int], Any]] = {  # in place of odometry k
    'nan': lambda k: odometry(k, changed(x7=math.nan)),
    'inf': lambda k: odometry(k, changed(x12=math.inf)),
    'pose frame': lambda k: convert.odometry(k * STEP, X, Frames(odom='map')),
    'child frame': lambda k: convert.odometry(k * STEP, X, Frames(base='base_link')),
    'old stamp': lambda k: odometry(k - 1),
    'far stamp': lambda k: odometry(10**9 + k),
    'no quaternion': lambda k: odometry(k, changed(x3=0.0, x4=0.0, x5=0.0, x6=0.0)),
    'impossible speed': lambda k: odometry(k, changed(x7=1e9)),
}


def test_refuses_broken_odometry_and_goes_on(lockstep) -> None:
    peer, process = lockstep
    peer.listen(topics.DIAGNOSTICS)
    for k in range(len(BAD) + 1):
        peer.publish(topics.CMD_VEL, setpoint(k))
    peer.publish(topics.ODOM, odometry(0))
    answered(peer, 1)
    for k, (kind, broken) in enumerate(BAD.items(), start=1):
        peer.publish(topics.ODOM, broken(k))
        peer.publish(topics.ODOM, odometry(k))
        wrenches = answered(peer, k + 1)
        assert stamps(wrenches) == [*range(k + 1)], kind
        forces = [m.wrench.force.x for m in wrenches[-2:]]
        assert all(map(math.isfinite, forces)), kind
        assert abs(forces[1] - forces[0]) < 100, f'{kind} left no trace'

    def refused() -> int:
        (status,) = peer.heard[topics.DIAGNOSTICS.name][-1].status
        return sum(int(v.value) for v in status.values if v.key.startswith('refused odom'))

    peer.until(lambda: peer.heard[topics.DIAGNOSTICS.name] and refused() == len(BAD), 'the count')
    code, output = stop(process)
    assert code == 0
    assert 'refused: odom' in output
    assert 'expected' in output


@pytest.mark.parametrize('how', ENDING)
def test_ends_on_a_signal(lockstep, how: int) -> None:
    peer, process = lockstep
    peer.publish(topics.CMD_VEL, setpoint(0))
    peer.publish(topics.ODOM, odometry(0))
    answered(peer, 1)  # so that both ends have matched
    peer.publish(topics.ODOM, odometry(1))
    for _ in range(2):  # between two answers it has taken what had come
        state(peer)
    code, _ = stop(process, how)
    assert code == 0
    last = answered(peer, 2)[-1]
    assert stamps([last]) == [1]
    assert last.wrench.force.x == 0


def test_an_incompatible_publisher_is_heard(lockstep) -> None:
    peer, process = lockstep
    peer.listen(topics.DIAGNOSTICS)
    said = peer.heard[topics.DIAGNOSTICS.name]
    peer.until(lambda: said, 'diagnostics')
    weak = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    made = peer.node.create_publisher(topics.ODOM.type, 'odom', weak)
    peer.until(lambda: 'odom: incompatible QoS' in said[-1].status[0].message, 'the report')
    assert 'reliability' in said[-1].status[0].message
    peer.node.destroy_publisher(made)
    peer.until(lambda: 'incompatible' not in said[-1].status[0].message, 'the end of it')
    kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    made = peer.node.create_subscription(topics.WRENCH.type, 'wrench', print, kept)
    conflict = 'wrench: incompatible QoS with another endpoint: durability'
    peer.until(lambda: conflict in said[-1].status[0].message, 'who does not hear it')
    said.clear()
    peer.until(lambda: len(said) > 2, 'more of it')
    assert all(m.status[0].message == conflict for m in said[1:]), 'although another one does'
    peer.node.destroy_subscription(made)
    _, output = stop(process)
    assert 'odom: incompatible QoS' in output


def test_a_second_odometry_and_a_second_controller_are_named_while_they_last() -> None:
    domain = fresh_domain()
    with graph(('controller_node', CONTROLLER), domain=domain) as (peer, _):
        peer.listen(topics.DIAGNOSTICS)
        said = peer.heard[topics.DIAGNOSTICS.name]

        def errors() -> str:
            heard = [s for m in said[-4:] for s in m.status if s.level == b'\x02']
            return '; '.join(status.message for status in heard)

        first, second = (peer.node.create_publisher(topics.ODOM.type, 'odom', 10) for _ in '12')
        other = start_node('controller_node', domain, *CONTROLLER)  # of the same name
        peer.until(
            lambda: '/odom: expected one publisher, found /test_peer, /test_peer' in errors()
        )
        crowd = '/wrench: expected one publisher, found /controller_node, /controller_node'
        peer.until(lambda: crowd in errors(), 'both controllers')
        stop(other)
        peer.node.destroy_publisher(second)
        said.clear()
        peer.until(lambda: len(said) > 4 and not errors(), 'the end of it')
        peer.node.destroy_publisher(first)


def explained(peer, level: bytes, said: str, *published: tuple[topics.Topic, Any]) -> None:
    """Offer odometry and more until the diagnostics say something, with that level.

    A machine that stands still for a moment may make it an error first: that odometry is old.
    """
    heard = peer.heard[topics.DIAGNOSTICS.name]
    peer.until(lambda: heard, 'the node to have begun')
    outputs = [(peer.node.create_publisher(t.type, t.name, 10), made) for t, made in published]
    odom = peer.node.create_publisher(topics.ODOM.type, 'odom', 10)
    begun = len(heard)

    def told() -> list:
        ns = time.time_ns()
        for output, make in outputs:
            output.publish(make(ns))
        odom.publish(convert.odometry(ns, X, FRAMES))
        peer.spin(0.02)
        statuses = [s for m in heard[begun:] for s in m.status]
        return [s for s in statuses if said in s.message and s.level == level]

    found = peer.until(told, f'{said} with level {level}')[-1]
    for output, _ in [*outputs, (odom, None)]:
        peer.node.destroy_publisher(output)
    assert found.hardware_id == 'herman2018'


def test_mistakes_with_set_points_are_explained() -> None:
    plain = topics.Topic('cmd_vel', Twist)
    # no pause of a busy machine is as long as these
    long = parameters(odometry_timeout=patience(30.0), limits__gap=patience(30.0))
    with graph(('controller_node', [*CONTROLLER, *long])) as (peer, processes):
        peer.listen(topics.DIAGNOSTICS)
        explained(peer, WARN, 'nobody publishes /cmd_vel')
        named = 'expected geometry_msgs/msg/TwistStamped, found geometry_msgs/msg/Twist of '
        named += '/test_peer; publish it with a header'
        explained(peer, WARN, named, (plain, lambda _: Twist()))
        code, output = stop(processes['controller_node'])
    assert code == 0
    assert 'begins: tracks cmd_vel with gvc in real time' in output
    assert 'ends with exit code 0: tracks cmd_vel' in output
    assert 'ERROR' not in output, 'a normal start and end'
    assert 'engages' not in output, 'it never was in charge'


def test_stamps_of_set_points_without_a_time_are_explained() -> None:
    unstamped = topics.CMD_VEL, lambda _: convert.twist(0, (0.1, 0, 0, 0, 0, 0), FRAMES)
    with program() as peer:
        peer.add(ControllerNode, GIVEN)
        peer.listen(topics.DIAGNOSTICS)
        explained(peer, ERROR, 'found stamp 0', unstamped)  # they are refused as well


def test_a_set_point_that_waits_for_its_acceleration_is_explained() -> None:
    with program() as peer:
        peer.add(ControllerNode, {**GIVEN, 'setpoint_acceleration': 'topic'})
        peer.listen(topics.DIAGNOSTICS)
        moving = topics.CMD_VEL, lambda ns: convert.twist(ns, (0.1, 0, 0, 0, 0, 0), FRAMES)
        waits = 'setpoint_acceleration: topic waits for it'
        explained(peer, WARN, f'nobody publishes /cmd_accel; {waits}', moving)
        foreign = topics.CMD_ACCEL, lambda ns: convert.accel(ns, (0.0,) * 6, Frames(base='x'))
        explained(peer, ERROR, f'no cmd_accel of its stamp comes; {waits}', moving, foreign)


def state(peer) -> str:
    return peer.call(GetState, 'controller_node/get_state').current_state.label


def set_parameter(peer, name: str, value: ParameterValue):
    request = SetParameters.Request(parameters=[Parameter(name=name, value=value)])
    return peer.call(SetParameters, 'controller_node/set_parameters', request).results[0]


def test_lifecycle_gains_are_taken_while_inactive_only() -> None:
    with program() as peer:
        node = peer.add(ControllerNode, [*CONTROLLER, *parameters(autostart=False)])
        peer.listen(topics.DIAGNOSTICS)
        assert state(peer) == 'unconfigured'
        assert change(peer, Transition.TRANSITION_CONFIGURE)
        doubles = ParameterValue(type=8, double_array_value=[20.0])
        assert set_parameter(peer, 'gains.k_D', doubles).successful
        wrong = ParameterValue(type=8, double_array_value=[20.0, 1.0])
        assert not set_parameter(peer, 'gains.k_D', wrong).successful
        assert set_parameter(peer, 'law', ParameterValue(type=4, string_value='cl')).successful
        assert change(peer, Transition.TRANSITION_ACTIVATE)
        refused = set_parameter(peer, 'gains.k_D', doubles)
        assert not refused.successful
        assert 'inactive' in refused.reason
        assert change(peer, Transition.TRANSITION_DEACTIVATE)
        lower = ParameterValue(type=8, double_array_value=[7.0])
        assert set_parameter(peer, 'gains.k_D', lower).successful
        faster = ParameterValue(type=3, double_value=0.1)
        assert set_parameter(peer, 'ramp', faster).successful
        assert change(peer, Transition.TRANSITION_ACTIVATE)
        assert change(peer, Transition.TRANSITION_DEACTIVATE)

        def said() -> set[tuple[str, float, str]]:
            status = [message.status[0] for message in peer.heard[topics.DIAGNOSTICS.name]]
            facts = [{one.key: one.value for one in entry.values} for entry in status]
            return {(told['law'], json.loads(told['gains'])['k_D'][0], told['changed'])
                    for told in facts if told.get('active') == 'True'}  # fmt: skip

        laws = {('cl', 20.0, '{}'), ('cl', 7.0, '{"ramp": 0.1}')}
        peer.until(lambda: said() == laws, 'each law, however short')
        assert node.task == 'tracks cmd_vel with cl in real time'


def test_limits_and_timeouts_are_taken_while_inactive_only() -> None:
    with program() as peer:
        node = peer.add(ControllerNode, [*LOCKSTEP, *parameters(autostart=False)])
        peer.listen(topics.WRENCH)
        assert change(peer, Transition.TRANSITION_CONFIGURE)
        five = ParameterValue(type=8, double_array_value=[5.0])
        assert set_parameter(peer, 'limits.wrench', five).successful
        two = ParameterValue(type=8, double_array_value=[5.0, 1.0])
        reason = set_parameter(peer, 'limits.wrench', two).reason
        assert reason.startswith('limits.wrench: expected 1 or 6')
        reason = set_parameter(peer, 'gains.k_D', two).reason
        assert reason == 'gains.k_D: expected 1, 6 or 36 finite numbers, found 2 numbers'
        second = ParameterValue(type=3, double_value=1.0)
        for name in ('odometry_timeout', 'setpoint_timeout', 'ramp', 'limits.speed'):
            assert set_parameter(peer, name, second).successful
        for name, words in (('stamp_clock', 'auto, ros, own'), ('actuators.saturation', 'scaled')):
            wrong = set_parameter(peer, name, ParameterValue(type=4, string_value='rubbish'))
            assert not wrong.successful
            assert wrong.reason.startswith(f'{name}: expected one of {words}')
        decides = set_parameter(peer, 'lockstep', ParameterValue(type=1, bool_value=False))
        assert not decides.successful, 'it decides what is subscribed'
        assert change(peer, Transition.TRANSITION_ACTIVATE)
        refused = set_parameter(peer, 'limits.wrench', five)
        assert 'inactive' in refused.reason
        fast = convert.twist(STEP, (1.5, 0, 0, 0, 0, 0), FRAMES)
        peer.publish(topics.CMD_VEL, fast)  # refused: 1 m/s at most
        peer.publish(topics.CMD_VEL, setpoint(0))
        peer.publish(topics.ODOM, odometry(0))
        assert answered(peer, 1)[0].wrench.force.x == 5.0
        assert [*node.graph.refused] == ['cmd_vel: twist.linear']


def test_a_transition_that_does_not_exist_is_refused() -> None:
    with graph(('controller_node', CONTROLLER)) as (peer, processes):
        peer.until(lambda: state(peer) == 'active', 'activation')
        assert not change(peer, Transition.TRANSITION_ACTIVATE)
        assert state(peer) == 'active'
        _, output = stop(processes['controller_node'])
    assert 'No transition' in output


@pytest.mark.parametrize(
    ('arguments', 'key', 'expected'),
    [
        ([*parameters(vehicle='herman2018'), *GAINS], 'law', 'smc, multisine or module:Class'),
        ([*parameters(law='gvc'), *GAINS], 'vehicle', 'a vehicle file'),
        (parameters(law='gvc', vehicle='herman2018'), 'gains.k_D', 'a number'),
        ([*UNLIMITED, *GAINS], 'limits.wrench', 'the largest wrench'),
        ([*CONTROLLER, *parameters(limits__wrench='[0.0]')], 'limits.wrench', 'one above'),
        ([*CONTROLLER, *parameters(setpoint_filter__zeta=0.1)], 'setpoint_filter.zeta', '0.5'),
        ([*CONTROLLER, *parameters(gains__k_D='[1.0, 2.0]')], 'gains.k_D', '1, 6 or 36'),
        ([*CONTROLLER, *parameters(gains__k_P='[1.0]')], 'gains.k_P', 'k_D, k_I, Lambda, Gamma'),
        ([*CONTROLLER, *parameters(lockstop=True)], 'lockstop', 'one of'),
        ([*CONTROLLER, *parameters(lockstep='maybe')], 'lockstep', 'true or false'),
        ([*CONTROLLER, *parameters(setpoint_pairing='some')], 'setpoint_pairing', 'exact, latest'),
        ([*CONTROLLER, *parameters(law='nonsense')], 'law', 'smc, multisine or module:Class'),
        ([*CONTROLLER, *parameters(vehicle='nothing')], 'nothing', 'herman2018'),
    ],
)
def test_wrong_parameters_end_in_one_line(arguments: list[str], key: str, expected: str) -> None:
    assert_one_line(run_node('controller_node', *arguments), key, expected)


@pytest.mark.parametrize('key', ['odometry_timeout', 'limits.gap', 'limits.acceleration'])
def test_numbers_that_overflow_are_refused_by_their_names(key: str) -> None:
    with program() as made, pytest.raises(InputError) as caught:
        made.add(ControllerNode, {**GIVEN, key: 1e308})
    assert (caught.value.key, caught.value.found) == (key, '1e+308')


@pytest.mark.parametrize(
    'told', [{'limits__wrench': '[5.0]'}, {'actuators__limit': '[5.0]'}], ids=['clips', 'knows']
)
def test_integrals_stop_at_the_limits_that_are_known(told) -> None:
    """The adaptive term of surge stays zero while its wrench is cut, that of an idle axis too."""
    arguments = [*LOCKSTEP, *parameters(**told)]
    with graph(('controller_node', arguments)) as (peer, _):
        peer.listen(topics.WRENCH, topics.DISTURBANCE_ESTIMATE)
        peer.until(lambda: peer.node.count_publishers('wrench'), 'a wrench publisher')
        for k in range(5):
            peer.publish(topics.CMD_VEL, setpoint(k))
            peer.publish(topics.ODOM, odometry(k))
            answered(peer, k + 1)
        estimates = peer.heard['disturbance_estimate']
        peer.until(lambda: len(estimates) == 5, 'estimates')
        assert [m.wrench.force.x for m in estimates] == [0.0] * 5
        clipped = 'limits__wrench' in told
        assert all((m.wrench.force.x == 5.0) == clipped for m in peer.heard['wrench'])


def test_without_anti_windup_they_do_not_stop() -> None:
    arguments = [*LOCKSTEP, *parameters(limits__wrench='[5.0]', anti_windup=False)]
    with program() as peer:
        peer.add(ControllerNode, arguments)
        peer.listen(topics.WRENCH, topics.DISTURBANCE_ESTIMATE)
        peer.until(lambda: peer.node.count_publishers('wrench'), 'a wrench publisher')
        for k in range(3):
            peer.publish(topics.CMD_VEL, setpoint(k))
            peer.publish(topics.ODOM, odometry(k))
            answered(peer, k + 1)
        estimates = peer.heard['disturbance_estimate']
        peer.until(lambda: len(estimates) == 3, 'estimates')
        assert estimates[-1].wrench.force.x > 0.0


def test_thrusters_that_the_vehicle_has_not_are_refused() -> None:
    extra = parameters(actuators__thrusters=True)
    assert_one_line(run_node('controller_node', *CONTROLLER, *extra), 'actuators.thrusters')


@pytest.mark.parametrize('limit', ['limits__wrench', 'actuators__limit'])
def test_in_real_time_nothing_beyond_the_limit_is_published(limit: str) -> None:
    told = parameters(**{limit: '[5.0]'}, ramp=0.0, setpoint_timeout=patience(60.0))
    with graph(('controller_node', [*UNLIMITED, *GAINS, *told])) as (peer, _):
        peer.listen(topics.WRENCH)
        peer.until(lambda: peer.node.count_publishers('wrench'), 'a wrench publisher')
        peer.publish(topics.CMD_VEL, setpoint_of_now(2.0))
        peer.spin(0.1)
        peer.until(lambda: offer(peer).wrench.force.x == 5.0, 'the limit')
        assert max(abs(m.wrench.force.x) for m in peer.heard['wrench']) == 5.0


def test_what_nobody_upstream_can_mend_is_an_error() -> None:
    idle = Idle(None, derivative=False)
    assert idle.health('', 5) == (OK, '')
    assert idle.health('the law answers nan', 5) == (ERROR, 'the law answers nan')


def test_stamps_far_from_those_of_odometry_are_explained_and_near_ones_are_not() -> None:
    idle, said = Idle(None, derivative=True), 'no set-point for 2 s'
    for topic in (topics.CMD_VEL, topics.CMD_ACCEL):
        idle.hear(topic, 10**10)
    for near in (9 * 10**9, 11 * 10**9):
        assert idle.health(said, near) == (WARN, said)
    for far in (8 * 10**9, 12 * 10**9):
        level, text = idle.health(said, far)
        assert level == WARN
        assert text.startswith(f'{said}: cmd_vel: expected')
        assert text.endswith('found stamps 2 s apart from those of odom')
