"""How large the deformations of a vehicle become in case 1 of the paper, scaled to it."""

from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.scaling import scaled_case1
from auv_analysis.scenario import scenario_from
from auv_analysis.simulation import simulate
from auv_analysis.summary import summarize
from auv_dynamics.config import shipped
from auv_dynamics.files import read_yaml

CONTROLLER = 'gvc'  # of case 1: the one whose deformations the paper draws


def reached(vehicle: str | Path) -> dict[str, Any]:
    """Largest deformations in case 1 scaled to a vehicle, under GVC.

    Parameters
    ----------
    vehicle : a vehicle file, or the bare name of a shipped one

    Returns
    -------
    found : ready for JSON
        failure : why there are no figures, '' where there are
        scenario : name
        delta_xi_max, delta_pi_max : (6,) m/s, rad/s and N, N m
        delta_xi_energy_percent : (6,) 1/2 N_i delta_xi_i^2 at that peak, of the mean kinetic energy
        kinetic_energy : mean, J

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    data, file = scaled_case1(vehicle), shipped('vehicles', vehicle)
    path = Path(f'{data["name"]}.yaml')
    scenario = scenario_from(data, read_yaml(file, 'vehicle'), path, file, {})
    try:
        summary = summarize(simulate(scenario, CONTROLLER))
    except ArithmeticError as error:
        return {'failure': str(error), 'scenario': scenario.name}
    coupling, mean = summary['coupling'], summary['kinetic_energy']['mean']
    size = np.array(coupling['delta_xi_max'])
    energy = 0.5 * np.array(summary['decomposition']['N']) * size**2
    return {
        'failure': '',
        'scenario': scenario.name,
        'delta_xi_max': coupling['delta_xi_max'],
        'delta_pi_max': coupling['delta_pi_max'],
        'delta_xi_energy_percent': (100 * energy / mean).tolist(),
        'kinetic_energy': mean,
    }
