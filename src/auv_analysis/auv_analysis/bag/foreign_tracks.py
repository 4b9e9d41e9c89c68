"""Signals of another system in NED and FSD, over one clock, and their common time base."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from auv_analysis.bag.foreign_fields import COMPONENTS, EULER, POSITION, RATES, VELOCITY
from auv_analysis.bag.foreign_messages import (
    Recorded,
    logged_with,
    longest_stretch,
    on_the_clock,
    ordered,
)
from auv_analysis.bag.foreign_topics import FROM_ATTITUDE, HELD, MOVING, TopicMap
from auv_analysis.bag.reading import usual_limit
from auv_analysis.bag.tracks import BURST, ENOUGH, Track, assembled, at_times, between_gaps, jumps
from auv_analysis.metrics.local_polynomials import SMALLEST, rates
from auv_analysis.metrics.pose_twist import CONJUGATE, turn, turned
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import one_of
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.vehicle.frames import (
    ENU_FLU,
    NED_FSD,
    named_axes,
    swap_attitude,
    swap_body,
    swap_position,
)
from auv_dynamics.vehicle.thruster_curves import ThrusterCurve, load_curve
from auv_dynamics.vehicle.vehicle import Vehicle

POSE, TWIST = slice(0, 7), slice(7, 13)  # of an odometry's row
BURSTS = 0.2  # share of intervals of a burst that makes bursts
_SWAPS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    'pose': lambda x: np.concatenate([swap_position(x[:, :3]), swap_attitude(x[:, 3:])], axis=1),
    'twist': swap_body,
    'wrench': swap_body,
    'wrench_applied': swap_body,
    'setpoint': swap_body,
}


def tracks_of(
    found: dict[str, Recorded], mapping: TopicMap, vehicle: Vehicle, notes: list[str]
) -> tuple[dict[str, Track], Track]:
    """Signals of the mapped topics, and the velocity if its twist_frame were the other one.

    Parameters
    ----------
    found : role -> messages in the order of the bag
    mapping : how they are meant
    vehicle : whose thrusters turn thrusts into a wrench
    notes : gets a line for everything that was assumed or is odd

    Returns
    -------
    tracks : 'pose' and 'twist', and 'wrench', 'wrench_applied' and 'setpoint' where mapped; a
        component that was not measured is NaN throughout

    Raises
    ------
    InputError : axes that nobody told, thrusts that do not fit the vehicle

    """
    found = {key: _retimed(one, notes) for key, one in _on_one_clock(found, notes).items()}
    axes = {key: axes_of(one, notes) for key, one in found.items()}
    notes.append(_said(axes, found))
    bag, by_role = next(iter(found.values())).bag, _by_role(found, axes)
    pose = assembled([_track('pose', *one) for one in by_role.pop('pose')], bag)
    lacking = unknown_angles(pose, mapping)
    by_attitude = [one for one, _ in by_role['twist'] if one.source.twist_frame == 'world']
    if lacking and (by_attitude or mapping.rates == FROM_ATTITUDE):
        expected = 'all three angles, since rates: or twist_frame: world need them'
        raise InputError(bag, 'pose', expected, f'none for {", ".join(lacking)}')
    moving = by_role.pop('twist')
    twists = [_velocity(*one, pose, one[0].source.twist_frame == 'world') for one in moving]
    instead = [
        _without_rates(_velocity(*one, pose, one[0].source.twist_frame == 'child'))
        for one in moving
    ]
    if mapping.rates == FROM_ATTITUDE:
        others = [_without_rates(one) for one in twists[1:] if one.given[:3].any()]
        twists = [with_rates(twists[0], pose, notes), *others]
        if not len(twists[0].ns):
            expected = f'{SMALLEST} attitudes without a gap at a velocity, for their rate'
            raise InputError(bag, pose.topic, expected, 'none')
    tracks = {'pose': pose, 'twist': assembled(twists, bag)}
    for role, every in by_role.items():
        if role == 'thrusters':
            tracks['wrench'] = _of_thrusters([one for one, _ in every], vehicle, mapping, notes)
        else:
            tracks[role] = assembled([_track(role, *one) for one in every], bag)
    for role, names in (('pose', POSITION), ('twist', (*VELOCITY, *RATES))):
        unknown = [i for i, name in enumerate(names) if name in mapping.unknown]
        rows = tracks[role].rows.copy()
        rows[:, unknown] = np.nan
        tracks[role] = replace(tracks[role], rows=rows)
    return tracks, assembled(instead, bag)


def unknown_angles(pose: Track, mapping: TopicMap) -> tuple[str, ...]:
    """Those of phi, theta and psi that were not measured."""
    return tuple(name for name in EULER if name in mapping.unknown or not pose.given[-1])


def _by_role(
    found: Mapping[str, Recorded], axes: Mapping[str, str]
) -> dict[str, list[tuple[Recorded, str]]]:
    """Role -> its topics with their axes; an odometry is a pose and a twist."""
    by_role: dict[str, list[tuple[Recorded, str]]] = {}
    for key, one in found.items():
        halves = {one.source.role: slice(None)}
        if one.source.role == 'odometry':
            halves = {role: columns for role, columns in (('pose', POSE), ('twist', TWIST))
                      if not np.isnan(one.rows[:, columns]).all()}  # fmt: skip
        for role, columns in halves.items():
            by_role.setdefault(role, []).append((one.part(slice(None), columns), axes[key]))
    for role, other in (('pose', 'twist'), ('twist', 'pose')):
        if role not in by_role:  # nothing of it was measured
            one, told = by_role[other][0]
            rows = np.full((len(one.rows), len(COMPONENTS[role])), np.nan)
            by_role[role] = [(replace(one, rows=rows), told)]
    return by_role


def _without_rates(twist: Track) -> Track:
    return replace(twist, rows=np.where(np.arange(6) < 3, twist.rows, np.nan))


def _on_one_clock(found: Mapping[str, Recorded], notes: list[str]) -> dict[str, Recorded]:
    """The same with rising stamps of one clock that does not start anew."""
    moving = [one for one in found.values() if one.source.role in MOVING]
    moving += [one for one in found.values() if one.source.role == 'pose']
    clock = next((one for one in moving if one.stamped), moving[0])
    kept = longest_stretch(clock, [])
    timed = {role: on_the_clock(one, kept, notes) for role, one in found.items()}
    if len(kept.log) < len(clock.log):
        timed = {
            role: one if one.source.topic == clock.source.topic else logged_with(one, kept)
            for role, one in timed.items()
        }
    return {role: ordered(longest_stretch(one, notes), notes) for role, one in timed.items()}


def _retimed(one: Recorded, notes: list[str]) -> Recorded:
    """The same with stamps spread evenly where that was told, and without the delay that was told.

    A measurement was taken before its stamp by its delay, a command acts as much behind it.
    """
    stamps, source = one.stamps, one.source
    if source.stamps == 'uniform' and len(stamps) > 1:
        even = _evenly(stamps, _limit(one))
        moved = np.abs(even - stamps).max() / NANOSECONDS
        notes.append(
            f'{source.topic}: stamps spread evenly, as told; they move by up to {moved:.3g} s'
        )
        stamps = even
    elif len(stamps) > ENOUGH:
        apart = np.diff(stamps)
        mean = np.minimum(apart, usual_limit(stamps)).mean()  # between gaps
        share = float(np.mean(apart < BURST * mean))
        if share > BURSTS:
            notes.append(
                f'{source.topic}: its stamps come in bursts, {100 * share:.0f} % of the intervals '
                f'are below a fifth of the mean of {mean / NANOSECONDS:.3g} s; '
                'stamps: uniform in the map spreads them evenly'
            )
    if source.delay:
        sign = 1 if source.role in HELD else -1
        stamps = stamps + sign * round(source.delay * NANOSECONDS)
        which = 'acts {} s behind its stamps' if sign > 0 else 'was measured {} s before its stamps'
        notes.append(f'{source.topic}: {source.role} {which.format(source.delay)}, as told')
    return replace(one, stamps=stamps)


def _evenly(stamps: np.ndarray, limit: float) -> np.ndarray:
    """Rising stamps (n,), ns, by a straight line over their numbers in every part without a gap."""
    parts = np.split(stamps, np.flatnonzero(np.diff(stamps) > limit) + 1)
    spread = []
    for part in parts:
        k = np.arange(len(part))
        since = (part - part[0]).astype(float)
        line = np.polyval(np.polyfit(k, since, 1), k) if len(part) > 2 else since
        spread.append(part[0] + np.round(line).astype(np.int64))
    return np.maximum.accumulate(np.concatenate(spread))


def _said(axes: Mapping[str, str], found: Mapping[str, Recorded]) -> str:
    """Axes of the topics, and the source of that statement."""
    parts = []
    for told in dict.fromkeys(axes.values()):
        members = [found[role].source for role in axes if axes[role] == told and told]
        topics = ', '.join(dict.fromkeys(source.topic for source in members))
        by = 'as told' if any(source.frames for source in members) else 'by their frame ids'
        turned = ', turned into NED and FSD' if told == ENU_FLU else ''
        parts += [f'{told} {by}{turned}: {topics}'] if topics else []
    return f'axes {"; ".join(parts)}'


def _track(role: str, one: Recorded, axes: str, rows: np.ndarray | None = None) -> Track:
    if rows is None:
        rows = _SWAPS[role](one.rows) if axes == ENU_FLU else one.rows
    held = one.source.between == 'hold'
    least = 1 if held else 2  # no line leads from a single message
    if len(one.stamps) < least:
        expected = f'at least {least} messages on the clock of the velocity'
        raise InputError(one.bag, one.source.topic, expected, len(one.stamps) or 'none')
    told = one.source.gap is not None
    return Track(role, one.source.topic, one.stamps, rows, _limit(one), held, told=told)


def _limit(one: Recorded) -> float:
    if one.source.gap is not None:
        return one.source.gap * NANOSECONDS
    return np.inf if one.source.role == 'setpoint' else usual_limit(one.stamps)


def _velocity(one: Recorded, axes: str, pose: Track, is_world: bool) -> Track:
    """Velocity in FSD if its messages write it in the axes of the world, else of the body."""
    if not is_world:
        return _track('twist', one, axes)
    halves = [one.rows[:, :3], one.rows[:, 3:]]
    if axes == ENU_FLU:
        halves = [swap_position(half) for half in halves]
    to_body = at_times(pose, one.stamps)[:, 3:] * CONJUGATE
    rows = np.concatenate([turn(to_body, half) for half in halves], axis=1)
    return _track('twist', one, axes, rows)


def with_rates(twist: Track, pose: Track, notes: list[str]) -> Track:
    """The velocity with the rate of the attitude in the place of its angular half.

    Samples at whose stamp the attitude has no rate are left out.

    Parameters
    ----------
    twist, pose : in NED and FSD
    notes : gets a line

    """
    angular, pose = np.full((len(twist.ns), 3), np.nan), replace(pose, resets=jumps(pose))
    for first, last in between_gaps(int(pose.ns[0]), int(pose.ns[-1]), (pose,)):
        inside = slice(*np.searchsorted(pose.ns, [first, last + 1]))
        asked = slice(*np.searchsorted(twist.ns, [first, last + 1]))
        ns = pose.ns[inside]
        if len(ns) >= SMALLEST:
            t, at = ((times - ns[0]) / NANOSECONDS for times in (ns, twist.ns[asked]))
            angular[asked] = rates(t, turned(pose.rows[inside, 3:]), at, SMALLEST, bias=False).rate
    known = ~np.isnan(angular[:, 0])
    notes.append(
        f'{pose.topic}: the angular velocity is the rate of its attitude, as told, by cubics over '
        f'{SMALLEST} samples, so that its noise is correlated over them'
    )
    rows = np.concatenate([twist.rows[:, :3], angular], axis=1)
    return replace(twist, ns=twist.ns[known], rows=rows[known])


def _of_thrusters(
    every: Sequence[Recorded], vehicle: Vehicle, mapping: TopicMap, notes: list[str]
) -> Track:
    """The wrench T u of thrusts u, of commands by their curve; the vehicle file gives T in FSD."""
    thrusters = vehicle.thrusters
    if thrusters is None:
        raise InputError(vehicle.name, 'thrusters', 'the thrusters of the mapped topic', None)
    count = sum(one.rows.shape[1] for one in every)
    if count != len(thrusters.names):
        expected = f'{len(thrusters.names)} numbers, one per thruster of {vehicle.name}'
        topics = ' and '.join(one.source.topic for one in every)
        raise InputError(every[0].bag, topics, expected, f'{count}')
    parts, last = [], 0
    for one in every:
        first, last = last, last + one.rows.shape[1]
        rows = np.full((len(one.rows), count), np.nan)
        rows[:, first:last] = _thrusts(one, thrusters.names, slice(first, last), mapping, notes)
        parts.append(_track('wrench', one, '', rows))
    whole = assembled(parts, every[0].bag)
    return replace(whole, rows=whole.rows @ thrusters.matrix.T)


def _thrusts(
    one: Recorded, names: Sequence[str], own: slice, mapping: TopicMap, notes: list[str]
) -> np.ndarray:
    """Thrusts (n, k) in N of a topic with those of some thrusters."""
    source = one.source
    if not source.curve:
        if source.reversed:
            expected = 'a curve whose commands to mirror'
            raise InputError(mapping.origin, 'thrusters.curve', expected, None)
        return one.rows
    curve = load_curve(source.curve, Path(str(mapping.origin)).parent)
    mirrored = _reversed(source.reversed, names, mapping.origin)[own]
    notes.append(_said_of_curve(curve, one.rows, mirrored, source.topic))
    return curve.thrust(one.rows, mirrored)


def _reversed(told: Sequence[str | int], names: Sequence[str], origin: object) -> np.ndarray:
    """Whether each thruster is among those that were told, by name or number from 1."""
    known: dict[str | int, int] = {name: i for i, name in enumerate(names)}
    known |= {i + 1: i for i in range(len(names))}
    unknown = [one for one in told if one not in known]
    if unknown:
        expected = f'{one_of(unknown[0], names)}, or 1 to {len(names)}'
        raise InputError(origin, 'thrusters.reversed', expected, unknown[0])
    return np.isin(np.arange(len(names)), [known[one] for one in told])


def _said_of_curve(
    curve: ThrusterCurve, commands: np.ndarray, mirrored: np.ndarray, topic: str
) -> str:
    """Thruster curve in use, and the share of time within its dead band or at its end."""
    thrusts = curve.thrust(commands, mirrored)
    ends = np.isin(thrusts, [curve.thrusts[0], curve.thrusts[-1]]).mean()
    still = (thrusts == 0.0).mean()
    return (
        f'{topic}: {curve.unit} into N by {curve.name}, a steady curve of a thruster at rest; '
        f'{100 * still:.3g} % of the commands without thrust, {100 * ends:.3g} % at its ends'
    )


def axes_of(found: Recorded, notes: list[str]) -> str:
    """Axes of a topic, by what was said or, if its frame ids all say NED and FSD, by these.

    Parameters
    ----------
    found : the topic
    notes : gets a line where frame ids contradict what was said

    Raises
    ------
    InputError : nothing was said, and the frame ids do not say NED and FSD

    """
    source = found.source
    if source.role == 'thrusters':
        return ''  # thrusts have none: the vehicle file says where they point
    ids = [name for name in (found.frame, found.child) if name]
    if source.frames is None:
        if ids and all(named_axes(name) == NED_FSD for name in ids):
            return NED_FSD
        where = f'{source.topic}: frame_id' if ids else f'{source.topic}: frames'
        shown = ', '.join(repr(name) for name in ids) if ids else 'a type without frame_id'
        expected = f'--frames {NED_FSD} or {ENU_FLU}, since only what is named ned, fsd or frd'
        raise InputError(found.bag, where, f'{expected} is taken as that', shown)
    against = [name for name in ids if named_axes(name) not in (None, source.frames)]
    if against:
        notes.append(f'{source.topic}: frame_id {against[0]} taken as {source.frames}, as told')
    return source.frames
