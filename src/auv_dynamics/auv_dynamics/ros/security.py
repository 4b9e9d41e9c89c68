"""Exposure of a process: its discovery range, and DDS security as the user asked for it.

ROS reads its security variables letter by letter: `ROS_SECURITY_ENABLE=1` is a no, and every
strategy but `Enforce` lets a node without keys talk in the clear. Both would pass unnoticed.
"""

import os
import subprocess
import sys
from pathlib import Path

from auv_dynamics.files.errors import InputError

RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
HERE = 'LOCALHOST'
# of Fast DDS 2, and of its later versions, which read both
PROFILES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
ENABLE, STRATEGY = 'ROS_SECURITY_ENABLE', 'ROS_SECURITY_STRATEGY'
KEYSTORE = 'ROS_SECURITY_KEYSTORE'
WORDS = {ENABLE: ('true', 'false'), STRATEGY: ('Enforce', 'Permissive')}
TRIAL = """
import sys, rclpy
rclpy.init(args=sys.argv[1:])
rclpy.create_node(sys.argv[-1].rpartition('/')[2], start_parameter_services=False, enable_rosout=False)
"""  # noqa: E501  what a participant does when it joins


def loopback() -> dict[str, str]:
    """Environment variables that keep a graph on this machine, with quick discovery.

    With the range alone Fast DDS still listens on every interface, and answers whoever names this
    machine as its peer; the profile binds its sockets to the loopback.
    """
    return {RANGE: HERE, **dict.fromkeys(PROFILES, str(Path(__file__).with_name('fastdds.xml')))}


def local() -> dict[str, str]:
    """The same as far as the user has not said otherwise."""
    chosen = os.environ.get(RANGE) or HERE
    own = chosen != HERE or any(map(os.environ.get, PROFILES))
    return {RANGE: chosen} if own else loopback()


def stay_local() -> None:
    """Keep this process on this machine, as far as the user has not said otherwise.

    The middleware reads its environment when it is loaded, which `rclpy.init` does. Commands call
    this; a node that a user starts is heard as far as ROS lets it.
    """
    os.environ.update(local())


def enclave(executable: str) -> list[str]:
    """Arguments that name the enclave of an executable: that of the shipped policy."""
    return ['--ros-args', '--enclave', f'/auv_gvc/{executable}']


def asked() -> bool:
    """Whether security is switched on, with a warning where it is not enforced.

    Raises
    ------
    InputError : a word that ROS would take for something else than what it says; no keys named

    """
    for name, words in WORDS.items():
        value = os.environ.get(name, '')
        if value and value not in words:
            raise InputError(name, '', f'{" or ".join(words)}, letter by letter', value)
    if os.environ.get(ENABLE) != 'true':
        return False
    if os.environ.get(STRATEGY) != 'Enforce':
        text = f'warning: {STRATEGY} is not Enforce: a node without keys talks in the clear'
        print(text, file=sys.stderr, flush=True)
    elif not os.environ.get(KEYSTORE):
        raise InputError(KEYSTORE, '', 'the folder of the keys, since security is enforced', None)
    return True


def require(executable: str) -> None:
    """Try to join with the keys of an executable, where security is switched on.

    It is tried in another process: what the middleware prints when it refuses is long.

    Raises
    ------
    InputError : this middleware has no DDS security, or there are no keys for the enclave

    """
    if not asked():
        return
    arguments = enclave(executable)
    command = [sys.executable, '-c', TRIAL, *arguments]
    tried = subprocess.run(command, capture_output=True, text=True, check=False)
    if tried.returncode != 0:
        errors = [line.partition('Error: ') for line in tried.stderr.splitlines()]
        said = [text for _, error, text in errors if error] or ['a crash']
        expected = f'a middleware with DDS security, and keys of {arguments[-1]}'
        raise InputError(f'{ENABLE}=true', '', expected, said[-1])
