"""Records for identification from bags: ours as they are, others with a mapping."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from auv_analysis.bag.any_bag import survey
from auv_analysis.bag.foreign_checks import contradictions
from auv_analysis.bag.foreign_fields import COMPONENTS
from auv_analysis.bag.foreign_messages import read_sources
from auv_analysis.bag.foreign_topics import TopicMap, read_mapping
from auv_analysis.bag.foreign_tracks import tracks_of, unknown_angles
from auv_analysis.bag.tracks import Track
from auv_analysis.output.progress import say
from auv_analysis.output.text import join
from auv_analysis.studies.identify.plausibility import check_rates
from auv_analysis.studies.identify.record import Record, cut_at_jumps, long_enough, of_tracks
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros.interface import GROUND_TRUTH, ODOM, WRENCH, WRENCH_APPLIED
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle

USUAL = 0.95  # quantile of a wrench that single peaks do not move
CLIPPED = 1.5  # times what acts: more than a lag takes away
NOTHING = 1e-3  # of the largest command of its kind


def read_records(
    bag: Path, vehicle: Vehicle, mapping: TopicMap | None, *, applied: bool, notes: list[str]
) -> list[Record]:
    """Stretches of a bag with attitude, velocity and wrench.

    Parameters
    ----------
    bag : folder or file of any kind
    vehicle : the prior
    mapping : which topics hold what; None: those of our nodes
    applied : the wrench that acted in place of the command
    notes : gets what is worth saying

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    mapping = _ours(bag, applied=applied) if mapping is None else mapping
    if not mapping.knows_wrench:
        expected = 'wrench (--wrench) or thrusters: motion alone tells no M, D and g'
        raise InputError(mapping.origin, 'wrench', expected, None)
    if applied and not any(one.role == WRENCH_APPLIED for one in mapping.sources.values()):
        expected = 'a topic, since --applied asks for it'
        raise InputError(mapping.origin, WRENCH_APPLIED, expected, None)
    tracks, otherwise = tracks_of(read_sources(bag, mapping, notes), mapping, vehicle, notes)
    tracks['twist'] = without_constants(tracks['twist'], notes)
    lacking = unknown_angles(tracks['pose'], mapping)
    if lacking:
        found = f'nothing for {", ".join(lacking)}'
        raise InputError(bag, 'pose', 'phi, theta and psi: the model turns with them', found)
    role = WRENCH_APPLIED if applied else WRENCH
    if not tracks[role].given.all():
        raise InputError(bag, role, 'all six components', 'some that no topic has')
    tracks, warnings = cut_at_jumps(tracks, role)
    if not applied and WRENCH_APPLIED in tracks:
        warnings += _not_acting(tracks[WRENCH].rows, tracks[WRENCH_APPLIED].rows)
    for note in warnings:
        say(f'warning: {bag}: {note}')
    notes += [*contradictions(tracks, otherwise, mapping), *warnings]
    records = of_tracks(bag.absolute().name, tracks, role)
    if not any(record.known.any() for record in records):
        found = 'a velocity that never changes' if records else 'none'
        raise InputError(bag, '', 'a second and more with attitude, velocity and wrench', found)
    for record in records:
        check_rates(record)
    return records


def _not_acting(command: np.ndarray, acting: np.ndarray) -> Iterator[str]:
    """Axes on which far less acted than was commanded, beyond a lag's effect; (n, 6), (m, 6)."""
    asked, given = (np.quantile(np.abs(rows), USUAL, axis=0) for rows in (command, acting))
    least = np.repeat([NOTHING * asked[:3].max(), NOTHING * asked[3:].max()], 3)
    less = (asked > CLIPPED * given) & (asked > least)
    if less.any():
        yield (
            f'{join([DOFS[i] for i in np.flatnonzero(less)])}: much less acted than was commanded, '
            'which the model takes for its wrench: see --applied'
        )


def without_constants(twist: Track, notes: list[str]) -> Track:
    """The velocity without components that never change, which no sensor gives."""
    constant = (twist.rows == twist.rows[0]).all(axis=0)
    for name in np.array(COMPONENTS['twist'])[constant].tolist():
        notes.append(f'{twist.topic}: {name} is constant, taken as not measured')
    return replace(twist, rows=np.where(constant, np.nan, twist.rows))


def _ours(bag: Path, *, applied: bool) -> TopicMap:
    topics = survey(bag).types
    found = {}
    for role, name in (('odometry', ODOM), (WRENCH, WRENCH), (WRENCH_APPLIED, WRENCH_APPLIED)):
        some = [topic for topic in topics if topic.rpartition('/')[2] == name
                and not topic.endswith(GROUND_TRUTH)]  # fmt: skip
        if role == WRENCH_APPLIED and not applied and len(some) != 1:
            continue
        if len(some) != 1:
            text = f'one topic {name}, or --odom, --wrench and --frames, or --map'
            raise InputError(bag, role, text, ', '.join(some) or 'none')
        found[role] = some[0]
    return read_mapping(None, found)


def parts(records: Sequence[Record], spans: Sequence[tuple[float, float]]) -> list[Record]:
    """The parts of records within spans of time, s; none given: all of them."""
    if not spans:
        return list(records)
    if any(last[1] > after[0] for last, after in pairwise(sorted(spans))):
        raise InputError('--part', '', 'parts that do not overlap', str(spans))
    found = long_enough([
        record.part(max(begin, record.start), min(end, record.end))
        for record in records for begin, end in spans
    ])  # fmt: skip
    if not found:
        expected = f'a time up to {records[-1].end:g} s, for a second and more'
        raise InputError('--part', '', expected, str(spans))
    return found


def on_one_step(records: Sequence[Record]) -> list[Record]:
    """Records whose commands have the same step: those of the finest are repeated in the others."""
    step = min(record.step for record in records)
    return [record if record.step == step else _finer(record, step) for record in records]


def _finer(record: Record, step: float) -> Record:
    count = int((record.end - record.start) / step + 1e-6)  # 0.3 / 0.1 is less than 3
    rows = ((np.arange(count) + 0.5) * step / record.step).astype(int)
    return replace(record, step=step, command=record.command[rows])
