"""Bags of any length without a node graph: a simulated run, written as the recorder would."""

import struct
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from mcap._chunk_builder import ChunkBuilder
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from rosbags.typesys import Stores, get_typestore

from auv_analysis import load_scenario, simulate
from auv_analysis.bag.metadata import Definition, as_text, metadata, write_metadata
from auv_analysis.bag.output import BagFile, Storage
from auv_analysis.graph.node_parameters import node_parameters, parameter_file
from auv_analysis.runs.run import Run
from auv_analysis.scenario.scenario import Scenario
from auv_dynamics.ros.interface import NANOSECONDS, Frames
from auv_dynamics.vehicle.kinematics import quaternion

TYPES = get_typestore(Stores.ROS2_JAZZY)
FRAMES = Frames()
STAMP = (0x01234567, 0x02345678)  # what a template holds in place of a stamp
NUMBERS = tuple(np.arange(1.0, 14.0))  # and in place of its numbers
BRIEF = 36_000  # steps of a bag of six minutes
HEAD = 31  # bytes of a message's record before the message
ODOMETRY, WRENCH = 'nav_msgs/msg/Odometry', 'geometry_msgs/msg/WrenchStamped'
TWIST, ACCEL = 'geometry_msgs/msg/TwistStamped', 'geometry_msgs/msg/AccelStamped'


def _state(run: Run) -> np.ndarray:
    """Numbers of an odometry (n, 13): position, quaternion x y z w, velocity."""
    w, x, y, z = quaternion(run.eta[:, 3:]).T
    return np.column_stack([run.eta[:, :3], x, y, z, w, run.nu])


COLUMNS: dict[str, tuple[str, Callable[[Run], Any]]] = {  # topic -> type, its numbers
    'odom': (ODOMETRY, _state),
    'twist': (TWIST, lambda run: run.nu),
    'cmd_vel': (TWIST, lambda run: run.nu_d),
    'cmd_accel': (ACCEL, lambda run: run.nu_d_dot),
    'wrench': (WRENCH, lambda run: run.tau),
    'disturbance': (WRENCH, lambda run: run.disturbance),
    'disturbance_estimate': (WRENCH, lambda run: run.disturbance_estimate),
    'clock': ('rosgraph_msgs/msg/Clock', lambda run: run.t[:, None][:, :0]),
}


@cache
def made_bag(steps: int) -> Path:
    """Bag of Case 1 with so many steps, which all benchmarks share; it goes with the process."""
    return make_bag(Path(_folder().name) / str(steps), steps)


@cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix='auv_gvc_bags_')


def make_bag(
    folder: Path, steps: int, scenario: str | Path = 'case1', controller: str = 'gvc', **how: Any
) -> Path:
    """Simulate a scenario for so many steps and write it as a bag.

    Parameters
    ----------
    folder : of the bag
    steps : after the first sample
    scenario, controller : what is simulated, whatever duration it has
    how : `compression`, `chunk_size` of the `Storage`

    Returns
    -------
    folder : the same

    """
    stretched = _stretched(load_scenario(scenario), steps, folder.with_suffix('.yaml'))
    return write_run(simulate(stretched, controller, 'zoh'), stretched, folder, **how)


def write_run(run: Run, scenario: Scenario, folder: Path, **how: Any) -> Path:
    """Write a run as the bag that the node graph would have recorded of its step topics."""
    parameters = node_parameters(scenario, run.controller, bag=folder)
    texts = dict(scenario.attachments) | {'params.yaml': parameter_file(parameters, 'made')}
    folder.mkdir(parents=True)
    storage = Storage(**how)
    file = BagFile(folder / f'{folder.name}_0.mcap', texts, storage)
    definitions = []
    for topic, (kind, _) in COLUMNS.items():
        text = TYPES.generate_msgdef(kind, ros_version=2)[0]
        definitions.append(Definition(f'/{topic}', kind, digest=TYPES.hash_rihs01(kind)))
        file.define(definitions[-1], text)
    ns = np.round(run.t * NANOSECONDS).astype(np.int64)
    steps = max(1, storage.chunk_size // _records(run.part(slice(1)), ns[:1])[0].size)
    for first in range(0, len(ns), steps):
        part = slice(first, first + steps)
        _add_chunk(file, ns[part], *_records(run.part(part), ns[part]))
    file.finish()
    write_metadata(folder, as_text(metadata(definitions, [file.extent])))
    return folder


def _records(run: Run, ns: np.ndarray) -> tuple[np.ndarray, list[int]]:
    """Message records of steps as bytes (n, size), and where each topic's begins."""
    parts: list[np.ndarray] = []
    places = []
    stamps = np.column_stack([ns, ns]).astype('<u8').view(np.uint8)
    for number, (kind, numbers) in enumerate(COLUMNS.values(), 1):
        messages = _serialized(kind, ns, numbers(run))
        head = struct.pack('<BQHI', Opcode.MESSAGE, HEAD - 9 + messages.shape[1], number, 0)
        heads = np.tile(np.frombuffer(head, np.uint8), (len(ns), 1))
        places.append(sum(part.shape[1] for part in parts))
        parts += [heads, stamps, messages]
    return np.concatenate(parts, axis=1), places


class _Steps(ChunkBuilder):
    """Whole steps at once: message after message takes seven times as long."""

    def __init__(self, before: ChunkBuilder, ns: np.ndarray, records: np.ndarray, at: list[int]):
        definitions = before.end()  # schemas and channels, which the first chunk begins with
        self._data = definitions + records.tobytes()
        self.num_messages = records.shape[0] * len(at)
        self.message_start_time, self.message_end_time = int(ns[0]), int(ns[-1])
        starts = len(definitions) + records.shape[1] * np.arange(len(ns))
        self.message_indices: dict[int, Any] = {
            number: _Index(number, np.column_stack([ns, starts + place]))
            for number, place in enumerate(at, 1)
        }

    def end(self) -> bytes:
        """Records of the chunk."""
        return self._data

    def reset(self) -> None:
        """Nothing: it is used once."""


class _Index:
    """Message index of a channel: log times and offsets (n, 2)."""

    def __init__(self, channel: int, entries: np.ndarray):
        self._channel, self._entries = channel, entries

    def write(self, stream: RecordBuilder) -> None:
        """Write all entries at once."""
        stream.start_record(Opcode.MESSAGE_INDEX)
        stream.write2(self._channel)
        stream.write4(16 * len(self._entries))
        stream.write(self._entries.astype('<u8').tobytes())
        stream.finish_record()


def _add_chunk(file: BagFile, ns: np.ndarray, records: np.ndarray, places: list[int]) -> None:
    """Write steps as one chunk, past the public face of `mcap.Writer`."""
    writer = vars(file._writer)  # noqa: SLF001
    builder, statistics = writer['_Writer__chunk_builder'], writer['_Writer__statistics']
    writer['_Writer__chunk_builder'] = _Steps(builder, ns, records, places)
    file.flush()
    writer['_Writer__chunk_builder'] = builder
    for number, topic in enumerate(COLUMNS, 1):
        file.extent.add(f'/{topic}', int(ns[0]), int(ns[-1]), len(ns))
        statistics.channel_message_counts[number] += len(ns)
    statistics.message_count += len(ns) * len(COLUMNS)
    statistics.message_start_time, statistics.message_end_time = file.extent.first, file.extent.last


def _stretched(scenario: Scenario, steps: int, path: Path) -> Scenario:
    data = {**scenario.data, 'duration': steps * scenario.step}
    data['vehicle'] = str(scenario.vehicle_path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump(data), encoding='utf-8')
    return load_scenario(path)


def _serialized(kind: str, ns: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Messages (n, size) of bytes: a template, with stamps and numbers in their places."""
    template, stamp, places = _template(kind)
    messages = np.tile(np.frombuffer(template, np.uint8), (len(ns), 1))
    time = np.stack([ns // NANOSECONDS, ns % NANOSECONDS], axis=1).astype('<u4')
    messages[:, stamp : stamp + 8] = np.ascontiguousarray(time).view(np.uint8)
    for i, place in enumerate(places):
        column = np.ascontiguousarray(numbers[:, i], '<f8')
        messages[:, place : place + 8] = column.view(np.uint8).reshape(-1, 8)
    return messages


@cache
def _template(kind: str) -> tuple[bytes, int, list[int]]:
    """A message as another library serializes it, the place of its stamp and of its numbers."""
    data = bytes(TYPES.serialize_cdr(_numbered(kind), kind))
    found = [data.find(struct.pack('<d', number)) for number in NUMBERS]
    return data, data.index(struct.pack('<II', *STAMP)), [place for place in found if place > 0]


def _numbered(kind: str) -> Any:
    """Message whose numbers but the covariances are those of `NUMBERS`, in their order."""
    package, _, name = kind.split('/')
    time = _new('builtin_interfaces/msg/Time', *STAMP)
    if name == 'Clock':
        return _new(kind, time)
    numbers = iter(NUMBERS)

    def vector(type_name: str, size: int = 3) -> Any:
        return _new(f'geometry_msgs/msg/{type_name}', *(next(numbers) for _ in range(size)))

    header = _new('std_msgs/msg/Header', time, FRAMES.odom if name == 'Odometry' else FRAMES.base)
    if name == 'Odometry':
        pose = _new('geometry_msgs/msg/Pose', vector('Point'), vector('Quaternion', 4))
        twist = _new('geometry_msgs/msg/Twist', vector('Vector3'), vector('Vector3'))
        parts = [
            _new(f'geometry_msgs/msg/{what}WithCovariance', value, np.zeros(36))
            for what, value in (('Pose', pose), ('Twist', twist))
        ]
        return _new(kind, header, FRAMES.base, *parts)
    inner = f'{package}/msg/{name.removesuffix("Stamped")}'
    return _new(kind, header, _new(inner, vector('Vector3'), vector('Vector3')))


def _new(kind: str, *values: Any) -> Any:
    return TYPES.types[kind](*values)
