"""Bags that the rosbags library reads: rosbag2's SQLite files and ROS 1 files."""

import shutil
import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import zstandard
from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.rosbag1 import Reader as Rosbag1
from rosbags.rosbag2 import Reader as Rosbag2

from auv_analysis.bag.contents import Contents
from auv_analysis.bag.decoding import refusal
from auv_analysis.bag.files import check_regular
from auv_analysis.bag.limits import MOST_NAMED
from auv_analysis.foreign.decoders import Decoder, Logged, decoded, decoder_of
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import read_yaml


def survey_of_rosbags(bag: Path) -> Contents:
    """Topics, types, counts and span of a bag, without its messages."""
    contents = Contents()
    for part in _parts(bag):
        with _opened(part) as reader:
            for connection in reader.connections:
                topic = connection.topic
                contents.types[topic] = connection.msgtype
                contents.counts[topic] = contents.counts.get(topic, 0) + connection.msgcount
            if reader.message_count:
                contents.span(reader.start_time, reader.end_time - 1)
    return contents


def messages_of_rosbags(bag: Path, topics: Collection[str]) -> Iterator[Logged]:
    """Messages of some topics, in the order of logging."""
    for part in _parts(bag):
        yield from _messages(part, topics)


def _messages(bag: Path, topics: Collection[str]) -> Iterator[Logged]:
    with _opened(bag) as reader:
        wanted = [c for c in reader.connections if c.topic in topics]
        if not wanted:
            return
        decoders = {c.id: _of_connection(bag, c) for c in wanted}
        found = reader.messages(connections=wanted)
        while True:
            try:
                connection, log_time, data = next(found)
            except StopIteration:
                return
            except Exception as error:  # whatever the library meets in a damaged file
                raise refusal(bag, '', 'a bag that can be read to its end', error) from None
            topic = connection.topic
            message = decoded(bag, topic, decoders[connection.id], bytes(data))
            yield Logged(topic, log_time, message)


def _of_connection(bag: Path, connection: Connection) -> Decoder:
    definition = connection.msgdef
    known = definition.format != MessageDefinitionFormat.NONE
    language = 'idl' if definition.format == MessageDefinitionFormat.IDL else 'msg'
    encoding = 'ros1' if _is_ros1(bag) else 'cdr'
    text = definition.data if known else ''
    return decoder_of(bag, connection.topic, (connection.msgtype, text, language, encoding))


def _parts(bag: Path) -> list[Path]:
    """What rosbags opens: a folder whose recorder was killed has no metadata, but its files."""
    if not bag.is_dir():
        return [bag]
    if (bag / 'metadata.yaml').exists():
        _check_metadata(bag)
        return [bag]
    files = sorted(bag.glob('*.db3'))
    for file in files:
        check_regular(file, bag)
    return files


def _check_metadata(bag: Path) -> None:
    """Refuse a metadata.yaml that leads out of its folder or decompresses to more than fits."""
    path = bag / 'metadata.yaml'
    check_regular(path, bag)
    told = read_yaml(path, 'metadata').get('rosbag2_bagfile_information')
    listed = told.get('relative_file_paths') if isinstance(told, dict) else None
    if not isinstance(told, dict) or not isinstance(listed, list):
        raise InputError(path, 'relative_file_paths', 'a list of files', listed)
    for name in listed:
        if not isinstance(name, str) or Path(name).is_absolute() or '..' in Path(name).parts:
            expected = 'names of files in the folder of the bag'
            raise InputError(path, 'relative_file_paths', expected, name)
        file = bag / Path(name).name  # as rosbags reads it, which some versions write with folders
        check_regular(file, bag)
        if str(told.get('compression_mode', '')).lower() == 'file':
            _check_size(file)


def _check_size(file: Path) -> None:
    """Refuse a compressed file that rosbags would fill the disk with."""
    with file.open('rb') as stream:
        head = stream.read(18)
    try:
        size = zstandard.frame_content_size(head)
    except zstandard.ZstdError:
        size = -1
    free = shutil.disk_usage(tempfile.gettempdir()).free
    if not 0 <= size <= free:
        expected = f'a zstd file that says that it holds at most the {free} bytes that are free'
        raise InputError(file, '', expected, 'no size' if size < 0 else f'{size} bytes')


def _is_ros1(bag: Path) -> bool:
    return bag.suffix == '.bag' and not bag.is_dir()


@contextmanager
def _opened(bag: Path) -> Iterator[Any]:
    """An open reader of the rosbags library."""
    try:
        reader: Any = Rosbag1(bag) if _is_ros1(bag) else Rosbag2(bag)
        reader.open()
    except Exception as error:  # of SQLite, of YAML, of the library: by what the file is
        raise refusal(bag, '', 'a bag that rosbags can open', error) from None
    try:
        if len(reader.connections) > MOST_NAMED:
            raise InputError(bag, '', f'at most {MOST_NAMED} topics', f'{len(reader.connections)}')
        yield reader
    finally:
        reader.close()
