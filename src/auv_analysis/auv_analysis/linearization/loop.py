"""Linearisation of a vehicle and of its closed loop: A, B, C, D of python-control and SciPy."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.linearization.law import LawAt, holding_point
from auv_analysis.linearization.plant import LEVEL, NU, plant_jacobian
from auv_analysis.linearization.state_space import Linearization, names, relative, state_names
from auv_analysis.scenario import Scenario
from auv_dynamics.kinematics import jacobian as kinematics
from auv_dynamics.uncertainty import with_errors
from auv_dynamics.vehicle import Vehicle
from auv_dynamics.vehicle_file import load_vehicle
from auv_gvc_controller.laws import make_gains
from auv_gvc_controller.model import control_model


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
    law : 'gvc', 'cl', 'pid', 'smc' or 'module:Class'; None: the vehicle alone, with input tau
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
    eta, nu = _point(eta0, 'eta0'), _point(nu0, 'nu0')
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
    errors = [spec for spec in vehicle.data['disturbance'] if spec['kind'] == 'model_error']
    plant, _ = with_errors(vehicle.vehicle, errors)
    if controller is not None:
        law, gains = vehicle.controller(controller)['law'], vehicle.gain_values(controller)
    return vehicle.vehicle, plant, law, gains


def _point(value: Any, name: str) -> np.ndarray:
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
