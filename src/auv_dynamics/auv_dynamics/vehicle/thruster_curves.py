"""Thruster curves: the thrust of a command and the command of a thrust, from measured tables."""

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from auv_dynamics.files.errors import InputError, shorten
from auv_dynamics.files.nearest import one_of
from auv_dynamics.files.yaml_files import read_text

SHIPPED = Path(__file__).with_name('curves')
NEUTRAL = {'pwm_us': 1500.0, 'percent': 0.0, 'command': 0.0}  # what asks for no thrust
THRUSTS = {'thrust_n': 1.0, 'thrust_kgf': 9.80665}  # N of one
TABULATED = re.compile(r'(?P<family>.+)_(?P<voltage>\d+)v')  # names of the shipped curves
ROUGH = 0.02  # of the range of a curve: what measurement alone makes it fall, more is refused


@dataclass(frozen=True, eq=False)
class ThrusterCurve:
    """Steady thrust of a thruster at rest in the water, linear between the rows of a table.

    Attributes
    ----------
    name : of the shipped curve, or its file
    unit : of the command, a key of `NEUTRAL`
    commands : (n,) rising
    thrusts : (n,) N, never falling; zero over the dead band

    """

    name: str
    unit: str
    commands: np.ndarray
    thrusts: np.ndarray

    @property
    def voltage(self) -> float | None:
        """Voltage in V at which a shipped curve was measured; None of any other."""
        found = TABULATED.fullmatch(self.name)
        return float(found['voltage']) if found and self.name in shipped_curves() else None

    @property
    def dead_band(self) -> tuple[float, float]:
        """Lowest and highest command without thrust; both where the line crosses zero."""
        still = self.commands[self.thrusts == 0.0]
        if len(still):
            return float(still[0]), float(still[-1])
        crossing = float(np.interp(0.0, self.thrusts, self.commands))
        return crossing, crossing

    def thrust(self, commands: np.ndarray, reversed_: np.ndarray | bool = False) -> np.ndarray:
        """Thrust in N of commands (...); beyond the table, that of its end.

        A pulse width of zero is no pulse, and no thrust.

        Parameters
        ----------
        commands : (...) in the curve's unit
        reversed_ : (...) of thrusters that turn the other way round: their command is mirrored
            about neutral

        """
        commands = np.asarray(commands, float)
        neutral = NEUTRAL[self.unit]
        mirrored = np.where(reversed_, 2.0 * neutral - commands, commands)
        thrusts = np.interp(mirrored, self.commands, self.thrusts)
        silent = (self.unit == 'pwm_us') & (commands == 0.0)
        return np.where(silent, 0.0, thrusts)

    def command(self, thrusts: np.ndarray, reversed_: np.ndarray | bool = False) -> np.ndarray:
        """Command of thrusts (...) in N; beyond the table, that of its end; of zero, neutral.

        Neutral is the middle of the dead band where that does not hold the nominal one.
        """
        thrusts = np.asarray(thrusts, float)
        low, high = self.dead_band
        neutral = NEUTRAL[self.unit]
        rest = neutral if low <= neutral <= high else (low + high) / 2.0
        astern, ahead = self.thrusts < 0.0, self.thrusts > 0.0
        below = np.interp(
            thrusts, np.append(self.thrusts[astern], 0.0), np.append(self.commands[astern], low)
        )
        above = np.interp(
            thrusts,
            np.insert(self.thrusts[ahead], 0, 0.0),
            np.insert(self.commands[ahead], 0, high),
        )
        found = np.select([thrusts < 0.0, thrusts > 0.0], [below, above], rest)
        return np.where(reversed_, 2.0 * neutral - found, found)


@cache  # every rotor of a vehicle asks
def shipped_curves() -> list[str]:
    """Names of the curves that come along."""
    return sorted(path.stem for path in SHIPPED.glob('*.csv'))


def at_voltage(curve: ThrusterCurve, nominal: float, voltage: float) -> ThrusterCurve:
    """Curve of the same thruster at another voltage.

    At each command thrust is linear between the voltages of a shipped family of curves. Beyond
    them, and for a curve that stands alone, it goes by the square of the voltage: the speed of the
    rotor goes by the voltage, and thrust by the square of the speed (Fossen 2021, section 9.3).

    Parameters
    ----------
    curve : at the nominal voltage
    nominal, voltage : V

    """
    found = TABULATED.fullmatch(curve.name) if curve.voltage is not None else None
    if found is None:
        return replace(curve, thrusts=curve.thrusts * (voltage / nominal) ** 2)
    family = [
        load_curve(name) for name in shipped_curves() if name.startswith(f'{found["family"]}_')
    ]
    family.sort(key=lambda one: one.voltage or 0.0)
    known = np.array([one.voltage for one in family], float)
    within = float(np.clip(voltage, known[0], known[-1]))
    above = max(int(np.searchsorted(known, within)), 1)
    low, high = (family[i].thrust(curve.commands) for i in (above - 1, above))
    share = (within - known[above - 1]) / (known[above] - known[above - 1])
    thrusts = (low + share * (high - low)) * (voltage / within) ** 2
    return replace(curve, name=f'{curve.name} at {voltage:g} V', thrusts=thrusts)


def curve_of(given: str | Mapping[str, Any], file: object, key: str) -> ThrusterCurve:
    """Curve that a vehicle file gives: the name of a shipped one, or a table of two columns.

    Parameters
    ----------
    given : name, or a mapping of a list pwm_us, percent or command and a list thrust_n or
        thrust_kgf, as in the files of `load_curve`
    file, key : named in errors

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    if isinstance(given, str):
        if given not in shipped_curves():
            expected = f'a table, or {one_of(given, shipped_curves())}'
            raise InputError(file, key, expected, given)
        return load_curve(given)
    try:
        unit, force = _columns([*given])
        commands, thrusts = (np.array(given[name], float) for name in (unit, force))
        if len(commands) != len(thrusts):
            expected = f'{unit} and {force} of equal length'
            raise InputError('', '', expected, f'{len(commands)} and {len(thrusts)}')
        values = np.stack([commands, thrusts], axis=1)
        _check(values, file)
    except InputError as error:
        raise InputError(file, key, error.expected, error.found) from None
    return ThrusterCurve('', unit, commands, np.sort(thrusts) * THRUSTS[force])


def _columns(header: list[str]) -> tuple[str, str]:
    """Names of the command and of the thrust among those of all columns."""
    found = []
    for names in (NEUTRAL, THRUSTS):
        known = [cell for cell in header if cell in names]
        if len(known) != 1:
            expected = f'one column {" or ".join(names)}'
            raise InputError('', '', expected, ','.join(header) or None)
        found.append(known[0])
    return found[0], found[1]


def source_of(name: str) -> str:
    """Source of a shipped curve: the comment at the head of its file."""
    text = (SHIPPED / f'{name}.csv').read_text(encoding='utf-8')
    said = [line.lstrip('# ') for line in text.splitlines() if line.startswith('#')]
    return ' '.join(said)


def load_curve(curve: str | Path, beside: Path | None = None) -> ThrusterCurve:
    """Curve of a CSV file, or a shipped one by its name.

    Parameters
    ----------
    curve : file with a column pwm_us, percent or command (-1 to 1), rising, and a column thrust_n
        or thrust_kgf; lines that begin with # are comments. Or a name such as 't200_16v'
    beside : folder that a relative path may start from

    Raises
    ------
    InputError : naming file, line, expected and found

    """
    path = Path(curve)
    if path.suffix != '.csv':
        if str(curve) not in shipped_curves():
            raise InputError(
                'curve', '', f'a .csv file, or {one_of(curve, shipped_curves())}', curve
            )
        path = SHIPPED / f'{curve}.csv'
    elif beside is not None and (beside / path).is_file():
        path = beside / path
    return _parsed(read_text(path, 'thruster curve'), path, str(curve))


@lru_cache(maxsize=32)  # a voltage between two of a family asks for all of them
def _parsed(text: str, path: Path, name: str) -> ThrusterCurve:
    lines = [
        (number, line) for number, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith('#')
    ]  # fmt: skip
    try:
        rows = list(csv.reader(line for _, line in lines))
    except csv.Error as error:
        raise InputError(path, '', 'a CSV table', str(error)) from None
    if len(rows) != len(lines):
        raise InputError(path, '', 'each row in a line', 'a cell of several lines')
    header = [cell.strip() for cell in rows[0]] if rows else []
    try:
        unit, force = _columns(header)
    except InputError as error:
        raise InputError(path, 'first line', error.expected, error.found) from None
    columns = [header.index(name) for name in (unit, force)]
    table = []
    for (number, _), row in zip(lines[1:], rows[1:], strict=True):
        try:
            table.append([float(row[column]) for column in columns])
        except (ValueError, IndexError):
            raise InputError(path, f'line {number}', 'two numbers', ','.join(row)) from None
    values = np.array(table).reshape(-1, 2)
    _check(values, path)
    commands, thrusts = values[:, 0], values[:, 1] * THRUSTS[force]
    # sorted, measured values of a rising curve are never farther off than as they came
    return ThrusterCurve(name, unit, commands, np.sort(thrusts))


def _check(values: np.ndarray, path: object) -> None:
    """Refuse what is no curve: not finite, commands that do not rise, thrust that falls."""
    commands, thrusts = values.T
    if len(values) < 2 or not np.all(np.isfinite(values)):
        raise InputError(path, '', 'two and more rows of finite numbers', f'{len(values)} rows')
    if np.any(np.diff(commands) <= 0.0):
        k = int(np.argmax(np.diff(commands) <= 0.0))
        raise InputError(
            path, '', 'commands that rise', f'{commands[k + 1]:g} after {commands[k]:g}'
        )
    fall = float(np.max(np.maximum.accumulate(thrusts) - thrusts))
    if not thrusts[0] <= 0.0 <= thrusts[-1] or np.ptp(thrusts) == 0.0:
        ends = shorten([float(thrusts[0]), float(thrusts[-1])])
        raise InputError(path, '', 'thrust that rises from astern or zero to ahead', ends)
    if fall > ROUGH * float(np.ptp(thrusts)):
        raise InputError(path, '', 'thrust that rises with the command', f'a fall of {fall:.3g}')
