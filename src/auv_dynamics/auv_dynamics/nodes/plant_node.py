"""The plant as a node: odometry out, wrench in, in lock-step or in real time."""

import sys
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from rclpy.duration import Duration
from std_srvs.srv import SetBool, Trigger

from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.plant.actuators import make_actuators
from auv_dynamics.plant.devices import SensorNoise
from auv_dynamics.plant.faults import FaultSetting, make_faults
from auv_dynamics.plant.plant import Plant, initial_state
from auv_dynamics.plant.uncertainty import make_uncertainty
from auv_dynamics.ros import interface, topics
from auv_dynamics.ros.codec import first_stamp
from auv_dynamics.ros.endpoints import NAMELESS, UNNAMED, full_name, other_publishers
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.ros.node_interface import OK, STALE, Health, NodeInterface, Peers, steady_timer
from auv_dynamics.ros.node_main import BulkNode, main_of
from auv_dynamics.ros.parameters import declare_settings
from auv_dynamics.ros.settings import PlantSettings

WATCH = 0.2  # s between two looks at the silence
CATCH_UP = 2.0  # s that a plant in real time may be late: beyond, its time goes on from there
AHEAD = 1.0  # s that the stamp of a wrench may be ahead: it answers an odometry
DIVERGES = 'beyond every speed after step {}: the closed loop diverges'


class LockStep:
    """Step k is published, and only the wrench that carries its stamp leads to step k + 1.

    Parameters
    ----------
    node : the plant node

    """

    def __init__(self, node: Any):
        self._node = node
        self._started = self._published = self._reset = False
        self._ack = -1
        self._since: float | None = None  # when the present wait began; None: nothing is awaited
        self._publishers: dict[str, str] = {}  # topic -> nodes last seen to publish it
        if node.window:
            qos = topics.one_at_a_time()
            node.graph.subscribe(topics.PROGRESS, self._on_progress, qos)
        steady_timer(node, WATCH, self._watch)

    def start(self) -> None:
        """Publish step 0, or the step that a pause has held."""
        if not self._started:
            self._started, self._since = True, time.monotonic()
        self._go_on()

    def reset(self) -> int:
        """Put the vehicle back, at the next step where this one is known; which step that is."""
        # the answer to a published step is an answer to its state, and so is its F
        self._reset = self._published
        if not self._reset:
            self._node.plant.reset()
        return self._node.plant.k + self._reset

    def wrench(self, ns: int, tau: tuple[float, ...]) -> None:
        """Take the answer to the step that was published last."""
        node, plant = self._node, self._node.plant
        expected = plant.k * node.step_ns
        if not (self._published and ns == expected):
            raise interface.BadMessageError(f'wrench: stamp: expected {expected} ns, found {ns} ns')
        k, self._published = plant.k, False
        forces = plant.answer(tau)
        if k == node.last:
            self._since = None
        else:
            plant.advance()
            if self._reset:
                self._reset = False
                plant.reset()
            if not plant.diverged:
                self._go_on()
        node.publish_forces(k, *forces)
        if plant.diverged:
            node.end(1, DIVERGES.format(k))
        elif k == node.last and not node.window:
            node.end(0)

    def _go_on(self) -> None:
        node = self._node
        waits_for_credit = node.window and node.plant.k - self._ack > node.window
        if self._since is None or self._published or node.paused or waits_for_credit:
            return
        self._published, self._since = True, time.monotonic()
        node.publish_state(node.plant.k)

    def _on_progress(self, message: bytes, _: dict[str, Any]) -> None:
        self._ack = max(self._ack, first_stamp(message, topics.PROGRESS.name) // self._node.step_ns)
        self._go_on()

    def _watch(self) -> None:
        node = self._node
        if self._since is None or node.paused:
            return
        for topic in (topics.WRENCH.name, topics.PROGRESS.name):
            names = {info.node_name for info in node.get_publishers_info_by_topic(topic)}
            # one that is stopped for long leaves the graph, or loses its name; it is named here
            if names and UNNAMED not in names:
                self._publishers[topic] = ', '.join(sorted(names))
        if time.monotonic() - max(self._since, node.resumed) > node.wrench_timeout:
            silent = (topics.WRENCH.name, 'no controller')
            if not self._published:
                silent = (topics.PROGRESS.name, 'no recorder')
            who = self._publishers.get(*silent)
            text = f'no answer on {silent[0]} to step {node.plant.k} for {node.wrench_timeout:g} s'
            node.end(1, f'{text}; its publisher: {who}')


class RealTime:
    """Step k is published at k * step after the start; the last wrench is held, then zero.

    Parameters
    ----------
    node : the plant node

    """

    def __init__(self, node: Any):
        self._node = node
        self._began: float | None = None
        self._first = 0  # step published at `_began`
        self._tau: tuple[float, ...] = (0.0,) * 6
        self._heard = -float('inf')
        self._answered = -1
        self._ended: float | None = None
        node.graph.in_trouble_while(self._silence)

    def start(self) -> None:
        """Start the clock, also after a pause; while it runs this does nothing."""
        if self._began is None and self._ended is None:
            self._began = time.monotonic()
            if not hasattr(self, '_timer'):
                self._timer = steady_timer(self._node, self._node.step_ns / 1e9, self._tick)
            self._tick()

    def wrench(self, ns: int, tau: tuple[float, ...]) -> None:
        """Hold this wrench from now on."""
        step, k = ns // self._node.step_ns, self._node.plant.k
        if step < self._answered:
            raise interface.BadMessageError(
                f'wrench: stamp: expected newer than the last, found {ns} ns'
            )
        if (step - k) * self._node.step_ns > AHEAD * interface.NANOSECONDS:
            raise interface.BadMessageError(
                f'wrench: stamp: expected that of an odometry, found {ns} ns, ahead of all'
            )
        self._answered = min(step, k)  # one that is ahead locks out none of those that follow
        if not self._node.plant.deaf:
            self._tau, self._heard = tau, time.monotonic()

    def reset(self) -> int:
        """Put the vehicle back; the step from which this is seen."""
        self._node.plant.reset()
        return int(self._node.plant.k)

    def _silence(self) -> Health:
        timeout = self._node.wrench_timeout
        if self._began is None or time.monotonic() - self._heard <= timeout:
            return OK, ''
        return STALE, f'no wrench for {timeout:g} s: zero wrench'

    def _held(self) -> tuple[float, ...]:
        heard = time.monotonic() - self._heard <= self._node.wrench_timeout
        return self._tau if heard else (0.0,) * 6

    def _tick(self) -> None:
        node, plant = self._node, self._node.plant
        self._end()
        if node.paused:
            self._began, self._first = None, plant.k
        if self._began is None:
            return
        due = self._first + int((time.monotonic() - self._began) * 1e9) // node.step_ns
        late = (due - plant.k) * node.step_ns / interface.NANOSECONDS
        if late > max(CATCH_UP, node.step_ns / interface.NANOSECONDS):
            node.graph.complain(f'{late:.3g} s late: time goes on from step {plant.k}')
            self._began, self._first, due = time.monotonic(), plant.k, plant.k
        while plant.k <= due:
            node.publish_state(None if plant.lost else plant.measured_at)
            node.publish_forces(plant.k, *plant.answer(self._held(), heard=True))
            if plant.k != node.last:
                plant.advance()
                if not plant.diverged:
                    continue
                node.end(1, DIVERGES.format(plant.k - 1))
            self._began, self._ended = None, time.monotonic()
            return

    def _end(self) -> None:
        """With no recorder to wait for, exit once the last wrench is here or overdue."""
        node = self._node
        if self._ended is None or node.window or node.exit_code is not None:
            return
        overdue = time.monotonic() - self._ended > node.wrench_timeout
        if self._answered >= node.last or overdue:
            node.end(0)


MET = 0.5  # s after its birth in which those who are there already are met, before it starts
NEW = 3.0  # s after its start in which it gives way to another clock, and may wait for its name


class PlantNode(BulkNode):
    """A 6-DOF vehicle: integrates equations (1) and (2) between two wrenches."""

    latency_critical = True

    def __init__(self, **options: Any):
        super().__init__(interface.PLANT, **options)
        self._born = time.monotonic()
        self.graph = NodeInterface(self)
        timeout = 30.0 if self.lockstep else 0.5
        p = declare_settings(self, PlantSettings, wrench_timeout=timeout)
        self.plant = self._make_plant(p)
        self.graph.must_hold = self.window
        self._publish_odometry = self.graph.output(topics.ODOM)
        self._publish_clock = self.graph.output(topics.CLOCK) if p.publish_clock else None
        self._publish_twist = self.graph.output(topics.TWIST)
        self._publish_disturbance = self.graph.output(topics.DISTURBANCE)
        self._publish_applied = self.graph.output(topics.WRENCH_APPLIED) if self._acts else None
        self._publish_truth = self.graph.output(topics.GROUND_TRUTH) if self._senses else None
        self.peers = Peers(self, [*p.start_after])
        self.graph.also_ready_when(self.peers.not_ready)
        self.pace = LockStep(self) if self.lockstep else RealTime(self)
        qos = topics.one_at_a_time() if self.lockstep else topics.newest_command()
        self.graph.listen(topics.WRENCH, self.pace.wrench, qos)
        self.create_service(SetBool, '~/run', self._on_run)
        self.create_service(Trigger, '~/reset', self._on_reset)
        self.paused, self.resumed = p.start_paused, 0.0  # and when, steady clock, s
        self._started: float | None = None
        self._alone = time.monotonic()  # when nobody else published the clock
        self._starter = steady_timer(self, 0.05, self._start)

    def _make_plant(self, p: PlantSettings) -> Plant:
        grid = p.grid(self.get_name())
        self.step_ns, self.last = grid.step_ns, grid.last
        self.window, self.wrench_timeout = p.recorder_window, p.wrench_timeout
        name, vehicle = self.get_name(), load_vehicle(p.vehicle)
        self.graph.hardware_id = vehicle.name
        faults = make_faults(
            [*p.faults.values()],
            [f'faults.{key}' for key in p.faults],
            FaultSetting(
                grid.step,
                grid.duration,
                vehicle.thrusters,
                bool(p.actuators.get('thrusters', False)),
                vehicle.name,
                name,
            ),
        )
        self._acts = bool(p.actuators) or faults.acting
        self._senses = bool(p.sensors) or faults.sensing
        places = [f'disturbance.{key}' for key in p.disturbance]
        state = (self._six(key, getattr(p, f'initial_{key}')) for key in ('eta', 'nu'))
        return Plant(
            make_uncertainty(vehicle, [*p.disturbance.values()], name, places),
            grid.step,
            p.integrator,
            initial_state(*state),
            make_actuators(p.actuators or None, vehicle, grid.step, name),
            SensorNoise(p.sensors, p.seed, faults) if self._senses else None,
            faults,
            p.seed,
        )

    def _six(self, key: str, values: Sequence[float]) -> np.ndarray:
        if len(values) != 6:
            raise InputError(self.get_name(), f'initial.{key}', '6 finite numbers', [*values])
        return np.array(values)

    def _start(self) -> None:
        now = time.monotonic()
        newcomer = self._started is None or now - self._started < NEW
        if not newcomer:
            self._starter.cancel()
        elif self._publish_clock is not None and not self._is_only_clock(now):
            return
        met = now - self._born >= MET and self.exit_code is None
        if met and self.graph.ready() and not self.peers.not_ready() and not self.paused:
            if self._started is None:
                self._started = now
                pace = 'lock-step' if self.lockstep else 'real time'
                step = f'{self.step_ns / NANOSECONDS:g} s'
                self.begin(f'simulates {self.graph.hardware_id} in {pace}, {step} per step')
            self.pace.start()

    def _is_only_clock(self, now: float) -> bool:
        """Whether nobody else publishes `/clock`; who came later ends with one line."""
        names = sorted(map(full_name, other_publishers(self, topics.CLOCK.name)))
        if not names:
            self._alone = now
        elif self.exit_code is None and (NAMELESS not in names or now - self._alone >= NEW):
            expected = f'nobody else who publishes {topics.CLOCK.name}, or false'
            found = ', '.join(names)
            print(InputError(self.get_name(), 'publish_clock', expected, found), file=sys.stderr)
            self.exit_code = 2
        return not names

    def publish_state(self, measured: int | None) -> None:
        """Publish step k; odometry first, since the controller waits for it.

        `measured` is the step that odometry and twist are stamped with, None withholds them.
        """
        plant, ns = self.plant, self.plant.k * self.step_ns
        if measured is not None:
            self._publish_odometry(measured * self.step_ns, plant.measured)
        if self._publish_clock is not None:
            self._publish_clock(ns, ())
        if measured is not None:
            self._publish_twist(measured * self.step_ns, plant.measured[7:])
        if self._publish_truth is not None:
            self._publish_truth(ns, plant.x)
        self.graph.latest_ns = ns
        self.graph.facts['step'] = plant.k

    def publish_forces(self, k: int, applied: tuple[float, ...], F: tuple[float, ...]) -> None:
        """Publish what was applied at step k and F, what opposed it in (1)."""
        self._publish_disturbance(k * self.step_ns, F)
        if self._publish_applied is not None:
            self._publish_applied(k * self.step_ns, applied)

    def end(self, code: int, text: str = '') -> None:
        """End the node: 1 with the reason when the run failed."""
        if text:
            self.get_logger().error(text)
        if code == 0:
            for publisher in self.graph.publishers.values():
                publisher.wait_for_all_acked(Duration(seconds=5.0))
        self.exit_code = code

    def _on_run(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        reason = ''
        if request.data:
            reason = self.peers.not_ready() or ('' if self.graph.ready() else interface.PLANT)
        if not reason:
            self.paused, self.resumed = not request.data, time.monotonic()
            self._start()
        word = 'running' if request.data else 'paused'
        response.success, response.message = not reason, reason or word
        return response

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        step = self.pace.reset()
        response.success, response.message = True, f'state of the start from step {step}'
        return response


def main() -> None:
    """Run the node."""
    main_of(PlantNode)
