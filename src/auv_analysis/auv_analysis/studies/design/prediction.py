"""Prediction: couplings of changed vehicles that move as in a run, and the objective function.

Dynamics is linear in the inertial parameters, so the input of the changed vehicle is that of the
run plus a linear map of the effect, (1): dtau = dM nu_dot + dC(nu) nu + dD(nu) nu + dg(eta).
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.metrics.coupling import delta_pi, delta_xi, structural_zeros
from auv_analysis.metrics.quantities import METRICS
from auv_analysis.runs.run import Run
from auv_analysis.studies.design.change import UPPER, WIDTH, ChangeEffect, ChangeSpace
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import one_of
from auv_dynamics.kernel.compile import plain
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.kinematics import quaternion, rotation
from auv_dynamics.vehicle.model import acceleration, coriolis
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_dynamics.vehicle.vehicle_file import is_definite
from auv_gvc_controller.laws.model import control_model, decompose, inverse_upper

KINDS = ('delta_xi', 'delta_pi')
COUPLINGS = tuple(f'{kind}.{dof}' for kind in KINDS for dof in DOFS)
UNITS = {
    f'{kind}.{dof}': METRICS[f'coupling.{kind}_max'].unit_of(dof) for kind in KINDS for dof in DOFS
}
REST = 1e-12  # a share below this is rounding


class Sizes(NamedTuple):
    """Couplings and effort of a run.

    Attributes
    ----------
    peaks : (12,) largest magnitudes of delta_xi and delta_pi: m/s, rad/s; N, N m
    shares : (12,) free of units, see `shares_of`
    effort : mean of tau^T M^-1 tau with M of the unchanged vehicle, N m/s2 (W/s)

    """

    peaks: np.ndarray
    shares: np.ndarray
    effort: float

    @property
    def by_effort(self) -> float:
        """Divisor of an effort: inf, so that it does not count, where there was none."""
        return self.effort if self.effort > 0 else np.inf


def sizes_of(run: Run, M_inv: np.ndarray) -> Sizes:
    """Sizes of the couplings of a run; M_inv (6, 6) weighs the effort."""
    model = control_model(run.vehicle)
    Upsilon, inverse = model.Upsilon.reshape(6, 6), model.Upsilon_inv.reshape(6, 6)
    xi, pi = delta_xi(inverse, run.nu), delta_pi(Upsilon, run.tau)
    peaks = np.concatenate([np.abs(xi).max(axis=0), np.abs(pi).max(axis=0)])
    even = np.full(len(run.t), 1 / len(run.t))
    shares = shares_of(xi, pi, model.N, run.nu @ inverse.T, run.tau @ Upsilon, even)
    return Sizes(peaks, shares, float(effort_of(run.tau, M_inv, even)))


def shares_of(
    xi_deformed: np.ndarray,
    pi_deformed: np.ndarray,
    N: np.ndarray,
    xi: np.ndarray,
    pi: np.ndarray,
    weights: np.ndarray,
) -> np.ndarray:
    """Couplings in proportion to the whole motion, free of units.

    A velocity weighs by the kinetic energy, sum of N_i xi_i^2 = nu^T M nu, an input by its dual,
    sum of pi_i^2 / N_i = tau^T M^-1 tau, which has the same N and Upsilon. So metres and radians
    can be compared, and a deformed velocity with a deformed input:
    sqrt(mean(N_i delta_xi_i^2) / mean(nu^T M nu)), sqrt(mean(delta_pi_i^2 / N_i) / mean(...)).

    Parameters
    ----------
    xi_deformed, pi_deformed : (..., n, 6) delta_xi, (33), and delta_pi, (34)
    N : (..., 6)
    xi, pi : (..., n, 6) generalised velocities and inputs
    weights : (n,) of the samples in a mean

    Returns
    -------
    shares : (..., 12) zero where nothing moves

    """
    energies = N * (weights @ xi_deformed**2), (weights @ pi_deformed**2) / N
    wholes = (N * (weights @ xi**2)).sum(-1), ((weights @ pi**2) / N).sum(-1)
    halves = [
        part / (whole + (whole == 0))[..., None]
        for part, whole in zip(energies, wholes, strict=True)
    ]
    return np.sqrt(np.concatenate(halves, axis=-1))


def effort_of(tau: np.ndarray, M_inv: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Mean of tau^T M^-1 tau: tau (..., n, 6) and weights (n,) to (...)."""
    return ((tau @ M_inv) * tau).sum(axis=-1) @ weights


def present(vehicle: Vehicle) -> list[str]:
    """Couplings that the structure of a vehicle's M allows, by name."""
    Upsilon, _ = decompose(vehicle.M)
    zeros = structural_zeros(Upsilon)
    return [name for name in COUPLINGS if name.split('.')[1] not in zeros[name.split('.')[0]]]


def coupling_named(text: str, there: list[str]) -> str:
    """Name of a coupling as a user types it: `delta_xi.sway`, `delta_xi_max.sway`.

    Raises
    ------
    InputError : it is none of the twelve

    """
    name = text.replace('_max.', '.')
    if name not in COUPLINGS:
        expected = one_of(name, there) if there else 'such as delta_xi.sway'
        raise InputError('--reduce', '', expected, text)
    return name


EVERY = tuple(range(len(COUPLINGS)))
SAMPLES = 120  # that are spread over a run, denser where much happens
PEAKS = 3  # samples that are added for every signal, at its largest values
OTHERS = 0.1  # weight of the other couplings and of the effort beside the one to be reduced
AT_REST = 0.3  # weight of the hydrostatic penalty
SIZE = 0.01  # weight of the size of the change
LEAST = 0.01  # of all couplings before: the least by which the others are judged
IMPOSSIBLE = 1e6  # objective of a change whose M is not positive definite


@dataclass(frozen=True, eq=False)
class RecordedMotion:
    """Samples of a run, and what its input would be for another vehicle.

    Attributes
    ----------
    nu, tau : (n, 6) velocity and commanded wrench at some samples
    response : (6 n, WIDTH) from a `ChangeEffect` as a row to what it adds to tau
    row : (WIDTH,) effect that the run's own vehicle already has
    weights : (n,) of the samples in a mean over the run, their sum is 1

    """

    nu: np.ndarray
    tau: np.ndarray
    response: np.ndarray
    row: np.ndarray
    weights: np.ndarray

    @classmethod
    def of(cls, run: Run, row: np.ndarray) -> 'RecordedMotion':
        """Motion of a run; `row` is the effect that its vehicle already has."""
        where = _samples(run)
        part = run.part(where)
        down = rotation(quaternion(part.eta[:, 3:]))[:, 2]
        nu_dot = accelerations(part)
        columns = [added_wrench(_unit(k), part.nu, nu_dot, down).ravel() for k in range(WIDTH)]
        weights = _weights(where, len(run.t))
        return cls(part.nu, part.tau, np.stack(columns, axis=-1), np.asarray(row), weights)

    def inputs(self, row: np.ndarray) -> np.ndarray:
        """Tau (..., n, 6) of vehicles in this motion; row (..., WIDTH)."""
        change = row - self.row
        added = self.response @ change.reshape(-1, WIDTH).T
        return self.tau + added.T.reshape(*change.shape[:-1], *self.tau.shape)


def added_wrench(
    change: ChangeEffect, nu: np.ndarray, nu_dot: np.ndarray, down: np.ndarray
) -> np.ndarray:
    """Contribution of an effect to tau in the same motion, (1).

    Parameters
    ----------
    change : of the vehicle, no leading axes
    nu, nu_dot : (n, 6) velocity and acceleration, body frame
    down : (n, 3) direction of gravity in the body frame

    Returns
    -------
    dtau : (n, 6) N, N m

    """
    columns = tuple(nu.T)
    turning = plain(coriolis)(change.M.ravel(), columns, columns)
    dtau = nu_dot @ change.M + np.stack(turning, axis=1) + np.abs(nu) * nu * change.drag
    dtau[:, 3:] += np.cross(down, change.couple)
    return dtau


def accelerations(run: Run) -> np.ndarray:
    """nu_dot (n, 6) of a run's samples by (1), with the wrench that was applied."""
    F = np.zeros_like(run.nu) if run.disturbance is None else run.disturbance
    columns = (tuple(rows.T) for rows in (quaternion(run.eta[:, 3:]), run.nu, run.tau_applied, F))
    return np.stack(plain(acceleration)(run.vehicle.model, *columns), axis=1)


def _unit(k: int) -> ChangeEffect:
    row = np.zeros(WIDTH)
    row[k] = 1.0
    M = np.zeros((6, 6))
    M[UPPER] = row[: len(UPPER[0])]
    M = np.maximum(M, M.T)
    return ChangeEffect(M, row[-9:-6], row[-6:])


def _samples(run: Run) -> np.ndarray:
    """Indices of samples, ascending: dense where energy and effort are, and at the peaks."""
    model = control_model(run.vehicle)
    Upsilon, inverse = model.Upsilon.reshape(6, 6), model.Upsilon_inv.reshape(6, 6)
    energy = (run.nu @ run.vehicle.M * run.nu).sum(axis=1)
    effort = (run.tau * np.linalg.solve(run.vehicle.M, run.tau.T).T).sum(axis=1)
    parts = (part / total for part in (energy, effort) if (total := part.sum()) > 0)
    activity = np.cumsum(sum(parts, np.full(len(run.t), 1 / len(run.t))))
    levels = (np.arange(SAMPLES) + 0.5) / SAMPLES * activity[-1]
    spread = np.minimum(np.searchsorted(activity, levels), len(run.t) - 1)
    signals = run.nu, run.tau, delta_xi(inverse, run.nu), delta_pi(Upsilon, run.tau)
    size = np.abs(np.concatenate(signals, axis=1))
    peaks = np.argsort(-size, axis=0, kind='stable')[:PEAKS]
    return np.union1d(spread, peaks)


def _weights(where: np.ndarray, count: int) -> np.ndarray:
    """Share of the run that is nearer to each of some samples than to the others."""
    between = np.concatenate([[-0.5], (where[1:] + where[:-1]) / 2, [count - 0.5]])
    return np.diff(between) / count


class Metrics(NamedTuple):
    """Objectives of a change; any number of leading axes.

    Attributes
    ----------
    ratios : (..., m) largest magnitudes of some couplings, after by before
    shares : (..., 12) of `shares_of`
    effort : (...,) mean of tau^T M^-1 tau, after by before
    at_rest : (...,) of `ChangeSpace.hydrostatic_penalty`
    size : (...,) of the change, see `ChangeSpace.size`
    definite : (...,) whether M is positive definite

    """

    ratios: np.ndarray
    shares: np.ndarray
    effort: Any
    at_rest: Any
    size: Any
    definite: Any


class Prediction:
    """Predicted couplings of a changed vehicle that moves as in a run.

    Parameters
    ----------
    space : the changes
    motion : samples of a run
    before : sizes of the couplings of the unchanged vehicle
    smooth : (12,) its smooth largest magnitudes; none: from the motion, which must be its own

    """

    def __init__(
        self,
        space: ChangeSpace,
        motion: RecordedMotion,
        before: Sizes,
        smooth: np.ndarray | None = None,
    ):
        self.space, self.motion, self.before = space, motion, before
        self._M_inv = np.linalg.inv(space.vehicle.M)  # weighs the effort
        if smooth is None:
            peaks = smooth_peak(self.signals(space.unchanged)[0])
            smooth = np.where(peaks > 0, peaks, np.inf)
        self.smooth = smooth

    def metrics(self, x: np.ndarray, targets: tuple[int, ...] = EVERY) -> Metrics:
        """Metrics of changes (..., 13); `targets` are places in `COUPLINGS`."""
        (deformed, xi, pi, tau, N, definite), weights = self.signals(x), self.motion.weights
        return Metrics(
            ratios=smooth_peak(deformed[..., targets]) / self.smooth[list(targets)],
            shares=shares_of(deformed[..., :6], deformed[..., 6:], N, xi, pi, weights),
            effort=effort_of(tau, self._M_inv, weights) / self.before.by_effort,
            at_rest=self.space.hydrostatic_penalty(x),
            size=self.space.size(x),
            definite=definite,
        )

    def ratios(self, x: np.ndarray) -> np.ndarray:
        """Predicted largest magnitudes (12,) after a change (13,), by those before; 0 by 0 is 0."""
        peaks = np.abs(self.signals(x)[0]).max(axis=-2)
        return peaks / np.where(self.before.peaks > 0, self.before.peaks, np.inf)

    def signals(self, x: np.ndarray) -> tuple[np.ndarray, ...]:
        """Of changes (..., 13) at the samples of the motion.

        Returns
        -------
        deformed : (..., n, 12) delta_xi beside delta_pi
        xi, pi, tau : (..., n, 6)
        N : (..., 6)
        definite : (...) whether M is positive definite; else Upsilon and N are those of I

        """
        change = self.space.effect(x)
        M = self.space.vehicle.M + change.M
        definite = is_definite(M)
        Upsilon, N = decompose(np.where(definite[..., None, None], M, np.eye(6)))
        tau, nu = self.motion.inputs(change.row), self.motion.nu
        xi, pi = nu @ np.swapaxes(inverse_upper(Upsilon), -2, -1), tau @ Upsilon
        return np.concatenate([xi - nu, pi - tau], axis=-1), xi, pi, tau, N, definite


def smooth_peak(signals: np.ndarray) -> np.ndarray:
    """(mean of s^8)^(1/8) over the samples of signals: (..., n, m) to (..., m)."""
    squares = signals * signals
    squares *= squares
    squares *= squares  # a power of eight takes ten times as long
    return squares.mean(axis=-2) ** 0.125


def _without(shares: np.ndarray, target: int) -> np.ndarray:
    """Sum of squares (...) of the shares (..., 12) of all couplings but one."""
    squares = shares**2
    return squares.sum(axis=-1) - squares[..., target]


@dataclass(frozen=True, eq=False)
class Objective:
    """Score of changes by which one coupling is to be reduced.

    Attributes
    ----------
    prediction : of the metrics
    target : place in `COUPLINGS`
    others : weight of the other couplings and of the effort

    """

    prediction: Prediction
    target: int
    others: float = OTHERS

    def value(self, x: np.ndarray) -> np.ndarray:
        """Score (...) of changes (..., 13)."""
        return self.of(self.prediction.metrics(x, (self.target,)))

    def of(self, metrics: Metrics) -> np.ndarray:
        """Score (...) of metrics: r^2 + others (o^2 + e^2) + 0.3 at_rest + 0.01 size.

        r is the largest magnitude of the target, the one ratio of the metrics, o the root sum
        square of the shares of all other couplings, e the root of the effort: each after by before.
        """
        before = self.prediction.before.shares
        rest = _without(metrics.shares, self.target) / (
            _without(before, self.target) + LEAST * (before @ before)
        )
        burden = AT_REST * metrics.at_rest + SIZE * metrics.size
        value = metrics.ratios[..., 0] ** 2 + self.others * (rest + metrics.effort) + burden
        return np.where(metrics.definite, value, IMPOSSIBLE)
