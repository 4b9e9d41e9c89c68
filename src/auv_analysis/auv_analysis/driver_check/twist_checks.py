"""Checks of the axes in which the twist is written, by the rate of the pose."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from auv_analysis.driver_check.axis_checks import axis_findings
from auv_analysis.driver_check.finding import FAIL, PASS, Finding, unchecked
from auv_analysis.driver_check.fits import FITS, STILL, Fits, fits_of
from auv_analysis.driver_check.hypotheses import ANGULAR, CHILD, LINEAR, Hypothesis
from auv_analysis.driver_check.motion import Motion
from auv_analysis.output.text import join, number
from auv_dynamics.vehicle import DOFS

STANDS = 0.1  # of the larger speed: the other does not move
FLOW = 0.03  # m/s of a current that is worth its name
LEVEL = 0.8  # of a current that does not rise or sink
MOVE = 'move the vehicle while this listens, by hand or by its pilot, in all axes; or --actuate'
TURN = 'turn the vehicle away from north, or tilt it, and move it again while this listens'
WORLD = 'world'
SEE = 'see {}'


class Half(NamedTuple):
    """Linear or angular: its check, its readings, its unit and its degrees of freedom."""

    id: str
    expected: str
    readings: Sequence[Hypothesis]
    unit: str
    dofs: slice


HALVES = (
    Half(
        'twist_frame',
        'twist.linear in the axes of child_frame_id: R(q) v is the rate of the position',
        LINEAR,
        'm/s',
        slice(3),
    ),
    Half(
        'angular_frame',
        'twist.angular in the axes of child_frame_id, in rad/s: the turning of the attitude',
        ANGULAR,
        'rad/s',
        slice(3, 6),
    ),
)


def motion_findings(motion: Motion | None) -> list[Finding]:
    """Findings of a motion; None: there was too little odometry."""
    frames: list[Finding] = []
    axes: list[Finding] = []
    for half in HALVES:
        if motion is None:
            why, fits = 'too few messages with finite numbers and unit quaternions', None
            frames.append(unchecked(half.id, half.expected, why))
        else:
            fits = fits_of(motion, half.readings)
            frames.append(_frame(half, motion, fits))
            if _no_position(half, motion):
                fits = None
        axes += axis_findings(motion, fits, DOFS[half.dofs], half.unit, SEE.format(half.id))
    return [*frames, *axes]


def _frame(half: Half, motion: Motion, fits: Fits) -> Finding:
    numbers = {f'off_{name}': off for name, off in fits.off.items()}
    speeds = {'speed_by_pose': fits.by_path, 'speed_by_twist': fits.by_twist}
    numbers = {**speeds, 'noise': fits.noise, **numbers}

    def finding(verdict: str, found: str, advice: str = '') -> Finding:
        if motion.by_arrival:
            found += ' (by the times of arrival, since the stamps do not rise)'
        return Finding(half.id, half.expected, found, verdict, advice, numbers)

    if not fits.told:
        why = f'moved too little: {_speeds(half, fits)}; {STILL:g} {half.unit} and more tell axes'
        return unchecked(half.id, half.expected, why, MOVE, **numbers)
    if _no_position(half, motion):
        found = f'the position stands still: {_speeds(half, fits)}'
        advice = 'have the driver give a position while it is checked'
        return unchecked(half.id, half.expected, found, advice, **numbers)
    if not fits.right:
        return finding(FAIL, *_cause(half, fits))
    found = f'they fit, off by {_percent(fits.off[CHILD])} of {number(fits.speed)} {half.unit}'
    if WORLD in fits.others and half.unit == 'm/s':
        found += '; so do those of header.frame_id, from which the vehicle is not turned away'
        return unchecked(half.id, half.expected, found, TURN, **numbers)
    if fits.others:
        found += f'; not told apart by this motion: {join(fits.others)}'
    return finding(PASS, found)


def _cause(half: Half, fits: Fits) -> tuple[str, str]:
    """What the twist seems to be instead, and how to mend it."""
    told = f'in those of child_frame_id it is off by {_percent(fits.off[CHILD])}'
    if fits.off[fits.best] <= FITS and fits.best != CHILD:
        names = [fits.best, *(name for name in fits.others if name != fits.best)]
        likely = {one.name: one for one in half.readings}
        found = f'{likely[fits.best].text}: off by {_percent(fits.off[fits.best])}, {told}'
        if names[1:]:
            found += f'; {join(names[1:])} would fit as well'
        return found, likely[fits.best].advice
    if fits.by_twist < min(STILL, STANDS * fits.speed):
        return f'the twist stands still: {_speeds(half, fits)}', 'fill in the twist'
    if fits.by_path < min(STILL, STANDS * fits.speed):
        advice = 'fill in the pose: the controller needs the attitude'
        return f'the pose stands still: {_speeds(half, fits)}', advice
    flow, level = (float(np.linalg.norm(fits.constant[:n])) for n in (3, 2))
    if half.unit == 'm/s' and fits.rest <= FITS and level > max(FLOW, LEVEL * flow):
        found = f'{told}, by a constant {number(flow)} m/s: a current, or a moving origin'
        return found, 'give the velocity over ground, not that through the water'
    if fits.scaled <= FITS:
        found = f'{told}; multiplied by {number(fits.factor)} it fits'
        return found, f'the unit is {half.unit}'
    found = f'{told}, and in no usual ones it fits: {fits.best} by {_percent(fits.off[fits.best])}'
    advice = 'a single axis? see its row below; else: are pose and twist of one time, one vehicle?'
    return found, advice


def _no_position(half: Half, motion: Motion) -> bool:
    """Whether no position is given: a velocity controller needs none, not every vehicle has one."""
    return half.unit == 'm/s' and not np.ptp(motion.p, axis=0).any()


def _speeds(half: Half, fits: Fits) -> str:
    by = f'{number(fits.by_path)} {half.unit} by the pose, {number(fits.by_twist)} by the twist'
    return f'{by}, noise {number(fits.noise)}'


def _percent(part: float) -> str:
    return f'{100 * part:.3g} %'
