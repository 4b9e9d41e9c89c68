"""What `auv linearize` finds, as one JSON-ready document: a linear model per loop."""

from collections.abc import Mapping, Sequence
from typing import Any

from auv_analysis.linearization.loop import linearize
from auv_analysis.linearization.modes import STABLE, modes, stability
from auv_analysis.linearization.state_space import Linearization
from auv_analysis.scenario import Scenario
from auv_dynamics.vehicle import Vehicle

OPEN = 'open loop'


def linear_models(
    subject: Vehicle | Scenario,
    controllers: Sequence[str],
    nu0: Sequence[float] | None,
    eta0: Sequence[float] | None,
) -> dict[str, Linearization]:
    """Linear models by name: the vehicle alone, then the loop with each controller.

    Parameters
    ----------
    subject : a vehicle, or a scenario with its controllers
    controllers : names of some of them
    nu0, eta0 : (6,) the point; none: at rest, level

    """
    found = {OPEN: linearize(subject, nu0, eta0=eta0)}
    for name in controllers:
        found[name] = linearize(subject, nu0, controller=name, eta0=eta0)
    return found


def document_of(
    name: str, models: Mapping[str, Linearization], left_out: Sequence[str]
) -> dict[str, Any]:
    """Matrices, names, point and modes of each model, and what stands in none of them."""
    return {
        'name': name,
        'models': {name: _model(model) for name, model in models.items()},
        'left_out': list(left_out),
    }


def _model(model: Linearization) -> dict[str, Any]:
    found = modes(model)
    return {
        **{key: matrix.tolist() for key, matrix in zip('ABCD', model, strict=True)},
        **{key: list(getattr(model, key)) for key in ('states', 'inputs', 'outputs')},
        **{key: getattr(model, key).tolist() for key in ('x0', 'u0', 'y0', 'drift')},
        'error': model.error,
        'modes': found,
        'stable': stability(found) == STABLE,
        'stability': stability(found),
    }
