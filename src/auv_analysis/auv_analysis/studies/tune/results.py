"""A tuning from search to results: check against `simulate`, Monte Carlo, paired comparisons."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.metrics.authority import beyond_authority
from auv_analysis.metrics.quantities import COSTS
from auv_analysis.output.arrow import pa
from auv_analysis.output.new_files import known
from auv_analysis.report.results import Results
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scenario import Scenario, load_scenario, write_inputs
from auv_analysis.simulation.simulate import DivergedError, simulate
from auv_analysis.studies.pairs import Pairs, holm, log_ratios, paired
from auv_analysis.studies.tune.cost import Measures, measures_of_run, of_each
from auv_analysis.studies.tune.gain_space import STRUCTURES
from auv_analysis.studies.tune.perturbations import applicable, monte_carlo
from auv_analysis.studies.tune.search import Goal, Request, TunedLaw, structures_of, tuned
from auv_dynamics.files.errors import FailedError
from auv_gvc_controller.laws.law import SHIPPED

COMPARED = ('weighted_error', 'error', 'effort', 'late_error', 'settling')
LEVEL = 0.05  # of Holm's p below which a difference is called one
QUANTILES = {'q05': 0.05, 'q25': 0.25, 'median': 0.5, 'q75': 0.75, 'q95': 0.95}


@dataclass(frozen=True)
class Comparison(Pairs):
    """A controller against another one in one measure, over the same draws; ratios of `Pairs`.

    Attributes
    ----------
    controller, against : their names
    measure : one of `COMPARED`
    draws : number of pairs
    p_holm : p after Holm's correction for all comparisons of the document

    """

    controller: str
    against: str
    measure: str
    draws: int
    p_holm: float

    @property
    def verdict(self) -> int:
        """-1 smaller, 1 larger, 0 no difference that the test tells from chance."""
        return 0 if self.p_holm >= LEVEL else int(np.sign(self.effect))


def compare(found: Mapping[str, Measures], pairs: Iterable[tuple[str, str]]) -> list[Comparison]:
    """Compare pairs of controllers in every measure that exists, of a loop in a draw at least.

    Parameters
    ----------
    found : controller -> Measures of (n,), row i of all of the same draw
    pairs : (controller, against)

    Returns
    -------
    comparisons : corrected for their number

    """
    known = [
        measure
        for measure in COMPARED
        if any(np.isfinite(getattr(measures, measure)).any() for measures in found.values())
    ]
    names = [(a, b, measure) for a, b in pairs for measure in known]
    ratios = [log_ratios(getattr(found[a], m), getattr(found[b], m)) for a, b, m in names]
    rows = [paired(d) for d in ratios]
    adjusted = holm([row.p for row in rows])
    return [
        Comparison(**asdict(row), controller=a, against=b, measure=m, draws=len(d), p_holm=p)
        for row, (a, b, m), d, p in zip(rows, names, ratios, adjusted, strict=True)
    ]


@dataclass(frozen=True, eq=False)
class Tuning:
    """All that a tuning gave.

    Attributes
    ----------
    request, goal : what was asked, and the reference's measures
    scenario : with the scenario's own controllers and the tuned ones
    laws : name in that scenario -> tuned law
    nominal : controller -> measures (1,) in the scenario itself
    deviation : largest relative difference of these to the same from `simulate`
    commands : controller -> largest magnitudes (6,) of its command, N and N m; not of diverged ones
    draws : controller -> measures (n,), row i of the same draw; empty without Monte Carlo

    """

    request: Request
    goal: Goal
    scenario: Scenario
    laws: Mapping[str, TunedLaw]
    nominal: Mapping[str, Measures]
    deviation: float
    commands: Mapping[str, np.ndarray]
    draws: Mapping[str, Measures]

    @property
    def retuned(self) -> str | None:
        """Name of the reference's own law with searched gains; None where it is no shipped law."""
        law = self.scenario.controller(self.request.reference)['law']
        return next((name for name, one in self.laws.items() if one.law == law), None)

    @cached_property
    def comparisons(self) -> list[Comparison]:
        """Each controller against the reference, each tuned law against the reference's own."""
        reference, own = self.request.reference, self.retuned
        pairs = [(name, reference) for name in self.scenario.controllers if name != reference]
        if own is not None:
            pairs += [(name, own) for name in self.laws if name != own]
        return compare(self.draws, pairs) if self.draws else []

    def ratio(self, name: str, measure: str) -> float:
        """A measure of a controller in the scenario itself, to the reference's."""
        value, base = (getattr(self.nominal[n], measure)[0] for n in (name, self.request.reference))
        return float(value / base)

    def remarks(self, name: str) -> list[str]:
        """Warnings on a controller's numbers, a phrase each."""
        found = []
        if name in self.laws:
            found += self.laws[name].remarks(self.scenario.duration)
        if name in self.commands:
            found += beyond_authority(self.scenario.vehicle, self.commands[name].tolist())
        return found

    @cached_property
    def results(self) -> Results:
        """`tune.json`, but for the sentences; `search.parquet` and `monte_carlo.parquet`."""
        request, names = self.request, list(self.scenario.controllers)
        asked = ('reference', 'equal', 'index', 'tolerance', 'structure', 'hold', 'seed')
        facts: dict[str, Any] = {
            'scenario': request.scenario.name,
            'vehicle': request.scenario.vehicle.name,
            **{key: getattr(request, key) for key in asked},
            'measures': {
                name: {'label': cost.label, 'unit': cost.unit, 'text': cost.meaning}
                for name, cost in COSTS.items()
            },
            'controllers': {name: self._controller(name) for name in names},
            'validation': {'largest_relative_deviation': self.deviation},
            'monte_carlo': None,
        }
        if self.draws:
            comparisons = [asdict(c) | {'verdict': c.verdict} for c in self.comparisons]
            facts['monte_carlo'] = {
                'samples': len(self.draws[request.reference].error),
                'spread': applicable(request.spread, request.scenario.vehicle),
                'controllers': {name: _distribution(self.draws[name]) for name in names},
                'comparisons': comparisons,
            }
        results = Results('tune', known(facts))
        results.add('search', 'All gains that were evaluated', _evaluations(self.laws), {})
        if self.draws:
            results.add('monte_carlo', 'A row per draw and controller', _draws(self.draws), {})
        return results

    def _controller(self, name: str) -> dict[str, Any]:
        entry = self.scenario.controller(name)
        found: dict[str, Any] = {
            'law': entry['law'],
            'tuned': name in self.laws,
            'gains': self.scenario.gain_values(name),
            'measures': _numbers(self.nominal[name]),
            'equality': self.ratio(name, self.goal.names[1]) - 1.0,
            'remarks': self.remarks(name),
        }
        if name not in self.laws:
            return found
        law = self.laws[name]
        return found | {
            'structure': law.best.space.structure,
            'structure_means': STRUCTURES[law.best.space.structure],
            'at_bound': law.best.space.at_bound(law.best.x),
            'reached': law.best.reached,
            'price': law.best.price,
            'evaluations': sum(len(s.points) for s in law.searches),
            'searches': [
                {
                    'structure': s.space.structure,
                    'reached': s.reached,
                    'evaluations': len(s.points),
                    'searched': self._bounds(s.space.law),
                    'measures': _numbers(s.measures),
                }
                for s in law.searches
            ],
        }

    def _bounds(self, law: str) -> dict[str, Any]:
        gains = SHIPPED[law].search(self.request.scenario.step)
        return {
            gain: {'low': about.low, 'high': about.high, 'times_inertia': about.inertial}
            for gain, about in gains.items()
        }


def _numbers(measures: Measures) -> dict[str, float]:
    """Measures (1,) as numbers."""
    return {name: float(values[0]) for name, values in measures._asdict().items()}


def _distribution(draws: Measures) -> dict[str, Any]:
    """Quantiles of each measure, a loop that diverged or does not settle above all others."""
    found: dict[str, Any] = {
        'diverged': float(np.isnan(draws.error).mean()),
        'settled': float(np.isfinite(draws.settling).mean()),
    }
    for name, values in draws._asdict().items():
        ordered = np.nan_to_num(values, nan=np.inf, posinf=np.inf)
        at = np.quantile(ordered, list(QUANTILES.values()), method='higher')
        found[name] = dict(zip(QUANTILES, at.tolist(), strict=True))
    return found


def _evaluations(laws: Mapping[str, TunedLaw]) -> pa.Table:
    """A row for every point that a search evaluated.

    Columns controller, law, structure, stage, diverged, allowed (its velocity loop is slow enough
    for the control period), the measures, then what was searched: a gain as the law takes it or,
    where the structure is a matrix times a number, that number.
    """
    tables = []
    for name, law in laws.items():
        for one in law.searches:
            words = {'controller': name, 'law': law.law, 'structure': one.space.structure}
            gains = zip(one.space.names, np.exp(one.points.T), strict=True)
            tables.append(
                pa.table({
                    **{key: [word] * len(one.points) for key, word in words.items()},
                    'stage': one.stages.tolist(),
                    'diverged': np.isnan(one.evaluations.error),
                    'allowed': one.allowed,
                    **_columns(one.evaluations),
                    **{f'gain.{gain}': values for gain, values in gains},
                })
            )  # fmt: skip
    return pa.concat_tables(tables, promote_options='default')


def _draws(draws: Mapping[str, Measures]) -> pa.Table:
    """A row per draw and controller: draw, controller, diverged, the measures."""
    return pa.concat_tables(
        pa.table({
            'draw': np.arange(len(measures.error)),
            'controller': [name] * len(measures.error),
            'diverged': np.isnan(measures.error),
            **_columns(measures),
        })
        for name, measures in draws.items()
    )  # fmt: skip


def _columns(measures: Measures) -> dict[str, pa.Array]:
    """The measures; null for what diverged or does not settle."""
    return {
        name: pa.array(values, mask=~np.isfinite(values))
        for name, values in measures._asdict().items()
    }


SAME = 1e-6  # relative: a batch and a single run differ by rounding alone
LONGEST = 100  # characters of a scenario's name
Progress = Callable[[str, int], Callable[[], None]]  # what is done, in how many parts -> a part is


def tune(request: Request, out: Path, progress: Progress) -> Tuning:
    """Tune, check, perturb and compare; `scenario.yaml` with its files is written to `out` first.

    Raises
    ------
    DivergedError : the reference's own loop
    FailedError : single runs of the written scenario do not give what the search saw

    """
    goal = Goal.of(request)
    laws: dict[str, TunedLaw] = {}
    for law in request.laws:
        advance = progress(f'tuning {law}', len(structures_of(request.structure)))
        laws[_free(f'{law}_tuned', request.scenario)] = tuned(request, law, goal, advance)
    written = write_inputs(_with(request.scenario, laws), out)
    scenario = load_scenario(written['scenario.yaml'])
    nominal = of_each(scenario, request.hold)
    deviation, commands = _checked(scenario, request, nominal, progress)
    draws: dict[str, Measures] = {}
    if request.samples:
        what = f'{request.samples} draws of model error and disturbance'
        draws = monte_carlo(
            scenario, request.spread, request.samples, request.seed, request.hold, request.threads,
            progress(what, request.samples),
        )  # fmt: skip
    return Tuning(request, goal, scenario, laws, nominal, deviation, commands, draws)


def _free(name: str, scenario: Scenario) -> str:
    """The name, longer where the scenario has a controller of that name."""
    while name in scenario.controllers:
        name += '_again'
    return name


def _with(scenario: Scenario, laws: Mapping[str, TunedLaw]) -> Scenario:
    """The scenario with the tuned laws as further controllers, under a name of its own."""
    entries: dict[str, Any] = {name: law.entry for name, law in laws.items()}
    name = f'{scenario.name[: LONGEST - len("_tuned")]}_tuned'
    values = {'name': name, 'controllers': {**scenario.controllers, **entries}}
    changed = changed_scenario(scenario, values)
    return replace(changed, attachments={**scenario.attachments, **changed.attachments})


def _checked(
    scenario: Scenario, request: Request, nominal: Mapping[str, Measures], progress: Progress
) -> tuple[float, dict[str, np.ndarray]]:
    """Largest relative deviation of single runs from the batch, and their largest commands (6,)."""
    advance = progress('checking against single runs', len(nominal))
    largest, commands = 0.0, {}
    for name, expected in nominal.items():
        try:
            run = simulate(scenario, name, request.hold)
        except DivergedError:
            found = Measures(*(np.full(1, np.nan) for _ in Measures._fields))
        else:
            found, commands[name] = measures_of_run(run), np.abs(run.tau).max(axis=0)
        deviations = [_deviation(a[0], b[0]) for a, b in zip(found, expected, strict=True)]
        largest = max(largest, *deviations)
        if largest > SAME:
            worst = Measures._fields[int(np.argmax(deviations))]
            text = f'expected what the batch gave, found {worst} apart by {largest:.2g}'
            raise FailedError(f'{scenario.name}, {name}: {text} (relative)')
        advance()
    return largest, commands


def _deviation(a: float, b: float) -> float:
    if a == b or (np.isnan(a) and np.isnan(b)):
        return 0.0
    return float(abs(a - b) / max(abs(a), abs(b))) if np.isfinite(a) and np.isfinite(b) else np.inf
