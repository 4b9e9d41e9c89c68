"""The reference's closed loops: recorded F, laws, tables, attitude without a singularity."""

import herman_reference as reference
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from reference_cases import (
    CONSTANT,
    DENSE_M_A,
    ERRORS,
    PAPER,
    PID,
    SIX,
    SMC,
    TURNED,
    VARYING,
    file_of,
    off_centre,
    run,
    wave,
)


@pytest.mark.parametrize('hold', ['continuous', 'zoh'])
def test_F_without_a_wrong_model_is_what_was_given(hold):
    push = [{'kind': 'herman2018', 'scale': 3.0}, {'kind': 'harmonic', 'roll': {'offset': 20.0}}]
    one = run(off_centre(), PAPER | {'law': 'gvc'}, hold, disturbance=push, initial=TURNED)
    assert_allclose(one['F'], one['disturbance'], atol=1e-8)
    assert np.abs(one['F']).max() > 50.0


@pytest.mark.parametrize('hold', ['continuous', 'zoh'])
def test_F_of_model_errors_is_that_of_equation_3(hold):
    spec = [ERRORS, {'kind': 'model_error', 'dM': (3.0 * DENSE_M_A).tolist(), 'dD': [40.0] * 6}]
    one = run(off_centre(), PAPER | {'law': 'gvc'}, hold, disturbance=spec, initial=TURNED)
    plant, true = reference.Plant(off_centre(), spec), reference.plant_matrices(off_centre(), spec)
    file = reference.vehicle_matrices(off_centre())
    for k, t in enumerate(one['t']):
        R, nu = one['R'][k], one['nu'][k]
        nu_dot = plant.acceleration(t, R, nu, one['tau_applied'][k])
        F = (true['M'] - file['M']) @ nu_dot
        F += reference.coriolis(true['M'] - file['M'], nu) @ nu
        F += (reference.damping(true, nu) - reference.damping(file, nu)) @ nu
        F += reference.restoring(true, one['eta'][k]) - reference.restoring(file, one['eta'][k])
        assert_allclose(one['F'][k], F, atol=1e-8 * np.abs(one['F']).max())


def test_F_of_too_much_buoyancy_opposes_a_dive():
    spec = {'kind': 'model_error', 'buoyancy': 0.1}
    one = run(file_of('herman2018'), PAPER | {'law': 'cl'}, disturbance=spec, duration=0.0)
    assert_allclose(one['F'], [[0, 0, 0.1 * 1000 * 9.81 * 0.36, 0, 0, 0]], atol=1e-9)


def test_F_of_a_current_on_a_vehicle_at_rest():
    mats = reference.vehicle_matrices(off_centre())
    nu_c = np.array([*CONSTANT['velocity'], 0, 0, 0])
    one = run(off_centre(), PAPER | {'law': 'cl'}, disturbance=CONSTANT, duration=0.0)
    F = reference.kirchhoff(mats['M_A'], nu_c) - reference.damping(mats, nu_c) @ nu_c
    assert_allclose(one['F'][0], F, atol=1e-9)


def test_gvc_is_cl_with_gains_times_M():
    M = reference.vehicle_matrices(off_centre())['M']
    cl = PAPER | {'law': 'cl', 'k_D': (12.0 * M).tolist(), 'Gamma': (60.0 * M).tolist()}
    found = [run(off_centre(), e, disturbance=VARYING) for e in (cl, PAPER | {'law': 'gvc'})]
    for key in ('nu', 'tau', 'disturbance_estimate'):
        scale = np.abs(found[0][key]).max()
        assert_allclose(found[0][key], found[1][key], atol=1e-9 * scale)


def test_feed_forward_of_pid_is_exact():
    start = {'nu': reference.setpoint(SIX, 0.0)[0].tolist()}
    weak = PID | {'k_P': 0.0, 'k_I': 0.0, 'k_D': 0.0}
    one = run(off_centre(), weak, initial=start)
    assert_allclose(one['nu'], one['nu_d'], atol=1e-9)
    assert not one['disturbance_estimate'].any()
    without = run(off_centre(), weak | {'k_FF': 0.0}, initial=start)
    eta = without['eta'][-1]
    g = reference.restoring(reference.vehicle_matrices(off_centre()), eta)
    assert_allclose(without['tau'][-1], g, rtol=1e-9)


def test_feed_forward_of_pid_is_taken_at_the_wanted_velocity():
    mats = reference.vehicle_matrices(off_centre())
    _, law = reference.control_law(mats, PID | {'k_P': 0.0, 'k_I': 0.0, 'k_D': 0.0})
    nu, nu_d, nu_d_dot = np.random.default_rng(1).normal(size=(3, 6))
    C_D = reference.coriolis(mats['M'], nu_d) + reference.damping(mats, nu_d)
    tau = law(nu, nu_d, nu_d_dot, np.zeros(6))(np.ones(12))[0]
    assert_allclose(tau, mats['M'] @ nu_d_dot + C_D @ nu_d, rtol=1e-12)


def test_filtered_derivative_of_pid():
    mats, h, slope = reference.vehicle_matrices(off_centre()), 0.01, 0.3
    entry = PID | {'k_P': 0.0, 'k_I': 0.0, 'k_D': 7.0, 'k_FF': 0.0, 'omega_f': 10.0}
    size, law = reference.control_law(mats, entry)
    x = np.zeros(size)
    for k in range(500):
        tau, rate, _ = law(np.zeros(6), np.full(6, slope * k * h), np.zeros(6), np.zeros(6))(x)
        exact = 7.0 * slope * (1.0 - (1.0 - 10.0 * h) ** k)  # of a ramp, from zero
        assert_allclose(tau, np.full(6, exact), rtol=1e-9)
        x = x + h * rate
    assert_allclose(tau, np.full(6, 7.0 * slope), rtol=1e-9)


@pytest.mark.parametrize('inside', [True, False])
def test_error_of_smc_obeys_its_closed_loop(inside):
    """M s_dot + (C + D + k_D) s + k_S sat(s / phi) + f = F, s_dot by central differences."""
    h, mats = 0.001, reference.vehicle_matrices(off_centre())
    push = {'kind': 'harmonic', 'surge': wave(50.0, 400.0, 3.0), 'yaw': wave(0.0, 200.0, 2.0)}
    phi = np.full(6, 5.0 if inside else 1e-4)
    entry = SMC | {'Lambda': (0.8 * np.eye(6) + 0.1).tolist(), 'phi': phi.tolist()}
    start = {'nu': [0.1, -0.6, -0.5, -0.4, -0.7, -0.5]}
    one = run(off_centre(), entry, disturbance=push, step=h, duration=0.02, initial=start)
    Lambda, x, nu = np.array(entry['Lambda']), one['law_state'], one['nu']
    s = one['nu_d'] - nu + 2 * x[:, :6] @ Lambda.T + x[:, 6:12] @ (Lambda @ Lambda).T
    assert ((np.abs(s) < phi) == inside).all()  # the kink of sat is not crossed
    s_dot = (s[:-4] - 8 * s[1:-3] + 8 * s[3:-1] - s[4:]) / (12 * h)
    for k in range(2, len(s) - 2):
        C_D = reference.coriolis(mats['M'], nu[k]) + reference.damping(mats, nu[k])
        left = mats['M'] @ s_dot[k - 2] + C_D @ s[k] + 4000.0 * s[k]
        left += 100.0 * (s[k] / phi if inside else np.sign(s[k])) + one['disturbance_estimate'][k]
        assert_allclose(left, one['disturbance'][k], atol=2e-3)
    assert_allclose(one['disturbance_estimate'], 9000.0 * x[:, 12:], rtol=1e-12)


@pytest.mark.parametrize('entry', [PID, SMC])
def test_a_fine_hold_is_the_continuous_law(entry):
    start = {'initial': {'nu': TURNED['nu']}, 'disturbance': ERRORS, 'duration': 0.4}
    exact = run(off_centre(), entry, step=0.002, **start)
    errors = []
    for h in (0.004, 0.002):
        held = run(off_centre(), entry, 'zoh', step=h, **start)
        errors.append(np.abs(held['nu'][-1] - exact['nu'][-1]).max())
    assert errors[1] < 2e-3
    assert_allclose(errors[0] / errors[1], 2.0, atol=0.15)  # first order in the step


def test_unknown_and_missing_gains_are_refused():
    for entry in (PID | {'k_Q': 1.0}, {'law': 'smc', 'k_D': 1.0}):
        with pytest.raises(ValueError, match='takes'):
            run(off_centre(), entry)


@pytest.mark.parametrize('hold', ['continuous', 'zoh'])
def test_two_forms_of_attitude_agree(hold):
    changes = {'disturbance': [VARYING, ERRORS], 'initial': TURNED, 'step': 0.005}
    one, other = (
        run(off_centre(), PAPER | {'law': 'gvc'}, hold, attitude=attitude, **changes)
        for attitude in ('euler', 'matrix')
    )
    for key in ('eta', 'R', 'nu', 'tau', 'F'):
        assert_allclose(one[key], other[key], atol=1e-8 * np.abs(one[key]).max(), err_msg=key)


def test_pitching_through_the_vertical():
    start = {'nu': [0, 0, 0, 0, 0.9, 0]}
    changes = {'setpoint': {'pitch': {'offset': 0.9}}, 'initial': start, 'duration': 4.0}
    one = run(off_centre(), PID, attitude='matrix', **changes)
    exact = [reference.rodrigues(np.array([0, 0.9 * t, 0])) for t in one['t']]
    assert_allclose(one['R'], exact, atol=1e-8)
    assert one['eta'][:, 4].max() > 1.56
    assert_allclose(np.abs(one['eta'][-1, [3, 5]]), [np.pi, np.pi], atol=1e-6)


def test_order_of_convergence_of_the_matrix_attitude():
    ends = []
    for h in (0.1, 0.05, 0.00625):
        changes = {'step': h, 'duration': 0.8, 'initial': TURNED}
        ends.append(run(off_centre(), PAPER | {'law': 'gvc'}, attitude='matrix', **changes))
        assert_allclose(ends[-1]['R'][-1] @ ends[-1]['R'][-1].T, np.eye(3), atol=1e-14)
    coarse, middle = (np.abs(e['R'][-1] - ends[2]['R'][-1]).max() for e in ends[:2])
    assert np.log2(coarse / middle) > 4.5


def test_setpoints_from_a_table():
    table = np.array([[0.0, *range(6)], [0.5, *range(1, 7)], [1.0, *([0.0] * 6)]])
    value, slope = reference.setpoint({'table': table}, 0.25)
    assert_allclose(value, np.arange(6) + 0.5)
    assert_allclose(slope, np.full(6, 2.0))
    for t, row in ((0.5, 1), (1.0, 2)):
        value, slope = reference.setpoint({'table': table}, t)
        assert_allclose(value, table[row, 1:])
        assert_allclose(slope, -2.0 * np.arange(1, 7))
    wave_table = [[t, *reference.setpoint(SIX, t)[0]] for t in np.arange(101) * 0.01]
    found = run(off_centre(), PAPER | {'law': 'gvc'}, 'zoh', setpoint={'table': wave_table})
    expected = run(off_centre(), PAPER | {'law': 'gvc'}, 'zoh')
    assert_allclose(found['nu_d'], expected['nu_d'], atol=1e-15)
    assert_allclose(found['nu'], expected['nu'], atol=1e-4)


def test_refused_runs():
    for message, changes in (
        ('cover', {'setpoint': {'table': [[0.0] * 7, [0.9] * 7]}}),
        ('table', {'setpoint': {'file': 'x.csv'}}),
        ('zoh', {'actuators': {'limit': 1.0}}),
        ('zoh', {'sensors': {'drop_out': 0.1}}),
    ):
        with pytest.raises(ValueError, match=message):
            run(off_centre(), PAPER | {'law': 'gvc'}, **changes)


def test_nothing_given_is_changed():
    vehicle, scenario = off_centre(), file_of('case1', 'scenarios')
    scenario |= {'disturbance': [VARYING, ERRORS], 'initial': TURNED, 'actuators': {'delay': 0.02}}
    reference.simulate(vehicle, scenario, 'gvc', 'zoh', 0.1)
    assert vehicle == off_centre()
    assert_array_equal(scenario['initial']['nu'], TURNED['nu'])
