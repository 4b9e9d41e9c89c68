"""Small scenarios for tests of `auv tune`, of a vehicle whose M is diagonal."""

from pathlib import Path
from typing import Any

import yaml

from auv_analysis.scenario.scenario import Scenario, load_scenario

MASS, VOLUME = 100.0, 0.1  # neutral in water of 1000 kg/m3
DIAGONAL = {
    'format': 1,
    'name': 'diagonal',
    'source': 'made for tests: neutral, centred, M diagonal',
    'rigid_body': {
        'mass': MASS,
        'center_of_gravity': [0.0, 0.0, 0.0],
        'inertia': [[10.0, 0.0, 0.0], [0.0, 12.0, 0.0], [0.0, 0.0, 14.0]],
        'inertia_reference': 'cg',
    },
    'hydrostatics': {'volume': VOLUME, 'center_of_buoyancy': [0.0, 0.0, 0.0]},
    'added_mass': [20.0, 60.0, 80.0, 3.0, 5.0, 4.0],
    'damping': {'linear': [30.0, 40.0, 50.0, 5.0, 6.0, 7.0], 'quadratic': [60.0] * 6},
    'environment': {'water_density': 1000.0, 'gravity': 9.81},
}
M_II = [120.0, 160.0, 180.0, 13.0, 17.0, 18.0]
SETPOINT = {
    'surge': {'offset': 0.5, 'terms': [{'amplitude': 0.3, 'omega': 1.0}]},
    'yaw': {'offset': 0.1, 'terms': [{'amplitude': 0.2, 'omega': 0.7}]},
}
GVC = {'law': 'gvc', 'k_D': 6.0, 'k_I': 2.0, 'Lambda': 0.5, 'Gamma': 20.0}
SAME_CL = {  # the same law on a diagonal M
    'law': 'cl',
    'k_D': [6.0 * m for m in M_II],
    'k_I': 2.0,
    'Lambda': 0.5,
    'Gamma': [20.0 * m for m in M_II],
}
WAVES = {'kind': 'harmonic', 'surge': {'offset': 5.0, 'terms': [{'amplitude': 9.0, 'omega': 2.0}]}}


def write(folder: Path, controllers: dict[str, Any], **changes: Any) -> Path:
    """A scenario of the diagonal vehicle, or of another one, in a folder."""
    vehicle = changes.pop('vehicle', DIAGONAL)
    data = {
        'name': 'small', 'vehicle': 'v.yaml', 'duration': 1.0, 'step': 0.01,
        'controllers': controllers, 'setpoint': SETPOINT, 'disturbance': WAVES, **changes,
    }  # fmt: skip
    if isinstance(vehicle, dict):
        (folder / 'v.yaml').write_text(yaml.safe_dump(vehicle))
    else:
        data['vehicle'] = vehicle
    (folder / 's.yaml').write_text(yaml.safe_dump(data, sort_keys=False))
    return folder / 's.yaml'


def scenario(folder: Path, controllers: dict[str, Any], **changes: Any) -> Scenario:
    """The same, loaded."""
    return load_scenario(write(folder, controllers, **changes))
