"""Bags of any length without a node graph: a simulated run, written as the recorder would."""

import struct
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from rosbags.typesys import Stores, get_typestore

from auv_analysis import load_scenario, simulate
from auv_analysis.bag.metadata import Definition
from auv_analysis.bag.output import Storage
from auv_analysis.bag.writer import BagWriter
from auv_analysis.graph.node_parameters import node_parameters, parameter_file
from auv_analysis.runs.run import Run
from auv_analysis.scenario.scenario import Scenario
from auv_dynamics.ros.interface import NANOSECONDS, Frames
from auv_dynamics.vehicle.kinematics import quaternion

TYPES = get_typestore(Stores.ROS2_JAZZY)
FRAMES = Frames()
STAMP = (0x01234567, 0x02345678)  # what a template holds in place of a stamp
NUMBERS = tuple(np.arange(1.0, 14.0))  # and in place of its numbers
BLOCK = 4096  # steps whose messages are prepared together
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


def make_bag(
    folder: Path, steps: int, scenario: str | Path = 'case1', controller: str = 'gvc', **how: Any
) -> Path:
    """Simulate a scenario for so many steps and write it as a bag.

    Parameters
    ----------
    folder : of the bag
    steps : after the first sample
    scenario, controller : what is simulated, whatever duration it has
    how : `compression`, `chunk_size` of the `BagWriter`

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
    writer = BagWriter(folder, texts, Storage(**how))
    for topic, (kind, _) in COLUMNS.items():
        text = TYPES.generate_msgdef(kind, ros_version=2)[0]
        writer.add_channel(Definition(f'/{topic}', kind, digest=TYPES.hash_rihs01(kind)), text)
    stamps = np.round(run.t * NANOSECONDS).astype(np.int64)
    for first in range(0, len(stamps), BLOCK):
        part, ns = run.part(slice(first, first + BLOCK)), stamps[first : first + BLOCK]
        columns = {
            t: _serialized(kind, ns, numbers(part)) for t, (kind, numbers) in COLUMNS.items()
        }
        for k, stamp in enumerate(ns.tolist()):
            for topic, messages in columns.items():
                writer.write(f'/{topic}', stamp, messages[k].tobytes())
    writer.close()
    return folder


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
