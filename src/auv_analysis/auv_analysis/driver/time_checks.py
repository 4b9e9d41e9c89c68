"""Time checks: when messages come, and what their stamps say."""

import numpy as np

from auv_analysis.driver.evidence import Evidence, Finding, judged, unchecked
from auv_analysis.output.text import join
from auv_dynamics.ros.interface import NANOSECONDS

ENOUGH = 5  # messages within the controller's odometry_timeout: one or two may then be lost
RATE_WITHIN = 0.1  # of the promised rate
SAME_EPOCH = 86_400.0  # s: clocks that are further apart count from different beginnings
AHEAD = 0.02  # s that clocks of two machines may be apart
FRESH = 0.5  # of odometry_timeout that 95 % of the ages stay below
DRIFT = 5e-3  # s per s
SURE = 3.0  # standard errors
FEW = 20  # messages, of fewer no drift is told
MUTE = 'no odometry came, though it is announced'
PARTS = 8  # of the time, for the drift
MS = 1e3


def rate(evidence: Evidence) -> Finding:
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


def gaps(evidence: Evidence) -> Finding:
    """Longest silence."""
    log, settings = evidence.log, evidence.settings
    expected = f'never {settings.timeout:g} s without odometry (odometry_timeout)'
    ends = np.concatenate([np.sort(log.arrived_ns), [log.ended_ns]])
    longest = float(np.diff(ends).max()) / NANOSECONDS
    found = f'longest silence {longest:.3f} s, {log.lost} messages lost on the way'
    advice = 'the controller lets go in such a silence: what blocks the driver, or the network?'
    return judged(longest < settings.timeout, expected, found, advice, longest_s=longest,
                  lost=log.lost)  # fmt: skip


def stamps(evidence: Evidence) -> Finding:
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
             'negative': negative}  # fmt: skip
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


def reference_ns(evidence: Evidence) -> tuple[np.ndarray, float]:
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


def age(evidence: Evidence) -> Finding:
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


def drift(evidence: Evidence) -> Finding:
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
    parts = np.array_split(np.arange(len(t)), PARTS)
    freshest = [part[np.argmin(late[part])] for part in parts]
    (slope, _), covariance = np.polyfit(t[freshest], late[freshest], 1, cov=True)
    faster, error = float(-slope), float(np.sqrt(covariance[0, 0]))
    found = f'{faster:+.2g} s/s, standard error {error:.1g}'
    advice = 'is the stamp a time in seconds and nanoseconds, of a clock that is not simulated?'
    good = abs(faster) <= DRIFT + SURE * error
    return judged(good, expected, found, advice, drift=faster, standard_error=error)
