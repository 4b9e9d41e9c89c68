"""One message at a time, by its schema: decoded, checked, or refused in one line."""

import contextlib
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mcap.records import Channel, Schema
from mcap_ros2.decoder import DecoderFactory

from auv_analysis.bag.limits import LARGEST_PARSED
from auv_analysis.bag.roles import READERS, role_of
from auv_analysis.bag.tables import Table
from auv_dynamics.files.errors import InputError, first_line
from auv_dynamics.ros import interface

Decoder = Callable[[bytes], Any]


class Decoding:
    """Decoders of the channels of one file; what must not be used raises InputError.

    Parameters
    ----------
    path : the file, for the refusals

    """

    def __init__(self, path: Path):
        self._path = path
        self._decoders: dict[int, Decoder] = {}
        self._known: dict[tuple[str, str, str, bytes], Decoder | None] = {}
        self._parsed = 0  # bytes of definitions
        self._topics: dict[int, str] = {}

    def add(self, channel: Channel, schema: Schema | None) -> None:
        """Learn to decode a channel, where its encoding is known."""
        decoder = self._decoder(channel, schema)
        if decoder is not None:
            self._decoders[channel.id] = decoder
            self._topics[channel.id] = channel.topic

    def _decoder(self, channel: Channel, schema: Schema | None) -> Decoder | None:
        """Decoder of a channel; channels of one definition share it."""
        if schema is None:
            return None
        key = channel.message_encoding, schema.name, schema.encoding, schema.data
        if key not in self._known:
            self._parsed += len(schema.data)
            if self._parsed > LARGEST_PARSED:
                expected = f'at most {LARGEST_PARSED} bytes of different definitions'
                raise InputError(self._path, channel.topic, expected, f'{self._parsed}')
            try:  # a factory of its own each: it goes by the ids of schemas
                with contextlib.redirect_stderr(io.StringIO()):  # its parser prints and raises
                    decoder = DecoderFactory().decoder_for(channel.message_encoding, schema)
            except Exception as error:  # whatever its parser stumbles over
                raise refusal(self._path, channel.topic, 'a schema of its type', error) from None
            self._known[key] = decoder
        return self._known[key]

    def __contains__(self, channel: int) -> bool:
        return channel in self._decoders

    def __getitem__(self, channel: int) -> Decoder:
        return self._decoders[channel]

    def message(self, table: Table, i: int, channel: int) -> Any:
        """Message number i of a table."""
        try:
            return self._decoders[channel](table.payload(i))
        except Exception as error:  # by its schema, a message may be anything
            raise refusal(
                self._path, self._topics[channel], 'messages of its type', error
            ) from None

    def value(
        self, topic: str, message: Any, frames: interface.Frames | None
    ) -> tuple[int, tuple[float, ...]]:
        """Stamp and row of a message; those before the first odometry are free in their frame."""
        try:
            known = frames or interface.Frames(base=message.header.frame_id)
            return READERS[role_of(topic)](message, known)
        except interface.BadMessageError as error:
            raise refusal(self._path, topic, 'usable messages', error) from None
        except (AttributeError, TypeError) as error:  # a schema with other fields
            raise refusal(self._path, topic, 'messages of its type', error) from None

    def frames_of(self, channel: int, odometry: Any) -> interface.Frames:
        """Frames that an odometry of a channel names."""
        try:
            return interface.Frames(odometry.header.frame_id, odometry.child_frame_id)
        except AttributeError as error:  # a schema with other fields
            raise refusal(
                self._path, self._topics[channel], 'messages of its type', error
            ) from None


def refusal(path: Path, topic: str, expected: str, error: Exception) -> InputError:
    """What a library said, as one line of ours."""
    return InputError(path, topic, expected, first_line(error))
