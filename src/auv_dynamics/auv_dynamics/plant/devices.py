"""Sensors and actuators with their faults: in the kernel, and one step at a time."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from auv_dynamics.kernel.compile import compiled, helper
from auv_dynamics.kernel.lanes import Number, anywhere, select
from auv_dynamics.kernel.six import (
    Numbers,
    Six,
    Vector,
    add,
    clipped,
    fill_vector,
    scale,
    vector,
)
from auv_dynamics.plant.actuators import (
    Actuators,
    fill_allocated,
    fill_applied,
    fill_slowed,
    memory,
    waited,
)
from auv_dynamics.plant.faults import (
    AGE,
    AXES,
    HELD,
    NONE,
    THRUSTERS,
    WRENCH,
    Faults,
    FaultShape,
    MeasurementFaults,
)

WIDTH = 11  # columns of a row: velocity noise (6), rotation quaternion (4), whether it is lost
LOST = WIDTH - 1


class SensorNoise:
    """Random numbers of a run, row by row, the same however many rows are asked for at once.

    Parameters
    ----------
    spec : `velocity_noise` (1 or 6 standard deviations, m/s and rad/s), `attitude_noise` (1 or 3,
        rad, about the body axes), `drop_out` (probability that a sample is lost)
    seed : of the scenario; `SeedSequence(seed).spawn(2)` gives the streams of noise and of losses
    faults : whose biases and drop-outs come on top

    """

    def __init__(self, spec: Mapping[str, Any], seed: int, faults: Faults = NONE):
        self._noise, self._loss = (
            np.random.Generator(np.random.PCG64(child))
            for child in np.random.SeedSequence(seed).spawn(2)
        )
        velocity = np.broadcast_to(np.asarray(spec.get('velocity_noise', 0.0), float), 6)
        attitude = np.broadcast_to(np.asarray(spec.get('attitude_noise', 0.0), float), 3)
        self._deviation = np.concatenate([velocity, attitude])
        self._drop_out = float(spec.get('drop_out', 0.0))
        self._faults = MeasurementFaults(faults, seed) if faults.sensing else None
        self._begun = False

    def rows(self, count: int) -> np.ndarray:
        """The next `count` rows (count, 11).

        Noise of nu in m/s and rad/s; exp(noise / 2) of the attitude as a quaternion w, x, y, z; 1
        where the sample is lost, which the first of a run never is. Noise includes biases.
        """
        noise = self._noise.standard_normal((count, 9)) * self._deviation
        lost = self._loss.random(count) < self._drop_out
        if self._faults is not None:
            bias, dropped = self._faults.rows(count)
            noise, lost = noise + bias, lost | dropped
        half = 0.5 * noise[:, 6:]
        angle = np.sqrt((half**2).sum(axis=1))
        scale = np.divide(np.sin(angle), angle, out=np.ones(count), where=angle > 0)
        if not self._begun:
            lost[:1], self._begun = False, True
        return np.column_stack([noise[:, :6], np.cos(angle), half * scale[:, None], lost])


@helper
def fill_measured(noise: np.ndarray, x: np.ndarray, measured: np.ndarray) -> None:
    """Write what is measured of the state x (13,); a lost sample changes nothing.

    nu + noise; q * exp(noise / 2), a small rotation about the body axes; the position is true.
    """
    lost = noise[10] != 0.0
    e0, e1, e2, e3 = noise[6], noise[7], noise[8], noise[9]
    w, i, j, l = x[3], x[4], x[5], x[6]
    for n in range(3):
        measured[n] = select(lost, measured[n], x[n])
    measured[3] = select(lost, measured[3], w * e0 - i * e1 - j * e2 - l * e3)
    measured[4] = select(lost, measured[4], w * e1 + i * e0 + j * e3 - l * e2)
    measured[5] = select(lost, measured[5], w * e2 - i * e3 + j * e0 + l * e1)
    measured[6] = select(lost, measured[6], w * e3 + i * e2 - j * e1 + l * e0)
    for n in range(6):
        measured[7 + n] = select(lost, measured[7 + n], x[7 + n] + noise[n])


SIZE = 13  # of a state


def history_shape(faults: FaultShape) -> tuple[int, int]:
    """Shape of the `history` of `fill_arrived`, with no rows where sensors are never late."""
    return (faults.delay + 2 if faults.delay else 0, SIZE)


@helper
def fill_arrived(fault: np.ndarray, k: int, history: np.ndarray, measured: np.ndarray) -> None:
    """Write the newest measurement that has arrived at step k into `measured` (13,).

    `history` (delay + 2, 13): a ring of the last measurements, then that of step k.
    """
    size = history.shape[0] - 1
    for n in range(history.shape[1]):
        history[k % size, n] = history[size, n]
    for age in range(size):
        wanted = fault[AGE] == age
        if anywhere(wanted):
            old = history[(k - age) % size]
            for n in range(history.shape[1]):
                measured[n] = select(wanted, old[n], measured[n])


@helper
def _kept_in(fault: np.ndarray, i: int, tau: Vector, held: np.ndarray) -> Number:
    kept = select(fault[WRENCH] == HELD, held[i], 0.0 * tau[i])
    return select(fault[WRENCH] == 0.0, tau[i], kept)


@helper
def fill_heard(fault: np.ndarray, tau: Vector, held: np.ndarray) -> Six:
    """The command that the actuators hear; `held` (6,) is the last one, in place."""
    heard = (
        _kept_in(fault, 0, tau, held),
        _kept_in(fault, 1, tau, held),
        _kept_in(fault, 2, tau, held),
        _kept_in(fault, 3, tau, held),
        _kept_in(fault, 4, tau, held),
        _kept_in(fault, 5, tau, held),
    )
    fill_vector(held, 0, heard)
    return heard


@helper
def fill_faulty(
    actuators: Actuators, fault: np.ndarray, k: int, tau: Vector, state: np.ndarray
) -> Numbers:
    """`fill_applied` of actuators with faults; the last row of `state` is the last command."""
    heard = fill_heard(fault, tau, state[state.shape[0] - 1])
    command = waited(actuators, k, heard, state)
    c = fill_allocated(actuators.rotors, actuators, fault[THRUSTERS:], k, command, state)
    c = clipped(c, actuators.reach.limit)
    c = add(scale(vector(fault, AXES), c), vector(fault, AXES + 6))  # faults of whole axes
    return fill_slowed(actuators.follow, actuators.slew, c, state[0])


compiled_measured, compiled_arrived = compiled(fill_measured), compiled(fill_arrived)
compiled_applied, compiled_faulty = compiled(fill_applied), compiled(fill_faulty)


class Sensing:
    """From the true state to the measurement that has arrived.

    Parameters
    ----------
    noise : of the sensors; None: they are perfect
    faults : of the scenario

    Attributes
    ----------
    measured : (13,) the newest measurement that has arrived
    age : steps since it was made
    lost : whether nothing new has arrived at this step

    """

    def __init__(self, noise: SensorNoise | None, faults: Faults):
        # sensors that are late but perfect still have a past
        self._noise = SensorNoise({}, 0) if noise is None and faults.shape.delay else noise
        self._history = np.zeros(history_shape(faults.shape))
        # of the last measurements, as in the ring of the history
        self._losses = np.zeros(faults.shape.delay + 1, bool)
        self.measured = np.zeros(SIZE)
        self.age, self.lost = 0, False

    def reset(self, x: np.ndarray) -> None:
        """Forget all but the state x."""
        self.measured, self.lost = x.copy(), False
        self._history[:], self._losses[:] = x, False

    def rows(self, count: int) -> np.ndarray:
        """Random numbers of the next steps."""
        return np.zeros((count, 0)) if self._noise is None else self._noise.rows(count)

    def measure(self, k: int, x: np.ndarray, noise: np.ndarray, fault: np.ndarray | None) -> None:
        """Measure the state x at step k."""
        if self._noise is None:
            self.measured, self.lost = x, False
            return
        lost = bool(noise[LOST])
        if fault is None or len(self._history) == 0:
            compiled_measured(noise, x, self.measured)
            self.lost = lost
            return
        compiled_measured(noise, x, self._history[-1])
        compiled_arrived(fault, k, self._history, self.measured)
        before, self.age = self.age, int(fault[AGE])
        self._losses[k % len(self._losses)] = lost
        nothing_new = k > 0 and self.age == before + 1
        self.lost = nothing_new or bool(self._losses[(k - self.age) % len(self._losses)])


class Acting:
    """From the command to the applied wrench.

    Parameters
    ----------
    actuators : between the two
    faults : of the scenario

    """

    def __init__(self, actuators: Actuators, faults: Faults):
        self._actuators, self._faulty = actuators, faults.shape.any
        self.reset()

    def reset(self, applied: Numbers = (0.0,) * 6) -> None:
        """Forget every command; `applied` is the wrench that lag and slew rate go on from."""
        self._memory = memory(self._actuators, faults=self._faulty)
        self._memory[0] = applied

    def apply(
        self, k: int, tau: tuple[float, ...], fault: np.ndarray | None, *, heard: bool
    ) -> tuple[float, ...]:
        """Wrench applied from step k on for the command tau.

        `heard` says that tau is what the actuators have, whatever the fault does to messages.
        """
        if fault is None:
            ideal = self._actuators.ideal
            return tau if ideal else compiled_applied(self._actuators, k, tau, self._memory)
        if heard:
            fault = fault.copy()
            fault[WRENCH] = 0.0
        return compiled_faulty(self._actuators, fault, k, tau, self._memory)
