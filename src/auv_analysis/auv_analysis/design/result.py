"""A design as files in a folder and as one JSON document."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.design.comparison import HALF, Candidate
from auv_analysis.design.couplings import COUPLINGS, UNITS, present
from auv_analysis.design.inputs import write_inputs
from auv_analysis.design.outcome import Outcome, coupled_in, measures
from auv_analysis.design.parameters import Parameter
from auv_analysis.design.proposal import Proposal
from auv_analysis.design.search import parts_of
from auv_analysis.design.statements import (
    ASSUMPTIONS,
    bound_warnings,
    nothing_statement,
    place_warnings,
    rest_of,
    result_statement,
    side_effect_warnings,
    side_effects,
    warnings_of,
)
from auv_analysis.design.words import change_words, values_of
from auv_analysis.metrics.authority import beyond_authority
from auv_analysis.output.folder import Results
from auv_analysis.output.new_files import write_json
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_gvc_controller.laws.decomposition import decompose

AT_BOUND = 2e-3  # of a range: a value that is nearer to its end lies on it
DESIGN, BEFORE, AFTER = 'design.json', 'summary_before.json', 'summary.json'


@dataclass(frozen=True, eq=False)
class Result:
    """A design with its runs.

    Attributes
    ----------
    proposal : what was found
    document : what `--json` prints
    before, after : runs of every controller; None where there is nothing to reduce

    """

    proposal: Proposal
    document: dict[str, Any]
    before: Outcome | None = None
    after: Outcome | None = None


def concluded(found: Proposal, results: Results) -> Result:
    """Write the changed vehicle and its scenario, run both vehicles, write the figures.

    Parameters
    ----------
    found : of `propose`
    results : where to write, and the folder that the document names

    Returns
    -------
    result : its document also stands in design.json; the runs after the change are those of the
        scenario and the vehicle as they were read back from the folder

    """
    setting, out = found.setting, results.folder
    scenario = write_inputs(found, out)
    document = _head(found, results.out)
    if found.target is None or found.before is None:
        name = setting.space.vehicle.name
        document['statement'] = nothing_statement(name, found.asked, found.there)
        write_json(out / DESIGN, document)
        return Result(found, document)
    before = Outcome.of(setting.scenario, setting.hold)
    after = Outcome.of(scenario, setting.hold)
    write_json(out / BEFORE, before.summaries)
    write_json(out / AFTER, after.summaries)
    document |= _body(found, scenario.vehicle, before, after)
    write_json(out / DESIGN, document)
    return Result(found, document, before, after)


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


def _body(found: Proposal, changed: Vehicle, before: Outcome, after: Outcome) -> dict[str, Any]:
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
        'at_rest': {'before': rest_of(vehicle), 'after': rest_of(changed)},
        'controllers': _controllers(before, after, coupled),
        'assumptions': list(ASSUMPTIONS),
        'side_effects': effects,
        'warnings': [
            *side_effect_warnings(effects),
            *warnings_of(vehicle, changed),
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
    """Which bound of the search a value lies on; an angle comes round again."""
    if one.unit == 'deg' or one.lower == one.upper:
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
    before: Outcome, after: Outcome, coupled: Mapping[str, set[str]]
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
