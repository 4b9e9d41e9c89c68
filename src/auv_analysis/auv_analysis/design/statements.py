"""What a design comes to, in sentences that are computed from its numbers."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from auv_analysis.design.comparison import HALF, Candidate
from auv_analysis.design.couplings import COUPLINGS, UNITS
from auv_analysis.design.parameters import BALLAST, DISC_PART, NAMES, semi_axes
from auv_analysis.design.search import parts_of
from auv_analysis.design.space import Space
from auv_analysis.output.text import join, number, plain
from auv_dynamics.vehicle.vehicle import Vehicle

ASSUMPTIONS = (
    'The inertia about the centre of gravity stays as it is when the centre of gravity is moved.',
    'Ballast is a point mass; foam at its place carries its weight, so that W - B and the '
    'restoring moment do not change, and foam and ballast have no added mass and no drag.',
    'The disc is thin, as heavy as the water that it displaces, and moves as in unbounded water; '
    'its drag counts in each degree of freedom by itself.',
    'The damping is otherwise that of the file, and the controllers keep their gains.',
)
TILT = np.radians(1.0)  # more of it at rest is worth a warning
WORSE = 1.1  # times: from which on a side effect is named
NEGLIGIBLE = 1e-3  # of the largest of its kind and unit: not worth a word
MOST = 6  # side effects that are named
COSTS = (
    'delta_xi_max', 'delta_pi_max', 'effort.rms', 'effort.max', 'velocity_error.rms',
    'velocity_error.max_after_2s',
)  # fmt: skip


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


def bound_warnings(parameters: Sequence[Mapping[str, Any]]) -> list[str]:
    """What lies on a bound of the search; `parameters` as in design.json."""
    on = [
        f'{one["name"]} = {plain(one["value"], 4)} {one["unit"]} ({one["at_bound"]})'
        for one in parameters
        if one['at_bound']
    ]
    if not on:
        return []
    return [f'at a bound of the search, so that more might do more: {join(on)}']


def place_warnings(space: Space, x: np.ndarray) -> list[str]:
    """Which parts are placed outside of the hull, as far as a vehicle file tells of it."""
    axes, which = semi_axes(space.vehicle, space.data)
    found = []
    for part in (BALLAST, DISC_PART):
        r = x[[NAMES.index(f'{part}.{axis}') for axis in 'xyz']]
        if part in parts_of(x) and np.linalg.norm((r - space.vehicle.r_B) / axes) > 1:
            found.append(
                f'the {part} is placed outside the hull, as far as the file tells of one: {which}, '
                f'{join([plain(a, 3) for a in axes])} m, about the centre of buoyancy'
            )
    return found


def side_effects(rows: Sequence[Mapping[str, Any]], target: str) -> list[dict[str, Any]]:
    """Measures beside the target that a change makes larger by more than a tenth.

    Parameters
    ----------
    rows : `measures` of design.json
    target : name of the coupling that is reduced, as in `COUPLINGS`

    Returns
    -------
    effects : the same rows with `percent`, None where there was none before; those that are
        nothing beside the largest of their kind are left out

    """
    found = []
    kinds: dict[tuple[str, str], float] = {}
    for row in rows:
        kind = row['name'].rpartition('.')[0], row['unit']
        kinds[kind] = max(kinds.get(kind, 0.0), row['before'] or 0.0, row['after'] or 0.0)
    for row in rows:
        kind = row['name'].rpartition('.')[0], row['unit']
        before, after = row['before'], row['after']
        if before is None or after is None or kind[0] not in COSTS:
            continue
        asked = row['name'] == target.replace('.', '_max.')
        if not asked and after > WORSE * before and after > NEGLIGIBLE * kinds[kind]:
            percent = 100 * (after / before - 1) if before else None
            found.append({**row, 'percent': percent})
    return sorted(found, key=lambda row: -(row['percent'] or np.inf))


def side_effect_warnings(effects: Sequence[Mapping[str, Any]]) -> list[str]:
    """The same in words, the largest first."""
    if not effects:
        return []
    named = [
        f'{row["name"]} from {number(row["before"])} to {number(row["after"])} {row["unit"]}'
        + (' (new)' if row['percent'] is None else f' (+{number(row["percent"])} %)')
        for row in effects[:MOST]
    ]
    if len(effects) > MOST:
        named.append(f'{len(effects) - MOST} others')
    return [f'side effects above {100 * (WORSE - 1):.0f} %: {join(named)}']


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
