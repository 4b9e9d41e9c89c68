"""The messages of any bag: MCAP by our own reader, all others by the rosbags library."""

from collections.abc import Collection, Iterator
from pathlib import Path

from mcap.records import Channel, Schema

from auv_analysis.bag.files import bag_files, is_mcap
from auv_analysis.bag.records import records
from auv_analysis.bag.tables import Table
from auv_analysis.foreign.decoders import Decoder, Logged, decoded, decoder_of
from auv_analysis.foreign.kinds import type_name
from auv_analysis.foreign.rosbags_files import messages_of_rosbags

LANGUAGES = {'ros2msg': 'msg', 'ros1msg': 'msg', 'ros2idl': 'idl'}  # of MCAP's schemas


def messages(bag: Path, topics: Collection[str], notes: list[str]) -> Iterator[Logged]:
    """Messages of some topics in the order of the bag.

    Parameters
    ----------
    bag : folder or file
    topics : names as the bag has them
    notes : gets a line where a file is damaged or was not finished

    Raises
    ------
    InputError : not a bag, or messages that cannot be decoded

    """
    if is_mcap(bag):
        for path in bag_files(bag):
            yield from _of_mcap(path, topics, notes)
    else:
        yield from messages_of_rosbags(bag, topics)


def _of_mcap(path: Path, topics: Collection[str], notes: list[str]) -> Iterator[Logged]:
    schemas: dict[int, Schema] = {}
    wanted: dict[int, tuple[str, Decoder]] = {}
    for item in records(path, notes):
        if isinstance(item, Schema):
            schemas[item.id] = item
        elif isinstance(item, Channel) and item.topic in topics and item.id not in wanted:
            schema = schemas.get(item.schema_id)
            name = type_name(schema.name) if schema and '/' in schema.name else ''
            text = schema.data.decode('utf-8', 'replace') if schema else ''
            language = LANGUAGES.get(schema.encoding, schema.encoding) if schema else 'nothing'
            encoding = item.message_encoding
            decode = decoder_of(path, item.topic, (name, text, language, encoding))
            wanted[item.id] = item.topic, decode
        elif isinstance(item, Table):
            for i, channel in enumerate(item.channels.tolist()):
                if channel in wanted:
                    topic, decode = wanted[channel]
                    message = decoded(path, topic, decode, item.payload(i))
                    yield Logged(topic, int(item.log_times[i]), message)
