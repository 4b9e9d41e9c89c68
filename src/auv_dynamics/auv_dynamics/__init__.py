"""Vehicle model, kinematics, integrator, disturbances and the plant.

- `load_vehicle(path or name)`: a `Vehicle` with M, C(nu), D(nu), g(eta) and both dynamics
- `InputError`: what is wrong with a file or an option: file, key, expected, found
"""

from typing import TYPE_CHECKING

from auv_dynamics.files.lazy import lazy_names

if TYPE_CHECKING:
    from auv_dynamics.files.errors import InputError
    from auv_dynamics.vehicle.vehicle import Vehicle
    from auv_dynamics.vehicle.vehicle_file import load_vehicle

_HOME = {
    'InputError': 'auv_dynamics.files.errors',
    'Vehicle': 'auv_dynamics.vehicle.vehicle',
    'load_vehicle': 'auv_dynamics.vehicle.vehicle_file',
}
__all__ = ['InputError', 'Vehicle', 'load_vehicle']
__getattr__, __dir__ = lazy_names(__name__, _HOME)
