"""Who was there: the endpoints of the topics that matter, as discovery tells them."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Endpoint:
    """A publisher or a subscription.

    Attributes
    ----------
    node : its full name
    type : of the messages, such as nav_msgs/msg/Odometry
    reliability, durability : of its quality of service, in lower case

    """

    node: str
    type: str
    reliability: str = 'reliable'
    durability: str = 'volatile'

    @property
    def policies(self) -> str:
        """Its quality of service, as far as discovery tells it, which knows no depth."""
        return f'reliability {self.reliability}, durability {self.durability}'


@dataclass(frozen=True)
class Scene:
    """The endpoints of a driver and of whoever is beside it; observers are left out.

    Attributes
    ----------
    place : domain and namespace, in words
    odom, wrench : full names of the topics
    odom_type, wrench_type : that they should have
    odom_publishers, wrench_publishers, wrench_subscribers, clock_publishers : of these topics
    conflicts : 'controller', 'recorder', 'wrench' -> why our end and the driver's do not match;
        empty where they do
    elsewhere : other topics of the odometry's type -> who publishes them
    listeners : other topics of the wrench's type -> who subscribes them
    topics : names of all topics

    """

    place: str
    odom: str
    wrench: str
    odom_type: str
    wrench_type: str
    odom_publishers: tuple[Endpoint, ...] = ()
    wrench_publishers: tuple[Endpoint, ...] = ()
    wrench_subscribers: tuple[Endpoint, ...] = ()
    clock_publishers: tuple[Endpoint, ...] = ()
    conflicts: Mapping[str, str] = field(default_factory=dict)
    elsewhere: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    listeners: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    topics: tuple[str, ...] = ()

    @property
    def drivers(self) -> tuple[Endpoint, ...]:
        """Publishers of odometry that has its type."""
        return tuple(end for end in self.odom_publishers if end.type == self.odom_type)

    @property
    def takers(self) -> tuple[Endpoint, ...]:
        """Subscriptions to the wrench that have its type."""
        return tuple(end for end in self.wrench_subscribers if end.type == self.wrench_type)
