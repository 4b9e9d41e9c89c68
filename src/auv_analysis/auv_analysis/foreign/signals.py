"""A recorded topic as arrays: stamps put in order, and what was odd about them said."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.foreign.mapping import HELD, Source
from auv_dynamics.ros.interface import NANOSECONDS

BACK = NANOSECONDS  # ns: stamps that fall by more have begun anew, less is a message that came late
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
    rows : (n, k) numbers

    """

    bag: Path
    source: Source
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
    """The longest part, in messages, in which the clock never starts anew."""
    cuts = np.flatnonzero(np.diff(of.stamps) < -BACK) + 1
    if not len(cuts):
        return of
    parts = np.split(np.arange(len(of.stamps)), cuts)
    kept = max(parts, key=len)
    back = np.max(-np.diff(of.stamps)[cuts - 1]) / NANOSECONDS
    notes.append(
        f'{of.source.topic}: the clock jumps back {len(cuts)} times, by up to {back:.6g} s; '
        f'read the longest of {len(parts)} stretches, left {len(of.stamps) - len(kept)} messages'
    )
    return of.part(kept)


def logged_with(of: Recorded, clock: Recorded) -> Recorded:
    """What was logged while the kept part of another topic was."""
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
