"""What an ArduSub vehicle is asked for when it is met: messages, version, parameters."""

import math
from collections import Counter
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink
from wrench_mapping import MANUAL_CONTROL

SECOND = 1_000_000_000  # ns
TURN = SECOND // 10  # between two requests for messages
SLOW = 0.5  # of the wanted rate: another ground station has asked for less
AGAIN, TRIES = SECOND // 2, 20  # of a question that has no answer
LEAST_VERSION = (4, 0, 0)
SEES_OVERRIDES = (4, 5, 0)  # from here on ArduSub's pilot-input failsafe
IGNORED = 2  # bit of RC_OPTIONS: whoever steers by MAVLink
FRAMES = {6: 1, 8: 2}  # thrusters -> FRAME_CONFIG: vectored, vectored with 6 DOF
STATION = ('SYSID_MYGCS', 'MAV_GCS_SYSID')  # 4.7 has renamed it
NEWER = ('MAV_GCS_SYSID_HI', 'FS_GCS_TIMEOUT')  # asked for first, and not waited for
GAINS = ('JS_GAIN_DEFAULT', 'JS_GAIN_MIN', 'JS_GAIN_MAX')
# parameter -> least and largest value, and what another one means
EXPECTED = {
    'FS_GCS_ENABLE': (2, 2, 'when this driver is killed the motors go on as last told; set 2'),
    'FS_GCS_TIMEOUT': (0, 5, 'so many s they go on when this driver is killed; set 5'),
    'FS_PILOT_TIMEOUT': (0.5, 3, 'set 3'),
    'ACRO_YAW_P': (3.375, 3.375, 'yaw is scaled in proportion; set 3.375'),
    'JS_THR_GAIN': (1, 1, 'heave is so many times as strong; set 1'),
}
OTHERS = ('FRAME_CONFIG', 'FS_PILOT_INPUT', 'RC_OPTIONS', 'RC_OVERRIDE_TIME', *GAINS)
PARAMETERS = (*NEWER, *STATION, *EXPECTED, *OTHERS)  # in this order
Order = Callable[..., None]  # a command and its parameters


class Telemetry:
    """Asks for messages that do not come: each for itself, or by its older stream if refused.

    Parameters
    ----------
    wanted : message id -> period in us, and the stream that has the message
    order : sends a command
    request : sends a REQUEST_DATA_STREAM of a stream and a rate in Hz

    """

    def __init__(
        self, wanted: dict[int, tuple[int, int]], order: Order, request: Callable[[int, int], None]
    ):
        self._wanted, self._order, self._request = wanted, order, request
        self._last: dict[int, int] = {}  # ns of a request
        self._due = self._until = self._counted = 0  # ns; until when an answer is waited for
        self._counts: Counter[int] = Counter()
        self._slow: set[int] = set()
        self._unanswered: int | None = None

    def answered(self, accepted: bool) -> None:
        """Take the answer to the request that was sent last."""
        self._until = 0
        if accepted:
            self._unanswered = None

    def heard(self, message_id: int) -> None:
        """Count a message."""
        self._counts[message_id] += 1

    def tick(self, heard: dict[int, int], now: int) -> None:
        """Ask for one that comes too slowly, or was not heard for a second; each once a second."""
        self._count(now)
        if now < self._due or (self._unanswered is not None and now < self._until):
            return
        self._due = now + TURN
        if self._unanswered is not None:
            period, stream = self._wanted[self._unanswered]
            self._request(stream, max(1, round(1e6 / period)))
            self._unanswered = None
        for message_id, (period, _) in self._wanted.items():
            came = -SECOND if message_id in self._slow else heard.get(message_id, -SECOND)
            if now - max(came, self._last.get(message_id, -SECOND)) < SECOND:
                continue
            self._last[message_id] = now
            self._unanswered, self._until = message_id, now + AGAIN
            self._order(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, period)
            return

    def _count(self, now: int) -> None:
        """Note once a second what comes at less than half of its rate."""
        if (passed := now - self._counted) < SECOND:
            return
        self._slow = {
            message_id
            for message_id, (period, _) in self._wanted.items()
            if 0 < self._counts[message_id] < SLOW * passed / (1000 * period)
        }
        self._counted = now
        self._counts.clear()


class Profile:
    """Version and parameters of the vehicle, asked for until they are known or given up.

    Parameters
    ----------
    order : sends a command
    read : sends a PARAM_REQUEST_READ of a name

    """

    def __init__(self, order: Order, read: Callable[[str], None]):
        self._order, self._read = order, read
        self.reset()

    def reset(self) -> None:
        """Forget the vehicle: it may be another one, or have other parameters."""
        self.version: tuple[int, int, int] | None = None
        self.kind = ''
        self.values: dict[str, float] = {}
        self._tries, self._due = 0, 0

    def tick(self, now: int) -> None:
        """Ask for what is missing."""
        if now < self._due or self.complete:
            return
        self._due, self._tries = now + AGAIN, self._tries + 1
        if self.version is None:  # the first is known since 4.0, the second until 4.5
            wanted = mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION
            self._order(mavlink.MAV_CMD_REQUEST_MESSAGE, wanted)
            self._order(mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, 1)
        for name in self._unknown():
            self._read(name)

    def take_version(self, message: Any) -> None:
        """Take an AUTOPILOT_VERSION."""
        major, minor, patch, kind = message.flight_sw_version.to_bytes(4, 'big')
        self.version = major, minor, patch
        self.kind = {0: 'dev', 64: 'alpha', 128: 'beta', 192: 'rc', 255: ''}.get(kind, '')

    def take_parameter(self, message: Any) -> None:
        """Take a PARAM_VALUE; ValueError: not finite."""
        name, value = message.param_id, message.param_value
        if name in PARAMETERS:
            if not math.isfinite(value):
                raise ValueError(f'PARAM_VALUE: expected a finite {name}, found {value}')
            self.values[name] = value

    @property
    def complete(self) -> bool:
        """Whether everything is known, or has been asked for often enough."""
        return self._tries > TRIES or not self.missing()

    @property
    def firmware(self) -> str:
        """Version as a text."""
        numbers = '.'.join(map(str, self.version)) if self.version else 'unknown'
        return f'ArduSub {numbers} {self.kind}'.strip()

    def missing(self) -> list[str]:
        """What is not known yet and is waited for."""
        unknown = [name for name in self._unknown() if name not in NEWER]
        return ['AUTOPILOT_VERSION'] * (self.version is None) + unknown

    def _unknown(self) -> list[str]:
        known = {*self.values} | ({*STATION} if {*STATION} & {*self.values} else set())
        return [name for name in PARAMETERS if name not in known]

    def gain(self) -> float | None:
        """Pilot gain at boot, if that is within its limits; a button may have changed it since."""
        default, least, most = (self.values.get(name, 0.0) for name in GAINS)
        return default if 0.1 <= least <= default <= most <= 1.0 else None

    def differences(self, station: int, thrusters: int, how: str) -> tuple[list[str], list[str]]:
        """What is not as it should be, and what to do, once complete.

        Parameters
        ----------
        station : MAVLink id of this driver
        thrusters : how many the vehicle file has
        how : 'rc_override' or 'manual_control'

        Returns
        -------
        serious, others : with which the vehicle must not be armed, with which it may

        """
        serious, others, value = [], [], self.values.get
        for name in STATION:
            found = value(name, station)
            if not found <= station <= max(found, value('MAV_GCS_SYSID_HI', 0.0)):
                advice = f'it obeys that one only: start with -p system:={found:g} or set {station}'
                serious.append(f'{name} is {found:g}, expected {station}: {advice}')
        frame = FRAMES.get(thrusters, 0)
        if (found := value('FRAME_CONFIG', frame)) != frame:
            advice = f'the vehicle file has {thrusters} thrusters: set it, or give -p vehicle'
            serious.append(f'FRAME_CONFIG is {found:g}, expected {frame}: {advice}')
        if int(value('RC_OPTIONS', 0.0)) & IGNORED or value('RC_OVERRIDE_TIME', 3.0) == 0.0:
            text = 'RC_OPTIONS has bit 1, or RC_OVERRIDE_TIME is 0: nobody steers it by MAVLink'
            serious.append(f'{text}; clear the bit, and set 3')
        if missing := self.missing():
            others.append(f'no answer about {", ".join(missing)}: not checked')
        if self.version and self.version < LEAST_VERSION:
            others.append(f'{self.firmware} is older than 4.0: nobody has tried it')
        for name, (least, most, what) in EXPECTED.items():
            found = value(name, least)
            if not least <= found <= most and (name != 'JS_THR_GAIN' or how == MANUAL_CONTROL):
                expected = f'{least:g}' if least == most else f'{least:g} to {most:g}'
                others.append(f'{name} is {found:g}, expected {expected}: {what}')
        blind = how != MANUAL_CONTROL and (self.version or LEAST_VERSION) < SEES_OVERRIDES
        action = value('FS_PILOT_INPUT')
        if blind and action == 2.0:
            others.append(
                f'FS_PILOT_INPUT is 2 and {self.firmware} counts joysticks only: one that was used '
                'since boot disarms this driver after FS_PILOT_TIMEOUT; boot again without it'
            )
        elif not blind and action not in (2.0, None):
            text = f'FS_PILOT_INPUT is {action:g}, expected 2: a driver that hangs is not noticed'
            others.append(text)
        return serious, others
