"""Message types by name, and how a publisher's quality of service is written down."""

import importlib
import importlib.util
import re
from pathlib import Path
from typing import Any

from rclpy.qos import QoSProfile

from auv_dynamics.ros import interface

NAME = re.compile(r'([a-z]\w*)/msg/([A-Z]\w*)', re.ASCII)
STAMPED_TYPES = ('std_msgs/msg/Header', 'rosgraph_msgs/msg/Clock')


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


def begins_with_stamp(kind: Any) -> bool:
    """Whether a serialized message of a class begins with its time."""
    if type_name(kind) in STAMPED_TYPES:
        return True
    fields = kind.get_fields_and_field_types()
    return bool(fields) and next(iter(fields.values())) == 'std_msgs/Header'


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
