"""The files of a bag, and the contents of its metadata.yaml and recording.yaml."""

import os
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from auv_analysis.output.new_files import replacing
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import parse_any_yaml, parse_yaml, yaml_text

if TYPE_CHECKING:
    from mcap.records import Channel, Schema

DISTRO = 'jazzy'
BAG = 'a bag: a folder, an .mcap, a .db3 or a ROS 1 .bag file, or a .csv, .tlog or .BIN file'
IN_FOLDERS = ('.mcap', '.db3', '.mcap.zstd', '.db3.zstd')  # endings of files of a bag
TABLES, LOGS = ('.csv', '.tsv'), ('.tlog', '.bin')
OTHERS = ('.db3', '.bag', *TABLES, *LOGS)  # endings of files that McapFile does not read
METADATA = 'metadata.yaml'
RECORDING = 'recording.yaml'
ROOT = 'rosbag2_bagfile_information'


@dataclass(frozen=True)
class Definition:
    """A topic as a bag defines it.

    Attributes
    ----------
    topic : full name
    kind : message type, 'package/msg/Name'
    encoding : of its messages, 'cdr' for ROS 2
    qos : offered profiles as rosbag2 writes them, a YAML text; empty: not known
    digest : RIHS01 type hash; empty where it is not known

    """

    topic: str
    kind: str
    encoding: str = 'cdr'
    qos: str = ''
    digest: str = ''

    @classmethod
    def of(cls, channel: 'Channel', schema: 'Schema | None') -> 'Definition':
        """Topic of a channel."""
        about = channel.metadata
        return cls(
            channel.topic,
            schema.name if schema else '',
            channel.message_encoding,
            about.get('offered_qos_profiles', ''),
            about.get('topic_type_hash', ''),
        )


@dataclass
class FileExtent:
    """Contents of a bag or a file of it: messages per topic, first and last log time in ns."""

    name: str = ''
    counts: dict[str, int] = field(default_factory=dict)
    first: int | None = None
    last: int | None = None

    def add(self, topic: str, first: int, last: int, count: int = 1) -> None:
        """Count messages of a topic that were logged from `first` to `last`, ns."""
        self.counts[topic] = self.counts.get(topic, 0) + count
        self.first = first if self.first is None else min(self.first, first)
        self.last = last if self.last is None else max(self.last, last)


@dataclass
class TopicExtent:
    """Number of a topic's messages, first and last log time, ns."""

    first: int
    last: int = 0
    count: int = 0

    def add(self, stamp: int) -> None:
        """Count a message."""
        self.first, self.last = min(self.first, stamp), max(self.last, stamp)
        self.count += 1

    @property
    def rate(self) -> float:
        """Messages per second; 0 of a single one."""
        return (self.count - 1) / max(self.last - self.first, 1) * 1e9


def metadata(
    definitions: Iterable[Definition], extents: Sequence[FileExtent], *, packed: bool = False
) -> dict[str, Any]:
    """Contents of `rosbag2_bagfile_information`.

    Parameters
    ----------
    definitions : of the topics
    extents : of the files, in their order
    packed : whether each message is compressed by itself

    """
    whole = FileExtent()
    for extent in extents:
        for topic, count in extent.counts.items():
            if extent.first is not None and extent.last is not None:
                whole.add(topic, extent.first, extent.last, count)
    return {
        'version': 9,
        'storage_identifier': 'mcap',
        **_span(whole),
        'topics_with_message_count': [
            {'topic_metadata': _about(one), 'message_count': whole.counts.get(one.topic, 0)}
            for one in definitions
        ],
        'compression_format': 'zstd' if packed else '',
        'compression_mode': 'message' if packed else '',
        'relative_file_paths': [extent.name for extent in extents],
        'files': [{'path': extent.name, **_span(extent)} for extent in extents],
        'custom_data': None,
        'ros_distro': DISTRO,
    }


def _span(extent: FileExtent) -> dict[str, Any]:
    first, last = extent.first or 0, extent.last or 0
    return {
        'starting_time': {'nanoseconds_since_epoch': first},
        'duration': {'nanoseconds': last - first},
        'message_count': sum(extent.counts.values()),
    }


def _about(definition: Definition) -> dict[str, Any]:
    return {
        'name': definition.topic,
        'type': definition.kind,
        'serialization_format': definition.encoding,
        'offered_qos_profiles': offered_profiles(definition.qos),
        'type_description_hash': definition.digest,
    }


class _Dumper(yaml.SafeDumper):
    """Writes out what stands in several places."""

    def ignore_aliases(self, _: Any) -> bool:
        return True


class _FastDumper(getattr(yaml, 'CSafeDumper', yaml.SafeDumper)):  # type: ignore[misc]
    """The same by libyaml, in a fifth of the time."""

    ignore_aliases = _Dumper.ignore_aliases


def counts_in(document: Mapping[str, Any]) -> dict[str, int]:
    """Topic -> number of its messages, of those that have any, as the metadata of a bag say."""
    every = document['topics_with_message_count']
    return {e['topic_metadata']['name']: e['message_count'] for e in every if e['message_count']}


def as_text(document: Mapping[str, Any]) -> str:
    """Text of a metadata.yaml."""
    try:
        return yaml.dump({ROOT: document}, Dumper=_FastDumper, sort_keys=False)
    except UnicodeEncodeError:  # the name of a file is no text
        return yaml.dump({ROOT: document}, Dumper=_Dumper, sort_keys=False)


@lru_cache(64)  # topics mostly offer the same
def offered_profiles(text: str) -> list[Any]:
    """QoS profiles of a `Definition`; none of a text without any, or that names itself."""
    if '*' in text:
        return []
    try:
        found = parse_any_yaml(text, 'offered_qos_profiles')
    except InputError:
        return []
    return found if isinstance(found, list) else []


def write_metadata(folder: Path, text: str) -> None:
    """Write metadata.yaml: it is there as a whole, or as it was before."""
    with replacing(folder / METADATA) as file:
        file.write(text.encode())


def is_csv(bag: Path) -> bool:
    """Whether this is a file of named columns, or a folder that has such and no bag."""
    if not os.path.isdir(bag):
        return bag.suffix.lower() in TABLES
    endings = {entry.suffix.lower() for entry in bag.iterdir()}
    return not endings.isdisjoint(TABLES) and endings.isdisjoint(('.mcap', '.db3', '.zstd'))


def is_log(bag: Path) -> bool:
    """Whether this is a log of ArduPilot, by its ending in any case."""
    return bag.suffix.lower() in LOGS


def is_mcap(bag: Path) -> bool:
    """Whether our own reader reads this bag; InputError when there is no bag at all."""
    if is_csv(bag) and os.path.exists(bag):
        return False
    if os.path.isdir(bag):
        if any(bag.glob('*.mcap')):
            return True
        if not [*bag.glob('*.db3*'), *bag.glob('*.mcap.zstd')]:
            raise InputError(bag, '', BAG, 'a folder with neither .mcap nor .db3 files')
        return False
    if not os.path.isfile(bag):
        raise InputError(bag, '', BAG, 'no such file or folder')
    return bag.suffix.lower() not in OTHERS


def files_of(bag: Path) -> list[Path]:
    """Files that a bag of any kind consists of, which results must not overwrite."""
    if is_mcap(bag):
        return bag_files(bag)
    return sorted(bag.iterdir()) if bag.is_dir() else [bag]


def bag_files(bag: str | Path) -> list[Path]:
    """MCAP files of a bag, in order; InputError when there are none."""
    path = Path(bag)
    is_folder = os.path.isdir(path)  # Path.is_dir raises for a name that is too long
    files = sorted(path.glob('*.mcap'), key=split_order) if is_folder else [path]
    if not files or not os.path.isfile(files[0]):
        found = 'a folder without .mcap files' if is_folder else 'no such file or folder'
        raise InputError(path, '', 'a bag folder or an .mcap file', found)
    for file in files:
        check_regular(file, path if is_folder else file.resolve().parent)
    if is_folder:
        refuse_packed(path, files)
    return files


def refuse_packed(folder: Path, files: Collection[Path]) -> None:
    """Refuse files that rosbag2 compressed as a whole beside those that it had not come to."""
    first = min(files, default=folder)
    for packed in sorted(folder.glob(f'*{first.suffix}.zstd')) if files else ():
        if packed.with_suffix('') not in files:
            expected = 'files that are all compressed, or none (zstd -d unpacks them)'
            raise InputError(packed, '', expected, f'others that are not: {first.name}')


def check_regular(path: Path, folder: Path) -> None:
    """Refuse what is no file, such as a pipe, or lies outside of the folder of its bag."""
    if not os.path.isfile(path):
        raise InputError(path, '', 'a file', 'something else of that name')
    if not path.resolve().is_relative_to(folder.resolve()):
        expected = 'a file in the folder of its bag, or the file itself'
        raise InputError(path, '', expected, f'a link to {path.resolve()}')


def split_order(path: Path) -> tuple[int, str]:
    """Place of a file in its bag: by the number at the end of its name."""
    number = path.stem.rpartition('_')[2]
    return (int(number) if number.isdecimal() else 0, path.name)


def recording_text(strict: bool, names: Mapping[str, str], namespace: str = '/') -> str:
    """The recorder's notes on its recording, as an attachment.

    Parameters
    ----------
    strict : whether every step had to come once and in order
    names : recorded topic -> the name that it has where nothing is remapped, of those that differ
    namespace : of the recorder

    """
    noted = {'strict': strict, 'namespace': namespace, 'topics': dict(names)}
    return yaml_text(noted, default_flow_style=False)


def read_recording(text: str, bag: object) -> tuple[bool, dict[str, str], str | None]:
    """Strict, names and namespace as `recording_text` noted them; a namespace may be missing."""
    file = f'{bag}: {RECORDING}'
    noted = parse_yaml(text, file, 'recording')
    names: Any = noted.get('topics', {})
    if not isinstance(names, dict) or not all(
        isinstance(n, str) for n in (*names, *names.values())
    ):
        raise InputError(file, 'topics', 'a mapping of topics to names', names)
    if len(set(names.values())) < len(names):
        raise InputError(file, 'topics', 'each name once', names)
    namespace = noted.get('namespace')
    if not (namespace is None or isinstance(namespace, str)):
        raise InputError(file, 'namespace', 'the name of a namespace', namespace)
    return noted.get('strict') is not False, names, namespace
