"""A plant's sensors and actuators with their faults, one step at a time."""

import numpy as np

from auv_dynamics.plant.actuators import Actuators, fill_applied, memory
from auv_dynamics.plant.faults import Faults
from auv_dynamics.plant.faulty_devices import (
    AGE,
    SIZE,
    WRENCH,
    fill_arrived,
    fill_faulty,
    history_shape,
)
from auv_dynamics.plant.sensors import LOST, SensorNoise, fill_measured


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
        self.measured = x.copy()
        self._history[:] = x

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
            fill_measured(noise, x, self.measured)
            self.lost = lost
            return
        fill_measured(noise, x, self._history[-1])
        fill_arrived(fault, k, self._history, self.measured)
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

    def reset(self) -> None:
        """Forget every command."""
        self._memory = memory(self._actuators, faults=self._faulty)

    def apply(
        self, k: int, tau: tuple[float, ...], fault: np.ndarray | None, *, heard: bool
    ) -> tuple[float, ...]:
        """Wrench applied from step k on for the command tau.

        `heard` says that tau is what the actuators have, whatever the fault does to messages.
        """
        if fault is None:
            ideal = self._actuators.ideal
            return tau if ideal else fill_applied(self._actuators, k, tau, self._memory)
        if heard:
            fault = fault.copy()
            fault[WRENCH] = 0.0
        return fill_faulty(self._actuators, fault, k, tau, self._memory)
