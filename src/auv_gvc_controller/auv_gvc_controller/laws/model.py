"""What a law knows of the vehicle: the terms of (1) and the decomposition of M."""

from typing import NamedTuple

import numpy as np

from auv_dynamics.vehicle.model import Model
from auv_dynamics.vehicle.vehicle import Vehicle, row_major
from auv_gvc_controller.laws.decomposition import decompose, inverse_upper


class ControlModel(NamedTuple):
    """The `model` argument of a law: flat float64 arrays, row-major.

    Attributes
    ----------
    dynamics : M, D and hydrostatics of (1)
    Upsilon, Upsilon_inv : (36,) from xi to nu and back, unit upper triangular, (4)
    N : (6,) diagonal inertia, (9)

    """

    dynamics: Model
    Upsilon: np.ndarray
    Upsilon_inv: np.ndarray
    N: np.ndarray


def control_model(vehicle: Vehicle) -> ControlModel:
    """Model of a vehicle, or of a fleet of them, as a law takes it."""
    Upsilon, N = decompose(vehicle.M)
    return ControlModel(vehicle.model, row_major(Upsilon), row_major(inverse_upper(Upsilon)), N)
