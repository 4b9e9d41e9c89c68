"""An autopilot that behaves like ArduSub towards its ground station, with a simulated vehicle.

What it does was seen of ArduSub 4.0.3 and 4.2.0dev, or read in the sources of later versions. It
reads the pilot's input at 50 Hz and keeps the last one in every mode; refuses to arm until it is
ready; starts the motors half a second after arming; knows the failsafes of the pilot's input and
of the ground station; stabilises roll and pitch, and in ALT_HOLD the depth; sends what it was asked
for, and PilotGain with its older stream only.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from ardusub_mixer import MIDDLE, motor_pulses, thrust
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from auv_dynamics import load_vehicle
from auv_dynamics.plant.plant import Plant, initial_state
from auv_dynamics.plant.uncertainty import make_uncertainty
from auv_dynamics.vehicle.kinematics import euler, rotation

STEP = 5_000_000  # ns of the simulation
INPUT = 4  # steps between two looks at the pilot's input
ON_THE_WAY = 2  # steps from there to the motors
SECOND = 1_000_000_000
SPOOL_UP = SECOND // 2
MODES = {0: 'STABILIZE', 2: 'ALT_HOLD', 19: 'MANUAL'}
STABILIZE, ALT_HOLD, MANUAL = MODES
GROUND_STATION = 255  # SYSID_MYGCS
GCS_TIMEOUT = 2.5  # s; FS_GCS_TIMEOUT where there is one
SEES_OVERRIDES = (4, 5, 0)  # from here on the pilot-input failsafe
RENAMED = (4, 7, 0)  # from here on SYSID_MYGCS is MAV_GCS_SYSID
SEPARATE = (0, 65535)  # of an override: released to a receiver that is not there, left as it is
ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
FAILED, UNSUPPORTED = mavlink.MAV_RESULT_FAILED, mavlink.MAV_RESULT_UNSUPPORTED
NAMED = mavlink.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT
STREAMS = {
    mavlink.MAV_DATA_STREAM_EXTENDED_STATUS: (mavlink.MAVLINK_MSG_ID_SYS_STATUS, NAMED),
    mavlink.MAV_DATA_STREAM_RC_CHANNELS: (
        mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW,
        mavlink.MAVLINK_MSG_ID_RC_CHANNELS,
    ),
    mavlink.MAV_DATA_STREAM_POSITION: (mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED,),
    mavlink.MAV_DATA_STREAM_EXTRA1: (mavlink.MAVLINK_MSG_ID_ATTITUDE,),
}
LEVEL, STILL, DEPTH, SINK = 1.5, 0.5, 0.8, 0.8  # of stabilising: input per rad, rad/s, m, m/s


@dataclass(frozen=True)
class Settings:
    """What is simulated."""

    vehicle: str = 'bluerov2_heavy'  # vehicle file, or bare name
    eta: tuple = (0.0,) * 6  # start, NED, m and rad
    nu: tuple = (0.0,) * 6  # m/s and rad/s, FSD
    curve: str = 'square'  # of the thrusters, or 'measured'
    voltage: float = 16.0  # V, of the supply
    gain: float = 0.5  # pilot gain, JS_GAIN_DEFAULT
    mode: int = MANUAL  # at boot
    version: tuple = (4, 5, 0)  # of the firmware
    position_after: float = 50.0  # s from boot until there is a position
    ready_after: float = 10.0  # s from boot until it arms
    velocity_bias: tuple = (0.0,) * 3  # of the estimator, FSD, m/s; 0.03 to 0.04 was seen


vehicle_of = cache(load_vehicle)


class Autopilot:
    """One boot of the autopilot; `now` of its methods is ns since then.

    Parameters
    ----------
    settings : Settings
    send : takes a message

    """

    def __init__(self, settings: Settings, send: Callable[[Any], None]):
        vehicle = vehicle_of(settings.vehicle)
        assert vehicle.thrusters is not None
        self._settings, self._send, self._T = settings, send, vehicle.thrusters.matrix
        truth = make_uncertainty(vehicle, [], settings.vehicle, [])
        start = initial_state(np.array(settings.eta), np.array(settings.nu))
        self.plant = Plant(truth, STEP / SECOND, 'rk4', start)
        self.armed, self.mode = False, settings.mode
        self._armed_at, self._depth = 0, 0.0
        self._override = [MIDDLE] * 6  # as it was last received
        self.channels = [MIDDLE] * 6  # as they were last read
        motors = self._T.shape[1]
        self.pulses = self._outputs = [MIDDLE] * motors  # of the inputs
        self._inputs, self._tau = [float(MIDDLE)] * 6, (0.0,) * 6
        self._coming = deque([self.pulses] * (1 + ON_THE_WAY), maxlen=1 + ON_THE_WAY)
        self._pilot_heard: int | None = None
        self._station_heard: int | None = None
        self._pilot_lost = False
        self._intervals: dict[int, int] = {mavlink.MAVLINK_MSG_ID_HEARTBEAT: SECOND}
        self._due: dict[int, int] = {}
        station = 'MAV_GCS_SYSID' if settings.version >= RENAMED else 'SYSID_MYGCS'
        self.parameters = {
            station: 255.0, 'FRAME_CONFIG': 2.0 if motors == 8 else 1.0, 'FS_GCS_ENABLE': 2.0,
            'FS_PILOT_INPUT': 2.0, 'FS_PILOT_TIMEOUT': 3.0, 'JS_GAIN_DEFAULT': settings.gain,
            'JS_GAIN_MIN': 0.25, 'JS_GAIN_MAX': 1.0, 'JS_THR_GAIN': 1.0, 'ACRO_YAW_P': 3.375,
            'RC_OPTIONS': 0.0, 'RC_OVERRIDE_TIME': 3.0,
        }  # fmt: skip
        if settings.version >= RENAMED:
            self.parameters |= {'FS_GCS_TIMEOUT': 5.0, 'MAV_GCS_SYSID_HI': 0.0}
        self._takers: dict[str, Callable[[Any, int], Any]] = {
            'HEARTBEAT': self._heartbeat,
            'TIMESYNC': self._timesync,
            'COMMAND_LONG': self._command,
            'REQUEST_DATA_STREAM': self._stream,
            'PARAM_REQUEST_READ': self._parameter,
            'SET_MODE': lambda m, _: self.set_mode(m.custom_mode),
            'RC_CHANNELS_OVERRIDE': self._take_override,
            'MANUAL_CONTROL': self._manual_control,
        }

    def receive(self, message: Any, now: int) -> None:
        """Take a message."""
        if take := self._takers.get(message.get_type()):
            take(message, now)

    def advance(self, now: int) -> None:
        """Let the vehicle move until `now`, watch over its ground station, send what is due."""
        while (self.plant.k + 1) * STEP <= now:
            self._move()
        self._watch_pilot(now)
        self._watch_station(now)
        for message_id, interval in self._intervals.items():
            if now >= self._due.get(message_id, 0):
                self._due[message_id] = max(now, self._due.get(message_id, now) + interval)
                self._report(message_id, now)

    def set_mode(self, mode: int) -> int:
        """Change the mode; the pilot's input stays."""
        if mode not in MODES:
            return DENIED
        self.mode, self._depth = mode, float(self.plant.x[2])
        return ACCEPTED

    def arm(self, on: bool, now: int) -> int:
        """Arm or disarm; refused until the vehicle is ready."""
        if on and not self.armed:
            if now < self._settings.ready_after * SECOND:
                self._say('PreArm: Gyros not calibrated')
                return FAILED
            self._armed_at = now
        self.armed = on
        return ACCEPTED

    def _move(self) -> None:
        k, motors = self.plant.k, len(self.pulses)
        if k % INPUT == 0:
            self.channels = list(self._override)
        drives = self.armed and k * STEP - self._armed_at >= SPOOL_UP
        inputs = self._stabilised() if drives else [MIDDLE] * 6
        if inputs != self._inputs:
            self._inputs, self._outputs = inputs, motor_pulses(inputs, motors)
        self._coming.append(self._outputs)
        before, self.pulses = self.pulses, self._coming[0] if self.armed else [MIDDLE] * motors
        if self.pulses != before:
            tau = self._T @ thrust(self.pulses, self._settings.curve, self._settings.voltage)
            self._tau = tuple(tau.tolist())
        self.plant.answer(self._tau)
        self.plant.advance()

    def _stabilised(self) -> list[float]:
        """Input of the pilot, and what the modes other than MANUAL add to it."""
        inputs, x = [float(pulse) for pulse in self.channels], self.plant.x
        if self.mode == MANUAL:
            return inputs
        roll, pitch, _ = euler(x[3:7])
        inputs[0] -= 400 * (LEVEL * pitch + STILL * x[11])
        inputs[1] -= 400 * (LEVEL * roll + STILL * x[10])
        if self.mode == ALT_HOLD:  # throttle up, depth down
            inputs[2] += 400 * (DEPTH * (x[2] - self._depth) + SINK * x[9])
        return inputs

    def _watch_pilot(self, now: int) -> None:
        """Pilot-input failsafe; before 4.5 overrides are no input, and without any it is asleep."""
        timeout = self.parameters['FS_PILOT_TIMEOUT'] * SECOND
        action = self.parameters['FS_PILOT_INPUT']
        lost = self._pilot_heard is not None and now - self._pilot_heard >= timeout and action > 0
        if lost and not self._pilot_lost:
            self._say('Lost manual control')
            self._override = [MIDDLE] * 6
            self.armed = self.armed and action != 2.0
        self._pilot_lost = lost

    def _watch_station(self, now: int) -> None:
        heard, action = self._station_heard, self.parameters['FS_GCS_ENABLE']
        timeout = self.parameters.get('FS_GCS_TIMEOUT', GCS_TIMEOUT) * SECOND
        if self.armed and action == 2.0 and heard is not None and now - heard >= timeout:
            self._say(f'MYGCS: {GROUND_STATION}, heartbeat lost')
            self.armed = False

    def _say(self, text: str) -> None:
        self._send(mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_CRITICAL, text.encode()))

    def _heartbeat(self, message: Any, now: int) -> None:
        if message.get_srcSystem() == GROUND_STATION:
            self._station_heard = now

    def _timesync(self, message: Any, now: int) -> None:
        if message.tc1 == 0:
            self._send(mavlink.MAVLink_timesync_message(now, message.ts1))

    def _command(self, message: Any, now: int) -> None:
        number, first = message.command, int(message.param1)
        result = UNSUPPORTED
        if number == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            result = self.arm(first == 1, now)
        elif number == mavlink.MAV_CMD_DO_SET_MODE:
            result = self.set_mode(int(message.param2))
        elif number == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            known = first in self._intervals or any(first in ids for ids in STREAMS.values())
            known = known and first != NAMED
            result = ACCEPTED if known else FAILED
            if known:
                self._intervals[first] = int(message.param2) * 1000
        elif (number, first) == (mavlink.MAV_CMD_REQUEST_MESSAGE, 148):
            result, version = ACCEPTED, int.from_bytes((*self._settings.version, 255), 'big')
            self._send(
                mavlink.MAVLink_autopilot_version_message(
                    0, version, 0, 0, 0, *[[0] * 8] * 3, 0, 0, 0
                )
            )
        self._send(mavlink.MAVLink_command_ack_message(number, result))

    def _stream(self, message: Any, _: int) -> None:
        for message_id in STREAMS.get(message.req_stream_id, ()):
            self._intervals[message_id] = SECOND // max(1, message.req_message_rate)

    def _parameter(self, message: Any, _: int) -> None:
        value = self.parameters.get(message.param_id)
        if value is not None:
            name, kind = message.param_id.encode(), mavlink.MAV_PARAM_TYPE_REAL32
            self._send(mavlink.MAVLink_param_value_message(name, value, kind, 900, 65535))

    def _take_override(self, message: Any, now: int) -> None:
        if message.get_srcSystem() != GROUND_STATION:
            return
        self._station_heard = now
        for i in range(6):
            pulse = getattr(message, f'chan{i + 1}_raw')
            if pulse not in SEPARATE:
                self._override[i] = pulse
        if self._settings.version >= SEES_OVERRIDES:
            self._pilot_heard = now

    def _manual_control(self, message: Any, now: int) -> None:
        if message.get_srcSystem() != GROUND_STATION:
            return
        sideways = 0.4 * self._settings.gain
        up = 2.0 * sideways * self.parameters['JS_THR_GAIN']
        pulses = (message.z * up + int(MIDDLE - 500 * up), *(
            axis * sideways + MIDDLE for axis in (message.r, message.x, message.y)
        ))  # fmt: skip
        self._override = [MIDDLE, MIDDLE, *(min(1900, max(1100, int(pulse))) for pulse in pulses)]
        self._pilot_heard = self._station_heard = now

    def _report(self, message_id: int, now: int) -> None:
        """Send one of the messages that are sent by themselves."""
        ms = self.plant.k * STEP // 1_000_000
        x, m = self.plant.x, mavlink
        if message_id == m.MAVLINK_MSG_ID_HEARTBEAT:
            flags = m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | m.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
            flags |= m.MAV_MODE_FLAG_SAFETY_ARMED * self.armed
            state = m.MAV_STATE_ACTIVE if self.armed else m.MAV_STATE_STANDBY
            kind = m.MAV_TYPE_SUBMARINE, m.MAV_AUTOPILOT_ARDUPILOTMEGA
            self._send(m.MAVLink_heartbeat_message(*kind, flags, self.mode, state, 3))
        elif message_id == NAMED:
            gain = self._settings.gain
            self._send(m.MAVLink_named_value_float_message(ms, b'PilotGain', gain))
        elif message_id == m.MAVLINK_MSG_ID_ATTITUDE:
            self._send(m.MAVLink_attitude_message(ms, *euler(x[3:7]), *x[10:]))
        elif message_id == m.MAVLINK_MSG_ID_LOCAL_POSITION_NED:
            if now >= self._settings.position_after * SECOND:
                v = rotation(x[3:7]) @ (x[7:10] + self._settings.velocity_bias)
                self._send(m.MAVLink_local_position_ned_message(ms, *x[:3], *v))
        elif message_id == m.MAVLINK_MSG_ID_SYS_STATUS:
            voltage = round(1000 * self._settings.voltage)
            self._send(m.MAVLink_sys_status_message(0, 0, 0, 0, voltage, -1, -1, *[0] * 6))
        elif message_id == m.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW:
            outputs = [*self.pulses, 0, 0][:8]
            self._send(m.MAVLink_servo_output_raw_message(ms * 1000 % 2**32, 0, *outputs))
        elif message_id == m.MAVLINK_MSG_ID_RC_CHANNELS:
            channels = [*self.channels, *[0] * 12]
            self._send(m.MAVLink_rc_channels_message(ms, 16, *channels, 0))
