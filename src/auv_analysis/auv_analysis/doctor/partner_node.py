"""A participant of a domain that looks who is there: a half of the test of discovery."""

import json
import sys
import time

from rclpy.context import Context
from rclpy.node import Node

from auv_dynamics.ros.participant import Participant

STAYS = 1.5  # s after it has found the other, so that the other finds it as well
LOOK = 0.1  # s


def main() -> None:
    """Print how long another node took to be found, and all that were: DOMAIN NAME OTHER SECONDS.

    Without an OTHER it looks for so long.
    """
    domain, name, other, seconds = sys.argv[1:]

    def make(context: Context) -> Node:
        return Node(name, context=context, start_parameter_services=False, enable_rosout=False)

    participant = Participant(int(domain), make)
    began = time.monotonic()
    took, seen = None, set()
    while time.monotonic() - began < float(seconds) and took is None:
        participant.spin(LOOK)
        seen |= participant.nodes()
        if other and f'/{other}' in seen:
            took = time.monotonic() - began
    if took is not None:
        participant.spin(STAYS)
    participant.close()
    print(json.dumps({'took': took, 'seen': sorted(seen - {f'/{name}'})}))


if __name__ == '__main__':
    main()
