"""The plant beyond its vehicle file: model errors, currents, and F by its definition."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from helpers.plants import plant_of, push
from helpers.strategies import QUICK, attitudes, full, vectors, vehicles
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.plant.plant import initial_state
from auv_dynamics.plant.uncertainty import make_uncertainty
from auv_dynamics.vehicle.kinematics import quaternion, rotation
from auv_dynamics.vehicle.vehicle import skew
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict

STEP = 1e-3
TAU = np.array([300.0, -100.0, 200.0, 20.0, -30.0, 40.0])
ERRORS = {'kind': 'model_error', 'mass': 0.05, 'added_mass': -0.2, 'damping': 0.3, 'buoyancy': 0.1}


def cross6(nu: np.ndarray) -> np.ndarray:
    """Dual twist of (1): d/dt momentum = -cross6(nu) momentum + force."""
    return np.block([[skew(nu[3:]), np.zeros((3, 3))], [skew(nu[:3]), skew(nu[3:])]])


def momentum_balance(
    vehicle: Any, specs: Sequence[dict], eta: np.ndarray, nu: np.ndarray, tau: np.ndarray
) -> np.ndarray:
    """nu_dot of the true vehicle, by Kirchhoff's equations in place of C(nu) nu."""
    error: dict[str, Any] = dict.fromkeys(
        ('mass', 'added_mass', 'damping', 'buoyancy', 'dM', 'dD'), 0
    )
    v_c = np.zeros(3)
    for spec in specs:
        if spec['kind'] == 'model_error':
            for key in set(spec) - {'kind'}:
                error[key] = error[key] + (full(spec[key]) if key in ('dM', 'dD') else spec[key])
        if spec['kind'] == 'current':
            v_c = v_c + np.array(spec['velocity'])
    M_RB, M_A = vehicle.M_RB * (1 + error['mass']), vehicle.M_A * (1 + error['added_mass'])
    M_A = M_A + error['dM']
    R = rotation(quaternion(eta[3:]))
    c = np.concatenate([R.T @ v_c, np.zeros(3)])
    nu_r = nu - c
    c_dot = np.concatenate([-np.cross(nu[3:], c[:3]), np.zeros(3)])
    lift = np.zeros((6, 6)) if vehicle.lift is None else abs(nu_r[0]) * vehicle.lift
    D = vehicle.D_linear + vehicle.D_quadratic * np.abs(nu_r) + lift
    D = D * (1 + error['damping']) + error['dD']
    W, B = vehicle.weight * (1 + error['mass']), vehicle.buoyancy * (1 + error['buoyancy'])
    down = R[2]
    force, moment = (W - B) * down, np.cross(W * vehicle.r_G - B * vehicle.r_B, down)
    inertial = cross6(nu) @ M_RB @ nu  # body: through space
    water = cross6(nu_r) @ M_A @ nu_r - M_A @ c_dot  # water: through the water
    rest = tau - D @ nu_r + np.concatenate([force, moment]) - inertial - water
    return np.linalg.solve(M_RB + M_A, rest)


def observed(vehicle: Any, specs: list[dict], eta: np.ndarray, nu: np.ndarray) -> tuple:
    """nu_dot by a difference over one tiny step of the plant, and F there."""
    step = 1e-6
    plant = plant_of(vehicle, specs, step, 'ode5', initial_state(eta, nu))
    _, F = push(plant, TAU)
    return (plant.x[7:] - nu) / step, np.array(F)


@st.composite
def error_lists(draw: st.DrawFn) -> list[dict]:
    small = st.floats(-0.3, 0.3)
    keys = ('mass', 'added_mass', 'damping', 'buoyancy')
    listed: list[dict] = [
        {'kind': 'model_error', **{key: draw(small) for key in keys}}
        for _ in range(draw(st.integers(0, 2)))
    ]
    if draw(st.booleans()):
        listed.append({'kind': 'model_error', 'dM': 5.0, 'dD': [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]})
    if draw(st.booleans()) or not listed:
        listed.append({'kind': 'current', 'velocity': draw(vectors(3, 0.5)).tolist()})
    return listed


@QUICK
@given(vehicles(heavy_water=False), error_lists(), attitudes(), vectors(largest=1.0))
def test_acceleration_by_kirchhoffs_equations(data, specs, eta, nu):
    vehicle = vehicle_from_dict(data, 'f')
    expected = momentum_balance(vehicle, specs, eta, nu, TAU)
    found, F = observed(vehicle, specs, eta, nu)
    assert_allclose(found, expected, rtol=0, atol=1e-3 * (1 + np.abs(expected).max()))
    known = vehicle.inverse_dynamics(eta, nu, expected)
    scale = np.abs(TAU).max() + np.abs(known).max()
    assert_allclose(F, TAU - known, rtol=0, atol=1e-9 * scale)


def test_a_relative_error_is_that_of_a_file_with_those_numbers():
    vehicle = load_vehicle('rexrov')
    model = make_uncertainty(vehicle, [ERRORS], 'f', ['d']).truth.model
    M = 1.05 * vehicle.M_RB + 0.8 * vehicle.M_A
    assert_allclose(model.M.reshape(6, 6), M, rtol=1e-14)
    assert_allclose(model.M_inv.reshape(6, 6) @ M, np.eye(6), atol=1e-12)
    assert_allclose(model.D_linear.reshape(6, 6), 1.3 * vehicle.D_linear, rtol=1e-14)
    assert_allclose(model.D_quadratic.reshape(6, 6), 1.3 * vehicle.D_quadratic, rtol=1e-14)
    W, B = 1.05 * vehicle.weight, 1.1 * vehicle.buoyancy
    expected = [W - B, *(W * vehicle.r_G - B * vehicle.r_B)]
    assert_allclose(model.hydrostatics, expected, rtol=1e-14)


def test_full_matrices_are_added_and_leave_g_alone():
    vehicle = load_vehicle('herman2018')
    dM, dD = np.diag([10.0, 20, 30, 1, 2, 3]), np.arange(36.0).reshape(6, 6)
    specs = [{'kind': 'model_error', 'dM': dM.tolist(), 'dD': dD.tolist()}]
    model = make_uncertainty(vehicle, specs, 'f', ['d']).truth.model
    assert_allclose(model.M.reshape(6, 6), vehicle.M + dM)
    assert_allclose(model.D_linear.reshape(6, 6), vehicle.D_linear + dD)
    assert_allclose(model.hydrostatics, vehicle.model.hydrostatics)


def test_several_entries_add_up():
    vehicle = load_vehicle('rexrov')
    halves = [
        {'kind': 'model_error', 'mass': 0.025, 'dM': 4.0},
        {'kind': 'model_error', 'mass': 0.025, 'dM': 3.0},
    ]
    one = [{'kind': 'model_error', 'mass': 0.05, 'dM': 7.0}]
    parts = make_uncertainty(vehicle, halves, 'f', ['a', 'b']).truth.model
    whole = make_uncertainty(vehicle, one, 'f', ['a']).truth.model
    assert_allclose(parts.M, whole.M, rtol=1e-15)
    currents = [
        {'kind': 'current', 'velocity': [0.1, 0, 0]},
        {'kind': 'current', 'velocity': [0, 0.2, -0.1]},
    ]
    flow = make_uncertainty(vehicle, currents, 'f', ['a', 'b']).current
    assert flow is not None
    assert_allclose(flow(np.zeros(1)), [[0.1, 0.2, -0.1, 0, 0, 0]])


def test_a_drifting_vehicle_feels_no_current():
    vehicle = load_vehicle('rexrov')
    specs = [{'kind': 'current', 'velocity': [0.3, -0.2, 0.1]}]
    eta = np.array([0, 0, 0, 0.2, -0.3, 1.0])
    R = rotation(quaternion(eta[3:]))
    nu = np.concatenate([R.T @ [0.3, -0.2, 0.1], np.zeros(3)])
    plant = plant_of(vehicle, specs, 0.01, 'ode5', initial_state(eta, nu))
    tau = vehicle.g(eta)
    for _ in range(100):
        _, F = push(plant, tau)
    assert_allclose(plant.x[:3], [0.3, -0.2, 0.1], atol=1e-9)
    assert_allclose(plant.x[7:], nu, atol=1e-9)
    # what the controller's model would say opposes the wrench: drag of the speed over ground
    assert_allclose(F, -vehicle.D(nu) @ nu - vehicle.C(nu) @ nu, atol=1e-6)


@pytest.mark.parametrize('axis', ['north', 'east', 'down'])
def test_a_varying_current_carries_the_body_and_drags_by_the_water(axis):
    """Released at rest relative to the water, a body accelerates less than the water does."""
    vehicle = load_vehicle('rexrov')
    wave = {'terms': [{'amplitude': 0.4, 'omega': 0.5}]}
    specs = [{'kind': 'current', axis: wave}]
    k = ('north', 'east', 'down').index(axis)
    plant = plant_of(vehicle, specs, 1e-6, 'ode5', initial_state(np.zeros(6), np.zeros(6)))
    push(plant, vehicle.g(np.zeros(6)))
    v_c_dot = np.zeros(6)
    v_c_dot[k] = 0.4 * 0.5  # at t = 0, where the current itself is zero
    expected = np.linalg.solve(vehicle.M, vehicle.M_A @ v_c_dot)
    assert_allclose(plant.x[7:] / 1e-6, expected, atol=1e-5)
    assert 0.1 < expected[k] / v_c_dot[k] < 1.0


def test_a_varying_current_with_constant_terms_is_the_constant_one():
    vehicle = load_vehicle('rexrov')
    x = initial_state(np.array([0, 0, 0, 0.1, 0.2, 0.3]), np.full(6, 0.1))
    plants = [
        plant_of(vehicle, [{'kind': 'current', **spec}], 0.01, 'ode5', x)
        for spec in (
            {'velocity': [0.3, 0.1, -0.2]},
            {'north': {'offset': 0.3}, 'east': {'offset': 0.1}, 'down': {'offset': -0.2}},
        )
    ]
    for _ in range(50):
        for plant in plants:
            push(plant, TAU)
    assert_allclose(plants[0].x, plants[1].x, rtol=0, atol=1e-14)


def twice(key: str, value: float) -> list[dict]:
    return [{'kind': 'model_error', key: value}] * 2


ASKEW = np.triu(np.ones((6, 6))).tolist()
VARYING = {'kind': 'current', 'north': {'terms': [{'amplitude': 0.1, 'omega': 1.0}]}}


@pytest.mark.parametrize(
    ('vehicle', 'specs', 'key', 'text'),
    [
        ('herman2018', [VARYING], 'd0.north', 'constant current'),
        ('rexrov', [VARYING, {'kind': 'model_error', 'dM': 1.0}], 'd0.north', 'beside dM'),
        ('herman2018', [ERRORS], 'd0.mass', 'dM and dD'),
        ('rexrov', twice('mass', -0.6), 'd0.mass', 'sum of all entries'),
        ('rexrov', twice('damping', -0.6), 'd0.damping', 'least -1, found -1.2'),
        ('rexrov', twice('added_mass', -0.6), 'd0.added_mass', 'of at least -1'),
        ('herman2018', twice('buoyancy', -0.6), 'd0.buoyancy', 'of at least -1'),
        ('rexrov', twice('mass', -0.5), 'd0.mass', 'above -1, found -1'),
        ('rexrov', [VARYING, twice('mass', -1.5)[0]], 'd1.mass', 'above -1, found -1.5'),
        ('herman2018', [{'kind': 'model_error', 'damping': 0.1}], 'd0.damping', 'dM and dD'),
        ('rexrov', [{'kind': 'model_error', 'dM': -1e5}], 'd0', 'positive definite'),
        ('rexrov', [{'kind': 'model_error', 'dM': ASKEW}], 'd0.dM', 'symmetric'),
    ],
)  # fmt: skip
def test_what_a_vehicle_cannot_take_is_refused_in_one_line(vehicle, specs, key, text):
    places = [f'd{i}' for i in range(len(specs))]
    with pytest.raises(InputError, match=text) as caught:
        make_uncertainty(load_vehicle(vehicle), specs, 'case.yaml', places)
    assert caught.value.key == key
    assert '\n' not in str(caught.value)


def test_a_constant_current_is_taken_where_the_file_gives_M_itself():
    vehicle = load_vehicle('herman2018_neutral')
    R_flow = [0.2, 0.1, 0.0]
    plant = plant_of(
        vehicle, [{'kind': 'current', 'velocity': R_flow}], 0.01, 'ode5',
        initial_state(np.zeros(6), np.array([0.2, 0.1, 0, 0, 0, 0])),
    )  # fmt: skip
    push(plant, vehicle.g(np.zeros(6)))
    assert_allclose(plant.x[7:10], R_flow, atol=1e-12)


def test_without_errors_F_is_the_disturbance_to_the_last_bit():
    vehicle = load_vehicle('rexrov')
    specs = [{'kind': 'herman2018', 'scale': [1, 2, 3, 4, 5, 6]}]
    uncertainty = make_uncertainty(vehicle, specs, 'f', ['d'])
    assert uncertainty.truth.exact
    plant = plant_of(vehicle, specs, 0.01, 'ode5', initial_state(np.zeros(6), np.zeros(6)))
    assert push(plant, TAU)[1] == tuple(uncertainty.F(np.zeros(1))[0])


def test_relative_errors_may_leave_nothing_but_of_the_mass():
    gone = [{'kind': 'model_error', 'damping': -0.5, 'added_mass': -0.5, 'buoyancy': -0.5}] * 2
    truth = make_uncertainty(load_vehicle('rexrov'), gone, 'f', ['a', 'b']).truth
    assert not truth.model.D_linear.any()
    assert_allclose(truth.model.M, truth.M_RB)


def test_an_exactly_singular_M_is_refused_in_one_line():
    vehicle = load_vehicle('herman2018')
    specs = [{'kind': 'model_error', 'dM': (-vehicle.M).tolist()}]
    with pytest.raises(InputError, match='positive definite'):
        make_uncertainty(vehicle, specs, 'case.yaml', ['d0'])
