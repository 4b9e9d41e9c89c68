"""What turns a serialized message into an object with its fields, by the bag's own definition."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

from auv_analysis.bag.decoding import refusal
from auv_analysis.bag.limits import LARGEST_PARSED

Result = TypeVar('Result')
Decoder = Callable[[bytes], Any]
RULE = '=' * 80 + '\n'  # between the parts of a definition


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
    if encoding not in ('cdr', 'ros1') or language not in ('msg', 'idl'):
        raise ValueError(f'messages in {encoding or "no encoding"}, described in {language}')
    if len(definition) > LARGEST_PARSED:
        raise ValueError(f'a definition of {len(definition)} bytes, above {LARGEST_PARSED}')
    store = get_typestore(Stores.EMPTY if definition else Stores.ROS2_HUMBLE)
    if definition and language == 'msg':
        store.register(get_types_from_msg(definition, name))
    for part in definition.split(RULE) if language == 'idl' else ():
        text = part.partition('\n')[2] if part.startswith('IDL: ') else part
        if text.strip():
            store.register(get_types_from_idl(text))
    store.get_msgdef(name)  # that the definition defines it shows here
    read = store.deserialize_cdr if encoding == 'cdr' else store.deserialize_ros1
    return partial(read, typename=name)


class Logged(NamedTuple):
    """A message and when it was logged, ns."""

    topic: str
    log_time: int
    message: Any


def decoder_of(path: Path, topic: str, how: tuple[str, str, str, str]) -> Decoder:
    """The same decoder as `decoder`; InputError, which names the topic, where there is none."""
    return _guarded(path, topic, 'a definition of its type', lambda: decoder(*how))


def decoded(path: Path, topic: str, decode: Decoder, data: bytes) -> Any:
    """A message; InputError, which names its topic, where it cannot be decoded."""
    return _guarded(path, topic, 'messages of its type', lambda: decode(data))


def _guarded(path: Path, topic: str, expected: str, work: Callable[[], Result]) -> Result:
    try:
        return work()
    except Exception as error:  # by its definition, a message may be anything
        raise refusal(path, topic, expected, error) from None
