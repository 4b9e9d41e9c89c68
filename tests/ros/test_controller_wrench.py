"""The wrench of the controller node, to its last digits that of the independent implementation."""

import json
import re
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import herman_reference as reference
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from helpers import nodes_in_process as by_hand
from helpers.nodes_in_process import Program, program, quaternion_of, write_vehicle
from helpers.patience import patience
from numpy.testing import assert_allclose
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter
from reference_cases import off_centre
from std_srvs.srv import Trigger

from auv_dynamics.ros import topics
from auv_gvc_controller.control.controller import FEWEST
from auv_gvc_controller.nodes.controller_node import ControllerNode

STEP = 20_000_000
STEPS = 4
PER_AXIS = {
    'k_D': [8.0, 10, 12, 6, 9, 11], 'k_I': [1.0, 2, 3, 4, 5, 6],
    'Lambda': [0.5, 0.6, 0.7, 0.8, 0.9, 1], 'Gamma': [30.0, 40, 50, 60, 70, 80],
}  # fmt: skip
LAWS: dict[str, dict[str, list[float]]] = {
    'gvc': PER_AXIS,
    'cl': {gain: [100.0 * value for value in row] for gain, row in PER_AXIS.items()},
    'pid': {
        'k_P': [4e3, 5e3, 6e3, 700, 800, 900], 'k_I': [2e3, 1e3, 500, 400, 300, 200],
        'k_D': [50.0, 60, 70, 8, 9, 10], 'omega_f': [20.0, 18, 16, 14, 12, 10],
        'k_FF': [1.0, 0.9, 0.8, 0.7, 0.6, 0.5],
    },
    'smc': {
        'k_D': [4e3, 5e3, 6e3, 700, 800, 900], 'Lambda': PER_AXIS['Lambda'],
        'Gamma': [9e3, 8e3, 7e3, 600, 500, 400], 'k_S': [100.0, 90, 80, 7, 6, 5],
        'phi': [0.05, 0.06, 0.07, 0.08, 0.09, 0.1],
    },
}  # fmt: skip
EXACT = {
    'lockstep': True, 'setpoint_pairing': 'exact', 'setpoint_acceleration': 'topic',
    'limits.acceleration': 1e4,
}  # fmt: skip
RNG = np.random.default_rng(5)
ETA = np.concatenate([RNG.uniform(-5, 5, (400, 3)), RNG.uniform(-0.6, 0.6, (400, 3))], axis=1)
NU, NU_D, NU_D_DOT = (RNG.uniform(-1, 1, (400, 6)) * size for size in (0.8, 1.0, 0.5))
KNOWN = reference.vehicle_matrices(off_centre())


@pytest.fixture(scope='module')
def vehicle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_vehicle(tmp_path_factory.mktemp('vehicle'), off_centre())


@pytest.fixture
def made() -> Iterator[Program]:
    with program() as new:
        new.listen(topics.WRENCH, topics.DISTURBANCE_ESTIMATE)
        yield new


def controller(made: Program, vehicle: Path, law: str, **settings: Any) -> ControllerNode:
    given = {f'gains.{gain}': list(map(float, row)) for gain, row in LAWS[law].items()}
    node = made.add(
        ControllerNode, {'law': law, 'vehicle': str(vehicle), **EXACT, **given, **settings}
    )
    made.until(lambda: made.node.count_publishers('wrench'), 'a controller')
    return node


def offered(made: Program, k: int, waited_for: Callable[[], Any] = lambda: None) -> None:
    """Set-point, acceleration and odometry of step k; `waited_for` is done; the answer has come."""
    rotation = reference.jacobian(ETA[k])[:3, :3]
    state = [*ETA[k, :3], *quaternion_of(rotation), *NU[k]]
    for topic, row in ((topics.CMD_VEL, NU_D[k]), (topics.CMD_ACCEL, NU_D_DOT[k])):
        made.publish(topic, by_hand.six(topic.type, k * STEP, row))
    count = len(made.heard['wrench'])
    made.publish(topics.ODOM, by_hand.odometry(k * STEP, state))
    waited_for()
    made.until(lambda: len(made.heard['disturbance_estimate']) > count, f'answer {k}')
    made.until(lambda: len(made.heard['wrench']) > count, f'wrench {k}')


def expected(law: str, gains: dict[str, Any], first: int, count: int) -> list[tuple]:
    """(tau, f) of some steps, from zero integrals, by the independent implementation."""
    entry = {gain: reference.square(np.squeeze(row)) for gain, row in gains.items()}
    size, at = reference.control_law(KNOWN, {'law': law, **entry})
    x, rate, said = np.zeros(size), np.zeros(size), []
    for k in range(first, first + count):
        x = x + rate * STEP / 1e9
        g = reference.restoring(KNOWN, ETA[k])
        tau, rate, f = at(NU[k], NU_D[k], NU_D_DOT[k], g)(x)
        said.append((tau, f))
    return said


def answers_as(
    made: Program, law: str, gains: dict[str, Any], first: int, limit: Any = np.inf
) -> None:
    """Offer some steps from zero integrals; every axis of each answer is as it should be."""
    for k in range(first, first + STEPS):
        offered(made, k)
    wrenches = made.heard['wrench'][-STEPS:]
    estimates = made.heard['disturbance_estimate'][-STEPS:]
    said = expected(law, gains, first, STEPS)
    for i, (tau, f) in enumerate(said):
        for message, values in ((wrenches[i], np.clip(tau, -limit, limit)), (estimates[i], f)):
            assert by_hand.ns_of(message) == (first + i) * STEP
            assert by_hand.frames_of(message) == ('base_link_fsd',)
            scale = np.abs(values).max()
            assert_allclose(by_hand.six_of(message), values, rtol=1e-9, atol=1e-9 * scale)


def change(node: ControllerNode, **values: Any) -> None:
    """Change parameters while the controller is inactive."""
    assert node.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
    given = [Parameter(name.replace('__', '.'), value=v) for name, v in values.items()]
    assert all(result.successful for result in node.set_parameters(given))
    assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS


def test_a_set_point_of_before_is_not_followed_after_an_activation(made, vehicle, capfd) -> None:
    """One that lies ahead is: in lock-step it was published once, for a step that comes."""
    held = {'setpoint_pairing': 'latest', 'setpoint_acceleration': 'none'}
    node, answered = controller(made, vehicle, 'gvc', **held), []
    for k in (0, 2):
        made.publish(topics.CMD_VEL, by_hand.six(topics.CMD_VEL.type, k * STEP, NU_D[0]))
    for k in range(3):
        made.publish(topics.ODOM, by_hand.odometry(k * STEP, [*ETA[0, :3], 1, 0, 0, 0, *NU[0]]))
        made.until(lambda k=k: len(made.heard['wrench']) > k, f'wrench {k}')
        answered.append(any(by_hand.six_of(made.heard['wrench'][-1])))
        change(node)
    assert answered == [True, False, True]
    said = capfd.readouterr().err
    assert 'tracks cmd_vel with gvc in lock-step' in said
    assert len(re.findall(r'\[ERROR\].*no set-point', said)) == 1, 'nothing is late there'


@pytest.mark.parametrize('law', LAWS)
def test_each_gain_that_is_changed_while_inactive_is_taken(made, vehicle, law: str) -> None:
    node, gains, k = controller(made, vehicle, law), dict(LAWS[law]), 0
    answers_as(made, law, gains, k)
    for gain, row in LAWS[law].items():
        k += STEPS
        gains[gain] = [1.5 * value + 0.1 for value in reversed(row)]
        change(node, **{f'gains__{gain}': gains[gain]})
        answers_as(made, law, gains, k)


def test_a_law_that_is_changed_while_inactive_is_taken(made, vehicle) -> None:
    node = controller(made, vehicle, 'gvc')
    answers_as(made, 'gvc', PER_AXIS, 0)
    change(node, law='cl')
    answers_as(made, 'cl', PER_AXIS, STEPS)
    change(node, law='gvc', gains__k_D=[7.0])
    answers_as(made, 'gvc', PER_AXIS | {'k_D': [7.0]}, 2 * STEPS)
    change(node, law='pid', gains__k_P=[5e3])  # its other gains have defaults
    assert {*json.loads(node.graph.facts['gains'])} == {'k_P', 'k_I', 'k_D'}


@pytest.mark.parametrize(('before', 'after'), [('gvc', 'pid'), ('pid', 'smc'), ('smc', 'cl')])
def test_a_law_with_other_gains_is_taken_while_inactive(made, vehicle, before, after) -> None:
    node = controller(made, vehicle, before)
    answers_as(made, before, LAWS[before], 0)
    gains = {f'gains__{gain}': list(map(float, row)) for gain, row in LAWS[after].items()}
    change(node, law=after, **gains)
    answers_as(made, after, LAWS[after], STEPS)
    assert json.loads(node.graph.facts['gains']) == LAWS[after]


def test_in_lock_step_odometry_of_an_inactive_one_is_answered_once_it_is_active(made, vehicle):
    """The plant publishes it once and waits: a change of gains in a run ended it."""
    node = controller(made, vehicle, 'gvc')
    answers_as(made, 'gvc', PER_AXIS, 0)

    def change_once_it_came() -> None:
        made.until(lambda: node._missed, 'the odometry')
        made.spin(0.1)
        assert len(made.heard['wrench']) == STEPS, 'inactive, it says nothing'
        assert node.set_parameters([Parameter('gains.k_D', value=[7.0])])[0].successful
        assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS

    assert node.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
    offered(made, STEPS, change_once_it_came)
    change(node, gains__k_D=[7.0])
    ((tau, _),) = expected('gvc', PER_AXIS | {'k_D': [7.0]}, STEPS, 1)
    assert_allclose(by_hand.six_of(made.heard['wrench'][-1]), tau, rtol=1e-9)
    answers_as(made, 'gvc', PER_AXIS | {'k_D': [7.0]}, STEPS + 1)
    assert len(made.heard['wrench']) == 2 * STEPS + 1, 'and that once'
    assert node.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
    made.publish(topics.ODOM, by_hand.odometry(9 * STEP, [*ETA[0, :3], 1, 0, 0, 0, *[1e6] * 6]))
    made.until(lambda: node._missed, 'an odometry that is not believed')
    assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
    assert [*node.graph.refused] == ['odom: twist.linear']


def test_limits_that_are_changed_while_inactive_are_taken(made, vehicle) -> None:
    node = controller(made, vehicle, 'gvc', anti_windup=False)
    small, large = [50.0, 60.0, 70.0, 8.0, 9.0, 10.0], [500.0, 400.0, 300.0, 90.0, 80.0, 70.0]
    for i, limit in enumerate((small, large)):
        change(node, limits__wrench=limit)
        answers_as(made, 'gvc', PER_AXIS, i * STEPS, np.array(limit))


def test_integrals_begin_anew_with_an_activation_and_with_a_reset(made, vehicle) -> None:
    """Rival controllers keep them over a deactivation (ros2_controllers#1840)."""
    node = controller(made, vehicle, 'gvc')
    answers_as(made, 'gvc', PER_AXIS, 0)
    change(node)
    answers_as(made, 'gvc', PER_AXIS, STEPS)
    assert made.call(Trigger, 'controller_node/reset').success
    answers_as(made, 'gvc', PER_AXIS, 2 * STEPS)
    assert len(made.heard['wrench']) == 3 * STEPS, 'in lock-step it left nothing unanswered'


def test_a_gain_may_be_one_number_six_or_a_matrix(made, vehicle) -> None:
    node = controller(made, vehicle, 'gvc')
    full = np.diag([8.0, 10, 12, 6, 9, 11]) + np.arange(36.0).reshape(6, 6) / 20
    for i, value in enumerate((full, np.array([9.0]))):
        change(node, gains__k_D=value.ravel().tolist())
        gains = PER_AXIS | {'k_D': full if i == 0 else [9.0]}
        answers_as(made, 'gvc', gains, i * STEPS)


def test_it_is_ready_while_it_is_active(made, vehicle) -> None:
    node = controller(made, vehicle, 'gvc', autostart=False)

    def ready() -> tuple[bool, str]:
        answer = made.call(Trigger, 'controller_node/ready')
        return answer.success, answer.message

    assert ready() == (False, 'inactive')
    assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    assert ready() == (False, 'inactive')
    assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
    assert ready() == (True, 'ready')
    answers_as(made, 'gvc', PER_AXIS, 0)
    change(node)
    assert node.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
    assert ready() == (False, 'inactive')
    assert node.trigger_cleanup() == TransitionCallbackReturn.SUCCESS
    assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
    answers_as(made, 'gvc', PER_AXIS, STEPS)


def test_a_law_that_is_still_to_come_is_said_at_the_start(made, vehicle, capfd) -> None:
    made.add(ControllerNode, {'vehicle': str(vehicle), **EXACT, 'autostart': False})
    assert 'begins: tracks cmd_vel with a law in lock-step' in capfd.readouterr().err


def test_before_it_is_configured_it_hears_and_resets_nothing(made, vehicle) -> None:
    node = controller(made, vehicle, 'gvc', autostart=False)
    for topic in (topics.CMD_VEL, topics.CMD_ACCEL):
        made.publish(topic, by_hand.six(topic.type, 0, NU_D[0]))
    made.publish(topics.ODOM, by_hand.odometry(0, [*ETA[0, :3], 1, 0, 0, 0, *NU[0]]))
    assert made.call(Trigger, 'controller_node/reset').success
    made.spin(0.2)
    assert not made.heard['wrench']
    for law, configured in (('pid', 'FAILURE'), ('gvc', 'SUCCESS')):  # it has the gains of this one
        assert node.set_parameters([Parameter('law', value=law)])[0].successful
        assert node.trigger_configure() == getattr(TransitionCallbackReturn, configured)


def test_what_is_missing_at_an_activation_is_told_and_leaves_it_inactive(made, vehicle) -> None:
    node = controller(made, vehicle, 'gvc')
    assert node.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
    assert node.set_parameters([Parameter('law', value='pid')])[0].successful
    assert node.trigger_activate() == TransitionCallbackReturn.FAILURE
    assert 'found an unknown gain' in node.graph.trouble
    assert not made.call(Trigger, 'controller_node/ready').success
    assert node.set_parameters([Parameter('law', value='gvc')])[0].successful
    assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS


def test_an_error_while_it_leaves_still_leaves_no_wrench(made, vehicle, monkeypatch) -> None:
    node = controller(made, vehicle, 'gvc', **BESIDE)
    disengage, calls = node._disengage, []

    def first_fails() -> None:
        calls.append('disengaged')
        if len(calls) == 1:
            raise KeyError('what nobody thought of')
        disengage()

    monkeypatch.setattr(node, '_disengage', first_fails)
    assert node.trigger_deactivate() == TransitionCallbackReturn.ERROR
    made.until(lambda: made.heard['wrench'], 'a zero wrench')
    assert by_hand.six_of(made.heard['wrench'][-1]) == [0.0] * 6
    assert not made.call(Trigger, 'controller_node/ready').success


@pytest.mark.parametrize(
    ('name', 'value', 'reason'),
    [
        ('gains.k_D', [1.0, 2.0, 3.0, 4.0, 5.0, float('inf')], 'gains.k_D: expected 1, 6 or 36'),
        ('law', 'nonsense', 'law: '),
    ],
)
def test_a_change_to_what_no_law_can_use_is_refused(made, vehicle, name, value, reason) -> None:
    node = controller(made, vehicle, 'gvc', autostart=False)
    (result,) = node.set_parameters([Parameter(name, value=value)])
    assert not result.successful
    assert result.reason.startswith(reason)


def test_what_is_not_of_the_controller_may_change_while_it_is_active(made, vehicle) -> None:
    node = controller(made, vehicle, 'gvc')
    other = Parameter('use_sim_time', value=False)
    assert node.set_parameters([other])[0].successful
    beside = node.set_parameters_atomically([other, Parameter('gains.k_D', value=[5.0])])
    assert beside.reason == 'gains.k_D: expected an inactive controller, found an active one'


def test_the_law_that_was_named_at_the_start_may_be_named_again(made) -> None:
    node = made.add(ControllerNode, {'law': 'nowhere:Law', 'autostart': False})
    (result,) = node.set_parameters([Parameter('law', value='nowhere:Law')])
    assert 'No module named' in result.reason, 'it is looked for'


STILL = {  # without integrals and filter: the wrench of a state stays what it is
    **PER_AXIS, 'k_I': [0.0], 'Lambda': [1e-9], 'Gamma': [0.0],
}  # fmt: skip
BESIDE = {
    'lockstep': False, 'setpoint_pairing': 'latest', 'setpoint_acceleration': 'none',
    'limits.wrench': [1e5, 2e5, 3e5, 4e5, 5e5, 20.0], 'ramp': 0.1,
    'odometry_timeout': patience(0.3), 'setpoint_timeout': patience(0.3),
}  # fmt: skip
OK, WARN, STALE = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.STALE


class Vehicle:
    """One that stands still in one state beside a controller, and an operator."""

    def __init__(self, made: Program):
        self.made, self.says = made, {topics.ODOM, topics.CMD_VEL}
        made.listen(topics.DIAGNOSTICS)

    def step(self) -> None:
        """What both say at one moment."""
        now = time.time_ns()
        state = [*ETA[0, :3], *quaternion_of(reference.jacobian(ETA[0])[:3, :3]), *NU[0]]
        if topics.CMD_VEL in self.says:
            self.made.publish(topics.CMD_VEL, by_hand.six(topics.CMD_VEL.type, now, NU_D[0]))
        if topics.ODOM in self.says:
            self.made.publish(topics.ODOM, by_hand.odometry(now, state))
        self.made.spin(0.02)

    def until(self, done: Callable[[], Any], what: str) -> Any:
        limit = time.monotonic() + patience(30.0)
        while not (found := done()):
            assert time.monotonic() < limit, what
            self.step()
        return found

    def gets(self, wrench: Any) -> None:
        """Go on until the wrench is this one, every axis."""
        heard, seen = self.made.heard['wrench'], len(self.made.heard['wrench'])
        close = partial(np.allclose, b=wrench, rtol=1e-6, atol=1e-6)
        self.until(
            lambda: len(heard) > seen + 1 and close(by_hand.six_of(heard[-1])), f'wrench {wrench}'
        )

    def is_told(self, level: bytes, said: str, **facts: str) -> None:
        """Go on until the diagnostics say this."""
        heard, seen = self.made.heard['/diagnostics'], len(self.made.heard['/diagnostics'])

        def told() -> bool:
            for message in heard[seen:]:
                (status,) = message.status
                found = {pair.key.replace(' ', '_'): pair.value for pair in status.values}
                if (status.level, found | facts) == (level, found) and said in status.message:
                    return True
            return False

        self.until(told, f'{said}, {facts}')


def test_silence_in_real_time_gives_zero_wrench_is_explained_and_it_comes_back(
    made, vehicle, capfd
) -> None:
    gains = {f'gains.{gain}': [*map(float, row)] for gain, row in STILL.items()}
    node = controller(made, vehicle, 'gvc', **BESIDE, **gains)
    ship, zero = Vehicle(made), [0.0] * 6
    entry = {gain: reference.square(np.squeeze(row)) for gain, row in STILL.items()}
    size, at = reference.control_law(KNOWN, {'law': 'gvc', **entry})
    g = reference.restoring(KNOWN, ETA[0])
    tau, _, _ = at(NU[0], NU_D[0], np.zeros(6), g)(np.zeros(size))
    limit = np.array(BESIDE['limits.wrench'])
    tau = np.clip(tau, -limit, limit)
    assert abs(tau[5]) == limit[5]
    assert np.abs(tau[:5]).min() > 1.0
    ship.says = set()
    ship.is_told(STALE, 'no odometry yet: nobody publishes /odom', active='True', watchdog='none')
    ship.says = {topics.ODOM}
    ship.gets(zero)
    ship.is_told(WARN, 'no set-point yet: nobody publishes /cmd_vel', watchdog='no set-point yet')
    ship.says = {topics.ODOM, topics.CMD_VEL}
    ship.gets(tau)
    ship.is_told(OK, 'ok', watchdog='none', watchdog_trips='0', refused='0')
    stamps = {by_hand.ns_of(message) for message in made.heard['wrench']}
    assert by_hand.ns_of(made.heard['/diagnostics'][-1]) in stamps, 'of the newest answer'
    silences = (topics.ODOM, STALE, 'no odometry for'), (topics.CMD_VEL, WARN, 'no set-point for')
    for i, (silent, level, said) in enumerate(silences, start=1):
        ship.says.discard(silent)
        ship.until(lambda: by_hand.six_of(made.heard['wrench'][-1]) == zero, 'a zero wrench')
        ship.is_told(level, said, watchdog_trips=str(i))
        ship.says.add(silent)
        ship.gets(tau)
        ship.is_told(OK, 'ok', watchdog='none', watchdog_trips=str(i))
    assert node.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
    made.until(lambda: by_hand.six_of(made.heard['wrench'][-1]) == zero, 'a zero wrench')
    count = len(made.heard['wrench'])
    ship.is_told(OK, 'ok', active='False')
    assert len(made.heard['wrench']) == count, 'inactive, it says nothing'
    assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
    ship.gets(tau)
    assert node.trigger_shutdown() == TransitionCallbackReturn.SUCCESS
    made.until(lambda: by_hand.six_of(made.heard['wrench'][-1]) == zero, 'a zero wrench')
    told = re.findall('engages|disengages', capfd.readouterr().err)
    assert told == ['engages', 'disengages'] * (len(told) // 2), 'each change is said, and once'
    assert len(told) >= 8


@pytest.mark.parametrize('returns', [False, True])
@pytest.mark.parametrize('lockstep', [True, False])
def test_an_answer_that_is_held_back_is_zero_where_the_controller_leaves(
    made, vehicle, capfd, lockstep, returns
) -> None:
    settings = {'lockstep': lockstep, 'setpoint_pairing': 'latest', 'setpoint_timeout': 60.0}
    settings |= {'setpoint_acceleration': 'none', 'odometry_timeout': 60.0, 'limits.wrench': [1e4]}
    settings |= {'ramp': 0.0, 'expected_subscribers': ['wrench=2']}
    node = controller(made, vehicle, 'gvc', **settings)
    made.publish(topics.CMD_VEL, by_hand.six(topics.CMD_VEL.type, 3 * STEP, NU_D[0]))
    made.until(lambda: node._idle._heard, 'the set-point')
    made.publish(topics.ODOM, by_hand.odometry(3 * STEP, [*ETA[0, :3], 1, 0, 0, 0, *NU[0]]))
    made.until(lambda: node._held is not None and any(node._held[0].tau), 'an answer')
    assert node.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
    if returns:
        assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
    assert not made.heard['wrench'], 'one of two listens'
    made.listen(topics.WRENCH)
    made.until(lambda: made.heard['wrench'], 'what it leaves')
    made.until(lambda: node._held is None, 'nothing held back')
    assert {tuple(by_hand.six_of(message)) for message in made.heard['wrench']} == {(0.0,) * 6}
    assert by_hand.ns_of(made.heard['wrench'][0]) == 3 * STEP
    assert not re.search('engages|disengages', capfd.readouterr().err)


def test_in_lock_step_the_law_goes_on_from_an_answer_that_is_held_back(made, vehicle) -> None:
    node = controller(made, vehicle, 'gvc', expected_subscribers=['wrench=2'])

    def join() -> None:
        made.until(lambda: node._held, 'an answer')
        made.listen(topics.WRENCH)

    for k in range(STEPS):
        offered(made, k, join if k == 0 else lambda: None)
    found = {by_hand.ns_of(one) // STEP: by_hand.six_of(one) for one in made.heard['wrench']}
    for k, (tau, _) in enumerate(expected('gvc', PER_AXIS, 0, STEPS)):
        assert_allclose(found[k], tau, rtol=1e-9)


def test_in_real_time_a_law_begins_once_it_is_heard(made, vehicle) -> None:
    """Beside a vehicle that says odometry already, a recorder that comes late is waited for."""
    node = controller(made, vehicle, 'gvc', **BESIDE, expected_subscribers=['wrench=2'])
    ship = Vehicle(made)
    ship.until(lambda: node._held is not None and not node._controller.watchdog, 'an answer')
    for _ in range(50):
        ship.step()
    assert not made.heard['wrench'], 'one of two listens'
    made.listen(topics.WRENCH)
    ship.until(lambda: len(made.heard['wrench']) > 2, 'what is published')
    first, second = (np.abs(by_hand.six_of(one)) for one in made.heard['wrench'][:2])
    assert not first.any()
    assert (second <= np.array(BESIDE['limits.wrench']) / FEWEST).all()
    assert node._controller.trips == 0


def test_in_real_time_what_came_before_an_activation_is_not_obeyed(made, vehicle) -> None:
    """The clock may have begun anew since: then set-points of the old time lie ahead of it."""
    real = {'lockstep': False, 'setpoint_pairing': 'latest', 'limits.wrench': [1e4]}
    real |= {'setpoint_acceleration': 'none', 'setpoint_timeout': 60.0, 'odometry_timeout': 60.0}
    node = controller(made, vehicle, 'gvc', **real, ramp=0.0)
    came: list[object] = []
    listening = node._idle.hear
    node._idle.hear = lambda *heard: (listening(*heard), came.append(heard))

    def setpoint() -> None:
        count = len(came)
        made.publish(topics.CMD_VEL, by_hand.six(topics.CMD_VEL.type, 9 * STEP, NU_D[0]))
        made.until(lambda: len(came) > count, 'the set-point')

    def is_driven(k: int) -> bool:
        count = len(made.heard['wrench'])
        made.publish(topics.ODOM, by_hand.odometry(k * STEP, [*ETA[0, :3], 1, 0, 0, 0, *NU[0]]))
        made.until(lambda: len(made.heard['wrench']) > count, f'answer {k}')
        return any(by_hand.six_of(made.heard['wrench'][-1]))

    assert node.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
    made.until(lambda: made.heard['wrench'], 'the zero wrench that it leaves')
    setpoint()
    assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
    assert not is_driven(9)
    setpoint()
    assert is_driven(10)
