"""Topics, message types by name, quality of service; names are relative, for a namespace."""

import importlib
import importlib.util
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import AccelStamped, TwistStamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.exceptions import InvalidTopicNameException
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.validate_full_topic_name import validate_full_topic_name
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from auv_dynamics.ros import interface


@dataclass(frozen=True)
class Topic:
    """A topic of the graph."""

    name: str
    type: type


ODOM = Topic(interface.ODOM, Odometry)
TWIST = Topic(interface.TWIST, TwistStamped)
CMD_VEL = Topic(interface.CMD_VEL, TwistStamped)
CMD_ACCEL = Topic(interface.CMD_ACCEL, AccelStamped)
WRENCH = Topic(interface.WRENCH, WrenchStamped)
WRENCH_APPLIED = Topic(interface.WRENCH_APPLIED, WrenchStamped)
GROUND_TRUTH = Topic(interface.GROUND_TRUTH, Odometry)
DISTURBANCE = Topic(interface.DISTURBANCE, WrenchStamped)
DISTURBANCE_ESTIMATE = Topic(interface.DISTURBANCE_ESTIMATE, WrenchStamped)
KINETIC_ENERGY = Topic(interface.KINETIC_ENERGY, JointState)
KINETIC_ENERGY_SHARES = Topic(interface.KINETIC_ENERGY_SHARES, JointState)
DELTA_XI = Topic(interface.DELTA_XI, TwistStamped)
DELTA_PI = Topic(interface.DELTA_PI, WrenchStamped)
LUMPED_ERROR = Topic(interface.LUMPED_ERROR, WrenchStamped)
PROGRESS = Topic(interface.PROGRESS, Header)
DIAGNOSTICS = Topic(interface.DIAGNOSTICS, DiagnosticArray)
CLOCK = Topic(interface.CLOCK, Clock)

STEP_TOPICS = (  # one message per step
    *(ODOM, TWIST, CMD_VEL, CMD_ACCEL, WRENCH, DISTURBANCE, DISTURBANCE_ESTIMATE),
    *(WRENCH_APPLIED, GROUND_TRUTH),
)
ANALYSIS_TOPICS = (KINETIC_ENERGY, KINETIC_ENERGY_SHARES, DELTA_XI, DELTA_PI, LUMPED_ERROR)
SINGLE = {ODOM, WRENCH, CLOCK}  # for one publisher: others would be obeyed as well
TOPICS = (*STEP_TOPICS, *ANALYSIS_TOPICS, PROGRESS, DIAGNOSTICS, CLOCK)


def _qos(reliability: ReliabilityPolicy, depth: int) -> QoSProfile:
    return QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=depth, reliability=reliability)


def every_step() -> QoSProfile:
    """Nothing may be lost: publishers of step topics, the recorder, analysis, exact pairing."""
    return _qos(ReliabilityPolicy.RELIABLE, interface.DEPTH)


def one_at_a_time() -> QoSProfile:
    """Lock-step subscriptions: at most a few messages are ever under way."""
    return _qos(ReliabilityPolicy.RELIABLE, 10)


def newest_measurement(depth: int = 10) -> QoSProfile:
    """Real time: odometry of any driver; the set-point node asks for the newest one alone."""
    return _qos(ReliabilityPolicy.BEST_EFFORT, depth)


def newest_command() -> QoSProfile:
    """Real time: the plant's wrench."""
    return _qos(ReliabilityPolicy.RELIABLE, 1)


def is_name(name: str) -> bool:
    """Whether a topic may have this name, relative or absolute; a namespace but / likewise."""
    if not (name.isascii() and name.isprintable()):  # rclpy would see no more than is before a NUL
        return False
    try:
        return bool(validate_full_topic_name(name if name.startswith('/') else f'/{name}'))
    except InvalidTopicNameException:
        return False


def best_effort(depth: int = interface.DEPTH) -> QoSProfile:
    """Observers: whatever there is, from whomever, and nobody waits for them."""
    return _qos(ReliabilityPolicy.BEST_EFFORT, depth)


NAME = re.compile(r'([a-z]\w*)/msg/([A-Z]\w*)', re.ASCII)


def type_name(kind: type) -> str:
    """Name of a message class: package/msg/Name."""
    package, folder, *_ = kind.__module__.split('.')
    return f'{package}/{folder}/{kind.__name__}'


def message_class(name: str) -> type:
    """Class of a message by its name; ImportError or AttributeError where there is none.

    Whoever publishes chooses the name: nothing is imported but packages with messages.
    """
    match = NAME.fullmatch(name)
    spec = importlib.util.find_spec(match[1]) if match else None
    places = (spec.submodule_search_locations if spec else None) or ()
    if not match or not any((Path(place) / 'msg/__init__.py').is_file() for place in places):
        raise ImportError(f'{name}: no message that is installed here')
    return getattr(importlib.import_module(f'{match[1]}.msg'), match[2])


def qos_entry(qos: QoSProfile) -> dict[str, Any]:
    """A profile as rosbag2's metadata has it."""

    def duration(value: Any) -> dict[str, int]:
        sec, nsec = divmod(value.nanoseconds, interface.NANOSECONDS)
        return {'sec': sec, 'nsec': nsec}

    return {
        'history': qos.history.name.lower(),
        'depth': qos.depth,
        'reliability': qos.reliability.name.lower(),
        'durability': qos.durability.name.lower(),
        'deadline': duration(qos.deadline),
        'lifespan': duration(qos.lifespan),
        'liveliness': qos.liveliness.name.lower(),
        'liveliness_lease_duration': duration(qos.liveliness_lease_duration),
        'avoid_ros_namespace_conventions': qos.avoid_ros_namespace_conventions,
    }
