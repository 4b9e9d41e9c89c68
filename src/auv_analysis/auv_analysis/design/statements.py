"""What a design comes to, in sentences that are computed from its numbers."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from auv_analysis.design.comparison import HALF, Candidate
from auv_analysis.design.couplings import COUPLINGS, UNITS
from auv_analysis.report.text import join, number
from auv_dynamics.vehicle import Vehicle

ASSUMPTIONS = (
    'The inertia about the centre of gravity stays as it is when the centre of gravity is moved.',
    'Ballast is a point mass; foam at its place carries its weight, so that W - B and the '
    'restoring moment do not change, and foam and ballast have no added mass and no drag.',
    'The disc is thin, as heavy as the water that it displaces, and moves as in unbounded water; '
    'its drag counts in each degree of freedom by itself.',
    'The damping is otherwise that of the file, and the controllers keep their gains.',
)
TILT = np.radians(1.0)  # more of it at rest is worth a warning


def nothing_statement(vehicle: str, target: str | None, there: Sequence[str]) -> str:
    """Why there is nothing to remove."""
    if not there:
        return (
            f'{vehicle}: M is diagonal, so Upsilon is the identity and delta_xi and delta_pi are '
            'zero in every motion: there is no coupling to remove.'
        )
    if target is not None and target not in there:
        return (
            f'{vehicle}: {target} is zero in every motion by the structure of M: there is nothing '
            f'to remove. Not zero: {join(list(there))}.'
        )
    what = 'every coupling' if target is None else target
    return f'{vehicle}: {what} is zero throughout this scenario: there is nothing to remove.'


def result_statement(
    target: int, before: float, best: Candidate | None, words: Sequence[str], by: str
) -> str:
    """What the proposal does to the coupling, by simulation.

    Parameters
    ----------
    target : place in `COUPLINGS`
    before : largest magnitude
    best : the proposal; none: there is none
    words : of the proposal
    by : controller and hold of the run

    """
    name, unit = COUPLINGS[target], UNITS[COUPLINGS[target]]
    if best is None or best.ratio is None:
        return f'No change within the bounds lowers {name}, which is {number(before)} {unit}, {by}.'
    after = best.ratio * before
    lowered = 100 * (1 - best.ratio)
    text = (
        f'{_capital("; ".join(words))}: {name} falls from {number(before)} to {number(after)} '
        f'{unit}, by {lowered:.1f} %, {by}.'
    )
    if best.ratio > HALF:
        text += f' The bounds do not allow half: {lowered:.1f} % is the most that was found.'
    return text


def warnings_of(before: Vehicle, after: Vehicle) -> list[str]:
    """What gets worse in the vehicle at rest."""
    found = []
    stable, now = stability(before), stability(after)
    if now <= 0 < stable:
        found.append('the changed vehicle is statically unstable')
    elif now < stable - 1e-9 * abs(stable):
        found.append(
            f'the static stability W z_G - B z_B falls from {number(stable)} to {number(now)} N m'
        )
    level, tilted = tilt(before), tilt(after)
    if level is not None and tilted is not None and tilted > level + TILT:
        angles = (np.degrees(angle) for angle in (tilted, level))
        found.append('at rest it tilts by {:.1f} deg, before {:.1f}'.format(*angles))
    return found


def stability(vehicle: Vehicle) -> float:
    """W z_G - B z_B in N m: positive where it rights itself."""
    return float(vehicle.weight * vehicle.r_G[2] - vehicle.buoyancy * vehicle.r_B[2])


def tilt(vehicle: Vehicle) -> float | None:
    """Angle in rad from level to where it rests; None where it does not right itself."""
    x, y, z = vehicle.weight * vehicle.r_G - vehicle.buoyancy * vehicle.r_B
    return float(np.arctan2(np.hypot(x, y), z)) if z > 0 else None


def rest_of(vehicle: Vehicle) -> dict[str, Any]:
    """Hydrostatics that a change can touch: N, N m, m, deg; None where it does not rest."""
    angle = tilt(vehicle)
    return {
        'weight': float(vehicle.weight),
        'buoyancy': float(vehicle.buoyancy),
        'weight_minus_buoyancy': float(vehicle.weight - vehicle.buoyancy),
        'r_G': vehicle.r_G.tolist(),
        'r_B': vehicle.r_B.tolist(),
        'metacentric_height': float(vehicle.r_G[2] - vehicle.r_B[2]),
        'stability': stability(vehicle),
        'tilt_at_rest_deg': None if angle is None else float(np.degrees(angle)),
    }


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
