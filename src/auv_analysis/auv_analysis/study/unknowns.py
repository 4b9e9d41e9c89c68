"""What the paper leaves open of its vehicle and disturbance, and vehicles that all have its N."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from itertools import product
from typing import Any

import numpy as np

from auv_analysis.report import paper
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scenario import Scenario

R_G = (0.15, 0.0, 0.03)  # m; section 5
MASS = (185.0, 300.0)  # kg: what Δξ of sway leaves, and X_udot <= 0
M46 = ((-32.0, -19.0), (18.0, 31.0))  # kg m2: what the share of roll and Δξ of roll leave
DAMPING = (0.0, 20.0)  # times the reconstruction's
SIGNS = (-1, 1)  # of the exponents of (39)
INSIDE = 32  # points of a Sobol' sequence in all continuous unknowns, with either sign


@dataclass(frozen=True)
class Variant:
    """One way to fill in what the paper leaves open.

    Attributes
    ----------
    kind : 'shipped', 'corner' or 'inside'
    mass : kg
    M46 : roll-yaw term of M, kg m2
    linear, quadratic : factors of the two parts of the damping
    exponent_sign : of (39)

    """

    kind: str
    mass: float
    M46: float
    linear: float
    quadratic: float
    exponent_sign: int


NAMES = tuple(entry.name for entry in fields(Variant))[1:]


def inertia(mass: float, M46: float) -> np.ndarray:
    """M (6, 6) with the N that the paper prints, for a mass and a roll-yaw term.

    Coupled are surge and pitch by m z_G, sway and roll by -m z_G, sway and yaw by m x_G, heave and
    pitch by -m x_G, roll and yaw by M46; the diagonal follows from N = Upsilon^T M Upsilon, (9).

    Parameters
    ----------
    mass : kg
    M46 : kg m2

    """
    x, z = mass * R_G[0], mass * R_G[2]
    N = paper.N
    M = np.diag(N)
    M[3, 3] += z**2 / N[1]
    M[4, 4] += z**2 / N[0] + x**2 / N[2]
    M[5, 5] += x**2 / N[1] + (M46 + x * z / N[1]) ** 2 / N[3]
    for i, j, value in ((0, 4, z), (1, 3, -z), (1, 5, x), (2, 4, -x), (3, 5, M46)):
        M[i, j] = M[j, i] = value
    return M


def variants(scenario: Scenario, seed: int = 0, inside: int = INSIDE) -> tuple[Variant, ...]:
    """The shipped values, every corner, and points inside with either sign.

    Parameters
    ----------
    scenario : of the paper, with the shipped vehicle
    seed : of the points inside
    inside : how many, a power of two

    """
    data = scenario.vehicle_data
    sign = int(scenario.data['disturbance'][0].get('exponent_sign', -1))
    mass, shipped46 = data['rigid_body']['mass'], data['inertia_matrix'][3][5]
    first = Variant('shipped', float(mass), float(shipped46), 1.0, 1.0, sign)
    ends = (M46[0][0], M46[1][1])
    corners = [
        Variant('corner', *values) for values in product(MASS, ends, DAMPING, DAMPING, SIGNS)
    ]
    points = [
        Variant('inside', *values, sign) for values in _inside(seed, inside) for sign in SIGNS
    ]
    return (first, *corners, *points)


def _inside(seed: int, count: int) -> list[tuple[float, float, float, float]]:
    """Masses, M46 of either interval, and factors of damping, of which small ones are as many."""
    from scipy.stats import qmc

    points = qmc.Sobol(4, rng=np.random.default_rng(seed)).random(count)
    found = []
    for u, v, *damping in points:
        low, high = M46[int(v >= 0.5)]
        linear, quadratic = (DAMPING[1] * w**2 for w in damping)
        found.append((MASS[0] + u * (MASS[1] - MASS[0]), low + (2 * v % 1) * (high - low),
                      float(linear), float(quadratic)))  # fmt: skip
    return [tuple(float(x) for x in values) for values in found]  # type: ignore[misc]  # four


def changes_of(variant: Variant, scenario: Scenario) -> dict[str, Any]:
    """Changes that make the scenario the variant's; none of the shipped one."""
    if variant.kind == 'shipped':
        return {}
    damping: Mapping[str, Any] = scenario.vehicle_data['damping']
    return {
        'vehicle.rigid_body.mass': variant.mass,
        'vehicle.inertia_matrix': inertia(variant.mass, variant.M46),
        'vehicle.damping.linear': variant.linear * np.asarray(damping['linear'], float),
        'vehicle.damping.quadratic': variant.quadratic * np.asarray(damping['quadratic'], float),
        'disturbance[0].exponent_sign': variant.exponent_sign,
    }


def scenario_of(variant: Variant, scenario: Scenario) -> Scenario:
    """The scenario with what a variant says."""
    values = changes_of(variant, scenario)
    return changed_scenario(scenario, values) if values else scenario
