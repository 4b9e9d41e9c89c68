"""Faults step by step: the numbers that they change, tabulated ahead and seeded."""

import numpy as np

from auv_dynamics.plant.actuators import WHOLE
from auv_dynamics.plant.faults import RANDOM, Fault, Faults
from auv_dynamics.plant.faulty_devices import (
    AGE,
    AXES,
    HELD,
    THRUSTERS,
    WRENCH,
    ZEROED,
)
from auv_dynamics.vehicle import DOFS


class Losses:
    """Which messages a fault loses, step by step.

    One uniform number is drawn per step, also outside the fault's interval, so that what is lost
    later does not depend on where it begins.

    Parameters
    ----------
    fault : of a kind with a probability
    seed : of the scenario; the stream is that of
        `SeedSequence(seed, spawn_key=(2, kind, nth))`, kind 0 for sensor_drop_out, 1 for
        wrench_loss, so that it depends on no other fault and on no noise

    """

    def __init__(self, fault: Fault, seed: int):
        self._fault = fault
        self._probability = float(fault.spec.get('probability', 1.0))
        key = (2, RANDOM.index(fault.kind), fault.nth)
        self._draw = np.random.Generator(
            np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key))
        )

    def rows(self, k: np.ndarray) -> np.ndarray:
        """(n,) whether it is lost at steps k (n,), which follow those of the last call."""
        return (self._draw.random(len(k)) < self._probability) & self._fault.there(k)


class MeasurementFaults:
    """What `sensor_bias` and `sensor_drop_out` do to the measurements of a run."""

    def __init__(self, faults: Faults, seed: int):
        self._biases = faults.of('sensor_bias')
        self._losses = [Losses(fault, seed) for fault in faults.of('sensor_drop_out')]
        self._k = 0

    def rows(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Bias (count, 9) in m/s, rad/s and rad, and loss (count,) of the next steps."""
        k = np.arange(self._k, self._k + count)
        self._k += count
        bias, lost = np.zeros((count, 9)), np.zeros(count, bool)
        for fault in self._biases:
            there = fault.there(k)
            bias[there, :6] += fault.spec.get('velocity', 0.0)
            bias[there, 6:] += fault.spec.get('attitude', 0.0)
        for losses in self._losses:
            lost |= losses.rows(k)
        return bias, lost


class FaultRows:
    """The rows of a run that `faulty_devices` takes, the same however many are asked for at once.

    Parameters
    ----------
    faults : of the scenario
    seed : of the scenario

    """

    def __init__(self, faults: Faults, seed: int):
        self._faults = faults
        self._losses = [(fault, Losses(fault, seed)) for fault in faults.of('wrench_loss')]
        self._k = 0
        self._seen = 0  # step of the newest measurement that has arrived
        self._heard = -1  # step of the newest wrench that has arrived

    def rows(self, count: int) -> np.ndarray:
        """The next rows (count, 14 + 2 n), n thrusters that the wrench is allocated to."""
        k = np.arange(self._k, self._k + count)
        self._k += count
        n = len(self._faults.thrusters)
        table = np.zeros((count, THRUSTERS + 2 * n))
        table[:, WRENCH] = self._wrench(k)
        table[:, AGE] = self._age(k)
        table[:, AXES : AXES + 6] = 1.0
        table[:, THRUSTERS : THRUSTERS + n] = 1.0
        for fault in self._faults.of('actuator'):
            i = AXES + DOFS.index(fault.spec['axis'])
            _weaken(table, fault, k, i, i + 6)
        for fault in self._faults.of('thruster'):
            i = THRUSTERS + self._faults.thrusters.index(fault.spec['thruster'])
            _weaken(table, fault, k, i, i + n)
        return table

    def _age(self, k: np.ndarray) -> np.ndarray:
        """Steps since the measurement that is the newest to have arrived at steps k."""
        delay = np.zeros(len(k), int)
        for fault in self._faults.of('sensor_delay'):
            delay[fault.there(k)] = self._faults.delay_of(fault)
        seen = np.maximum(np.maximum.accumulate(k - delay), self._seen) if len(k) else k
        self._seen = int(seen[-1]) if len(k) else self._seen
        return k - seen

    def _wrench(self, k: np.ndarray) -> np.ndarray:
        """0 where the wrench arrives, else `HELD` or `ZEROED`."""
        lost, timeout = np.zeros(len(k), bool), np.full(len(k), np.inf)
        for fault, losses in self._losses:
            lost |= losses.rows(k)
            there = fault.there(k)
            timeout[there] = np.minimum(timeout[there], fault.spec.get('timeout', np.inf))
        heard = np.maximum.accumulate(np.where(lost, self._heard, k)) if len(k) else k
        self._heard = int(heard[-1]) if len(k) else self._heard
        overdue = k - heard > timeout / self._faults.step + WHOLE
        return np.where(lost, np.where(overdue, ZEROED, HELD), 0.0)


def _weaken(table: np.ndarray, fault: Fault, k: np.ndarray, factor: int, offset: int) -> None:
    """Write what is left of a device's output: factor times it, plus offset."""
    there = fault.there(k)
    if 'stuck' in fault.spec:
        table[there, factor], table[there, offset] = 0.0, fault.spec['stuck']
    else:
        table[there, factor] *= fault.spec['efficiency']
