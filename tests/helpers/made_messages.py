"""Messages and bags as other libraries write them, without ROS: rosbags serializes, mcap writes."""

from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.typesys import Stores, get_typestore

TYPES = get_typestore(Stores.ROS2_JAZZY)
COMPRESSIONS = {
    'none': CompressionType.NONE, 'lz4': CompressionType.LZ4, 'zstd': CompressionType.ZSTD,
}  # fmt: skip
ODOMETRY = 'nav_msgs/msg/Odometry'
STRING = 'std_msgs/msg/String'
FRAMES = 'odom_ned', 'base_link_fsd'
SECOND = 10**9


def new(kind: str, *values: Any) -> Any:
    return TYPES.types[kind](*values)


def geometry(name: str, *values: Any) -> Any:
    return new(f'geometry_msgs/msg/{name}', *values)


def header(ns: int, frame: str) -> Any:
    return new(
        'std_msgs/msg/Header', new('builtin_interfaces/msg/Time', *divmod(ns, SECOND)), frame
    )


def odometry(ns: int, row: Any, frames: tuple[str, str] = FRAMES) -> Any:
    """Odometry of a row (13,): position, quaternion w x y z, velocity."""
    p, (w, x, y, z), nu = row[:3], row[3:7], row[7:]
    pose = geometry('Pose', geometry('Point', *p), geometry('Quaternion', x, y, z, w))
    twist = geometry('Twist', geometry('Vector3', *nu[:3]), geometry('Vector3', *nu[3:]))
    parts = [
        geometry(f'{what}WithCovariance', value, np.arange(36.0))
        for what, value in (('Pose', pose), ('Twist', twist))
    ]
    return new(ODOMETRY, header(ns, frames[0]), frames[1], *parts)


def stamped(name: str, ns: int, row: Any, frame: str = FRAMES[1]) -> Any:
    """TwistStamped, AccelStamped or WrenchStamped of a row (6,)."""
    halves = geometry('Vector3', *row[:3]), geometry('Vector3', *row[3:])
    return geometry(f'{name}Stamped', header(ns, frame), geometry(name, *halves))


def health(node: str, ns: int, facts: dict[str, str]) -> Any:
    """What a node says of itself."""
    pairs = [new('diagnostic_msgs/msg/KeyValue', *fact) for fact in facts.items()]
    status = new('diagnostic_msgs/msg/DiagnosticStatus', 0, node, 'ok', 'auv', pairs)
    return new('diagnostic_msgs/msg/DiagnosticArray', header(ns, FRAMES[1]), [status])


def serialized(message: Any, *, little: bool = True) -> bytes:
    return bytes(TYPES.serialize_cdr(message, message.__msgtype__, little_endian=little))


class Bag:
    """Writes one MCAP file with the writer of the mcap package."""

    def __init__(self, path: Path, *, index: bool = True, **options: Any):
        path.parent.mkdir(parents=True, exist_ok=True)
        types = IndexType.ALL if index else IndexType.NONE
        self.path, self._channels = path, {}
        self._writer = Writer(str(path), index_types=types, **options)
        self._writer.start(profile='ros2', library='test')

    def channel(self, topic: str, kind: str, *, again: bool = False) -> int:
        """Id of a topic's channel; `again`: of a second one."""
        if (topic, again) not in self._channels:
            text = TYPES.generate_msgdef(kind, ros_version=2)[0].encode()
            schema = self._writer.register_schema(kind, 'ros2msg', text)
            # ids of equal channels are shared, so that a second one has other metadata
            made = self._writer.register_channel(topic, 'cdr', schema, {'again': str(again)})
            self._channels[topic, again] = made
        return self._channels[topic, again]

    def add(self, topic: str, kind: str, ns: int, data: bytes, *, again: bool = False) -> None:
        self._writer.add_message(self.channel(topic, kind, again=again), ns, data, ns)

    def attach(self, name: str, text: str) -> None:
        self._writer.add_attachment(0, 0, name, 'text/plain', text.encode())

    def close(self) -> Path:
        self._writer.finish()
        return self.path
