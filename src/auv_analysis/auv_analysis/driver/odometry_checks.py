"""Odometry checks: frames, numbers, rate and stamps of the messages.

Frame ids, finite numbers, attitude and position; speeds and steps within the plausibility limits
of the controller; when messages come, and what their stamps say.
"""

import numpy as np

from auv_analysis.driver.evidence import CheckResult, DriverRecord, judged, unchecked
from auv_analysis.metrics.pose_twist import w_first
from auv_analysis.output.text import join, number
from auv_dynamics.ros.interface import NANOSECONDS, ODOM, UNIT
from auv_dynamics.vehicle.frames import ENU_FLU, named_axes
from auv_dynamics.vehicle.kinematics import rotation

USUAL = {ODOM, 'map', 'world', 'earth', 'base_link', 'base_footprint'}  # in ROS: ENU and FLU
BETWEEN = 'put frame_converter_node between the driver and our nodes'
BEYOND = 10.0  # times the median deviation of a step: nearly seven standard deviations
IN_TURN = -0.75  # correlation of a step with the next: white noise has -0.5, two sources in turn -1
FELL_OVER = 75.0  # deg from upright that no vehicle has at a check
FLOATS = 40.0  # deg that it may have
ABOVE = 0.5  # m above the origin that are worth a word
PARTS = {  # columns of a state
    'position': slice(3),
    'orientation': slice(3, 7),
    'twist.linear': slice(7, 10),
    'twist.angular': slice(10, 13),
}


def frames(evidence: DriverRecord) -> CheckResult:
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


def finite(evidence: DriverRecord) -> CheckResult:
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


def quaternion_norm(evidence: DriverRecord) -> CheckResult:
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


def upright(evidence: DriverRecord) -> CheckResult:
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


def depth(evidence: DriverRecord) -> CheckResult:
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


def speeds(evidence: DriverRecord) -> CheckResult:
    """Plausible speeds."""
    settings, log = evidence.settings, evidence.log
    linear, angular = _largest_halves(log.x[log.finite, 7:])
    return judged(
        linear <= settings.speed and angular <= settings.turning,
        f'at most {settings.speed:g} m/s and {settings.turning:g} rad/s',
        f'largest {number(linear)} m/s and {number(angular)} rad/s',
        'units: m/s and rad/s; what is above is refused by the controller (limits.speed, .rate)',
        linear=linear,
        angular=angular,
    )


def jumps(evidence: DriverRecord) -> CheckResult:
    """Plausible steps between messages."""
    motion, settings = evidence.motion, evidence.settings
    speed, turning, acceleration = settings.speed, settings.turning, settings.acceleration
    expected = f'at most {speed:g} m/s and {turning:g} rad/s by the pose, '
    expected += f'{acceleration:g} m/s2 and rad/s2 by the twist'
    if motion.by_publication:
        why = 'the stamps do not rise, and times of publication are no measure of a step'
        return unchecked(expected, why)
    apart = np.diff(motion.t)[:, None]
    steps = np.diff(motion.p, axis=0)
    apart_from = steps - np.median(steps, axis=0)  # noise of the position makes no speed
    noise = BEYOND * np.median(np.abs(apart_from), axis=0)
    to_and_fro = (apart_from[1:] * apart_from[:-1]).sum(axis=0)
    noise[to_and_fro < IN_TURN * (apart_from**2).sum(axis=0)] = 0.0
    position = _largest(np.maximum(np.abs(steps) - noise, 0.0) / apart)
    attitude = _largest(np.diff(motion.turned, axis=0) / apart)
    linear, angular = _largest_halves(np.diff(motion.nu, axis=0) / apart)
    return judged(
        position <= speed and attitude <= turning and max(linear, angular) <= acceleration,
        expected,
        f'position {number(position)} m/s beyond its noise, attitude {number(attitude)} rad/s, '
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


ENOUGH = 5  # messages within the controller's odometry_timeout: one or two may then be lost
RATE_WITHIN = 0.1  # of the promised rate
SAME_EPOCH = 86_400.0  # s: clocks that are further apart count from different beginnings
AHEAD = 0.02  # s that clocks of two machines may be apart
FRESH = 0.5  # of odometry_timeout that 95 % of the ages stay below
DRIFT = 5e-3  # s per s
SURE = 3.0  # standard errors
FEW = 20  # messages, of fewer no drift is told
MUTE = 'no odometry came, though it is announced'
SPANS = 8  # parts of the time, for the drift
MS = 1e3


def rate(evidence: DriverRecord) -> CheckResult:
    """Rate."""
    log, settings = evidence.log, evidence.settings
    least = ENOUGH / settings.timeout
    expected = f'at least {least:g} Hz, {ENOUGH} messages in odometry_timeout'
    if settings.rate:
        expected = f'{settings.rate:g} Hz within {100 * RATE_WITHIN:g} %'
    n, arrived = len(log.arrived_ns), log.arrived_ns
    advice = 'publish at a steady rate from a timer or from the fastest sensor'
    if not n:
        advice = 'does the driver wait for something before it publishes?'
        return judged(False, expected, MUTE, advice, messages=0)
    if n < 3:
        found = f'{n} messages in {log.seconds:.1f} s'
        return judged(False, expected, found, advice, messages=n)
    apart = np.diff(np.sort(arrived)) / NANOSECONDS
    hertz = float((n - 1) / apart.sum()) if apart.sum() > 0 else float('inf')
    low, middle, high = (float(value) for value in np.percentile(apart, [1, 50, 99]))
    found = (
        f'{hertz:.1f} Hz; {low * MS:.1f}, {middle * MS:.1f}, {high * MS:.1f} ms apart '
        '(1, 50, 99 % of the messages)'
    )
    good = hertz >= least
    if settings.rate:
        good = abs(hertz - settings.rate) <= RATE_WITHIN * settings.rate
    return judged(
        good, expected, found, advice, rate_hz=hertz, messages=n, apart_1_percent_s=low,
        apart_median_s=middle, apart_99_percent_s=high, jitter_s=float(apart.std()),
    )  # fmt: skip


def gaps(evidence: DriverRecord) -> CheckResult:
    """Longest silence."""
    log, settings = evidence.log, evidence.settings
    expected = f'never {settings.timeout:g} s without odometry (odometry_timeout)'
    ends = np.concatenate([np.sort(log.arrived_ns), [log.ended_ns]])
    longest = float(np.diff(ends).max()) / NANOSECONDS
    found = f'longest silence {longest:.3f} s, {log.lost} messages lost on the way'
    advice = 'the controller lets go in such a silence: what blocks the driver, or the network?'
    return judged(longest < settings.timeout, expected, found, advice, longest_s=longest,
                  lost=log.lost)  # fmt: skip


def stamps(evidence: DriverRecord) -> CheckResult:
    """Order of the stamps."""
    log, settings = evidence.log, evidence.settings
    expected = f'rising from message to message, by {settings.gap:g} s at most, none zero'
    ns = log.stamp_ns
    steps = np.diff(ns)
    same, back = int((steps == 0).sum()), int((steps < 0).sum())
    far, zero = int((steps > settings.gap * NANOSECONDS).sum()), int((ns == 0).sum())
    zero = max(zero - 1, 0)  # a clock that begins at zero says so once
    negative = int((ns < 0).sum())
    parts = {'repeated': same, 'going back': back, 'leaping ahead': far, 'zero': zero,
             'negative or with 1e9 ns and more': negative}  # fmt: skip
    told = [f'{count} {word}' for word, count in parts.items() if count]
    found = f'{len(ns)} stamps, {join(told) if told else "each later than the one before"}'
    if zero or negative or (len(steps) and same == len(steps)):
        advice = 'stamp each message with the time at which its numbers were measured'
    elif same:
        advice = 'publish each measurement once: the controller refuses a stamp that it has seen'
    elif back:
        advice = 'publish in the order of the stamps, from a clock that is never set back'
    else:
        advice = f'a longer jump than limits.gap, {settings.gap:g} s, is bridged and not integrated'
    return judged(not told, expected, found, advice, repeated=same, back=back, far=far,
                  zero=zero, negative=negative)  # fmt: skip


def reference_ns(evidence: DriverRecord) -> tuple[np.ndarray, float]:
    """Time (n,) in ns that our nodes' clock showed at each arrival, NaN before it began; its step.

    With simulated time the clock shows the last /clock that came before, a step of it in s.
    """
    log, arrived = evidence.log, evidence.log.arrived_ns
    if not evidence.settings.sim_time:
        return arrived.astype(float), 0.0
    shown, at = log.clock_ns, log.clock_arrived_ns
    if not len(shown):
        return np.full(len(arrived), np.nan), 0.0
    last = np.searchsorted(at, arrived, side='right') - 1
    time = np.where(last >= 0, shown[np.maximum(last, 0)].astype(float), np.nan)
    steps = np.diff(shown)
    return time, float(np.median(steps)) / NANOSECONDS if len(steps) else 0.0


def age(evidence: DriverRecord) -> CheckResult:
    """Age of the stamps."""
    log, settings = evidence.log, evidence.settings
    most = FRESH * settings.timeout
    expected = f'95 % younger than {most:g} s, none from the future'
    now, step = reference_ns(evidence)
    known = np.isfinite(now)
    if not known.any():
        return unchecked(expected, 'no /clock was heard before the odometry')
    ages = (now[known] - log.stamp_ns[known]) / NANOSECONDS
    low, middle, high = (float(value) for value in np.percentile(ages, [5, 50, 95]))
    numbers = {'age_5_percent_s': low, 'age_median_s': middle, 'age_95_percent_s': high}
    if abs(middle) > SAME_EPOCH:
        since = 'the start of the computer' if log.stamp_ns[-1] < 1e17 else 'another day'
        found = (
            f'not comparable: another epoch, stamps count from {since}; the oldest is '
            f'{float(ages.max() - ages.min()) * MS:.1f} ms later on its way than the freshest'
        )
        advice = (
            'stamp with the system time, disciplined by NTP or PTP; else give the controller '
            'stamp_clock: own, and --use-sim-time here if it is a simulation'
        )
        return unchecked(expected, found, advice, **numbers)
    found = f'{middle * MS:.1f} ms (median), {low * MS:.1f} to {high * MS:.1f} ms (5 to 95 %)'
    ahead = low < -AHEAD - 2.0 * step
    advice = 'publish at once what was measured; are the clocks of both computers disciplined?'
    if ahead:
        advice = 'the clock of the driver is ahead of ours: discipline both by NTP or PTP'
    return judged(high <= most and not ahead, expected, found, advice, **numbers)


def drift(evidence: DriverRecord) -> CheckResult:
    """Speed of their clock."""
    log, settings = evidence.log, evidence.settings
    clock = 'simulated time' if settings.sim_time else 'the time of arrival'
    expected = f'stamps as fast as {clock} within {DRIFT:g} s/s'
    now, _ = reference_ns(evidence)
    known = np.isfinite(now)
    t, stamped = now[known], log.stamp_ns[known].astype(float)
    if len(t) < FEW or np.ptp(t) == 0.0 or np.ptp(stamped) == 0.0:
        return unchecked(expected, 'too few stamps that differ')
    t, late = (t - t[0]) / NANOSECONDS, (t - stamped - (t[0] - stamped[0])) / NANOSECONDS
    # whatever keeps messages waiting makes them later: of each part of the time the freshest one
    parts = np.array_split(np.arange(len(t)), SPANS)
    freshest = [part[np.argmin(late[part])] for part in parts]
    if np.ptp(t[freshest]) == 0.0:
        return unchecked(expected, f'{clock} stood still')
    (slope, _), covariance = np.polyfit(t[freshest], late[freshest], 1, cov=True)
    faster, error = 0.0 - float(slope), float(np.sqrt(covariance[0, 0]))
    found = f'{faster:+.2g} s/s, standard error {error:.1g}'
    advice = 'is the stamp a time in seconds and nanoseconds, of a clock that is not simulated?'
    good = abs(faster) <= DRIFT + SURE * error
    return judged(good, expected, found, advice, drift=faster, standard_error=error)
