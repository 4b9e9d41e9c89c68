"""A node's life as a process: start, spin, end on a signal or by itself, exit code."""

import contextlib
import ctypes
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor, TimeoutException
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from auv_dynamics.files.ending import take_signals
from auv_dynamics.files.errors import InputError, first_line
from auv_dynamics.ros.bulk import DataPath
from auv_dynamics.ros.interface import NANOSECONDS, PARENT
from auv_dynamics.ros.private import PLAIN, RCLError, RMWError
from auv_dynamics.ros.reach import say_local, stay_local
from auv_dynamics.ros.security import asked

POLL = 0.1  # s, longest wait before a signal is noticed
TEARDOWN = 4.0  # s to leave the graph, after the last words; then the process ends anyway
MONOTONIC, IN_A_THREAD = 1, 2  # CLOCK_MONOTONIC, SIGEV_THREAD
SERVE = 0.02  # s of data between two looks at parameters, services and timers
CALLBACKS = 50  # that are served at each look, at most


def live(makes: Sequence[Callable[[], Any]], args: list[str] | None = None) -> int:
    """Run nodes in this process until a signal or until one of them ends.

    Parameters
    ----------
    makes : each builds a node, which may set its `exit_code`; InputError gives one line on stderr
        and exit code 2. They are closed in reverse order: the first one hears the last words
    args : command line, default sys.argv

    Returns
    -------
    code : 0 after a signal or a good end, 1 when the work failed, 2 for wrong input

    """
    stop = threading.Event()
    take_signals(lambda *_: stop.set())
    if not any(getattr(make, 'prompt', False) for make in makes):
        give_way()
    nodes: list[Any] = []
    code = 0
    try:
        unset = stay_local()
        asked()
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        executor = SingleThreadedExecutor()
        for make in makes:
            nodes.append(make())
            executor.add_node(nodes[-1])
        if unset:
            say_local()
        _spin(nodes, executor, stop)
    except InputError as error:
        print(error, file=sys.stderr, flush=True)
        code = 2
    except (rclpy.exceptions.ROSInterruptException, ExternalShutdownException):
        code = 0
    # a parameter file that is no YAML, keys that are not there; what rclpy declares itself
    except (RCLError, rclpy.exceptions.ParameterException) as error:
        print(first_line(error), file=sys.stderr, flush=True)
        code = 2
    finally:
        closed = _close(nodes)
        code = code or closed
        _tear_down(nodes, code)
        # one that comes while Python tears down does not change the code
        take_signals(signal.SIG_IGN)
    return code


def give_way() -> None:
    """Let a process that only observes not interrupt those whose answers are waited for."""
    with contextlib.suppress(OSError, AttributeError):  # not every system has it
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


def _spin(nodes: list[Any], executor: SingleThreadedExecutor, stop: threading.Event) -> None:
    """Data as it comes, and in between whatever the executor has to serve."""
    data = DataPath(nodes)

    def ended() -> bool:
        return any(node.exit_code is not None for node in nodes)

    while not (stop.is_set() or ended() or _orphaned()):
        if PLAIN:
            serve(nodes[0], executor, POLL)
            continue
        data.serve(_next_look(nodes), ended)
        for node in nodes:
            node.follow_clock()
        for _ in range(CALLBACKS):
            if not serve(nodes[0], executor, 0.0):
                break


def _next_look(nodes: list[Any]) -> float:
    """When to serve the executor again: soon, and in time for timers that are even faster."""
    fast = [timer for node in nodes for timer in node.timers if timer.timer_period_ns < SERVE * 1e9]
    left = [timer.time_until_next_call() for timer in fast]
    return time.monotonic() + min([SERVE, *(max(0, ns) / 1e9 for ns in left if ns is not None)])


def serve(node: Any, executor: SingleThreadedExecutor, timeout: float) -> bool:
    """Run a callback that is ready within so many s; whether there was one."""
    try:
        callback, _, node = executor.wait_for_ready_callbacks(timeout_sec=timeout)
        callback()
        callback.result()
    except TimeoutException:
        return False
    except (RCLError, RMWError) as error:  # a transition that does not exist, a broken request
        node.get_logger().error(f'refused: {first_line(error)}')
    return True


def _close(nodes: list[Any]) -> int:
    """Close all nodes, the first one last; the exit code of one that has failed, else 0."""
    failed = {node.get_name(): node.exit_code for node in nodes if node.exit_code}
    with contextlib.ExitStack() as stack:
        for node in nodes:
            stack.callback(node.close)
    for node in nodes:
        node.finish()
    codes = [node.exit_code for node in nodes if node.exit_code]
    if len(nodes) > 1:
        for name, code in failed.items():
            print(f'{name} ended with exit code {code}', file=sys.stderr, flush=True)
    return codes[0] if codes else 0


def _tear_down(nodes: list[Any], code: int) -> None:
    """Leave the graph; what was done before counts, however long that takes."""
    with _ending(code, TEARDOWN):
        for node in reversed(nodes):
            with contextlib.suppress(Exception):
                node.destroy_node()
        try_shutdown()


class _Event(ctypes.Structure):
    """What a timer of POSIX does: `struct sigevent`."""

    _fields_ = (
        *(('value', ctypes.c_void_p), ('signal', ctypes.c_int), ('how', ctypes.c_int)),
        *(('function', ctypes.c_void_p), ('rest', ctypes.c_char * 40)),
    )


@contextlib.contextmanager
def _ending(code: int, seconds: float) -> Iterator[None]:
    """End the process with an exit code if this lasts longer.

    The middleware has been seen to turn in circles with the GIL held: Python cannot end it then.
    """
    sys.stdout.flush()
    libc, timer = ctypes.CDLL(None), ctypes.c_void_p()
    call = ctypes.cast(libc['_exit'], ctypes.c_void_p).value
    event = _Event(code, 0, IN_A_THREAD, call)
    libc.timer_create(MONOTONIC, ctypes.byref(event), ctypes.byref(timer))
    whole, rest = divmod(seconds, 1.0)
    once = (ctypes.c_long * 4)(0, 0, int(whole), int(rest * NANOSECONDS))
    libc.timer_settime(timer, 0, once, None)
    try:
        yield
    finally:
        libc.timer_delete(timer)


def _orphaned() -> bool:
    parent = os.environ.get(PARENT)
    return parent is not None and os.getppid() != int(parent)


def main_of(*makes: Callable[[], Any]) -> None:
    """Entry point of an executable with one node, or several."""
    sys.exit(live(makes))
