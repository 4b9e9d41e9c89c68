"""What the model does not explain: F of (1) from measured motion and wrench, with its error.

From (1), F is the rate of the impulse less the momentum,

    F = d/dt [ integral of (tau - C nu - D nu - g) dt - M nu ],

so that the only rate to be estimated is that of a signal that stays smooth where tau and nu_dot
jump: a rate of nu alone would smear a step of tau into F.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from auv_analysis.bag.foreign_tracks import TimeBase, Track, at_times, integral
from auv_analysis.metrics.local_polynomials import (
    ORDER,
    Stretch,
    filtered,
    given_window,
    narrow_window,
    variance,
)
from auv_dynamics.kernel.compile import plain
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.vehicle.model import coriolis, damping, restoring
from auv_dynamics.vehicle.vehicle import Vehicle

FILTER = 'local polynomials of order 3 (Savitzky-Golay for uneven stamps)'
SMALL = 1e-6  # m/s, rad/s: step of the differences that tell how resistance depends on nu


@dataclass(frozen=True, eq=False)
class Unexplained:
    """F with what is known of its error.

    Attributes
    ----------
    F : (n, 6) N and N m, body frame
    error : (n, 6) standard error of each, N and N m
    window : (6,) s, of the filter
    nu_dot_error : (6,) root mean square of the error of nu_dot that goes with it, m/s2 and rad/s2
    noise : (6,) standard deviation of white noise found in nu, m/s and rad/s

    """

    F: np.ndarray
    error: np.ndarray
    window: np.ndarray
    nu_dot_error: np.ndarray
    noise: np.ndarray

    def figures(self) -> dict[str, Any]:
        """How the acceleration was estimated, for `summary.json`."""
        return {
            'filter': FILTER,
            'order': ORDER,
            'window': self.window.tolist(),
            'velocity_noise': self.noise.tolist(),
            'error_rms': self.nu_dot_error.tolist(),
        }


def unexplained(
    vehicle: Vehicle, base: TimeBase, pose: Track, twist: Track, tau: Track, window: float | None
) -> Unexplained:
    """Estimate F of (1) at the samples of a time base.

    Parameters
    ----------
    vehicle : the model
    base : whose samples are asked for
    pose, twist, tau : motion and the wrench that acted
    window : s, None: by its error, per degree of freedom

    """
    velocities = [_velocities(base, twist, i) for i in range(len(base.stretches))]
    seconds = [(ns - base.ns[0]) / NANOSECONDS for ns, _ in velocities]
    noise = variance(zip(seconds, (nu for _, nu in velocities), strict=True))
    stretches = [
        _stretch(vehicle, pose, tau, (t, ns, nu), base.t[base.owner == i], noise)
        for i, (t, (ns, nu)) in enumerate(zip(seconds, velocities, strict=True))
    ]
    period = twist.period / NANOSECONDS
    counts = given_window(window, period) if window else narrow_window(stretches)
    F, error = filtered(stretches, counts, base.step / NANOSECONDS)
    inverse = np.linalg.inv(vehicle.M)
    nu_dot_error = np.sqrt((error**2 @ (inverse**2).T).mean(axis=0))
    return Unexplained(F, error, counts * period, nu_dot_error, np.sqrt(noise))


def _velocities(base: TimeBase, twist: Track, i: int) -> tuple[np.ndarray, np.ndarray]:
    """Stamps (k,) and velocities (k, 6) inside a stretch."""
    first, last = base.stretches[i]
    inside = slice(*np.searchsorted(twist.ns, [first, last + 1]))
    return twist.ns[inside], twist.rows[inside]


def _stretch(
    vehicle: Vehicle,
    pose: Track,
    tau: Track,
    samples: tuple[np.ndarray, np.ndarray, np.ndarray],
    at: np.ndarray,
    noise: np.ndarray,
) -> Stretch:
    """Impulse less momentum at the velocity samples: times in s and ns, velocities."""
    t, ns, nu = samples
    attitude = at_times(pose, ns)[:, 3:]
    resisted = resistance(vehicle, nu, attitude)
    fine = cumulative_trapezoid(resisted, t, axis=0, initial=0.0)
    coarse = cumulative_trapezoid(resisted[::2], t[::2], axis=0, initial=0.0)
    apart = (fine[::2] - coarse) / 3.0  # Richardson: the error of the finer one is of order 2
    y = integral(tau, ns) - fine - nu @ vehicle.M.T
    spread = np.zeros(nu.shape)  # of the resistance by noise of the velocity
    for i in range(6):
        moved = resistance(vehicle, nu + SMALL * np.eye(6)[i], attitude)
        spread += ((moved - resisted) / SMALL) ** 2 * noise[i]
    doubt = np.stack([np.interp(t, t[::2], column) for column in apart.T], axis=1)
    return Stretch(t, y - y[0], doubt, spread, at)


def resistance(vehicle: Vehicle, nu: np.ndarray, attitude: np.ndarray) -> np.ndarray:
    """C nu + D nu + g (n, 6) in N and N m of velocities (n, 6) and quaternions (n, 4)."""
    model, columns = vehicle.model, tuple(nu.T)
    terms = (
        plain(coriolis)(model.M, columns, columns),
        plain(damping)(model, columns, columns),
        plain(restoring)(model, tuple(attitude.T)),
    )
    return np.sum([np.stack(np.broadcast_arrays(*term), axis=1) for term in terms], axis=0)
