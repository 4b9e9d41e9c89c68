"""Bags to be cut and damaged, and what can be hoped for of them, said as plainly as it can be."""

import os
import time
from collections import Counter
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any

from helpers.made_messages import STRING, TYPES, odometry, serialized, stamped
from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from rosbags.highlevel import AnyReader

from auv_analysis.bag.metadata import Definition
from auv_analysis.bag.output import Storage
from auv_analysis.bag.writer import BagWriter

STEP = 10_000_000
UPRIGHT = [0, 0, 0, 1, *[0] * 9]
QOS = """\
- history: keep_last
  depth: 3000
  reliability: reliable
  durability: volatile
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: automatic
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
"""
ATTACHED = {'scenario.yaml': 'name: made\n', '../escape.yaml': 'a: 1\n', 'params.yaml': 'x: {}\n'}
Row = tuple[str, int, bytes]


def write_bag(folder: Path, steps: int = 30, first: int = 0, **storage: Any) -> Path:
    """A bag by our own writer, in small chunks."""
    writer = BagWriter(folder, ATTACHED, Storage(**{'chunk_size': 1500, **storage}))
    for topic, kind in (
        ('/odom', 'nav_msgs/msg/Odometry'),
        ('/wrench', 'geometry_msgs/msg/WrenchStamped'),
        ('/remark', STRING),
    ):
        text = TYPES.generate_msgdef(kind, ros_version=2)[0]
        writer.add_channel(Definition(topic, kind, qos=QOS, digest=TYPES.hash_rihs01(kind)), text)
    for k in range(first, first + steps):
        odom, wrench = odometry(k * STEP, UPRIGHT), stamped('Wrench', k * STEP, [0.1 * k] * 6)
        writer.write('/odom', k * STEP, serialized(odom))
        writer.write('/wrench', k * STEP, serialized(wrench))
        if k % 7 == 0:
            writer.write('/remark', k * STEP, serialized(TYPES.types[STRING]('x' * k)))
    writer.close()
    return folder


def old(path: Path) -> Path:
    """The file, as if it had been written a while ago: nobody is recording it."""
    then = time.time() - 60
    os.utime(path, (then, then))
    return path


def messages_of(path: Path) -> list[Row]:
    """Messages by the reader of the mcap package, checksums verified, in the order of the file."""
    with path.open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True)
        return [
            (c.topic, m.log_time, m.data)
            for _, c, m in reader.iter_messages(None, log_time_order=False)
        ]


def attachments_of(path: Path) -> list[tuple[str, bytes]]:
    """Names and data of the attachments, by the index where there is one."""
    with path.open('rb') as stream:
        listed = [(a.name, a.data) for a in make_reader(stream).iter_attachments()]
        records = StreamReader(path.open('rb')).records
        found = [(r.name, r.data) for r in records if isinstance(r, Attachment)]
    assert listed in ([], found)
    return found


def seen_by_rosbags(bag: Path) -> Counter:
    """Messages by topic and time as rosbags reads them."""
    with AnyReader([bag]) as reader:
        return Counter((c.topic, t, bytes(d)) for c, t, d in reader.messages())


@lru_cache(8)
def places(data: bytes) -> list[tuple[int, int, Any]]:
    """Begin, end and record of all records of an undamaged file."""
    found, place = [], 8
    while place < len(data) - 8:
        end = place + 9 + int.from_bytes(data[place + 1 : place + 9], 'little')
        reader = StreamReader(BytesIO(data[place:end]), skip_magic=True, emit_chunks=True)
        found.append((place, end, next(reader.records, None)))
        place = end
    return found


def hoped_for(data: bytes, touched: Any) -> tuple[list[Row], list[str]]:
    """Messages and names of attachments of the records that are not touched.

    Parameters
    ----------
    data : of the undamaged file
    touched : begin and end of a record -> whether damage has touched it

    """
    rows: list[Row] = []
    names, topics = [], topics_of(data)
    for begin, end, record in places(data):
        if touched(begin, end):
            continue
        if isinstance(record, Attachment):
            names.append(record.name)
        inner = breakup_chunk(record) if isinstance(record, Chunk) else [record]
        found = [r for r in inner if isinstance(r, Message)]
        rows += [(topics[m.channel_id], m.log_time, m.data) for m in found]
    return rows, names


@lru_cache(8)
def topics_of(data: bytes) -> dict[int, str]:
    """Channel id -> topic, of an undamaged file."""
    records = [record for _, _, record in places(data)]
    chunks = [r for chunk in records if isinstance(chunk, Chunk) for r in breakup_chunk(chunk)]
    return {r.id: r.topic for r in [*records, *chunks] if isinstance(r, Channel)}
