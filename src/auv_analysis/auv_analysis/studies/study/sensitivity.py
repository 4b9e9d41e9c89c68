"""Which KPIs of a closed loop follow its gains most, and which gain it is: step 3.

A sweep of the gains: a design of factors, rollouts at its points, Sobol' or Morris indices of the
logarithms of the KPIs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from auv_analysis.runs.run import Hold
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.batch import kernel_of
from auv_analysis.simulation.kernels import IN_PYTHON
from auv_analysis.simulation.rollouts import batch_of, rollouts
from auv_analysis.simulation.variants import packed_variants
from auv_analysis.studies.study.indices import Design, Method, spreads
from auv_analysis.studies.study.kpis import Excluded, Figure, sort_out
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.laws.law import SHIPPED

COUNTS = {'sobol': 256, 'morris': 32}  # default base points, trajectories
OWN_COUNTS = {'sobol': 64, 'morris': 16}  # of a user's law, whose every loop is packed on its own
SLOW_COUNT = 4  # trajectories of a law that runs as plain Python
SHRINKS = 4  # how often the span is tried, each time with the square root of the last


@dataclass(frozen=True)
class Index:
    """What one gain does to one figure; None is what the method does not give.

    Attributes
    ----------
    gain : its name
    S1, ST : share of the variance of ln(figure) that it makes alone, and with all other gains
    mu_star : of Morris: mean change of ln(figure) over its whole range, whatever the sign
    sigma : of Morris: standard deviation of that change
    S1_conf, ST_conf, mu_star_conf : half of the 95 % interval
    elasticity : relative change of the figure per relative change of the gain, by least squares

    """

    gain: str
    elasticity: float
    S1: float | None = None
    S1_conf: float | None = None
    ST: float | None = None
    ST_conf: float | None = None
    mu_star: float | None = None
    mu_star_conf: float | None = None
    sigma: float | None = None

    @property
    def weight(self) -> float:
        """What gains are ordered by: ST, or mu_star."""
        return float(self.mu_star if self.ST is None else self.ST)  # type: ignore[arg-type]  # one of both

    @property
    def doubled(self) -> float:
        """Change of the figure in % when the gain is doubled, by the elasticity."""
        return 100.0 * (2.0**self.elasticity - 1.0)


@dataclass(frozen=True)
class Variable:
    """One figure and how it follows the gains.

    Attributes
    ----------
    figure : which it is
    value : with the scenario's own gains
    smallest, largest : over all rollouts
    spread : standard deviation of ln(figure), about its relative change; with a 95 % interval
    rank : place by spread among the degrees of freedom of this figure, 1 the largest; with a
        95 % interval
    indices : one of each gain

    """

    figure: Figure
    value: float
    smallest: float
    largest: float
    spread: float
    spread_low: float
    spread_high: float
    rank: int
    rank_low: int
    rank_high: int
    indices: tuple[Index, ...]

    @property
    def spread_conf(self) -> float:
        """Half of the 95 % interval of the spread."""
        return 0.5 * (self.spread_high - self.spread_low)

    @property
    def main(self) -> Index:
        """The gain that does most of it."""
        return max(self.indices, key=lambda index: index.weight)


@dataclass(frozen=True)
class Sensitivity:
    """How the figures of one controller follow its gains.

    Attributes
    ----------
    controller, law : whose gains
    method, count, seed : of the design
    rollouts : closed loops that the indices come from; 0 where there are none
    span : every gain is multiplied by a number from 1/span to span, log-uniform
    asked : the span that was asked for; wider than `span` where loops diverged there
    failed : span -> how many rollouts diverged or were refused there
    gains : names of the factors
    left_out : gain -> why it is none
    variables : by falling spread
    excluded : figures that have no spread, and why
    refusal : why there are no variables; empty where there are

    """

    controller: str
    law: str
    method: Method
    count: int
    seed: int
    rollouts: int
    span: float
    asked: float
    failed: Mapping[float, int]
    gains: tuple[str, ...]
    left_out: Mapping[str, str]
    variables: tuple[Variable, ...] = ()
    excluded: tuple[Excluded, ...] = ()
    refusal: str = ''

    def of(self, name: str) -> dict[str, Variable]:
        """Degree of freedom -> variable of a figure such as 'velocity_error.rms'."""
        return {v.figure.dof: v for v in self.variables if v.figure.name == name}

    @property
    def alike(self) -> dict[str, int]:
        """Figure -> number of its degrees of freedom that are ranked."""
        names = [variable.figure.name for variable in self.variables]
        return {name: names.count(name) for name in names}

    def six(self, name: str) -> np.ndarray:
        """Spreads (6,) of a figure; 0 where it has none."""
        found = self.of(name)
        return np.array([found[dof].spread if dof in found else 0.0 for dof in DOFS])


@dataclass(frozen=True)
class GainFactors:
    """What of a controller is multiplied.

    Attributes
    ----------
    scenario : the same with every default gain of the controller written out
    controller : its name
    values : gain -> what the scenario gives: one number, (6,) or (6, 6)
    left_out : gain -> why it is no factor

    """

    scenario: Scenario
    controller: str
    values: Mapping[str, np.ndarray]
    left_out: Mapping[str, str]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the gains that are multiplied."""
        return tuple(self.values)

    def changes(self, factors: np.ndarray) -> dict[str, np.ndarray]:
        """Changes for `rollouts`.

        Parameters
        ----------
        factors : (B, k) positive, a column per gain

        Returns
        -------
        changes : path -> (B, ...) gains

        """
        return {
            gain_path(self.controller, name): np.multiply.outer(factors[:, i], value)
            for i, (name, value) in enumerate(self.values.items())
        }


def gain_path(controller: str, gain: str) -> str:
    """Path of a gain; a controller's name may have dots in it."""
    return f"controllers.'{controller}'.{gain}"


def gain_factors(scenario: Scenario, controller: str) -> GainFactors:
    """Every gain of a controller's law that is not zero, those left to their defaults as well.

    Raises
    ------
    InputError : no such controller

    """
    scenario.controller(controller)
    given: dict[str, Any] = scenario.gain_values(controller)
    law = type(scenario.gains(controller))
    defaults = getattr(law, '_field_defaults', {})
    missing = {name: _plain(value) for name, value in defaults.items() if name not in given}
    if missing:
        written = {gain_path(controller, name): value for name, value in missing.items()}
        scenario = changed_scenario(scenario, written)
    values = {name: np.asarray(value, float) for name, value in {**given, **missing}.items()}
    moved = {name: values[name] for name in law._fields if np.any(values[name] != 0.0)}
    still = {name: 'zero: a factor leaves it as it is' for name in values if name not in moved}
    return GainFactors(scenario, controller, moved, still)


def _plain(value: Any) -> Any:
    return np.asarray(value, float).tolist()


def sensitivity(
    scenario: Scenario,
    controller: str,
    *,
    method: Method | None = None,
    count: int | None = None,
    span: float = 2.0,
    seed: int = 0,
    hold: Hold = 'continuous',
    threads: int = 1,
) -> Sensitivity:
    """Sensitivity of the figures of a closed loop to the gains of its law.

    Every gain, whatever its shape, is multiplied by a number of its own, log-uniform between
    1/span and span. Where a loop diverges the span is made smaller for all of them.

    Parameters
    ----------
    scenario : of `load_scenario`
    controller : name of one of its controllers
    method : 'sobol' or 'morris'; none: 'sobol', and 'morris' for a law that runs as plain Python
    count : base points of Sobol', a power of two, or trajectories of Morris; none: by the method
    span : above 1
    seed : of the design and of every resampling; the sensors' noise is the scenario's
    hold, threads : as of `rollouts`

    Returns
    -------
    sensitivity : with a refusal in place of variables where no span was narrow enough

    Raises
    ------
    InputError : no such controller; actuators or sensors with hold 'continuous'
    ValueError : no such method, a count that does not fit it, a span not above 1

    """
    if not span > 1.0:
        raise ValueError(f'span: expected a number above 1, found {span}')
    factors = gain_factors(scenario, controller)
    law = scenario.controller(controller)['law']
    slow = (method is None or count is None) and _in_python(scenario, controller, hold)
    method = method or ('morris' if slow else 'sobol')
    count = count or _default_count(law, method, slow=slow)
    result = Sensitivity(
        controller, law, method, count, seed, 0, span, span, {}, factors.names, factors.left_out
    )
    if not factors.names:
        return replace(result, refusal='the law has no gain that is not zero')
    design = Design(method, factors.names, count, seed)
    for used in (span ** (0.5**i) for i in range(SHRINKS)):
        found = _rollouts(factors, used**design.points, hold, threads)
        failed = int(np.sum(found['status'] != 'ok'))
        if failed:
            result = replace(result, failed={**result.failed, used: failed})
        if found['status'][0] != 'ok':
            reason = f'with the scenario’s own gains: {found["reason"][0]}'
            return replace(result, failed={}, refusal=reason)
        if not failed:
            return _judged(replace(result, span=used), design, found, factors)
    return replace(result, span=used, refusal=_refusal(result, found))


def _in_python(scenario: Scenario, controller: str, hold: Hold) -> bool:
    """Whether a controller's law is one that numba does not compile."""
    if scenario.controller(controller)['law'] in SHIPPED:
        return False
    one, seed = np.array([0]), np.array([scenario.data['seed']])
    variants, _ = packed_variants(scenario, controller, {}, one, seed)
    return kernel_of(batch_of(variants, hold)).how == IN_PYTHON


def _default_count(law: str, method: Method, *, slow: bool) -> int:
    if slow and method == 'morris':
        return SLOW_COUNT
    return (COUNTS if law in SHIPPED else OWN_COUNTS).get(method, 0)


def _rollouts(
    factors: GainFactors, points: np.ndarray, hold: Hold, threads: int
) -> dict[str, np.ndarray]:
    """Figures with the gains as they are in the first row, then those of the design."""
    rows = np.vstack([np.ones(len(factors.names)), points])
    changes = factors.changes(rows)
    return rollouts(factors.scenario, factors.controller, changes, hold=hold, threads=threads)


def _refusal(result: Sensitivity, found: Mapping[str, np.ndarray]) -> str:
    spans = ', '.join(f'{n} within a factor {span:.3g}' for span, n in result.failed.items())
    first = next(reason for reason in found['reason'] if reason)
    return f'rollouts that failed: {spans}; the first: {first}'


def _judged(
    result: Sensitivity, design: Design, found: Mapping[str, np.ndarray], factors: GainFactors
) -> Sensitivity:
    vehicle = factors.scenario.vehicle
    figures, excluded = sort_out({name: v[1:] for name, v in found.items()}, vehicle)
    values = {figure: np.asarray(found[figure.column], float) for figure in figures}
    variables = [
        variable
        for name in dict.fromkeys(figure.name for figure in figures)
        for variable in _alike([f for f in figures if f.name == name], values, design, result)
    ]
    variables.sort(key=lambda variable: -variable.spread)
    return replace(
        result,
        rollouts=len(design.points) + 1,
        variables=tuple(variables),
        excluded=tuple(excluded),
    )


def _alike(
    figures: Sequence[Figure],
    values: Mapping[Figure, np.ndarray],
    design: Design,
    result: Sensitivity,
) -> list[Variable]:
    """Variables of one kind, among which they are ranked."""
    answers = np.log(np.column_stack([values[figure][1:] for figure in figures]))
    found = spreads(design, answers)
    return [
        Variable(
            figure,
            value=float(values[figure][0]),
            smallest=float(values[figure].min()),
            largest=float(values[figure].max()),
            spread=float(found.value[i]),
            spread_low=float(found.low[i]),
            spread_high=float(found.high[i]),
            rank=int(found.rank[i]),
            rank_low=int(found.rank_low[i]),
            rank_high=int(found.rank_high[i]),
            indices=_indices(design, answers[:, i], result.span),
        )
        for i, figure in enumerate(figures)
    ]


def _indices(design: Design, answers: np.ndarray, span: float) -> tuple[Index, ...]:
    found = design.indices(answers)
    elasticity = found.pop('slope') / np.log(span)
    return tuple(
        Index(gain, float(elasticity[i]), **{name: float(v[i]) for name, v in found.items()})
        for i, gain in enumerate(design.names)
    )
