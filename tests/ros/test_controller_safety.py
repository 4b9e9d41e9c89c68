"""The controller beside a real driver: each fault, the promised reaction, and the way back."""

import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from helpers.node_processes import (
    CONTROLLER,
    PATIENCE,
    Peer,
    change,
    fresh_domain,
    graph,
    parameters,
    start_node,
    stop,
)
from helpers.patience import patience
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import GetState
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters

from auv_dynamics.ros import convert, interface, topics
from auv_dynamics.ros.interface import Frames
from auv_dynamics.ros.node_interface import ERROR, STALE, WARN
from auv_dynamics.ros.topics import DIAGNOSTICS

FRAMES = Frames()
PERIOD = 0.02
X = np.array([0, 0, 0, 1, 0, 0, 0, 0.1, 0, 0, 0, 0, 0], float)
TIMEOUT = patience(0.3)  # s, of the watchdogs
OLD = round(patience(1.0) * 10**9)  # ns: older than they allow
WATCHED = parameters(odometry_timeout=TIMEOUT, setpoint_timeout=TIMEOUT)
REAL = [*CONTROLLER, *WATCHED, *parameters(ramp=patience(0.2))]
SLOW = patience(3.0)  # s, of a ramp
LONG = round(2 * SLOW * 10**9)  # ns: further ahead than a timeout of this allows
SILENT = f'no odometry for {TIMEOUT:g} s'


class Driver:
    """Odometry and set-points at 50 Hz, stamped by the clock on the wall unless it is set wrong."""

    def __init__(self, peer: Peer):
        self.peer, self.x = peer, X.copy()
        self.odometry = self.setpoints = True
        self.clock = time.time_ns
        self.setpoint_age = 0
        peer.listen(topics.WRENCH, DIAGNOSTICS)
        peer.until(lambda: peer.node.count_publishers('wrench'), 'a wrench publisher')

    @property
    def surge(self) -> list[float]:
        """Every force heard so far."""
        return [message.wrench.force.x for message in self.peer.heard['wrench']]

    def step(self) -> None:
        now = self.clock()
        if self.setpoints:
            nu_d = (0.5, 0, 0, 0, 0, 0)
            self.peer.publish(topics.CMD_VEL, convert.twist(now - self.setpoint_age, nu_d, FRAMES))
        if self.odometry:
            self.peer.publish(topics.ODOM, convert.odometry(now, self.x, FRAMES))
        self.peer.spin(PERIOD)

    def until(self, done: Callable[[], bool], what: str) -> None:
        limit = time.monotonic() + patience(30.0)
        while not done():
            assert time.monotonic() < limit, what
            self.step()

    def works(self) -> None:
        """Drive until the law is in charge, past its ramp."""
        seen = len(self.surge)
        self.until(
            lambda: len(self.surge) > seen + 15 and min(map(abs, self.surge[-5:])) > 1.0,
            'a wrench',
        )

    def rises(self) -> None:
        """Drive until the law is in charge and its slow ramp over."""
        self.works()
        over = time.monotonic() + SLOW
        self.until(lambda: time.monotonic() > over, 'the end of the ramp')

    def lets_go(self) -> list[float]:
        """Drive until the wrench is zero; the forces on the way."""
        seen = len(self.surge)
        self.until(lambda: 0.0 in self.surge[seen:], 'a zero wrench')
        return self.surge[seen : self.surge.index(0.0, seen) + 1]

    def health(self, wanted: Callable[[dict], bool]) -> dict:
        """Diagnostics of the controller, once those from now on say what is wanted."""
        found: list[dict] = []
        heard, before = self.peer.heard[DIAGNOSTICS.name], len(self.peer.heard[DIAGNOSTICS.name])

        def told() -> bool:
            for array in heard[before:]:
                for status in array.status:
                    if status.name == '/controller_node':
                        values = {entry.key: entry.value for entry in status.values}
                        found.append({'message': status.message, 'level': status.level, **values})
            return any(map(wanted, found))

        self.until(told, 'diagnostics')
        return next(filter(wanted, reversed(found)))


@pytest.fixture
def driver():
    yield from driven()


@pytest.fixture(scope='module')
def recovering():
    """One driver, which is broken and mended again and again, its ramp longer than most pauses."""
    yield from driven(*parameters(ramp=patience(1.0)))


@pytest.fixture
def slow():
    """One whose ramp is long beside any pause of a busy machine that no watchdog sees."""
    yield from driven(*parameters(ramp=SLOW))


def driven(*more: str) -> Iterator[Driver]:
    with graph(('controller_node', [*REAL, *more])) as (peer, _):
        yield Driver(peer)


def assert_ramp(forces: list[float]) -> None:
    """Down in steps, never up, to zero."""
    sizes = [abs(force) for force in forces[-6:]]
    assert sizes == sorted(sizes, reverse=True)
    assert 0 < sizes[-2] < max(map(abs, forces)), 'over a ramp'
    assert sizes[-1] == 0.0


def freeze(driver: Driver) -> None:
    now = time.time_ns()
    driver.clock = lambda: now


def silent_ahead(driver: Driver) -> None:
    """Set-points of far more than the timeout at once, and no more."""
    now, apart = time.time_ns(), round(TIMEOUT / 15 * 10**9)
    for k in range(200):
        ahead = convert.twist(now + k * apart, (0.5, 0, 0, 0, 0, 0), FRAMES)
        driver.peer.publish(topics.CMD_VEL, ahead)
    driver.setpoints = False


FAULTS: dict[str, tuple[Callable[[Driver], None], str]] = {
    'odometry falls silent': (lambda d: setattr(d, 'odometry', False), SILENT),
    'set-points fall silent': (lambda d: setattr(d, 'setpoints', False), 'no set-point for'),
    'set-points ahead, then none': (silent_ahead, 'no set-point heard for'),
    'old set-points': (lambda d: setattr(d, 'setpoint_age', OLD), 'no set-point for'),
    'odometry is late': (
        lambda d: setattr(d, 'clock', lambda: time.time_ns() - OLD), SILENT,
    ),
    'odometry is not a number': (lambda d: d.x.__setitem__(7, math.nan), SILENT),
    'its stamp is frozen': (freeze, SILENT),
}  # fmt: skip


@pytest.mark.parametrize('fault', FAULTS)
def test_the_wrench_goes_to_zero_over_a_ramp_and_comes_back(recovering: Driver, fault: str) -> None:
    driver, (break_it, said) = recovering, FAULTS[fault]
    driver.works()
    trips = int(driver.health(lambda h: h['message'] == 'ok')['watchdog trips'])
    kept = vars(driver).copy()
    try:
        break_it(driver)
        assert_ramp(driver.lets_go())
        health = driver.health(lambda h: h.get('watchdog', '').startswith(said))
    finally:
        vars(driver).update(kept)
        driver.x = X.copy()
    assert health['message'].startswith(said), 'for as long as it lasts'
    lasting = STALE if said.startswith('no odometry') else WARN
    assert health['level'] in (lasting, ERROR), 'an error where messages are refused'
    assert int(health['watchdog trips']) > trips
    driver.works()
    assert driver.health(lambda h: h['message'] == 'ok')['watchdog'] == 'none'


def newest(peer: Peer) -> int:
    """Stamp of the last wrench, ns."""
    return interface.nanoseconds(peer.heard['wrench'][-1].header.stamp)


def test_a_driver_that_starts_again_with_its_clock_at_zero_is_believed_after_a_pause() -> None:
    """ros2_controllers#1683: a controller that never recovers."""
    with graph(('controller_node', REAL)) as (peer, _):
        driver = Driver(peer)
        start = time.time_ns()
        driver.clock = lambda: time.time_ns() - start + 100 * 10**9  # since it was switched on
        driver.works()
        again = time.time_ns()
        driver.clock = lambda: time.time_ns() - again
        driver.until(lambda: newest(peer) < 50 * 10**9, 'an answer in the new time')
        driver.works()
        health = driver.health(lambda h: 'refused odom: stamp went back' in h)
        assert int(health['refused odom: stamp went back']) >= 2


@pytest.mark.parametrize('jump', [3600, -3600], ids=['forward', 'back'])
def test_a_jump_of_the_clock_is_survived(jump: int) -> None:
    """Driver, set-points and controller follow one simulated clock, which jumps."""
    with graph(('controller_node', [*REAL, *parameters(use_sim_time=True)])) as (peer, _):
        driver = Driver(peer)
        origin = time.time_ns() - 7200 * 10**9

        def clock() -> int:
            now = time.time_ns() - origin
            peer.publish(topics.CLOCK, topics.CLOCK.type(clock=convert.stamp(now)))
            return now

        driver.clock = clock
        driver.works()
        origin -= jump * 10**9
        driver.until(
            lambda: abs(newest(peer) - (time.time_ns() - origin)) < 5 * 10**9,
            'an answer in the new time',
        )
        driver.works()
        word = 'jumped' if jump > 0 else 'went back'
        health = driver.health(lambda h: any(word in key or 'clock' in key for key in h))
        assert int(health['refused']) >= 1


def bad(x: np.ndarray, **values: float) -> np.ndarray:
    x = x.copy()
    for place, value in values.items():
        x[int(place[1:])] = value
    return x


BROKEN: dict[str, Callable[[int], object]] = {
    'odom: not finite': lambda ns: convert.odometry(ns, bad(X, _7=math.nan), FRAMES),
    'odom: orientation': lambda ns: convert.odometry(ns, bad(X, _3=1.1), FRAMES),
    'odom: header.frame_id': lambda ns: convert.odometry(ns, X, Frames(odom='map')),
    'odom: child_frame_id': lambda ns: convert.odometry(ns, X, Frames(base='base_link')),
    'odom: twist.linear': lambda ns: convert.odometry(ns, bad(X, _8=1e6), FRAMES),
    'odom: stamp went back': lambda ns: convert.odometry(ns - 5 * 10**9, X, FRAMES),
    'odom: stamp jumped': lambda ns: convert.odometry(ns + 3 * LONG, X, FRAMES),
    'odom: stamp ahead of the clock': lambda ns: convert.odometry(ns + LONG, X, FRAMES),
    'cmd_vel: not finite': lambda ns: convert.twist(ns, (math.inf, 0, 0, 0, 0, 0), FRAMES),
    'cmd_vel: header.frame_id': lambda ns: convert.twist(ns, (1, 0, 0, 0, 0, 0), Frames(base='x')),
    'cmd_vel: twist.angular': lambda ns: convert.twist(ns, (0, 0, 0, 1e6, 0, 0), FRAMES),
}


def test_broken_messages_among_good_ones_are_refused_counted_and_never_forwarded() -> None:
    still = parameters(  # without integrals and filter, the wrench stays what it is
        law='gvc', vehicle='herman2018', gains__k_D='[12.0]', gains__k_I='[0.0]',
        # no pause of a busy machine is as long as these
        gains__Lambda='[1e-9]', gains__Gamma='[0.0]', odometry_timeout=SLOW, setpoint_timeout=SLOW,
        limits__gap=1.5e-9 * LONG, limits__wrench='[1e5]', setpoint_acceleration='none',
        ramp=0.0,  # of which a burst of answers is no part
    )  # fmt: skip
    with graph(('controller_node', still)) as (peer, processes):
        driver = Driver(peer)
        driver.works()
        usual = driver.surge[-1]
        seen = len(driver.surge)
        health, limit = {}, time.monotonic() + patience(30.0)
        while not all(int(health.get(f'refused {kind}', 0)) >= 3 for kind in BROKEN):
            assert time.monotonic() < limit, health
            # a queue of one loses a message that the next one catches up with: sent once more
            for _ in range(3):
                for kind, make in BROKEN.items():
                    driver.step()
                    topic = topics.ODOM if kind.startswith('odom') else topics.CMD_VEL
                    peer.publish(topic, make(time.time_ns()))
            driver.step()
            health = driver.health(lambda _: True)
        assert int(health['refused']) == sum(
            int(count) for key, count in health.items() if key.startswith('refused ')
        )
        forces = driver.surge[seen:]
        assert len(forces) > 30
        assert all(map(math.isfinite, forces))
        assert forces == pytest.approx([usual] * len(forces), rel=1e-6)
        code, output = stop(processes['controller_node'])
        assert code == 0
        for kind in BROKEN:
            assert f'refused: {kind}' in output


def state(peer: Peer) -> str:
    return peer.call(GetState, 'controller_node/get_state').current_state.label


def set_parameter(peer: Peer, name: str, value: ParameterValue) -> bool:
    request = SetParameters.Request(parameters=[Parameter(name=name, value=value)])
    return peer.call(SetParameters, 'controller_node/set_parameters', request).results[0].successful


def test_the_whole_life_of_the_controller(driver: Driver) -> None:
    """Zero wrench whenever it leaves (ros2_controllers#2602), nothing while it is away."""
    peer = driver.peer
    for leave, back in (
        ([Transition.TRANSITION_DEACTIVATE], [Transition.TRANSITION_ACTIVATE]),
        (
            [Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP],
            [Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE],
        ),
    ):
        driver.works()
        for transition in leave:
            assert change(peer, transition)
        peer.until(lambda: driver.surge[-1] == 0.0, 'a zero wrench')
        count = len(driver.surge)
        for _ in range(20):
            driver.step()
        assert len(driver.surge) == count, 'inactive, it says nothing'
        for transition in back:
            assert change(peer, transition)
    driver.works()
    assert change(peer, Transition.TRANSITION_ACTIVE_SHUTDOWN)
    assert state(peer) == 'finalized'
    peer.until(lambda: driver.surge[-1] == 0.0, 'a zero wrench')
    count = len(driver.surge)
    for _ in range(20):
        driver.step()
    assert len(driver.surge) == count


def test_a_change_of_law_and_gains_is_no_bump(slow: Driver) -> None:
    """mvp_control#10, ros2_controllers#1840: nothing of the old law is left in the new one."""
    driver, peer = slow, slow.peer
    driver.rises()
    gvc = driver.surge[-1]
    assert not set_parameter(peer, 'law', ParameterValue(type=4, string_value='cl'))
    assert change(peer, Transition.TRANSITION_DEACTIVATE)
    assert set_parameter(peer, 'law', ParameterValue(type=4, string_value='cl'))
    # nothing that grows while a machine stands still: what comes in is the same at each step
    for gain, value in (('k_D', 300.0), ('k_I', 1e-9), ('Lambda', 1e-9)):
        given = ParameterValue(type=8, double_array_value=[value])
        assert set_parameter(peer, f'gains.{gain}', given)
    peer.until(lambda: driver.surge[-1] == 0.0, 'a zero wrench')
    count = len(driver.surge)
    assert change(peer, Transition.TRANSITION_ACTIVATE)
    driver.rises()
    forces = [0.0, *driver.surge[count:]]
    steps = np.abs(np.diff(forces))
    assert max(steps) < 0.15 * max(map(abs, forces)), 'it comes in over the ramp'
    assert not math.isclose(forces[-1], gvc, rel_tol=0.05), 'and it is another law'


def test_the_network_cannot_name_a_module_to_run(driver: Driver) -> None:
    peer = driver.peer
    assert change(peer, Transition.TRANSITION_DEACTIVATE)
    value = ParameterValue(type=4, string_value='this:Zen')
    request = SetParameters.Request(parameters=[Parameter(name='law', value=value)])
    result = peer.call(SetParameters, 'controller_node/set_parameters', request).results[0]
    assert not result.successful
    assert "found 'this:Zen'" in result.reason


BROKEN_BUILD = """
from auv_gvc_controller.nodes import controller_node
from auv_gvc_controller.nodes.controller_node import ControllerParameters

build, calls = ControllerParameters.build, []


def second_fails(self):
    calls.append(self)
    if len(calls) == 2:
        raise KeyError('what nobody thought of')
    return build(self)


if __name__ == '__main__':
    ControllerParameters.build = second_fails
    controller_node.main()
"""


def test_an_error_inside_a_transition_leaves_no_wrench_and_can_be_mended(tmp_path: Path) -> None:
    domain = fresh_domain()
    peer = Peer(domain)
    script = tmp_path / 'broken_controller.py'
    script.write_text(BROKEN_BUILD)
    process = start_node(str(script), domain, *REAL, *parameters(autostart=False))
    try:
        driver = Driver(peer)
        assert change(peer, Transition.TRANSITION_CONFIGURE)
        assert not change(peer, Transition.TRANSITION_ACTIVATE)
        assert state(peer) == 'unconfigured'
        assert change(peer, Transition.TRANSITION_CONFIGURE)
        assert change(peer, Transition.TRANSITION_ACTIVATE)
        driver.works()
    finally:
        peer.close()
        code, output = stop(process)
    assert code == 0, output


STEPS = {  # s -> surge, m/s
    'a step': {0.0: 0.5},
    'steps at 10 Hz': {0.0: 0.75, 0.1: 1.0, 0.2: 0.75, 0.3: 0.5},
    'back to back': {0.6: 0.5, 0.6001: 0.505},
}


def test_set_points_by_hand_take_little_more_than_holds_the_speed() -> None:
    """Ten a second, and jumps: without the filter a step takes 520 N, with differences 570 N."""
    law = [word.replace('herman2018', 'herman2018_neutral') for word in CONTROLLER]
    # weak feedback: a pause of up to 0.5 s of plant or controller, in which a wrench, 0.2 m/s2,
    # is held beside a filter that falls by as much, adds k_D M (0.4 m/s2) (0.5 s) = 180 N to it
    law += parameters(gains__k_D='[3.0]', gains__k_I='[0.0]', gains__Lambda='[1e-9]')
    law += parameters(gains__Gamma='[0.0]', use_sim_time=True, setpoint_timeout=patience(0.5))
    with graph(
        ('plant_node', parameters(vehicle='herman2018_neutral', step=PERIOD)),
        ('controller_node', law),
    ) as (peer, _):
        peer.listen(topics.WRENCH)
        odometry, wrenches = [], peer.heard['wrench']
        newest = topics.newest_command()  # whoever falls behind would send old set-points
        peer.node.create_subscription(topics.ODOM.type, 'odom', odometry.append, newest)
        peer.until(lambda: odometry, 'odometry')
        peer.publish(topics.CMD_VEL, convert.twist(0, (0.5, 0, 0, 0, 0, 0), FRAMES))  # both are met

        def now() -> float:
            return interface.nanoseconds(odometry[-1].header.stamp) / 1e9

        for steps in STEPS.values():
            begin, left, surge, sent = now(), dict(steps), 0.5, 0.0
            limit = time.monotonic() + PATIENCE
            while now() < begin + 1.2 or abs(odometry[-1].twist.twist.linear.x - 0.5) > 0.1:
                assert time.monotonic() < limit, 'the speed'
                due = [left.pop(at) for at in [*left] if begin + at <= now()]
                surge = due[-1] if due else surge
                for value in due or [surge] * (now() >= sent + 0.1):
                    sent = max(now(), sent + 1e-4)
                    command = convert.twist(round(sent * 1e9), (value, 0, 0, 0, 0, 0), FRAMES)
                    peer.publish(topics.CMD_VEL, command)
                peer.spin(0.01)
    # 60 N hold 0.5 m/s, and M = 300 kg takes 60 N for 0.2 m/s2
    assert max(abs(message.wrench.force.x) for message in wrenches) < 60.0 + 60.0 + 180.0


def test_the_wrench_changes_no_faster_than_its_limit() -> None:
    arguments = [
        *CONTROLLER,
        *parameters(lockstep=True, setpoint_pairing='exact', limits__wrench_rate='[100.0]'),
    ]
    with graph(('controller_node', arguments)) as (peer, _):
        peer.listen(topics.WRENCH)
        peer.until(lambda: peer.node.count_publishers('wrench'), 'a wrench publisher')
        for k in range(20):
            ns = k * 10_000_000
            peer.publish(topics.CMD_VEL, convert.twist(ns, (0.5, 0, 0, 0, 0, 0), FRAMES))
            peer.publish(topics.ODOM, convert.odometry(ns, X, FRAMES))
            peer.until(lambda k=k: len(peer.heard['wrench']) > k, f'wrench {k}')
        forces = [message.wrench.force.x for message in peer.heard['wrench']]
        np.testing.assert_allclose(forces, 1.0 * np.arange(20), atol=1e-9)


OPEN_LOOP = parameters(
    law='multisine', vehicle='herman2018', limits__wrench='[60.0]', odometry_timeout=TIMEOUT,
    setpoint_timeout=TIMEOUT, ramp=patience(1.0), gains__offset='[50.0, 0.0, 0.0, 0.0, 0.0, 0.0]',
    gains__amplitude='[20.0, 0.0, 0.0, 0.0, 0.0, 0.0]', gains__omega='[8.0]', gains__phase='[0.0]',
)  # fmt: skip


def test_an_open_loop_keeps_every_guard_of_a_controller() -> None:
    """Limit, watchdogs, the operator's stop: whoever publishes set-points holds the switch."""
    with graph(('controller_node', OPEN_LOOP)) as (peer, _):
        driver = Driver(peer)
        for silent in ('setpoints', 'odometry'):
            driver.until(lambda: 60.0 in driver.surge[-5:], 'a wrench at its limit')
            assert max(driver.surge) == 60.0, '70 N are asked for'
            setattr(driver, silent, False)
            assert_ramp(driver.lets_go())
            setattr(driver, silent, True)
        driver.works()
        assert change(peer, Transition.TRANSITION_DEACTIVATE)
        peer.until(lambda: driver.surge[-1] == 0.0, 'a zero wrench')
