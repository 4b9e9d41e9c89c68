"""Results of a design: both vehicles simulated under every controller, side effects, warnings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.metrics.authority import beyond_authority
from auv_analysis.metrics.measures import TOTAL
from auv_analysis.metrics.quantities import METRICS
from auv_analysis.metrics.summary import summarize
from auv_analysis.output.folder import ResultsFolder
from auv_analysis.output.new_files import write_json
from auv_analysis.output.text import capital, join, number, plain
from auv_analysis.runs.run import Hold, Run
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.simulate import simulate
from auv_analysis.studies.design.change import (
    BALLAST,
    DISC_PART,
    NAMES,
    ChangeSpace,
    Parameter,
    parts_of,
    semi_axes,
    values_of,
)
from auv_analysis.studies.design.prediction import COUPLINGS, KINDS, UNITS, present
from auv_analysis.studies.design.search import HALF, Candidate, Proposal
from auv_analysis.studies.design.setting import change_words, write_inputs
from auv_dynamics.files.errors import first_line
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_gvc_controller.laws.model import decompose

AT_BOUND = 2e-3  # of a range: a value that is nearer to its end lies on it
DESIGN, BEFORE, AFTER = 'design.json', 'summary_before.json', 'summary.json'
MEASURES = (  # keys of a summary
    'coupling.delta_xi_max', 'coupling.delta_pi_max', 'kinetic_energy.mean',
    'kinetic_energy.shares_percent', 'effort.rms', 'effort.max', 'velocity_error.rms',
    'velocity_error.max_after_2s',
)  # fmt: skip
ASSUMPTIONS = (
    'The inertia about the centre of gravity stays as it is when the centre of gravity is moved.',
    'Ballast is a point mass; foam at its place carries its weight, so that W - B and the '
    'restoring moment do not change, and foam and ballast have no added mass and no drag.',
    'The disc is thin, as heavy as the water that it displaces, and moves as in unbounded water; '
    'its drag counts in each degree of freedom by itself.',
    'The damping is otherwise that of the file, and the controllers keep their gains.',
)
TILT = 1.0  # deg: more of it at rest is worth a warning
WORSE = 1.1  # times: from which on a side effect is named
NEGLIGIBLE = 1e-3  # of the largest of its kind and unit: not worth a word
MOST = 6  # side effects that are named
COSTS = tuple(m.removeprefix('coupling.') for m in MEASURES if not m.startswith('kinetic_'))


@dataclass(frozen=True, eq=False)
class Simulated:
    """Runs of the controllers of a scenario with one vehicle.

    Attributes
    ----------
    runs : controller -> run, of those that came to their end
    summaries : controller -> `summarize(run)`
    failures : controller -> why it did not

    """

    runs: dict[str, Run]
    summaries: dict[str, dict[str, Any]]
    failures: dict[str, str]

    @classmethod
    def of(cls, scenario: Scenario, hold: Hold) -> 'Simulated':
        """Simulate every controller."""
        runs, failures = {}, {}
        for name in scenario.controllers:
            try:
                runs[name] = simulate(scenario, name, hold)
            except ArithmeticError as error:
                failures[name] = first_line(error)
        return cls(runs, {name: summarize(run) for name, run in runs.items()}, failures)


def measures(
    before: Mapping[str, Any], after: Mapping[str, Any], coupled: Mapping[str, set[str]]
) -> list[dict[str, Any]]:
    """Figures before and after a change: couplings, then energy, effort and errors.

    Parameters
    ----------
    before, after : of `summarize`
    coupled : kind of coupling -> degrees of freedom that it deforms before or after

    Returns
    -------
    measures : name, unit, before and after of each; None where there is no such figure

    """
    rows = []
    for metric in MEASURES:
        name, (group, _, key) = metric.removeprefix('coupling.'), metric.partition('.')
        old, new = before[group][key], after[group][key]
        if metric == TOTAL:
            rows.append({'name': name, 'unit': METRICS[metric].unit, 'before': old, 'after': new})
            continue
        for i, dof in enumerate(DOFS):
            if dof in coupled.get(name.removesuffix('_max'), DOFS):
                row = {'name': f'{name}.{dof}', 'unit': METRICS[metric].unit_of(i)}
                rows.append(row | {'before': old and old[i], 'after': new and new[i]})
    return rows


def coupled_in(*vehicles: Vehicle) -> dict[str, set[str]]:
    """Degrees of freedom that are deformed in one of some vehicles, for each kind."""
    names = {name for vehicle in vehicles for name in present(vehicle)}
    return {kind: {n.split('.')[1] for n in names if n.startswith(kind)} for kind in KINDS}


@dataclass(frozen=True, eq=False)
class DesignStudy:
    """A design with its runs.

    Attributes
    ----------
    proposal : what was found
    document : what `--json` prints
    simulated : 'before', 'after' -> runs of every controller; {} where there is nothing to reduce

    """

    proposal: Proposal
    document: dict[str, Any]
    simulated: Mapping[str, Simulated]


def write_results(found: Proposal, results: ResultsFolder) -> DesignStudy:
    """Write the changed vehicle and its scenario, run both vehicles, write the figures.

    The document also stands in design.json; the runs after the change are those of the scenario and
    the vehicle as they were read back from the folder.
    """
    setting, out = found.setting, results.folder
    x, target = (None, '') if found.best is None else (found.best.x, COUPLINGS[found.best.target])
    scenario = write_inputs(setting, x, target, out)
    document = _head(found, results.out)
    if found.target is None or found.before is None:
        name = setting.space.vehicle.name
        document['statement'] = nothing_statement(name, found.asked, found.there)
        write_json(out / DESIGN, document)
        return DesignStudy(found, document, {})
    before = Simulated.of(setting.scenario, setting.hold)
    after = Simulated.of(scenario, setting.hold)
    write_json(out / BEFORE, before.summaries)
    write_json(out / AFTER, after.summaries)
    document |= _body(found, scenario.vehicle, before, after)
    write_json(out / DESIGN, document)
    return DesignStudy(found, document, {'before': before, 'after': after})


def _head(found: Proposal, out: Path) -> dict[str, Any]:
    setting = found.setting
    return {
        'measures': [],
        'statement': '',
        'vehicle': setting.space.vehicle.name,
        'scenario': setting.scenario.name,
        'controller': setting.controller,
        'hold': setting.hold,
        'reduce': found.asked if found.target is None else COUPLINGS[found.target],
        'asked': found.asked,
        'couplings': found.there,
        'folder': str(out),
    }


def _body(found: Proposal, changed: Vehicle, before: Simulated, after: Simulated) -> dict[str, Any]:
    setting, best, target = found.setting, found.best, found.target
    assert target is not None
    assert found.before is not None
    x = setting.space.unchanged if best is None else best.x
    words = change_words(setting.space, x)
    vehicle, main = setting.space.vehicle, setting.controller
    coupled = coupled_in(vehicle, changed)
    rows = measures(before.summaries[main], after.summaries[main], coupled)
    parameters = _parameters(found, x)
    effects = side_effects(rows, COUPLINGS[target])
    rest = {'before': rest_of(vehicle), 'after': rest_of(changed)}
    largest = after.summaries[main]['effort']['max']
    by = f'simulated with {main} ({setting.hold})'
    return {
        'measures': rows,
        'statement': result_statement(target, float(found.before.peaks[target]), best, words, by),
        'halved': best is not None and best.ratio is not None and best.ratio <= HALF,
        'proposal': {
            'parts': parts_of(x),
            'words': words,
            'values': values_of(x),
            'Upsilon_before': decompose(vehicle.M)[0].tolist(),
            'Upsilon_after': decompose(changed.M)[0].tolist(),
        },
        'parameters': parameters,
        'ranking': _ranking(found, changed),
        'alternatives': [_candidate(one, one is best) for one in found.candidates],
        'at_rest': rest,
        'controllers': _controllers(before, after, coupled),
        'assumptions': list(ASSUMPTIONS),
        'side_effects': effects,
        'warnings': [
            *side_effect_warnings(effects),
            *warnings_of(**rest),
            *bound_warnings(parameters),
            *place_warnings(setting.space, x),
            *beyond_authority(changed, largest),
        ],
    }


def _parameters(found: Proposal, x: np.ndarray) -> list[dict[str, Any]]:
    parts = parts_of(x)
    return [
        {
            'name': one.name,
            'unit': one.unit,
            'value': float(value) if one.part in parts else None,
            'lower': one.lower,
            'upper': one.upper,
            'reason': one.reason,
            'at_bound': _at_bound(one, float(value)) if one.part in parts else None,
        }
        for one, value in zip(found.setting.space.parameters, x, strict=True)
    ]


def _at_bound(one: Parameter, value: float) -> str | None:
    """Bound of the search on which a value lies; an angle is periodic."""
    if one.unit == 'deg':
        return None
    near = AT_BOUND * (one.upper - one.lower)
    return 'upper' if value > one.upper - near else 'lower' if value < one.lower + near else None


def _ranking(found: Proposal, changed: Vehicle) -> list[dict[str, Any]]:
    """Couplings of either vehicle, the largest share before first."""
    assert found.before is not None
    before, best = found.before, found.best
    after = before if best is None or best.sizes is None else best.sizes
    named = {*found.there, *present(changed)}
    places = [k for k in np.argsort(-before.shares, kind='stable') if COUPLINGS[k] in named]
    return [
        {
            'coupling': COUPLINGS[k],
            'unit': UNITS[COUPLINGS[k]],
            'share': {'before': float(before.shares[k]), 'after': float(after.shares[k])},
            'largest': {'before': float(before.peaks[k]), 'after': float(after.peaks[k])},
        }
        for k in places
    ]


def _candidate(one: Candidate, proposed: bool) -> dict[str, Any]:
    return {
        'coupling': COUPLINGS[one.target],
        'part': one.part,
        'predicted': one.predicted,
        'ratio': one.ratio,
        'score': one.score if np.isfinite(one.score) else None,
        'values': values_of(one.x),
        'failure': one.failure or None,
        'proposed': proposed,
    }


def _controllers(
    before: Simulated, after: Simulated, coupled: Mapping[str, set[str]]
) -> dict[str, dict[str, Any]]:
    """Measures of every controller that came to its end with both vehicles, or why it did not."""
    found: dict[str, dict[str, Any]] = {}
    for name in dict.fromkeys([*before.summaries, *before.failures]):
        failure = before.failures.get(name) or after.failures.get(name)
        rows = []
        if failure is None:
            rows = measures(before.summaries[name], after.summaries[name], coupled)
        found[name] = {'failure': failure, 'measures': rows}
    return found


def nothing_statement(vehicle: str, target: str | None, there: Sequence[str]) -> str:
    """Why there is nothing to remove."""
    if not there:
        return (
            f'{vehicle}: M is diagonal, so Upsilon is the identity and delta_xi and delta_pi are '
            'zero in every motion: there is no coupling to remove.'
        )
    if target is not None and target not in there:
        return (
            f'{vehicle}: {target} is zero in every motion by the structure of M: there is nothing '
            f'to remove. Not zero: {join(list(there))}.'
        )
    what = 'every coupling' if target is None else target
    return f'{vehicle}: {what} is zero throughout this scenario: there is nothing to remove.'


def result_statement(
    target: int, before: float, best: Candidate | None, words: Sequence[str], by: str
) -> str:
    """Effect of the proposal on the coupling, by simulation; `before` is its largest magnitude."""
    name, unit = COUPLINGS[target], UNITS[COUPLINGS[target]]
    if best is None or best.ratio is None:
        return f'No change within the bounds lowers {name}, which is {number(before)} {unit}, {by}.'
    after = best.ratio * before
    lowered = 100 * (1 - best.ratio)
    text = (
        f'{capital("; ".join(words))}: {name} falls from {number(before)} to {number(after)} '
        f'{unit}, by {lowered:.1f} %, {by}.'
    )
    if best.ratio > HALF:
        text += f' The bounds do not allow half: {lowered:.1f} % is the most that was found.'
    return text


def warnings_of(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    """Deterioration of the vehicle at rest; before and after are those of `rest_of`."""
    found = []
    stable, now = before['stability'], after['stability']
    if now <= 0 < stable:
        found.append('the changed vehicle is statically unstable')
    elif now < stable - 1e-9 * abs(stable):
        found.append(
            f'the static stability W z_G - B z_B falls from {number(stable)} to {number(now)} N m'
        )
    level, tilted = before['tilt_at_rest_deg'], after['tilt_at_rest_deg']
    if level is not None and tilted is not None and tilted > level + TILT:
        found.append(f'at rest it tilts by {tilted:.1f} deg, before {level:.1f}')
    return found


def bound_warnings(parameters: Sequence[Mapping[str, Any]]) -> list[str]:
    """Parameters on a bound of the search; `parameters` as in design.json."""
    on = [
        f'{one["name"]} = {plain(one["value"], 4)} {one["unit"]} ({one["at_bound"]})'
        for one in parameters
        if one['at_bound']
    ]
    if not on:
        return []
    return [f'at a bound of the search, so that more might do more: {join(on)}']


def place_warnings(space: ChangeSpace, x: np.ndarray) -> list[str]:
    """Parts placed outside of the hull, as far as the vehicle file gives its size."""
    axes, which = semi_axes(space.vehicle, space.data)
    found = []
    for part in (BALLAST, DISC_PART):
        r = x[[NAMES.index(f'{part}.{axis}') for axis in 'xyz']]
        if part in parts_of(x) and np.linalg.norm((r - space.vehicle.r_B) / axes) > 1:
            found.append(
                f'the {part} is placed outside the hull, as far as the file tells of one: {which}, '
                f'{join([plain(a, 3) for a in axes])} m, about the centre of buoyancy'
            )
    return found


def side_effects(rows: Sequence[Mapping[str, Any]], target: str) -> list[dict[str, Any]]:
    """Measures beside the target that a change makes larger by more than a tenth.

    Parameters
    ----------
    rows : `measures` of design.json
    target : name of the coupling that is reduced, as in `COUPLINGS`

    Returns
    -------
    effects : the same rows with `percent`, None where there was none before; those that are
        nothing beside the largest of their kind are left out

    """
    found = []
    kinds: dict[tuple[str, str], float] = {}
    for row in rows:
        kind = row['name'].rpartition('.')[0], row['unit']
        kinds[kind] = max(kinds.get(kind, 0.0), row['before'] or 0.0, row['after'] or 0.0)
    for row in rows:
        kind = row['name'].rpartition('.')[0], row['unit']
        before, after = row['before'], row['after']
        if before is None or after is None or kind[0] not in COSTS:
            continue
        asked = row['name'] == target.replace('.', '_max.')
        if not asked and after > WORSE * before and after > NEGLIGIBLE * kinds[kind]:
            percent = 100 * (after / before - 1) if before else None
            found.append({**row, 'percent': percent})
    return sorted(found, key=lambda row: -(row['percent'] or np.inf))


def side_effect_warnings(effects: Sequence[Mapping[str, Any]]) -> list[str]:
    """The same in words, the largest first."""
    if not effects:
        return []
    named = [
        f'{row["name"]} from {number(row["before"])} to {number(row["after"])} {row["unit"]}'
        + (' (new)' if row['percent'] is None else f' (+{number(row["percent"])} %)')
        for row in effects[:MOST]
    ]
    if len(effects) > MOST:
        more = len(effects) - MOST
        named.append(f'{more} other{"s" * (more > 1)}')
    return [f'side effects above {100 * (WORSE - 1):.0f} %: {join(named)}']


def rest_of(vehicle: Vehicle) -> dict[str, Any]:
    """Hydrostatics that a change can touch: N, N m, m, deg; no tilt where it does not rest.

    `stability` is W z_G - B z_B, positive where the vehicle rights itself.
    """
    x, y, z = vehicle.model.hydrostatics[1:].tolist()
    return {
        'weight': float(vehicle.weight),
        'buoyancy': float(vehicle.buoyancy),
        'weight_minus_buoyancy': float(vehicle.weight - vehicle.buoyancy),
        'r_G': vehicle.r_G.tolist(),
        'r_B': vehicle.r_B.tolist(),
        'metacentric_height': float(vehicle.r_G[2] - vehicle.r_B[2]),
        'stability': z,
        'tilt_at_rest_deg': float(np.degrees(np.arctan2(np.hypot(x, y), z))) if z > 0 else None,
    }
