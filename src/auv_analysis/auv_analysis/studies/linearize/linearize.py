"""Linear models of a vehicle and of its closed loop: A, B, C, D of python-control and SciPy."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.scenario.scenario import Scenario
from auv_dynamics.plant.uncertainty import with_errors
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.kinematics import jacobian as kinematics
from auv_dynamics.vehicle.kinematics import quaternion
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_dynamics.vehicle.vehicle_file import load_vehicle
from auv_gvc_controller.control.sampled_law import (
    anti_windup,
    compiled_sample,
    fill_sample,
    is_compiled,
)
from auv_gvc_controller.laws.law import make_gains
from auv_gvc_controller.laws.model import ControlModel, control_model


def names(*groups: str) -> tuple[str, ...]:
    """Names of groups of six: 'nu[surge]', ...; python-control takes no dots in them."""
    return tuple(f'{group}[{dof}]' for group in groups for dof in DOFS)


def state_names(m: int) -> tuple[str, ...]:
    """phi, theta, nu and the m states of a law: 'law1[surge]' of the first block of six, ..."""
    own = [f'law{1 + i // 6}[{DOFS[i % 6]}]' if m % 6 == 0 else f'law[{i + 1}]' for i in range(m)]
    return ('phi', 'theta', *names('nu'), *own)


def relative(error: np.ndarray, values: np.ndarray) -> float:
    """Largest error relative to the largest entry of its row."""
    largest = np.abs(values).max(axis=1, keepdims=True)
    return float(np.max(error / np.where(largest > 0, largest, 1.0), initial=0.0))


@dataclass(frozen=True, eq=False, repr=False)
class Linearization:
    """x_dot = A x + B u, y = C x + D u about a point; unpacks as A, B, C, D.

    Attributes
    ----------
    A, B, C, D : (n, n), (n, k), (p, n), (p, k) in SI units
    states, inputs, outputs : names, such as 'phi', 'nu[surge]', 'law1[yaw]', 'tau[yaw]'
    x0, u0, y0 : (n,), (k,), (p,) the point
    drift : (n,) x_dot there; zero where the point is at rest, which a vehicle that turns while it
        is inclined is not
    error : largest error of a derivative of the law, relative to the largest entry of its row

    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    x0: np.ndarray
    u0: np.ndarray
    y0: np.ndarray
    drift: np.ndarray
    error: float

    def __iter__(self) -> Iterator[np.ndarray]:
        """A, B, C, D, so that `control.ss(*linearize(...))` works."""
        return iter((self.A, self.B, self.C, self.D))

    def __repr__(self) -> str:
        """Sizes, names and poles, in a few lines; the matrices are A, B, C and D."""
        groups = (
            ', '.join(dict.fromkeys(name.partition('[')[0] for name in named))
            for named in (self.states, self.inputs, self.outputs)
        )
        states, inputs, outputs = groups
        poles = np.round(np.sort_complex(np.linalg.eigvals(self.A))[::-1], 9) + 0.0
        shown = ', '.join(pole_text(pole.real, pole.imag) for pole in poles if pole.imag >= 0)
        return (
            f'<Linearization: A {self.A.shape}, B {self.B.shape}, C {self.C.shape}'
            f'\n states: {states}; inputs: {inputs}; outputs: {outputs}'
            f'\n poles, 1/s: {shown}>'
        )

    def __len__(self) -> int:
        """Four."""
        return 4

    def selected(self, inputs: Sequence[str], outputs: Sequence[str]) -> 'Linearization':
        """The same model with some groups of six of its inputs and outputs; ValueError: no such."""
        columns = _places(self.inputs, inputs, 'inputs')
        rows = _places(self.outputs, outputs, 'outputs')
        return replace(
            self,
            B=self.B[:, columns],
            C=self.C[rows],
            D=self.D[np.ix_(rows, columns)],
            inputs=tuple(self.inputs[i] for i in columns),
            outputs=tuple(self.outputs[i] for i in rows),
            u0=self.u0[columns],
            y0=self.y0[rows],
        )


def pole_text(real: float, imaginary: float) -> str:
    """A pole, and with it the one that is conjugate."""
    return f'{real:.4g}' + (f' ± {imaginary:.4g}i' if imaginary else '')


def _places(named: Sequence[str], groups: Sequence[str], what: str) -> list[int]:
    known = list(dict.fromkeys(name.partition('[')[0] for name in named))
    chosen = [groups] if isinstance(groups, str) else groups
    for group in chosen:
        if group not in known:
            raise ValueError(f'{what}: expected some of {", ".join(known)}, found {group!r}')
    return [6 * known.index(group) + i for group in chosen for i in range(6)]


STEP = 1e-5  # of m/s, rad/s, rad: rounding leaves ten digits of a law's gains


def jacobian(
    function: Callable[[np.ndarray], np.ndarray], at: np.ndarray, count: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Central differences over `STEP`, its half and quarter, extrapolated linearly to no step.

    Exact but for rounding where the function is quadratic on both sides of `at`, and so for every
    shipped law: central differences of abs(x) x are off by a multiple of the step at x = 0, which
    the extrapolation removes (Richardson; for a smooth function it leaves an error in step^2).

    Parameters
    ----------
    function : (K, n) to (K, m), points to values
    at : (n,) where
    count : k, of the first elements of `at` alone; None: all n

    Returns
    -------
    J : (m, k) derivatives
    error : (m, k) by how much the last two extrapolations differ

    """
    steps = np.array([STEP, STEP / 2, STEP / 4])
    moves = steps[:, None, None] * np.eye(len(at))[:count]  # (3, k, n)
    values = function(np.stack([at + moves, at - moves]).reshape(-1, len(at)))
    ahead, back = values.reshape(2, 3, moves.shape[1], -1)
    wide, half, quarter = (ahead - back) / (2 * steps[:, None, None])
    first, second = 2 * half - wide, 2 * quarter - half
    return second.T, np.abs(second - first).T


LEVEL = 1e-6  # distance of abs(theta) from pi/2 below which Euler angles are of no use
ATTITUDE, NU = slice(0, 2), slice(2, 8)


def plant_jacobian(
    vehicle: Vehicle, eta: np.ndarray, nu: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A and B of x_dot = A x + B (tau - F), x = (phi, theta, nu), exact but for rounding.

    C(nu) nu is homogeneous of degree 2, D(nu) nu = D_l nu + D_q abs(nu) nu + abs(u) lift nu has
    the derivative D_l + 2 D_q diag(abs(nu)) + abs(u) lift + sign(u) lift nu e_u^T, also at zero
    (at u = 0 with sideways velocity: the mean of either side), and g is a sinusoid in phi as in
    theta, whose derivative is half its difference over a quarter turn to either side.

    Parameters
    ----------
    vehicle : Vehicle
    eta : (6,) m (NED) and rad; abs(theta) below pi/2
    nu : (6,) m/s, rad/s

    Returns
    -------
    A : (8, 8) derivatives of (1) and of phi_dot, theta_dot of (2)
    B : (8, 6) zero above M^-1

    """
    C = vehicle.C(nu)
    turning = C + np.stack([vehicle.C(unit) @ nu for unit in np.eye(6)], axis=1)
    dragging = 2 * vehicle.D(nu) - vehicle.D_linear
    if vehicle.lift is not None:
        dragging -= abs(nu[0]) * vehicle.lift
        dragging[:, 0] += np.sign(nu[0]) * vehicle.lift @ nu
    turns = np.pi / 2 * np.eye(6)[3:5]
    restoring = np.stack([vehicle.g(eta + turn) - vehicle.g(eta - turn) for turn in turns], axis=1)
    A = np.zeros((8, 8))
    A[ATTITUDE, ATTITUDE] = _attitude_slope(eta, kinematics(eta) @ nu)
    A[ATTITUDE, NU] = kinematics(eta)[3:5]
    A[NU, ATTITUDE] = -np.linalg.solve(vehicle.M, restoring / 2)
    A[NU, NU] = -np.linalg.solve(vehicle.M, turning + dragging)
    B = np.zeros((8, 6))
    B[NU] = np.linalg.inv(vehicle.M)
    return A, B


def _attitude_slope(eta: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Derivatives of (phi_dot, theta_dot) of (2) by (phi, theta) at these Euler rates."""
    theta, (_, pitching, heading) = eta[4], rate[3:]
    cos = np.cos(theta)
    return np.array([[pitching * np.tan(theta), heading / cos], [-heading * cos, 0.0]])


ROUNDING = 1e-9
TRIALS = 20  # of Newton's method for the states in which a law holds a velocity


class LawAt:
    """A law around an attitude: y = (phi, theta, nu, its states, nu_d, nu_d_dot) to its answer.

    Parameters
    ----------
    gains : named tuple of the law's gains
    model : what the law knows of the vehicle
    psi : heading, rad

    """

    def __init__(self, gains: Any, model: ControlModel, psi: float):
        self._gains, self._model = gains, model
        # most of what is asked about an attitude leaves it as it is
        self._attitude = lru_cache(maxsize=8)(
            lambda phi, theta: tuple(quaternion(np.array([phi, theta, psi])).tolist())
        )
        self._guard = anti_windup(gains, None)
        self._sample = compiled_sample if is_compiled(gains) else fill_sample
        self.states = type(gains).STATES

    def answers(self, points: np.ndarray) -> np.ndarray:
        """(K, 6 + m) of (K, 20 + m): tau in N, N m, then rates of the law's m states, at t = 0."""
        m = self.states
        found = np.zeros((len(points), 6 + m))
        states = points[:, 8 : 8 + m].copy()
        for answer, state, y in zip(found, states, points.tolist(), strict=True):
            # a sample after no time at all: nothing is integrated
            tau, _ = self._sample(
                0.0, 0.0, tuple(y[2:8]), self._attitude(y[0], y[1]), tuple(y[8 + m : 14 + m]),
                tuple(y[14 + m :]), state, answer[6:], self._gains, self._model, self._guard,
            )  # fmt: skip
            answer[:6] = tau
        if not np.isfinite(found).all():
            wrong = found[~np.isfinite(found).all(axis=1)][0]
            raise ArithmeticError(f'the law gave what is not finite: {wrong}')
        return found

    def answer(self, y: np.ndarray) -> np.ndarray:
        """(6 + m,) of one point (20 + m,)."""
        return self.answers(y[None])[0]

    def jacobian(self, y: np.ndarray, count: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives (6 + m, 20 + m) of the answer, and their errors; by `count` of y alone."""
        return jacobian(self.answers, y, count)


def holding_point(law: LawAt, plant: Vehicle, eta: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """Argument of a law that holds nu: nu_d = nu, nu_d_dot = 0, states that balance the plant.

    Parameters
    ----------
    law : LawAt
    plant : Vehicle; where it is what the law knows, the states are zero
    eta, nu : (6,) m and rad, m/s and rad/s

    Returns
    -------
    y : (20 + m,) as `LawAt.answer` takes it

    Raises
    ------
    ArithmeticError : there are no such states

    """
    m = law.states
    needed = np.concatenate([plant.inverse_dynamics(eta, nu, np.zeros(6)), np.zeros(m)])
    y = np.concatenate([eta[3:5], nu, np.zeros(m), nu, np.zeros(6)])
    bound = ROUNDING * max(1.0, np.abs(needed).max())
    for _ in range(TRIALS):
        missing = needed - law.answer(y)
        if np.abs(missing).max() <= bound:
            return y
        slope, _ = law.jacobian(y, 8 + m)
        y[8 : 8 + m] += np.linalg.lstsq(slope[:, 8 : 8 + m], missing, rcond=None)[0]
    raise ArithmeticError(
        f'the law holds nu = {nu} in no state: {np.abs(missing).max():.3g} N or N m are missing'
    )


def linearize(
    vehicle: Vehicle | Scenario | str | Path,
    nu0: Sequence[float] | np.ndarray | None = None,
    *,
    law: str | None = None,
    gains: Mapping[str, Any] | None = None,
    controller: str | None = None,
    eta0: Sequence[float] | np.ndarray | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
) -> Linearization:
    """Linear model of the closed loop of a law, or of the vehicle alone, about a steady velocity.

    The states are phi and theta (Euler ZYX), nu, and those of the law. Position and heading are
    left out: nothing depends on them, they are integrals of the output (2). The law acts at every
    instant, as in `simulate(hold='continuous')`; nu_d = nu0 and tau are those that hold nu0.

    Parameters
    ----------
    vehicle : Vehicle, a vehicle file or the bare name of a shipped one; or a Scenario, whose
        model errors are the plant's and whose current must be none
    nu0 : (6,) m/s and rad/s, body frame; none: at rest
    law : name of a shipped one, or 'module:Class'; None: the vehicle alone, with input tau
    gains : of the law, each a number, 6 numbers or 6x6
    controller : of the scenario, in place of `law` and `gains`
    eta0 : (6,) m (NED) and rad; none: level
    inputs : groups of six, of 'nu_d', 'nu_d_dot' and 'F' (default 'nu_d', 'F'), without a law of
        'tau' and 'F' (default both). A step of nu_d alone is one whose nu_d_dot is zero; F, the
        lumped uncertainty in N and N m, opposes tau
    outputs : of 'nu' and 'tau' (default both), without a law of 'nu' alone

    Returns
    -------
    linearization : Linearization; the vehicle's derivatives are exact but for rounding, those of
        the law are central differences whose error it states

    Raises
    ------
    ValueError : unknown law, gain, controller or group, a wrong shape, theta at +-pi/2, a current
    ArithmeticError : the law holds nu0 in no state

    Equations (1), (2), with (16) to (22) for GVC.

    """
    known, plant, law, gains = _parts(vehicle, law, gains, controller)
    eta, nu = operating_point(eta0, 'eta0'), operating_point(nu0, 'nu0')
    if abs(np.cos(eta[4])) < LEVEL:
        raise ValueError(f'eta0: expected a pitch within +-pi/2, found {eta[4]:g}')
    if law is None:
        whole = _open_loop(plant, eta, nu)
        return whole.selected(inputs or ('tau', 'F'), outputs or ('nu',))
    whole = _closed_loop(
        plant, LawAt(make_gains(law, gains or {}), control_model(known), eta[5]), eta, nu
    )
    return whole.selected(inputs or ('nu_d', 'F'), outputs or ('nu', 'tau'))


def _parts(
    vehicle: Any, law: str | None, gains: Any, controller: str | None
) -> tuple[Vehicle, Vehicle, str | None, Any]:
    """What the law knows, the plant, the law and its gains."""
    if not isinstance(vehicle, Scenario):
        if controller is not None:
            raise ValueError('controller: expected a scenario beside it, found a vehicle')
        known = vehicle if isinstance(vehicle, Vehicle) else load_vehicle(vehicle)
        return known, known, law, gains
    if law is not None and controller is not None:
        raise ValueError('law: expected controller or law, found both')
    if vehicle.uncertainty.current is not None:
        raise ValueError('vehicle: expected a scenario in still water, found a current')
    if controller is not None:
        law, gains = vehicle.controller(controller)['law'], vehicle.gain_values(controller)
    return vehicle.vehicle, plant_of(vehicle), law, gains


def plant_of(scenario: Scenario) -> Vehicle:
    """The vehicle with the scenario's model errors."""
    errors = [spec for spec in scenario.data['disturbance'] if spec['kind'] == 'model_error']
    return with_errors(scenario.vehicle, errors)[0]


def operating_point(value: Any, name: str) -> np.ndarray:
    """(6,) of what was given, zero where nothing was; ValueError names it."""
    point = np.zeros(6) if value is None else np.array(value, float)
    if point.shape != (6,) or not np.isfinite(point).all():
        raise ValueError(f'{name}: expected 6 finite numbers, found {value}')
    return point


def _open_loop(plant: Vehicle, eta: np.ndarray, nu: np.ndarray) -> Linearization:
    A, B = plant_jacobian(plant, eta, nu)
    tau = plant.inverse_dynamics(eta, nu, np.zeros(6))
    return Linearization(
        A=A,
        B=np.hstack([B, -B]),
        C=np.eye(8)[NU],
        D=np.zeros((6, 12)),
        states=state_names(0),
        inputs=names('tau', 'F'),
        outputs=names('nu'),
        x0=np.concatenate([eta[3:5], nu]),
        u0=np.concatenate([tau, np.zeros(6)]),
        y0=nu,
        drift=np.concatenate([(kinematics(eta) @ nu)[3:5], np.zeros(6)]),
        error=0.0,
    )


def _closed_loop(plant: Vehicle, law: LawAt, eta: np.ndarray, nu: np.ndarray) -> Linearization:
    m = law.states
    n = 8 + m
    y = holding_point(law, plant, eta, nu)
    answer, (slope, error) = law.answer(y), law.jacobian(y)
    free, forced = plant_jacobian(plant, eta, nu)
    by_state, by_setpoint = slope[:, :n], slope[:, n:]
    # tau of the law enters the plant, its rates are the rest of x_dot
    through = np.block([[forced, np.zeros((8, m))], [np.zeros((m, 6)), np.eye(m)]])
    A = through @ by_state
    A[:8, :8] += free
    return Linearization(
        A=A,
        B=np.hstack([through @ by_setpoint, np.vstack([-forced, np.zeros((m, 6))])]),
        C=np.vstack([np.eye(n)[NU], by_state[:6]]),
        D=np.block([[np.zeros((6, 18))], [by_setpoint[:6], np.zeros((6, 6))]]),
        states=state_names(m),
        inputs=names('nu_d', 'nu_d_dot', 'F'),
        outputs=names('nu', 'tau'),
        x0=y[:n],
        u0=np.concatenate([y[n:], np.zeros(6)]),
        y0=np.concatenate([nu, answer[:6]]),
        drift=np.concatenate([(kinematics(eta) @ nu)[3:5], np.zeros(6), answer[6:]]),
        error=relative(error, slope),
    )
