"""An ArduSub vehicle over MAVLink, as a ground station has it; no socket, no ROS, no clock."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from boot_clock import BootClock, Exchange
from navigation import Navigation, RestartedError, Sample
from pilot import MANUAL, Pilot, Timeouts
from pilot_messages import MANUAL_CONTROL, OVERRIDE, manual_control, rc_override
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from wrench_mapping import PilotAxes

SECOND = 1_000_000_000  # ns
QUICK = SECOND // 10  # between two TIMESYNC requests until the clock is known
DISARM_NOW = 3  # requests at the end, when no answer is waited for
WARNING = mavlink.MAV_SEVERITY_WARNING
GAIN = 'PilotGain'  # NAMED_VALUE_FLOAT that ArduSub sends by itself


@dataclass(frozen=True)
class LinkSettings:
    """Who is talked to, and how.

    Attributes
    ----------
    system, component : MAVLink ids of the autopilot
    rate : of attitude and position, Hz
    timeout : silence of the position after which the vehicle is not heard, ns
    how : 'rc_override' (six axes) or 'manual_control' (four)
    wrench : timeouts of the wrench

    """

    system: int = 1
    component: int = mavlink.MAV_COMP_ID_AUTOPILOT1
    rate: float = 50.0
    timeout: int = SECOND
    how: str = OVERRIDE
    wrench: Timeouts = field(default_factory=Timeouts)


class VehicleLink:
    """Heartbeats, telemetry, time, mode, arming and pilot input of one vehicle.

    Parameters
    ----------
    settings : LinkSettings
    send : takes a message
    say : takes a line for the people

    """

    def __init__(
        self, settings: LinkSettings, send: Callable[[Any], None], say: Callable[[str], None]
    ):
        self._settings, self._send, self._say = settings, send, say
        self.pilot = Pilot(settings.wrench)
        self.clock = BootClock()
        self.gain: float | None = 1.0 if settings.how == OVERRIDE else None
        self.voltage: float | None = None
        self.refused = 0
        self._navigation = Navigation(self.clock)
        self._heard: dict[int, int] = {}  # message id -> ns
        self._sampled: int | None = None  # ns of the last sample
        self._last_ns = -1  # stamp of the last sample
        self._due: dict[str, int] = {}
        every = round(1e6 / settings.rate)
        self._intervals = {
            mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: every,
            mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: every,
            mavlink.MAVLINK_MSG_ID_SYS_STATUS: 1_000_000,
        }
        self._takers: dict[str, Callable[[Any, int], Sample | None]] = {
            'HEARTBEAT': self._heartbeat,
            'TIMESYNC': self._timesync,
            'ATTITUDE_QUATERNION': lambda m, _: self._navigation.attitude(m),
            'LOCAL_POSITION_NED': self._position,
            'SYS_STATUS': self._status,
            'NAMED_VALUE_FLOAT': self._named,
            'COMMAND_ACK': self._answer,
            'STATUSTEXT': self._text,
        }

    def is_vehicle(self, message: Any) -> bool:
        """Whether a message is of the autopilot that is talked to."""
        ids = message.get_srcSystem(), message.get_srcComponent()
        return ids == (self._settings.system, self._settings.component)

    def receive(self, message: Any, now: int) -> Sample | None:
        """Take a message that arrived at `now` in ns; a sample of the motion where it gives one.

        What others send, and what must not be used, is dropped and counted in `refused`.
        """
        if not self.is_vehicle(message):
            self.refused += 1
            return None
        take = self._takers.get(message.get_type())
        if take is None:
            return None
        try:
            sample = take(message, now)
        except RestartedError as error:
            self._restarted(str(error))
            return None
        except ValueError as error:
            self.refused += 1
            self._say(f'refused: {error}')
            return None
        self._heard[message.get_msgId()] = now
        return sample

    def command(self, axes: PilotAxes, now: int) -> None:
        """Command the axes of a wrench that has just come, once the pilot gain is known."""
        if self.gain is not None:
            self.pilot.command(axes, now)
            self._steer(now, fresh=True)

    def tick(self, now: int) -> None:
        """Send what is due at `now` in ns; to be called often."""
        if self._sampled is not None and now - self._sampled > self._settings.timeout:
            self._sampled = None
            self.pilot.silence()
            self._say('vehicle not heard: neutral')
        if self._is_due('heartbeat', now, SECOND):
            self._send(ground_station_heartbeat())
        if self._is_due('timesync', now, SECOND if self.clock.local(0) is not None else QUICK):
            self._send(mavlink.MAVLink_timesync_message(0, now))
        if self._is_due('telemetry', now, SECOND):
            for message_id, interval in self._intervals.items():
                if now - self._heard.get(message_id, -SECOND) >= SECOND:
                    self._order(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, interval)
        self._steer(now)

    def hears(self) -> bool:
        """Whether samples come."""
        return self._sampled is not None

    def leave(self) -> None:
        """Last words: neutral and disarmed, if the vehicle is in this hand."""
        if self.pilot.wanted and self.pilot.armed:
            self._send(rc_override(PilotAxes(), *self._target))
            for _ in range(DISARM_NOW):  # any of them may be lost
                self._order(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0)

    @property
    def _target(self) -> tuple[int, int]:
        return self._settings.system, self._settings.component

    def _is_due(self, what: str, now: int, period: int) -> bool:
        if now < self._due.get(what, now):
            return False
        self._due[what] = now + period
        return True

    def _order(self, command: int, *parameters: float) -> None:
        padded = [*parameters, *[0.0] * (7 - len(parameters))]
        self._send(mavlink.MAVLink_command_long_message(*self._target, command, 0, *padded))

    def _steer(self, now: int, *, fresh: bool = False) -> None:
        deed = self.pilot.due(now, fresh=fresh)
        if deed.mode:
            flag = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
            self._order(mavlink.MAV_CMD_DO_SET_MODE, flag, MANUAL)
        if deed.arm is not None:
            self._order(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, float(deed.arm))
        if deed.axes is None or self.gain is None:
            return
        if self._settings.how == MANUAL_CONTROL:
            self._send(manual_control(deed.axes, self._settings.system, self.gain))
        else:
            self._send(rc_override(deed.axes, *self._target))

    def _heartbeat(self, message: Any, now: int) -> None:
        kind = message.type, message.autopilot
        if kind != (mavlink.MAV_TYPE_SUBMARINE, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA):
            raise ValueError(f'HEARTBEAT: expected a submarine of ArduPilot (12, 3), found {kind}')
        armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        if text := self.pilot.vehicle(armed, message.custom_mode, now):
            self._say(text)

    def _timesync(self, message: Any, now: int) -> None:
        if message.tc1 == 0 or not 0 <= now - message.ts1 < SECOND:
            return  # a request of the vehicle, or the answer to somebody else
        if not self.clock.add(Exchange(message.ts1, message.tc1, now)):
            self._restarted('boot time jumped')

    def _position(self, message: Any, now: int) -> Sample | None:
        sample = self._navigation.position(message)
        if sample is None or sample.ns <= self._last_ns:
            return None
        if self._sampled is None:
            self._say_once_heard()
        self._sampled, self._last_ns = now, sample.ns
        return sample

    def _say_once_heard(self) -> None:
        if self._last_ns >= 0:
            self._say('vehicle heard again')

    def _status(self, message: Any, _: int) -> None:
        known = message.voltage_battery != 65535
        self.voltage = message.voltage_battery / 1000.0 if known else None

    def _named(self, message: Any, _: int) -> None:
        if message.name == GAIN and self._settings.how == MANUAL_CONTROL:
            if not 0.0 < message.value <= 1.0:
                raise ValueError(f'{GAIN}: expected a number from 0 to 1, found {message.value}')
            self.gain = message.value

    def _answer(self, message: Any, now: int) -> None:
        accepted = message.result == mavlink.MAV_RESULT_ACCEPTED
        if accepted and message.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            self.pilot.acknowledged(now)
        if message.result not in (mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_IN_PROGRESS):
            names = mavlink.enums['MAV_CMD'], mavlink.enums['MAV_RESULT']
            command, result = (
                table[number].name if number in table else str(number)
                for table, number in zip(names, (message.command, message.result), strict=True)
            )
            self._say(f'{command}: {result}')

    def _text(self, message: Any, _: int) -> None:
        if message.severity <= WARNING:
            self._say(f'vehicle: {message.text}')

    def _restarted(self, why: str) -> None:
        self._say(self.pilot.let_go(f'vehicle restarted ({why})'))
        self.pilot.armed, self._sampled = False, None
        self._heard.clear()
        self.clock.reset()
        self._navigation.reset()


def ground_station_heartbeat() -> Any:
    """HEARTBEAT of a ground station."""
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
    )
