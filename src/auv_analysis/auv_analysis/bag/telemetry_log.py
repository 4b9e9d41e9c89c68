"""Telemetry logs (.tlog): what a ground station received of a MAVLink vehicle.

pymavlink knows what the messages hold. Where they begin is looked for here, so that a file takes
no more memory than it has kinds of messages, whatever is in it.
"""

import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from auv_analysis.bag.limits import MOST_NAMED
from auv_analysis.bag.metadata import TopicExtent
from auv_dynamics.files.errors import InputError

Message = tuple[str, int, Any]  # topic, time of logging in ns, message
US = 1000  # ns
LATEST = 1 << 52  # us: beyond, a stamp is damage
V1, V2, SIGNED = 0xFE, 0xFD, 0x01
MARKER = re.compile(b'[\xfd\xfe]')
HEARTBEAT, ATTITUDE, SERVOS = 0, 30, 36  # ids
NO_AUTOPILOT = b'\x08'
WRAP = 1 << 32  # us: servo outputs tell the lower 32 bits of their time
NAME = 10  # bytes of a name of a value
TRIES = 10_000  # checksums that are worked out to find the next message behind damage


class Frame(NamedTuple):
    """Where a MAVLink message lies: stamp in us, first byte and end, sender, id, payload."""

    stamp: int
    start: int
    end: int
    system: int
    component: int
    number: int
    payload: int


def count(found: dict[Any, TopicExtent], kind: Any, time: int, path: Path) -> None:
    """Count a message of a kind; InputError where there are more kinds than a log has."""
    if kind not in found:
        if len(found) >= MOST_NAMED:
            raise InputError(path, '', f'at most {MOST_NAMED} kinds of messages', 'more')
        found[kind] = TopicExtent(time)
    found[kind].add(time)


def damage(path: Path, count: int, what: str) -> list[str]:
    """A note on bytes of a log that are no messages or records; none where all are."""
    return [f'{path.name}: damaged: {count} bytes are no {what}'] if count else []


class TelemetryLog:
    """A .tlog: what a ground station received, each message behind its time in us.

    Parameters
    ----------
    path : for refusals
    data : bytes of the file

    """

    kind = 'mavlink'

    def __init__(self, path: Path, data: Any):
        from pymavlink.dialects.v20 import ardupilotmega

        self._path, self._data = path, data
        self._library: Any = ardupilotmega
        self._decoder: Any = ardupilotmega.MAVLink(None)
        self._vehicle: tuple[int, int] | None = None
        self._damaged, self._tries = 0, TRIES
        self._boots: dict[tuple[int, int], int] = {}  # sender -> us on the ground station's clock
        self._told: dict[tuple[int, int, str], str] = {}  # sender and parameter -> value

    @property
    def parameters(self) -> dict[str, str]:
        """Parameters of the vehicle by name, as far as it told them."""
        return {name: told for (*sender, name), told in self._told.items()
                if tuple(sender) == self._vehicle}  # fmt: skip

    def tallies(self, notes: list[str]) -> dict[str, TopicExtent]:
        """What there is of each message of the vehicle; that is whose autopilot is heard most."""
        found: dict[tuple[int, int, str], TopicExtent] = {}
        heard: Counter[tuple[int, int]] = Counter()
        parameters = self._number('PARAM_VALUE')
        for frame in self._frames():
            key = frame.system, frame.component, self._topic(frame)
            count(found, key, frame.stamp * US, self._path)
            if frame.number == ATTITUDE:
                self._note_boot(frame)
            elif frame.number == HEARTBEAT:
                autopilot = self._data[frame.payload + 5 : frame.payload + 6]
                if autopilot != NO_AUTOPILOT and self._decoded(frame) is not None:
                    heard[frame.system, frame.component] += 1
            elif frame.number == parameters:
                self._note_parameter(frame)
        self._vehicle = self._chosen(found, heard, notes)
        notes += damage(self._path, self._damaged, 'messages')
        return {
            topic: tally
            for (system, component, topic), tally in sorted(found.items())
            if (system, component) == self._vehicle
        }

    def _chosen(
        self,
        found: Mapping[tuple[int, int, str], TopicExtent],
        heard: Counter[tuple[int, int]],
        notes: list[str],
    ) -> tuple[int, int]:
        """System and component of the vehicle."""
        senders = sorted({key[:2] for key in found})
        if not senders:
            raise InputError(self._path, '', 'MAVLink messages behind their times', 'none')
        if not heard and len(senders) > 1:
            listed = ', '.join(f'{system}.{component}' for system, component in senders[:8])
            expected = 'heartbeats of the autopilot, which say who it is'
            raise InputError(self._path, '', expected, f'none from {listed}')
        vehicle = heard.most_common(1)[0][0] if heard else senders[0]
        others = [sender for sender in senders if sender != vehicle]
        if others:
            left = sum(tally.count for key, tally in found.items() if key[:2] != vehicle)
            also = f', the most heard of {len(heard)} autopilots' if len(heard) > 1 else ''
            notes.append(
                f'{self._path.name}: read system {vehicle[0]}, component {vehicle[1]}{also}; left '
                f'{left} messages of {len(others)} other senders'
            )
        return vehicle

    def messages(self, topics: Collection[str], notes: list[str]) -> Iterator[Message]:
        """Messages of some topics; those with a wrong checksum are left out and counted."""
        wrong = 0
        numbers = {self._number(topic.partition('[')[0]) for topic in topics}
        for frame in self._frames():
            if (frame.system, frame.component) != self._vehicle:
                continue
            if frame.number == ATTITUDE:
                self._note_boot(frame)
            if frame.number not in numbers or (topic := self._topic(frame)) not in topics:
                continue
            message = self._decoded(frame)
            if message is None:
                wrong += 1
            else:
                if frame.number == SERVOS:
                    boot = self._boots.get((frame.system, frame.component), frame.stamp)
                    passed = frame.stamp - boot - message.time_usec
                    message.time_usec += max(round(passed / WRAP), 0) * WRAP
                yield topic, frame.stamp * US, message
        if wrong:
            notes.append(f'{self._path.name}: {wrong} messages left out, whose checksum is wrong')
        notes += damage(self._path, self._damaged, 'messages')

    def _topic(self, frame: Frame) -> str:
        """Type of a message; behind it which port, sensor or value, where that is not number 0."""
        known = self._library.mavlink_map.get(frame.number)
        if known is None:
            return f'message {frame.number}'
        name, key = str(known.msgname), known.instance_field
        if key is None:
            return name
        kind, begin = known.fieldtypes[known.fieldnames.index(key)], known.instance_offset
        width = NAME if kind == 'char' else int(re.sub(r'\D', '', kind)) // 8
        end = min(begin + width, self._data[frame.start + 1])  # zeros at the end are not sent
        told = self._data[frame.payload + begin : frame.payload + end]
        if kind == 'char':
            instance = told.partition(b'\0')[0].decode('latin-1')
        else:
            instance = str(int.from_bytes(told, 'little') or '')
        return f'{name}[{instance}]' if instance else name

    def _number(self, topic: str) -> int:
        """Id of a message type; -1 of an unknown one."""
        every = self._library.mavlink_map.items()
        return next((number for number, kind in every if kind.msgname == topic), -1)

    def _decoded(self, frame: Frame) -> Any:
        """The message of a frame; None where its checksum or its layout is wrong."""
        try:
            return self._decoder.decode(bytearray(self._data[frame.start : frame.end]))
        except Exception:  # whatever the library meets in damaged bytes
            return None

    def _note_boot(self, frame: Frame) -> None:
        told = self._data[frame.payload : frame.payload + 4]  # time_boot_ms
        self._boots[frame.system, frame.component] = (
            frame.stamp - int.from_bytes(told, 'little') * US
        )

    def _note_parameter(self, frame: Frame) -> None:
        message = self._decoded(frame)
        if message is not None and len(self._told) < MOST_NAMED:
            name = frame.system, frame.component, str(message.param_id)
            self._told[name] = f'{message.param_value:g}'

    def _frames(self) -> Iterator[Frame]:
        """All messages, by their headers alone."""
        place, size = 0, len(self._data)
        self._damaged, self._tries = 0, TRIES
        while place < size:
            frame = self._frame(place)
            if frame is None:
                behind = self._next(place + 1)
                self._damaged += behind - place
                place = behind
            else:
                yield frame
                place = frame.end

    def _frame(self, place: int) -> Frame | None:
        """The message that begins with its time at a place; None where there is none."""
        data = self._data
        head = data[place : place + 20]
        if len(head) < 16:
            return None
        if head[8] == V1:
            start, payload = place + 8, place + 14
            end = payload + head[9] + 2
            system, component, number = head[11], head[12], head[13]
        elif head[8] == V2 and len(head) == 20:
            start, payload = place + 8, place + 18
            end = payload + head[9] + 2 + (13 if head[10] & SIGNED else 0)
            system, component = head[13], head[14]
            number = head[15] | head[16] << 8 | head[17] << 16
        else:
            return None
        stamp = int.from_bytes(head[:8], 'big')
        if end > len(data) or stamp > LATEST:
            return None
        return Frame(stamp, start, end, system, component, number, payload)

    def _next(self, place: int) -> int:
        """Where the next message begins whose checksum is right; the end where there is none."""
        for match in MARKER.finditer(self._data, place + 8):
            candidate = match.start() - 8
            frame = self._frame(candidate)
            if frame is None or frame.number not in self._library.mavlink_map:
                continue
            self._tries -= 1
            if self._tries < 0:
                break
            if self._decoded(frame) is not None:
                return candidate
        return len(self._data)
