"""Frame checks and number checks: what stands in the messages, and in two that follow each other.

Frame ids, finite numbers, attitude and position; speeds and steps within the plausibility limits
of the controller.
"""

import numpy as np

from auv_analysis.driver.evidence import Evidence, Finding, judged, unchecked
from auv_analysis.metrics.pose_twist import w_first
from auv_analysis.output.text import join, number
from auv_dynamics.ros.interface import ODOM, UNIT
from auv_dynamics.vehicle.frames import ENU_FLU, named_axes
from auv_dynamics.vehicle.kinematics import rotation

USUAL = {ODOM, 'map', 'world', 'earth', 'base_link', 'base_footprint'}  # in ROS: ENU and FLU
BETWEEN = 'put frame_converter_node between the driver and our nodes'
FELL_OVER = 75.0  # deg from upright that no vehicle has at a check
FLOATS = 40.0  # deg that it may have
ABOVE = 0.5  # m above the origin that are worth a word
PARTS = {  # columns of a state
    'position': slice(3),
    'orientation': slice(3, 7),
    'twist.linear': slice(7, 10),
    'twist.angular': slice(10, 13),
}


def frames(evidence: Evidence) -> Finding:
    """Frame ids."""
    expected_pair = (evidence.settings.frames.odom, evidence.settings.frames.base)
    expected = f'header.frame_id {expected_pair[0]}, child_frame_id {expected_pair[1]}'
    counted = evidence.log.frames
    pairs = sorted(counted, key=lambda pair: -counted[pair])
    found = join([f'{header!r} and {child!r}' for header, child in pairs[:3]])
    if len(pairs) > 1:
        found += f': {len(pairs)} pairs in turn'
    header, child = pairs[0]
    words = {name.rpartition('/')[2] for name in (header, child)}
    advice = 'if the axes are NED and FSD, '
    if named_axes(header) == ENU_FLU or named_axes(child) == ENU_FLU or words & USUAL:
        advice = f'if its axes are ENU and FLU, as usual in ROS, {BETWEEN}; '
        advice += 'if they are NED and FSD all the same, '
    advice += f'give our nodes odom_frame: {header or "..."} and base_frame: {child or "..."}'
    if not (header and child):
        advice = 'fill in header.frame_id and child_frame_id: without them no axes are told'
    return judged(pairs == [expected_pair], expected, found, advice, pairs=len(pairs))


def finite(evidence: Evidence) -> Finding:
    """Finite numbers."""
    log = evidence.log
    bad, n = int((~log.finite).sum()), len(log.x)
    found = f'{bad} of {n} messages have numbers that are not'
    if bad:
        broken = [name for name, part in PARTS.items() if not np.isfinite(log.x[:, part]).all()]
        found += f', in {join(broken)}'
    for topic, count in log.unreadable.items():
        found += f'; {count} of {topic} are no messages of its type'
        bad += count
    advice = 'publish nothing while there is no measurement: the controller refuses such messages'
    return judged(not bad, 'finite numbers in every message', found, advice, messages=bad)


def quaternion_norm(evidence: Evidence) -> Finding:
    """Unit quaternion."""
    expected = f'a norm within {UNIT:g} of 1, as the controller requires'
    q = evidence.log.x[evidence.log.finite, 3:7]
    if not len(q):
        return unchecked(expected, 'no message with finite numbers')
    off = np.abs(np.linalg.norm(q, axis=1) - 1.0)
    worst, bad = float(off.max()), int((off > UNIT).sum())
    found = f'largest deviation {worst:.2g}; {bad} of {len(q)} messages beyond'
    advice = 'normalise the quaternion'
    if (np.abs(q) < UNIT).all():
        advice = 'fill in pose.pose.orientation: it is zero, which is no attitude'
    return judged(not bad, expected, found, advice, largest_deviation=worst)


def upright(evidence: Evidence) -> Finding:
    """Attitude of a vehicle afloat."""
    expected = f'at most {FELL_OVER:g} deg from upright, by the median'
    q = evidence.log.x[evidence.log.finite, 3:7]
    norm = np.linalg.norm(q, axis=1, keepdims=True)
    q = q[norm[:, 0] > 0.5] / norm[norm[:, 0] > 0.5]
    if not len(q):
        return unchecked(expected, 'no attitude')
    tilt, otherwise = _tilt(q), _tilt(w_first(q))
    advice = 'body axes with z up, as in FLU? turn them to forward-starboard-down, or '
    advice += BETWEEN
    if otherwise < FLOATS:
        advice = f'w written first into x? read so it is {otherwise:.1f} deg; else {advice}'
    numbers = {'tilt_deg': tilt, 'tilt_w_first_deg': otherwise}
    return judged(tilt <= FELL_OVER, expected, f'{tilt:.1f} deg', advice, **numbers)


def _tilt(q: np.ndarray) -> float:
    """Median angle in deg between the body's z and that of the earth: quaternions (n, 4)."""
    return float(np.degrees(np.median(np.arccos(np.clip(rotation(q)[:, 2, 2], -1.0, 1.0)))))


def depth(evidence: Evidence) -> Finding:
    """Direction of z."""
    expected = 'z is down: not above its origin throughout'
    z = evidence.log.x[evidence.log.finite, 2]
    if not len(z):
        return unchecked(expected, 'no message with finite numbers')
    low, high = float(z.min()), float(z.max())
    found = f'z from {number(low)} to {number(high)} m'
    if high < -ABOVE:
        why = f'{found}: above the origin throughout; if the vehicle was below it, z is up'
        advice = 'compare with the depth sensor: NED has z down'
        return unchecked(expected, why, advice, lowest=low, highest=high)
    return judged(True, expected, found, lowest=low, highest=high)


def speeds(evidence: Evidence) -> Finding:
    """Plausible speeds."""
    settings = evidence.settings
    linear, angular = _largest_halves(evidence.motion.nu)
    return judged(
        linear <= settings.speed and angular <= settings.turning,
        f'at most {settings.speed:g} m/s and {settings.turning:g} rad/s',
        f'largest {number(linear)} m/s and {number(angular)} rad/s',
        'units: m/s and rad/s; what is above is refused by the controller (limits.speed, .rate)',
        linear=linear,
        angular=angular,
    )


def jumps(evidence: Evidence) -> Finding:
    """Plausible steps between messages."""
    motion, settings = evidence.motion, evidence.settings
    speed, turning, acceleration = settings.speed, settings.turning, settings.acceleration
    expected = f'at most {speed:g} m/s and {turning:g} rad/s by the pose, '
    expected += f'{acceleration:g} m/s2 and rad/s2 by the twist'
    if motion.by_arrival:
        why = 'the stamps do not rise, and times of arrival are no measure of a step'
        return unchecked(expected, why)
    apart = np.diff(motion.t)[:, None]
    position = _largest(np.diff(motion.p, axis=0) / apart)
    attitude = _largest(np.diff(motion.turned, axis=0) / apart)
    linear, angular = _largest_halves(np.diff(motion.nu, axis=0) / apart)
    return judged(
        position <= speed and attitude <= turning and max(linear, angular) <= acceleration,
        expected,
        f'position {number(position)} m/s, attitude {number(attitude)} rad/s, '
        f'twist {number(linear)} m/s2 and {number(angular)} rad/s2',
        'a filter that is reset, two sources in turn, or an angle that leaps: smooth or refuse',
        position=position,
        attitude=attitude,
        linear=linear,
        angular=angular,
    )


def _largest_halves(rows: np.ndarray) -> tuple[float, float]:
    """Largest size of the linear and of the angular half of rows (n, 6)."""
    return _largest(rows[:, :3]), _largest(rows[:, 3:])


def _largest(rows: np.ndarray) -> float:
    return float(np.linalg.norm(rows, axis=1).max(initial=0.0))
