"""Mapped topics of a bag as arrays: which numbers a message holds, stamps put in order."""

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.bag.any_bag import messages, survey
from auv_analysis.bag.csv_logs import CSV, Block, blocks_of_csv
from auv_analysis.bag.foreign_fields import (
    FAR,
    FieldError,
    MessageReader,
    Reading,
    are_usable,
    presets,
)
from auv_analysis.bag.foreign_topics import HELD, MappedTopic, TopicMap, other_odometries
from auv_analysis.bag.metadata import is_csv
from auv_analysis.bag.reading import are_swapped, strays, stretches
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import meant
from auv_dynamics.files.yaml_files import is_number
from auv_dynamics.ros.interface import NANOSECONDS

TOGETHER = 4096  # messages that wait as objects before they become rows of arrays
APART = NANOSECONDS  # ns between logged and stamped time from which they are two clocks


@dataclass(frozen=True, eq=False)
class Recorded:
    """Messages of one topic in the order of the bag.

    Attributes
    ----------
    bag : where it comes from
    source : the topic
    frame, child : frame ids of its first message
    log : (n,) times of logging, ns
    stamps : (n,) stamps in ns; those of logging where the messages have none
    stamped : whether the stamps are those of headers
    rows : (n, k) numbers, NaN in columns that the topic does not have

    """

    bag: Path
    source: MappedTopic
    frame: str
    child: str
    log: np.ndarray
    stamps: np.ndarray
    stamped: bool
    rows: np.ndarray

    def part(self, keep: Any, columns: Any = slice(None)) -> 'Recorded':
        """The messages that an index, slice or mask keeps, and some of their numbers."""
        rows = self.rows[keep][:, columns]
        return replace(self, log=self.log[keep], stamps=self.stamps[keep], rows=rows)


def on_the_clock(of: Recorded, clock: Recorded, notes: list[str]) -> Recorded:
    """Logged times of a topic put on the clock of the stamps of another one.

    Parameters
    ----------
    of : a topic without stamps; one with stamps is returned as it is
    clock : the topic whose stamps count
    notes : gets a line where the clocks are not the same

    """
    if of.stamped or not clock.stamped:
        return of
    apart = float(np.median(clock.log - clock.stamps)) / NANOSECONDS
    if abs(apart) * NANOSECONDS < APART:
        return of
    order = np.argsort(clock.log, kind='stable')
    log, stamps = clock.log[order], np.maximum.accumulate(clock.stamps[order])
    inside = np.clip(of.log, log[0], log[-1])  # before and behind it, both clocks go on alike
    moved = np.interp(inside - log[0], log - log[0], stamps - stamps[0])
    moved_ns = stamps[0] + np.round(moved).astype(np.int64) + of.log - inside
    notes.append(
        f'{of.source.topic}: logged {apart:.6g} s off the stamps of {clock.source.topic}; put on '
        'its clock by the messages that were logged around each'
    )
    return replace(of, stamps=moved_ns)


def longest_stretch(of: Recorded, notes: list[str]) -> Recorded:
    """The longest part, in messages, in which the clock never starts anew, without stray stamps."""
    stray = strays(of.stamps, of.source.topic, notes)
    of = of.part(~stray) if stray.any() else of
    edges = stretches(of.stamps)
    times = len(edges) - 2
    if not times or _is_one_clock(of):
        return of
    i = int(np.argmax(np.diff(edges)))
    kept = of.part(slice(*edges[i : i + 2]))
    back = -np.diff(of.stamps).min() / NANOSECONDS
    notes.append(
        f'{of.source.topic}: the clock jumps back {times} times, by up to {back:.6g} s; '
        f'read the longest of {times + 1} stretches, '
        f'left {len(of.stamps) - len(kept.stamps)} messages'
    )
    return kept


def _is_one_clock(of: Recorded) -> bool:
    """Whether parts that were logged right after one another only stand in another order."""
    in_time = of.stamps[np.argsort(of.log, kind='stable')]
    return are_swapped(of.log) and len(stretches(in_time)) == 2


def logged_with(of: Recorded, clock: Recorded) -> Recorded:
    """Messages logged during the kept part of another topic."""
    return of.part((of.log >= clock.log.min()) & (of.log <= clock.log.max()))


def ordered(of: Recorded, notes: list[str]) -> Recorded:
    """Messages by rising stamps, each stamp once.

    Of a doubled stamp the first measurement is kept, but the last command: it is the one that held.
    """
    late = int(np.count_nonzero(of.stamps < np.maximum.accumulate(of.stamps)))
    last = of.source.role in HELD
    of = of.part(slice(None, None, -1)) if last else of
    stamps, index = np.unique(of.stamps, return_index=True)
    doubled = len(of.stamps) - len(stamps)
    if late:
        notes.append(f'{of.source.topic}: {late} messages came out of order and were sorted')
    if doubled:
        which = 'last' if last else 'first'
        notes.append(f'{of.source.topic}: {doubled} stamps came again, the {which} of each is kept')
    return of.part(index)


def read_sources(bag: Path, mapping: TopicMap, notes: list[str]) -> dict[str, Recorded]:
    """Key of the mapping -> its messages, in their order in the bag.

    Parameters
    ----------
    bag : folder or file
    mapping : its topics
    notes : gets a line for everything that is odd

    Raises
    ------
    InputError : a topic is not in the bag, of another type, empty or of no use

    """
    types = survey(bag).types
    found = {key: _Messages(bag, key, one, types) for key, one in mapping.sources.items()}
    by_topic: dict[str, list[_Messages]] = {}
    for one in found.values():
        by_topic.setdefault(one.source.topic, []).append(one)
    if is_csv(bag):
        for topic, block in blocks_of_csv(bag, by_topic.keys(), notes):
            for one in by_topic[topic]:
                one.add_block(block)
    else:
        for topic, log, message in messages(bag, by_topic.keys(), notes):
            for one in by_topic[topic]:
                one.add(log, message)
    return {key: one.recorded(notes) for key, one in found.items()}


class _Messages:
    """Takes the messages of one topic for one role.

    Parameters
    ----------
    bag, key : for refusals
    source : the topic
    types : topic -> type, of the bag

    """

    def __init__(self, bag: Path, key: str, source: MappedTopic, types: dict[str, str]):
        self.source, self._bag, self._key = source, bag, key
        is_odometry = source.role == 'odometry'
        self._others = other_odometries(types, source.topic) if is_odometry else ''
        self._read = self._reader(types)
        self._waiting: list[tuple[int, Reading]] = []
        self._parts: list[tuple[np.ndarray, np.ndarray]] = []
        self._frames: set[tuple[str, str]] = set()
        self._width, self._stamped = 0, False

    def _reader(self, types: dict[str, str]) -> MessageReader:
        source, known = self.source, presets(self.source.role)
        kind = types.get(source.topic)
        if kind is None:
            fitting = [name for name in sorted(types) if source.fields or types[name] in known]
            listed = f': {", ".join(fitting)}{meant(source.topic, fitting)}' if fitting else ''
            raise InputError(self._bag, self._key, f'a topic of the bag{listed}', source.topic)
        paths = known.get(kind) if source.fields is None else source.fields
        if paths is None:
            raise self._refusal(' or '.join(known), f'{kind}, of which fields: may name paths')
        self._has_log = kind != CSV
        if source.stamp is None and not self._has_log:
            expected = 'the column with the time, which a CSV file needs'
            raise InputError(self._bag, f'{self._key}.stamp', expected, None)
        return MessageReader(source.role, paths, source.units, source.stamp)

    def add_block(self, block: Block) -> None:
        """Take the next lines of a table."""
        with suppress(AttributeError):  # a path to no column: the message of a line says which
            stamps, rows = self._read.block(block.column, len(block.lines))
        if not self._frames:
            self.add(0, block.first())
            self._waiting.clear()
        self._parts.append((np.stack([stamps, stamps], axis=1), rows))

    def add(self, log: int, message: Any) -> None:
        """Take the next message, logged at a time in ns."""
        try:
            reading = self._read(message)
        except FieldError as error:
            key, expected, found = error.args
            if self.source.fields is None and not key.startswith('stamp'):
                raise self._refusal('messages of its type', found) from None
            raise InputError(self._bag, f'{self._key}.{key}', expected, found) from None
        except (LookupError, AttributeError, TypeError, ValueError) as error:
            # other fields than its type has, or a shorter array
            raise self._refusal('messages of its type', str(error)) from None
        self._width = self._width or len(reading.row)
        if len(reading.row) != self._width:
            expected = f'{self._width} numbers in each message'
            raise self._refusal(expected, f'{len(reading.row)}')
        self._frames.add((reading.frame, reading.child))
        if len(self._frames) > 1:
            ids = sorted(' '.join(filter(None, pair)) or 'none' for pair in self._frames)
            raise self._refusal('the same frame_id in all messages', '; '.join(ids))
        self._stamped = reading.stamp is not None
        self._waiting.append((min(log, FAR), reading))
        if len(self._waiting) == TOGETHER:
            self._settle()

    def _settle(self) -> None:
        """Turn what waits into arrays."""
        times = [(log, log if one.stamp is None else one.stamp) for log, one in self._waiting]
        try:
            rows = np.array([one.row for _, one in self._waiting], float)
        except (TypeError, ValueError):  # a text among numbers
            every = (value for _, one in self._waiting for value in one.row)
            found = next((value for value in every if not is_number(value)), 'none')
            raise self._refusal('a number in every message', str(found)) from None
        self._parts.append((np.array(times, np.int64), self._read.rows(rows)))
        self._waiting.clear()

    def recorded(self, notes: list[str]) -> Recorded:
        """All messages; those without usable numbers are left out, and counted in the notes."""
        topic = self.source.topic
        if self._waiting:
            self._settle()
        if not self._parts:
            raise self._refusal('messages', 'none')
        times, rows = (np.concatenate(part) for part in zip(*self._parts, strict=True))
        self._parts.clear()
        log, stamps = times.T if self._has_log else (times[:, 1], times[:, 1])
        if self.source.stamp is not None and not stamps.any() and np.isnan(rows).all():
            expected = f'times before the year 2116, in {self.source.stamp[1]}'
            raise InputError(self._bag, f'{self._key}.stamp', expected, 'none')
        stamped = self._stamped and self.source.stamps != 'log'
        if stamped and not stamps.any():
            notes.append(f'{topic}: every stamp is zero, so the time of logging is taken')
            stamped = False
        elif not self._stamped:
            notes.append(f'{topic}: messages without stamp, so the time of logging is taken')
        if self._read.converted:
            notes.append(f'{topic}: {self._read.converted}')
        usable = are_usable(rows, self.source.role)
        if not usable.any():
            raise self._refusal(f'finite numbers and unit quaternions{self._others}', 'none')
        if self.source.role == 'odometry' and self.source.fields is None:
            self._check_moving(rows[usable], notes)
        if not usable.all():
            lost = np.count_nonzero(~usable)
            notes.append(
                f'{topic}: {lost} of {len(rows)} messages were left out: not finite, or without '
                'a unit quaternion'
            )
        frame, child = next(iter(self._frames))
        found = Recorded(
            self._bag, self.source, frame, child, log, stamps if stamped else log, stamped, rows
        )
        return found if usable.all() else found.part(usable)

    def _check_moving(self, rows: np.ndarray, notes: list[str]) -> None:
        """Refuse an odometry without velocities, or of zeros, where there is another one."""
        if self._others and np.isnan(rows[:, 7:]).all():
            raise self._refusal(f'velocities{self._others}', 'none that is a number')
        if not np.nan_to_num(rows[:, [0, 1, 2, *range(7, 13)]]).any():
            if self._others:
                raise self._refusal(f'a motion{self._others}', 'position and velocity all zero')
            notes.append(f'{self.source.topic}: position and velocity are zero throughout')

    def _refusal(self, expected: str, found: str) -> InputError:
        return InputError(self._bag, self.source.topic, expected, found)
