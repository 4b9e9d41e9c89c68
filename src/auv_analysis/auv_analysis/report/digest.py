"""Run digest: the data for plots and tables of a run, taken in one pass over its blocks."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from auv_analysis.metrics.certificate import LAWS, certificate_blocks
from auv_analysis.metrics.coupling import delta_pi, delta_xi
from auv_analysis.metrics.energy import kinetic_energy, shares
from auv_analysis.metrics.settling import TRANSIENT, has_settled
from auv_analysis.metrics.statistics import Part, Statistics
from auv_analysis.metrics.summary import ENERGY_WINDOW
from auv_analysis.report.traces import Line, Trace, broken
from auv_analysis.runs.run import Extent, Run, RunInfo
from auv_gvc_controller.laws.model import ControlModel, control_model

FOREVER = float('inf')
FEWEST_SHARED = 10  # samples at equal times, from which on courses are compared
ROUNDING, TINY = 1e-6, 1e-9  # of the peak, and in the unit of a signal: apart by no more is alike


@dataclass(frozen=True, eq=False, kw_only=True)
class RunDigest(RunInfo):
    """A run as the report sees it: never more than some thousand points of each signal.

    Signals of six columns: `nu`, `tau`, `delta_xi`, `delta_pi`, `energy`, and where they are there
    `error`, `nu_d`, `F`, `lumped_error`, `applied` and, of an F that was estimated, `unexplained`
    or, without a recorded wrench, `required_wrench`, with `least` and `most`, two standard errors
    around it. What was not recorded is NaN throughout. Of one column: `kinetic` and `wanted`,
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
        return broken(self.line(name, column, part), [t - origin for t in self.breaks])

    @property
    def breaks(self) -> list[float]:
        """Where a line breaks, s: a step behind the begin of every gap."""
        return [begin + self.step for begin, _ in self.gaps]

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


def alike(runs: Sequence[RunDigest], signal: str) -> bool | None:
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


def same_vehicle(runs: Sequence[RunInfo]) -> bool:
    """Whether runs, one at least, have the same M, D and g, as their controllers know them."""
    first, *others = ([np.asarray(part) for part in run.vehicle.model] for run in runs)
    return all(np.array_equal(a, b) for one in others for a, b in zip(first, one, strict=True))


def cut_before(run: RunInfo, time: float) -> float:
    """Cut before the sample nearest to a time, s from the start."""
    return run.start + time - 0.5 * run.step


def cut_behind(run: RunInfo, time: float) -> float:
    """Cut behind the sample nearest to a time, s from the start."""
    return float(np.nextafter(run.start + time + 0.5 * run.step, np.inf))


def last_third(run: RunInfo) -> float:
    """Time from which the last third of a run counts, s from the start."""
    return 2.0 / 3.0 * run.duration


ESTIMATES = ('unexplained', 'required_wrench')  # wrenches that are estimated with their error
SPLIT = {'error', 'lumped_error', 'tau', 'delta_pi'}  # begin with a peak that dwarfs the rest
WHOLE = {
    'F', 'delta_xi', 'applied', 'kinetic', 'wanted', 'energy', 'unexplained', 'required_wrench',
    'least', 'most',
}  # fmt: skip
NEAR_ZERO = 0.005  # m/s, rad/s: what counts as a settled error
SHARE_COLUMNS = 600  # px across, of the stacked shares
COURSE = 1000  # samples, at most, by which runs are compared


def digests(runs: Mapping[str, Run | RunDigest]) -> dict[str, RunDigest]:
    """Digest of each of the runs that are shown together; what is one already stays as it is."""
    window = common_window(runs)
    return {
        n: run if isinstance(run, RunDigest) else digest(run, window) for n, run in runs.items()
    }


def common_window(runs: Mapping[str, RunInfo]) -> float:
    """Time over which the energies of runs are held together, s from the start."""
    return min([ENERGY_WINDOW, *(run.duration for run in runs.values())])


def digest(run: Run, window: float = ENERGY_WINDOW) -> RunDigest:
    """Digest of a run.

    Parameters
    ----------
    run : of `simulate`, `load_run` or `open_bag`
    window : time of interest, s from the start: statistics may be asked for that end there

    """
    builder = _Builder(run, window)
    for block in run.blocks():
        builder.add(block)
    ideal = run.knows_wrench and not (run.sensing or run.acting)
    if ideal and run.law in LAWS and run.gains:
        builder.add_certificate()
    return builder.built()


def signals(run: Run, model: ControlModel) -> dict[str, np.ndarray]:
    """The signals of a block as `RunDigest` names them, (n, 6) or (n, 1) each."""
    Upsilon, Upsilon_inv = (m.reshape(6, 6) for m in (model.Upsilon, model.Upsilon_inv))
    energy = kinetic_energy(Upsilon_inv, model.N, run.nu)
    found = {
        'nu': run.nu,
        'tau': run.tau,
        'delta_xi': delta_xi(Upsilon_inv, run.nu),
        'delta_pi': delta_pi(Upsilon, run.tau),
        'energy': energy,
        'kinetic': energy.sum(axis=1, keepdims=True),
    }
    if run.knows_setpoint:
        wanted = kinetic_energy(Upsilon_inv, model.N, run.nu_d)
        found |= {'error': run.nu_d - run.nu, 'nu_d': run.nu_d}
        found['wanted'] = wanted.sum(axis=1, keepdims=True)
    for name in ESTIMATES:
        wrench, error = getattr(run, name), getattr(run, f'{name}_error')
        if wrench is not None:
            found |= {name: wrench, 'least': wrench - 2.0 * error, 'most': wrench + 2.0 * error}
    if run.applied is not None:
        found['applied'] = run.applied
    if run.knows_disturbance:
        found |= {'F': run.disturbance, 'lumped_error': run.disturbance_estimate - run.disturbance}
    return found


def is_split(run: Run | RunDigest) -> bool:
    """Whether the first phase of a run is drawn apart: there are two samples in it at least."""
    return run.duration > 2.0 * TRANSIENT and run.step <= TRANSIENT


class _Builder:
    """Takes the blocks of a run in their order."""

    def __init__(self, run: Run, window: float):
        self._run, self._model, self._split = run, control_model(run.vehicle), is_split(run)
        start, end = run.start, run.start + run.duration
        self._ends = {
            'whole': (start, end),
            'early': (start, start + TRANSIENT),
            'late': (start + TRANSIENT, end),
            'log': (run.step, run.duration),
        }
        behind = [cut_behind(run, time) for time in (TRANSIENT, ENERGY_WINDOW, window)]
        before = [cut_before(run, time) for time in (TRANSIENT, last_third(run))]
        self._statistics = Statistics([*behind, *before])
        self._columns: dict[str, slice] = {}
        self._traces: dict[tuple[str, str], list[Trace]] = {}
        self._digest = hashlib.blake2b()
        edges = np.linspace(0, run.samples, SHARE_COLUMNS + 1).astype(int)
        self._edges = np.unique(edges)[:-1]  # numbers of the samples that begin a column
        self._sums = np.zeros((len(self._edges), 8))  # of 1, t and the energies, by column
        self._seen = 0
        self._outside, self._left = 0.0, -1  # time and number of the last sample far from zero
        self._estimates, self._missed = False, np.zeros(6, bool)
        self._begin: np.ndarray  # eta and nu of the first sample
        self._end: np.ndarray  # eta of the last
        self._every = 1 << ((run.samples - 1) // COURSE).bit_length()  # runs share the times of it
        self._course: dict[str, list[np.ndarray]] = {}

    def add(self, block: Run) -> None:
        """Take in the next block."""
        found = signals(block, self._model)
        if not self._columns:
            stops = np.cumsum([values.shape[1] for values in found.values()]).tolist()
            starts = [0, *stops[:-1]]
            self._columns = {n: slice(a, b) for n, a, b in zip(found, starts, stops, strict=True)}
        self._statistics.add(block.t, np.concatenate([*found.values()], axis=1))
        for name, values in found.items():
            self._draw(name, block.t, values)
        if not self._seen:
            self._begin = np.concatenate([block.eta[0], block.nu[0]])
        kept = slice(-self._seen % self._every, None, self._every)
        since = {'t': np.round(block.t - self._run.start, 9)}
        for name, values in (since | {n: found[n] for n in ('nu_d', 'F') if n in found}).items():
            self._course.setdefault(name, []).append(values[kept].copy())
        self._add_shares(block.t, found['energy'])
        if 'error' in found:
            far = np.flatnonzero(np.any(np.abs(found['error']) > NEAR_ZERO, axis=1))
            if len(far):
                self._outside = float(block.t[far[-1]] - self._run.start)
                self._left = self._seen - len(block.t) + int(far[-1])
        self._estimates |= bool(np.any(np.abs(block.disturbance_estimate) > 0.0))
        if block.applied is not None:
            self._missed |= np.any(block.tau != block.applied, axis=0)
        if block.disturbance is not None:
            self._digest.update(np.ascontiguousarray(block.disturbance).tobytes())
        self._end = block.eta[-1]

    def add_certificate(self) -> None:
        """Go through the run once more for the lines of its certificate."""
        for found in certificate_blocks(self._run, self._model):
            if np.isnan(found.L[0]):
                return  # a velocity, z or F is not known
            seen = found.L > 0
            if seen.any():
                self._trace('L', 'whole', 0, found.t[seen], found.L[seen])
            rates = {'increasing': (found.identity > 0).astype(float)}
            rates |= {name: getattr(found, name) for name in ('L_dot', 'identity', 'bound')}
            for name, values in rates.items():
                self._in_phases(name, found.t, values[:, None])

    def _draw(self, name: str, t: np.ndarray, values: np.ndarray) -> None:
        run = self._run
        if name in SPLIT:
            self._in_phases(name, t, values)
        if name in WHOLE or (name == 'tau' and (run.acting or run.acceleration is not None)):
            self._all('whole', name, t, values)
        if name == 'tau':  # the sample at t = 0 stands at the left edge
            self._all('log', name, np.maximum(t - run.start, run.step), values)
        elif name == 'error':
            later = t > run.start
            self._all('log', name, t[later] - run.start, np.abs(values[later]))

    def _in_phases(self, name: str, t: np.ndarray, values: np.ndarray) -> None:
        if not self._split:
            self._all('whole', name, t, values)
            return
        early = t <= self._ends['early'][1]
        self._all('early', name, t[early], values[early])
        self._all('late', name, t[~early], values[~early])

    def _all(self, part: str, name: str, t: np.ndarray, values: np.ndarray) -> None:
        for i in range(values.shape[1]):
            self._trace(name, part, i, t, values[:, i])

    def _trace(self, name: str, part: str, i: int, t: np.ndarray, y: np.ndarray) -> None:
        traces = self._traces.setdefault((name, part), [])
        if i == len(traces):
            traces.append(Trace(*self._ends[part], logarithmic=part == 'log'))
        traces[i].add(t, y)

    def _add_shares(self, t: np.ndarray, energy: np.ndarray) -> None:
        numbers = np.arange(self._seen, self._seen + len(t))
        column = np.searchsorted(self._edges, numbers, 'right') - 1
        weights = np.column_stack([np.ones(len(t)), t, energy]).T
        first, last = column[0], column[-1] + 1
        self._sums[first:last] += np.column_stack(
            [np.bincount(column - first, weight, last - first) for weight in weights]
        )
        self._seen += len(t)

    def _shares(self) -> Line:
        """Middles of the columns and their shares; only of those in which something moves."""
        means = self._sums[:, 1:] / self._sums[:, :1]
        parts = shares(means[:, 1:])
        moving = parts.sum(axis=1) > 0
        return means[moving, 0], parts[moving]

    def built(self) -> RunDigest:
        """The digest of the blocks."""
        run = self._run
        return RunDigest(
            **run.facts(),
            known_extent=run.extent,
            columns=self._columns,
            statistics=self._statistics,
            traces=self._traces,
            stack=self._shares(),
            settled=self._outside if has_settled(np.array(self._left), run.samples) else FOREVER,
            begin=self._begin,
            end=self._end,
            course={name: np.concatenate(parts) for name, parts in self._course.items()},
            estimates=self._estimates,
            missed=self._missed,
            F_digest=self._digest.digest(),
        )
