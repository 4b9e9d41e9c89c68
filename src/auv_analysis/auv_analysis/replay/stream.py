"""The messages of a bag in the order of their log times, read as they are needed."""

import heapq
import itertools
import math
from collections.abc import Collection, Iterator
from typing import NamedTuple

import numpy as np

from auv_analysis.bag.chunks import Table
from auv_analysis.bag.mcap_file import McapFile
from auv_analysis.replay.index import NEVER, BagIndex, PlayedFile


class Logged(NamedTuple):
    """A recorded message: log time in ns, recorded name of its topic, serialized bytes."""

    ns: int
    topic: str
    data: bytes


def messages(
    index: BagIndex, topics: Collection[str], begin: int = 0, end: int = NEVER
) -> Iterator[Logged]:
    """Messages by log time; those of one log time as they stand in the bag.

    What is held at a time is what the bag has out of order, and a file is opened only when its
    first message is due, so neither long bags nor bags of many files need much memory.

    Parameters
    ----------
    index : of the bag
    topics : recorded names that are wanted
    begin, end : first and last log time, ns

    """
    heap: list[tuple[int, int, Logged | None]] = []
    sources: dict[int, Iterator[Logged]] = {}
    for number, file in enumerate(index.files):
        if file.least and file.least[0] <= end:
            sources[number] = _of_file(file, topics, begin, end)
            heap.append((file.least[0], number, None))
    heapq.heapify(heap)
    while heap:
        _, number, message = heap[0]
        if message is not None:
            yield message
        following = next(sources[number], None)
        if following is None:
            heapq.heappop(heap)
        else:
            heapq.heapreplace(heap, (following.ns, number, following))


def _of_file(file: PlayedFile, topics: Collection[str], begin: int, end: int) -> Iterator[Logged]:
    waiting: list[tuple[int, int, Logged]] = []
    opened = McapFile(file.path)
    tables, order = 0, itertools.count()
    for item in opened.records():
        if not isinstance(item, Table):
            continue
        tables += 1
        for i in _inside(item, begin, end):
            topic = opened.channels[int(item.channels[i])].topic
            if topic in topics:
                message = Logged(int(item.log_times[i]), topic, item.payload(i))
                heapq.heappush(waiting, (message.ns, next(order), message))
        sure = file.least[tables] if tables < len(file.least) else math.inf
        while waiting and waiting[0][0] <= sure:
            yield heapq.heappop(waiting)[2]
        if sure > end:
            break  # also where the file has grown since it was indexed


def _inside(table: Table, begin: int, end: int) -> list[int]:
    times = table.log_times
    return np.flatnonzero((times >= begin) & (times <= min(end, NEVER - 1))).tolist()
