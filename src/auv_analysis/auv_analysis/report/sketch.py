"""What the report needs of a run, taken in one pass over its blocks: lines, extremes, sums."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from auv_analysis.report.statistics import Part, Statistics
from auv_analysis.report.traces import Line, Trace, broken
from auv_analysis.runs.run import Extent, Facts

FOREVER = float('inf')
FEWEST_SHARED = 10  # samples at equal times, from which on courses are compared
ROUNDING, TINY = 1e-6, 1e-9  # of the peak, and in the unit of a signal: apart by no more is alike


@dataclass(frozen=True, eq=False, kw_only=True)
class Sketch(Facts):
    """A run as the report sees it: never more than some thousand points of each signal.

    Signals of six columns: `nu`, `tau`, `delta_xi`, `delta_pi`, `energy`, and where they are there
    `error`, `nu_d`, `F`, `lumped_error`, `applied` and, of an F that was estimated, `unexplained`
    with `least` and `most`, two standard errors around it. Of one column: `kinetic` and `wanted`,
    the energies of the run and of its set-point, if there is one, and of a certificate `L`,
    `L_dot`, `identity`, `bound` and `increasing`, 1 where the identity is positive, else 0.

    Attributes
    ----------
    known_extent : length and optional signals
    columns : name -> its columns in the statistics
    statistics : of all signals
    traces : name, part -> lines of the columns; parts are 'whole', 'early', 'late' (of the
        transient) and 'log' (over the time since the start)
    stack : times (c,) and shares (c, 6) in %, means over columns of samples
    settled : time, s from the start, of the last sample with an error above 0.005; 0: of none,
        inf: one of the final dwell time
    begin, end : eta and nu (12,) at the first sample, eta (6,) at the last
    course : times `t` since the start of some samples, s, and (m, 6) `nu_d` and `F` there where
        they are known: what `alike` looks at
    estimates : whether the adaptive term is ever other than zero
    missed : (6,) whether the applied wrench ever differs from the command
    F_digest : tells disturbances of different runs apart

    """

    known_extent: Extent
    columns: dict[str, slice]
    statistics: Statistics
    traces: dict[tuple[str, str], list[Trace]]
    stack: Line
    settled: float
    begin: np.ndarray
    end: np.ndarray
    course: dict[str, np.ndarray]
    estimates: bool
    missed: np.ndarray
    F_digest: bytes

    @property
    def extent(self) -> Extent:
        """Length and optional signals."""
        return self.known_extent

    def line(self, name: str, column: int = 0, part: str = 'whole') -> Line:
        """Line of a column of a signal."""
        return self.traces[name, part][column].line()

    def shares(self) -> Line:
        """The stacked shares, nothing in gaps."""
        t, parts = self.stack
        for begin, end in self.gaps:
            outside = (t <= begin) | (t >= end)  # a column of samples may lie across
            t, parts = t[outside], parts[outside]
            at = np.searchsorted(t, [begin + self.step, end - self.step])
            t = np.insert(t, at, [begin + self.step, end - self.step])
            parts = np.insert(parts, at, 0.0, axis=0)
        return t, parts

    def drawn(self, name: str, column: int = 0, part: str = 'whole') -> Line:
        """The same line with a NaN in every gap, so that it breaks there."""
        origin = self.start if part == 'log' else 0.0
        gaps = [(begin - origin, end - origin) for begin, end in self.gaps]
        return broken(self.line(name, column, part), gaps, self.step)

    def part(self, name: str, first: float = 0.0, last: float = FOREVER) -> Part:
        """Statistics of a signal in [first, last], s from the start.

        First may be 0, 2 or `last_third`, last 2, 10, the common window or the end; another time
        is a ValueError, as are times between which there is no sample.

        """
        begin = None if first <= 0.0 else cut_before(self, first)
        end = None if last >= self.duration else cut_behind(self, last)
        found = self.statistics.between(begin, end)
        if found is None:
            raise ValueError(f'expected samples in {first:g} to {last:g} s, found none')
        return found.of(self.columns[name])


def alike(runs: Sequence[Sketch], signal: str) -> bool | None:
    """Whether a signal has the same course in all runs, over the time that they share.

    Parameters
    ----------
    runs : one at least
    signal : 'nu_d' or 'F'

    Returns
    -------
    alike : None where a run does not know it, or where they share too few times to tell

    """
    first = runs[0].course
    if any(signal not in run.course for run in runs):
        return None
    for other in (run.course for run in runs[1:]):
        _, mine, theirs = np.intersect1d(first['t'], other['t'], return_indices=True)
        if len(mine) < min(FEWEST_SHARED, len(first['t']), len(other['t'])):
            return None
        a, b = first[signal][mine], other[signal][theirs]
        if np.any(np.abs(a - b) > ROUNDING * np.abs(a).max(axis=0) + TINY):
            return False
    return True


def cut_before(run: Facts, time: float) -> float:
    """Cut before the sample nearest to a time, s from the start."""
    return run.start + time - 0.5 * run.step


def cut_behind(run: Facts, time: float) -> float:
    """Cut behind the sample nearest to a time, s from the start."""
    return float(np.nextafter(run.start + time + 0.5 * run.step, np.inf))


def last_third(run: Facts) -> float:
    """Time from which the last third of a run counts, s from the start."""
    return 2.0 / 3.0 * run.duration
