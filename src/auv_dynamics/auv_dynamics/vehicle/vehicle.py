"""A vehicle's coefficients and the dynamics (1) as matrices, for people and for the kernel."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from auv_dynamics.kernel.compile import plain
from auv_dynamics.vehicle.kinematics import quaternion
from auv_dynamics.vehicle.model import (
    Model,
    acceleration,
    coriolis,
    damping,
    restoring,
)
from auv_dynamics.vehicle.thrusters import Thrusters


def skew(a: np.ndarray) -> np.ndarray:
    """S(a) with S(a) b = a x b: (..., 3) to (..., 3, 3); complex stays complex."""
    x, y, z = np.moveaxis(np.asarray(a), -1, 0)
    o = np.zeros_like(x)
    rows = [[o, -z, y], [z, o, -x], [-y, x, o]]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def rigid_body_matrix(
    mass: float | np.ndarray, r_G: np.ndarray, inertia: np.ndarray, reference: str
) -> np.ndarray:
    """M_RB about the body origin, Fossen 1994; any number of leading axes, complex stays complex.

    Parameters
    ----------
    mass : (...,) kg
    r_G : (..., 3) centre of gravity from the body origin, m
    inertia : (..., 3, 3) tensor, kg m2
    reference : 'cg' or 'co', the point about which the tensor is given

    Returns
    -------
    M_RB : (..., 6, 6) symmetric

    """
    S, m = skew(r_G), np.asarray(mass)[..., None, None]
    about_origin = inertia - m * S @ S if reference == 'cg' else inertia
    return np.block([[m * np.eye(3), -m * S], [m * S, about_origin]])


def munk_terms(M: np.ndarray) -> np.ndarray:
    """What inertia adds to SNAME's derivatives by u: coefficient (i, j) of u nu_j in -C(nu) nu.

    With the added mass of a torpedo alone, [5][1] is the Munk moment Y_vdot - X_udot, a part of a
    combined N_uv; column 0 is zero. (6, 6) of a symmetric M (6, 6).
    """
    flat, ahead, product = row_major(M), tuple(np.eye(6)[0]), plain(coriolis)
    columns = [
        -np.add(product(flat, ahead, tuple(unit)), product(flat, tuple(unit), ahead))
        for unit in np.eye(6)
    ]
    columns[0] = columns[0] / 2
    return np.stack(columns, axis=1)


def row_major(A: np.ndarray) -> np.ndarray:
    """Matrices (..., 6, 6) as the kernel takes them: (..., 36), copied."""
    return np.array(A, float).reshape(*np.shape(A)[:-2], 36)


def make_model(
    M: np.ndarray,
    D_linear: np.ndarray,
    D_quadratic: np.ndarray,
    hydrostatics: np.ndarray,
    lift: np.ndarray | None = None,
) -> Model:
    """Coefficients as the kernel takes them, with any number of leading axes.

    Parameters
    ----------
    M : (..., 6, 6) inertia with added mass, symmetric positive definite
    D_linear, D_quadratic : (..., 6, 6) positive damping; column j multiplies 1, abs(nu_j)
    hydrostatics : (..., 4) W - B in N, then W r_G - B r_B in N m
    lift : (..., 6, 6) positive lift of body and fins, which multiplies abs(u); None: none

    """
    return Model(
        M=row_major(M),
        M_inv=row_major(np.linalg.inv(M)),
        D_linear=row_major(D_linear),
        D_quadratic=row_major(D_quadratic),
        hydrostatics=np.array(hydrostatics, float),
        lift=None if lift is None else row_major(lift),
    )


@dataclass(frozen=True, eq=False)
class Vehicle:
    """A vehicle: parameters in the body frame forward-starboard-down, SI units.

    Of many vehicles, see `fleet`, every number has a leading axis.

    Attributes
    ----------
    name, source : from the file
    M : (6, 6) inertia with added mass, symmetric positive definite
    D_linear, D_quadratic : (6, 6) positive damping; column j of D_quadratic multiplies abs(nu_j)
    lift : (6, 6) positive lift of body and fins, which multiplies abs(u); None: none
    weight, buoyancy : N
    r_G, r_B : (3,) centres of gravity and buoyancy, m
    M_RB, M_A : (6, 6) rigid-body and added part of M, None where a file gives M itself
    warnings : what the loader found odd, one line each
    thrusters : the file's, None where it gives none

    """

    name: str
    source: str
    M: np.ndarray
    D_linear: np.ndarray
    D_quadratic: np.ndarray
    weight: Any
    buoyancy: Any
    r_G: np.ndarray
    r_B: np.ndarray
    M_RB: np.ndarray | None = None
    M_A: np.ndarray | None = None
    lift: np.ndarray | None = None
    warnings: tuple[str, ...] = field(default=())
    thrusters: Thrusters | None = None

    @cached_property
    def model(self) -> Model:
        """The coefficients as the kernel takes them."""
        weight, buoyancy = (np.asarray(force)[..., None] for force in (self.weight, self.buoyancy))
        couple = weight * self.r_G - buoyancy * self.r_B
        heavy = np.broadcast_to(weight - buoyancy, (*couple.shape[:-1], 1))
        hydrostatics = np.concatenate([heavy, couple], axis=-1)
        return make_model(self.M, self.D_linear, self.D_quadratic, hydrostatics, self.lift)

    def changed(self, **values: Any) -> 'Vehicle':
        """Vehicle with some attributes replaced; M_RB and M_A are dropped unless given."""
        return replace(self, **{'M_RB': None, 'M_A': None, **values})

    def C(self, nu: np.ndarray) -> np.ndarray:
        """C(nu) of (1), skew-symmetric: (6,) in m/s, rad/s to (6, 6)."""
        return _columns(lambda x: plain(coriolis)(self.model.M, tuple(nu), x))

    def D(self, nu: np.ndarray) -> np.ndarray:
        """D(nu) of (1), positive: (6,) in m/s, rad/s to (6, 6)."""
        return _columns(lambda x: plain(damping)(self.model, tuple(nu), x))

    def g(self, eta: np.ndarray) -> np.ndarray:
        """g(eta) of (1): (6,) in m (NED) and rad to (6,) in N, N m, body frame."""
        return np.array(plain(restoring)(self.model, tuple(quaternion(np.asarray(eta)[3:]))))

    def forward_dynamics(
        self, eta: np.ndarray, nu: np.ndarray, tau: np.ndarray, F: np.ndarray | None = None
    ) -> np.ndarray:
        """nu_dot of equation (1).

        Parameters
        ----------
        eta : (6,) position in m (NED) and Euler angles in rad
        nu : (6,) body velocity, m/s and rad/s
        tau : (6,) wrench, N and N m, body frame
        F : (6,) lumped uncertainty, N and N m; it opposes tau; none: zero

        Returns
        -------
        nu_dot : (6,) m/s2 and rad/s2, body frame

        """
        attitude = tuple(quaternion(np.asarray(eta)[3:]))
        F = np.zeros(6) if F is None else F
        return np.array(plain(acceleration)(self.model, attitude, tuple(nu), tuple(tau), tuple(F)))

    def inverse_dynamics(
        self, eta: np.ndarray, nu: np.ndarray, nu_dot: np.ndarray, F: np.ndarray | None = None
    ) -> np.ndarray:
        """Tau = M nu_dot + C(nu) nu + D(nu) nu + g(eta) + F, equation (1).

        Parameters
        ----------
        eta : (6,) position in m (NED) and Euler angles in rad
        nu : (6,) body velocity, m/s and rad/s
        nu_dot : (6,) body acceleration, m/s2 and rad/s2
        F : (6,) lumped uncertainty, N and N m; none: zero

        Returns
        -------
        tau : (6,) N and N m, body frame

        """
        nu = np.asarray(nu, float)
        tau = self.M @ nu_dot + self.C(nu) @ nu + self.D(nu) @ nu + self.g(eta)
        return tau if F is None else tau + F


def _columns(product: Callable[[tuple[float, ...]], Any]) -> np.ndarray:
    return np.array([product(tuple(unit)) for unit in np.eye(6)]).T
