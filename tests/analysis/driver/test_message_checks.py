"""Frame ids and numbers of single messages."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.made_odometry import found_in as found_by
from helpers.made_odometry import healthy, motion, odometry_log

from auv_analysis.driver.evidence import FAIL, NOT_CHECKED, PASS, CheckResult
from auv_analysis.driver.odometry_log import OdometryBuffer, OdometryLog
from auv_dynamics.ros.interface import Frames
from auv_dynamics.vehicle.frames import swap_state

pytestmark = pytest.mark.usefixtures('approved')

SPEEDS = 'speeds', 'jumps'


def found_in(heard: OdometryLog, **settings: object) -> dict[str, CheckResult]:
    ids = 'frames', 'finite', 'quaternion_norm', 'upright', 'depth'
    return found_by(heard, *ids, **settings)


def test_a_healthy_recording_passes() -> None:
    found = found_in(healthy())
    assert {one.verdict for one in found.values()} == {PASS}
    assert not any(one.advice for one in found.values())


@pytest.mark.parametrize(
    ('pair', 'word'),
    [
        (('odom', 'base_link'), 'frame_converter_node'),
        (('world_enu', 'base_link_flu'), 'frame_converter_node'),
        (('auv1/map', 'auv1/base_link'), 'frame_converter_node'),
        (('ned_origin', 'body_frd'), 'odom_frame: ned_origin and base_frame: body_frd'),
        (('', ''), 'fill in header.frame_id'),
    ],
)
def test_other_frames_fail_with_advice(pair: tuple[str, str], word: str) -> None:
    finding = found_in(healthy(frames={pair: 500}))['frames']
    assert finding.verdict == FAIL
    assert repr(pair[0]) in finding.found
    assert 'header.frame_id odom_ned, child_frame_id base_link_fsd' in finding.expected
    assert word in finding.advice


def test_expected_frames_are_those_that_were_asked_for() -> None:
    heard = healthy(frames={('odom', 'base_link'): 500})
    assert found_in(heard, frames=Frames('odom', 'base_link'))['frames'].verdict == PASS


def test_frames_that_change_fail() -> None:
    frames = Frames()
    pairs = {(frames.odom, frames.base): 499, ('odom', frames.base): 1}
    assert found_in(healthy(frames=pairs))['frames'].verdict == FAIL


@pytest.mark.parametrize('bad', [np.nan, np.inf])
@pytest.mark.parametrize(
    ('column', 'name'),
    [(1, 'position'), (4, 'orientation'), (8, 'twist.linear'), (12, 'twist.angular')],
)
def test_numbers_that_are_not_finite_fail(bad: float, column: int, name: str) -> None:
    x = motion()
    x[7, column] = bad
    finding = found_in(odometry_log(x))['finite']
    assert finding.verdict == FAIL
    assert f'1 of 500 messages have numbers that are not, in {name}' in finding.found


def test_messages_that_are_none_of_their_type_count_beside_those_with_wrong_numbers() -> None:
    x = motion()
    x[7, 1] = np.nan
    for log, count in ((healthy(), 5), (odometry_log(x), 6)):
        finding = found_in(replace(log, unreadable={'/odom': 3, '/wrench_applied': 2}))['finite']
        assert finding.verdict == FAIL
        assert finding.numbers['messages'] == count
        assert '; 3 of /odom are no messages of its type' in finding.found


def test_what_is_taken_stands_in_the_log_under_its_name() -> None:
    buffer, ones = OdometryBuffer(), np.arange(13.0)
    for k in range(3):
        buffer.odometry(10 + k, 20 + k, 60 + k, tuple(k * ones), ('a', 'b' if k else 'c'), k)
        buffer.clock(30 + k, 40 + k)
        buffer.wrench_applied(50 + k, tuple(k * ones[:6]))
    for topic in ('/x', '/y', '/x'):
        buffer.unreadable(topic, None)
    log = buffer.log(1, 2_000_000_001)
    assert (log.began_ns, log.ended_ns, log.seconds) == (1, 2_000_000_001, 2.0)
    stamps = (
        log.arrived_ns, log.stamp_ns, log.published_ns, log.clock_arrived_ns, log.clock_ns
    )  # fmt: skip
    np.testing.assert_array_equal(stamps, np.add.outer([10, 20, 60, 30, 40], range(3)))
    np.testing.assert_array_equal(log.applied_arrived_ns, [50, 51, 52])
    np.testing.assert_array_equal(log.x, np.outer(range(3), ones))
    np.testing.assert_array_equal(log.applied, np.outer(range(3), ones[:6]))
    assert log.frames == {('a', 'c'): 1, ('a', 'b'): 2}
    assert log.unreadable == {'/x': 2, '/y': 1}
    np.testing.assert_array_equal(buffer.recent(2), log.x[1:])
    assert buffer.newest == (12, 22)


@pytest.mark.parametrize(('factor', 'verdict'), [(1.0009, PASS), (1.0011, FAIL), (0.5, FAIL)])
def test_the_norm_is_that_of_the_controller(factor: float, verdict: str) -> None:
    x = motion()
    x[10, 3:7] *= factor
    finding = found_in(odometry_log(x))['quaternion_norm']
    assert finding.verdict == verdict
    assert finding.numbers['largest_deviation'] == pytest.approx(abs(factor - 1.0))


def test_an_attitude_that_is_zero_is_told_as_such() -> None:
    x = motion()
    x[:, 3:7] = 0.0
    found = found_in(odometry_log(x))
    assert 'fill in pose.pose.orientation' in found['quaternion_norm'].advice
    assert found['upright'].verdict == NOT_CHECKED


def test_of_messages_without_finite_numbers_nothing_else_is_told() -> None:
    x = motion()
    x[:, 3] = np.nan
    found = found_in(odometry_log(x))
    for id in ('quaternion_norm', 'upright', 'depth'):
        assert found[id].verdict == NOT_CHECKED
        assert found[id].found in ('no message with finite numbers', 'no attitude')


def test_w_first_reads_as_a_vehicle_on_its_back() -> None:
    x = motion(heading=0.3)
    x[:, 3:7] = np.roll(x[:, 3:7], 1, axis=1)
    finding = found_in(odometry_log(x))['upright']
    assert finding.verdict == FAIL
    assert 'w written first' in finding.advice


def test_body_axes_with_z_up_read_as_a_vehicle_on_its_back() -> None:
    x = motion(heading=1.5)
    x[:, 3:7] = swap_state(x)[:, 3:7]  # of FLU in ENU: upright ...
    assert found_in(odometry_log(x))['upright'].verdict == PASS
    S = np.array([0.0, 1.0, 0.0, 0.0])
    w, q = x[:, 3], x[:, 4:7]
    x[:, 3], x[:, 4:7] = -q @ S[1:], w[:, None] * S[1:] + np.cross(q, S[1:])  # ... of FSD in ENU
    finding = found_in(odometry_log(x))['upright']
    assert finding.verdict == FAIL
    assert 'z up, as in FLU' in finding.advice


def test_a_position_above_its_origin_is_a_doubt_and_no_failure() -> None:
    x = motion()
    x[:, 2] *= -1.0
    finding = found_in(odometry_log(x))['depth']
    assert finding.verdict == NOT_CHECKED
    assert 'z is up' in finding.found
    x[-1, 2] = 0.1  # it has been on its way down
    assert found_in(odometry_log(x))['depth'].verdict == PASS


@pytest.mark.parametrize(
    ('column', 'value', 'id'),
    [(7, 21.0, 'speeds'), (11, 21.0, 'speeds'), (0, 9.0, 'jumps'), (9, 5.0, 'jumps')],
)
def test_speeds_and_steps_beyond_the_limits_of_the_controller_fail(
    column: int, value: float, id: str
) -> None:
    x = motion()
    x[50, column] += value
    found = found_by(odometry_log(x), *SPEEDS)
    assert found[id].verdict == FAIL


def test_finite_numbers_whose_squares_are_not_fail_in_words() -> None:
    x, frames, buffer = motion(), Frames(), OdometryBuffer()
    x[[50, 60, 70], [7, 11, 0]] = -1e300
    for ns, row in zip(odometry_log(x).stamp_ns.tolist(), x.tolist(), strict=True):
        buffer.odometry(ns, ns, ns, tuple(row), (frames.odom, frames.base), None)
        assert np.isfinite(np.linalg.norm(buffer.recent(1)))  # what MotionGuard looks at
    heard = buffer.log(buffer.newest[0] - 10**10, buffer.newest[0])
    found = found_by(heard, *SPEEDS, 'twist_frame', 'angular_frame', 'axis_surge')
    assert found['speeds'].verdict == found['jumps'].verdict == FAIL


def test_speeds_of_a_healthy_driver_pass() -> None:
    found = found_by(healthy(), *SPEEDS)
    assert {one.verdict for one in found.values()} == {PASS}
    few = found_by(odometry_log(motion()[:5]), *SPEEDS)
    assert {one.verdict for one in few.values()} == {NOT_CHECKED}


def test_times_of_arrival_are_no_measure_of_a_step() -> None:
    heard = healthy()
    found = found_by(healthy(stamp_ns=np.full_like(heard.stamp_ns, heard.stamp_ns[0])), *SPEEDS)
    assert found['jumps'].verdict == NOT_CHECKED
    assert found['speeds'].verdict == PASS


def test_two_sources_in_turn_are_no_noise() -> None:
    x = motion()
    x[::2, 0] += 1.0
    assert found_by(odometry_log(x), *SPEEDS)['jumps'].verdict == FAIL
