"""What the environment says to ROS: distro, middleware, domain, reach."""

import os
import re
import sys
from collections.abc import Iterator

from auv_analysis.doctor.finding import Finding

DISTRO = 'jazzy'
RMW = 'rmw_fastrtps_cpp'
RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
REACHES = ('LOCALHOST', 'SUBNET', 'SYSTEM_DEFAULT', 'OFF')
PATHS = ('AMENT_PREFIX_PATH', 'PYTHONPATH', 'LD_LIBRARY_PATH')
OF_ROS = re.compile(r'(?:^|/)opt/ros/([a-z]+)(?:/|$)')
OF_PYTHON = re.compile(r'/python(3\.\d+)/')


def distro() -> Iterator[Finding]:
    """Whether another ROS than Jazzy, or packages for another Python, are in the environment."""
    others = {}
    if os.environ.get('ROS_DISTRO', DISTRO) != DISTRO:
        others['ROS_DISTRO'] = os.environ['ROS_DISTRO']
    ours = f'{sys.version_info[0]}.{sys.version_info[1]}'
    for name in PATHS:
        for entry in os.environ.get(name, '').split(os.pathsep):
            found = OF_ROS.search(entry)
            python = OF_PYTHON.search(f'{entry}/')
            if (found and found[1] != DISTRO) or (python and python[1] != ours):
                others.setdefault(name, entry)
    for name, value in others.items():
        advice = 'open a new terminal and source nothing, or the setup file of Jazzy alone'
        found_text = f'{name} names {value}: ROS 2 {DISTRO.title()} and Python {ours} are needed'
        yield Finding('ROS', 'broken', found_text, advice)
    if not others:
        sourced = os.environ.get('ROS_DISTRO')
        yield Finding('ROS', 'ok', f'{DISTRO}, {"sourced" if sourced else "from wheels"}')


def middleware() -> Iterator[Finding]:
    """Whether the middleware is the one that the nodes are tuned and tested for."""
    chosen = os.environ.get('RMW_IMPLEMENTATION') or RMW
    if chosen == RMW:
        yield Finding('middleware', 'ok', chosen)
    else:
        found = f'RMW_IMPLEMENTATION={chosen}: nodes are tested with {RMW} alone'
        yield Finding('middleware', 'warning', found, 'unset RMW_IMPLEMENTATION')


def reach() -> Iterator[Finding]:
    """How far nodes are heard."""
    value = os.environ.get(RANGE)
    if os.environ.get('ROS_LOCALHOST_ONLY', '0') not in ('', '0'):
        found = 'ROS_LOCALHOST_ONLY is set: it is deprecated and overrides the range'
        yield Finding('reach', 'warning', found, f'unset it; {RANGE}=LOCALHOST says the same')
    if not value or value == 'LOCALHOST':
        yield Finding('reach', 'ok', f'this machine only ({RANGE}={value or "LOCALHOST, by auv"})')
    elif value == 'OFF':
        found = f'{RANGE}=OFF: no node finds another'
        yield Finding('reach', 'broken', found, f'unset {RANGE}')
    elif value in REACHES:
        found = f'{RANGE}={value}: everybody on the network hears the nodes and may command them'
        yield Finding('reach', 'warning', found, f'unset {RANGE} where no other machine takes part')
    else:
        from auv_dynamics.files.nearest import one_of

        found = f'{RANGE}={value}: expected {one_of(value, REACHES)}'
        yield Finding('reach', 'broken', found, f'unset {RANGE}')


def domain() -> Iterator[Finding]:
    """Whether ROS_DOMAIN_ID is one."""
    from auv_analysis.graph.domain import VARIABLE, joined_domain
    from auv_dynamics.files.errors import InputError

    try:
        number = joined_domain(None)
    except InputError as error:
        yield Finding('domain', 'broken', str(error), f'unset {VARIABLE}')
        return
    if os.environ.get(VARIABLE):
        yield Finding('domain', 'ok', f'{VARIABLE}={number}')
    else:
        yield Finding('domain', 'ok', f'{VARIABLE} is not set: auv run takes a free one')
