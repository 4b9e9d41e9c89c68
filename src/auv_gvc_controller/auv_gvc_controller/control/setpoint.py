"""Velocity set-points nu_d and their derivative: offset plus sinusoids, or a CSV file."""

import csv
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import meant
from auv_dynamics.files.yaml_files import LARGEST, read_text
from auv_dynamics.plant.disturbance import Harmonics
from auv_dynamics.ros.interface import DEPTH
from auv_dynamics.ros.settings import KEY, GridSettings, Spec, setting
from auv_dynamics.vehicle import DOFS

COLUMNS = ('t', *DOFS)
ROUNDING = 1e-10  # s
STOPPING = 0.2  # m/s2, rad/s2: how a set-point without a duration goes to zero after its file


class SetpointTable:
    """Set-points of a CSV file, linear between rows.

    Parameters
    ----------
    t : (m,) s, increasing
    nu_d : (m, 6) m/s and rad/s

    """

    def __init__(self, t: np.ndarray, nu_d: np.ndarray):
        self._t, self._nu_d = t, nu_d
        self._slope = np.diff(nu_d, axis=0) / np.diff(t)[:, None]

    def _segment(self, t: np.ndarray | float) -> np.ndarray:
        # the segment that begins at or before t; a hair of rounding does not choose another one
        k = np.searchsorted(self._t, np.asarray(t, float) + ROUNDING, side='right') - 1
        return np.clip(k, 0, len(self._slope) - 1)

    def value(self, t: np.ndarray | float) -> np.ndarray:
        """nu_d at t (...,) s: (..., 6) in m/s and rad/s, body frame."""
        t = np.minimum(t, self._t[-1])  # past the end the last value is held
        k = self._segment(t)
        return self._nu_d[k] + self._slope[k] * (t - self._t[k])[..., None]

    def derivative(self, t: np.ndarray | float) -> np.ndarray:
        """nu_d_dot (..., 6): slope of the segment that begins at t, m/s2 and rad/s2."""
        held = np.asarray(t, float) > self._t[-1] + ROUNDING
        return np.where(held[..., None], 0.0, self._slope[self._segment(t)])


Setpoint = Harmonics | SetpointTable


def load_table(path: Path, duration: float, text: str | None = None) -> SetpointTable:
    """Set-points of a CSV file with the columns t, surge, sway, heave, roll, pitch, yaw.

    Parameters
    ----------
    path : CSV file, first line the column names
    duration : s that the file must cover from 0; 0: the set-point has no end, and goes to zero
        over a ramp once the file is over
    text : its contents where they have been read already; `path` is then only named in errors

    Returns
    -------
    table : linear between rows, its derivative the slope of the segment that begins at t

    Raises
    ------
    InputError : naming file, line, expected and found

    """
    lines, rows = _rows(path, text)
    header = tuple(name.strip() for name in rows[0]) if rows else ()
    if header != COLUMNS:
        wrong = next((name for name in header if name not in COLUMNS), None)
        expected = f'the columns {",".join(COLUMNS)}{meant(wrong, COLUMNS)}'
        raise InputError(path, 'line 1', expected, ','.join(header) or None)
    values = np.array([_numbers(path, i, row) for i, row in zip(lines[1:], rows[1:], strict=True)])
    if len(values) < 2:
        raise InputError(path, 't', 'at least two rows', f'{len(values)}')
    t = values[:, 0]
    backward = np.flatnonzero(np.diff(t) <= 0)
    if len(backward):
        k = int(backward[0]) + 1
        expected = 'a time later than the line before'
        raise InputError(path, f'line {lines[k + 1]}', expected, f'{t[k]:g}')
    if t[0] > 0 or t[-1] < duration - 1e-9:
        raise InputError(path, 't', f'0 to {duration:g} s covered', f'{t[0]:g} to {t[-1]:g} s')
    nu_d = values[:, 1:]
    stopping = np.abs(nu_d[-1]).max() / STOPPING
    if not duration and stopping > 0.0:
        t = np.append(t, t[-1] + stopping + np.array([0.0, 1.0]))
        nu_d = np.vstack([nu_d, np.zeros((2, 6))])
    return SetpointTable(t, nu_d)


def _rows(path: Path, text: str | None) -> tuple[list[int], list[list[str]]]:
    """Line numbers and cells of the lines that are not blank."""
    text = read_text(path, 'CSV set-point') if text is None else text
    reader = csv.reader(text.splitlines())
    lines, rows = [], []
    try:
        for row in reader:
            if row:
                lines.append(reader.line_num)
                rows.append(row)
    except csv.Error:
        expected = f'{len(COLUMNS)} finite numbers'
        found = 'a cell of more than 131072 characters'
        raise InputError(path, f'line {reader.line_num}', expected, found) from None
    return lines, rows


def _numbers(path: Path, line: int, row: list[str]) -> list[float]:
    try:
        numbers = [np.nan if '_' in cell else float(cell) for cell in row]
    except ValueError:
        numbers = [np.nan]
    if len(numbers) != len(COLUMNS) or not np.all(np.abs(numbers) <= LARGEST):
        huge = f', at most {LARGEST:g}' if np.all(np.isfinite(numbers)) else ''
        expected = f'{len(COLUMNS)} finite numbers{huge}'
        raise InputError(path, f'line {line}', expected, ','.join(row))
    return numbers


def make_setpoint(spec: Mapping[str, Any], duration: float, text: str | None = None) -> Setpoint:
    """Set-point of a checked scenario entry: `file`, or a mapping of degrees of freedom.

    Parameters
    ----------
    spec : {file: path} or {surge: {offset, terms}, ...}
    duration : s that a file must cover, 0: see `load_table`
    text : the file's contents where they have been read already

    """
    if 'file' in spec:
        return load_table(Path(spec['file']), duration, text)
    return Harmonics.from_spec(spec)


@dataclass(frozen=True)
class SetpointSettings(GridSettings):
    """Settings of the set-point node."""

    horizon: int = setting(
        0, 'steps ahead of odom, those until the next one at least', at_least=0, at_most=DEPTH - 1
    )
    setpoint: Spec = field(default_factory=dict, metadata=KEY)
