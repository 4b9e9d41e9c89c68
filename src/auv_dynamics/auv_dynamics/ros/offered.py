"""Quality of service of what is published again: nothing is lost, late comers get what they got."""

from typing import Any

import yaml
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from auv_dynamics.ros.topics import DEPTH

KEPT = ('transient_local', 1)  # as rosbag2 writes it: a word, or the number of the middleware
LATE = 100  # messages kept for late comers where the recorded depth is not known
LONGEST = 10_000  # characters of a profile that is read


def offered_again(recorded: str, *, volatile: bool = False) -> QoSProfile:
    """Profile for publishing a recorded topic.

    It is reliable, which every subscription accepts, and as durable as it was recorded.

    Parameters
    ----------
    recorded : offered profiles as rosbag2 writes them into a channel; empty: not known
    volatile : keep nothing for late comers, whatever was recorded

    """
    depths = [] if volatile else _kept(recorded)
    durability = DurabilityPolicy.TRANSIENT_LOCAL if depths else DurabilityPolicy.VOLATILE
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=max(depths) if depths else DEPTH,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=durability,
    )


def _kept(recorded: str) -> list[int]:
    """Depths of the profiles that keep messages for late comers."""
    try:
        profiles: Any = yaml.safe_load(recorded) if len(recorded) < LONGEST else None
    except (yaml.YAMLError, ValueError, RecursionError):
        return []
    if not isinstance(profiles, list):
        return []
    kept = [p for p in profiles if isinstance(p, dict) and p.get('durability') in KEPT]
    depths = [profile.get('depth') for profile in kept]
    return [d if isinstance(d, int) and 0 < d <= DEPTH else LATE for d in depths]
