"""What the records of a file hold for its repair: definitions, messages, attachments."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from mcap.records import Attachment, Channel, McapRecord, Message, Metadata, Schema

from auv_analysis.bag.tables import HEAD, Table, gather
from auv_analysis.recovery.scan import Found


class Messages(NamedTuple):
    """Messages in the order of the file.

    Attributes
    ----------
    channels, sequences : (n,) as they stand in the records
    log_times, publish_times : (n,) ns
    places : (n,) of the records in their chunk, bytes
    payload : number of a message -> its data, serialized

    """

    channels: np.ndarray
    sequences: np.ndarray
    log_times: np.ndarray
    publish_times: np.ndarray
    places: np.ndarray
    payload: Callable[[int], bytes]


def parts_of(found: Found) -> Iterator[Messages | Schema | Channel | Attachment | Metadata]:
    """Parts of a record; messages of a chunk together, as far as definitions allow."""
    if found.record is not None:
        for part in found.parts or [found.record]:
            yield from _part(part)


def _part(
    part: Table | McapRecord | None,
) -> Iterator[Messages | Schema | Channel | Attachment | Metadata]:
    if isinstance(part, Table):
        yield _messages(part)
    elif isinstance(part, Message):
        yield _message(part)
    elif isinstance(part, Schema | Channel | Attachment | Metadata):
        yield part


def _messages(table: Table) -> Messages:
    places = table.starts - HEAD.itemsize
    head = gather(table.data, places, HEAD.itemsize).view(HEAD)[:, 0]
    return Messages(
        table.channels,
        head['sequence'],
        table.log_times,
        head['publish_time'],
        places,
        table.payload,
    )


def _message(message: Message) -> Messages:
    numbers = message.channel_id, message.sequence, message.log_time, message.publish_time, 0
    channel, sequence, log, publish, place = (np.array([n], np.uint64) for n in numbers)
    return Messages(channel, sequence, log, publish, place, lambda _: message.data)
