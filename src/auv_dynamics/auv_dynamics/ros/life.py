"""A node's life as a process: start, spin, end on a signal or by itself, exit code."""

import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.signals import SignalHandlerOptions

from auv_dynamics.files import InputError
from auv_dynamics.interface import PARENT
from auv_dynamics.ros.bulk import PLAIN

RCLError = rclpy_implementation.RCLError
POLL = 0.1  # s, longest wait before a signal is noticed
SIGNALS = (signal.SIGINT, signal.SIGTERM)
SERVE = 0.02  # s of data between two looks at parameters, services and timers
CALLBACKS = 3  # that are served at each look


def live(make: Callable[[], Any], args: list[str] | None = None) -> int:
    """Run a node until a signal or its own end.

    Parameters
    ----------
    make : builds the node, which may set its `exit_code`; InputError gives one line on stderr
        and exit code 2
    args : command line, default sys.argv

    Returns
    -------
    code : 0 after a signal or a good end, 1 when the work failed, 2 for wrong input

    """
    stop = threading.Event()
    for number in SIGNALS:
        signal.signal(number, lambda *_: stop.set())
    node = None
    code = 0
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        node = make()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        while not stop.is_set() and node.exit_code is None and not _orphaned():
            _turn(node, executor)
    except InputError as error:
        print(error, file=sys.stderr, flush=True)
        code = 2
    except rclpy.exceptions.ROSInterruptException:
        code = 0
    except ExternalShutdownException:
        code = 0
    except RCLError as error:  # e.g. a parameter file that is no YAML
        print(str(error).splitlines()[0], file=sys.stderr, flush=True)
        code = 2
    finally:
        if node is not None:
            node.close()
            code = code or node.exit_code or 0
            with contextlib.suppress(Exception):
                node.destroy_node()
        rclpy.try_shutdown()
        for number in SIGNALS:  # one that comes while Python tears down does not change the code
            signal.signal(number, signal.SIG_IGN)
    return code


def _turn(node: Any, executor: SingleThreadedExecutor) -> None:
    """Data as it comes, for a while; then whatever the executor has to serve."""
    if PLAIN:
        _serve(node, executor, POLL)
        return
    until = time.monotonic() + SERVE
    while (left := until - time.monotonic()) > 0 and node.exit_code is None:
        node.wait_for_bulk(left)
        node.empty_bulk()
    node.follow_clock()
    for _ in range(CALLBACKS):
        _serve(node, executor, 0.0)


def _serve(node: Any, executor: SingleThreadedExecutor, timeout: float) -> None:
    try:
        executor.spin_once(timeout_sec=timeout)
    except RCLError as error:  # e.g. a lifecycle transition that does not exist from here
        node.get_logger().error(f'refused: {str(error).splitlines()[0]}')


def _orphaned() -> bool:
    parent = os.environ.get(PARENT)
    return parent is not None and os.getppid() != int(parent)


def main_of(make: Callable[[], Any]) -> None:
    """Entry point of a node executable."""
    sys.exit(live(make))
