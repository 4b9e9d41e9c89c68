"""`auv watch`: a live dashboard of a node graph, which is not disturbed by it."""

import argparse
import math
import time
from contextlib import ExitStack
from typing import Any

from auv_analysis.cli.arguments import add_domain, add_frames, namespace, number


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Which graph is listened to, how often and how long."""
    add_domain(command)
    text = 'of the graph, such as /auv1'
    command.add_argument('--namespace', type=namespace, default='/', help=text)
    text = 'for energy and couplings where no analysis_node runs'
    command.add_argument('--vehicle', help=text)
    text = 'refreshes per second; default: 4, in a pipe 1'
    command.add_argument('--rate', type=number(above=0, at_most=30), metavar='HZ', help=text)
    command.add_argument('--once', action='store_true', help='print a single snapshot')
    text = 'print the last snapshot after so long'
    command.add_argument(
        '--for', dest='limit', type=number(above=0), default=math.inf, metavar='SECONDS', help=text
    )
    add_frames(command)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Live dashboard in the terminal; returns the last snapshot."""
    from auv_analysis.graph.domain import join_domain, place_of
    from auv_analysis.output.keyboard import Keyboard
    from auv_analysis.output.progress import say
    from auv_analysis.watch.monitor import GraphMonitor
    from auv_analysis.watch.screen import Display, Session
    from auv_dynamics import load_vehicle
    from auv_dynamics.ros.interface import Frames

    vehicle = None if options.vehicle is None else load_vehicle(options.vehicle)
    with ExitStack() as stack:
        keyboard = stack.enter_context(Keyboard())  # from here on Ctrl-C is an end like another
        domain = join_domain(options.domain_id)
        # the middleware reads its environment when it is loaded
        from auv_analysis.graph.supervisor import give_way
        from auv_analysis.nodes.watch_node import Listener

        give_way()
        monitor = GraphMonitor(domain, options.namespace, vehicle, begin=time.monotonic())
        frames = Frames(options.odom_frame, options.base_frame)
        listener = Listener(domain, options.namespace, frames, monitor)
        stack.callback(listener.close)
        say(f'listens on {place_of(domain, options.namespace)}')
        single = options.once or options.limit < math.inf
        display = stack.enter_context(Display(stderr=options.json, single=single))
        session = Session(monitor, listener, display, options.rate)
        return session.run(keyboard, options.limit, once=options.once).document()
