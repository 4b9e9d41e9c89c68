"""The T200 thruster as this driver takes it: thrust by the square of the command."""

import numpy as np

VOLTS = (12.0, 16.0, 20.0)
FORWARD = (3.71, 5.25, 6.7)  # kgf at full command, Blue Robotics, bollard pull
REVERSE = (2.92, 4.1, 5.05)
NOMINAL = 16.0  # V, to which the limits of the vehicle files belong


def supply_factors(voltage: float) -> tuple[float, float]:
    """Full thrust at a supply voltage over that at 16 V: reverse and forward.

    Parameters
    ----------
    voltage : at the speed controllers, V; taken as 12 to 20, beyond which nothing is published

    """
    kgf = (np.interp(voltage, VOLTS, table) for table in (REVERSE, FORWARD))
    full = (np.interp(NOMINAL, VOLTS, table) for table in (REVERSE, FORWARD))
    reverse, forward = (float(a / b) for a, b in zip(kgf, full, strict=True))
    return reverse, forward


def command_of(thrust: np.ndarray, reverse: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """Commands (n,), 1 for full, of thrusts (n,) in N with full thrusts (n,) each way, N."""
    return np.sign(thrust) * np.sqrt(np.abs(thrust) / np.where(thrust < 0, reverse, forward))


def thrust_of(command: np.ndarray, reverse: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """Thrusts (n,) in N of commands (n,); the inverse of `command_of`."""
    return command * np.abs(command) * np.where(command < 0, reverse, forward)
