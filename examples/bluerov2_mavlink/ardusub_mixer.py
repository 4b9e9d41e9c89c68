"""How ArduSub moves its motors: pilot's pulses in, motor pulses out, and what T200s make of them.

Written from ArduSub's own tables and rules, and from nothing that the driver uses.
"""

from collections.abc import Sequence

import numpy as np

# AP_Motors6DOF.cpp, setup_motors: roll, pitch, yaw, throttle, forward, lateral of each motor
VECTORED_6DOF = (
    (0, 0, 1, 0, -1, 1),
    (0, 0, -1, 0, -1, -1),
    (0, 0, -1, 0, 1, 1),
    (0, 0, 1, 0, 1, -1),
    (1, -1, 0, -1, 0, 0),
    (-1, -1, 0, -1, 0, 0),
    (1, 1, 0, -1, 0, 0),
    (-1, 1, 0, -1, 0, 0),
)
VECTORED = (*VECTORED_6DOF[:4], (1, 0, 0, -1, 0, 0), (-1, 0, 0, -1, 0, 0))
FRAMES = {8: np.array(VECTORED_6DOF, float), 6: np.array(VECTORED, float)}
ORDER = (1, 0, 3, 2, 4, 5)  # input channels are pitch, roll, throttle, yaw, forward, lateral
LOW, MIDDLE, HIGH = 1100, 1500, 1900  # microseconds
DEAD = 25  # microseconds about the middle in which a speed controller does nothing
G = 9.80665


def motor_pulses(channels: Sequence[int], motors: int) -> list[int]:
    """Pulses of the motors, microseconds.

    Parameters
    ----------
    channels : six input pulses: pitch, roll, throttle, yaw, forward, lateral, microseconds
    motors : 6 (frame VECTORED) or 8 (VECTORED_6DOF)

    """
    inputs = [(min(HIGH, max(LOW, pulse)) - MIDDLE) / (HIGH - MIDDLE) for pulse in channels]
    ordered = np.array([inputs[i] for i in ORDER])
    factors = FRAMES[motors]
    if motors == 8:  # attitude and depth apart from the plane: each is normalised by itself
        rpt, yfl = factors.copy(), factors.copy()
        rpt[:, [2, 4, 5]] = 0.0
        yfl[:, [0, 1, 3]] = 0.0
        outputs = sum(out / max(1.0, np.abs(out).max()) for out in (rpt @ ordered, yfl @ ordered))
    else:
        outputs = factors @ ordered + _held_back(ordered[3], ordered[4])
    outputs = np.clip(outputs, -1.0, 1.0)
    return [int(MIDDLE + 400 * output) for output in outputs]


def _held_back(throttle: float, forward: float) -> np.ndarray:
    """What frame VECTORED takes off its rear thrusters against pitching, with MOT_FV_CPLNG_K 1."""
    most = max(0.0, 1.0 - abs(throttle))
    less = float(np.clip(forward, -most, most)) - forward
    rear = np.array([-1, -1, 0, 0, 0, 0] if forward < 0 else [0, 0, 1, 1, 0, 0], float)
    return rear * less


def thrust(pulses: Sequence[int], curve: str, voltage: float) -> np.ndarray:
    """Thrusts (n,) in N, positive the way of each thruster's nose.

    Parameters
    ----------
    pulses : of the motors, microseconds
    curve : 'square': by the square, as ArduPilot's simulator has it, to Blue Robotics' bollard
        pull; 'measured': the polynomial of von Benzon et al. 2022, eq. 18, eight thrusters on one
        battery
    voltage : of the supply, V; the measured curve is of 16 V and is taken at any

    """
    command = (np.array(pulses, float) - MIDDLE) / (HIGH - MIDDLE)
    command[np.abs(np.array(pulses) - MIDDLE) <= DEAD] = 0.0
    if curve == 'measured':
        powers = {9: -140.3, 7: 389.9, 5: -404.1, 3: 176.0, 1: 8.9}
        return sum((c * command**n for n, c in powers.items()), np.zeros(len(command)))
    # full thrust is about linear in the voltage from 12 to 20 V: 3.71, 5.25, 6.7 kgf forward
    forward, reverse = 5.25 + 0.374 * (voltage - 16.0), 4.10 + 0.266 * (voltage - 16.0)
    return command * np.abs(command) * np.where(command < 0, reverse, forward) * G
