"""What is right, known from elsewhere than the code: one check per formula of the kernel.

A check takes an implementation and raises AssertionError when it is wrong. It compares with
numbers that others have published, with the gradient of the potential, Newton for particles,
the turning of momentum, matrices written out, or the closed loop (22).
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import herman_reference as reference
import numpy as np
import pytest
from helpers.physics import (
    DENSE_C_NU,
    DENSE_M_A,
    DENSE_NU,
    G_ETA,
    R_ANGLES,
    G,
    R,
    T,
    attitude_of,
    diagonal_C,
    particle_wrench,
    particles,
    potential_gradient,
    turned,
    with_inertia,
)
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics import load_vehicle
from auv_dynamics.kernel.compile import plain
from auv_dynamics.vehicle.model import Model

DRAWN = np.random.default_rng(6)


def drawn(*shape: int) -> np.ndarray:
    """Generic numbers, none of them near zero."""
    values = DRAWN.uniform(0.2, 1.0, shape)
    return values * DRAWN.choice([-1.0, 1.0], shape)


def symmetric(size: float) -> np.ndarray:
    A = drawn(6, 6)
    return size * (np.eye(6) + A @ A.T / 6)


DENSE = symmetric(50.0)  # every entry couples
X, NU, NU_DOT, TAU, F = (drawn(6) for _ in range(5))
D_LINEAR, D_QUADRATIC, FULL, LIFT = (drawn(6, 6) for _ in range(4))
ATTITUDES = [G_ETA, np.array([0, 0, 0, 0.7, 0.4, -2.0]), np.array([0, 0, 0, -2.5, -1.1, 0.9])]


def model_of(M: np.ndarray, data: dict | None = None) -> Model:
    """The kernel's coefficients, without a Vehicle between."""
    m = reference.vehicle_matrices(data or with_inertia(M))
    couple = m['W'] * m['r_G'] - m['B'] * m['r_B']
    heavy = np.array([m['W'] - m['B'], *couple])
    drag = D_LINEAR.ravel(), D_QUADRATIC.ravel()
    return Model(M.ravel(), np.linalg.inv(M).ravel(), *drag, heavy, LIFT.ravel())


def right_side(M: np.ndarray, eta: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """C nu + D nu + g (6,) with the coefficients of `model_of`."""
    return reference.kirchhoff(M, nu) + D(nu) @ nu + gradient(with_inertia(M), eta)


def D(nu: np.ndarray) -> np.ndarray:
    return D_LINEAR + D_QUADRATIC * np.abs(nu) + LIFT * abs(nu[0])


def gradient(data: dict, eta: np.ndarray) -> np.ndarray:
    return reference.jacobian(eta).T @ potential_gradient(data, eta)


def check_C(coriolis: Callable) -> None:
    """Published entries of C, published C nu, skewness, and momentum."""
    M, nu = np.diag(np.arange(1.0, 7.0)).ravel(), tuple(range(1, 7))
    C = np.array([coriolis(M, nu, tuple(unit)) for unit in np.eye(6)]).T
    assert_array_equal(C, diagonal_C())
    found = coriolis(DENSE_M_A.ravel(), tuple(DENSE_NU), tuple(DENSE_NU))
    assert_allclose(found, DENSE_C_NU, atol=1e-12)
    found = coriolis(DENSE.ravel(), tuple(NU), tuple(NU))
    assert_allclose(found, reference.kirchhoff(DENSE, NU), rtol=1e-12)
    assert abs(X @ coriolis(DENSE.ravel(), tuple(NU), tuple(X))) < 1e-12


def check_D(damping: Callable) -> None:
    """Written out as matrices, ahead and astern; and a diagonal one only takes energy."""
    for nu in (NU, -NU):
        found = damping(model_of(DENSE), tuple(nu), tuple(X))
        assert_allclose(found, D(nu) @ X, rtol=1e-12)
    takes = Model(*model_of(DENSE)[:2], np.eye(6).ravel(), 3.0 * np.eye(6).ravel(), np.zeros(4))
    for x in np.vstack([np.eye(6), [X]]):
        assert x @ damping(takes, tuple(NU), tuple(x)) >= x @ x


def check_g(restoring: Callable) -> None:
    """Published g, and the gradient of the potential."""
    data = with_inertia(DENSE_M_A)
    model = model_of(DENSE_M_A, data)
    assert_allclose(restoring(model, tuple(attitude_of(G_ETA[3:]))), G, atol=1e-8)
    for eta in ATTITUDES:
        found = restoring(model, tuple(attitude_of(eta[3:])))
        assert_allclose(found, gradient(data, eta), rtol=1e-10)


def check_couple(vehicle: Any) -> None:
    """W - B and W r_G - B r_B of the published g, and g itself."""
    assert_allclose(vehicle.model.hydrostatics, [-10.0, 6.1, 6.0, 15.2], rtol=1e-12)
    assert_allclose(vehicle.g(G_ETA), G, atol=1e-8)


def published_vehicle(vehicle_class: Any) -> Any:
    zero = np.zeros((6, 6))
    r_G, r_B = np.array([0.01, 0.02, 0.03]), np.array([-0.01, 0.0, -0.02])
    return vehicle_class('v', '', DENSE, zero, zero, 300.0, 310.0, r_G, r_B)


def check_M(module: Any) -> None:
    """Newton for particles, whichever the point about which the inertia is given."""
    second, r_G, mass = DENSE[:3, :3], np.array([0.3, -0.2, 0.1]), 7.0
    inertia = np.trace(second) * np.eye(3) - second
    size, places = particles(mass, r_G, inertia)
    newton = [particle_wrench(size, places, np.zeros(6), unit) for unit in np.eye(6)]
    found = module.rigid_body_matrix(mass, r_G, inertia, 'cg')
    assert_allclose(found, np.transpose(newton), atol=1e-12)
    about_origin = found[3:, 3:]
    assert_allclose(module.rigid_body_matrix(mass, r_G, about_origin, 'co'), found, atol=1e-12)


def check_J(module: Any) -> None:
    """Published R and T, turning by the rates, and angles there and back."""
    assert_allclose(module.rotation(module.quaternion(R_ANGLES)), R, atol=1e-9)
    assert_allclose(module.quaternion(R_ANGLES), attitude_of(R_ANGLES), rtol=1e-14)
    J = module.jacobian(np.array([0, 0, 0, *R_ANGLES]))
    assert_allclose(J, np.block([[R, np.zeros((3, 3))], [np.zeros((3, 3)), T]]), atol=1e-9)
    for eta in ATTITUDES:
        q = attitude_of(eta[3:])
        assert_allclose(module.rotation(q), turned(q), rtol=1e-12, atol=1e-15)
        rate = plain(module.position_rate)(tuple(q), tuple(NU))
        assert_allclose(rate, turned(q) @ NU[:3], rtol=1e-12)
        q_dot = np.array(plain(module.attitude_rate)(tuple(q), tuple(NU)))
        turning = np.imag(turned(q + 1e-30j * q_dot)) / 1e-30
        assert_allclose(turning, turned(q) @ reference.skew(NU[3:]), atol=1e-14)  # R S(omega)
        assert_allclose(module.euler(q), eta[3:], rtol=1e-12)
    for theta in (np.pi / 2, -np.pi / 2):
        q = attitude_of([0.4, theta, -1.1])
        angles = module.euler(q)
        assert angles[0] == 0.0
        assert_allclose(turned(attitude_of(angles)), turned(q), atol=1e-7)


def check_U(module: Any) -> None:
    """Factors written down, whose product is made of whole numbers; and the printed N (38)."""
    U_inv = np.triu(np.arange(1.0, 37.0).reshape(6, 6) % 5 - 2.0, 1) + np.eye(6)
    N = np.array([2.0, 3.0, 5.0, 7.0, 11.0, 13.0])
    Upsilon, found = module.decompose(U_inv.T @ np.diag(N) @ U_inv)
    assert_allclose(found, N, rtol=1e-10)
    assert_allclose(Upsilon @ U_inv, np.eye(6), atol=1e-9)
    assert_allclose(module.inverse_upper(U_inv) @ U_inv, np.eye(6), atol=1e-12)
    Upsilon, found = module.decompose(load_vehicle('herman2018').M)
    assert_allclose(found, [300.0, 500.0, 500.0, 40.0, 175.5, 141.1], atol=0.05)
    xi = np.linalg.solve(Upsilon, [0, 0, 0, 0, 1.0, 0])  # delta_xi: 0.025 q and -0.075 q
    assert_allclose(xi, [0.025, 0.0, -0.075, 0.0, 1.0, 0.0], atol=1e-12)
    fleet = np.array([DENSE, U_inv.T @ np.diag(N) @ U_inv, 2.0 * DENSE])
    for one, M in zip(np.swapaxes(module.decompose(fleet)[0], 1, 2), fleet, strict=True):
        assert_allclose(one @ M @ one.T, np.diag(module.decompose(M)[1]), atol=1e-9)
    for skewed in (DENSE + np.triu(np.ones((6, 6)), 1), fleet + np.triu(np.ones((6, 6)), 1)):
        with pytest.raises(ValueError, match='expected a symmetric M'):
            module.decompose(skewed)


def check_algebra(module: Any) -> None:
    """Products of 6-vectors against numpy."""
    A, U = FULL, np.triu(FULL, 1) + np.eye(6)
    x, y = tuple(X), tuple(NU)
    assert_allclose(plain(module.matvec)(A.ravel(), x), A @ X, rtol=1e-12)
    assert_allclose(plain(module.upper)(U.ravel(), x), U @ X, rtol=1e-12)
    assert_allclose(plain(module.upper_T)(U.ravel(), x), U.T @ X, rtol=1e-12)
    assert_allclose(plain(module.add)(x, y), X + NU)
    assert_allclose(plain(module.sub)(x, y), X - NU)
    row, copy = np.arange(20.0), np.zeros(20)
    assert_array_equal(plain(module.vector)(row, 9), row[9:15])
    plain(module.fill_vector)(copy, 9, x)
    assert_array_equal(copy[9:15], X)
    assert not copy[:9].any()
    assert not copy[15:].any()


def check_F(acceleration: Callable) -> None:
    """Newton's equation (1): what tau does not spend accelerates; F resists it."""
    for eta in ATTITUDES:
        arguments = model_of(DENSE), tuple(attitude_of(eta[3:])), tuple(NU), tuple(TAU)
        nu_dot = np.array(acceleration(*arguments, tuple(F)))
        spent = DENSE @ nu_dot + right_side(DENSE, eta, NU) + F
        assert_allclose(spent, TAU, atol=1e-10)
        freed = np.array(acceleration(*arguments, (0.0,) * 6)) - nu_dot
        assert F @ freed > 0.0


def check_inverse(vehicle: Any) -> None:
    """Equation (1) read the other way; no damping in this vehicle."""
    for eta in ATTITUDES:
        tau = vehicle.inverse_dynamics(eta, NU, NU_DOT, F)
        g = gradient(with_inertia(DENSE), eta)
        assert_allclose(tau, DENSE @ NU_DOT + reference.kirchhoff(DENSE, NU) + g + F, rtol=1e-10)
        damped = type(vehicle)(
            'v', '', DENSE, D_LINEAR, D_QUADRATIC, 300.0, 310.0, vehicle.r_G, vehicle.r_B
        )
        drag = damped.inverse_dynamics(eta, NU, NU_DOT, F) - tau
        assert_allclose(drag, (D_LINEAR + D_QUADRATIC * np.abs(NU)) @ NU, rtol=1e-9)


class Growth(NamedTuple):
    """x_dot = x cos t, so that x = e^(sin t): the rate depends on the time of each stage."""

    t: np.ndarray

    @staticmethod
    def fill_rate(system, stage, x, rate):
        rate[0] = x[0] * np.cos(system.t[stage])


def check_step(module: Any) -> None:
    """Growth over 2 s: each method within an error that its order allows; times of stages."""
    step = 0.04
    for name, largest in (('ode5', 1e-10), ('rk4', 1e-6), ('euler', 0.1)):
        tableau, x = module.TABLEAUS[name], np.ones(1)
        stages = np.zeros((len(tableau.b), 1))
        for t in module.stage_times(tableau, step, 0, 50):
            plain(module.fill_step)(Growth(t), x, step, tableau, stages, np.zeros(1))
        assert abs(x[0] - np.exp(np.sin(2.0))) < largest
    late = module.stage_times(module.TABLEAUS['ode5'], 0.5, 3, 2)
    assert_allclose(late[:, 0], [1.5, 2.0])
    assert late[0, 1] == pytest.approx(1.6)


def check_frames(module: Any) -> None:
    """North and east, starboard and port, down and up; R becomes E R S; a diagonal of signs."""
    E, signs = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]]), np.array([1, -1, -1, 1, -1, -1])
    assert_array_equal(module.swap_position(X[:3]), E @ X[:3])
    assert_array_equal(module.swap_body(X), signs * X)
    assert_array_equal(module.swap_body_matrix(FULL), np.diag(signs) @ FULL @ np.diag(signs))
    S = np.diag(signs[:3])
    assert_array_equal(module.swap_inertia(FULL[:3, :3]), S @ FULL[:3, :3] @ S)
    for eta in ATTITUDES:
        q = attitude_of(eta[3:])
        there = module.swap_attitude(q)
        assert_allclose(turned(there), E @ turned(q) @ S, atol=1e-14)
        x = module.swap_state(np.concatenate([X[:3], q, NU]))
        assert_array_equal(x, [*(E @ X[:3]), *there, *(signs * NU)])
