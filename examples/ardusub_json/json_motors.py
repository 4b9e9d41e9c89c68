"""ArduSub's motors and a vehicle's thrusters: which is which, and the thrust of a pulse."""

from typing import NamedTuple

import numpy as np
from ardusub_mixer import FRAMES

from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import one_of
from auv_dynamics.vehicle.thruster_curves import ThrusterCurve, at_voltage, load_curve
from auv_dynamics.vehicle.thrusters import Thrusters

CHANNELS = 32  # pulses that a frame carries at most
NAMES = {6: 'VECTORED, FRAME_CONFIG 1', 8: 'VECTORED_6DOF, FRAME_CONFIG 2'}
NOMINAL = 16.0  # V of the usual curve
NONE = 1e-3  # m and of 1: below, a thruster has no share in a degree of freedom
Order = list[tuple[int, bool]]  # thruster of each motor, and whether it is reversed


class Motors(NamedTuple):
    """Thrusters by the channels of ArduSub.

    Attributes
    ----------
    channels : (n,) channel of each thruster, from 0
    reversed : (n,) whether it turns the other way round, as with MOT_n_DIRECTION -1
    curves : thrust of a pulse, and (m,) indices of the thrusters that have it
    astern, ahead : (n,) factors on negative and on positive thrusts

    """

    channels: np.ndarray
    reversed: np.ndarray
    curves: list[tuple[ThrusterCurve, np.ndarray]]
    astern: np.ndarray
    ahead: np.ndarray

    def thrusts(self, pulses: np.ndarray) -> np.ndarray:
        """Thrusts (n,), N, of pulses (32,), microseconds; 0 is no pulse and no thrust."""
        u = np.zeros(len(self.channels))
        for curve, at in self.curves:
            u[at] = curve.thrust(pulses[self.channels[at]], self.reversed[at])
        return u * np.where(u < 0.0, self.astern, self.ahead)


def make_motors(
    thrusters: Thrusters, option: str | None, voltage: float | None
) -> tuple[Motors, str]:
    """Motors of a vehicle, and in words which thruster is which.

    A thruster has the curve of its rotor in the vehicle file; one without a curve of pulses that of
    a T200, scaled so that a full pulse at 16 V gives its limits.

    Parameters
    ----------
    thrusters : of the vehicle file
    option : thruster of each motor, by name or number, with - where it is reversed; None: by the
        frame of ArduSub whose signs the thrusters have, else in the file's order
    voltage : of the battery, V; None: the nominal one of each rotor

    """
    if voltage is not None and not 0.0 < voltage < np.inf:
        raise InputError('--voltage', '', 'a positive number (V)', voltage)
    names = thrusters.names
    frame = '--motors' if option else NAMES.get(len(names), '')
    order = _ordered(option, names) if option else _matched(thrusters.matrix)
    if order is None:
        order = [(i, False) for i in range(len(names))]
        frame = 'no frame that is known here, in the order of the file'
    words = ', '.join(f'{names[i]}{" reversed" * flip}' for i, flip in order)
    flipped = np.array([flip for _, flip in sorted(order)])
    channels = np.argsort([i for i, _ in order])
    usual = load_curve('t200_16v')
    scales = thrusters.reverse / -usual.thrusts[0], thrusters.forward / usual.thrusts[-1]
    groups: dict[tuple[bytes, float], tuple[ThrusterCurve, list[int]]] = {}
    for i in range(len(names)):
        rotor = thrusters.rotors[i] if thrusters.rotors else None
        curve, nominal = usual, NOMINAL
        if rotor and rotor.curve and rotor.curve.unit == 'pwm_us':
            curve, nominal = rotor.curve, rotor.voltage or voltage or NOMINAL
            scales[0][i] = scales[1][i] = 1.0
        table = curve.commands.tobytes() + curve.thrusts.tobytes()
        groups.setdefault((table, nominal), (curve, []))[1].append(i)
    curves = [
        (at_voltage(curve, nominal, voltage or nominal), np.array(at))
        for (_, nominal), (curve, at) in groups.items()
    ]
    return Motors(channels, flipped, curves, *scales), f'{frame}; motors 1 to {len(names)}: {words}'


def _ordered(option: str, names: tuple[str, ...]) -> Order:
    words = [word.strip() for word in option.split(',')]
    known = {f'{i + 1}': i for i in range(len(names))} | {n: i for i, n in enumerate(names)}
    for word in words:
        if word.removeprefix('-') not in known:
            raise InputError('--motors', '', one_of(word.removeprefix('-'), names), word)
    order = [(known[word.removeprefix('-')], word.startswith('-')) for word in words]
    if sorted(i for i, _ in order) != list(range(len(names))):
        raise InputError('--motors', '', f'each of {", ".join(names)} once', option)
    return order


def _matched(T: np.ndarray) -> Order | None:
    """By ArduSub's factors, whose signs are those of T (6, n), or all their opposites."""
    if (factors := FRAMES.get(T.shape[1])) is None:
        return None
    # roll, pitch, yaw, throttle (up), forward, lateral to surge, sway, heave, roll, pitch, yaw
    factors = factors[:, [4, 5, 3, 0, 1, 2]] * [1, 1, -1, 1, 1, 1]
    signs = np.where(np.abs(T) > NONE, np.sign(T), 0.0)
    agreement = factors @ signs / np.abs(factors).sum(axis=1, keepdims=True)
    alike = np.abs(agreement) == 1.0
    if not (alike.sum(axis=0) == 1).all() or not (alike.sum(axis=1) == 1).all():
        return None
    return [(int(i), bool(agreement[j, i] < 0)) for j, i in enumerate(alike.argmax(axis=1))]
