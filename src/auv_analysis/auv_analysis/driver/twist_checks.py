"""Twist checks: axes, sign and unit of the twist, by the rate of the pose."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from auv_analysis.driver.evidence import FAIL, PASS, CheckResult, DriverRecord, judged, unchecked
from auv_analysis.driver.response import in_a_row
from auv_analysis.metrics.local_polynomials import SMALLEST
from auv_analysis.metrics.pose_twist import (
    CHILD,
    FITS,
    STILL,
    PoseTwist,
    TwistFit,
    compare_rates,
    turn,
)
from auv_analysis.output.text import join, number
from auv_dynamics.vehicle import DOFS

STANDS = 0.1  # of the larger speed: the other does not move
FLOW = 0.03  # m/s of a current that is worth its name
SAME = 0.5  # of the speed by the twist: a position that drifts less stands still
LEVEL = 0.8  # of a current that does not rise or sink
SLOPES = (0.75, 1.33)  # of the pose's rate over the twist, where they mean the same
PART = 0.15  # of the whole speed: a smaller component says nothing against the others' errors
CLEAR = 3.0  # times the noise
STRONGEST = 0.2  # of the samples: a vehicle may move for a part of the time only
CALM = 2.0  # s, the calmest of which tell how much an estimate wanders at rest
SLOW = 0.1  # m/s, rad/s: what is faster is motion, however much wanders
WANDERS = 0.05  # m/s of a velocity at rest, about its mean
WAITED = 3.0  # s at least that a vehicle rests before the first wrench
RELATED = 0.5  # squared correlation of pose and twist below which their ratio says nothing
PER_AXIS = {CHILD, 'flu', 'degrees'}  # readings under which each axis is one by itself
MOVE = 'move the vehicle while this listens, by hand or by its pilot, in all axes; or --actuate'
CURRENT = 'a current, or a moving origin'
OVER_GROUND = 'give the velocity over ground, not that through the water'
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
    if motion.by_publication:
        by = ' (by the times of publication, since the stamps do not rise)'
    if not fit.right:
        if not (_moves(evidence, half) or (fit.best != CHILD and fit.off[fit.best] <= FITS)):
            why = f'moved too little beside what it wanders at rest: {_speeds(fit, unit)}'
            return unchecked(expected, why, MOVE, **numbers)
        found, advice = _cause(evidence, fit, half, unit)
        return CheckResult(expected, found + by, FAIL, advice, numbers)
    found = f'they fit, off by {_percent(fit.off[CHILD])} of {number(fit.speed)} {unit}'
    if half == 'linear' and 'world' in fit.others:
        found += '; so do those of header.frame_id, from which the vehicle is not turned away'
        return unchecked(expected, found, TURN, **numbers)
    if fit.others:
        found += f'; not told apart by this motion: {join(fit.others)}'
    return CheckResult(expected, found + by, PASS, '', numbers)


def _cause(evidence: DriverRecord, fit: TwistFit, half: str, unit: str) -> tuple[str, str]:
    """The likely convention of the twist, and the remedy."""
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
        rest, found = standstill(evidence), f'{told}, by a constant {number(flow)} m/s'
        biased = rest and rest.stands and rest.bias > STILL
        return f'{found}: ' + ('see velocity_bias' if biased else CURRENT), OVER_GROUND
    if fit.scaled <= FITS:
        return f'{told}; multiplied by {number(fit.factor)} it fits', f'the unit is {unit}'
    found = f'{told}, and in no usual ones it fits: {fit.best} by {_percent(fit.off[fit.best])}'
    advice = 'a single axis? see its row below; else: are pose and twist of one time, one vehicle?'
    return found, advice


def _moves(evidence: DriverRecord, half: str) -> bool:
    """Whether a half of the twist or the rate of the pose is more than what it is at rest."""
    pair = evidence.rates[half]
    path = pair.path[:, :2] if half == 'linear' else pair.path  # a measured depth is noisy
    squares = np.maximum((path**2).sum(axis=1), (pair.velocity**2).sum(axis=1))
    count = min(max(round(CALM / float(np.median(np.diff(pair.t)))), 1), len(squares))
    calm = np.convolve(squares, np.full(count, 1.0 / count), 'valid').min()
    speed = float(np.sqrt(squares.mean()))
    return speed > min(max(STILL, CLEAR * float(np.sqrt(calm))), SLOW)


class Standstill(NamedTuple):
    """Velocity of a vehicle that nobody commands or moves, in earth axes.

    Attributes
    ----------
    drift, twist : (3,) m/s by the position, and by the twist
    errors : (3,) standard error of their difference, m/s
    body : (3,) mean of the twist in body axes, m/s

    """

    drift: np.ndarray
    twist: np.ndarray
    errors: np.ndarray
    body: np.ndarray

    @property
    def bias(self) -> float:
        """Difference of the two, where it exceeds the noise, m/s."""
        return self._told(self.twist - self.drift)

    @property
    def stands(self) -> bool:
        """Whether the position stands still beside the twist."""
        return self._told(self.drift) < SAME * float(np.linalg.norm(self.twist))

    def _told(self, v: np.ndarray) -> float:
        return float(np.linalg.norm(v[np.abs(v) > CLEAR * self.errors]))


@lru_cache(maxsize=1)
def standstill(evidence: DriverRecord) -> Standstill | None:
    """Velocity without a command: of all that was heard before one, or of its end; None: moved."""
    motion, free = evidence.motion, evidence.uncommanded
    for seconds in (np.inf, WAITED):
        here = free & (motion.t >= (motion.t[free].max(initial=0.0) - seconds))
        if here.sum() < SMALLEST:
            continue
        t, p = motion.t[here], motion.p[here]
        v = turn(motion.q[here], motion.nu[here, :3])
        if np.sqrt(compare_rates(t, p, v).velocity.var(axis=0).sum()) > WANDERS:
            continue
        line = np.polyfit(t - t.mean(), p, 1)
        off, about = p - (line[0] * (t - t.mean())[:, None] + line[1]), v - v.mean(axis=0)
        n, spread = len(t), float(((t - t.mean()) ** 2).sum())
        by_position = (off**2).sum(axis=0) / (n - 2) / spread * in_a_row(off)
        by_twist = (about**2).sum(axis=0) / (n - 1) / n * in_a_row(about)
        errors = np.sqrt(by_position + by_twist)
        return Standstill(line[0], v.mean(axis=0), errors, motion.nu[here, :3].mean(axis=0))
    return None


def velocity_bias(evidence: DriverRecord) -> CheckResult:
    """Velocity at rest."""
    expected = f'at rest, position and twist drift alike, within {STILL:g} m/s'
    if _no_position(evidence.motion):
        return unchecked(expected, 'no position')
    found = standstill(evidence)
    if found is None:
        advice = 'let it rest while this listens'
        return unchecked(expected, 'the vehicle was moved, or too little was heard', advice)
    parts = (found.drift, found.twist, found.errors)
    drift, twist, error = (float(np.linalg.norm(part)) for part in parts)
    bias = found.bias
    numbers = {'bias': bias, 'drift': drift, 'twist': twist, 'standard_error': error}
    text = f'{number(drift)} m/s by the position, {number(twist)} by the twist'
    doubt = f'standard error {number(error)}'
    if bias > STILL:
        if found.stands:
            each = join([f'{dof} {v:+.3f}' for dof, v in zip(DOFS[:3], found.body, strict=True)])
            why = f'the velocity of the estimator is biased by {number(bias)} m/s ({each}), while '
            why += f'the position stands still: {text}, {doubt}'
            advice = 'calibrate the estimator, or give it a velocity sensor: no tracking is better'
            return CheckResult(expected, why, FAIL, advice, numbers)
        return CheckResult(expected, f'{text}, {doubt}: {CURRENT}', FAIL, OVER_GROUND, numbers)
    if CLEAR * error > SLOW:
        return unchecked(expected, f'{text}, {doubt}: too noisy', 'listen for longer', **numbers)
    if drift > max(STILL, CLEAR * error):
        text = f'{text}, which agree: {CURRENT}'
    return CheckResult(expected, f'{text}, {doubt}', PASS, '', numbers)


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
    both_ways = float((path * velocity).sum()) ** 2
    related = both_ways > RELATED * float((path**2).sum() * (velocity**2).sum())
    if not related and not _moves(evidence, half):
        return unchecked(expected, 'pose and twist wander apart', f'move it in {dof}', **numbers)
    if by_twist < PART * by_path:
        found = f'{number(by_path)} {unit} by the pose, {number(by_twist)} by the twist'
        return judged(False, expected, found, 'fill in this component', **numbers)
    if not related:
        found = (
            f'{number(by_twist)} {unit} that do not follow the pose, which has {number(by_path)}'
        )
        advice = 'axes mixed up, or nothing but noise in this component'
        return judged(False, expected, found, advice, **numbers)
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
