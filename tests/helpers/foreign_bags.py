"""Bags in the layout of other systems: rosbags writes them, SciPy turns their axes."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from auv_analysis import load_scenario, simulate
from auv_analysis.bag.foreign_run import load_foreign
from auv_analysis.bag.foreign_topics import read_mapping
from auv_analysis.runs.run import Run

SECOND = 10**9
ROS2, ROS1 = get_typestore(Stores.ROS2_HUMBLE), get_typestore(Stores.ROS1_NOETIC)
EARTH = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]])  # NED to ENU
BODY = Rotation.from_matrix([[1, 0, 0], [0, -1, 0], [0, 0, -1]])  # FSD to FLU
ODOMETRY = 'nav_msgs/msg/Odometry'
MADE = 'geometry_msgs/msg/'
Message = tuple[str, int, Any]  # topic, time of logging in ns, message


TURNED = {'eta': [1.0, -2.0, 3.0, 0.4, -0.5, 2.5], 'nu': [0.4, -0.3, 0.2, 0.1, -0.2, 0.3]}
NAMED = 'world_ned', 'base_link_fsd'
UNNAMED = 'odom', 'base_link'


def simulated(name: str = 'case1_rexrov', duration: float = 4.0, **entries: Any) -> Run:
    """A run whose truth is known, far from level at its start."""
    scenario = load_scenario(name)
    data = scenario.data | {'duration': duration, 'initial': TURNED} | entries
    return simulate(replace(scenario, data=data), 'gvc', 'zoh')


def loaded(bag: Path, file: Path | None = None, **options: Any) -> Run:
    """Run of a bag, mapped by keys of a mapping file."""
    usual = {'vehicle': 'rexrov'} if file is None else {}
    return load_foreign(bag, read_mapping(file, usual | options)).run


class Motion(NamedTuple):
    """What a vehicle does, in the axes and frame that a bag has: rows per sample."""

    t: np.ndarray
    position: np.ndarray
    attitude: np.ndarray  # quaternions x y z w
    twist: np.ndarray
    tau: np.ndarray
    nu_d: np.ndarray


def motion(run: Run, *, enu: bool, world: bool = False, keep: Any = slice(None)) -> Motion:
    """A run as another system sees it; `world`: the twist in earth axes."""
    part = run.part(keep)
    turned = Rotation.from_euler('ZYX', part.eta[:, [5, 4, 3]])
    earth, body = (EARTH, BODY) if enu else (Rotation.identity(), Rotation.identity())
    attitude = earth * turned * body
    twist, tau, nu_d = (_halves(body, rows) for rows in (part.nu, part.tau, part.nu_d))
    twist = _halves(attitude, twist) if world else twist
    return Motion(part.t, earth.apply(part.eta[:, :3]), attitude.as_quat(), twist, tau, nu_d)


def _halves(rotation: Rotation, rows: np.ndarray) -> np.ndarray:
    return np.concatenate([rotation.apply(rows[:, :3]), rotation.apply(rows[:, 3:])], axis=1)


class Maker:
    """Makes messages of one generation of ROS."""

    def __init__(self, *, ros1: bool = False):
        self.store = ROS1 if ros1 else ROS2
        self.ros1 = ros1

    def new(self, kind: str, *values: Any) -> Any:
        return self.store.types[kind](*values)

    def geometry(self, name: str, *values: Any) -> Any:
        return self.new(f'{MADE}{name}', *values)

    def header(self, ns: int, frame: str) -> Any:
        time = self.new('builtin_interfaces/msg/Time', *divmod(int(ns), SECOND))
        return self.new('std_msgs/msg/Header', *([0] if self.ros1 else []), time, frame)

    def pose(self, position: Any, q: Any) -> Any:
        return self.geometry('Pose', self.geometry('Point', *position),
                             self.geometry('Quaternion', *q))  # fmt: skip

    def six(self, name: str, row: Any) -> Any:
        """Twist or Wrench."""
        return self.geometry(
            name, *(self.geometry('Vector3', *half) for half in (row[:3], row[3:]))
        )

    def stamped(self, name: str, ns: int, frame: str, value: Any) -> Any:
        return self.geometry(f'{name}Stamped', self.header(ns, frame), value)

    def covariant(self, name: str, value: Any) -> Any:
        return self.geometry(f'{name}WithCovariance', value, np.zeros(36))

    def odometry(self, ns: int, frames: tuple[str, str], m: Motion, i: int) -> Any:
        pose = self.covariant('Pose', self.pose(m.position[i], m.attitude[i]))
        twist = self.covariant('Twist', self.six('Twist', m.twist[i]))
        return self.new(ODOMETRY, self.header(ns, frames[0]), frames[1], pose, twist)


def nanoseconds(t: np.ndarray, epoch: int = 1_700_000_000) -> np.ndarray:
    """Stamps of times in s, since an epoch in s."""
    return np.round(t * SECOND).astype(np.int64) + epoch * SECOND


def write(path: Path, messages: Iterable[Message], maker: Maker, *, kind: str = 'mcap') -> Path:
    """Write a bag: 'mcap' or 'sqlite3' folder, or a ROS 1 'bag' file; in the order of logging."""
    path.parent.mkdir(parents=True, exist_ok=True)
    listed = sorted(messages, key=lambda message: message[1])
    if kind == 'bag':
        path = path.with_suffix('.bag')
        return written(path, Writer1(path), listed, maker.store.serialize_ros1, maker)
    plugin = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}[kind]
    writer = Writer2(path, version=8, storage_plugin=plugin)
    return written(path, writer, listed, maker.store.serialize_cdr, maker)


def written(
    path: Path, writer: Any, messages: list[Message], serialize: Callable, maker: Maker
) -> Path:
    """Write messages in their order."""
    connections: dict[str, Any] = {}
    with writer:
        for topic, log, message in messages:
            name = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=maker.store)
            writer.write(connections[topic], int(log), serialize(message, name))
    return path


def write_chunks(path: Path, messages: Iterable[Message], maker: Maker) -> Path:
    """Write an MCAP file of small chunks by the writer of the mcap package."""
    writer, channels = McapWriter(str(path), chunk_size=8192), {}
    version, language = (1, 'ros1msg') if maker.ros1 else (2, 'ros2msg')
    encoding = 'ros1' if maker.ros1 else 'cdr'
    serialize = maker.store.serialize_ros1 if maker.ros1 else maker.store.serialize_cdr
    writer.start(profile=f'ros{version}', library='test')
    for topic, log, message in sorted(messages, key=lambda message: message[1]):
        name = message.__msgtype__
        if topic not in channels:
            text = maker.store.generate_msgdef(name, ros_version=version)[0].encode()
            written = name.replace('/msg/', '/') if maker.ros1 else name
            schema = writer.register_schema(written, language, text)
            channels[topic] = writer.register_channel(topic, encoding, schema)
        writer.add_message(channels[topic], log, bytes(serialize(message, name)), log)
    writer.finish()
    return path


def simple(m: Motion, maker: Maker, odom: str, wrench: str, frames: tuple[str, str],
           tau: Motion | None = None) -> list[Message]:  # fmt: skip
    """Odometry and WrenchStamped, logged 2 ms after their stamps."""
    forces = m if tau is None else tau
    found: list[Message] = []
    for i, ns in enumerate(nanoseconds(m.t).tolist()):
        found.append((odom, ns + 2_000_000, maker.odometry(ns, frames, m, i)))
    for i, ns in enumerate(nanoseconds(forces.t).tolist()):
        value = maker.six('Wrench', forces.tau[i])
        found.append((wrench, ns + 2_000_000, maker.stamped('Wrench', ns, frames[1], value)))
    return found
