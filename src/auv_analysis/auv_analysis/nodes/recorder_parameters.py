"""The recorder's ROS parameters."""

import re
import shutil
from dataclasses import dataclass
from pathlib import Path

from rclpy.node import Node

from auv_analysis.bag import recording as described
from auv_analysis.nodes.recorder_topics import ALL, Wanted
from auv_analysis.recording import COMPRESSIONS, BagWriter, Storage
from auv_analysis.recording.storage import FREE_SPACE, LARGEST_CHUNK, LEAST_DURATION, LEAST_SIZE
from auv_dynamics.files.errors import InputError, reason
from auv_dynamics.files.nearest import meant
from auv_dynamics.files.yaml_files import read_text
from auv_dynamics.ros import interface, topics
from auv_dynamics.ros.parameters import declare, refuse_unknown
from auv_dynamics.ros.private import RCLError


@dataclass(frozen=True)
class RecorderParameters:
    """What the recorder was asked for.

    Attributes
    ----------
    bag : its folder
    writer : of the bag, open
    topics : step topics that are expected, each step of each
    others : which other topics are recorded
    step_ns : ns between steps
    last : index of the last step, None: until SIGTERM
    last_due : stamp in ns of analysis' last sample, None: not waited for
    strict : every step once and in order, as in lock-step; else gaps are only counted

    """

    bag: Path
    writer: BagWriter
    topics: tuple[str, ...]
    others: Wanted
    step_ns: int
    last: int | None
    last_due: int | None
    strict: bool


def recorder_parameters(node: Node) -> RecorderParameters:
    """Declare and check the parameters, open the bag; InputError when something is wrong."""
    name = node.get_name()
    known = [topic.name for topic in topics.STEP_TOPICS]
    bag = declare(node, 'bag', str, '', 'folder of the bag')
    usual = list(interface.STEP_TOPICS)
    expected = declare(node, 'topics', list[str], usual, 'step topics that are expected')
    others = _others(node)
    duration = declare(
        node,
        'duration',
        float,
        0.0,
        'length of the recording, s; 0: until a signal ends it',
        at_least=0.0,
    )
    step = declare(node, 'step', float, 0.01, 'time step, s', at_least=1e-9)
    every = declare(
        node, 'analysis_every', int, 0, 'steps between analysis samples, 0: not waited for',
        at_least=0,
    )  # fmt: skip
    strict = declare(node, 'strict', bool, True, 'a lost or doubled step ends the recording')
    pace = node.resolve_topic_name(expected[0]) if expected else ''
    storage = _storage(node, pace)
    files = declare(node, 'attachments', list[str], None, 'name=path of files kept in the bag')
    refuse_unknown(node)
    unknown = [topic for topic in expected if topic not in known]
    if unknown:
        listed = f'step topics: {", ".join(known)}{meant(unknown[0], known)}'
        raise InputError(name, 'topics', listed, unknown[0])
    if not bag:
        raise InputError(name, 'bag', 'the folder of the bag', None)
    attachments = {}
    for entry in files or []:
        label, equals, path = entry.partition('=')
        source = Path(path if equals else label)
        attachments[label if equals else source.name] = read_text(source, 'attachment')
    attachments[described.NAME] = described.recording_text(
        strict, remapped(node), node.get_namespace()
    )
    writer = _writer(name, Path(bag), attachments, storage)
    last = round(duration / step) if duration else None
    step_ns = round(step * interface.NANOSECONDS)
    due = last // every * every * step_ns if last is not None and every else None
    return RecorderParameters(
        Path(bag), writer, tuple(expected), others, step_ns, last, due, strict
    )


def _others(node: Node) -> Wanted:
    """Topics beside those of the graph."""
    name = node.get_name()
    text = f'topics outside of the namespace that are recorded as well, or {ALL}'
    listed = declare(node, 'extra_topics', list[str], None, text) or []
    text = 'regular expression: topics in whose names it is found are not recorded, but for ours'
    exclude = declare(node, 'exclude', str, '', text)
    extra = []
    for topic in listed:
        try:
            extra.append(topic if topic == ALL else node.resolve_topic_name(topic))
        except (RCLError, ValueError):
            expected = f'names of topics, or {ALL}'
            raise InputError(name, 'extra_topics', expected, topic) from None
    try:
        pattern = re.compile(exclude) if exclude else None
    except (re.error, RecursionError, OverflowError) as error:
        raise InputError(name, 'exclude', f'a regular expression ({error})', exclude) from None
    return Wanted(node.get_namespace(), tuple(extra), pattern)


def remapped(node: Node) -> dict[str, str]:
    """Topics of ours that have another name here -> what they would be called in this namespace."""
    space = node.get_namespace().rstrip('/')
    names = {}
    for topic in topics.TOPICS:
        usual = topic.name if topic.name.startswith('/') else f'{space}/{topic.name}'
        if (resolved := node.resolve_topic_name(topic.name)) != usual:
            names[resolved] = usual
    return names


def _storage(node: Node, pace: str) -> Storage:
    compression = declare(
        node, 'storage.compression', str, 'zstd', 'compression of chunks', one_of=list(COMPRESSIONS)
    )
    chunk_size = declare(
        node,
        'storage.chunk_size',
        int,
        1 << 20,
        'bytes of a chunk',
        at_least=1024,
        at_most=LARGEST_CHUNK,
    )
    text = 'most bytes of a file; 0: one file'
    max_size = declare(node, 'storage.max_size', int, 0, text, at_least=0)
    text = 'most log time in a file, s; 0: one file'
    max_duration = declare(
        node, 'storage.max_duration', float, 0.0, text, at_least=0.0, at_most=1e9
    )
    text = 'bytes that stay free on the file system: with less, the recording ends'
    free_space = declare(node, 'storage.free_space', int, FREE_SPACE, text, at_least=0)
    if 0 < max_duration < LEAST_DURATION:
        expected = f'0 for one file, or at least {LEAST_DURATION:g} s'
        raise InputError(node.get_name(), 'storage.max_duration', expected, max_duration)
    longest = round(max_duration * interface.NANOSECONDS)
    return Storage(compression, chunk_size, max_size, longest, pace, free_space)


def _writer(name: str, bag: Path, attachments: dict[str, str], storage: Storage) -> BagWriter:
    """Open the bag."""
    least = LEAST_SIZE + sum(len(text.encode()) for text in attachments.values())
    if 0 < storage.max_size < least:
        expected = f'0 for one file, or at least {least} bytes with these attachments'
        raise InputError(name, 'storage.max_size', expected, storage.max_size)
    if storage.free_space:
        there = next((folder for folder in bag.absolute().parents if folder.is_dir()), Path('/'))
        free = shutil.disk_usage(there).free
        if free < storage.free_space:
            expected = f'at most what is free on the file system of {bag}'
            raise InputError(name, 'storage.free_space', expected, f'{free} bytes free')
    try:
        return BagWriter(bag, attachments, storage)
    except OSError as error:
        found = reason(error)
        raise InputError(bag, '', 'a folder without a bag that can be written', found) from None
