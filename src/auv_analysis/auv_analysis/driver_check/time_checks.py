"""Checks of when messages come and of what their stamps say."""

import numpy as np

from auv_analysis.driver_check.finding import Finding, judged, unchecked
from auv_analysis.driver_check.recording import Recording
from auv_analysis.driver_check.settings import Settings
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
PARTS = 8  # of the time, for the drift
MS = 1e3


def time_findings(recording: Recording, settings: Settings) -> list[Finding]:
    """Findings of a recording with one message at least."""
    return [
        _rate(recording, settings),
        _gaps(recording, settings),
        _stamps(recording, settings),
        _age(recording, settings),
        _drift(recording, settings),
    ]


def _rate(recording: Recording, settings: Settings) -> Finding:
    least = ENOUGH / settings.timeout
    expected = f'at least {least:g} Hz, {ENOUGH} messages in odometry_timeout'
    if settings.rate:
        expected = f'{settings.rate:g} Hz within {100 * RATE_WITHIN:g} %'
    n, arrived = len(recording.arrived_ns), recording.arrived_ns
    advice = 'publish at a steady rate from a timer or from the fastest sensor'
    if n < 3:
        found = f'{n} messages in {recording.seconds:.1f} s'
        return judged('rate', False, expected, found, advice, messages=n)
    apart = np.diff(np.sort(arrived)) / NANOSECONDS
    rate = float((n - 1) / apart.sum()) if apart.sum() > 0 else float('inf')
    low, middle, high = (float(value) for value in np.percentile(apart, [1, 50, 99]))
    found = (
        f'{rate:.1f} Hz; {low * MS:.1f}, {middle * MS:.1f}, {high * MS:.1f} ms apart '
        '(1, 50, 99 % of the messages)'
    )
    good = rate >= least
    if settings.rate:
        good = abs(rate - settings.rate) <= RATE_WITHIN * settings.rate
    return judged(
        'rate', good, expected, found, advice, rate_hz=rate, messages=n, apart_1_percent_s=low,
        apart_median_s=middle, apart_99_percent_s=high, jitter_s=float(apart.std()),
    )  # fmt: skip


def _gaps(recording: Recording, settings: Settings) -> Finding:
    expected = f'never {settings.timeout:g} s without odometry (odometry_timeout)'
    ends = np.concatenate([np.sort(recording.arrived_ns), [recording.ended_ns]])
    longest = float(np.diff(ends).max()) / NANOSECONDS
    found = f'longest silence {longest:.3f} s, {recording.lost} messages lost on the way'
    advice = 'the controller lets go in such a silence: what blocks the driver, or the network?'
    return judged('gaps', longest < settings.timeout, expected, found, advice, longest_s=longest,
                  lost=recording.lost)  # fmt: skip


def _stamps(recording: Recording, settings: Settings) -> Finding:
    expected = f'rising from message to message, by {settings.gap:g} s at most, none zero'
    stamps = recording.stamp_ns
    steps = np.diff(stamps)
    same, back = int((steps == 0).sum()), int((steps < 0).sum())
    far, zero = int((steps > settings.gap * NANOSECONDS).sum()), int((stamps == 0).sum())
    zero = max(zero - 1, 0)  # a clock that begins at zero says so once
    negative = int((stamps < 0).sum())
    parts = {'repeated': same, 'going back': back, 'leaping ahead': far, 'zero': zero,
             'negative': negative}  # fmt: skip
    told = [f'{count} {word}' for word, count in parts.items() if count]
    found = f'{len(stamps)} stamps, {join(told) if told else "each later than the one before"}'
    if zero or negative or (len(steps) and same == len(steps)):
        advice = 'stamp each message with the time at which its numbers were measured'
    elif same:
        advice = 'publish each measurement once: the controller refuses a stamp that it has seen'
    elif back:
        advice = (
            'publish in the order of the stamps, from a clock that is slewed and never set back'
        )
    else:
        advice = f'a longer jump than limits.gap, {settings.gap:g} s, is bridged and not integrated'
    return judged('stamps', not told, expected, found, advice, repeated=same, back=back, far=far,
                  zero=zero, negative=negative)  # fmt: skip


def reference_ns(recording: Recording, settings: Settings) -> tuple[np.ndarray, float]:
    """Time (n,) in ns that our nodes' clock showed at each arrival, NaN before it began; its step.

    With simulated time the clock shows the last /clock that came before, a step of it in s.
    """
    arrived = recording.arrived_ns
    if not settings.sim_time:
        return arrived.astype(float), 0.0
    shown, at = recording.clock_ns, recording.clock_arrived_ns
    if not len(shown):
        return np.full(len(arrived), np.nan), 0.0
    last = np.searchsorted(at, arrived, side='right') - 1
    time = np.where(last >= 0, shown[np.maximum(last, 0)].astype(float), np.nan)
    steps = np.diff(shown)
    return time, float(np.median(steps)) / NANOSECONDS if len(steps) else 0.0


def _age(recording: Recording, settings: Settings) -> Finding:
    most = FRESH * settings.timeout
    expected = f'95 % younger than {most:g} s, none from the future'
    now, step = reference_ns(recording, settings)
    known = np.isfinite(now)
    if not known.any():
        return unchecked('age', expected, 'no /clock was heard before the odometry')
    ages = (now[known] - recording.stamp_ns[known]) / NANOSECONDS
    low, middle, high = (float(value) for value in np.percentile(ages, [5, 50, 95]))
    numbers = {'age_5_percent_s': low, 'age_median_s': middle, 'age_95_percent_s': high}
    if abs(middle) > SAME_EPOCH:
        since = 'the start of the computer' if recording.stamp_ns[-1] < 1e17 else 'another day'
        found = (
            f'not comparable: another epoch, stamps count from {since}; the oldest is '
            f'{float(ages.max() - ages.min()) * MS:.1f} ms later on its way than the freshest'
        )
        advice = (
            'stamp with the system time, disciplined by NTP or PTP; else give the controller '
            'stamp_clock: own, and --use-sim-time here if it is a simulation'
        )
        return unchecked('age', expected, found, advice, **numbers)
    found = f'{middle * MS:.1f} ms (median), {low * MS:.1f} to {high * MS:.1f} ms (5 to 95 %)'
    ahead = low < -AHEAD - 2.0 * step
    advice = 'publish at once what was measured; are the clocks of both computers disciplined?'
    if ahead:
        advice = 'the clock of the driver is ahead of ours: discipline both by NTP or PTP'
    return judged('age', high <= most and not ahead, expected, found, advice, **numbers)


def _drift(recording: Recording, settings: Settings) -> Finding:
    clock = 'simulated time' if settings.sim_time else 'the time of arrival'
    expected = f'stamps as fast as {clock} within {DRIFT:g} s/s'
    now, _ = reference_ns(recording, settings)
    known = np.isfinite(now)
    t, stamps = now[known], recording.stamp_ns[known].astype(float)
    if len(t) < FEW or np.ptp(t) == 0.0 or np.ptp(stamps) == 0.0:
        return unchecked('drift', expected, 'too few stamps that differ')
    t, late = (t - t[0]) / NANOSECONDS, (t - stamps - (t[0] - stamps[0])) / NANOSECONDS
    # whatever keeps messages waiting makes them later: of each part of the time the freshest one
    parts = np.array_split(np.arange(len(t)), PARTS)
    freshest = [part[np.argmin(late[part])] for part in parts]
    (slope, _), covariance = np.polyfit(t[freshest], late[freshest], 1, cov=True)
    drift, error = float(-slope), float(np.sqrt(covariance[0, 0]))
    found = f'{drift:+.2g} s/s, standard error {error:.1g}'
    advice = 'is the stamp a time in seconds and nanoseconds, of a clock that is not simulated?'
    good = abs(drift) <= DRIFT + SURE * error
    return judged('drift', good, expected, found, advice, drift=drift, standard_error=error)
