"""Case 1 of the paper on another vehicle, as a scenario."""

import re
from pathlib import Path
from typing import Any

import numpy as np

from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import read_yaml
from auv_dynamics.vehicle.vehicle_file import load_vehicle

REFERENCE = 'herman2018'  # the vehicle that case1 was made for
SCALE = f"""\
scale, 6x6: F = scale F_39, where F_39 is (39) as printed, in N and N m. scale is M M_ref^-1
with M of this vehicle and M_ref of {REFERENCE}, not a coupling by the water: row i holds the
weights of the entries of F_39, surge to yaw, in degree of freedom i.
""".splitlines()  # for a comment on the `scale` of a scaled disturbance
SLOWER = 0.5  # of the set-point (35): 0.6 m/s in surge, 0.8 m/s in heave, 0.05 rad/s in yaw
OF_MASS = {'gvc': ('k_I',), 'cl': ('k_D', 'k_I', 'Gamma')}  # gains of case1 in N and N m
GAINS = f"""\
Gains in N and N m are those of case1 times M_ii of this vehicle over that of {REFERENCE} in each
degree of freedom, so that both loops are equally fast.
""".splitlines()  # for a comment
DIGITS = 10  # of a written scale: the last ones differ between BLAS libraries
ROUNDING = 1e-12  # relative to the largest entry, below which an entry of the scale is zero
UNFIT = re.compile('[^A-Za-z0-9_.+-]+')  # in the name of a scenario, which names a folder

TOP_SPEED = {
    'bluerov2': '1.5 m/s (Blue Robotics)',
    'bluerov2_heavy': '0.85 m/s (four T200, 114 N, against 13.7 u + 141 u^2)',
    'girona500': '1.4 m/s (in its source: two thrusters of 154 N against 148 u^2)',
    'lauv': '2 m/s (as the model of gym-auv limits it)',
    'lrauv_tethys': '1.0 m/s (MBARI)',
}


def scaled_case1(vehicle: str | Path) -> dict[str, Any]:
    """Case 1 of the paper for another vehicle, as the contents of a scenario file.

    Parameters
    ----------
    vehicle : path of a vehicle file, or the bare name of a shipped one

    Returns
    -------
    scenario : case1 with that vehicle, the set-point (35) times 0.5 and `scale` of the
        disturbance (39) so that F = M a(t), a(t) = M_ref^-1 F(t); a path is made absolute

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    scenario = read_yaml(shipped('scenarios', 'case1'), 'scenario')
    loaded = load_vehicle(vehicle)
    scenario['name'] = plain_name('case1', loaded.name)
    bare = shipped('vehicles', vehicle) != Path(vehicle)
    scenario['vehicle'] = str(vehicle if bare else Path(vehicle).resolve())
    scenario['setpoint'] = {
        dof: _slower(harmonics) for dof, harmonics in scenario['setpoint'].items()
    }
    scale = _rounded(loaded.M @ np.linalg.inv(load_vehicle(REFERENCE).M))
    scenario['disturbance'] = scenario['disturbance'] | {'scale': scale.tolist()}
    return scenario


def scaled_gains(vehicle: str | Path) -> dict[str, dict[str, Any]]:
    """Controllers of case1, with gains that give another vehicle a loop as fast as its own."""
    controllers = read_yaml(shipped('scenarios', 'case1'), 'scenario')['controllers']
    ratio = np.diag(load_vehicle(vehicle).M) / np.diag(load_vehicle(REFERENCE).M)
    for entry in controllers.values():
        for gain in OF_MASS[entry['law']]:
            entry[gain] = [float(f'{entry[gain] * each:.3g}') for each in ratio]
    return controllers


def plain_name(kind: str, name: str, longest: int = 90) -> str:
    """A kind and so much of a name, as the name of a scenario or of a folder."""
    return f'{kind}_{UNFIT.sub("_", name)[:longest]}'


def _slower(harmonics: dict[str, Any]) -> dict[str, Any]:
    offset = {key: SLOWER * harmonics[key] for key in ('offset',) if key in harmonics}
    terms = [term | {'amplitude': SLOWER * term['amplitude']} for term in harmonics['terms']]
    return offset | {'terms': terms}


def _rounded(A: np.ndarray) -> np.ndarray:
    A = np.where(np.abs(A) < ROUNDING * np.abs(A).max(), 0.0, A)
    return np.array([[float(f'{entry:.{DIGITS}g}') for entry in row] for row in A])
