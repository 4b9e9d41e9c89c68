"""How far a process is heard: on this machine alone, unless the user has opened it."""

import os
import sys
from pathlib import Path

RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
PROFILE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
HERE = 'LOCALHOST'


def loopback() -> dict[str, str]:
    """Environment variables that keep a graph on this machine, with quick discovery.

    With the range alone Fast DDS still listens on every interface, and answers whoever names this
    machine as its peer; the profile binds its sockets to the loopback.
    """
    return {RANGE: HERE, PROFILE: str(Path(__file__).with_name('fastdds.xml'))}


def stay_local() -> bool:
    """Set what the user has not set; whether the range was left to this process.

    The middleware reads its environment when it is loaded, which `rclpy.init` does.
    """
    unset = not os.environ.get(RANGE)
    if unset:
        os.environ[RANGE] = HERE
    if os.environ[RANGE] == HERE:
        os.environ.setdefault(PROFILE, loopback()[PROFILE])
    return unset


def say_local() -> None:
    """Say what somebody must know whose other nodes are elsewhere."""
    text = f'discovery: this machine only; {RANGE}=SUBNET opens it to everybody on the network'
    print(text, file=sys.stderr, flush=True)
