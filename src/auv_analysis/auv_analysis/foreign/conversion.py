"""From recorded messages to signals in NED and FSD with rising stamps."""

from collections.abc import Mapping

import numpy as np

from auv_analysis.foreign.axes import axes_of, from_earth, in_our_axes, swap_earth
from auv_analysis.foreign.doubts import of_the_motion
from auv_analysis.foreign.mapping import Source, TopicMap
from auv_analysis.foreign.signals import (
    Recorded,
    logged_with,
    longest_stretch,
    on_the_clock,
    ordered,
)
from auv_analysis.foreign.tracks import Track, at_times, usual_limit
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.vehicle.frames import ENU_FLU
from auv_dynamics.vehicle.vehicle import Vehicle

FRAMES = ('child', 'world')  # in which a velocity may be written
POSE, TWIST = slice(0, 7), slice(7, 13)  # of an odometry's row


def tracks_of(
    found: dict[str, Recorded], mapping: TopicMap, vehicle: Vehicle, notes: list[str]
) -> dict[str, Track]:
    """Signals of the mapped topics.

    Parameters
    ----------
    found : role -> messages in the order of the bag
    mapping : how they are meant
    vehicle : whose thrusters turn thrusts into a wrench
    notes : gets a line for everything that was assumed or is odd

    Returns
    -------
    tracks : 'pose', 'twist' and 'wrench', and 'wrench_applied' and 'setpoint' where mapped

    Raises
    ------
    InputError : axes that nobody told, thrusts that do not fit the vehicle

    """
    found = _on_one_clock(found, notes)
    axes = {role: axes_of(one, notes) for role, one in found.items()}
    notes.append(_said(axes, found))
    if 'odometry' in found:
        both, told = found.pop('odometry'), axes.pop('odometry')
        for role, columns in (('pose', POSE), ('twist', TWIST)):
            found[role] = both.part(slice(None), columns)
            axes[role] = told
    tracks = {'pose': _track('pose', found['pose'], axes['pose'])}
    told, other = FRAMES if found['twist'].source.twist_frame == 'child' else FRAMES[::-1]
    twist, instead = (
        _velocity(found['twist'], axes['twist'], tracks['pose'], frame) for frame in (told, other)
    )
    tracks['twist'] = twist
    notes += of_the_motion(tracks['pose'], twist, instead, told)
    for role, one in found.items():
        if role == 'thrusters':
            tracks['wrench'] = _of_thrusters(one, vehicle, mapping)
        elif role not in tracks:
            tracks[role] = _track(role, one, axes[role])
    return tracks


def _on_one_clock(found: Mapping[str, Recorded], notes: list[str]) -> dict[str, Recorded]:
    """The same with rising stamps of one clock that does not start anew."""
    clock = found['odometry' if 'odometry' in found else 'twist']
    kept = longest_stretch(clock, [])
    timed = {role: on_the_clock(one, clock, notes) for role, one in found.items()}
    if len(kept.log) < len(clock.log):
        timed = {
            role: one if one.source.topic == clock.source.topic else logged_with(one, kept)
            for role, one in timed.items()
        }
    return {role: ordered(longest_stretch(one, notes), notes) for role, one in timed.items()}


def _said(axes: Mapping[str, str], found: Mapping[str, Recorded]) -> str:
    """Which axes the topics have and who says so."""
    parts = []
    for told in dict.fromkeys(axes.values()):
        members = [found[role].source for role in axes if axes[role] == told and told]
        topics = ', '.join(dict.fromkeys(source.topic for source in members))
        by = 'as told' if any(source.frames for source in members) else 'by their frame ids'
        turned = ', turned into NED and FSD' if told == ENU_FLU else ''
        parts += [f'{told} {by}{turned}: {topics}'] if topics else []
    return f'axes {"; ".join(parts)}'


def _track(role: str, one: Recorded, axes: str, rows: np.ndarray | None = None) -> Track:
    rows = in_our_axes(one.rows, role, axes) if rows is None else rows
    least = 2 if role in ('pose', 'twist') else 1  # a motion has a rate
    if len(one.stamps) < least:
        expected = f'at least {least} messages on the clock of the velocity'
        raise InputError(one.bag, one.source.topic, expected, len(one.stamps) or 'none')
    return Track(role, one.source.topic, one.stamps, rows, _limit(one), _is_held(one.source))


def _limit(one: Recorded) -> float:
    if one.source.gap is not None:
        return one.source.gap * NANOSECONDS
    return np.inf if one.source.role == 'setpoint' else usual_limit(one.stamps)


def _is_held(source: Source) -> bool:
    return source.between == 'hold'


def _velocity(one: Recorded, axes: str, pose: Track, frame: str) -> Track:
    """Velocity in FSD if its messages write it in the axes of that frame."""
    if frame == 'child':
        return _track('twist', one, axes)
    earth = swap_earth(one.rows) if axes == ENU_FLU else one.rows
    inside = np.clip(one.stamps, pose.ns[0], pose.ns[-1])
    return _track('twist', one, axes, from_earth(earth, at_times(pose, inside)[:, 3:]))


def _of_thrusters(one: Recorded, vehicle: Vehicle, mapping: TopicMap) -> Track:
    """The wrench T u of thrusts u; the vehicle file gives T in FSD."""
    thrusters = vehicle.thrusters
    if thrusters is None:
        raise InputError(mapping.vehicle, 'thrusters', 'the thrusters of the mapped topic', None)
    if one.rows.shape[1] != len(thrusters.names):
        expected = f'{len(thrusters.names)} numbers, one per thruster of {vehicle.name}'
        raise InputError(one.bag, one.source.topic, expected, f'{one.rows.shape[1]}')
    return _track('wrench', one, '', one.rows @ thrusters.matrix.T)
