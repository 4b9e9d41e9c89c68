"""An ArduSub vehicle over MAVLink, as a ground station has it; no socket, no ROS, no clock."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from navigation import BootClock, Exchange, Navigation, RestartedError, Sample
from pilot import MANUAL, Pilot
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from vehicle_checks import SECOND, Profile, Telemetry
from wrench_mapping import (
    MANUAL_CONTROL,
    NEUTRAL,
    NEUTRAL_PWM,
    OVERRIDE,
    PilotAxes,
    manual_control,
    pulses_of,
    rc_override,
)

QUICK = SECOND // 10  # between two TIMESYNC requests until the clock is known
GONE = 3 * SECOND  # without a heartbeat
STOOD = 5 * SECOND // 2  # after which ArduSub's failsafe has acted
SAY_AGAIN = 10 * SECOND  # the same text
FRESH = 5 * SECOND  # of a refusal to arm
WARNING = mavlink.MAV_SEVERITY_WARNING
GAIN = 'PilotGain'  # NAMED_VALUE_FLOAT of ArduSub's
AT_REST, DEAD = 5, 25  # us about neutral: of motors, and of inputs
SENT = 2 * SECOND  # for which inputs are kept, to know them when the vehicle reports them
FOLLOWED, STRANGE = 5, 6  # reports of inputs: known ones before strange ones count, and how many
FORGOTTEN = 0.05  # of a strange one by each own: two pilots share the reads in any proportion
UNSEEN = 0.06  # for which a strange one counts while no own one has been seen: 2 s of them
SHARED = (
    'another station has the id of this driver: while it is heard, the vehicle does not notice the '
    'loss of this one (FS_GCS_ENABLE); end it, or give this one an id of its own'
)

# message id -> rate in Hz (0: that of the odometry), and the stream that has it
MESSAGES = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: (5, mavlink.MAV_DATA_STREAM_EXTENDED_STATUS),  # in none
    mavlink.MAVLINK_MSG_ID_ATTITUDE: (0, mavlink.MAV_DATA_STREAM_EXTRA1),
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: (0, mavlink.MAV_DATA_STREAM_POSITION),
    mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: (20, mavlink.MAV_DATA_STREAM_RC_CHANNELS),
    mavlink.MAVLINK_MSG_ID_RC_CHANNELS: (50, mavlink.MAV_DATA_STREAM_RC_CHANNELS),
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: (2, mavlink.MAV_DATA_STREAM_EXTENDED_STATUS),
}
ODOMETRY = ('ATTITUDE', 'LOCAL_POSITION_NED')


@dataclass(frozen=True)
class LinkSettings:
    """Who is talked to, and how."""

    system: int = 1  # MAVLink id of the vehicle
    station: int = 255  # of this side
    thrusters: int = 8  # of the vehicle file
    rate: float = 50.0  # of attitude and position, Hz
    timeout: int = SECOND  # of the position: the vehicle is not heard, ns
    how: str = OVERRIDE  # six axes, or MANUAL_CONTROL: four
    neutral: int = SECOND // 2  # ns without a wrench
    disarm: int = 3 * SECOND  # ns without a wrench


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
        self._settings, self._send, self._tell = settings, send, say
        self._target = settings.system, mavlink.MAV_COMP_ID_AUTOPILOT1
        self.pilot = Pilot(settings.neutral, settings.disarm)
        self.clock = BootClock()
        self.profile = Profile(self._order, self._read_parameter)
        self.gain: float | None = 1.0 if settings.how == OVERRIDE else None
        self.gain_from = ''
        self.voltage: float | None = None
        self.refused = 0
        self._navigation = Navigation(self.clock)
        self._heard: dict[int, int] = {}  # message id -> ns
        self._sampled: int | None = None  # ns of the last sample
        self._last_ns = -1  # stamp of the last sample
        self._done: dict[str, int] = {}
        self._said: dict[str, int] = {}
        self._refusals: dict[str, int] = {}  # to arm: text -> ns
        self._compared = False
        self.differences: list[str] = []  # of the vehicle's parameters, and what to do
        self._serious: list[str] = []  # differences with which the vehicle is not taken
        self._inputs: deque[tuple[int, tuple[int, ...]]] = deque()  # sent: ns, pulses
        self._own: tuple[int, ...] = ()  # the last of them that the vehicle reported
        self.inputs: tuple[int, ...] = ()  # that the vehicle reported last, anybody's
        self._followed, self._strange = 0, 0.0
        self._now = 0
        self._telemetry = Telemetry(self._wanted_messages(), self._order, self._request_stream)
        self._takers: dict[str, Callable[[Any, int], Sample | None]] = {
            'HEARTBEAT': self._heartbeat,
            'TIMESYNC': self._timesync,
            'ATTITUDE': lambda m, _: self._navigation.attitude(m),
            'LOCAL_POSITION_NED': self._position,
            'SYS_STATUS': self._status,
            'SERVO_OUTPUT_RAW': self._motors,
            'RC_CHANNELS': self._channels,
            'NAMED_VALUE_FLOAT': self._named,
            'AUTOPILOT_VERSION': lambda m, _: self.profile.take_version(m),
            'PARAM_VALUE': lambda m, _: self.profile.take_parameter(m),
            'COMMAND_ACK': self._answer,
            'STATUSTEXT': self._text,
        }

    def is_vehicle(self, message: Any) -> bool:
        """Whether a message is of the autopilot that is talked to."""
        return (message.get_srcSystem(), message.get_srcComponent()) == self._target

    def receive(self, message: Any, now: int) -> Sample | None:
        """Take a message that arrived at `now` in ns; a sample of the motion where it gives one.

        What others send, and what must not be used, is dropped and counted in `refused`.
        """
        self._now = now
        if not self.is_vehicle(message):
            self._of_others(message)
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
        self._telemetry.heard(message.get_msgId())
        return sample

    def command(self, axes: PilotAxes, now: int) -> None:
        """Command the axes of a wrench that has just come, once the pilot gain is known.

        Neutral ones while the vehicle is not heard: not every controller needs odometry.
        """
        if self.gain is not None:
            self.pilot.command(axes if self.hears() else NEUTRAL, now)
            self._steer(now, fresh=True)

    def tick(self, now: int) -> None:
        """Send what is due at `now` in ns; to be called often."""
        stood, self._done['tick'] = now - self._done.get('tick', now), now
        self._now = now
        if self.pilot.wanted and stood > STOOD:
            self._give_up(f'this driver stood still for {stood / SECOND:.1f} s', now)
        if self._sampled is not None and now - self._sampled > self._settings.timeout:
            self._sampled = None
            self.pilot.silence()
            self._say('vehicle not heard: neutral')
        # before the first input they would keep alive what a killed driver has left
        if self._inputs and self._is_due('heartbeat', now, SECOND):
            kind = mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID
            self._send(mavlink.MAVLink_heartbeat_message(*kind, 0, 0, mavlink.MAV_STATE_ACTIVE, 3))
        if self._is_due('timesync', now, SECOND if self.clock.settled else QUICK):
            self._send(mavlink.MAVLink_timesync_message(0, now))
        self._telemetry.tick(self._heard, now)
        if self._has(mavlink.MAVLINK_MSG_ID_HEARTBEAT, now, GONE):
            self.profile.tick(now)
        if not self._compared and self.profile.complete:
            self._compare()
        self._steer(now)

    def hears(self) -> bool:
        """Whether samples come."""
        return self._sampled is not None

    def waits_for(self, now: int) -> list[str]:
        """What is missing before wrenches reach the motors, all of it; empty when they do."""
        if not self._has(mavlink.MAVLINK_MSG_ID_HEARTBEAT, now, GONE):
            return [f'a heartbeat of system {self._settings.system}']
        waits = [] if self.profile.complete else self.profile.missing()
        for name in ODOMETRY:
            if not self._has(getattr(mavlink, f'MAVLINK_MSG_ID_{name}'), now, SECOND):
                waits.append(name)
        if self.clock.local(0) is None:
            waits.append('TIMESYNC')
        if self.gain is None:
            waits.append(f'the pilot gain ({GAIN} or JS_GAIN_DEFAULT)')
        pilot = self.pilot
        if not pilot.wanted:
            return [*waits, *self._serious, f'~/arm ({pilot.why})']
        fed = pilot.is_fed(now)
        if not fed:
            waits.append('a wrench')
        if pilot.mode != MANUAL:
            waits.append(f'mode MANUAL (it is in {pilot.mode})')
        elif fed and not pilot.armed:
            waits.append(': '.join(['the vehicle to arm', *_younger(self._refusals, now - FRESH)]))
        return [*waits, *self._serious]

    def _wanted_messages(self) -> dict[int, tuple[int, int]]:
        rates = dict(MESSAGES)
        if self._settings.how == MANUAL_CONTROL:
            gain = mavlink.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT  # comes with its stream only
            rates[gain] = 2, mavlink.MAV_DATA_STREAM_EXTENDED_STATUS
        return {
            message_id: (round(1e6 / (rate or self._settings.rate)), stream)
            for message_id, (rate, stream) in rates.items()
        }

    def _has(self, message_id: int, now: int, within: int) -> bool:
        return now - self._heard.get(message_id, -within - 1) <= within

    def _is_due(self, what: str, now: int, period: int) -> bool:
        if now - self._done.get(what, -period) < period:
            return False
        self._done[what] = now
        return True

    def _give_up(self, why: str, now: int) -> None:
        self.pilot.want(False, now, why)
        self._say(f'{why}: disarmed until ~/arm is called')

    def _say(self, text: str) -> None:
        """Say a line; the same one again after a while only."""
        self._said = _younger(self._said, self._now - SAY_AGAIN)
        if text not in self._said:
            self._said[text] = self._now
            self._tell(text)

    def _order(self, command: int, *parameters: float) -> None:
        padded = [*parameters, *[0.0] * (7 - len(parameters))]
        self._send(mavlink.MAVLink_command_long_message(*self._target, command, 0, *padded))

    def _request_stream(self, stream: int, rate: int) -> None:
        self._send(mavlink.MAVLink_request_data_stream_message(*self._target, stream, rate, 1))

    def _read_parameter(self, name: str) -> None:
        self._send(mavlink.MAVLink_param_request_read_message(*self._target, name.encode(), -1))

    def _compare(self) -> None:
        """Say what of the vehicle's parameters is not as it should be, once they are known."""
        self._compared, settings = True, self._settings
        asked = settings.station, settings.thrusters, settings.how
        self._serious, others = self.profile.differences(*asked)
        self.differences = [*self._serious, *others]
        for text in self.differences:
            self._say(text)
        if self.gain is None and (gain := self.profile.gain()) is not None:
            self.gain, self.gain_from = gain, 'JS_GAIN_DEFAULT'

    def _steer(self, now: int, *, fresh: bool = False) -> None:
        known = self.gain is not None and self._compared and not self._serious
        deed = self.pilot.due(now, known and self._sampled is not None, fresh=fresh)
        if deed.mode:
            flag = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
            self._order(mavlink.MAV_CMD_DO_SET_MODE, flag, MANUAL)
        if deed.arm is not None:
            self._order(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, float(deed.arm))
        if deed.axes is None:
            return
        off = [pulse for pulse in self.inputs if pulse and abs(pulse - NEUTRAL_PWM) > DEAD]
        if off and not self._inputs:
            self._say(
                f'inputs were {self.inputs} before: of a receiver, which steers again '
                'RC_OVERRIDE_TIME after this driver falls silent, or the last of another pilot'
            )
        if self._settings.how == MANUAL_CONTROL:
            gain = self.gain or 1.0
            message = manual_control(deed.axes, self._settings.system, gain)
            pulses = pulses_of(message, gain, self.profile.values.get('JS_THR_GAIN', 1.0))
        else:
            message, pulses = rc_override(deed.axes, *self._target), deed.axes.pulses()
        self._inputs.append((now, pulses))
        while now - self._inputs[0][0] > SENT:
            self._inputs.popleft()
        self._send(message)

    def _of_others(self, message: Any) -> None:
        """Count what is not of the vehicle; say whose heartbeats stand in for this driver's."""
        self.refused += 1
        who = message.get_type(), message.get_srcSystem()
        if who == ('HEARTBEAT', self._settings.station) and SHARED not in self.differences:
            self.differences.append(SHARED)
            self._say(SHARED)

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
        self.clock.add(Exchange(message.ts1, message.tc1, now))

    def _position(self, message: Any, now: int) -> Sample | None:
        sample = self._navigation.position(message)
        if sample is None or sample.ns <= self._last_ns:
            return None
        if self._sampled is None and self._last_ns >= 0:
            self._say('vehicle heard again')
        self._sampled, self._last_ns = now, sample.ns
        return sample

    def _status(self, message: Any, _: int) -> None:
        known = message.voltage_battery != 65535
        self.voltage = message.voltage_battery / 1000.0 if known else None

    def _motors(self, message: Any, _: int) -> None:
        if message.port:  # outputs 17 to 32
            return
        outputs = [getattr(message, f'servo{i + 1}_raw') for i in range(self._settings.thrusters)]
        self.pilot.motors(all(not out or abs(out - NEUTRAL_PWM) <= AT_REST for out in outputs))

    def _channels(self, message: Any, now: int) -> None:
        """Notice another pilot: inputs that this one has not sent, after they were its own.

        Two of them would take turns: the newest input counts. The driver is the one that yields.
        Where its own never show, the vehicle obeys somebody or something else: it is disarmed.
        """
        self.inputs = found = tuple(getattr(message, f'chan{i}_raw') for i in range(1, 7))
        if not self.pilot.commands:
            self._followed, self._strange = 0, 0.0
            return
        seen = self._followed >= FOLLOWED
        if any(_alike(found, own) for own in (self._own, *(own for _, own in self._inputs))):
            self._own = found
            self._followed, self._strange = self._followed + 1, max(0.0, self._strange - FORGOTTEN)
        else:
            self._strange += 1.0 if seen else UNSEEN
        if self._strange >= STRANGE and seen:
            self._say(self.pilot.let_go(f'another pilot steers, inputs {found}'))
        elif self._strange >= STRANGE:
            why = f'inputs are {found}, not those sent: another pilot, his trims or input hold'
            self._give_up(why, now)

    def _named(self, message: Any, _: int) -> None:
        if message.name == GAIN and self._settings.how == MANUAL_CONTROL:
            if not 0.0 < message.value <= 1.0:
                raise ValueError(f'{GAIN}: expected a number from 0 to 1, found {message.value}')
            self.gain, self.gain_from = message.value, GAIN

    def _answer(self, message: Any, now: int) -> None:
        accepted = message.result == mavlink.MAV_RESULT_ACCEPTED
        orders = mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_CMD_DO_SET_MODE
        if message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            self._telemetry.answered(accepted)
        if accepted and message.command == orders[0]:
            self.pilot.acknowledged(now)
        if message.command in orders and not accepted:
            names = mavlink.enums['MAV_RESULT']
            result = names[message.result].name if message.result in names else message.result
            self._say(f'{mavlink.enums["MAV_CMD"][message.command].name}: {result}')

    def _text(self, message: Any, now: int) -> None:
        if message.text.startswith(('PreArm', 'Arm:')):
            self._refusals = {**_younger(self._refusals, now - FRESH), message.text: now}
        if message.severity <= WARNING:
            self._say(f'vehicle: {message.text}')

    def _restarted(self, why: str) -> None:
        self._say(self.pilot.let_go(f'vehicle restarted ({why})'))
        self.pilot.armed, self._sampled = False, None
        self._heard.clear()
        self._refusals.clear()
        self.clock.reset()
        self.profile.reset()
        self._compared, self._serious = False, []
        if self._settings.how == MANUAL_CONTROL:
            self.gain = None
        self._navigation.reset()


def _alike(some: tuple[int, ...], others: tuple[int, ...]) -> bool:
    """Whether inputs are the same to 2 us, by which MANUAL_CONTROL may be rounded otherwise."""
    return bool(others) and all(abs(a - b) <= 2 for a, b in zip(some, others, strict=True))


def _younger(texts: dict[str, int], than: int) -> dict[str, int]:
    return {text: at for text, at in texts.items() if at > than}
