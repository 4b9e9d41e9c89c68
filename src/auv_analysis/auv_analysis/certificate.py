"""The Lyapunov certificate (23) to (28), evaluated on a run.

Both laws have one form, with s = U^-1 (nu_err + Lambda z) and w = U^T (f - F)::

    law   U        A   B      G        H
    gvc   Upsilon  N   N k_D  Gamma N  N Gamma
    cl    I        M   k_D    Gamma    Gamma

    A s_dot + [U^T (C + D) U + B] s + U^T k_I z + w = 0,  w_dot = H s - U^T F_dot          (22)
    L = 1/2 s^T A s + 1/2 z^T k_I z + 1/2 w^T G^-1 w                                       (23)
    L_dot = -(U s)^T D (U s) - s^T B s - z^T Lambda k_I z - (U^T F_dot)^T G^-1 w           (26)
    L_dot <= the same with +rho for its last term, rho = |G^-1| |U^T F_dot| |w|            (28)

Why (26) holds: s^T U^T C U s = 0 because C is skew. U s = nu_err + Lambda z gives
-s^T U^T k_I z = -nu_err^T k_I z - z^T Lambda^T k_I z, whose first part cancels the derivative of
1/2 z^T k_I z when k_I is symmetric, and whose second is that of (26) when Lambda is symmetric
(Lambda k_I need not be). -s^T w cancels w^T G^-1 H s for every s and w exactly when the symmetric
part of G^-1 is H^-1. For CL that is a symmetric Gamma. For GVC it is N Gamma = Gamma N and Gamma
symmetric: Gamma is diagonal, or couples nothing but axes of equal N, although the theorem admits
every positive definite Gamma. k_D and D may be asymmetric, only their quadratic forms occur.

(26) is an identity along solutions, not a decrease: F_dot may raise L.
"""

from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.differences import derivative
from auv_gvc_controller.model import ControlModel

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
