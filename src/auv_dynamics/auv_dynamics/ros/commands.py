"""Recorded commands to a vehicle: only finite ones, and a zero wrench when they pause or end."""

from collections.abc import Mapping

from geometry_msgs.msg import WrenchStamped
from rclpy.duration import Duration
from rclpy.publisher import Publisher

from auv_dynamics.ros.codec import KINDS, message_of
from auv_dynamics.ros.interface import Frames

ACKNOWLEDGED = Duration(seconds=0.5)


class Commands:
    """Commands that a vehicle may hear.

    Parameters
    ----------
    publishers : name -> publisher
    heard : whether they go to nodes that act on them

    """

    def __init__(self, publishers: Mapping[str, Publisher], heard: bool):
        self._publishers, self._heard = publishers, heard
        self._last: dict[str, WrenchStamped] = {}

    def check(self, name: str, data: bytes) -> None:
        """Raise BadMessageError for a command that must not go out: one that is not finite."""
        publisher = self._publishers.get(name)
        kind = KINDS.get(publisher.msg_type) if publisher is not None else None
        if publisher is None or kind is None or kind.read is None:
            return
        message = message_of(data, publisher.msg_type, name)
        child = getattr(message, 'child_frame_id', message.header.frame_id)
        kind.read(message, Frames(message.header.frame_id, child), name)
        if isinstance(message, WrenchStamped):
            self._last[name] = message

    def let_go(self) -> None:
        """Publish a zero wrench where a vehicle holds the last one."""
        for name, last in self._last.items() if self._heard else ():
            self._publishers[name].publish(WrenchStamped(header=last.header))
            self._publishers[name].wait_for_all_acked(ACKNOWLEDGED)
        self._last.clear()
