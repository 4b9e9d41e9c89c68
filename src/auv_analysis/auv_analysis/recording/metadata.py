"""The metadata.yaml of a bag: rosbag2's version 9."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from auv_analysis.output.new_files import replacing

DISTRO = 'jazzy'
NAME = 'metadata.yaml'
ROOT = 'rosbag2_bagfile_information'


@dataclass(frozen=True)
class Definition:
    """A topic as a bag defines it.

    Attributes
    ----------
    topic : full name
    kind : message type, 'package/msg/Name'
    encoding : of its messages
    qos : offered profiles as rosbag2 writes them
    digest : RIHS01 type hash

    """

    topic: str
    kind: str
    encoding: str = 'cdr'
    qos: list[Any] = field(default_factory=list)
    digest: str = ''


@dataclass
class Extent:
    """What lies in a file of a bag: messages per topic, first and last log time in ns."""

    name: str
    counts: dict[str, int] = field(default_factory=dict)
    first: int | None = None
    last: int | None = None

    def add(self, topic: str, log_time: int) -> None:
        """Count a message."""
        self.counts[topic] = self.counts.get(topic, 0) + 1
        if self.first is None or self.last is None:
            self.first = self.last = log_time
        elif log_time > self.last:
            self.last = log_time
        elif log_time < self.first:
            self.first = log_time


def metadata(definitions: Iterable[Definition], extents: Sequence[Extent]) -> dict[str, Any]:
    """What stands below `rosbag2_bagfile_information`.

    Parameters
    ----------
    definitions : of the topics
    extents : of the files, in their order

    """
    counts: dict[str, int] = {}
    for extent in extents:
        for topic, count in extent.counts.items():
            counts[topic] = counts.get(topic, 0) + count
    firsts = [extent.first for extent in extents if extent.first is not None]
    lasts = [extent.last for extent in extents if extent.last is not None]
    span = _span(min(firsts, default=None), max(lasts, default=None), sum(counts.values()))
    return {
        'version': 9,
        'storage_identifier': 'mcap',
        **span,
        'topics_with_message_count': [
            {'topic_metadata': _about(definition), 'message_count': counts.get(definition.topic, 0)}
            for definition in definitions
        ],
        'compression_format': '',
        'compression_mode': '',
        'relative_file_paths': [extent.name for extent in extents],
        'files': [
            {'path': e.name, **_span(e.first, e.last, sum(e.counts.values()))} for e in extents
        ],
        'custom_data': None,
        'ros_distro': DISTRO,
    }


def _span(first: int | None, last: int | None, count: int) -> dict[str, Any]:
    return {
        'starting_time': {'nanoseconds_since_epoch': first or 0},
        'duration': {'nanoseconds': (last or 0) - (first or 0)},
        'message_count': count,
    }


def _about(definition: Definition) -> dict[str, Any]:
    return {
        'name': definition.topic,
        'type': definition.kind,
        'serialization_format': definition.encoding,
        'offered_qos_profiles': definition.qos,
        'type_description_hash': definition.digest,
    }


class _Dumper(yaml.SafeDumper):
    """Writes out what stands in several places."""

    def ignore_aliases(self, _: Any) -> bool:
        return True


def as_text(document: Mapping[str, Any]) -> str:
    """Text of a metadata.yaml."""
    return yaml.dump({ROOT: document}, Dumper=_Dumper, sort_keys=False)


def qos_text(qos: list[Any]) -> str:
    """Offered profiles as they stand in the metadata of a channel."""
    return yaml.dump(qos, Dumper=_Dumper, default_flow_style=False, sort_keys=False)


def write_metadata(folder: Path, text: str) -> None:
    """Write metadata.yaml: it is there as a whole, or as it was before."""
    with replacing(folder / NAME) as file:
        file.write(text.encode())
