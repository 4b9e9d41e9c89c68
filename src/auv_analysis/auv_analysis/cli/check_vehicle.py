"""`auv check-vehicle`: what a vehicle file says about how it can be controlled."""

import argparse
from typing import Any

from auv_analysis.studies import check_vehicle as vehicle_check
from auv_analysis.studies.check_vehicle import print_check


def check_vehicle(options: argparse.Namespace) -> dict[str, Any]:
    """What a vehicle file says about how it can be controlled."""
    document = vehicle_check.check_vehicle(options.vehicle, options.speed)
    if not options.json:
        print_check(document)
    return document
