"""Plants for tests: a vehicle with disturbances as a scenario writes them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from auv_dynamics.plant.plant import Plant
from auv_dynamics.plant.uncertainty import make_uncertainty
from auv_dynamics.vehicle.vehicle import Vehicle


def plant_of(
    vehicle: Vehicle,
    specs: Sequence[dict[str, Any]],
    step: float,
    integrator: str,
    x: np.ndarray,
    **options: Any,
) -> Plant:
    places = [f'disturbance[{i}]' for i in range(len(specs))]
    uncertainty = make_uncertainty(vehicle, specs, 'scenario.yaml', places)
    return Plant(uncertainty, step, integrator, x, **options)


def push(plant: Plant, tau: tuple) -> tuple[tuple, tuple]:
    """One step under a command: (applied, F) at its start."""
    answer = plant.answer(tuple(tau))
    plant.advance()
    return answer
