"""The recorder's ROS parameters."""

from dataclasses import dataclass
from pathlib import Path

from rclpy.node import Node

from auv_analysis.bag_writer import COMPRESSIONS, BagWriter
from auv_dynamics import interface
from auv_dynamics.files import InputError, read_text, reason
from auv_dynamics.ros import topics
from auv_dynamics.ros.parameters import declare, refuse_unknown


@dataclass(frozen=True)
class RecorderParameters:
    """What the recorder was asked for.

    Attributes
    ----------
    writer : of the bag, open
    topics : step topics that are expected, each step of each
    step_ns : ns between steps
    last : index of the last step, None: until SIGTERM
    last_due : stamp in ns of analysis' last sample, None: not waited for
    strict : every step once and in order, as in lock-step; else gaps are only counted

    """

    writer: BagWriter
    topics: tuple[str, ...]
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
    duration = declare(node, 'duration', float, 0.0, 's, 0: until SIGTERM', at_least=0.0)
    step = declare(node, 'step', float, 0.01, 's between steps', at_least=1e-9)
    every = declare(
        node, 'analysis_every', int, 0, 'steps between analysis samples, 0: not waited for',
        at_least=0,
    )  # fmt: skip
    strict = declare(node, 'strict', bool, True, 'a lost or doubled step ends the recording')
    compression = declare(
        node, 'storage.compression', str, 'zstd', 'of chunks', one_of=list(COMPRESSIONS)
    )
    size = declare(node, 'storage.chunk_size', int, 1 << 20, 'bytes', at_least=1024)
    files = declare(node, 'attachments', list[str], None, 'name=path of files kept in the bag')
    refuse_unknown(node)
    unknown = [topic for topic in expected if topic not in known]
    if unknown:
        raise InputError(name, 'topics', f'step topics: {", ".join(known)}', unknown[0])
    if not bag:
        raise InputError(name, 'bag', 'the folder of the bag', None)
    attachments = {}
    for entry in files or []:
        label, equals, path = entry.partition('=')
        source = Path(path if equals else label)
        attachments[label if equals else source.name] = read_text(source, 'attachment')
    try:
        writer = BagWriter(Path(bag), attachments, compression, size)
    except OSError as error:
        found = reason(error)
        raise InputError(bag, '', 'a folder without a bag that can be written', found) from None
    last = round(duration / step) if duration else None
    step_ns = round(step * interface.NANOSECONDS)
    due = last // every * every * step_ns if last is not None and every else None
    return RecorderParameters(writer, tuple(expected), step_ns, last, due, strict)
