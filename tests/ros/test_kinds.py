"""Message types by the name that a publisher gives them."""

import sys

import pytest
from geometry_msgs.msg import WrenchStamped
from rclpy.duration import Duration
from rclpy.qos import QoSProfile

from auv_dynamics.ros.topics import is_name, message_class, qos_entry, type_name


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
    assert not any(map(is_name, ('', 'a b', 'a\0b', 'é', '1st', 'a//b', 'a/')))


def test_the_times_of_a_profile_are_seconds_and_the_rest_of_them() -> None:
    entry = qos_entry(QoSProfile(depth=1, deadline=Duration(seconds=2, nanoseconds=500)))
    assert entry['deadline'] == {'sec': 2, 'nsec': 500}
