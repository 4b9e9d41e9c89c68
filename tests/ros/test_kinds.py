"""Message types by the name that a publisher gives them."""

import sys
from contextlib import nullcontext
from types import SimpleNamespace

import pytest
from geometry_msgs.msg import WrenchStamped
from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from auv_dynamics.ros import rclpy_internals
from auv_dynamics.ros.topics import best_effort, is_name, message_class, qos_entry, type_name


def test_a_message_is_found_by_its_name() -> None:
    assert message_class('geometry_msgs/msg/WrenchStamped') is WrenchStamped
    assert type_name(WrenchStamped) == 'geometry_msgs/msg/WrenchStamped'


@pytest.mark.parametrize(
    'name',
    ['antigravity/msg/X', 'this/msg/X', 'HelloWorld', 'a/b', '', '../os/msg/X', 'a_msgs/srv/X',
     'no_such_msgs/msg/X', 'numpy/msg/X', 'geometry_msgs/msg/__doc__', 'a/msg/X\n'],
)  # fmt: skip
def test_a_name_that_somebody_makes_up_imports_nothing(name: str) -> None:
    with pytest.raises(ImportError, match='no message that is installed here'):
        message_class(name)
    assert not {'antigravity', 'this'} & set(sys.modules)


def test_a_message_that_its_package_lacks_is_missed() -> None:
    with pytest.raises(AttributeError, match='NoSuchMessage'):
        message_class('geometry_msgs/msg/NoSuchMessage')


def test_a_topic_has_a_name_that_the_middleware_takes_whole() -> None:
    assert all(map(is_name, ('odom', '/auv1/cmd_vel')))
    assert not any(map(is_name, ('', 'a b', 'a\0b', 'é', 'a/日本', '٣', '1st', 'a//b', 'a/')))


def test_whoever_looks_on_takes_as_much_as_there_is_room_for_and_is_not_waited_for() -> None:
    found = qos_entry(best_effort())
    assert (found['reliability'], found['history'], found['depth']) == (
        'best_effort', 'keep_last', 3000
    )  # fmt: skip


def test_a_profile_is_written_whole() -> None:
    times = {
        key: Duration(seconds=k, nanoseconds=500 + k)
        for k, key in enumerate(('deadline', 'lifespan', 'liveliness_lease_duration'), start=2)
    }
    words = {
        'history': HistoryPolicy.KEEP_LAST,
        'reliability': ReliabilityPolicy.BEST_EFFORT,
        'durability': DurabilityPolicy.TRANSIENT_LOCAL,
        'liveliness': LivelinessPolicy.MANUAL_BY_TOPIC,
    }
    plain = {'depth': 7, 'avoid_ros_namespace_conventions': True}
    assert qos_entry(QoSProfile(**times, **words, **plain)) == plain | {
        'history': 'keep_last',
        'reliability': 'best_effort',
        'durability': 'transient_local',
        'liveliness': 'manual_by_topic',
        'deadline': {'sec': 2, 'nsec': 502},
        'lifespan': {'sec': 3, 'nsec': 503},
        'liveliness_lease_duration': {'sec': 4, 'nsec': 504},
    }


@pytest.mark.parametrize(
    ('name', 'middleware'),
    [('HelloWorld', 'rmw_fastrtps_cpp'), ('made_msgs/msg/Up', 'rmw_cyclonedds_cpp')],
)
def test_no_stand_in_is_made_of_a_bad_name_or_for_another_middleware(
    monkeypatch, name: str, middleware: str
) -> None:
    """Its type supports are laid out in another way."""
    identifier = 'get_rmw_implementation_identifier'
    monkeypatch.setattr(rclpy_internals, identifier, lambda: middleware)
    with pytest.raises(ImportError, match=f'{name}: expected a message and'):
        rclpy_internals.raw_class(name)


def test_of_what_has_arrived_so_much_is_taken_and_the_rest_stays() -> None:
    class Handle(nullcontext):
        def take_message(self, kind: str, raw: bool) -> tuple[str, bool, int] | None:
            return (kind, raw, arrived.pop(0)) if arrived else None

    arrived = [1, 2, 3]
    heard = SimpleNamespace(handle=Handle(), msg_type='kind', raw=True)
    assert rclpy_internals.taken(heard, 2) == [('kind', True, 1), ('kind', True, 2)]
    assert arrived == [3]
    assert rclpy_internals.taken(heard, 2) == [('kind', True, 3)]
