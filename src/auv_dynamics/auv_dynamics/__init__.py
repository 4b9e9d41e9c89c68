"""Vehicle model, kinematics, integrator, disturbances and the plant.

- `load_vehicle(path or name)`: a `Vehicle` with M, C(nu), D(nu), g(eta) and both dynamics
- `InputError`: what is wrong with a file or an option: file, key, expected, found
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from auv_dynamics.files.errors import InputError
    from auv_dynamics.vehicle.vehicle import Vehicle
    from auv_dynamics.vehicle.vehicle_file import load_vehicle

_HOME = {
    'InputError': 'auv_dynamics.files.yaml_files',
    'Vehicle': 'auv_dynamics.vehicle.vehicle',
    'load_vehicle': 'auv_dynamics.vehicle.vehicle_file',
}
__all__ = ['InputError', 'Vehicle', 'load_vehicle']


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for: `auv --help` must not load numba."""
    if name in _HOME:
        return getattr(importlib.import_module(_HOME[name]), name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')


def __dir__() -> list[str]:
    """Public names as well, for `help` and the TAB key."""
    return sorted({*globals(), *__all__})
