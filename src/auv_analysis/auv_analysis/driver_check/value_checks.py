"""Checks of what stands in the messages, each by itself: frame ids and numbers."""

import numpy as np

from auv_analysis.driver_check.attitude import reordered, tilt
from auv_analysis.driver_check.finding import Finding, judged, unchecked
from auv_analysis.driver_check.recording import Recording
from auv_analysis.driver_check.settings import Settings
from auv_analysis.output.text import join, number
from auv_dynamics.ros.interface import ODOM, UNIT
from auv_dynamics.vehicle.frames import ENU_FLU, named_axes

USUAL = {ODOM, 'map', 'world', 'earth', 'base_link', 'base_footprint'}  # in ROS: ENU and FLU
CONVERTER = (
    'if its axes are ENU and FLU, as usual in ROS, put frame_converter_node between the driver '
    'and our nodes'
)
FELL_OVER = 75.0  # deg from upright that no vehicle has at a check
FLOATS = 40.0  # deg that it may have
ABOVE = 0.5  # m above the origin that are worth a word


def value_findings(recording: Recording, settings: Settings) -> list[Finding]:
    """Findings of a recording with one message at least."""
    return [
        _frames(recording, settings),
        _finite(recording),
        _norm(recording),
        _upright(recording),
        _depth(recording),
    ]


def _frames(recording: Recording, settings: Settings) -> Finding:
    ours = (settings.frames.odom, settings.frames.base)
    expected = f'header.frame_id {ours[0]}, child_frame_id {ours[1]}'
    pairs = sorted(recording.frames, key=lambda pair: -recording.frames[pair])
    found = join([f'{header!r} and {child!r}' for header, child in pairs[:3]])
    if len(pairs) > 1:
        found += f': {len(pairs)} pairs in turn'
    header, child = pairs[0]
    words = {name.rpartition('/')[2] for name in (header, child)}
    if named_axes(header) == ENU_FLU or named_axes(child) == ENU_FLU or words & USUAL:
        advice = f'{CONVERTER}; if they are NED and FSD all the same, '
    else:
        advice = 'if the axes are NED and FSD, '
    advice += f'give our nodes odom_frame: {header or "..."} and base_frame: {child or "..."}'
    if not (header and child):
        advice = 'fill in header.frame_id and child_frame_id: without them no axes are told'
    return judged('frames', pairs == [ours], expected, found, advice, pairs=len(pairs))


def _finite(recording: Recording) -> Finding:
    bad, n = int((~recording.finite).sum()), len(recording.x)
    found = f'{bad} of {n} messages have numbers that are not'
    if bad:
        names = ('position', 'orientation', 'twist.linear', 'twist.angular')
        parts = np.split(recording.x, [3, 7, 10], axis=1)
        broken = [
            name for name, part in zip(names, parts, strict=True) if not np.isfinite(part).all()
        ]
        found += f', in {join(broken)}'
    for topic, count in recording.unreadable.items():
        found += f'; {count} of {topic} are no messages of its type'
        bad += count
    advice = 'publish nothing while there is no measurement: the controller refuses such messages'
    return judged('finite', not bad, 'finite numbers in every message', found, advice, messages=bad)


def _norm(recording: Recording) -> Finding:
    expected = f'a norm within {UNIT:g} of 1, as the controller requires'
    q = recording.x[recording.finite, 3:7]
    if not len(q):
        return unchecked('quaternion_norm', expected, 'no message with finite numbers')
    off = np.abs(np.linalg.norm(q, axis=1) - 1.0)
    worst, bad = float(off.max()), int((off > UNIT).sum())
    found = f'largest deviation {worst:.2g}; {bad} of {len(q)} messages beyond'
    advice = 'normalise the quaternion'
    if (np.abs(q) < UNIT).all():
        advice = 'fill in pose.pose.orientation: it is zero, which is no attitude'
    return judged('quaternion_norm', not bad, expected, found, advice, largest_deviation=worst)


def _upright(recording: Recording) -> Finding:
    expected = f'at most {FELL_OVER:g} deg from upright, by the median'
    q = recording.x[recording.finite, 3:7]
    norm = np.linalg.norm(q, axis=1, keepdims=True)
    q = q[norm[:, 0] > 0.5] / norm[norm[:, 0] > 0.5]
    if not len(q):
        return unchecked('upright', expected, 'no attitude')
    lies, else_lies = (float(np.degrees(np.median(tilt(one)))) for one in (q, reordered(q)))
    found = f'{lies:.1f} deg'
    advice = 'body axes with z up, as in FLU? turn them to forward-starboard-down, or '
    advice += CONVERTER.partition('put ')[2].join(['put ', ''])
    if else_lies < FLOATS:
        advice = f'w written first into x? read so it is {else_lies:.1f} deg; else {advice}'
    return judged('upright', lies <= FELL_OVER, expected, found, advice, tilt_deg=lies,
                  tilt_w_first_deg=else_lies)  # fmt: skip


def _depth(recording: Recording) -> Finding:
    expected = 'z is down: not above its origin throughout'
    z = recording.x[recording.finite, 2]
    if not len(z):
        return unchecked('depth', expected, 'no message with finite numbers')
    low, high = float(z.min()), float(z.max())
    found = f'z from {number(low)} to {number(high)} m'
    if high < -ABOVE:
        why = f'{found}: above the origin throughout; if the vehicle was below it, z is up'
        advice = 'compare with the depth sensor: NED has z down'
        return unchecked('depth', expected, why, advice, lowest=low, highest=high)
    return judged('depth', True, expected, found, '', lowest=low, highest=high)
