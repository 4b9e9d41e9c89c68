"""Whether a driver zeroes its thrusters by itself when commands cease."""

import numpy as np

from auv_analysis.driver_check.finding import Finding, judged, unchecked
from auv_analysis.driver_check.prediction import predicted
from auv_analysis.driver_check.response import LATEST, response_of
from auv_analysis.driver_check.trials import Heard
from auv_dynamics.ros.interface import WRENCH_APPLIED
from auv_dynamics.vehicle.vehicle import Vehicle

LONGEST = 1.0  # s of silence after which a driver must have let go
PART = 0.05  # of the wrench: less is none
STEP = 0.2  # s between two times that are tried
CLEAR = 25.0  # how much more often one explanation must be right: the difference in log-likelihood
EXPECTED = f'zero within {LONGEST:g} s of the last wrench'
ADVICE = 'give the driver a watchdog: a wrench older than some 0.5 s is zero'


def silence_finding(vehicle: Vehicle, heard: Heard | None, why: str) -> Finding:
    """Finding of the trial that ends without a zero.

    Parameters
    ----------
    vehicle : the model
    heard : the trial; None: there was none
    why : there was none

    """
    if heard is None:
        return unchecked('silence', EXPECTED, why or 'too little odometry')
    after = heard.applied_t > heard.silent_from
    if after.any():
        return _by_actuators(heard, after)
    return _by_motion(vehicle, heard)


def _by_actuators(heard: Heard, after: np.ndarray) -> Finding:
    t, rows = heard.applied_t, np.abs(heard.applied).max(axis=1)
    acting = t[rows > PART * heard.trial.size]
    ceased = float(max(acting.max(initial=0.0), heard.silent_from)) - heard.silent_from
    watched = float(t.max()) - heard.silent_from
    where = f'by {WRENCH_APPLIED}'
    if not (rows[~after] > PART * heard.trial.size).any():
        return unchecked('silence', EXPECTED, f'{WRENCH_APPLIED} never showed the wrench')
    found = f'zero after {ceased:.2f} s, {where}'
    if rows[-1] > PART * heard.trial.size:
        found = f'not within {watched:.2f} s, {where}'
    return judged('silence', ceased <= LONGEST and rows[-1] <= PART * heard.trial.size, EXPECTED,
                  found, ADVICE, ceased_s=ceased, watched_s=watched)  # fmt: skip


def _by_motion(vehicle: Vehicle, heard: Heard) -> Finding:
    """By the velocity: which time of letting go explains it best, against never letting go."""
    end = float(heard.t[-1])
    times = np.arange(0.0, end - heard.silent_from, STEP)
    left = [_unexplained(vehicle, heard, heard.silent_from + late) for late in times]
    never = _unexplained(vehicle, heard, end)
    best = int(np.argmin(left))
    # of normal errors: n/2 times the logarithm of the ratio of the squares
    n = len(heard.t)
    early = min(square for square, late in zip(left, times, strict=True) if late <= LONGEST)
    tiny = np.finfo(float).tiny
    stops = n / 2 * float(np.log(max(never, tiny) / max(min(left), tiny)))
    goes_on = n / 2 * float(np.log(max(early, tiny) / max(never, tiny)))
    numbers = {'ceased_s': float(times[best]), 'stops': stops, 'goes_on': goes_on}
    if stops > CLEAR:
        ceased = float(times[best])
        found = f'zero after {ceased:.1f} s, by the motion'
        return judged('silence', ceased <= LONGEST, EXPECTED, found, ADVICE, **numbers)
    if goes_on > CLEAR:
        found = f'not within {end - heard.silent_from:.1f} s, by the motion'
        return judged('silence', False, EXPECTED, found, ADVICE, **numbers)
    advice = f'publish {WRENCH_APPLIED}, which tells it without a doubt'
    return unchecked('silence', EXPECTED, 'the motion does not tell it', advice, **numbers)


def _unexplained(vehicle: Vehicle, heard: Heard, until: float) -> float:
    """Squares of the velocity that are left if the last wrench acted until a time, s."""
    end = float(heard.t[-1]) + LATEST
    *before, (begin, _, tau) = heard.held
    held = [*before, (begin, until, tau)]
    if until < end:
        held.append((until, end, (0.0,) * 6))
    model = predicted(vehicle, heard.x, held)
    return response_of(heard.t, heard.nu, model, heard.trial.axis).squares
