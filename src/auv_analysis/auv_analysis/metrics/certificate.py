"""The certificate (23) to (28) of the error dynamics (22), evaluated on a run."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.metrics.settling import TRANSIENT
from auv_analysis.runs.run import BLOCK, Run, rows_of
from auv_gvc_controller.laws.law import make_gains
from auv_gvc_controller.laws.model import ControlModel

NODES = 9  # samples of a formula: its error is of order 8 in the step


def derivative(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Derivative at each sample of the polynomial through the nine samples about it.

    With a step h its error is h^8 / 630 times the ninth derivative, and up to h^8 / 9 times that
    at the four samples at either end, which have more of the nine on one side than on the other.
    A run of fewer has one polynomial through all its n samples, and an error of order n - 1.

    Parameters
    ----------
    t : (n,) s, increasing; steps may differ
    values : (n, ...)

    Returns
    -------
    rates : (n, ...) unit of the values per s; NaN where there is one sample only

    """
    values = np.asarray(values, float)
    n, here = len(t), np.arange(len(t))
    nodes = min(NODES, n)
    if nodes < 2:
        return np.full(values.shape, np.nan)
    first = np.clip(here - nodes // 2, 0, n - nodes)
    rates = np.zeros(values.shape)
    for node in (first + i for i in range(nodes)):
        # rate at `here` of the Lagrange polynomial that is 1 at `node` and 0 at the others; with
        # values taken relative to the one at `here`, that node itself contributes nothing
        rate = np.where(node == here, 0.0, 1.0)
        for other in (first + j for j in range(nodes)):
            ahead = np.where((other == here) | (other == node), 1.0, t - t[other])
            rate *= ahead / np.where(other == node, 1.0, t[node] - t[other])
        rates += (rate * (values[node] - values).T).T
    return rates


LAWS = ('gvc', 'cl')
ROUNDING = 1e-9  # relative to the largest: an entry or eigenvalue that is zero


@dataclass(frozen=True, eq=False)
class Certificate:
    """The certificate at each of n samples; s and w of GVC are s_xi and w_xi.

    Attributes
    ----------
    t : (n,) s
    s : (n, 6) of (19), m/s and rad/s
    z : (n, 6) of (17), m and rad
    w : (n, 6) of (22), N and N m
    L : (n,) of (23), J
    L_dot : (n,) measured, `derivative` of L, W
    dissipation : (n,) left side of (27), W
    drift : (n,) F_xi_dot^T (Gamma N)^-1 w of (26), what a changing F takes from L, W
    rho : (n,) of (28), W

    """

    t: np.ndarray
    s: np.ndarray
    z: np.ndarray
    w: np.ndarray
    L: np.ndarray
    L_dot: np.ndarray
    dissipation: np.ndarray
    drift: np.ndarray
    rho: np.ndarray

    def part(self, keep: Any) -> 'Certificate':
        """Certificate of the samples that an index, slice or mask of samples keeps."""
        return Certificate(*(getattr(self, entry.name)[keep] for entry in fields(self)))

    @property
    def identity(self) -> np.ndarray:
        """(n,) right side of (26), W."""
        return -self.dissipation - self.drift

    @property
    def bound(self) -> np.ndarray:
        """(n,) right side of (28), W."""
        return -self.dissipation + self.rho


class Form(NamedTuple):
    """U, A, B, G of a law as above, and its gains: (6, 6) each."""

    U: np.ndarray
    A: np.ndarray
    B: np.ndarray
    G: np.ndarray
    k_I: np.ndarray
    Lambda: np.ndarray
    Gamma: np.ndarray


def form_of(law: str, gains: Any, model: ControlModel) -> Form:
    """Matrices of the form that both laws share; ValueError for a law without certificate."""
    if law not in LAWS:
        raise ValueError(f'law: expected {" or ".join(LAWS)}, found {law!r}')
    k_D, k_I, Lambda, Gamma = (
        np.reshape(getattr(gains, name), (6, 6)) for name in ('k_D', 'k_I', 'Lambda', 'Gamma')
    )
    if law == 'cl':
        M = model.dynamics.M.reshape(6, 6)
        return Form(np.eye(6), M, k_D, Gamma, k_I, Lambda, Gamma)
    U, N = model.Upsilon.reshape(6, 6), np.diag(model.N)
    return Form(U, N, N @ k_D, Gamma @ N, k_I, Lambda, Gamma)


def certificate(
    t: np.ndarray,
    nu: np.ndarray,
    nu_d: np.ndarray,
    z: np.ndarray,
    disturbance: np.ndarray,
    disturbance_estimate: np.ndarray,
    law: str,
    gains: Any,
    model: ControlModel,
) -> Certificate:
    """Evaluate (23), (26) and (28) at every sample of a run, with F_xi = U^T F of (13).

    Parameters
    ----------
    t : (n,) s, increasing; steps may differ
    nu, nu_d : (n, 6) true velocity and set-point, m/s and rad/s, body frame
    z : (n, 6) integral of nu_d - nu as the law has it, m and rad
    disturbance, disturbance_estimate : (n, 6) F and f, N and N m, body frame
    law : 'gvc' or 'cl'
    gains : the law's named tuple
    model : what the law knows of the vehicle

    Returns
    -------
    certificate : NaN what does not exist: rates of a single sample, all that takes the inverse of
        a singular Gamma

    Raises
    ------
    ValueError : a law without certificate

    """
    form, dynamics = form_of(law, gains, model), model.dynamics
    x = nu_d - nu + z @ form.Lambda.T  # U s, a row per sample
    s = np.linalg.solve(form.U, x.T).T
    w = (disturbance_estimate - disturbance) @ form.U  # U^T (f - F)
    G_inv, norm = _inverse(form.G)
    drag = x @ dynamics.D_linear.reshape(6, 6).T
    drag += (np.abs(nu) * x) @ dynamics.D_quadratic.reshape(6, 6).T
    if dynamics.lift is not None:
        drag += (np.abs(nu[:, :1]) * x) @ dynamics.lift.reshape(6, 6).T  # D(nu) x
    L = 0.5 * (_quadratic(s, form.A, s) + _quadratic(z, form.k_I, z) + _quadratic(w, G_inv, w))
    rates = derivative(t, np.column_stack([disturbance, L]))
    F_dot = rates[:, :6] @ form.U  # U^T F_dot
    return Certificate(
        t=t,
        s=s,
        z=z,
        w=w,
        L=L,
        L_dot=rates[:, 6],
        dissipation=(x * drag).sum(axis=1)
        + _quadratic(s, form.B, s)
        + _quadratic(z, form.Lambda @ form.k_I, z),
        drift=_quadratic(F_dot, G_inv, w),
        rho=norm * size(F_dot) * size(w),
    )


def sampled_integral(
    t: np.ndarray, nu_err: np.ndarray, start: np.ndarray | None = None
) -> np.ndarray:
    """Z of a law under zero-order hold: z_0 = 0, z_k = z_{k-1} + (t_k - t_{k-1}) nu_err_{k-1}.

    Parameters
    ----------
    t : (n,) s
    nu_err : (n, 6) nu_d - nu as the law saw it, m/s and rad/s
    start : (6,) z at the first sample, of a part that is not the beginning; None: zero

    Returns
    -------
    z : (n, 6) m and rad; equation (17)

    """
    steps = np.zeros(np.shape(nu_err))
    np.multiply(np.diff(t)[:, None], nu_err[:-1], out=steps[1:])
    if start is not None:
        steps[0] = start
    return np.cumsum(steps, axis=0)


def _inverse(G: np.ndarray) -> tuple[np.ndarray, float]:
    """G^-1 and its spectral norm: lambda_max(G^-1) where G is symmetric positive definite."""
    sizes = np.linalg.svd(G, compute_uv=False)
    if sizes[-1] <= ROUNDING * sizes[0]:
        return np.full(G.shape, np.nan), np.nan
    return np.linalg.inv(G), 1.0 / sizes[-1]


def _quadratic(a: np.ndarray, matrix: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a^T matrix b of each row."""
    return ((a @ matrix) * b).sum(axis=1)


def size(a: np.ndarray) -> np.ndarray:
    """Euclidean norm of each row."""
    return np.linalg.norm(a, axis=1)


BOUND_TOLERANCE = 1e-6  # of max abs((26)): allows for truncation in the measured L_dot
MARGIN = NODES - 1  # samples about a block with which its derivatives are those of the whole run
SPARSE = 1.5  # steps: samples that are further apart are not all that the law had
KEPT = 1 << 16  # samples outside the bound, as far as one can say before the end
SHARES = ('share_of_time_increasing', 'share_condition_27', 'share_bound_28')
FIGURES = (
    'identity_residual', 'identity_residual_rms', 'identity_residual_after_2s', *SHARES,
    'sup_s', 'sup_z', 'sup_w', 'L_first', 'L_last', 'rho_max',
)  # fmt: skip


def integral_of(run: Run, start: np.ndarray | None = None) -> np.ndarray | None:
    """Z of (17) as the law has it, (n, 6) in m and rad; None where it is not known.

    A bag does not hold it: there it follows from what the law saw, unless anti-windup may have
    stopped it at the limits of actuators.

    Parameters
    ----------
    run : a run or a part of one
    start : (6,) z at the first sample of a part that is not the beginning

    """
    if run.law in LAWS and run.law_state is not None:
        return run.law_state[:, :6]
    if run.applied is not None or 'applied' in run.unrecorded or run.hold != 'zoh':
        return None
    return sampled_integral(run.t, run.nu_d - run.nu_measured, start)


def why_unknown(run: Run) -> str:
    """Why z of a law is not known: it had integrated before the first sample, or began anew."""
    if run.law_state is not None:
        return ''
    parts = (slice(i, i + BLOCK) for i in range(0, len(run.t), BLOCK))
    f = (rows_of(run.disturbance_estimate, part) for part in parts)
    adapted = np.concatenate([(np.abs(rows) > 0.0).any(axis=1) for rows in f])
    if run.start > 0.0 or adapted[0]:
        return 'the law had begun before the first sample: z is not known'
    if not run.gaps and np.diff(rows_of(run.t, slice(None))).max(initial=0.0) > SPARSE * run.step:
        return 'samples of the law are missing: z is not known'
    anew = np.any(adapted[:-1] & ~adapted[1:])
    return 'the law began anew within the run: z is not known' if anew else ''


def certificate_blocks(run: Run, model: ControlModel, rows: int = BLOCK) -> Iterator[Certificate]:
    """Certificate of each block of a run of one of the `LAWS` with known gains.

    Parameters
    ----------
    run : the run
    model : what the law knows of the vehicle
    rows : samples of a block

    Yields
    ------
    certificate : the same numbers that `certificate` gives for the whole run; NaN what follows
        from a z or F that is not known

    """
    gains = make_gains(run.law, run.gains)
    start, late = None, why_unknown(run)
    for wide, inside in run.wide_blocks(MARGIN, rows):
        unknown = np.full(wide.nu.shape, np.nan)
        z = None if late else integral_of(wide, start)
        start = None if z is None else z[max(inside.stop - MARGIN, 0)]  # where the next one begins
        F, f = wide.disturbance, wide.disturbance_estimate
        z, F = unknown if z is None else z, unknown if F is None else F
        found = certificate(wide.t, wide.nu, wide.nu_d, z, F, f, run.law, gains, model)
        yield found.part(inside)


class CertificateFigures:
    """Figures of a certificate that comes in blocks.

    Parameters
    ----------
    start : time of the run's first sample, s
    largest : max abs((26)) of the whole run, where it is known beforehand

    Attributes
    ----------
    unsettled : whether `largest` must be known beforehand to count where the bound holds: before
        the last block it is not, and samples about which nothing can be said yet are kept, but
        not any number of them

    """

    def __init__(self, start: float, largest: float | None = None):
        self._late = start + TRANSIENT - 1e-9
        self._known, self.unsettled = largest, False
        self._count = self._increasing = self._condition = 0
        self._squares = np.zeros(2)  # of the residual and of (26)
        self._largest, self._late_largest = np.zeros(2), np.zeros(2)
        self._beyond = np.zeros((2, 0))  # L_dot and (28) where the bound may not hold
        self._broken = 0  # samples where it does not
        self._figures: dict[str, float] = {}

    def add(self, found: Certificate) -> None:
        """Take in the next block, of one sample at least."""
        pair = np.array([found.L_dot - found.identity, found.identity])
        self._count += len(found.t)
        self._squares += (pair**2).sum(axis=1)
        self._largest = np.maximum(self._largest, np.abs(pair).max(axis=1))
        late = np.abs(pair[:, found.t >= self._late]).max(axis=1, initial=0.0)
        self._late_largest = np.maximum(self._late_largest, late)
        self._increasing += int(np.count_nonzero(found.identity > 0))
        self._condition += int(np.count_nonzero(found.dissipation >= np.abs(found.drift)))
        self._compare(np.array([found.L_dot, found.bound]))
        peaks = {f'sup_{name}': size(getattr(found, name)).max() for name in ('s', 'z', 'w')}
        peaks['rho_max'] = found.rho.max()
        for name, peak in peaks.items():
            self._figures[name] = np.maximum(self._figures.get(name, peak), peak)
        self._figures.setdefault('L_first', found.L[0])
        self._figures['L_last'] = found.L[-1]

    def _compare(self, rates: np.ndarray) -> None:
        """Compare L_dot and (28), (2, n)."""
        if self._known is not None:
            self._broken += _outside(rates, self._known).shape[1]
        elif not self.unsettled and np.isfinite(self.largest):
            rates = np.concatenate([self._beyond, rates], axis=1)
            self._beyond = _outside(rates, self.largest)
            self.unsettled = self._beyond.shape[1] > KEPT
            self._broken = self._beyond.shape[1]

    @property
    def largest(self) -> float:
        """Largest magnitude of (26) so far, W."""
        return float(self._largest[1])

    def result(self) -> dict[str, float | None]:
        """Figures by name; those that are not finite, or do not exist, are None or left out."""
        figures = dict(self._figures)
        residual, largest = self._largest
        if np.isfinite(largest):
            counts = self._increasing, self._condition, self._count - self._broken
            figures |= {k: n / self._count for k, n in zip(SHARES, counts, strict=True)}
        if largest > 0:
            figures['identity_residual'] = residual / largest
            figures['identity_residual_rms'] = np.sqrt(self._squares[0] / self._squares[1])
        late_residual, late_largest = self._late_largest
        if late_largest > 0:
            figures['identity_residual_after_2s'] = late_residual / late_largest
        return {name: float(x) if np.isfinite(x) else None for name, x in figures.items()}


def as_figures(
    certificates: Callable[[], Iterator[Certificate]], start: float
) -> dict[str, float | None]:
    """Figures of a run.

    Parameters
    ----------
    certificates : goes through the certificates of its blocks, from the beginning
    start : time of its first sample, s

    """
    figures = CertificateFigures(start)
    for found in certificates():
        figures.add(found)
    if figures.unsettled:
        figures = CertificateFigures(start, figures.largest)
        for found in certificates():
            figures.add(found)
    return figures.result()


def _outside(rates: np.ndarray, largest: float) -> np.ndarray:
    """Those columns of L_dot and (28) between which the bound does not hold."""
    return rates[:, ~(rates[0] <= rates[1] + BOUND_TOLERANCE * largest)]
