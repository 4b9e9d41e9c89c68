"""Linear models against the paper's closed loop, the plant's own values and simulations."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace as Made

import numpy as np
import pytest
import scipy.linalg
import scipy.signal
from helpers.closed_loops import PAPER
from numpy.testing import assert_allclose

from auv_analysis import linearize, load_scenario, simulate
from auv_analysis.studies.linearize.linearize import jacobian, relative, state_names
from auv_analysis.studies.linearize.modes import modes
from auv_dynamics import load_vehicle
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.kinematics import jacobian as kinematics

NU = np.array([0.8, -0.2, 0.3, 0.05, -0.1, 0.2])
ETA = np.array([1.0, 2.0, 3.0, 0.3, -0.4, 2.0])
CRUISE = [0.5, 0.0, 0.0, 0.0, 0.0, 0.1]


def sorted_poles(A):
    return np.sort_complex(np.round(np.linalg.eigvals(A), 9))


def test_derivatives_of_what_has_a_corner_in_its_slope():
    def corner(points):
        x, y = points.T
        return np.stack([np.abs(x) * x + y, x * y], axis=1)

    J, error = jacobian(corner, np.zeros(2))
    assert_allclose(J, [[0, 1], [0, 0]], atol=1e-12)
    assert error.max() < 1e-10
    J, error = jacobian(lambda x: np.sin(50 * x), np.array([0.3]))
    assert abs(J[0, 0] - 50 * np.cos(15)) < 1e-4
    assert error[0, 0] > 1e-9  # what is not quadratic shows in the error


def test_an_error_is_relative_to_the_largest_of_its_row_or_as_it_is_where_all_are_zero():
    error = np.array([[0.2, 0.7], [3.0, 0.0]])
    assert relative(error, np.array([[0.0, 0.0], [2.0, -6.0]])) == 0.7
    assert relative(error, np.array([[0.0, 0.0], [2.0, -4.0]])) == 0.75


@pytest.mark.parametrize(
    ('name', 'surge'), [('rexrov', 0.8), ('bluerov2', 0.8), ('lauv', 0.8), ('lauv', -0.6)]
)
def test_vehicle_alone_against_differences_of_its_dynamics(name, surge):
    vehicle = load_vehicle(name)
    model = linearize(vehicle, [surge, *NU[1:]], eta0=ETA)

    def rate(y):
        eta, nu, tau = np.array([0, 0, 0, *y[:2], ETA[5]]), y[2:8], y[8:14]
        nu_dot = vehicle.forward_dynamics(eta, nu, tau, y[14:])
        return np.concatenate([(kinematics(eta) @ nu)[3:5], nu_dot])

    y0 = np.concatenate([model.x0, model.u0])
    slope, _ = jacobian(lambda points: np.stack([rate(y) for y in points]), y0)
    assert_allclose(np.hstack([model.A, model.B]), slope, atol=1e-8 * np.abs(slope).max())
    assert_allclose(model.drift, rate(y0), atol=1e-12)
    assert np.abs(model.drift[:2]).max() > 0.01  # inclined and turning: no rest
    assert_allclose(model.drift[2:], 0, atol=1e-12)


@pytest.mark.parametrize('law', ['gvc', 'cl'])
def test_poles_of_a_diagonal_vehicle_are_those_of_the_closed_loop(law):
    """(22) by axis: m s_dot + (d + K_D) s + k_I z + K_f integral(s) = 0, s = z_dot + Lambda z."""
    vehicle = load_vehicle('lrauv_tethys')
    model = linearize(vehicle, law=law, gains=PAPER)
    m, d = np.diagonal(vehicle.M), np.diagonal(vehicle.D_linear)
    scale = m if law == 'gvc' else np.ones(6)
    expected = [0, 0]  # phi and theta: g is compensated, nothing pulls them back
    for i in range(6):
        damped = d[i] + PAPER['k_D'] * scale[i]
        pull = PAPER['Gamma'] * scale[i]
        # m p + damped + k_I / (p + Lambda) + pull / p = 0
        cubic = np.polymul([m[i], damped, pull], [1, PAPER['Lambda']])
        expected.extend(np.roots(np.polyadd(cubic, [PAPER['k_I'], 0])))
    assert_allclose(sorted_poles(model.A), np.sort_complex(np.round(expected, 9)), atol=1e-7)
    assert model.error < 1e-9


def test_nu_d_with_its_derivative_is_followed_at_once():
    model = linearize('rexrov', CRUISE, law='gvc', gains=PAPER, inputs=('nu_d', 'nu_d_dot'))
    A, B, C, D = model
    for s in (0.3j, 2.0 + 1.0j):
        G = C @ np.linalg.solve(s * np.eye(len(A)) - A, B) + D
        assert_allclose((G[:, :6] + s * G[:, 6:])[:6], np.eye(6), atol=1e-7)


@pytest.fixture(scope='module')
def small_step():
    """A step of the set-point by ten-thousandths, from rest, and the linear model about rest."""
    base = load_scenario('case1')
    offsets = {'surge': 2e-4, 'sway': -1e-4, 'roll': 1e-4, 'yaw': 2e-4}
    setpoint = {dof: {'offset': value, 'terms': []} for dof, value in offsets.items()}
    data = base.data | {'duration': 4.0, 'disturbance': [], 'setpoint': setpoint}
    scenario = replace(base, data=data)
    return scenario, np.array([2e-4, -1e-4, 0, 1e-4, 0, 2e-4])


@pytest.mark.parametrize('controller', ['gvc', 'cl'])
def test_step_response_is_that_of_a_simulation(small_step, controller):
    scenario, size = small_step
    run = simulate(scenario, controller)
    model = linearize(scenario, controller=controller, inputs=('nu_d',))
    u = np.tile(size, (len(run.t), 1))
    t, y, _ = scipy.signal.lsim(scipy.signal.StateSpace(*model), u, run.t)
    assert_allclose(t, run.t)
    nu, tau = y[:, :6], y[:, 6:] + model.y0[6:]
    assert_allclose(nu, run.nu, atol=0.003 * np.abs(run.nu).max())
    assert_allclose(tau, run.tau, atol=0.003 * np.abs(run.tau - model.y0[6:]).max())


def test_eigenvalues_are_those_of_a_simulation_that_is_pushed(small_step):
    """The transition over half a second, from runs that begin a little beside the point."""
    scenario, _ = small_step
    still = replace(scenario, data=scenario.data | {'duration': 0.5, 'setpoint': {}})
    free = still.data['initial']
    h = 1e-4

    def end(i, sign):
        nu = sign * h * np.eye(6)[i]
        run = simulate(replace(still, data=still.data | {'initial': free | {'nu': nu}}), 'gvc')
        return np.concatenate([run.eta[-1, 3:5], run.nu[-1], run.law_state[-1]])

    moved = np.stack([(end(i, 1) - end(i, -1)) / (2 * h) for i in range(6)], axis=1)
    model = linearize(scenario, controller='gvc')
    assert_allclose(moved, scipy.linalg.expm(0.5 * model.A)[:, 2:8], atol=1e-5)


def test_model_errors_are_the_plants_and_the_law_holds_against_them():
    scenario = load_scenario('case1_rexrov')
    wrong = {'kind': 'model_error', 'mass': 0.1, 'damping': 0.3, 'buoyancy': 0.05}
    changed = replace(scenario, data=scenario.data | {'disturbance': [wrong]})
    model = linearize(changed, CRUISE, controller='gvc')
    assert_allclose(model.drift, 0, atol=1e-7)
    assert np.abs(model.x0[14:]).max() > 1e-3  # the adaptive term carries the difference
    exact = linearize(scenario, CRUISE, controller='gvc')
    assert np.abs(model.A[:8] - exact.A[:8]).max() > 0.1


def test_own_law_of_a_user(monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[4] / 'examples')
    model = linearize('bluerov2', law='own_law:ComputedTorque', gains={'k_P': 4.0, 'k_I': 2.0})
    # nu_dot = k_P nu_err + k_I z in every axis
    expected = [0, 0, *np.roots([1, 4, 2]).tolist() * 6]
    assert_allclose(sorted_poles(model.A), np.sort_complex(np.round(expected, 9)), atol=1e-6)
    assert model.states[8:] == tuple(name.replace('nu', 'law1') for name in model.states[2:8])


def test_states_of_a_law_are_named_by_axis_where_they_are_blocks_of_six():
    assert state_names(12)[8:] == tuple(f'law{i}[{dof}]' for i in (1, 2) for dof in DOFS)
    assert state_names(7)[8:] == tuple(f'law[{i}]' for i in range(1, 8))


def test_groups_of_inputs_and_outputs_are_taken_in_the_order_in_which_they_are_asked_for():
    given = {'nu0': CRUISE, 'law': 'gvc', 'gains': PAPER}
    whole = linearize('rexrov', inputs=('nu_d', 'nu_d_dot', 'F'), **given)
    some = linearize('rexrov', inputs=('F', 'nu_d'), outputs='tau', **given)
    columns, rows = [*range(12, 18), *range(6)], slice(6, 12)
    assert some.inputs == tuple(f'{group}[{dof}]' for group in ('F', 'nu_d') for dof in DOFS)
    assert some.outputs == whole.outputs[rows] == tuple(f'tau[{dof}]' for dof in DOFS)
    for found, expected in (
        (some.A, whole.A), (some.B, whole.B[:, columns]), (some.C, whole.C[rows]),
        (some.D, whole.D[rows][:, columns]), (some.u0, whole.u0[columns]),
        (some.y0, whole.y0[rows]),
    ):  # fmt: skip
        assert_allclose(found, expected, atol=1e-12)


def test_python_control_takes_it():
    import control

    model = linearize('bluerov2_heavy', CRUISE, law='gvc', gains=PAPER)
    system = control.ss(*model, inputs=model.inputs, outputs=model.outputs, states=model.states)
    assert (system.nstates, system.ninputs, system.noutputs) == (20, 12, 12)
    assert_allclose(np.sort(system.poles().real), np.sort(np.linalg.eigvals(model.A).real))


def test_modes_of_a_pendulum():
    found = modes(linearize('bluerov2_heavy'))
    swinging = {mode['mostly']: mode for mode in found if mode['pole'][1] > 0}
    vehicle = load_vehicle('bluerov2_heavy')
    stiffness = vehicle.buoyancy * 0.01 / np.diagonal(vehicle.M)[3]
    roll = swinging['roll'] if 'roll' in swinging else swinging['phi']
    assert roll['natural_frequency'] == pytest.approx(np.sqrt(stiffness), rel=1e-6)
    assert roll['damping_ratio'] == pytest.approx(0.0, abs=1e-9)  # no linear damping in roll


@pytest.mark.parametrize(
    ('changes', 'match'),
    [
        ({'law': 'pdi'}, 'expected gvc, cl, pid, smc, multisine or module:Class'),
        ({'law': 'gvc'}, 'k_D: expected .* found nothing'),
        ({'controller': 'gvc'}, 'controller: expected a scenario beside it'),
        ({'nu0': [1.0]}, 'nu0: expected 6 finite numbers'),
        ({'eta0': [0, 0, 0, 0, np.pi / 2, 0]}, 'eta0: expected a pitch within'),
        ({'inputs': ('nu_d',)}, 'inputs: expected some of tau, F'),
    ],
)
def test_what_cannot_be_linearised_is_refused(changes, match):
    with pytest.raises(ValueError, match=match):
        linearize('bluerov2', **changes)


def test_a_controller_and_a_law_are_one_too_many(small_step):
    with pytest.raises(ValueError, match='expected controller or law, found both'):
        linearize(small_step[0], law='gvc', gains=PAPER, controller='gvc')


def test_current_is_refused(small_step):
    scenario, _ = small_step
    spec = {'kind': 'current', 'velocity': [0.1, 0, 0]}
    flowing = replace(scenario, data=scenario.data | {'disturbance': [spec]})
    with pytest.raises(ValueError, match='a scenario in still water, found a current'):
        linearize(flowing, controller='gvc')


def test_printed_result_is_a_few_lines_with_the_poles():
    text = repr(linearize('rexrov', law='gvc', gains=PAPER))
    assert len(text.splitlines()) <= 3
    assert 'law2' in text
    assert '-0.8' in text


def test_poles_that_are_all_zero_are_told_as_such() -> None:
    found = modes(Made(A=np.zeros((2, 2)), states=('a', 'b')))
    assert [mode['pole'] for mode in found] == [[0.0, 0.0]] * 2
    assert [mode['mostly'] for mode in found] == ['a', 'b']
    chain = modes(Made(A=np.diag([2.0, 3.0], 1), states=('a', 'b', 'c')))  # of integrators
    assert [mode['pole'] for mode in chain] == [[0.0, 0.0]] * 3
