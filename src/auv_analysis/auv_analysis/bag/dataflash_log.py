"""DataFlash logs of ArduPilot (.BIN): records whose types the log defines itself.

pymavlink knows how fields are packed. Records are looked for here, so that a file takes no more
memory than it has kinds of messages, whatever is in it.
"""

import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from auv_analysis.bag.limits import MOST_NAMED
from auv_analysis.bag.metadata import TopicExtent
from auv_analysis.bag.telemetry_log import LATEST, US, Message, count, damage
from auv_dynamics.files.errors import InputError

GPS_EPOCH, WEEK = 315_964_800 - 18, 604_800  # s since 1970 less leap seconds, s
HEAD = b'\xa3\x95'
FMT, FMT_LENGTH = 0x80, 89
INSTANCE = '#'  # among the units of a field: it tells sensors or cores apart
WHOLE = 'BbM'  # formats of one byte


@dataclass
class Format:
    """A type of message as a DataFlash log defines it.

    Attributes
    ----------
    name, columns : of the type and of its fields
    unpack : its numbers, little endian
    scales : what each is to be multiplied by, None: nothing
    length : bytes with the head of three
    timed : whether it begins with its time in us
    codes : a character per field, its format
    instance : bytes from the head to the field that tells instances apart; None: there is none

    """

    name: str
    columns: list[str]
    unpack: struct.Struct
    scales: list[float | None]
    length: int
    timed: bool
    codes: str
    instance: int | None = None

    def message(self, data: bytes) -> SimpleNamespace:
        """A message by its bytes behind the head."""
        values = self.unpack.unpack(data)
        return SimpleNamespace(**{
            name: _value(value, scale)
            for name, value, scale in zip(self.columns, values, self.scales, strict=True)
        })  # fmt: skip


def _value(value: Any, scale: float | None) -> Any:
    if isinstance(value, bytes):
        return value.partition(b'\0')[0].decode('latin-1')
    return value if scale is None else value * scale


@dataclass
class Record:
    """Where a record of a DataFlash log lies: its type, first byte and time in us."""

    format: Format
    start: int
    time: int


@dataclass
class DataFlashLog:
    """A .BIN of the autopilot: records whose types the log defines itself.

    Parameters
    ----------
    path : for refusals
    data : bytes of the file

    """

    path: Path
    data: Any
    kind = 'dataflash'
    parameters: dict[str, str] = field(default_factory=dict)
    _epoch: int = 0  # us since 1970 at boot, as GPS tells it; 0: it does not
    _damaged: int = 0

    def tallies(self, notes: list[str]) -> dict[str, TopicExtent]:
        """What there is of each type and instance."""
        found: dict[str, TopicExtent] = {}
        for record in self._records():
            kind = record.format
            if kind.name == 'PARM':
                self._note_parameter(record)
            elif kind.name == 'GPS' and not self._epoch:
                self._note_epoch(record)
            count(found, self._topic(record), record.time, self.path)
        if not found:
            raise InputError(self.path, '', 'records of an on-board log of ArduPilot', 'none')
        begin = min((tally.first for tally in found.values() if tally.first), default=0)
        for tally in found.values():  # definitions stand before the first time
            times = tally.first, tally.last
            tally.first, tally.last = ((max(time, begin) + self._epoch) * US for time in times)
        notes += damage(self.path, self._damaged, 'records')
        return found

    def messages(self, topics: Collection[str], notes: list[str]) -> Iterator[Message]:
        """Messages of some topics."""
        names = {topic.partition('[')[0] for topic in topics}
        for record in self._records():
            if record.format.name in names and (topic := self._topic(record)) in topics:
                yield topic, (record.time + self._epoch) * US, self._message(record)
        notes += damage(self.path, self._damaged, 'records')

    def _message(self, record: Record) -> SimpleNamespace:
        body = self.data[record.start + 3 : record.start + record.format.length]
        return record.format.message(body)

    def _topic(self, record: Record) -> str:
        kind = record.format
        if kind.instance is None:
            return kind.name
        return f'{kind.name}[{self.data[record.start + 3 + kind.instance]}]'

    def _note_parameter(self, record: Record) -> None:
        told = self._message(record)
        name, value = getattr(told, 'Name', ''), getattr(told, 'Value', None)
        if isinstance(name, str) and isinstance(value, float) and len(self.parameters) < MOST_NAMED:
            self.parameters[name] = f'{value:g}'

    def _note_epoch(self, record: Record) -> None:
        """Time of boot by the first fix of GPS with a week."""
        told = self._message(record)
        week, ms = getattr(told, 'GWk', 0), getattr(told, 'GMS', 0)
        if isinstance(week, int) and isinstance(ms, int) and week > 0:
            now = GPS_EPOCH + week * WEEK + ms / 1e3
            self._epoch = max(round(now * 1e6) - record.time, 0)

    def _records(self) -> Iterator[Record]:
        """All records, and how many bytes are none."""
        data, size = self.data, len(self.data)
        formats = {FMT: _format(FMT_LENGTH, b'FMT', b'BBnNZ', b'Type,Length,Name,Format,Columns')}
        place, time, self._damaged = 0, 0, 0
        while place + 3 <= size:
            kind = formats.get(data[place + 2]) if data[place : place + 2] == HEAD else None
            if kind is None or place + kind.length > size:
                behind = data.find(HEAD, place + 1)
                behind = size if behind < 0 else behind
                self._damaged += behind - place
                place = behind
                continue
            if kind.timed:
                told = int.from_bytes(data[place + 3 : place + 11], 'little')
                if told > LATEST:
                    self._damaged += 1
                    place += 1
                    continue
                time = told
            record = Record(kind, place, time)
            if kind.name == 'FMT':
                self._define(record, formats)
            elif kind.name == 'FMTU':
                self._tell_instances(record, formats)
            yield record
            place += kind.length

    def _define(self, record: Record, formats: dict[int, Format]) -> None:
        """Take a type that can be read; others are passed by as damage."""
        number, length, *texts = formats[FMT].unpack.unpack(
            self.data[record.start + 3 : record.start + FMT_LENGTH]
        )
        try:
            kind = _format(length, *(text.partition(b'\0')[0] for text in texts))
        except ValueError:  # not ASCII among them
            return
        if number != FMT:
            kind.instance = formats[number].instance if number in formats else None
            formats[number] = kind

    def _tell_instances(self, record: Record, formats: dict[int, Format]) -> None:
        told = self._message(record)
        number, units = getattr(told, 'FmtType', None), getattr(told, 'UnitIds', '')
        kind = formats.get(number) if isinstance(number, int) else None
        at = units.find(INSTANCE) if isinstance(units, str) else -1
        if kind is not None and 0 <= at < len(kind.codes) and kind.codes[at] in WHOLE:
            kind.instance = struct.calcsize('<' + ''.join(_code(c)[0] for c in kind.codes[:at]))


def _code(character: str) -> tuple[str, float | None]:
    """Packing of a field, and its scale; ValueError for an unknown format."""
    from pymavlink.DFReader import FORMAT_TO_STRUCT

    if character not in FORMAT_TO_STRUCT:
        raise ValueError(character)
    packed, scale, _ = FORMAT_TO_STRUCT[character]
    return packed, scale


def _format(length: int, name: bytes, codes: bytes, columns: bytes) -> Format:
    """A type by its definition; ValueError where it contradicts itself."""
    known = [_code(character) for character in codes.decode('ascii')]
    unpack = struct.Struct('<' + ''.join(packed for packed, _ in known))
    names = columns.decode('latin-1').split(',') if columns else []
    title = name.decode('latin-1')
    if unpack.size + 3 != length or len(names) != len(known) or not title.isidentifier():
        raise ValueError(title)
    timed = names[:1] == ['TimeUS'] and codes[:1] == b'Q'
    scales = [scale for _, scale in known]
    return Format(title, names, unpack, scales, length, timed, codes.decode('ascii'))
