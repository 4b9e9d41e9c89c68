"""The reference's actuators, anti-windup and sensors."""

import herman_reference as reference
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from reference_cases import CL, PAPER, PID, SMC, TURNED, off_centre, run

STEP = np.array([100.0, -60.0, 0.0, 10.0, 0.0, -1.0])
H = 0.01
A, B = np.sqrt(0.5), 0.4
PLANAR = [
    {'name': 'a', 'position': [1, B, 0], 'direction': [2, -2, 0], 'limit': 40.0},
    {'name': 'b', 'position': [1, -B, 0], 'direction': [1, 1, 0], 'limit': [40.0, 50.0]},
    {'name': 'c', 'position': [-1, B, 0], 'direction': [1, 1, 0], 'limit': [-40.0, 50.0]},
    {'name': 'd', 'position': [-1, -B, 0], 'direction': [1, -1, 0], 'limit': 50.0},
]


def response(n: int = 40, **spec):
    """a_0 ... a_{n-1} to a constant command."""
    one = reference.Actuators(spec, {'thrusters': PLANAR}, H)
    return np.array([one(STEP) for _ in range(n)])


def test_step_response_of_the_lag():
    k = np.arange(40)[:, np.newaxis]
    assert_allclose(response(lag=0.05), STEP * (1 - np.exp(-(k + 1) * H / 0.05)), rtol=1e-12)


def test_limit_cases_of_the_lag():
    assert_array_equal(response(), np.tile(STEP, (40, 1)))
    assert_array_equal(response(lag=0.0), response())
    assert_array_equal(response(lag=1e-5), response())
    assert_allclose(response(lag=1e9), np.zeros((40, 6)), atol=1e-7)


def test_step_response_of_the_rate():
    k = np.arange(40)[:, np.newaxis]
    expected = np.sign(STEP) * np.minimum(np.abs(STEP), 500.0 * H * (k + 1))
    assert_allclose(response(rate=500.0), expected, rtol=1e-12)


def test_delay():
    found = response(delay=0.03)
    assert not found[:3].any()
    assert_array_equal(found[3:], np.tile(STEP, (37, 1)))
    with pytest.raises(ValueError, match='whole number'):
        response(delay=0.015)


def test_limit():
    limit = [50.0, 70.0, 1.0, 2.0, 1.0, 0.5]
    assert_array_equal(response(limit=limit)[0], [50.0, -60.0, 0.0, 2.0, 0.0, -0.5])
    assert_array_equal(response(limit=50.0)[-1], [50.0, -50.0, 0.0, 10.0, 0.0, -1.0])


def test_the_limit_stands_before_the_lag_and_the_rate_behind_it():
    """100 N cut to 40, then by a factor 1/2 per step, at most 15 N per step."""
    found = response(6, limit=40.0, lag=H / np.log(2.0), rate=1500.0, delay=H)[:, 0]
    assert_allclose(found, [0.0, 15.0, 27.5, 33.75, 36.875, 38.4375], rtol=1e-12)


def test_columns_of_the_thruster_matrix():
    T, low, high = reference.thruster_matrix(PLANAR)
    assert_allclose(T[:, 0], [A, -A, 0, 0, 0, -A - B * A], atol=1e-15)
    assert_allclose(T[5], [-A * (1 + B), A * (1 + B), -A * (1 + B), A * (1 + B)])
    assert_array_equal(low, [-40, -40, -40, -50])
    assert_array_equal(high, [40, 50, 50, 50])


def test_thrusts_are_scaled_down_together():
    one = reference.Actuators({'thrusters': True}, {'thrusters': PLANAR}, H)
    small = np.array([30.0, 10.0, 0, 0, 0, 5.0])
    assert_allclose(one.saturate(small), small, atol=1e-12)
    out_of_reach = small + np.array([0, 0, 7.0, 3.0, -2.0, 0])
    assert_allclose(one.saturate(out_of_reach), small, atol=1e-12)
    surge = np.array([1000.0, 0, 0, 0, 0, 0])  # 'a', with 40 N, is the first at its limit
    assert_allclose(one.saturate(surge), [4 * A * 40.0, 0, 0, 0, 0, 0], atol=1e-10)
    assert_allclose(one.saturate(-surge), [-4 * A * 40.0, 0, 0, 0, 0, 0], atol=1e-10)
    sway = np.array([0, 1000.0, 0, 0, 0, 0])
    assert_allclose(one.saturate(sway), [0, 4 * A * 40.0, 0, 0, 0, 0], atol=1e-10)
    both = reference.Actuators({'thrusters': True, 'limit': 50.0}, {'thrusters': PLANAR}, H)
    assert_allclose(both.saturate(surge), [50, 0, 0, 0, 0, 0], atol=1e-10)
    with pytest.raises(ValueError, match='a vehicle file with thrusters'):
        reference.Actuators({'thrusters': True}, {}, H)


@pytest.mark.parametrize('entry', [CL, PID, SMC])
def test_wide_actuators_change_nothing(entry):
    wide = {'limit': 1e9, 'rate': 1e9, 'lag': 0.0, 'delay': 0.0}
    plain = run(off_centre(), entry, 'zoh', initial=TURNED)
    found = run(off_centre(), entry, 'zoh', initial=TURNED, actuators=wide)
    for key in plain:
        assert_array_equal(found[key], plain[key])
    assert_array_equal(plain['tau_applied'], plain['tau'])


def test_a_run_holds_the_wrench_of_earlier_samples():
    found = run(off_centre(), CL, 'zoh', actuators={'delay': 0.05})
    assert_array_equal(found['tau_applied'][5:], found['tau'][:-5])
    assert not found['tau_applied'][:5].any()
    assert_allclose(found['F'], 0.0, atol=1e-8 * np.abs(found['tau']).max())


def saturated(anti_windup: bool, entry=CL):
    """Surge and heave beyond the limit for seconds, then within reach again."""
    table = np.zeros((4, 7))
    table[:, 0], table[:2, [1, 3]] = [0.0, 3.0, 3.01, 8.0], 2.0
    changes = {'setpoint': {'table': table}, 'actuators': {'limit': 800.0}, 'duration': 8.0}
    changes['integrator'] = 'euler'  # of the plant, whose motion is only looked at
    return run(off_centre(), entry | {'anti_windup': anti_windup}, 'zoh', **changes)


@pytest.mark.parametrize(('entry', 'surge'), [(CL, [0, 6]), (PID, [0]), (SMC, [0, 6, 12])])
def test_anti_windup_keeps_the_integrals_of_a_cut_axis(entry, surge):
    kept, wound = saturated(True, entry), saturated(False, entry)
    first = slice(0, 100)
    assert (kept['tau'][first, 0] > 800.0).all()
    assert np.abs(kept['law_state'][first][:, surge]).max() < 1e-12
    assert np.abs(wound['law_state'][100, surge]).min() > 0.1
    left = [np.abs(one['nu'][-1, 0]) for one in (kept, wound)]  # 5 s after nu_d came back to zero
    assert left[0] < 0.02
    assert left[1] > 0.5


def test_only_an_integral_of_the_cut_axis_that_adds_to_it_stops():
    """Cut at +1 in surge: z_surge adds and stops, S_surge pulls back, z_sway is of another axis."""
    tau, rate = np.array([2.0, 0.5, 0, 0, 0, 0]), np.zeros(12)
    rate[[0, 6, 1]] = 1.0, -1.0, 3.0

    def answer(x):
        return tau + np.array([x[0] + x[6] + x[1], x[1], 0, 0, 0, 0]), rate, None

    one, wide = (reference.Actuators({'limit': limit}, {}, H) for limit in (1.0, 5.0))
    kept = reference.not_wound_up(answer, np.zeros(12), tau, rate, one, 'cl')
    assert_array_equal(kept, [0.0, 3.0, 0, 0, 0, 0, -1.0, 0, 0, 0, 0, 0])
    assert_array_equal(reference.not_wound_up(answer, np.zeros(12), tau, rate, wide, 'cl'), rate)


def test_the_filter_of_pid_is_no_integral():
    tau, rate = np.full(6, 2.0), np.ones(12)

    def answer(x):
        return tau + x[:6] + x[6:], rate, None

    one = reference.Actuators({'limit': 1.0}, {}, H)
    kept = reference.not_wound_up(answer, np.zeros(12), tau, rate, one, 'pid')
    assert_array_equal(kept, [0.0] * 6 + [1.0] * 6)


def test_rounding_of_the_allocation_stops_nothing():
    """T T^+ tau differs from tau by rounding only: within all limits, every state goes on."""
    corners = [(x, y, z) for x in (-1.0, 1.1) for y in (-0.6, 0.7) for z in (-0.2, 0.3)]
    wide = [
        {'name': f'{i}', 'position': at, 'direction': [1, (-1) ** i, 0.3 * i - 1], 'limit': 1e6}
        for i, at in enumerate(corners)
    ]
    assert np.linalg.matrix_rank(reference.thruster_matrix(wide)[0]) == 6
    plain = run(off_centre(), CL, 'zoh', initial=TURNED)
    spec = {'actuators': {'thrusters': True}, 'initial': TURNED}
    found = run(off_centre() | {'thrusters': wide}, CL, 'zoh', **spec)
    assert_allclose(found['law_state'], plain['law_state'], atol=1e-12)


def test_anti_windup_does_not_know_lag_rate_and_delay():
    slow = {'limit': 1e6, 'lag': 0.2, 'rate': 2e4, 'delay': 0.05}
    one = run(off_centre(), CL, 'zoh', initial=TURNED, actuators=slow)
    z = 0.01 * np.cumsum(one['nu_d'] - one['nu'], axis=0)[:-1]
    assert np.abs(one['tau'] - one['tau_applied']).max() > 100.0
    assert_allclose(one['law_state'][1:, :6], z, atol=1e-13)


def product(p, q):
    """p q of quaternions, scalar first."""
    scalar = p[0] * q[0] - p[1:] @ q[1:]
    return np.array([scalar, *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))])


def rotation(q):
    s = reference.skew(q[1:])
    return np.eye(3) + 2 * q[0] * s + 2 * s @ s


def turn(vector):
    """exp(vector / 2), for a vector that is not zero."""
    angle = np.linalg.norm(vector)
    return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * np.asarray(vector) / angle)])


def test_noise_and_lost_samples():
    sensors = {'velocity_noise': [0.1, 0.2, 0.3, 0.04, 0.05, 0.06], 'attitude_noise': 0.02}
    spec = sensors | {'drop_out': 0.3}
    seen = run(off_centre(), CL, 'zoh', sensors=spec, seed=7, initial=TURNED)
    noise, loss = (np.random.default_rng(s) for s in np.random.SeedSequence(7).spawn(2))
    normal, lost = noise.standard_normal((101, 9)), loss.random(101) < 0.3
    last = 0
    assert 20 < lost.sum() < 40
    for k in range(101):
        last = k if k == 0 or not lost[k] else last
        nu = seen['nu'][last] + sensors['velocity_noise'] * normal[last, :6]
        assert_allclose(seen['nu_measured'][k], nu, rtol=1e-13)
        phi, theta, psi = seen['eta'][last, 3:]
        q = product(product(turn([0, 0, psi]), turn([0, theta, 0])), turn([phi, 0, 0]))
        q = product(q, turn(0.02 * normal[last, 6:]))
        angles = reference.euler_angles(rotation(q))
        assert_allclose(seen['eta_measured'][k, 3:], angles, atol=1e-13)
        assert_array_equal(seen['eta_measured'][k, :3], seen['eta'][last, :3])


def test_a_first_sample_is_never_lost_and_all_others_may_be():
    seen = run(off_centre(), CL, 'zoh', sensors={'velocity_noise': 0.1, 'drop_out': 1.0})
    assert_array_equal(seen['nu_measured'], np.tile(seen['nu_measured'][0], (101, 1)))
    assert np.abs(seen['nu_measured'][0]).min() > 0.0


def test_the_law_sees_the_measurement_and_the_plant_the_truth():
    only_g = PID | {'k_P': 0.0, 'k_I': 0.0, 'k_D': 0.0, 'k_FF': 0.0}
    sensors = {'attitude_noise': [0.1, 0.2, 0.3], 'velocity_noise': 5.0}
    seen = run(off_centre(), only_g, 'zoh', sensors=sensors, duration=0.1, initial=TURNED)
    mats = reference.vehicle_matrices(off_centre())
    for k in range(11):
        g = reference.restoring(mats, seen['eta_measured'][k])
        assert_allclose(seen['tau'][k], g, atol=1e-8)
    assert_allclose(seen['F'], 0.0, atol=1e-8)
    assert np.abs(seen['nu']).max() < 1.0


def test_noise_depends_on_the_seed_alone():
    sensors = {'velocity_noise': 0.1}
    one, same, other = (
        run(off_centre(), PAPER | {'law': 'gvc'}, 'zoh', sensors=sensors, seed=seed, duration=0.1)
        for seed in (1, 1, 2)
    )
    assert_array_equal(one['nu_measured'], same['nu_measured'])
    assert np.abs(one['nu_measured'] - other['nu_measured']).max() > 0.01
