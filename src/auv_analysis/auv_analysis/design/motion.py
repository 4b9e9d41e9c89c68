"""What a run says of a changed vehicle that moves in the same way: its inputs, by inverse dynamics.

Dynamics is linear in the inertial parameters, so the input of the changed vehicle is that of the
run plus a linear map of the difference, (1): dtau = dM nu_dot + dC(nu) nu + dD(nu) nu + dg(eta).
"""

from dataclasses import dataclass

import numpy as np

from auv_analysis.design.space import UPPER, WIDTH, Difference
from auv_analysis.metrics.coupling import delta_pi, delta_xi
from auv_analysis.runs.run import Run
from auv_dynamics.vehicle.kinematics import quaternion, rotation
from auv_gvc_controller.laws.model import control_model

SPREAD = 120  # samples that are spread over a run, denser where much happens
PEAKS = 3  # samples that are added for every signal, at its largest values


@dataclass(frozen=True, eq=False)
class Motion:
    """Samples of a run, and what its input would be for another vehicle.

    Attributes
    ----------
    nu, tau : (n, 6) velocity and commanded wrench at some samples
    response : (6 n, WIDTH) from a `Difference` as a row to what it adds to tau
    row : (WIDTH,) the difference of the run's own vehicle from the unchanged one
    weights : (n,) of the samples in a mean over the run, their sum is 1

    """

    nu: np.ndarray
    tau: np.ndarray
    response: np.ndarray
    row: np.ndarray
    weights: np.ndarray

    @classmethod
    def of(cls, run: Run, row: np.ndarray) -> 'Motion':
        """Motion of a run; `row` is that of its vehicle's difference from the unchanged one."""
        where = _samples(run)
        part = run.part(where)
        down = rotation(quaternion(part.eta[:, 3:]))[:, 2]
        nu_dot = acceleration(part, down)
        columns = [added_wrench(_unit(k), part.nu, nu_dot, down).ravel() for k in range(WIDTH)]
        weights = _weights(where, len(run.t))
        return cls(part.nu, part.tau, np.stack(columns, axis=-1), np.asarray(row), weights)

    def inputs(self, row: np.ndarray) -> np.ndarray:
        """Tau (..., n, 6) of vehicles in this motion; row (..., WIDTH), real or complex."""
        change = row - self.row
        flat = change.reshape(-1, WIDTH).T
        added = self.response @ flat.real
        if np.iscomplexobj(flat):
            added = added + 1j * (self.response @ flat.imag)
        return self.tau + added.T.reshape(*change.shape[:-1], *self.tau.shape)


def added_wrench(
    change: Difference, nu: np.ndarray, nu_dot: np.ndarray, down: np.ndarray
) -> np.ndarray:
    """What a difference adds to tau in the same motion, (1).

    Parameters
    ----------
    change : of the vehicle, no leading axes
    nu, nu_dot : (n, 6) velocity and acceleration, body frame
    down : (n, 3) direction of gravity in the body frame

    Returns
    -------
    dtau : (n, 6) N, N m

    """
    v, omega = nu[:, :3], nu[:, 3:]
    momentum = nu @ change.M.T
    linear, angular = momentum[:, :3], momentum[:, 3:]
    dtau = nu_dot @ change.M.T + np.abs(nu) * nu * change.drag
    dtau[:, :3] += np.cross(omega, linear)
    dtau[:, 3:] += np.cross(v, linear) + np.cross(omega, angular)
    dtau[:, 3:] += np.cross(down, np.broadcast_to(change.couple, down.shape))
    return dtau


def acceleration(run: Run, down: np.ndarray) -> np.ndarray:
    """nu_dot (n, 6) of a run's samples by (1), with the wrench that was applied."""
    vehicle, nu = run.vehicle, run.nu
    couple = vehicle.weight * vehicle.r_G - vehicle.buoyancy * vehicle.r_B
    whole = Difference(vehicle.M, couple, np.zeros(6))
    rest = run.tau_applied - added_wrench(whole, nu, np.zeros_like(nu), down)
    rest -= nu @ vehicle.D_linear.T + (np.abs(nu) * nu) @ vehicle.D_quadratic.T
    if vehicle.lift is not None:
        rest -= (np.abs(nu[:, :1]) * nu) @ vehicle.lift.T
    rest[:, :3] += (vehicle.weight - vehicle.buoyancy) * down
    if run.disturbance is not None:
        rest -= run.disturbance
    return np.linalg.solve(vehicle.M, rest.T).T


def _unit(k: int) -> Difference:
    row = np.zeros(WIDTH)
    row[k] = 1.0
    M = np.zeros((6, 6))
    M[UPPER] = row[: len(UPPER[0])]
    M = np.maximum(M, M.T)
    return Difference(M, row[-9:-6], row[-6:])


def _samples(run: Run) -> np.ndarray:
    """Indices of samples, ascending: dense where energy and effort are, and at the peaks."""
    model = control_model(run.vehicle)
    Upsilon, inverse = model.Upsilon.reshape(6, 6), model.Upsilon_inv.reshape(6, 6)
    energy = (run.nu @ run.vehicle.M * run.nu).sum(axis=1)
    effort = (run.tau * np.linalg.solve(run.vehicle.M, run.tau.T).T).sum(axis=1)
    parts = (part / total for part in (energy, effort) if (total := part.sum()) > 0)
    activity = np.cumsum(sum(parts, np.full(len(run.t), 1 / len(run.t))))
    levels = (np.arange(SPREAD) + 0.5) / SPREAD * activity[-1]
    spread = np.minimum(np.searchsorted(activity, levels), len(run.t) - 1)
    signals = run.nu, run.tau, delta_xi(inverse, run.nu), delta_pi(Upsilon, run.tau)
    size = np.abs(np.concatenate(signals, axis=1))
    peaks = np.argsort(-size, axis=0, kind='stable')[:PEAKS]
    return np.union1d(spread, peaks)


def _weights(where: np.ndarray, count: int) -> np.ndarray:
    """Share of the run that is nearer to each of some samples than to the others."""
    between = np.concatenate([[-0.5], (where[1:] + where[:-1]) / 2, [count - 0.5]])
    return np.diff(between) / count
