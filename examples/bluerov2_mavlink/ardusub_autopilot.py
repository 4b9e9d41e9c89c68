"""An autopilot that behaves like ArduSub towards its ground station, with a simulated vehicle.

What it knows: HEARTBEAT, TIMESYNC, arming, modes, message intervals, RC_CHANNELS_OVERRIDE,
MANUAL_CONTROL, the pilot-input and ground-station failsafes with their defaults. In MANUAL the
pilot's input goes to the motors; in every other mode the motors stand still here.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from ardusub_mixer import MIDDLE, motor_pulses, thrust
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from auv_dynamics import load_vehicle
from auv_dynamics.plant.plant import Plant, initial_state
from auv_dynamics.plant.uncertainty import make_uncertainty
from auv_dynamics.vehicle.kinematics import rotation

STEP = 5_000_000  # ns of the simulation
SECOND = 1_000_000_000
MODES = {0: 'STABILIZE', 2: 'ALT_HOLD', 19: 'MANUAL'}
MANUAL = 19
GROUND_STATION = 255  # SYSID_MYGCS
PILOT_TIMEOUT = GCS_TIMEOUT = 3 * SECOND  # FS_PILOT_TIMEOUT, FS_GCS_TIMEOUT; both then disarm
SEPARATE = (0, 65535)  # of an override: released, left as it is
ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED


@dataclass(frozen=True)
class Settings:
    """What is simulated.

    Attributes
    ----------
    vehicle : vehicle file, or bare name
    eta, nu : start, (6,) each
    curve : of the thrusters, 'square' or 'measured'
    voltage : of the supply, V
    gain : pilot gain, JS_GAIN_DEFAULT
    mode : at boot

    """

    vehicle: str = 'bluerov2_heavy'
    eta: tuple = (0.0,) * 6
    nu: tuple = (0.0,) * 6
    curve: str = 'square'
    voltage: float = 16.0
    gain: float = 0.5
    mode: int = MANUAL


class Autopilot:
    """One boot of the autopilot; `now` of its methods is ns since then.

    Parameters
    ----------
    settings : Settings
    send : takes a message

    """

    def __init__(self, settings: Settings, send: Callable[[Any], None]):
        vehicle = load_vehicle(settings.vehicle)
        assert vehicle.thrusters is not None
        self._settings, self._send, self._T = settings, send, vehicle.thrusters.matrix
        truth = make_uncertainty(vehicle, [], settings.vehicle, [])
        start = initial_state(np.array(settings.eta), np.array(settings.nu))
        self.plant = Plant(truth, STEP / SECOND, 'rk4', start)
        self.armed, self.mode = False, settings.mode
        self._channels = [MIDDLE] * 6
        self.pulses = [MIDDLE] * self._T.shape[1]
        self._pilot_heard = self._station_heard = 0
        self._intervals: dict[int, int] = {mavlink.MAVLINK_MSG_ID_HEARTBEAT: SECOND}
        self._due: dict[int, int] = {}
        self._takers: dict[str, Callable[[Any, int], Any]] = {
            'HEARTBEAT': self._heartbeat,
            'TIMESYNC': self._timesync,
            'COMMAND_LONG': self._command,
            'SET_MODE': lambda m, _: self._set_mode(m.custom_mode),
            'RC_CHANNELS_OVERRIDE': self._override,
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
        self._watch(now)
        for message_id, interval in self._intervals.items():
            if now >= self._due.get(message_id, 0):
                self._due[message_id] = max(now, self._due.get(message_id, now) + interval)
                self._report(message_id)

    def _move(self) -> None:
        drives = self.armed and self.mode == MANUAL
        motors = len(self.pulses)
        self.pulses = motor_pulses(self._channels if drives else [MIDDLE] * 6, motors)
        tau = self._T @ thrust(self.pulses, self._settings.curve, self._settings.voltage)
        self.plant.answer(tuple(tau.tolist()))
        self.plant.advance()

    def _watch(self, now: int) -> None:
        if not self.armed:
            return
        for heard, timeout, text in (
            (self._pilot_heard, PILOT_TIMEOUT, 'Lost manual control'),
            (self._station_heard, GCS_TIMEOUT, 'MYGCS: 255, heartbeat lost'),
        ):
            if now - heard >= timeout:
                self._say(text)
                self._channels = [MIDDLE] * 6
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
        number, first = message.command, message.param1
        result = mavlink.MAV_RESULT_UNSUPPORTED
        if number == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            result, self.armed = ACCEPTED, first == 1.0
            self._pilot_heard = now
        elif number == mavlink.MAV_CMD_DO_SET_MODE:
            result = self._set_mode(int(message.param2))
        elif number == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            result, self._intervals[int(first)] = ACCEPTED, int(message.param2) * 1000
        self._send(mavlink.MAVLink_command_ack_message(number, result))

    def _set_mode(self, mode: int) -> int:
        if mode not in MODES:
            return DENIED
        if mode != self.mode:
            self._channels = [MIDDLE] * 6
        self.mode = mode
        return ACCEPTED

    def _override(self, message: Any, now: int) -> None:
        if message.get_srcSystem() != GROUND_STATION:
            return
        for i in range(6):
            pulse = getattr(message, f'chan{i + 1}_raw')
            if pulse not in SEPARATE:
                self._channels[i] = pulse
        self._pilot_heard = now

    def _manual_control(self, message: Any, now: int) -> None:
        if message.get_srcSystem() != GROUND_STATION:
            return
        gain = self._settings.gain
        sideways, up = 0.4 * gain, 0.8 * gain
        pulses = (message.z * up + MIDDLE - 500 * up, *(
            axis * sideways + MIDDLE for axis in (message.r, message.x, message.y)
        ))  # fmt: skip
        self._channels = [MIDDLE, MIDDLE, *(min(1900, max(1100, int(pulse))) for pulse in pulses)]
        self._pilot_heard = now

    def _report(self, message_id: int) -> None:
        """Send one of the messages that are sent by themselves."""
        ms = self.plant.k * STEP // 1_000_000
        x, m = self.plant.x, mavlink
        if message_id == m.MAVLINK_MSG_ID_HEARTBEAT:
            flags = m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | m.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
            flags |= m.MAV_MODE_FLAG_SAFETY_ARMED * self.armed
            state = m.MAV_STATE_ACTIVE if self.armed else m.MAV_STATE_STANDBY
            kind = m.MAV_TYPE_SUBMARINE, m.MAV_AUTOPILOT_ARDUPILOTMEGA
            self._send(m.MAVLink_heartbeat_message(*kind, flags, self.mode, state, 3))
            gain = self._settings.gain
            self._send(m.MAVLink_named_value_float_message(ms, b'PilotGain', gain))
        elif message_id == m.MAVLINK_MSG_ID_ATTITUDE_QUATERNION:
            self._send(m.MAVLink_attitude_quaternion_message(ms, *x[3:7], *x[10:]))
        elif message_id == m.MAVLINK_MSG_ID_LOCAL_POSITION_NED:
            v = rotation(x[3:7]) @ x[7:10]
            self._send(m.MAVLink_local_position_ned_message(ms, *x[:3], *v))
        elif message_id == m.MAVLINK_MSG_ID_SYS_STATUS:
            voltage = round(1000 * self._settings.voltage)
            self._send(m.MAVLink_sys_status_message(0, 0, 0, 0, voltage, -1, -1, *[0] * 6))
        elif message_id == m.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW:
            outputs = [*self.pulses, 0, 0][:8]
            self._send(m.MAVLink_servo_output_raw_message(ms * 1000 % 2**32, 0, *outputs))
