"""Checks of each degree of freedom: sign and unit of the twist by what the pose says."""

from collections.abc import Sequence

import numpy as np

from auv_analysis.driver_check.finding import Finding, judged, unchecked
from auv_analysis.driver_check.fits import FITS, STILL, Fits
from auv_analysis.driver_check.hypotheses import CHILD
from auv_analysis.driver_check.motion import Compared, Motion, compared
from auv_analysis.output.text import number

SLOPES = (0.75, 1.33)  # of the pose's rate over the twist, where they mean the same
PART = 0.15  # of the whole speed: a smaller component says nothing against the others' errors
CLEAR = 3.0  # times the noise
STRONGEST = 0.2  # of the samples: a vehicle may move for a part of the time only
PER_AXIS = {CHILD, 'flu', 'degrees'}  # readings under which each axis is one by itself


def axis_findings(
    motion: Motion | None, fits: Fits | None, dofs: Sequence[str], unit: str, why: str
) -> list[Finding]:
    """Findings of three degrees of freedom.

    Parameters
    ----------
    motion : None: there was too little odometry
    fits : of these three
    dofs : their words
    unit : of their velocities
    why : where it is said why there is nothing to be found of them

    """
    expected = [f'{dof} by the twist is {dof} by the pose' for dof in dofs]
    ids = [f'axis_{dof}' for dof in dofs]
    if motion is None or fits is None or not fits.told:
        return [unchecked(id, text, why) for id, text in zip(ids, expected, strict=True)]
    if fits.off[fits.best] <= FITS and fits.best not in PER_AXIS and not fits.right:
        return [unchecked(id, text, why) for id, text in zip(ids, expected, strict=True)]
    linear = unit == 'm/s'
    path, nu = (motion.travelled, motion.nu[:, :3]) if linear else (motion.turned, motion.nu[:, 3:])
    pair = compared(motion, path, nu)
    return [
        _axis(pair, i, fits.speed, id, text, unit)
        for i, (id, text) in enumerate(zip(ids, expected, strict=True))
    ]


def _axis(pair: Compared, i: int, speed: float, id: str, expected: str, unit: str) -> Finding:
    a, b = pair.path[:, i], pair.velocity[:, i]
    noise_a, noise_b = pair.path_noise[i], pair.velocity_noise[i]
    by_path, by_twist = _rms(a, noise_a), _rms(b, noise_b)
    largest, noise = max(by_path, by_twist), float(np.sqrt(noise_a + noise_b))
    numbers = {'speed_by_pose': by_path, 'speed_by_twist': by_twist, 'noise': noise}
    if largest < max(STILL, PART * speed, CLEAR * noise):
        why = f'moved too little: {number(largest)} {unit}, noise {number(noise)}'
        return unchecked(id, expected, why, f'move it in {id.partition("_")[2]}', **numbers)
    if by_twist < PART * by_path:
        found = f'{number(by_path)} {unit} by the pose, {number(by_twist)} by the twist'
        return judged(id, False, expected, found, 'fill in this component', **numbers)
    slope = float((a * b).sum() / ((b**2).sum() - len(b) * noise_b))
    good = SLOPES[0] <= slope <= SLOPES[1]
    found = f'the pose gives {number(slope)} times the twist, at {number(largest)} {unit}'
    return judged(id, good, expected, found, _advice(slope, unit), slope=slope, **numbers)


def _advice(slope: float, unit: str) -> str:
    if SLOPES[0] <= -slope <= SLOPES[1]:
        return 'the sign is reversed: forward, starboard, down, and right-handed turns'
    if unit == 'rad/s' and SLOPES[0] <= np.degrees(slope) <= SLOPES[1]:
        return 'the twist is in deg/s: give rad/s'
    return f'axes mixed up, another unit than {unit}, or a part of the motion missing'


def _rms(values: np.ndarray, noise: float) -> float:
    """Root mean square of the strongest part of a signal, less that of its noise."""
    strongest = np.sort(values**2)[-max(round(STRONGEST * len(values)), 1) :]
    return float(np.sqrt(max(float(strongest.mean()) - noise, 0.0)))
