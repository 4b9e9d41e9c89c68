"""Decoded messages of any bag or log, read by our own readers or by the rosbags library."""

import math
import shutil
import tempfile
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
import zstandard
from mcap.records import Channel

from auv_analysis.bag.chunks import MessageTable
from auv_analysis.bag.csv_logs import survey_of_csv
from auv_analysis.bag.limits import LARGEST_DECODED, LARGEST_PARSED, MOST_NAMED
from auv_analysis.bag.mavlink_logs import messages_of_log, survey_of_log
from auv_analysis.bag.mcap_file import McapFile
from auv_analysis.bag.metadata import (
    bag_files,
    check_regular,
    is_csv,
    is_log,
    is_mcap,
    refuse_packed,
    split_order,
)
from auv_analysis.bag.reading import BagContents, read_bag
from auv_analysis.bag.step_topics import refusal
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import read_yaml

if TYPE_CHECKING:
    from rosbags.interfaces import Connection, Msgdef
    from rosbags.typesys.store import Typestore

Result = TypeVar('Result')
Decoder = Callable[[bytes], Any]
MOST_KEPT = 64  # decoders: channels of one type share theirs
RULE = '=' * 80 + '\n'  # between the parts of a definition
DEFINED = (  # what hides definitions in no language that rosbags knows
    'CREATE TEMP VIEW message_definitions AS SELECT * FROM main.message_definitions '
    "WHERE encoding IN ('ros2msg', 'ros2idl')"
)
LANGUAGES = {'ros2msg': 'msg', 'ros1msg': 'msg', 'ros2idl': 'idl'}  # of MCAP's schemas


class LoggedMessage(NamedTuple):
    """A message and when it was logged, ns."""

    topic: str
    log_time: int
    message: Any


def type_name(name: str) -> str:
    """A message type as ROS 2 writes it: 'nav_msgs/Odometry' becomes 'nav_msgs/msg/Odometry'.

    A name without a package stays as it is: nobody's type, but a schema may be called so.
    """
    package, slash, rest = name.partition('/')
    return f'{package}/msg/{rest.rpartition("/")[2]}' if slash else name


def survey(bag: Path) -> BagContents:
    """Topics, types, counts and span of a bag of any kind, without its messages."""
    if is_csv(bag):
        return survey_of_csv(bag)
    if is_log(bag):
        return survey_of_log(bag)
    if not is_mcap(bag):
        return _survey_of_rosbags(bag)
    contents = read_bag(bag, decode=False)
    contents.types = {topic: type_name(kind) for topic, kind in contents.types.items()}
    return contents


def messages(
    bag: Path, topics: Collection[str], notes: list[str], shares: Mapping[str, float] | None = None
) -> Iterator[LoggedMessage]:
    """Messages of some topics in the order of the bag.

    Parameters
    ----------
    bag : folder or file
    topics : names as the bag has them
    notes : gets a line where a file is damaged or was not finished
    shares : topic -> which share of its messages comes, evenly; of other topics all come

    Raises
    ------
    InputError : not a bag, or messages that cannot be decoded

    """
    met: Counter[str] = Counter()

    def taken(topic: str) -> bool:
        share = (shares or {}).get(topic, 1.0)
        met[topic] += 1
        return math.ceil(met[topic] * share) > math.ceil((met[topic] - 1) * share)

    if is_log(bag):
        every = messages_of_log(bag, topics, notes)
        yield from (LoggedMessage(*found) for found in every if taken(found[0]))
    elif is_mcap(bag):
        for path in bag_files(bag):
            yield from _of_mcap(path, topics, notes, taken)
    else:
        for part in _parts(bag):
            yield from _of_rosbags(part, topics, taken)


def _of_mcap(
    path: Path, topics: Collection[str], notes: list[str], taken: Callable[[str], bool]
) -> Iterator[LoggedMessage]:
    file = McapFile(path, notes)
    wanted: dict[int, tuple[str, Decoder]] = {}
    for item in file.records():
        if isinstance(item, Channel) and item.topic in topics:
            schema = file.schema_of(item)
            name = type_name(schema.name) if schema and '/' in schema.name else ''
            text = schema.data.decode('utf-8', 'replace') if schema else ''
            language = LANGUAGES.get(schema.encoding, schema.encoding) if schema else 'nothing'
            decode = decoder_of(path, item.topic, (name, text, language, item.message_encoding))
            wanted[item.id] = item.topic, decode
        elif isinstance(item, MessageTable):
            for i, channel in enumerate(item.channels.tolist()):
                if channel in wanted and taken(wanted[channel][0]):
                    topic, decode = wanted[channel]
                    message = decoded(path, topic, decode, item.message(i))
                    yield LoggedMessage(topic, int(item.log_times[i]), message)


def _survey_of_rosbags(bag: Path) -> BagContents:
    """Topics, types, counts and span of a bag, without its messages."""
    contents = BagContents()
    for part in _parts(bag):
        with _opened(part) as reader:
            for one in reader.connections:
                contents.types[one.topic] = one.msgtype
                if one.msgcount:
                    contents.add(one.topic, reader.start_time, reader.end_time - 1, one.msgcount)
    return contents


def _of_rosbags(
    bag: Path, topics: Collection[str], taken: Callable[[str], bool]
) -> Iterator[LoggedMessage]:
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
            if taken(topic):
                message = decoded(bag, topic, decoders[connection.id], bytes(data))
                yield LoggedMessage(topic, log_time, message)


def _of_connection(bag: Path, connection: 'Connection') -> Decoder:
    definition = connection.msgdef
    known = definition.format.name != 'NONE'
    language = 'idl' if definition.format.name == 'IDL' else 'msg'
    encoding = 'ros1' if _is_ros1(bag) else 'cdr'
    text = definition.data if known else ''
    return decoder_of(bag, connection.topic, (connection.msgtype, text, language, encoding))


def _parts(bag: Path) -> list[Path]:
    """What rosbags opens: its files, where a folder has no metadata or one that lacks some of them.

    No metadata is what a recorder leaves that was killed.
    """
    if not bag.is_dir():
        return [bag]
    files = sorted(bag.glob('*.db3'), key=split_order)
    if (bag / 'metadata.yaml').exists():
        listed = {name.removesuffix('.zstd') for name in _listed(bag)}
        if listed.issuperset(file.name for file in files):
            return [bag]
    refuse_packed(bag, files)
    if not files:
        raise InputError(bag, '', 'a metadata.yaml beside compressed files', 'none')
    for file in files:
        check_regular(file, bag)
    return files


def _listed(bag: Path) -> list[str]:
    """Names of the files that metadata.yaml lists; InputError: outside, or more than fits."""
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
    return [Path(name).name for name in listed]


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


def _check_closed(file: Path) -> None:
    """Refuse an SQLite file of a killed recorder whose last messages still lie beside it."""
    beside = file.with_name(f'{file.name}-wal')
    if beside.is_file() and beside.stat().st_size:
        remedy = f'sqlite3 {file.name} "PRAGMA wal_checkpoint"'
        expected = f'nothing in {beside.name}: {remedy} takes it in'
        raise InputError(file, '', expected, f'{beside.stat().st_size} bytes')


def _is_ros1(bag: Path) -> bool:
    return bag.suffix == '.bag' and not bag.is_dir()


@contextmanager
def _opened(bag: Path) -> Iterator[Any]:
    """An open reader of the rosbags library."""
    from rosbags import rosbag1, rosbag2  # loads slowly, and is not needed for MCAP

    for file in [bag] if bag.is_file() else bag.glob('*.db3'):
        _check_closed(file)
    try:
        reader: Any = rosbag1.Reader(bag) if _is_ros1(bag) else rosbag2.Reader(bag)
        with _defined():
            reader.open()
    except Exception as error:  # of SQLite, of YAML, of the library: by what the file is
        raise refusal(bag, '', 'a bag that rosbags can open', error) from None
    try:
        if len(reader.connections) > MOST_NAMED:
            raise InputError(bag, '', f'at most {MOST_NAMED} topics', f'{len(reader.connections)}')
        yield reader
    finally:
        reader.close()


@contextmanager
def _defined() -> Iterator[None]:
    """Hide from rosbags the definitions of types for which rosbag2 found no file, as of actions.

    It opens no SQLite bag that has one.
    """
    from rosbags.rosbag2 import storage_sqlite3

    hooks: list[Any] = getattr(getattr(storage_sqlite3, 'apsw', None), 'connection_hooks', [])
    hooks.append(lambda connection: connection.execute(DEFINED))
    try:
        yield
    finally:
        hooks.pop()


@lru_cache(MOST_KEPT)
def decoder(name: str, definition: str, language: str, encoding: str) -> Decoder:
    """Decoder of one type.

    Parameters
    ----------
    name : type as ROS 2 writes it
    definition : of the type and of all that it contains; '': the one that ROS 2 Humble has
    language : of the definition: 'msg' or 'idl'
    encoding : of the messages: 'cdr' or 'ros1'

    Raises
    ------
    ValueError : another language or encoding, or a definition that is too long
    Exception : whatever the parser of the definition stumbles over

    """
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    known = language in ('msg', 'idl') or (name and not definition)
    if encoding not in ('cdr', 'ros1') or not known:
        raise ValueError(f'messages in {encoding or "no encoding"}, described in {language}')
    if len(definition) > LARGEST_PARSED:
        raise ValueError(f'a definition of {len(definition)} bytes, above {LARGEST_PARSED}')
    definition = definition.replace('\r\n', '\n')  # which the parser stumbles over
    store = get_typestore(Stores.EMPTY if definition else Stores.ROS2_HUMBLE)
    if definition and language == 'msg':
        store.register(get_types_from_msg(definition, name))
    for part in definition.split(RULE) if language == 'idl' else ():
        text = part.partition('\n')[2] if part.startswith('IDL: ') else part
        if text.strip():
            store.register(get_types_from_idl(text))
    try:
        kind = store.get_msgdef(name)
    except KeyError as error:
        raise ValueError(f'none of {error.args[0]}') from None
    if encoding == 'cdr':
        return partial(_of_cdr, store, kind)
    return partial(store.deserialize_ros1, typename=name)


def _of_cdr(store: 'Typestore', kind: 'Msgdef[object]', data: bytes) -> Any:
    """A message, which may have unused bytes behind it: `deserialize_cdr` allows 3.

    Fast CDR reserves up to 8 more for each empty sequence of 8-byte numbers, and leaves in them
    what the memory held.
    """
    if data[:2] not in (b'\0\0', b'\0\1'):
        raise ValueError(f'CDR of kind {data[:2].hex()}')
    read = kind.deserialize_cdr_le if data[1] else kind.deserialize_cdr_be
    message, end = read(data[4:], 0, kind.cls, store)
    unused = len(data) - 4 - end
    if unused > 3 and unused > 3 + 8 * _empty_sequences(message):
        raise ValueError(f'{unused} bytes behind a message of {end}')
    return message


def _empty_sequences(part: Any) -> int:
    """Number of empty sequences of 8-byte numbers in a message."""
    if isinstance(part, np.ndarray):
        return int(part.dtype.itemsize == 8 and not len(part))
    inside = part if isinstance(part, list) else getattr(part, '__dict__', {}).values()
    return sum(map(_empty_sequences, inside))


def decoder_of(path: Path, topic: str, how: tuple[str, str, str, str]) -> Decoder:
    """The same decoder as `decoder`; InputError, which names the topic, where there is none."""
    return _guarded(path, topic, 'a definition of its type', lambda: decoder(*how))


def decoded(path: Path, topic: str, decode: Decoder, data: bytes) -> Any:
    """A message; InputError, which names its topic, where it cannot be decoded."""
    if len(data) > LARGEST_DECODED:
        expected = f'messages of at most {LARGEST_DECODED} bytes'
        raise InputError(path, topic, expected, f'{len(data)} bytes')
    return _guarded(path, topic, 'messages of its type', lambda: decode(data))


def _guarded(path: Path, topic: str, expected: str, work: Callable[[], Result]) -> Result:
    try:
        return work()
    except Exception as error:  # by its definition, a message may be anything
        raise refusal(path, topic, expected, error) from None
