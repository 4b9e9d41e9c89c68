"""Going through a run once, block by block, for all that the report shows of it."""

import hashlib
from collections.abc import Mapping

import numpy as np

from auv_analysis.metrics.certificate import LAWS, certificate_blocks
from auv_analysis.metrics.coupling import delta_pi, delta_xi
from auv_analysis.metrics.energy import kinetic_energy, shares
from auv_analysis.metrics.summary import TRANSIENT, has_settled
from auv_analysis.report import paper
from auv_analysis.report.sketch import FOREVER, Sketch, cut_before, cut_behind, last_third
from auv_analysis.report.statistics import Statistics
from auv_analysis.report.traces import Line, Trace
from auv_analysis.runs.run import AnyRun, Facts, Run
from auv_gvc_controller.laws.model import ControlModel, control_model

SPLIT = ('error', 'lumped_error', 'tau', 'delta_pi')  # begin with a peak that dwarfs the rest
WHOLE = (
    'F', 'delta_xi', 'applied', 'kinetic', 'wanted', 'energy', 'unexplained', 'least', 'most',
)  # fmt: skip
NEAR_ZERO = 0.005  # m/s, rad/s: what counts as a settled error
SHARE_COLUMNS = 600  # of the stacked shares
COURSE = 1000  # samples, at most, by which runs are compared


def sketches(runs: Mapping[str, AnyRun | Sketch]) -> dict[str, Sketch]:
    """Sketch of each of the runs that are shown together; what is one already stays as it is."""
    window = common_window(runs)
    return {n: run if isinstance(run, Sketch) else sketch(run, window) for n, run in runs.items()}


def common_window(runs: Mapping[str, Facts]) -> float:
    """Time over which the energies of runs are held together, s from the start."""
    return min([paper.ENERGY_WINDOW, *(run.duration for run in runs.values())])


def sketch(run: AnyRun, window: float = paper.ENERGY_WINDOW) -> Sketch:
    """Sketch of a run.

    Parameters
    ----------
    run : of `simulate`, `load_run` or `open_bag`
    window : time of interest, s from the start: statistics may be asked for that end there

    """
    builder = _Builder(run, window)
    for block in run.blocks():
        builder.add(block)
    true = run.knows_disturbance and not (run.sensing or run.acting)
    if true and run.law in LAWS and run.gains:
        builder.add_certificate()
    return builder.built()


def signals(run: Run, model: ControlModel) -> dict[str, np.ndarray]:
    """The signals of a block as `Sketch` names them, (n, 6) or (n, 1) each."""
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
    if run.unexplained is not None and run.unexplained_error is not None:
        apart = 2.0 * run.unexplained_error
        found['unexplained'] = run.unexplained
        found |= {'least': run.unexplained - apart, 'most': run.unexplained + apart}
    if run.applied is not None:
        found['applied'] = run.applied
    if run.disturbance is not None:
        found |= {'F': run.disturbance, 'lumped_error': run.disturbance_estimate - run.disturbance}
    return found


def is_split(run: AnyRun | Sketch) -> bool:
    """Whether the first phase of a run is drawn apart."""
    return run.duration > 2.0 * TRANSIENT


class _Builder:
    """Takes the blocks of a run in their order."""

    def __init__(self, run: AnyRun, window: float):
        self._run, self._model = run, control_model(run.vehicle)
        behind = [cut_behind(run, time) for time in (TRANSIENT, paper.ENERGY_WINDOW, window)]
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
        self._begin, self._end = np.zeros(12), np.zeros(6)
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
        error = found.get('error', np.zeros((1, 6)))
        far = np.flatnonzero(np.abs(error).max(axis=1) > NEAR_ZERO)
        if len(far):
            self._outside = float(block.t[far[-1]] - self._run.start)
            self._left = self._seen - len(error) + int(far[-1])
        self._estimates |= bool(np.any(block.disturbance_estimate != 0.0))
        self._missed |= np.any(block.tau != block.tau_applied, axis=0)
        if block.disturbance is not None:
            self._digest.update(np.ascontiguousarray(block.disturbance).tobytes())
        self._end = block.eta[-1]

    def add_certificate(self) -> None:
        """Go through the run once more for the lines of its certificate."""
        for found in certificate_blocks(self._run, self._model):
            if np.isnan(found.L[0]):
                return  # z is not known
            seen = found.L > 0
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
        if not is_split(self._run):
            self._all('whole', name, t, values)
            return
        early = t <= self._run.start + TRANSIENT
        self._all('early', name, t[early], values[early])
        self._all('late', name, t[~early], values[~early])

    def _all(self, part: str, name: str, t: np.ndarray, values: np.ndarray) -> None:
        for i in range(values.shape[1]):
            self._trace(name, part, i, t, values[:, i])

    def _trace(self, name: str, part: str, i: int, t: np.ndarray, y: np.ndarray) -> None:
        traces = self._traces.setdefault((name, part), [])
        if i == len(traces):
            start, end = self._run.start, self._run.start + self._run.duration
            ends = {
                'whole': (start, end),
                'early': (start, start + TRANSIENT),
                'late': (start + TRANSIENT, end),
                'log': (self._run.step, self._run.duration),
            }
            traces.append(Trace(*ends[part], logarithmic=part == 'log'))
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

    def built(self) -> Sketch:
        """The sketch of the blocks."""
        run = self._run
        return Sketch(
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
