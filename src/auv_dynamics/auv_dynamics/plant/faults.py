"""Faults of sensors, actuators and links: what fails and when, and its numbers step by step.

The kernel takes a row of numbers per step: what becomes of the wrench (0: it arrives), the age of
the newest measurement that has arrived in steps, a factor per axis (6), an offset per axis (6), a
factor and an offset per thruster (2 n).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import one_of
from auv_dynamics.plant.actuators import WHOLE, steps_of
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.thrusters import Thrusters

SENSING = ('sensor_drop_out', 'sensor_delay', 'sensor_bias')
ACTING = ('thruster', 'actuator', 'wrench_loss')
RANDOM = ('sensor_drop_out', 'wrench_loss')  # of a probability
WRENCH, AGE, AXES, THRUSTERS = 0, 1, 2, 14  # where these stand in a row
HELD, ZEROED = 1.0, 2.0  # a lost wrench: the last one is kept; it has been kept for too long
END = 1 << 62  # step at which what has no end ends


class FaultShape(NamedTuple):
    """Inputs of the kernel, computed before it starts.

    Attributes
    ----------
    any : whether there is any fault
    delay : longest delay of the sensors, steps

    """

    any: bool
    delay: int


@dataclass(frozen=True)
class Fault:
    """One entry of `faults`.

    Attributes
    ----------
    spec : as the scenario writes it; `thruster` is a name
    first, end : it is there at steps k with first <= k < end
    nth : of its kind, from 0: with the kind it says which random stream is its own

    """

    spec: Mapping[str, Any]
    first: int
    end: int
    nth: int

    @property
    def kind(self) -> str:
        """One of `SENSING` or `ACTING`."""
        return self.spec['kind']

    def there(self, k: np.ndarray) -> np.ndarray:
        """(n,) whether it is there at steps k (n,)."""
        return (k >= self.first) & (k < self.end)


@dataclass(frozen=True)
class Faults:
    """Faults of a scenario.

    Attributes
    ----------
    entries : in the scenario's order
    step : s
    thrusters : names of those that the wrench is allocated to; none where it is not

    """

    entries: tuple[Fault, ...]
    step: float
    thrusters: tuple[str, ...]

    def of(self, *kinds: str) -> list[Fault]:
        """Entries of these kinds."""
        return [fault for fault in self.entries if fault.kind in kinds]

    @property
    def sensing(self) -> bool:
        """Whether any of them stands between the true and the measured state."""
        return bool(self.of(*SENSING))

    @property
    def acting(self) -> bool:
        """Whether any of them stands between the command and the applied wrench."""
        return bool(self.of(*ACTING))

    def delay_of(self, fault: Fault) -> int:
        """Steps that a `sensor_delay` takes."""
        return round(fault.spec['delay'] / self.step)

    @property
    def shape(self) -> FaultShape:
        """Inputs of the kernel."""
        delays = [self.delay_of(fault) for fault in self.of('sensor_delay')]
        return FaultShape(bool(self.entries), max(delays, default=0))


NONE = Faults((), 1.0, ())


class FaultSetting(NamedTuple):
    """Setting that faults are checked against.

    Attributes
    ----------
    step : s
    duration : s; 0 or None: without end
    thrusters : of the vehicle file, None where it has none
    allocated : whether the actuators allocate the wrench to them
    vehicle : its name
    file : named in errors

    """

    step: float
    duration: float | None
    thrusters: Thrusters | None
    allocated: bool
    vehicle: str
    file: object


def make_faults(
    specs: Sequence[Mapping[str, Any]], places: Sequence[str], setting: FaultSetting
) -> Faults:
    """Faults of a checked scenario.

    Parameters
    ----------
    specs : mappings with `kind`, `from`, `to` (s) and what that kind takes, see docs/faults.md
    places : the key of each, for errors
    setting : what they must fit to

    Raises
    ------
    InputError : times without a step between them, a thruster that there is not, what overlaps

    """
    entries: list[Fault] = []
    for given, place in zip(specs, places, strict=True):
        spec, (first, end) = dict(given), _interval(given, place, setting)
        if spec['kind'] == 'thruster':
            spec['thruster'] = _thruster(spec, place, setting)
        if spec['kind'] == 'sensor_delay':
            steps_of(spec['delay'], setting.step, setting.file, f'{place}.delay', least=1)
        nth = sum(other.kind == spec['kind'] for other in entries)
        fault = Fault(spec, first, end, nth)
        for other, where in zip(entries, places, strict=False):
            _check_apart(fault, other, place, where, setting)
        entries.append(fault)
    names = setting.thrusters.names if setting.thrusters and setting.allocated else ()
    return Faults(tuple(entries), setting.step, names)


def _interval(spec: Mapping[str, Any], place: str, setting: FaultSetting) -> tuple[int, int]:
    begin, end = float(spec.get('from', 0.0)), spec.get('to')
    if setting.duration and begin > setting.duration:
        expected = f'a time within the run of {setting.duration:g} s'
        raise InputError(setting.file, f'{place}.from', expected, f'{begin:g} s')
    if end is not None and end <= begin:
        expected = f'a time after from ({begin:g} s)'
        raise InputError(setting.file, f'{place}.to', expected, f'{end:g} s')
    first = _step_at(begin, setting)
    last = END if end is None else _step_at(float(end), setting)
    if first == last:
        expected = f'a step between from ({begin:g} s) and to, steps are {setting.step:g} s apart'
        raise InputError(setting.file, f'{place}.to', expected, end and f'{end:g} s')
    return first, last


def _step_at(time: float, setting: FaultSetting) -> int:
    """Index of the first step at or after a time, s."""
    return int(min(np.ceil(time / setting.step - WHOLE), END))


def _thruster(spec: Mapping[str, Any], place: str, setting: FaultSetting) -> str:
    """Name of the thruster that a fault is of; its stuck thrust is checked."""
    key, file, given = f'{place}.thruster', setting.file, spec['thruster']
    if setting.thrusters is None:
        expected = f'a vehicle with thrusters, {setting.vehicle} has none (kind actuator instead)'
        raise InputError(file, key, expected, str(given))
    if not setting.allocated:
        expected = 'actuators: {thrusters: true}, else no wrench is allocated to thrusters'
        raise InputError(file, key, expected, str(given))
    names = setting.thrusters.names
    if isinstance(given, str):
        if given not in names:
            raise InputError(file, key, one_of(given, names), given)
        name = given
    elif given >= len(names):
        raise InputError(file, key, f'an index below {len(names)}', f'{given:g}')
    else:
        name = names[int(given)]
    if 'stuck' in spec:
        i = names.index(name)
        least, most = -setting.thrusters.reverse[i], setting.thrusters.forward[i]
        if not least <= spec['stuck'] <= most:
            expected = f'a thrust of {name}, {least:g} to {most:g} N'
            raise InputError(file, f'{place}.stuck', expected, f'{spec["stuck"]:g} N')
    return name


def _check_apart(fault: Fault, other: Fault, place: str, where: str, setting: FaultSetting) -> None:
    """Refuse two faults that say different things of the same device at the same time."""
    if fault.kind != other.kind or fault.end <= other.first or other.end <= fault.first:
        return
    if fault.kind == 'sensor_delay':
        raise InputError(setting.file, place, 'one sensor_delay at a time', f'{where} as well')
    device = {'thruster': 'thruster', 'actuator': 'axis'}.get(fault.kind)
    if device is None or fault.spec[device] != other.spec[device]:
        return
    if 'stuck' in fault.spec or 'stuck' in other.spec:
        expected = f'{device} {fault.spec[device]} stuck at one value and with no other fault'
        raise InputError(setting.file, place, expected, f'{where} as well')


class Losses:
    """Messages lost by a fault, step by step.

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
    """Effect of `sensor_bias` and `sensor_drop_out` on the measurements of a run."""

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
    """The rows of a run that the kernel takes, the same however many are asked for at once.

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
        seen = np.maximum(np.maximum.accumulate(k - delay), self._seen)
        self._seen = int(seen[-1]) if len(k) else self._seen
        return k - seen

    def _wrench(self, k: np.ndarray) -> np.ndarray:
        """0 where the wrench arrives, else `HELD` or `ZEROED`."""
        lost, timeout = np.zeros(len(k), bool), np.full(len(k), np.inf)
        for fault, losses in self._losses:
            lost |= losses.rows(k)
            there = fault.there(k)
            timeout[there] = np.minimum(timeout[there], fault.spec.get('timeout', np.inf))
        heard = np.maximum.accumulate(np.where(lost, self._heard, k))
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
