"""Logs of ArduPilot as tests write them: .tlog by pymavlink, .BIN record by record."""

import struct
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pymavlink.DFReader import FORMAT_TO_STRUCT
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from auv_analysis.runs.run import Run
from auv_dynamics.vehicle.thruster_curves import load_curve
from auv_dynamics.vehicle.vehicle import Vehicle

EPOCH = 1_700_000_000_000_000  # us
BOOT = 40_000  # ms on the autopilot's clock when a run begins
DEGREES = 180.0 / np.pi
VEHICLE, GROUND = (1, 1), (255, 190)
Sent = tuple[int, tuple[int, int], Any]  # us since 1970, sender, message


def write_tlog(path: Path, sent: Iterable[Sent], version: int = 2, *, signed: bool = False) -> Path:
    """Write messages as a ground station does, in their order, by a version of MAVLink."""
    writers: dict[tuple[int, int], Any] = {}
    with path.open('wb') as file:
        for time, sender, message in sent:
            writer = writers.setdefault(sender, mavlink.MAVLink(None, *sender))
            if signed:
                writer.signing.secret_key, writer.signing.sign_outgoing = b'x' * 32, True
                writer.signing.timestamp = 1
            packed = message.pack(writer, force_mavlink1=version == 1)
            file.write(struct.pack('>Q', time) + packed)
            writer.seq = (writer.seq + 1) % 256
    return path


def heartbeat(autopilot: int = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA) -> Any:
    """Who somebody is: a submarine of ArduPilot, or a ground station."""
    kind = mavlink.MAV_TYPE_SUBMARINE if autopilot != 8 else mavlink.MAV_TYPE_GCS
    return mavlink.MAVLink_heartbeat_message(kind, autopilot, 81, 19, 4, 3)


def parameter(name: str, value: float) -> Any:
    return mavlink.MAVLink_param_value_message(name.encode(), value, 9, 1, 0)


def pulses(run: Run, vehicle: Vehicle, curve: str, mirrored: Any = False) -> np.ndarray:
    """Pulse widths (n, thrusters) in whole us of the wrench of a run."""
    assert vehicle.thrusters is not None
    u = run.tau @ vehicle.thrusters.inverse.T
    return np.rint(load_curve(curve).command(u, mirrored)).astype(int)


def world_velocity(run: Run) -> np.ndarray:
    """Velocity (n, 3) in NED, m/s."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_euler('ZYX', run.eta[:, [5, 4, 3]]).apply(run.nu[:, :3])


def telemetry(run: Run, pulses: np.ndarray, every: int = 1, servos_every: int = 1) -> list[Sent]:
    """What a ground station hears of a run: every so many samples attitude and servo outputs."""
    sent: list[Sent] = [
        (EPOCH, GROUND, heartbeat(8)), (EPOCH, VEHICLE, heartbeat()),
        *((EPOCH, VEHICLE, parameter(f'MOT_{i}_DIRECTION', 1.0)) for i in range(1, 9)),
    ]  # fmt: skip
    velocity = world_velocity(run)
    for i in range(0, run.samples, every):
        ms = BOOT + round(run.t[i] * 1e3)
        time = EPOCH + round(run.t[i] * 1e6) + 3000 + 100 * (i % 7)  # it arrives later
        x, y, z, *angles = run.eta[i]
        attitude = mavlink.MAVLink_attitude_message(ms, *angles, *run.nu[i, 3:])
        position = mavlink.MAVLink_local_position_ned_message(ms, x, y, z, *velocity[i])
        sent += [(time, VEHICLE, attitude), (time, VEHICLE, position)]
        if i % (every * servos_every) == 0:
            values = [*pulses[i].tolist(), 0, 0, 0, 0, 0, 0, 0, 0]
            us = (ms * 1000) % 2**32
            servos = mavlink.MAVLink_servo_output_raw_message(us, 0, *values)
            sent += [(time, GROUND, heartbeat(8)), (time, VEHICLE, servos)]
    return sent


FMT = (0x80, 'FMT', 'BBnNZ', 'Type,Length,Name,Format,Columns')
FMTU = (0x81, 'FMTU', 'QBNN', 'TimeUS,FmtType,UnitIds,MultIds')
PARM = (0x82, 'PARM', 'QNf', 'TimeUS,Name,Value')
ATT = (0x83, 'ATT', 'QffffffB', 'TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF')
RATE = (0x84, 'RATE', 'Qffffff', 'TimeUS,RDes,R,PDes,P,YDes,Y')
XKF1 = (
    0x85, 'XKF1', 'QBccCfffffffccce',
    'TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH',
)  # fmt: skip
RCOU = (0x87, 'RCOU', 'QHHHHHHHH', 'TimeUS,C1,C2,C3,C4,C5,C6,C7,C8')
GPS = (0x88, 'GPS', 'QIHL', 'TimeUS,GMS,GWk,Lat')
TYPES = (FMT, FMTU, PARM, ATT, RATE, XKF1, RCOU, GPS)
Type = tuple[int, str, str, str]


def packing(codes: str) -> struct.Struct:
    return struct.Struct('<' + ''.join(FORMAT_TO_STRUCT[code][0] for code in codes))


def record(kind: Type, *values: Any) -> bytes:
    """A record of a .BIN."""
    written = [value.encode() if isinstance(value, str) else value for value in values]
    return b'\xa3\x95' + bytes([kind[0]]) + packing(kind[2]).pack(*written)


def definitions(types: Sequence[Type] = TYPES, instances: Mapping[str, str] | None = None) -> bytes:
    """FMT of every type, and FMTU of those with instances: name -> units."""
    formats = [
        record(FMT, number, packing(codes).size + 3, name, codes, columns)
        for number, name, codes, columns in types
    ]
    told = {'XKF1': 's#'} if instances is None else instances
    numbers = {name: number for number, name, *_ in types}
    units = [record(FMTU, 0, numbers[name], text, '') for name, text in told.items()]
    return b''.join(formats + units)


def onboard(run: Run, pulses: np.ndarray, every: int = 1) -> bytes:
    """What the autopilot writes of a run; a second core of the estimator is wrong by 0.1 m/s."""
    written = [
        definitions(),
        *(record(PARM, BOOT * 1000, f'MOT_{i}_DIRECTION', 1.0) for i in range(1, 9)),
    ]
    velocity = world_velocity(run)
    for i in range(0, run.samples, every):
        us = BOOT * 1000 + round(run.t[i] * 1e6)
        roll, pitch, yaw = (run.eta[i, 3:] * DEGREES).tolist()
        yaw %= 360.0
        turned = [round(100 * angle) for angle in (roll, pitch, yaw)]
        p, q, r = (run.nu[i, 3:] * DEGREES).tolist()
        x, y, z = run.eta[i, :3].tolist()
        written += [
            record(ATT, us, 0, roll, 0, pitch, 0, yaw, 3),
            record(RATE, us, 0, p, 0, q, 0, r),
            record(XKF1, us, 0, *turned, *velocity[i], 0, x, y, z, 0, 0, 0, 0),
            record(XKF1, us, 1, *turned, *(velocity[i] + 0.1), 0, x, y, z, 0, 0, 0, 0),
            record(RCOU, us, *pulses[i].tolist()),
        ]  # fmt: skip
    return b''.join(written)
