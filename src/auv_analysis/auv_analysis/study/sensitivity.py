"""Which figures of a closed loop follow its gains most, and which gain it is: step 3."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from auv_analysis.batch import kernel_of
from auv_analysis.kernels import IN_PYTHON
from auv_analysis.rollouts import batch_of, rollouts
from auv_analysis.scenario import Scenario
from auv_analysis.simulation import Hold
from auv_analysis.study.effects import Index, Sensitivity, Variable
from auv_analysis.study.figures import Figure, sort_out
from auv_analysis.study.gains import GainFactors, gain_factors
from auv_analysis.study.indices import Design, Method, spreads
from auv_analysis.variants import packed_variants
from auv_gvc_controller.laws import SHIPPED

COUNTS = {'sobol': 256, 'morris': 32}  # default base points, trajectories
OWN_COUNTS = {'sobol': 64, 'morris': 16}  # of a user's law, whose every loop is packed on its own
SLOW_COUNT = 4  # trajectories of a law that runs as plain Python
SHRINKS = 4  # how often the span is tried, each time with the square root of the last


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
