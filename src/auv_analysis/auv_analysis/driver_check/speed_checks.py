"""Checks of speeds and of steps from one message to the next, by the controller's limits."""

import numpy as np

from auv_analysis.driver_check.finding import Finding, judged, unchecked
from auv_analysis.driver_check.motion import Motion
from auv_analysis.driver_check.settings import Settings
from auv_analysis.output.text import number


def speed_findings(motion: Motion | None, settings: Settings) -> list[Finding]:
    """Findings of a motion."""
    speeds = f'at most {settings.speed:g} m/s and {settings.turning:g} rad/s'
    jumps = f'{speeds} by the pose, {settings.acceleration:g} m/s2 and rad/s2 by the twist'
    if motion is None:
        why = 'too few messages with finite numbers'
        return [unchecked('speeds', speeds, why), unchecked('jumps', jumps, why)]
    return [_speeds(motion, settings, speeds), _jumps(motion, settings, jumps)]


def _speeds(motion: Motion, settings: Settings, expected: str) -> Finding:
    linear, angular = (_largest(motion.nu[:, part]) for part in (slice(3), slice(3, 6)))
    good = linear <= settings.speed and angular <= settings.turning
    found = f'largest {number(linear)} m/s and {number(angular)} rad/s'
    advice = (
        'units: m/s and rad/s; what is above is refused by the controller (limits.speed, .rate)'
    )
    return judged('speeds', good, expected, found, advice, linear=linear, angular=angular)


def _jumps(motion: Motion, settings: Settings, expected: str) -> Finding:
    if motion.by_arrival:
        why = 'the stamps do not rise, and times of arrival are no measure of a step'
        return unchecked('jumps', expected, why)
    apart = np.diff(motion.t)[:, None]
    p_rate = _largest(np.diff(motion.p, axis=0) / apart)
    q_rate = _largest(np.diff(motion.turned, axis=0) / apart)
    nu_rate = np.diff(motion.nu, axis=0) / apart
    nu_rates = [_largest(nu_rate[:, part]) for part in (slice(3), slice(3, 6))]
    good = (
        p_rate <= settings.speed
        and q_rate <= settings.turning
        and max(nu_rates) <= settings.acceleration
    )
    found = (
        f'position {number(p_rate)} m/s, attitude {number(q_rate)} rad/s, '
        f'twist {number(nu_rates[0])} m/s2 and {number(nu_rates[1])} rad/s2'
    )
    advice = 'a filter that is reset, two sources in turn, or an angle that leaps: smooth or refuse'
    return judged('jumps', good, expected, found, advice, position=p_rate, attitude=q_rate,
                  linear=nu_rates[0], angular=nu_rates[1])  # fmt: skip


def _largest(rows: np.ndarray) -> float:
    return float(np.linalg.norm(rows, axis=1).max(initial=0.0))
