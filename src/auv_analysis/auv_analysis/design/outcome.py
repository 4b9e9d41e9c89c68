"""What a change did, by simulation: figures before and after, for every controller."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from auv_analysis.design.couplings import KINDS, present
from auv_analysis.metrics.summary import summarize
from auv_analysis.runs.run import Hold, Run
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.simulate import simulate
from auv_dynamics.files.errors import first_line
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle

VELOCITY = ('m/s',) * 3 + ('rad/s',) * 3
WRENCH = ('N',) * 3 + ('N m',) * 3
PERCENT = ('%',) * 6
MEASURES = (  # name, where it stands in a summary, units
    ('delta_xi_max', ('coupling', 'delta_xi_max'), VELOCITY),
    ('delta_pi_max', ('coupling', 'delta_pi_max'), WRENCH),
    ('kinetic_energy.shares_percent', ('kinetic_energy', 'shares_percent'), PERCENT),
    ('effort.rms', ('effort', 'rms'), WRENCH),
    ('effort.max', ('effort', 'max'), WRENCH),
    ('velocity_error.rms', ('velocity_error', 'rms'), VELOCITY),
    ('velocity_error.max_after_2s', ('velocity_error', 'max_after_2s'), VELOCITY),
)
ENERGY = ('kinetic_energy', 'mean')

Summaries = dict[str, dict[str, Any]]


@dataclass(frozen=True, eq=False)
class Outcome:
    """Runs of the controllers of a scenario with one vehicle.

    Attributes
    ----------
    runs : controller -> run, of those that came to their end
    summaries : controller -> `summarize(run)`
    failures : controller -> why it did not

    """

    runs: dict[str, Run]
    summaries: Summaries
    failures: dict[str, str]

    @classmethod
    def of(cls, scenario: Scenario, hold: Hold) -> 'Outcome':
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
    for name, keys, units in MEASURES:
        kind = name.removesuffix('_max')
        for i, dof in enumerate(DOFS):
            if kind in coupled and dof not in coupled[kind]:
                continue
            rows.append(_row(f'{name}.{dof}', units[i], _at(before, keys, i), _at(after, keys, i)))
        if kind == KINDS[-1]:
            energy = _at(before, ENERGY), _at(after, ENERGY)
            rows.append(_row('.'.join(ENERGY), 'J', *energy))
    return rows


def coupled_in(*vehicles: Vehicle) -> dict[str, set[str]]:
    """Degrees of freedom that are deformed in one of some vehicles, for each kind."""
    names = {name for vehicle in vehicles for name in present(vehicle)}
    return {kind: {n.split('.')[1] for n in names if n.startswith(kind)} for kind in KINDS}


def _row(name: str, unit: str, before: float | None, after: float | None) -> dict[str, Any]:
    return {'name': name, 'unit': unit, 'before': before, 'after': after}


def _at(summary: Mapping[str, Any], keys: tuple[str, str], i: int | None = None) -> float | None:
    value = summary[keys[0]][keys[1]]
    return value if value is None or i is None else value[i]
