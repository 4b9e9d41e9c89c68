"""Logs of systems that nobody knows: sensors of their own message types, tables of numbers."""

import io
from pathlib import Path
from typing import Any

import numpy as np
from helpers.foreign_bags import Maker, Message, Motion, motion, nanoseconds
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from scipy.spatial.transform import Rotation

from auv_analysis.runs.run import Run

HEAD = ['t [ms]', 'x', 'y', 'z', 'roll', 'pitch', 'yaw', *'uvwpqrXYZKMN']
HEADS = {  # how such files begin: text before the numbers, separator, line ends
    'plain': (','.join(HEAD) + '\n', ',', '\n'),
    'semicolons': ('﻿' + ';'.join(HEAD) + '\r\n', ';', '\r\n'),
    'tabs and comments': ('# dive 7, tank\n\n' + '\t'.join(HEAD) + '\n', '\t', '\n'),
    'units below': (','.join(HEAD) + '\n' + ','.join(['ms', *['m'] * 18]) + '\n', ',', '\n'),
    'names in a comment': ('# made by savetxt\n# ' + ','.join(HEAD) + '\n', ',', '\n'),
    'separators at the end': (', '.join(HEAD) + ',\n', ',', ',\n'),
}
TYPES = {
    'rov_msgs/msg/Dvl': 'std_msgs/Header header\ngeometry_msgs/Vector3 velocity\nstring mode\n',
    'rov_msgs/msg/Tilt': 'uint64 time_us\nfloat64[] deg\n',
    'rov_msgs/msg/Depth': 'std_msgs/Header header\nfloat64 depth_mm\n',
    'rov_msgs/msg/Motor': 'float64 thrust\n',
    'rov_msgs/msg/Motors': 'std_msgs/Header header\nrov_msgs/Motor[] motors\n',
    'rov_msgs/msg/Force': 'std_msgs/Header header\nfloat64[6] data\n',
}
IMU = 'sensor_msgs/msg/Imu'
SENSORS: dict[str, Any] = {  # mapping of what `every` writes
    'frames': 'ned_fsd',
    'pose': [
        {'topic': '/tilt', 'stamp': {'field': 'time_us', 'units': 'us'}, 'units': 'deg',
         'fields': {'phi': 'deg[0]', 'theta': 'deg[1]', 'psi': '-deg[2]'}},
        {'topic': '/depth', 'fields': {'z': 'depth_mm'}, 'units': 'mm'},
        {'topic': '/fix', 'fields': {'x': 'point.x', 'y': 'point.y'}, 'frames': 'enu_flu'},
    ],
    'twist': [
        {'topic': '/dvl', 'fields': {'u': 'velocity.x', 'v': '-velocity.y', 'w': '-velocity.z'}},
        {'topic': '/imu', 'units': 'deg/s', 'frames': 'enu_flu'},
    ],
    'wrench': {'topic': '/force', 'units': {'X': 'kN', 'Y': 1e3, 'Z': 1e3},
               'fields': {c: f'data[{i}]' for i, c in enumerate('XYZKMN')}},
    'vehicle': 'rexrov', 'step': 0.01,
}  # fmt: skip


def maker(*, ros1: bool = False) -> Maker:
    """One that knows types that nobody else has."""
    made = Maker(ros1=ros1)
    made.store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    for name, text in TYPES.items():
        made.store.register(get_types_from_msg(text, name))
    return made


def every(run: Run, make: Maker, apart: dict[str, int] | None = None) -> list[Message]:
    """The sensors of a run: tilt in degrees without header, a DVL in FLU, an Imu with stamps of
    zero and rates in degrees, depth in mm, position in ENU, forces in kN.

    `apart` says which topics have only every so manieth message.
    """  # fmt: skip
    ned, enu = motion(run, enu=False), motion(run, enu=True)
    angles = np.degrees(Rotation.from_quat(ned.attitude).as_euler('ZYX')[:, ::-1]) * [1, 1, -1]
    found: list[Message] = []
    for i, ns in enumerate(nanoseconds(run.t).tolist()):
        header = make.header(ns, '')
        x, y, z = enu.position[i]
        found += [
            ('/tilt', ns, make.new('rov_msgs/msg/Tilt', ns // 1000, angles[i])),
            ('/depth', ns, make.new('rov_msgs/msg/Depth', header, -1e3 * z)),
            ('/fix', ns, make.geometry('PointStamped', header, make.geometry('Point', x, y, 0.0))),
            ('/dvl', ns, make.new('rov_msgs/msg/Dvl', header,
                                  make.geometry('Vector3', *enu.twist[i, :3]), 'bottom')),
            ('/imu', ns, imu(make, enu, i)),
            ('/force', ns, make.new('rov_msgs/msg/Force', header,
                                    ned.tau[i] * [1e-3, 1e-3, 1e-3, 1, 1, 1])),
        ]  # fmt: skip
    return [entry for k, entry in enumerate(found) if k // 6 % (apart or {}).get(entry[0], 1) == 0]


def imu(make: Maker, m: Motion, i: int) -> Any:
    """A real one: stamps of zero, degrees per second."""
    rates = make.geometry('Vector3', *np.degrees(m.twist[i, 3:]))
    none, zeros = make.geometry('Vector3', 0.0, 0.0, 0.0), np.zeros(9)
    turned = make.geometry('Quaternion', *m.attitude[i])
    return make.new(IMU, make.header(0, 'imu_link'), turned, zeros, rates, zeros, none, zeros)


def columns(run: Run) -> np.ndarray:
    m = motion(run, enu=False)
    angles = np.degrees(Rotation.from_quat(m.attitude).as_euler('ZYX')[:, ::-1])
    return np.column_stack([1e3 * run.t + 5e3, m.position, angles, run.nu, run.tau])


STATE = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw', *'uvwpqr')
TABLES: dict[str, Any] = {  # mapping of what `tables` writes
    'frames': 'ned_fsd', 'stamp': 't',
    'odometry': {'topic': 'motion', 'fields': {name: name for name in STATE}},
    'wrench': {'topic': 'force', 'fields': {name: name for name in 'XYZKMN'}},
}  # fmt: skip


def tables(folder: Path, seen: Motion, forces: Motion) -> Path:
    """Motion and wrench as two tables: they take a fifth of the time of messages."""
    folder.mkdir(parents=True)
    for name, head, rows in (
        ('motion', STATE, (seen.position, seen.attitude, seen.twist)),
        ('force', 'XYZKMN', (forces.tau,)),
    ):
        t = (seen if name == 'motion' else forces).t
        text = text_of(np.column_stack([t, *rows]))
        (folder / f'{name}.csv').write_text(f'{",".join(("t", *head))}\n{text}')
    return folder


def text_of(rows: np.ndarray, separator: str = ',', end: str = '\n') -> str:
    stream = io.StringIO()
    np.savetxt(stream, rows, fmt='%.17g', delimiter=separator, newline=end)
    return stream.getvalue()
