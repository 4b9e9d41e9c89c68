"""What is right of the laws and of the plant that they do not know, for `test_signs`.

As in `sign_checks`: a check takes an implementation and raises AssertionError when it is wrong.
The closed loop (22) judges the paper's laws; the independent implementation in `reference`, whose
plant is written from Newton, Euler and Kirchhoff, judges the others and the plant.
"""

from typing import Any

import herman_reference as reference
import numpy as np
import yaml
from helpers.physics import attitude_of, turned, vehicle_of
from helpers.sign_checks import ATTITUDES, LIFT, NU, TAU, F, drawn, gradient, symmetric
from numpy.testing import assert_allclose

from auv_dynamics.files.shipped import shipped
from auv_dynamics.kernel.compile import plain
from auv_gvc_controller.laws.law import make_gains
from auv_gvc_controller.laws.model import control_model

REXROV = yaml.safe_load(shipped('vehicles', 'rexrov').read_text(encoding='utf-8'))
REXROV['lift'] = (500.0 * LIFT).tolist()
VEHICLE = vehicle_of(REXROV)
NU_D, NU_D_DOT, ETA = drawn(6), drawn(6), ATTITUDES[1]
GAINS = {
    'k_D': symmetric(3.0),
    'k_I': symmetric(2.0),
    'Lambda': symmetric(0.5),
    'Gamma': symmetric(7.0),
}
STATE = drawn(18)
OTHERS = {
    'pid': {'k_P': 300.0, 'k_I': 200.0, 'k_D': 100.0, 'omega_f': 5.0, 'k_FF': 0.5},
    'smc': {'k_D': 300.0, 'Lambda': 0.5, 'Gamma': 700.0, 'k_S': 90.0},
}
SPECS = [
    {'kind': 'model_error', 'mass': 0.1, 'added_mass': -0.2, 'damping': 0.3, 'buoyancy': 0.05},
    {'kind': 'model_error', 'dM': 40.0, 'dD': 20.0},
    {'kind': 'harmonic', 'surge': {'offset': 30.0}, 'yaw': {'offset': -20.0}},
]
FLOW = {
    'kind': 'current',
    'velocity': [0.3, -0.2, 0.1],
    'north': {'offset': 0.1, 'terms': [{'amplitude': 0.4, 'omega': 2.0, 'phase': 0.3}]},
    'east': {'terms': [{'amplitude': 0.3, 'omega': 3.0}]},
    'down': {'terms': [{'amplitude': -0.2, 'omega': 1.0, 'phase': 1.0}]},
}


def answer(law: Any, gains: Any, state: np.ndarray) -> tuple[np.ndarray, ...]:
    """(tau, f, rate) of a law at the state of these checks."""
    arguments = (0.0, tuple(NU), tuple(attitude_of(ETA[3:])), tuple(NU_D), tuple(NU_D_DOT),
                 state, gains, control_model(VEHICLE))  # fmt: skip
    tau, f = law.wrench(*arguments)
    return np.array(tau), np.array(f), np.array(law.state_rate(*arguments))


def check_law(name: str, law: Any) -> None:
    """f by (21), the rates that are integrated, and the closed loop (22) with any F.

    (22) for GVC; for CL the same with M for N, 1 for Upsilon, and gains that carry no N.
    """
    m = reference.vehicle_matrices(REXROV)
    k_D, k_I, Lambda, Gamma = GAINS.values()
    z, S, nu_err = STATE[:6], STATE[6:12], NU_D - NU
    tau, f, rate = answer(law, make_gains(name, GAINS), STATE[:12])
    U, N = reference.decompose(m['M'])
    if name == 'cl':
        U, N = np.eye(6), m['M']
    scaled = {'gvc': N, 'cl': np.eye(6)}[name]
    s = np.linalg.solve(U, nu_err + Lambda @ z)
    assert_allclose(U.T @ f, scaled @ Gamma @ S, rtol=1e-9)
    assert_allclose(rate, [*nu_err, *s], rtol=1e-10)

    C, D = reference.coriolis(m['M'], NU), reference.damping(m, NU)
    disturbed = 100.0 * F
    nu_dot = np.linalg.solve(m['M'], tau - C @ NU - D @ NU - gradient(REXROV, ETA) - disturbed)
    s_dot = np.linalg.solve(U, NU_D_DOT - nu_dot + Lambda @ nu_err)  # (20)
    damped = U.T @ (C + D) @ U + scaled @ k_D
    loop = N @ s_dot + damped @ s + U.T @ (k_I @ z + f - disturbed)
    assert_allclose(loop, np.zeros(6), atol=1e-9 * np.abs(tau).max())


def check_other_law(name: str, law: Any) -> None:
    """Wrench, f and rates of the independent implementation, with numbers and with matrices."""
    m = reference.vehicle_matrices(REXROV)
    full = {key: value * symmetric(1.0) for key, value in OTHERS[name].items()}
    layers = {'smc': [{'phi': 0.01}, {'phi': [40.0, 50.0, 60.0, 70.0, 80.0, 90.0]}]}.get(name, [{}])
    for layer in layers:
        values = full | layer
        size, at = reference.control_law(m, {'law': name, **values})
        state = STATE[:size]
        theirs = at(NU, NU_D, NU_D_DOT, gradient(REXROV, ETA))(state)
        tau, f, rate = answer(law, make_gains(name, values), state)
        assert_allclose(tau, theirs[0], rtol=1e-10)
        assert_allclose(rate, theirs[1], rtol=1e-10)
        assert_allclose(f, theirs[2], rtol=1e-10)


def check_multisine(law: Any) -> None:
    """The wrench by its sum, at any state and with a state that stays."""
    rows = np.array([drawn(36), drawn(36), drawn(36)]).reshape(3, 6, 6)
    offset, t = drawn(6), 0.7
    values = dict(zip(('amplitude', 'omega', 'phase'), rows.tolist(), strict=True))
    gains = make_gains('multisine', values | {'offset': offset.tolist()})
    expected = offset + (rows[0] * np.sin(rows[1] * t + rows[2])).sum(axis=1)
    for nu in (NU, 0.0 * NU):
        arguments = (t, tuple(nu), tuple(attitude_of(ETA[3:])), tuple(NU_D), tuple(NU_D_DOT),
                     STATE[:6], gains, control_model(VEHICLE))  # fmt: skip
        tau, f = law.wrench(*arguments)
        assert_allclose(tau, expected, rtol=1e-12)
        assert not any(f)
        assert not any(law.state_rate(*arguments))


def check_current(module: Any) -> None:
    """Acceleration in a current that varies, by Newton for the body and Kirchhoff for the water."""
    t, vehicle = 0.7, VEHICLE
    flow = module.make_current([FLOW])(np.array([t]))[0]
    assert_allclose(flow, np.concatenate(reference.current([FLOW], t)), rtol=1e-12)
    steady = reference.Plant(REXROV, [FLOW])
    for eta in ATTITUDES:
        q = attitude_of(eta[3:])
        truth = module.PlantModel(vehicle.model, vehicle.M_RB.ravel(), vehicle.model, False)
        found = plain(module.true_acceleration)(
            truth, tuple(q), tuple(NU), tuple(TAU), tuple(F), flow[None], 0
        )
        assert_allclose(plain(module.to_body)(tuple(q), tuple(F[:3])), turned(q).T @ F[:3])
        expected = steady.acceleration(t, turned(q), NU, TAU - F)
        assert_allclose(found, expected, rtol=1e-9)


def check_uncertainty(module: Any) -> None:
    """The plant's coefficients, and F as what is left of (1) with the vehicle file's."""
    vehicle, places = VEHICLE, [str(i) for i in range(len(SPECS))]
    made = module.make_uncertainty(vehicle, SPECS, 'scenario.yaml', places)
    true, known = reference.plant_matrices(REXROV, SPECS[:2]), reference.vehicle_matrices(REXROV)
    for key in ('M', 'D_linear', 'D_quadratic', 'lift'):
        assert_allclose(np.reshape(getattr(made.truth.model, key), (6, 6)), true[key], rtol=1e-12)
    couple = true['W'] * true['r_G'] - true['B'] * true['r_B']
    assert_allclose(made.truth.model.hydrostatics, [true['W'] - true['B'], *couple], rtol=1e-9)
    external = made.F(np.zeros(1))[0]
    q, tau = attitude_of(ETA[3:]), 900.0 * TAU
    nu_dot = reference.Plant(REXROV, SPECS).acceleration(0.0, turned(q), NU, tau)
    still = np.zeros((0, 6))
    given = made.truth, tuple(q), tuple(NU), tuple(tau), tuple(external)
    assert_allclose(plain(module.true_acceleration)(*given, still, 0), nu_dot, rtol=1e-8)
    found = plain(module.lumped)(*given, tuple(nu_dot))
    used = known['M'] @ nu_dot + reference.kirchhoff(known['M'], NU)
    used += reference.damping(known, NU) @ NU + gradient(REXROV, ETA)
    assert_allclose(found, tau - used, rtol=1e-8)
