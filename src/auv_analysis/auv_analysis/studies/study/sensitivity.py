"""Sensitivity of a closed loop's KPIs to its gains: step 3.

A sweep of the gains: a design of factors, rollouts at its points, Sobol' or Morris indices of the
logarithms of the KPIs.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from auv_analysis.metrics.coupling import structural_zeros
from auv_analysis.metrics.quantities import HALVES, Quantity, quantity
from auv_analysis.runs.run import Hold
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.batch import IN_PYTHON, kernel_of
from auv_analysis.simulation.rollouts import batch_of, rollouts
from auv_analysis.simulation.variants import packed_variants
from auv_analysis.studies.sweep.indices import Method, SensitivityPlan, spreads
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_gvc_controller.laws import OPEN_LOOP
from auv_gvc_controller.laws.law import SHIPPED
from auv_gvc_controller.laws.model import control_model

SIX = (
    'velocity_error.rms', 'velocity_error.max_after_2s', 'velocity_error.settling_time',
    'effort.rms', 'effort.max', 'lumped_error.rms', 'lumped_error.max_after_2s',
    'coupling.delta_xi_max', 'coupling.delta_pi_max', 'kinetic_energy.shares_percent',
)  # fmt: skip
TOTAL = 'kinetic_energy.mean'
STRUCTURAL = 'zero for every motion by the structure of M'
ROUNDING = 1e-9  # of the largest of its kind, and of a relative change: below it is no signal


@dataclass(frozen=True)
class Kpi:
    """One number of a run.

    Attributes
    ----------
    name : key of `summary.json`, such as 'velocity_error.rms'
    dof : its degree of freedom; 'all' of the total energy

    """

    name: str
    dof: str

    @property
    def column(self) -> str:
        """Column of `rollouts`."""
        return self.name if self.dof == 'all' else f'{self.name}.{self.dof}'

    @property
    def quantity(self) -> Quantity:
        """What it is."""
        return quantity(self.column)


KPIS = (*(Kpi(name, dof) for name in SIX for dof in DOFS), Kpi(TOTAL, 'all'))


def sort_out(found: Mapping[str, np.ndarray], vehicle: Vehicle) -> tuple[list[Kpi], dict[Kpi, str]]:
    """KPIs whose logarithm is defined and changes, and the others with the reason.

    Parameters
    ----------
    found : columns of `rollouts` (n,) that are all 'ok'
    vehicle : whose structure makes couplings vanish

    """
    zeros = structural_zeros(control_model(vehicle).Upsilon.reshape(6, 6))
    never = {Kpi(f'coupling.{kind}_max', dof) for kind, dofs in zeros.items() for dof in dofs}
    reasons = {kpi: STRUCTURAL if kpi in never else _reason(kpi, found) for kpi in KPIS}
    excluded = {kpi: reason for kpi, reason in reasons.items() if reason}
    return [kpi for kpi in KPIS if kpi not in excluded], excluded


def _reason(kpi: Kpi, found: Mapping[str, np.ndarray]) -> str:
    """Why a KPI cannot be followed; empty where it can."""
    values = np.asarray(found[kpi.column], float)
    missing, zero = np.isnan(values), values == 0.0
    lacks = 'does not settle' if 'settling' in kpi.name else 'does not exist'
    for what, where in ((lacks, missing), ('zero', zero)):
        if where.all():
            return f'{what} in any rollout' if where is missing else 'zero throughout'
        if where.any():
            return f'{what} in {where.sum()} of {len(values)} rollouts'
    if values.max() <= ROUNDING * _largest_of_kind(kpi, found):
        return 'rounding: below 1e-9 of the largest of its kind'
    return 'the same whatever the gains' if np.ptp(np.log(values)) <= ROUNDING else ''


def _largest_of_kind(kpi: Kpi, found: Mapping[str, np.ndarray]) -> float:
    if kpi.dof == 'all':
        return 0.0
    alike = next(dofs for dofs in HALVES.values() if kpi.dof in dofs)
    return max(float(np.nanmax(found[f'{kpi.name}.{dof}'], initial=0.0)) for dof in alike)


SPAN = 2.0  # from 1/SPAN to SPAN times the value of a gain
COUNTS = {'sobol': 256, 'morris': 32}  # default base points, trajectories
OWN_COUNTS = {'sobol': 64, 'morris': 16}  # of a user's law, whose every loop is packed on its own
SLOW_COUNT = 4  # trajectories of a law that runs as plain Python
Row = dict[str, Any]
SHRINKS = 4  # how often the span is tried, each time with the square root of the last


@dataclass(frozen=True)
class Sensitivity:
    """Sensitivity of one controller's KPIs to its gains.

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
    rows : of each KPI and gain, KPIs by falling spread, as in `sensitivity.parquet`:
        figure, dof, unit : the KPI
        value, smallest, largest : with the scenario's own gains, and over all rollouts
        spread, spread_low, spread_high, spread_conf : standard deviation of ln(KPI), about its
            relative change, with its 95 % interval and half of that
        rank, rank_low, rank_high, alike : place by spread among so many degrees of freedom of
            this KPI, 1 the largest, with its 95 % interval
        gain, elasticity : relative change of the KPI per relative change of the gain, by least
            squares; doubled : change in % when the gain is doubled, by that
        S1, ST, mu_star, sigma : indices of ln(KPI), see `SensitivityPlan.indices`; '_conf' is
            half of the 95 % interval; absent what the method does not give
    excluded : KPI without spread -> why
    refusal : why there are no rows; empty where there are

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
    rows: tuple[Row, ...] = ()
    excluded: Mapping[Kpi, str] = field(default_factory=dict)
    refusal: str = ''

    @property
    def weight(self) -> str:
        """Index that gains are ordered by."""
        return 'ST' if self.method == 'sobol' else 'mu_star'

    @property
    def kpis(self) -> dict[Kpi, list[Row]]:
        """KPI, by falling spread -> its rows, the gain that does most of it first."""
        found: dict[Kpi, list[Row]] = {}
        for row in sorted(self.rows, key=lambda row: (-row['spread'], -row[self.weight])):
            found.setdefault(Kpi(row['figure'], row['dof']), []).append(row)
        return found

    def of(self, name: str) -> dict[str, list[Row]]:
        """Degree of freedom -> rows of a KPI such as 'velocity_error.rms', as of `kpis`."""
        return {kpi.dof: rows for kpi, rows in self.kpis.items() if kpi.name == name}

    def six(self, name: str) -> np.ndarray:
        """Spreads (6,) of a KPI; 0 where it has none."""
        found = self.of(name)
        return np.array([found[dof][0]['spread'] if dof in found else 0.0 for dof in DOFS])


def gain_path(controller: str, gain: str) -> str:
    """Path of a gain; a controller's name may have dots in it."""
    return f"controllers.'{controller}'.{gain}"


def gain_factors(
    scenario: Scenario, controller: str
) -> tuple[Scenario, dict[str, np.ndarray], dict[str, str]]:
    """Every gain of a controller's law that is not zero, those left to their defaults as well.

    Returns
    -------
    scenario : the same with every default gain of the controller written out
    values : gain -> what the scenario gives: one number, (6,) or (6, 6)
    left_out : gain -> why it is no factor

    Raises
    ------
    InputError : no such controller

    """
    if scenario.controller(controller)['law'] == OPEN_LOOP:  # its numbers are those of a wrench
        return scenario, {}, {}
    given: dict[str, Any] = scenario.gain_values(controller)
    law = type(scenario.gains(controller))
    defaults = getattr(law, '_field_defaults', {})
    missing = {name: value for name, value in defaults.items() if name not in given}
    values = {name: np.asarray(value, float) for name, value in {**given, **missing}.items()}
    if missing:
        written = {gain_path(controller, name): values[name].tolist() for name in missing}
        scenario = changed_scenario(scenario, written)
    moved = {name: values[name] for name in law._fields if np.any(values[name] != 0.0)}
    still = {name: 'zero: a factor leaves it as it is' for name in values if name not in moved}
    return scenario, moved, still


def sensitivity(
    scenario: Scenario,
    controller: str,
    *,
    method: Method | None = None,
    count: int | None = None,
    span: float = SPAN,
    seed: int = 0,
    hold: Hold = 'continuous',
    threads: int = 1,
) -> Sensitivity:
    """Sensitivity of the KPIs of a closed loop to the gains of its law.

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
    sensitivity : with a refusal in place of rows where no span was narrow enough

    Raises
    ------
    InputError : no such controller; actuators or sensors with hold 'continuous'
    ValueError : no such method, a count that does not fit it, a span not above 1

    """
    if not span > 1.0:
        raise ValueError(f'span: expected a number above 1, found {span}')
    scenario, gains, left_out = gain_factors(scenario, controller)
    law = scenario.controller(controller)['law']
    open_ = method is None or count is None
    slow = bool(gains) and open_ and _in_python(scenario, controller, hold)
    method = method or ('morris' if slow else 'sobol')
    count = count or _default_count(law, method, slow=slow)
    names = tuple(gains)
    result = Sensitivity(controller, law, method, count, seed, 0, span, span, {}, names, left_out)
    if not names:
        return replace(result, refusal='the law has no gain that is not zero')
    design = SensitivityPlan(method, names, count, seed)
    for used in (span ** (0.5**i) for i in range(SHRINKS)):
        # with the gains as they are in the first row, then those of the design
        rows = np.vstack([np.ones(len(names)), used**design.points])
        changes = {
            gain_path(controller, name): np.multiply.outer(factor, value)
            for factor, (name, value) in zip(rows.T, gains.items(), strict=True)
        }
        found = rollouts(scenario, controller, changes, hold=hold, threads=threads)
        failed = int(np.sum(found['status'] != 'ok'))
        if failed:
            result = replace(result, failed={**result.failed, used: failed})
        if found['status'][0] != 'ok':
            reason = f'with the scenario’s own gains: {found["reason"][0]}'
            return replace(result, failed={}, refusal=reason)
        if not failed:
            return _judged(replace(result, span=used), design, found, scenario.vehicle)
    spans = ', '.join(f'{n} within a factor {span:.3g}' for span, n in result.failed.items())
    first = next(reason for reason in found['reason'] if reason)
    return replace(result, span=used, refusal=f'rollouts that failed: {spans}; the first: {first}')


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


def _judged(
    result: Sensitivity,
    design: SensitivityPlan,
    found: Mapping[str, np.ndarray],
    vehicle: Vehicle,
) -> Sensitivity:
    kpis, excluded = sort_out({k: v[1:] for k, v in found.items()}, vehicle)
    rows: list[Row] = []
    for name in dict.fromkeys(kpi.name for kpi in kpis):
        alike = [kpi for kpi in kpis if kpi.name == name]  # among which they are ranked
        values = np.column_stack([np.asarray(found[kpi.column], float) for kpi in alike])
        answers = np.log(values[1:])
        ranked = spreads(design, answers)
        for i, kpi in enumerate(alike):
            row: Row = {'figure': kpi.name, 'dof': kpi.dof, 'unit': kpi.quantity.unit}
            row |= {'value': values[0, i], 'smallest': values[:, i].min()}
            row |= {'largest': values[:, i].max(), 'alike': len(alike)}
            row |= {key: of_each[i] for key, of_each in ranked.items()}
            indices = design.indices(answers[:, i])
            indices['elasticity'] = indices.pop('slope') / np.log(result.span)
            indices['doubled'] = 100.0 * (2.0 ** indices['elasticity'] - 1.0)
            for j, gain in enumerate(design.names):
                rows.append(row | {'gain': gain} | {key: v[j] for key, v in indices.items()})
    plain = [{k: v.item() if hasattr(v, 'item') else v for k, v in row.items()} for row in rows]
    plain.sort(key=lambda row: -row['spread'])
    count = len(design.points) + 1
    return replace(result, rollouts=count, rows=tuple(plain), excluded=excluded)
