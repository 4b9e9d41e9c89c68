"""A bag that is to be played: what lies in it, and its messages in the order of their log times."""

import heapq
import itertools
import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.records import Channel

from auv_analysis.bag.chunks import MessageTable
from auv_analysis.bag.mcap_file import McapFile
from auv_analysis.bag.metadata import Definition, bag_files
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros.interface import NANOSECONDS

GAP = 60 * NANOSECONDS  # ns without a message, from which it is a gap
NEVER = (1 << 64) - 1  # ns, the latest of all log times
LATEST = (1 << 31) * NANOSECONDS  # of a ROS time
MOST_SPANS = 1000  # of a topic that are told apart
Span = tuple[int, int]  # ns, first and last log time


@dataclass
class BagIndex:
    """A bag before it is played.

    Attributes
    ----------
    bag : its folder or file
    files : file, in the order of the recording -> an entry per table of messages: the earliest log
        time in it or behind it, ns
    topics : recorded name -> its first definition
    first, last : log times in ns
    spans : recorded name -> log times of it without a gap in between, in the order of the bag
    clashes : topics that were recorded in more than one way
    notes : what is odd, one line each

    """

    bag: Path
    files: dict[Path, list[int]] = field(default_factory=dict)
    topics: dict[str, Definition] = field(default_factory=dict)
    spans: dict[str, list[Span]] = field(default_factory=dict)
    first: int = NEVER
    last: int = -1
    clashes: set[str] = field(default_factory=set)
    notes: list[str] = field(default_factory=list)

    def gaps(self, topics: Collection[str], begin: int, end: int) -> list[Span]:
        """Last log time before and first one behind each gap of some topics, from begin to end."""
        found = sorted(span for topic in topics for span in self.spans.get(topic, ()))
        gaps, reached = [], found[0][1] if found else 0
        for first, last in found:
            if first - reached > GAP and begin <= reached and first <= end:
                gaps.append((reached, first))
            reached = max(reached, last)
        return gaps


def index_bag(bag: str | Path) -> BagIndex:
    """Read a bag once, in memory that does not grow with it.

    Parameters
    ----------
    bag : folder or .mcap file, finished or not, damaged or not

    Raises
    ------
    InputError : no MCAP bag, no message in it, or a log time that is none

    """
    index = BagIndex(Path(bag))
    for path in bag_files(bag):
        index.files[path] = _indexed(path, index)
    if index.last < 0:
        raise InputError(bag, '', 'a bag with messages', 'none')
    if index.last >= LATEST:
        expected = f'log times below {LATEST} ns, what a ROS time can hold'
        raise InputError(bag, '', expected, f'{index.last} ns')
    return index


def _indexed(path: Path, index: BagIndex) -> list[int]:
    file, earliest = McapFile(path, index.notes), list[int]()
    for item in file.records():
        if isinstance(item, MessageTable):
            earliest.append(int(item.log_times.min()))
            index.first = min(index.first, earliest[-1])
            index.last = max(index.last, int(item.log_times.max()))
            for channel, numbers in file.by_channel(item):
                _span(index.spans.setdefault(channel.topic, []), item.log_times[numbers])
        elif isinstance(item, Channel):
            found = Definition.of(item, file.schema_of(item))
            known = index.topics.setdefault(item.topic, found)
            if (known.kind, known.encoding) != (found.kind, found.encoding):
                index.clashes.add(item.topic)
    least = np.minimum.accumulate(np.array(earliest[::-1], np.uint64))[::-1]
    return [int(ns) for ns in least]


def _span(spans: list[Span], times: np.ndarray) -> None:
    """Add the log times of a topic in a table; further gaps than can be told apart are none."""
    ordered = np.sort(times)
    inner = np.flatnonzero(np.diff(ordered) > GAP)
    firsts = ordered[np.concatenate([[0], inner + 1])].tolist()
    lasts = ordered[np.concatenate([inner, [-1]])].tolist()
    for first, last in zip(firsts, lasts, strict=True):
        before = spans[-1] if spans else (first, last)
        near = first - before[1] <= GAP and before[0] - last <= GAP
        if spans and (near or len(spans) >= MOST_SPANS):
            spans[-1] = min(before[0], first), max(before[1], last)
        else:
            spans.append((first, last))


class PlayedMessage(NamedTuple):
    """A recorded message: log time in ns, recorded name of its topic, serialized bytes."""

    ns: int
    topic: str
    data: bytes


def messages(
    index: BagIndex, topics: Collection[str], begin: int = 0, end: int = NEVER
) -> Iterator[PlayedMessage]:
    """Messages by log time; those of one log time as they stand in the bag.

    What is held at a time is what the bag has out of order, and a file is opened only when its
    first message is due, so neither long bags nor bags of many files need much memory.

    Parameters
    ----------
    index : of the bag
    topics : recorded names that are wanted
    begin, end : first and last log time, ns

    """
    sources = [
        _of_file(file, least, topics, begin, end)
        for file, least in index.files.items()
        if least and least[0] <= end
    ]
    for message in heapq.merge(*sources, key=lambda message: message.ns):
        if message.topic:
            yield message


def _of_file(
    file: Path, least: Sequence[int], topics: Collection[str], begin: int, end: int
) -> Iterator[PlayedMessage]:
    """Messages of a file by log time, behind one of no topic, before which it is not opened."""
    yield PlayedMessage(least[0], '', b'')
    waiting: list[tuple[int, int, PlayedMessage]] = []
    opened = McapFile(file)
    tables, order = 0, itertools.count()
    for item in opened.records():
        if not isinstance(item, MessageTable):
            continue
        tables += 1
        times = item.log_times
        for i in np.flatnonzero((times >= begin) & (times <= end)).tolist():
            topic = opened.channels[int(item.channels[i])].topic
            if topic in topics:
                message = PlayedMessage(int(times[i]), topic, item.message(i))
                heapq.heappush(waiting, (message.ns, next(order), message))
        sure = least[tables] if tables < len(least) else math.inf
        while waiting and waiting[0][0] <= sure:
            yield heapq.heappop(waiting)[2]
        if sure > end:
            break  # also where the file has grown since it was indexed
