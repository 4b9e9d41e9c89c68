"""Thrusters as they are: dead band, battery voltage and the response of the rotor's speed."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.files.errors import InputError
from auv_dynamics.kernel.compile import compiled, helper
from auv_dynamics.kernel.lanes import Number, clip, select, sqrt
from auv_dynamics.kernel.six import Numbers, add
from auv_dynamics.vehicle.thruster_curves import at_voltage
from auv_dynamics.vehicle.thrusters import (
    AttainableWrench,
    Rotor,
    Thrusters,
    column,
    left_of,
    shaped,
    thrust,
)

KEYS = ('rotors', 'rotor_lag', 'dead_band', 'voltage')  # of `actuators`, any of which asks for them
PER_ROW = 3  # rotors whose speed and its rate fill a row of six of the actuators' memory


class Rotors(NamedTuple):
    """Response of n thrusters to commanded thrusts.

    Attributes
    ----------
    dead_band : (n, 2) reverse and forward thrust in N below which a rotor does not turn
    low, high, near : (n, m) borders of the linear pieces of the steady thrust, N, and the one that
        is nearer to zero; m = 0: what is asked for
    slope, change : (n, m) slopes of the pieces at the first voltage, and what the last one adds
    pace : (1,) of the way from the first to the last voltage, per step
    response : (n, 4) of the deviation of the speed and of its rate over a step, row-major; (0, 4):
        the speed follows at once
    turning : number of rows of `response`
    drag : (n, 2) weight of the thrusts over a step, 1/sqrt(N), and inverse of the weight of its
        end, of rotors that the propeller's drag slows down; 0 in the first column: another; None:
        there are none

    """

    dead_band: np.ndarray
    low: np.ndarray
    high: np.ndarray
    near: np.ndarray
    slope: np.ndarray
    change: np.ndarray
    pace: np.ndarray
    response: np.ndarray
    turning: int
    drag: np.ndarray | None


def make_rotors(
    spec: Mapping[str, Any], thrusters: Thrusters, vehicle: str, step: float, file: object
) -> Rotors | None:
    """Rotors of the actuators of a checked scenario, None where none of `KEYS` asks for them.

    Parameters
    ----------
    spec : `rotors`: those of the vehicle file; `rotor_lag` (s) and `dead_band` (N) of all in their
        place; `voltage` (V) of the battery, or [first, last, seconds from one to the other]
    thrusters : of the vehicle
    vehicle : its name
    step : control period, s
    file : named in errors

    Raises
    ------
    InputError : a vehicle file without rotors, or without their nominal voltage

    """
    if not any(spec.get(key) not in (None, False) for key in KEYS):
        return None
    if spec.get('rotors') and not thrusters.rotors:
        expected = f'a vehicle whose thrusters have a rotor, those of {vehicle} have none'
        raise InputError(file, 'actuators.rotors', expected, 'true')
    rotors = asked_rotors(spec, thrusters)
    response = np.array([_response(rotor, step) for rotor in rotors])
    most = np.maximum(thrusters.reverse, thrusters.forward).tolist()
    drag = np.array([_drag(*pair, step) for pair in zip(rotors, most, strict=True)])
    lagging = response.any() or drag.any()
    (low, high, near, slope, change), pace = _pieces(
        spec.get('voltage'), thrusters, vehicle, step, file
    )
    return Rotors(
        np.array([rotor.dead_band for rotor in rotors]),
        low,
        high,
        near,
        slope,
        change,
        np.array([pace]),
        response if lagging else np.zeros((0, 4)),
        len(rotors) if lagging else 0,
        drag if drag.any() else None,
    )


def asked_rotors(spec: Mapping[str, Any], thrusters: Thrusters) -> tuple[Rotor, ...]:
    """Rotors of thrusters by the actuators of a scenario, as of `make_rotors`; else ideal ones."""
    rotors = (thrusters.rotors if spec.get('rotors') else ()) or (Rotor(),) * len(thrusters.names)
    own: dict[str, Any] = {}
    if spec.get('rotor_lag') is not None:
        own = {'lag': float(spec['rotor_lag']), 'lag_at': 0.0, 'omega': 0.0}
    if 'dead_band' in spec:
        reverse, forward = np.broadcast_to(spec['dead_band'], 2).astype(float).tolist()
        own['dead_band'] = (reverse, forward)
    return tuple(replace(rotor, **own) for rotor in rotors)


def _response(rotor: Rotor, step: float) -> np.ndarray:
    """(4,) transition over a step of the deviation of the speed from what is asked, and its rate.

    T n_dot + n = n_d (Fossen 2021, section 9.5), or n_ddot + 2 zeta omega n_dot + omega^2 n =
    omega^2 n_d, n_d held over the step: the exponential of the system's matrix times the step.
    """
    if rotor.lag_at:
        return np.zeros(4)
    if rotor.omega == 0.0:
        return np.array([np.exp(-step / rotor.lag) if rotor.lag else 0.0, 0.0, 0.0, 0.0])
    omega, zeta = rotor.omega, rotor.zeta
    split = omega * np.sqrt(complex(zeta**2 - 1.0))
    slow, fast = np.exp((split - zeta * omega) * step), np.exp((-split - zeta * omega) * step)
    odd = (slow - fast) / (2.0 * split) if abs(split) > 0.0 else step * slow
    about = np.array([[zeta * omega, 1.0], [-(omega**2), -zeta * omega]])
    return ((slow + fast) / 2.0 * np.eye(2) + odd * about).real.ravel()


def _drag(rotor: Rotor, most: float, step: float) -> tuple[float, float]:
    """Row of `drag` of a rotor whose thrust is `most` N at its limit; see `fill_turned`.

    n_dot = (u - n |n|) / (2 lag sqrt(lag_at)) has the time constant lag at the thrust lag_at. The
    weight of the end of a step, 1/2 for a short one, makes a small deviation exact at the limit.
    """
    if not rotor.lag_at:
        return 0.0, 0.0
    gain = step / (2.0 * rotor.lag * np.sqrt(rotor.lag_at))
    decay = 2.0 * gain * np.sqrt(most)  # step by time constant
    end = -1.0 / np.expm1(-decay) - 1.0 / decay
    return end * gain, 1.0 / end


def _pieces(
    voltage: float | Sequence[float] | None, thrusters: Thrusters, vehicle: str, step: float,
    file: object,
) -> tuple[np.ndarray, float]:  # fmt: skip
    """Pieces (5, n, m) of the steady thrusts as in `Rotors`, none without a voltage; the pace."""
    if voltage is None:
        return np.zeros((5, len(thrusters.names), 0)), 0.0
    given = [voltage, voltage, 1.0] if isinstance(voltage, int | float) else voltage
    rows = []
    for i, rotor in enumerate(thrusters.rotors or (Rotor(),) * len(thrusters.names)):
        if rotor.voltage is None:
            expected = f'a nominal voltage of every thruster, {vehicle} gives none of'
            raise InputError(file, 'actuators.voltage', expected, thrusters.names[i])
        limits = float(thrusters.reverse[i]), float(thrusters.forward[i])
        asked, begin = steady_thrusts(rotor, *limits, given[0])
        _, end = steady_thrusts(rotor, *limits, given[1])
        low, high = asked[:-1], asked[1:]
        slope, later = (np.diff(thrusts) / np.diff(asked) for thrusts in (begin, end))
        rows.append([low, high, np.where(high > 0.0, low, high), slope, later - slope])
    most = max(len(row[0]) for row in rows)
    padded = [[np.pad(part, (0, most - len(part))) for part in row] for row in rows]
    return np.array(padded).transpose(1, 0, 2).copy(), step / given[2]


def steady_thrusts(
    rotor: Rotor, reverse: float, forward: float, voltage: float
) -> tuple[np.ndarray, np.ndarray]:
    """What comes at a voltage where the command is the inverse of the curve at the nominal one.

    Parameters
    ----------
    rotor : with its nominal voltage
    reverse, forward : limits of the thruster, N
    voltage : V

    Returns
    -------
    asked : (m + 1,) thrusts in N, rising, zero among them; in between it is linear
    given : (m + 1,) thrusts at the voltage

    """
    assert rotor.voltage is not None
    if rotor.curve is None:
        asked = np.array([-reverse, 0.0, forward])
        return asked, asked * (voltage / rotor.voltage) ** 2
    nominal = rotor.curve.thrusts
    given = at_voltage(rotor.curve, rotor.voltage, voltage).thrusts
    asked, first = np.unique(nominal, return_index=True)
    given = np.where(asked == 0.0, 0.0, given[first])
    if 0.0 not in asked:
        place = int(np.searchsorted(asked, 0.0))
        asked, given = np.insert(asked, place, 0.0), np.insert(given, place, 0.0)
    return asked, given


@helper
def _steady(rotors: Rotors, i: int, k: int, u: Number) -> Number:
    """Thrust in N that thruster i gives in the end where u is asked for at step k."""
    least, most = -rotors.dead_band[i, 0], rotors.dead_band[i, 1]
    turned = select(u >= most, u, select(u <= least, u, 0.0 * u))
    if rotors.low.shape[1] == 0:
        return turned
    way = k * rotors.pace[0]
    way = select(way > 1.0, 1.0, way)
    total = 0.0 * turned
    for r in range(rotors.low.shape[1]):
        part = clip(turned, rotors.low[i, r], rotors.high[i, r]) - rotors.near[i, r]
        total = total + (rotors.slope[i, r] + way * rotors.change[i, r]) * part
    return total


@helper
def fill_turned(
    drag: np.ndarray | None, rotors: Rotors, i: int, u: Number, row: np.ndarray
) -> Number:
    """Thrust of a rotor whose steady thrust is u; `row` (6,) has its speed and rate, in place.

    Thrust goes by n |n| (Yoerger et al. 1990, equation (1); Fossen 2021, section 9.3), n in
    sqrt(N). With drag the mean m of a step has n_dot = a (u - m |m|) (Yoerger et al. 1990), a
    quadratic equation. `drag` is that of rotors: without any the branch is none when compiled.
    """
    P, j = rotors.response, 2 * (i % PER_ROW)
    root = sqrt(abs(u))
    asked = select(u < 0.0, -root, root)
    ahead, rate = row[j] - asked, 1.0 * row[j + 1]
    speed = asked + (P[i, 0] * ahead + P[i, 1] * rate)
    row[j + 1] = P[i, 2] * ahead + P[i, 3] * rate
    if drag is not None:
        weight, away = drag[i, 0], drag[i, 1]
        w = row[j] + weight * u
        mean = 2.0 * w / (1.0 + sqrt(1.0 + 4.0 * weight * abs(w)))
        speed = select(weight > 0.0, row[j] + away * (mean - row[j]), speed)
    row[j] = speed
    return speed * abs(speed)


@compiled
def fill_followed(rotors: Rotors, u: np.ndarray, speeds: np.ndarray) -> None:
    """Write the thrusts of rotors into u (n,) in the place of their steady ones, N.

    `speeds` (rows of three rotors, 6) in place; `rotors` have some that do not follow at once.
    """
    for i in range(len(u)):
        u[i] = fill_turned(rotors.drag, rotors, i, u[i], speeds[i // PER_ROW])


@helper
def fill_delivered(
    rotors: Rotors, reach: AttainableWrench, left: np.ndarray | None, k: int, tau: Numbers,
    speeds: np.ndarray,
) -> Numbers:  # fmt: skip
    """T u, u what the thrusters make of the thrusts of tau at step k.

    Parameters
    ----------
    left : what faults leave of each thrust, as of `delivered`
    speeds : (..., 6) rows of three rotors, in place

    """
    command, share = shaped(reach.first, reach, tau)
    n = reach.T.shape[1]
    total = (0.0 * tau[0], 0.0 * tau[1], 0.0 * tau[2], 0.0 * tau[3], 0.0 * tau[4], 0.0 * tau[5])
    for i in range(n):
        u = _steady(rotors, i, k, thrust(reach, i, command) * share)
        if rotors.turning > 0:
            u = fill_turned(rotors.drag, rotors, i, u, speeds[i // PER_ROW])
        total = add(total, column(reach, i, left_of(left, i, n, u)))
    return total
