"""Vehicle model, kinematics, integrator, disturbances and the plant."""

from auv_dynamics.files import InputError
from auv_dynamics.vehicle import Vehicle
from auv_dynamics.vehicle_file import load_vehicle

__all__ = ['InputError', 'Vehicle', 'load_vehicle']
