"""How the plant's time passes: with the wrenches (lock-step) or with the steady clock."""

import time
from typing import Any

from auv_dynamics.ros import interface, topics
from auv_dynamics.ros.codec import first_stamp
from auv_dynamics.ros.endpoints import UNNAMED
from auv_dynamics.ros.node_interface import OK, STALE, Health, steady_timer

WATCH = 0.2  # s between two looks at the silence
CATCH_UP = 0.5  # s that a plant in real time may be late: beyond, its time goes on from there
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

    @property
    def _waits_for_credit(self) -> bool:
        node = self._node
        return bool(node.window) and node.plant.k - self._ack > node.window

    def start(self) -> None:
        """Publish step 0; later calls do nothing."""
        if not self._started:
            self._started = self._published = True
            self._since = time.monotonic()
            self._node.publish_state(self._node.plant.k)

    def resume(self) -> None:
        """Go on after a pause."""
        if self._since is not None:
            self._since = time.monotonic()
        self._go_on()

    def pause(self) -> None:
        """Hold the next step."""

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
        if not (self._started and self._published and ns == expected):
            raise interface.BadMessageError(f'wrench: stamp: expected {expected} ns, found {ns} ns')
        k = plant.k
        applied, F = plant.answer(tau)
        if k == node.last:
            node.publish_forces(k, applied, F)
            self._published = False
            self._since = None
            if not node.window:
                node.end(0)
            return
        plant.advance()
        self._published = False
        if self._reset:
            self._reset = False
            plant.reset()
        if plant.diverged:
            node.publish_forces(k, applied, F)
            node.end(1, DIVERGES.format(k))
            return
        self._go_on()
        node.publish_forces(k, applied, F)

    def _go_on(self) -> None:
        done = self._since is None or not self._started
        if done or self._published or self._node.paused or self._waits_for_credit:
            return
        self._published = True
        self._since = time.monotonic()
        self._node.publish_state(self._node.plant.k)

    def _on_progress(self, message: bytes, _: dict[str, Any]) -> None:
        self._ack = max(self._ack, first_stamp(message) // self._node.step_ns)
        self._go_on()

    def _watch(self) -> None:
        node = self._node
        if not self._started or self._since is None or node.paused:
            return
        for topic in (topics.WRENCH.name, topics.PROGRESS.name):
            names = {info.node_name for info in node.get_publishers_info_by_topic(topic)}
            # one that is stopped for long leaves the graph, or loses its name; it is named here
            if names and UNNAMED not in names:
                self._publishers[topic] = ', '.join(sorted(names))
        if time.monotonic() - self._since > node.wrench_timeout:
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

    ZERO = (0.0,) * 6

    def __init__(self, node: Any):
        self._node = node
        self._began: float | None = None
        self._first = 0  # step published at `_began`
        self._tau: tuple[float, ...] = self.ZERO
        self._heard = -float('inf')
        self._answered = -1
        self._ended: float | None = None
        node.graph.in_trouble_while(self._silence)

    def start(self) -> None:
        """Start the clock; later calls do nothing."""
        if self._began is None and self._ended is None:
            self._began = time.monotonic()
            if not hasattr(self, '_timer'):
                self._timer = steady_timer(self._node, self._node.step_ns / 1e9, self._tick)

    def resume(self) -> None:
        """Go on after a pause, from the step that was held."""
        self.start()

    def pause(self) -> None:
        """Hold the clock."""
        self._began, self._first = None, self._node.plant.k

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
        runs = self._began is not None and self._ended is None
        if not runs or time.monotonic() - self._heard <= timeout:
            return OK, ''
        return STALE, f'no wrench for {timeout:g} s: zero wrench'

    def _held(self) -> tuple[float, ...]:
        node = self._node
        if time.monotonic() - self._heard <= node.wrench_timeout:
            return self._tau
        self._tau = self.ZERO
        return self.ZERO

    def _tick(self) -> None:
        node, plant = self._node, self._node.plant
        self._end()
        if self._began is None:
            return
        due = self._first + int((time.monotonic() - self._began) * 1e9) // node.step_ns
        late = (due - plant.k) * node.step_ns / interface.NANOSECONDS
        if late > max(CATCH_UP, node.step_ns / interface.NANOSECONDS):
            node.graph.complain(f'{late:.3g} s late: time goes on from step {plant.k}')
            self._began, self._first, due = time.monotonic(), plant.k, plant.k
        while plant.k <= due and self._ended is None:
            node.publish_state(None if plant.lost else plant.measured_at)
            node.publish_forces(plant.k, *plant.answer(self._held(), heard=True))
            if plant.k == node.last:
                self._ended = time.monotonic()
                continue
            plant.advance()
            if plant.diverged:
                self._ended = time.monotonic()
                node.end(1, DIVERGES.format(plant.k - 1))

    def _end(self) -> None:
        """With no recorder to wait for, exit once the last wrench is here or overdue."""
        node = self._node
        if self._ended is None or node.window or node.exit_code is not None:
            return
        overdue = time.monotonic() - self._ended > node.wrench_timeout
        if self._answered >= node.last or overdue:
            node.end(0)
