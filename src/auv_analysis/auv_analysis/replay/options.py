"""Options of `auv replay`."""

import argparse
from pathlib import Path


def add_options(command: argparse.ArgumentParser) -> None:
    """Add the options of `auv replay` to its parser."""
    command.add_argument('bag', type=Path, metavar='BAG', help='a bag folder or an .mcap file')
    text = 's of the bag per s, or max: as fast as it goes without loss; default: 1'
    command.add_argument('--rate', metavar='R', default='1', help=text)
    command.add_argument('--start', metavar='S', help='begin so many s behind its beginning')
    command.add_argument('--duration', metavar='S', help='play so many s of it')
    command.add_argument('--loop', action='store_true', help='begin again at its end')
    command.add_argument('--paused', action='store_true', help='begin paused')
    text = 'jump where nothing was recorded for more than a minute'
    command.add_argument('--skip-gaps', action='store_true', help=text)
    text = 'recorded names or patterns; default: all'
    command.add_argument('--topics', nargs='+', metavar='TOPIC', help=text)
    names = command.add_mutually_exclusive_group()
    text = 'before the recorded names; default: replay'
    names.add_argument('--namespace', metavar='NAME', help=text)
    names.add_argument('--original-names', action='store_true', help='as they were recorded')
    text = 'commands as well where a vehicle may listen: outside of /replay'
    command.add_argument('--commands', action='store_true', help=text)
    text = 'even where a foreign node acts on them'
    command.add_argument('--force-commands', action='store_true', help=text)
    text = 'also analysis, diagnostics, progress and clock as recorded'
    command.add_argument('--all', action='store_true', help=text)
    command.add_argument('--no-clock', action='store_true', help='publish no /clock')
    text = 'TOPIC=COUNT: wait for so many subscribers; may be repeated'
    command.add_argument('--expect', action='append', metavar='TOPIC=COUNT', help=text)
    text = 'topic of wrenches: the next odometry waits for that with the stamp of the last'
    command.add_argument('--answers', metavar='TOPIC', help=text)
    command.add_argument('--domain-id', help='ROS domain, default: $ROS_DOMAIN_ID, else 0')
    _open_loop(command.add_argument_group('what another law would have commanded, without nodes'))


def _open_loop(group: argparse._ArgumentGroup) -> None:
    text = 'law on the recorded odometry and set-points: gvc, cl, pid, smc or module:Class'
    group.add_argument('--law', help=text)
    text = 'NAME=VALUE of 1, 6 or 36 numbers, with commas; default: as recorded; may be repeated'
    group.add_argument('--gain', action='append', default=[], metavar='NAME=VALUE', help=text)
    group.add_argument('--vehicle', help='for bags that do not carry their own')
