"""`auv check-vehicle`: how well the vehicle of a file can be controlled."""

import argparse
from typing import Any

from auv_analysis.cli.arguments import VEHICLE


def add_arguments(command: argparse.ArgumentParser) -> None:
    """A vehicle, and its speed."""
    command.add_argument('vehicle', metavar='FILE', help=VEHICLE)
    text = 'surge speed at which it is linearised, m/s; default: top speed if shipped, else 1'
    command.add_argument('--speed', type=float, metavar='U', help=text)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """What a vehicle file says about how it can be controlled."""
    from auv_analysis.studies.check_vehicle import check_vehicle, print_check

    document = check_vehicle(options.vehicle, options.speed)
    if not options.json:
        print_check(document)
    return document
