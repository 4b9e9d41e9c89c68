"""Twist checks: axes, sign and unit of the twist, by the rate of the pose."""

import numpy as np

from auv_analysis.driver.evidence import FAIL, PASS, CheckResult, DriverRecord, judged, unchecked
from auv_analysis.metrics.pose_twist import (
    CHILD,
    FITS,
    STILL,
    PoseTwist,
    TwistFit,
)
from auv_analysis.output.text import join, number
from auv_dynamics.vehicle import DOFS

STANDS = 0.1  # of the larger speed: the other does not move
FLOW = 0.03  # m/s of a current that is worth its name
LEVEL = 0.8  # of a current that does not rise or sink
SLOPES = (0.75, 1.33)  # of the pose's rate over the twist, where they mean the same
PART = 0.15  # of the whole speed: a smaller component says nothing against the others' errors
CLEAR = 3.0  # times the noise
STRONGEST = 0.2  # of the samples: a vehicle may move for a part of the time only
PER_AXIS = {CHILD, 'flu', 'degrees'}  # readings under which each axis is one by itself
MOVE = 'move the vehicle while this listens, by hand or by its pilot, in all axes; or --actuate'
TURN = 'turn the vehicle away from north, or tilt it, and move it again while this listens'

FLU_ADVICE = (
    'turn y and z of the one that is not forward-starboard-down, or send both in ENU and FLU '
    'through frame_converter_node'
)
ENU_ADVICE = (
    'give position and attitude in NED, or send all in ENU and FLU through frame_converter_node'
)
W_FIRST = (
    'those of child_frame_id, but the quaternion is written w first',
    'orientation has fields x, y, z, w: assign them by name',
)
INVERSE = (
    'those of child_frame_id, but the quaternion is that from earth to body',
    'give the attitude from body to earth: conjugate the quaternion',
)
TWIST_READINGS = {  # half and reading -> what it says of the driver, how to mend it
    'linear': {
        'world': (
            'the axes of header.frame_id, not of child_frame_id',
            'turn twist.linear into the body: R(q)^T v',
        ),
        'flu': (
            'forward-left-up where the pose is NED and FSD, or the other way round',
            FLU_ADVICE,
        ),
        'world_enu': (
            'east-north-up, not the axes of child_frame_id',
            'turn twist.linear into the body, forward-starboard-down',
        ),
        'position_enu': (
            'those of child_frame_id, but the position is east-north-up and the attitude is not',
            ENU_ADVICE,
        ),
        'attitude_enu': (
            'those of child_frame_id, but the attitude is of FLU in ENU and the position is NED',
            ENU_ADVICE,
        ),
        'z_up': (
            'those of child_frame_id, but z of the position grows upwards',
            'give depth as positive z, not altitude',
        ),
        'w_first': W_FIRST,
        'inverse': INVERSE,
    },
    'angular': {
        'degrees': ('the axes of child_frame_id, but in deg/s', 'rad/s, always'),
        'flu': (
            'forward-left-up where the attitude is of FSD in NED, or the other way round',
            FLU_ADVICE,
        ),
        'world': (
            'the axes of header.frame_id, not of child_frame_id',
            'turn twist.angular into the body: R(q)^T omega',
        ),
        'euler_rates': (
            'none: these are the rates of roll, pitch and yaw',
            'give p, q, r: the angular velocity in body axes',
        ),
        'w_first': W_FIRST,
        'inverse': INVERSE,
    },
}


def twist_frame(evidence: DriverRecord) -> CheckResult:
    """Axes of twist.linear."""
    expected = 'twist.linear in the axes of child_frame_id: R(q) v is the rate of the position'
    return _frame(evidence, 'linear', 'm/s', expected)


def angular_frame(evidence: DriverRecord) -> CheckResult:
    """Axes of twist.angular."""
    expected = 'twist.angular in the axes of child_frame_id, in rad/s: the turning of the attitude'
    return _frame(evidence, 'angular', 'rad/s', expected)


def _frame(evidence: DriverRecord, half: str, unit: str, expected: str) -> CheckResult:
    motion, fit = evidence.motion, evidence.twist_fits[half]
    numbers = {
        'speed_by_pose': fit.by_path,
        'speed_by_twist': fit.by_twist,
        'noise': fit.noise,
        **{f'off_{name}': off for name, off in fit.off.items()},
    }
    if not fit.told:
        why = f'moved too little: {_speeds(fit, unit)}; {STILL:g} {unit} and more tell axes'
        return unchecked(expected, why, MOVE, **numbers)
    if half == 'linear' and _no_position(motion):
        found = f'the position stands still: {_speeds(fit, unit)}'
        advice = 'have the driver give a position while it is checked'
        return unchecked(expected, found, advice, **numbers)
    by = ''
    if motion.by_arrival:
        by = ' (by the times of arrival, since the stamps do not rise)'
    if not fit.right:
        found, advice = _cause(fit, half, unit)
        return CheckResult(expected, found + by, FAIL, advice, numbers)
    found = f'they fit, off by {_percent(fit.off[CHILD])} of {number(fit.speed)} {unit}'
    if half == 'linear' and 'world' in fit.others:
        found += '; so do those of header.frame_id, from which the vehicle is not turned away'
        return unchecked(expected, found, TURN, **numbers)
    if fit.others:
        found += f'; not told apart by this motion: {join(fit.others)}'
    return CheckResult(expected, found + by, PASS, '', numbers)


def _cause(fit: TwistFit, half: str, unit: str) -> tuple[str, str]:
    """What the twist seems to be instead, and how to mend it."""
    told = f'in those of child_frame_id it is off by {_percent(fit.off[CHILD])}'
    if fit.off[fit.best] <= FITS and fit.best != CHILD:
        text, advice = TWIST_READINGS[half][fit.best]
        found = f'{text}: off by {_percent(fit.off[fit.best])}, {told}'
        also = [name for name in fit.others if name != fit.best]
        if also:
            found += f'; {join(also)} would fit as well'
        return found, advice
    if fit.by_twist < min(STILL, STANDS * fit.speed):
        return f'the twist stands still: {_speeds(fit, unit)}', 'fill in the twist'
    if fit.by_path < min(STILL, STANDS * fit.speed):
        advice = 'fill in the pose: the controller needs the attitude'
        return f'the pose stands still: {_speeds(fit, unit)}', advice
    flow, level = (float(np.linalg.norm(fit.constant[:n])) for n in (3, 2))
    if half == 'linear' and fit.rest <= FITS and level > max(FLOW, LEVEL * flow):
        found = f'{told}, by a constant {number(flow)} m/s: a current, or a moving origin'
        return found, 'give the velocity over ground, not that through the water'
    if fit.scaled <= FITS:
        return f'{told}; multiplied by {number(fit.factor)} it fits', f'the unit is {unit}'
    found = f'{told}, and in no usual ones it fits: {fit.best} by {_percent(fit.off[fit.best])}'
    advice = 'a single axis? see its row below; else: are pose and twist of one time, one vehicle?'
    return found, advice


def _no_position(motion: PoseTwist) -> bool:
    """Whether no position is given: a velocity controller needs none, not every vehicle has one."""
    return not np.ptp(motion.p, axis=0).any()


def _speeds(fit: TwistFit, unit: str) -> str:
    by = f'{number(fit.by_path)} {unit} by the pose, {number(fit.by_twist)} by the twist'
    return f'{by}, noise {number(fit.noise)}'


def _percent(part: float) -> str:
    return f'{100 * part:.3g} %'


def axis(dof: str, evidence: DriverRecord) -> CheckResult:
    """Twist and pose in one degree of freedom."""
    expected = f'{dof} by the twist is {dof} by the pose'
    i = DOFS.index(dof)
    half, unit, see = ('linear', 'm/s', 'see twist_frame')
    if i >= 3:
        half, unit, see = ('angular', 'rad/s', 'see angular_frame')
    motion, fit = evidence.motion, evidence.twist_fits[half]
    other_axes = fit.off[fit.best] <= FITS and fit.best not in PER_AXIS and not fit.right
    if not fit.told or other_axes or (half == 'linear' and _no_position(motion)):
        return unchecked(expected, see)
    pair, i = evidence.rates[half], i % 3
    path, velocity = pair.path[:, i], pair.velocity[:, i]
    noise = float(pair.path_noise[i]), float(pair.velocity_noise[i])
    by_path, by_twist = _rms(path, noise[0]), _rms(velocity, noise[1])
    largest, both = max(by_path, by_twist), float(np.sqrt(sum(noise)))
    numbers = {'speed_by_pose': by_path, 'speed_by_twist': by_twist, 'noise': both}
    if largest < max(STILL, PART * fit.speed, CLEAR * both):
        why = f'moved too little: {number(largest)} {unit}, noise {number(both)}'
        return unchecked(expected, why, f'move it in {dof}', **numbers)
    if by_twist < PART * by_path:
        found = f'{number(by_path)} {unit} by the pose, {number(by_twist)} by the twist'
        return judged(False, expected, found, 'fill in this component', **numbers)
    slope = float((path * velocity).sum() / ((velocity**2).sum() - len(velocity) * noise[1]))
    found = f'the pose gives {number(slope)} times the twist, at {number(largest)} {unit}'
    good = SLOPES[0] <= slope <= SLOPES[1]
    return judged(good, expected, found, _advice(slope, unit), slope=slope, **numbers)


def _advice(slope: float, unit: str) -> str:
    if SLOPES[0] <= -slope <= SLOPES[1]:
        return 'the sign is reversed: forward, starboard, down, and right-handed turns'
    if unit == 'rad/s' and SLOPES[0] <= np.degrees(slope) <= SLOPES[1]:
        return 'the twist is in deg/s: give rad/s'
    return f'axes mixed up, another unit than {unit}, or a part of the motion missing'


def _rms(values: np.ndarray, noise: float) -> float:
    """Root mean square of the strongest part of a signal (n,), less that of its noise."""
    strongest = np.sort(values**2)[-max(round(STRONGEST * len(values)), 1) :]
    return float(np.sqrt(max(float(strongest.mean()) - noise, 0.0)))
