"""Schemas and channels of a file, from wherever they stand in it."""

from collections.abc import Iterator
from typing import Any

from mcap.records import Channel, Schema

from auv_analysis.recording.metadata import Definition
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import parse_any_yaml

LARGEST_POLICIES = 1 << 21  # characters of the offered profiles of all topics; more are left out
BETWEEN, SUMMARY, CHUNK = range(3)  # where a definition stands: the better its checksum, the higher


class Definitions:
    """The most trustworthy definition of each id."""

    def __init__(self) -> None:
        self._schemas: dict[int, tuple[int, Schema]] = {}
        self._channels: dict[int, tuple[int, Channel]] = {}
        self.doubtful: set[str] = set()  # topics or types that are defined differently elsewhere
        self._ids: dict[tuple[type, bool], set[int]] = {}  # kind, whether in the summary

    def add(self, record: Schema | Channel, trust: int) -> None:
        """Take a definition, of which `trust` says where it stands."""
        self._ids.setdefault((type(record), trust == SUMMARY), set()).add(record.id)
        if isinstance(record, Schema):
            self._add(self._schemas, record, trust, record.name)
        else:
            self._add(self._channels, record, trust, record.topic)

    def _add(self, known: dict[int, Any], record: Schema | Channel, trust: int, name: str) -> None:
        old = known.get(record.id)
        if old is not None and old[1] != record:
            self.doubtful.add(name)
        if old is None or old[0] < trust:
            known[record.id] = trust, record

    def agree(self) -> bool:
        """Whether the summary repeats all definitions before it, where it repeats any."""
        kinds = [kind for kind, is_summary in self._ids if is_summary]
        return all(self._ids.get((kind, False), set()) <= self._ids[kind, True] for kind in kinds)

    def channel(self, number: int) -> Channel | None:
        """Channel of an id."""
        found = self._channels.get(number)
        return found[1] if found else None

    def schema_of(self, channel: Channel) -> Schema | None:
        """Schema of a channel."""
        found = self._schemas.get(channel.schema_id)
        return found[1] if found else None

    def channels(self) -> Iterator[Channel]:
        """All channels, by their ids."""
        for _, (_, channel) in sorted(self._channels.items()):
            yield channel

    def of_rosbag2(self) -> list[Definition] | None:
        """The topics for a metadata.yaml; None where not all are as rosbag2 writes them."""
        found: dict[str, Definition] = {}
        known: dict[str, list[Any]] = {}
        left = LARGEST_POLICIES
        for channel in self.channels():
            schema = self.schema_of(channel)
            if channel.message_encoding != 'cdr' or schema is None:
                return None
            digest = channel.metadata.get('topic_type_hash', '')
            text = channel.metadata.get('offered_qos_profiles', '')
            left -= len(text)
            if text not in known and left >= 0:
                known[text] = _qos(text)
            qos = known[text] if left >= 0 else []
            definition = Definition(channel.topic, schema.name, qos=qos, digest=digest)
            found.setdefault(channel.topic, definition)
        return [*found.values()]


def _qos(text: str) -> list[Any]:
    """Offered profiles, none where the text is no list of them, or one that refers to itself."""
    if '*' in text:
        return []
    try:
        found = parse_any_yaml(text, 'offered_qos_profiles')
    except InputError:
        return []
    return found if isinstance(found, list) else []
