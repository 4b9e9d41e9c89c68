"""Response to faults: errors and effort before, during and after each."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from auv_analysis.metrics.quantities import SIGNALS
from auv_analysis.metrics.settling import TRANSIENT, band_of, settling_times
from auv_analysis.metrics.statistics import Part, Statistics
from auv_analysis.runs.run import Run, RunInfo
from auv_analysis.scenario.fault_words import Mark
from auv_dynamics.vehicle import DOFS

FILE = 'faults.parquet'
SHORTEST = 1.0  # s: least length of the time before and after that a fault is held against
PARTS = ('before', 'during', 'after')
Window = tuple[float, float]


@dataclass(frozen=True)
class FaultResponse:
    """A fault in one degree of freedom of one run; None is what does not exist.

    Attributes
    ----------
    mark : the fault
    law, dof : of the run
    windows : times of `rms` and `effort`, s
    rms : of nu_d - nu before, during and after, m/s or rad/s
    peak : largest absolute error before, during and after
    band : of a settled error
    recovery : s from the end of the fault until the error has settled in the band, dwell time
        included, up to the next begin or end of a fault or the end of the run
    until : s, when the time that `recovery` looks at ends; None where the fault has no end
    effort : RMS of the commanded wrench of this axis before, during and after, N or N m

    """

    mark: Mark
    law: str
    dof: str
    windows: tuple[Window, Window, Window]
    rms: tuple[float | None, float | None, float | None]
    peak: tuple[float | None, float | None, float | None]
    band: float
    recovery: float | None
    until: float | None
    effort: tuple[float | None, float | None, float | None]


def windows_of(mark: Mark, run: RunInfo) -> tuple[Window, Window, Window]:
    """Times [from, to) before, during and after a fault, s; empty where there is none.

    Before and after are as long as the fault, `SHORTEST` at least, and end where another fault
    begins or ends; what comes before has nothing of the transient that a run begins with, unless
    the fault does.
    """
    first, last = run.start, run.start + run.duration + run.step / 2
    if mark.start > first + TRANSIENT:
        first += TRANSIENT
    start, end = max(mark.start, first), min(mark.end, last)
    length = max(end - start, SHORTEST)
    begun = [other.start for other in run.faults if other.start < start]
    ended = [other.end for other in run.faults if other.end <= start]
    before = max([first, start - length, *begun, *ended])
    after = end, min(end + length, next_change(mark, run))
    return (before, start), (start, max(start, end)), after


def next_change(mark: Mark, run: RunInfo) -> float:
    """Time of the first begin or end of another fault behind the end of this one, or of the end."""
    last = run.start + run.duration + run.step / 2
    begins = [other.start for other in run.faults if other.start >= mark.end]
    return min([last, *begins, *(other.end for other in run.faults if other.end > mark.end)])


def responses(run: Run) -> list[FaultResponse]:
    """Every fault of a run in every degree of freedom; none where no set-point is known."""
    if not run.faults or not run.knows_setpoint:
        return []
    tiny = 1e-6 * run.step
    windows = {mark: windows_of(mark, run) for mark in run.faults}
    cuts = [time - tiny for three in windows.values() for window in three for time in window]
    statistics, peak = Statistics(cuts), np.zeros(6)
    for block in run.blocks():
        statistics.add(block.t, np.concatenate([block.nu_d - block.nu, block.tau], axis=1))
        peak = np.maximum(peak, np.abs(block.nu_d).max(axis=0))
    band = band_of(peak)
    last, found = run.start + run.duration, []
    for mark in run.faults:
        recovery = recovery_times(mark, run, band)
        until = min(next_change(mark, run), last) if mark.end <= last + tiny else None
        parts = [statistics.between(a - tiny, b - tiny) for a, b in windows[mark]]
        for i, dof in enumerate(DOFS):
            found.append(
                FaultResponse(
                    mark,
                    run.law,
                    dof,
                    windows[mark],
                    _of(parts, 'rms', i),
                    _of(parts, 'peak', i),
                    float(band[i]),
                    recovery[i],
                    until,
                    _of(parts, 'rms', 6 + i),
                )
            )
    return found


def _of(parts: Sequence[Part | None], name: str, column: int) -> tuple[Any, ...]:
    """A number of each part, None of one without samples."""
    return tuple(None if part is None else float(getattr(part, name)[column]) for part in parts)


def recovery_times(mark: Mark, run: Run, band: np.ndarray) -> list[float | None]:
    """Seconds from the end of a fault until each error has settled in its band; None: never."""
    tiny, until = 1e-6 * run.step, next_change(mark, run)
    first, last = np.searchsorted(run.t, [mark.end - tiny, until - tiny])
    if mark.end < run.start or first == last:
        return [None] * 6
    behind = run.part(slice(first, last))
    errors = ((block.t, block.nu_d - block.nu) for block in behind.blocks())
    settled, _ = settling_times(errors, last - first, band)
    return [
        None if time is None else 0.0 if time == behind.t[0] else round(time - mark.end, 9)
        for time in settled
    ]


def fault_rows(found: Mapping[str, Sequence[FaultResponse]]) -> list[dict[str, Any]]:
    """Rows of `faults.parquet`: one per controller, fault and degree of freedom."""
    return [_row(name, response) for name, several in found.items() for response in several]


def _row(controller: str, response: FaultResponse) -> dict[str, Any]:
    mark = response.mark
    row: dict[str, Any] = {
        'fault': mark.number,
        'kind': mark.kind,
        'label': mark.label,
        'start': mark.start,
        'end': None if math.isinf(mark.end) else mark.end,
        'controller': controller,
        'law': response.law,
        'dof': response.dof,
        'unit': SIGNALS['error'].unit_of(response.dof),
        'effort_unit': SIGNALS['tau'].unit_of(response.dof),
        'band': response.band,
        'recovery': response.recovery,
        'until': response.until,
    }
    for name, values in (
        ('rms', response.rms), ('max', response.peak), ('effort', response.effort),
    ):  # fmt: skip
        row |= {f'{name}_{part}': value for part, value in zip(PARTS, values, strict=True)}
    for part, (begin, end) in zip(PARTS, response.windows, strict=True):
        row |= {f'{part}_from': begin, f'{part}_to': end}
    return row
