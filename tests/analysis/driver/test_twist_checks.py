"""Twist against pose: each usual mistake is told by its name, with noise as without it."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace as Made

import numpy as np
import pytest
from helpers.made_odometry import found_in as found_by
from helpers.made_odometry import graph, motion, odometry_log
from scipy.signal import lfilter

from auv_analysis.driver.checks import CHECKS
from auv_analysis.driver.evidence import (
    FAIL,
    NOT_CHECKED,
    PASS,
    CheckResult,
    DriverRecord,
    Settings,
)
from auv_analysis.driver.twist_checks import _rms
from auv_analysis.metrics.pose_twist import ANGULAR, CHILD, LINEAR, TwistFit, fit_readings
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.frames import swap_attitude, swap_body, swap_position, swap_state
from auv_dynamics.vehicle.kinematics import euler, rotation

pytestmark = pytest.mark.usefixtures('approved')

MOTION = [id for id, check in CHECKS.items() if check.group == 'motion']
NOISES = (0.0, 0.01)  # m, rad, m/s, rad/s


def found_in(x: np.ndarray, rate: float = 50.0) -> dict[str, CheckResult]:
    return found_by(odometry_log(x, rate), *MOTION)


def with_parts(x: np.ndarray, **parts: np.ndarray) -> np.ndarray:
    """The same states with position p, quaternion q, velocity v or angular velocity w replaced."""
    x = x.copy()
    for name, where in {'p': (0, 3), 'q': (3, 7), 'v': (7, 10), 'w': (10, 13)}.items():
        if name in parts:
            x[:, slice(*where)] = parts[name]
    return x


def in_world(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.einsum('nij,nj->ni', rotation(x[:, 3:7]), v)


def euler_rates(x: np.ndarray) -> np.ndarray:
    phi, theta, _ = euler(x[:, 3:7]).T
    p, q, r = x[:, 10:].T
    psi_rate = (q * np.sin(phi) + r * np.cos(phi)) / np.cos(theta)
    return np.stack(
        [p + psi_rate * np.sin(theta), q * np.cos(phi) - r * np.sin(phi), psi_rate], axis=1
    )


def flu(x: np.ndarray) -> np.ndarray:
    return swap_body(x[:, 7:])


MISTAKES: dict[str, tuple[Callable[[np.ndarray], np.ndarray], str, str]] = {
    'world': (
        lambda x: with_parts(x, v=in_world(x, x[:, 7:10])),
        'twist_frame',
        'the axes of header.frame_id',
    ),
    'world, angular': (
        lambda x: with_parts(x, w=in_world(x, x[:, 10:])),
        'angular_frame',
        'the axes of header.frame_id',
    ),
    'flu': (lambda x: with_parts(x, v=flu(x)[:, :3]), 'twist_frame', 'forward-left-up'),
    'flu, angular': (lambda x: with_parts(x, w=flu(x)[:, 3:]), 'angular_frame', 'forward-left-up'),
    'pose alone in ENU': (
        lambda x: with_parts(swap_state(x), v=x[:, 7:10], w=x[:, 10:]),
        'twist_frame',
        'forward-left-up',
    ),
    'position in ENU': (
        lambda x: with_parts(x, p=swap_position(x[:, :3])),
        'twist_frame',
        'the position is east-north-up',
    ),
    'attitude in ENU': (
        lambda x: with_parts(x, q=swap_attitude(x[:, 3:7])),
        'twist_frame',
        'the attitude is of FLU in ENU',
    ),
    'world in ENU': (
        lambda x: with_parts(x, v=swap_position(in_world(x, x[:, 7:10]))),
        'twist_frame',
        'east-north-up, not the axes of child_frame_id',
    ),
    'z up': (
        lambda x: with_parts(x, p=x[:, :3] * [1.0, 1.0, -1.0]),
        'twist_frame',
        'grows upwards',
    ),
    'w first': (
        lambda x: with_parts(x, q=np.roll(x[:, 3:7], 1, axis=1)),
        'twist_frame',
        'w first',
    ),
    'w first, angular': (
        lambda x: with_parts(x, q=np.roll(x[:, 3:7], 1, axis=1)),
        'angular_frame',
        'w first',
    ),
    'inverse': (
        lambda x: with_parts(x, q=x[:, 3:7] * [1.0, -1.0, -1.0, -1.0]),
        'twist_frame',
        'from earth to body',
    ),
    'degrees': (lambda x: with_parts(x, w=np.degrees(x[:, 10:])), 'angular_frame', 'deg/s'),
    'knots': (lambda x: with_parts(x, v=x[:, 7:10] / 0.5144), 'twist_frame', 'multiplied by 0.51'),
    'through the water': (
        lambda x: with_parts(x, p=x[:, :3] + np.arange(len(x))[:, None] * [0.003, 0.002, 0.0]),
        'twist_frame',
        'a current',
    ),
    'no twist': (
        lambda x: with_parts(x, v=np.zeros((len(x), 3))),
        'twist_frame',
        'the twist stands still',
    ),
    'no attitude': (
        lambda x: with_parts(x, q=np.tile([1.0, 0.0, 0.0, 0.0], (len(x), 1))),
        'angular_frame',
        'the pose stands still',
    ),
}


@pytest.mark.parametrize('strays', [(0, [0, 1]), (498, [10**18, 2 * 10**18])])
def test_the_motion_tells_what_it_tells_beside_stray_stamps(strays: tuple[int, list[int]]) -> None:
    heard = odometry_log(motion(noise=1e-4))
    stamps, (k, ns) = heard.stamp_ns.copy(), strays
    stamps[k : k + 2] = ns if k == 0 else stamps[k - 1] + np.array(ns)
    found = found_by(replace(heard, stamp_ns=stamps), 'stamps', 'jumps', *MOTION)
    assert {id for id, one in found.items() if one.verdict == FAIL} == {'stamps'}
    assert found['twist_frame'].verdict == found['axis_yaw'].verdict == PASS
    heard.x[k, 7] = 21.0
    fast = found_by(replace(heard, stamp_ns=stamps), 'speeds')['speeds']
    assert fast.verdict == FAIL, 'the controller would refuse it all the same'


@pytest.mark.parametrize('noise', NOISES)
@pytest.mark.parametrize('mistake', MISTAKES)
def test_a_mistake_is_told_by_its_name(mistake: str, noise: float) -> None:
    make, id, words = MISTAKES[mistake]
    finding = found_by(odometry_log(make(motion(noise=noise))), id)[id]
    assert finding.verdict == FAIL
    assert words in finding.found
    assert finding.advice


@pytest.mark.parametrize('noise', NOISES)
@pytest.mark.parametrize(
    ('rate', 'heading'), [(10.0, -2.5), (50.0, -2.5), (50.0, 0.7), (50.0, 3.1), (200.0, 3.1)]
)
def test_a_healthy_driver_passes(noise: float, rate: float, heading: float) -> None:
    found = found_in(motion(rate=rate, heading=heading, noise=noise), rate)
    for id in ('twist_frame', 'angular_frame'):
        assert found[id].verdict == PASS, found[id]
    for dof in DOFS:
        # at 10 Hz so much noise hides the smaller motions
        assert found[f'axis_{dof}'].verdict in ((PASS, NOT_CHECKED) if noise else (PASS,))


def test_rates_of_angles_are_told_where_the_vehicle_tilts() -> None:
    x = motion(speed=4.0)
    finding = found_in(with_parts(x, w=euler_rates(x)))['angular_frame']
    assert finding.verdict == FAIL
    assert 'rates of roll, pitch and yaw' in finding.found


def test_everything_in_ros_axes_is_consistent_and_passes() -> None:
    found = found_in(swap_state(motion()))  # its frame ids are what tells it: see `frames`
    assert found['twist_frame'].verdict == found['angular_frame'].verdict == PASS


@pytest.mark.parametrize('noise', NOISES)
def test_a_vehicle_at_rest_tells_nothing(noise: float) -> None:
    found = found_in(motion(speed=0.01, noise=noise))
    assert found.pop('velocity_bias').verdict == PASS
    assert {one.verdict for one in found.values()} == {NOT_CHECKED}
    assert 'moved too little' in found['twist_frame'].found
    assert 'move the vehicle' in found['twist_frame'].advice


def test_child_and_world_are_one_while_it_heads_north() -> None:
    x = motion(heading=0.0, speed=0.2)
    for states in (x, with_parts(x, v=in_world(x, x[:, 7:10]))):
        finding = found_in(states)['twist_frame']
        assert finding.verdict == NOT_CHECKED or 'header.frame_id' in finding.found
    assert 'turn the vehicle away from north' in found_in(x)['twist_frame'].advice


def test_a_single_reversed_axis_is_named() -> None:
    x = motion(noise=1e-3)
    x[:, 8] *= -1.0
    found = found_in(x)
    assert found['axis_sway'].verdict == FAIL
    assert found['axis_sway'].numbers['slope'] == pytest.approx(-1.0, abs=0.05)
    assert 'sign is reversed' in found['axis_sway'].advice
    assert found['axis_surge'].verdict == found['axis_heave'].verdict == PASS
    assert found['twist_frame'].verdict == FAIL


@pytest.mark.parametrize('seed', range(8))
def test_noise_in_place_of_a_component_has_no_sign(seed: int) -> None:
    x = motion(noise=1e-3)
    x[:, 8] = np.random.default_rng(seed).normal(0.0, 0.03, len(x))
    found = found_in(x)['axis_sway']
    assert found.verdict != PASS
    assert 'sign' not in found.advice


def test_degrees_are_named_in_each_axis() -> None:
    x = motion()
    x[:, 10:] = np.degrees(x[:, 10:])
    found = found_in(x)
    for dof in DOFS[3:]:
        assert found[f'axis_{dof}'].verdict == FAIL
        assert 'deg/s' in found[f'axis_{dof}'].advice


def test_a_driver_without_a_position_is_not_blamed() -> None:
    x = motion()
    x[:, :3] = 0.0
    found = found_in(x)
    assert found['twist_frame'].verdict == found['axis_surge'].verdict == NOT_CHECKED
    assert found['angular_frame'].verdict == PASS


def test_stamps_that_stand_still_leave_the_times_of_publication() -> None:
    heard = odometry_log(motion())
    heard.stamp_ns[:] = heard.stamp_ns[0]
    heard.arrived_ns[:] = heard.arrived_ns[49::50].repeat(50)  # once per second, together
    finding = found_by(heard, 'twist_frame')['twist_frame']
    assert finding.verdict == PASS
    assert 'by the times of publication' in finding.found


def test_broken_messages_are_left_out_and_few_tell_nothing() -> None:
    x = motion()
    x[100:110, 8] = np.nan
    x[200, 3:7] = 0.0
    assert found_in(x)['twist_frame'].verdict == PASS
    assert {one.verdict for one in found_in(x[:5]).values()} == {NOT_CHECKED}


def test_messages_that_were_sent_together_are_one_and_times_rise() -> None:
    heard = odometry_log(motion())
    heard.stamp_ns[:] = heard.stamp_ns[0]
    heard.published_ns[10] = heard.published_ns[9] - 5
    heard.published_ns[12] = heard.published_ns[11]
    heard.x[20, 3:7] *= 1.05
    heard.x[21, 3:7] *= 1.2  # which is no attitude
    m = DriverRecord(graph(), heard, Settings()).motion
    kept = np.delete(np.arange(500), [10, 12, 21])
    assert m.by_publication
    np.testing.assert_allclose(m.t, (heard.published_ns[kept] - heard.published_ns[0]) / 1e9)
    np.testing.assert_array_equal(m.nu, heard.x[kept, 7:])
    np.testing.assert_allclose(np.linalg.norm(m.q, axis=1), 1.0)


def test_what_came_before_the_first_wrench_is_uncommanded() -> None:
    heard = odometry_log(motion())
    steps = [(int(heard.arrived_ns[40]), (0.0,) * 6), (int(heard.arrived_ns[60]), (1.0,) * 6)]
    excitation = Made(sent=[Made(steps=[]), Made(steps=steps)])
    for sent, count in ((None, 500), (Made(sent=[]), 500), (excitation, 40)):
        evidence = DriverRecord(graph(), heard, Settings(), sent)
        assert evidence.uncommanded.tolist() == [i < count for i in range(500)]


@pytest.mark.parametrize(
    ('child', 'flu', 'right', 'others'),
    [(0.3, 0.25, True, ['flu']), (0.31, 0.25, False, ['flu']), (0.2, 0.05, True, ['flu']),
     (0.21, 0.05, False, ['flu']), (0.1, 0.01, True, ['flu']), (0.01, 0.11, True, []),
     (0.05, 0.4, True, [])],
)  # fmt: skip
def test_a_reading_is_possible_where_it_fits_and_none_fits_far_better(
    child: float, flu: float, right: bool, others: list[str]
) -> None:
    fit = TwistFit(0.1, 0.2, 0.0, {CHILD: child, 'flu': flu}, (0.0,) * 3, 0.0, 1.0, 0.0)
    assert (fit.right, fit.others) == (right, others)
    assert fit.best == ('flu' if flu < child else CHILD)


@pytest.mark.parametrize(
    ('speeds', 'noise', 'told'),
    [((0.03, 0.01), 0.02, True), ((0.01, 0.03), 0.02, True), ((0.03, 0.03), 0.03, False),
     ((0.02, 0.01), 0.0, False)],
)  # fmt: skip
def test_axes_are_told_by_motion_beyond_its_noise(speeds, noise: float, told: bool) -> None:
    assert TwistFit(*speeds, noise, {CHILD: 0.0}, (0.0,) * 3, 0.0, 1.0, 0.0).told is told


def test_the_right_reading_fits_and_all_others_do_not() -> None:
    heard = odometry_log(motion(speed=3.0, noise=1e-3))
    m = DriverRecord(graph(), heard, Settings()).motion
    for readings in (LINEAR, ANGULAR):
        fits = fit_readings(m, readings)
        assert fits.best == CHILD
        assert fits.right
        assert not fits.others
        assert fits.off[CHILD] < 0.03


def at_rest(seconds: float = 10.0, rate: float = 50.0) -> np.ndarray:
    """States (n, 13) of a vehicle that hangs still, noise of an estimator in it."""
    random, n = np.random.default_rng(5), round(seconds * rate)
    x = np.tile([3.0, -2.0, 5.0, 0.92, 0.0, 0.0, 0.392, *np.zeros(6)], (n, 1))
    x[:, 3:7] /= np.linalg.norm(x[0, 3:7])
    x[:, :3] += random.normal(0.0, 0.003, (n, 3))
    x[:, 7:] += random.normal(0.0, 0.003, (n, 6))
    return x


def wander(n: int, size: float, last: float = 1.0, rate: float = 50.0) -> np.ndarray:
    """First-order autoregressive noise (n,) of a standard deviation, that lasts for some s."""
    rho = np.exp(-1.0 / (last * rate))
    draw = np.random.default_rng(8).normal(0.0, size * np.sqrt(1.0 - rho**2), n)
    return lfilter([1.0], [1.0, -rho], draw)


def test_a_biased_velocity_is_told_from_a_current_by_the_position_at_rest() -> None:
    x = at_rest()
    bias = np.array([0.03, -0.02, 0.01])
    finding = found_in(with_parts(x, v=x[:, 7:10] + bias))
    found = finding['velocity_bias']
    assert found.verdict == FAIL
    assert 'velocity of the estimator is biased by 0.037' in found.found
    assert 'surge +0.030, sway -0.020 and heave +0.010' in found.found
    assert all('current' not in one.found for one in finding.values())
    flow = np.array([0.05, 0.02, 0.0])
    way = x[:, :3] + np.arange(len(x))[:, None] / 50.0 * flow
    through_water = found_in(with_parts(x, p=way))['velocity_bias']
    assert through_water.verdict == FAIL
    assert 'a current, or a moving origin' in through_water.found
    v = np.einsum('nji,j->ni', rotation(x[:, 3:7]), flow) + x[:, 7:10]
    carried = found_in(with_parts(x, p=way, v=v))['velocity_bias']
    assert carried.verdict == PASS
    assert 'which agree: a current, or a moving origin' in carried.found


@pytest.mark.parametrize(
    ('moves', 'verdict'), [(slice(0, 300), FAIL), (slice(400, 500), NOT_CHECKED)]
)
def test_a_vehicle_that_was_moved_is_at_rest_where_it_is_so_in_the_end(moves, verdict) -> None:
    x = at_rest()
    x[:, 7] += 0.05
    x[moves, 8] += 0.3 * np.sin(np.arange(500)[moves] / 20.0)
    assert found_by(odometry_log(x), 'velocity_bias')['velocity_bias'].verdict == verdict


def test_at_rest_nothing_is_told_of_a_bias_that_is_not_there() -> None:
    found = found_in(at_rest())['velocity_bias']
    assert found.verdict == PASS
    assert 'current' not in found.found


def test_a_position_that_is_too_noisy_tells_no_bias() -> None:
    x = at_rest()
    x[:, :3] += np.random.default_rng(6).normal(0.0, 3.0, (len(x), 3))
    found = found_by(odometry_log(x), 'velocity_bias')['velocity_bias']
    assert found.verdict == NOT_CHECKED
    assert 'too noisy' in found.found


@pytest.mark.parametrize('last', [0.0, 0.3, 1.0])
def test_noise_of_the_depth_at_rest_is_no_false_alarm(last: float) -> None:
    x = at_rest()
    depth = wander(len(x), 0.2, last) if last else np.random.default_rng(4).normal(0, 0.2, len(x))
    x[:, 2] += depth
    heard = odometry_log(x)
    found = found_by(heard, *CHECKS)
    assert [id for id, one in found.items() if one.verdict == FAIL] == []


def test_the_strongest_part_of_a_few_samples_is_one_of_them() -> None:
    values = np.array([1.0, -3.0, 2.0])
    assert _rms(values[:2], 0.0) == 3.0
    assert _rms(np.repeat(values, 5), 5.0) == 2.0
