"""A node as a process: start, spin, end on a signal or by itself, exit code.

In real time its executor is rclpy's, and everything here public API of rclpy. In lock-step, where
each message is waited for, `DataPath` stands beside the executor: rclpy rebuilds its whole wait
set, services and timers included, for every message. There the data subscriptions have a small wait
set of their own, and all that has arrived is taken at once. AUV_GVC_EXECUTOR=plain does without.
"""

import contextlib
import ctypes
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NoReturn

import rclpy
from rclpy.exceptions import ParameterUninitializedException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor, TimeoutException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.service import Service
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rclpy.utilities import try_shutdown

from auv_dynamics.files.errors import InputError, first_line, take_signals
from auv_dynamics.ros.interface import DEPTH, NANOSECONDS, PARENT
from auv_dynamics.ros.rclpy_internals import DataWait, RCLError, RMWError, has_data_path, taken
from auv_dynamics.ros.security import asked
from auv_dynamics.ros.topics import CLOCK

NAP = 0.005  # s between two looks at an observer's data


class BulkMixin:
    """Mixin of a node that runs as a process, and in a data path; stands before `Node`.

    By itself it is an ordinary node: any executor serves its subscriptions. `DataPath` takes them
    over in lock-step. The data of a `latency_critical` node is waited for there. At other nodes one
    looks now and then: the longer the naps, the more there is to be taken at once.

    Attributes
    ----------
    given : parameters that the user gave, by name
    bulk : whether a data path serves its subscriptions
    lockstep : whether it waits for nothing but messages
    exit_code : set when the node ends by itself
    task : what it does, once it has begun

    """

    latency_critical = False
    bulk = False
    lockstep = False
    exit_code: int | None = None
    task = ''
    given: dict[str, Any] | None = None

    def __init__(self, name: str, **options: Any):
        self._data_subscriptions: list[Subscription] = []
        super().__init__(  # type: ignore[call-arg]  # of the Node behind the mixin
            name, automatically_declare_parameters_from_overrides=True, **options
        )

    def declare_parameters(
        self, namespace: str, parameters: list[Any], ignore_override: bool = False
    ) -> list[Parameter]:
        """Declare parameters; what rclpy would declare of what was given is noted instead.

        A parameter is declared once, by `parameters.declare`, with its description.
        """
        if self.given is None:
            self.given = {name: value for name, value, _ in parameters}
            return []
        return super().declare_parameters(  # type: ignore[misc]  # as above
            namespace, parameters, ignore_override
        )

    @property
    def subscriptions(self) -> Iterator[Subscription]:
        """The subscriptions that an executor waits for."""
        mine = super().subscriptions  # type: ignore[misc]  # as above
        return (
            s for s in mine if not (self.bulk and (s in self._data_subscriptions or _is_clock(s)))
        )

    def get_parameter(self, name: str) -> Parameter:
        """A parameter, also one that is not set.

        rclpy raises for it, and its service then answers nothing about all the others either.
        """
        try:
            return super().get_parameter(name)  # type: ignore[misc]  # as above
        except ParameterUninitializedException:
            return Parameter(name)

    def begin(self, task: str) -> None:
        """Say in a line what the node does from now on."""
        self.task = task
        self.get_logger().info(f'begins: {task}')  # type: ignore[attr-defined]  # as above

    def finish(self) -> None:
        """Say that it is over, and how it went."""
        if self.task:
            text = f'ends with exit code {self.exit_code or 0}: {self.task}'
            self.get_logger().info(text)  # type: ignore[attr-defined]  # as above

    def close(self) -> None:
        """Last words while the context is still valid: zero wrench, closed bag."""

    def data_subscriptions(self) -> list[Subscription]:
        """The subscriptions of the data path."""
        return self._data_subscriptions

    def add_data(self, subscription: Subscription) -> None:
        """Note a subscription, with a callback (message, info), as one for a data path."""
        self._data_subscriptions.append(subscription)

    def drop_data(self, subscription: Subscription) -> None:
        """End a subscription of the data path."""
        self._data_subscriptions.remove(subscription)
        super().destroy_subscription(subscription)  # type: ignore[misc]  # as above

    def take_data(self) -> int:
        """Hand what a data path has received to its callbacks; how many messages.

        Of a latency-critical node one message of each subscription, for there is seldom more than
        one, and to find no further one takes nearly as long. It is asked again.
        """
        # not without end, should they come as fast as they are taken
        count, most = 0, 1 if self.latency_critical else DEPTH
        for subscription in self._data_subscriptions if self.bulk else ():
            callback = subscription.callback
            entries = taken(subscription, most)
            for message, info in entries:
                callback(message, info)
            count += len(entries)
        return count

    def follow_clock(self) -> None:
        """Tell rclpy's clock the newest simulated time."""
        mine = super().subscriptions  # type: ignore[misc]  # as above
        for subscription in [s for s in mine if _is_clock(s)]:
            for newest, _ in taken(subscription, 1):  # rclpy keeps no more
                subscription.callback(newest)


class BulkNode(BulkMixin, Node):
    """A node with a data path of its own: see `BulkMixin`."""


class DataPath:
    """Serves the data of the nodes of a process, in one thread.

    Parameters
    ----------
    nodes : of one context

    """

    def __init__(self, nodes: Sequence[Any]):
        for node in nodes:
            node.bulk = True
        self._prompt = [node for node in nodes if node.latency_critical]
        self._observers = [node for node in nodes if not node.latency_critical]
        self._wait = DataWait(nodes[0].context)
        self._look_at = 0.0

    def serve(self, until: float, ended: Callable[[], bool]) -> None:
        """Take data as it comes until a time of the monotonic clock, or until a node has ended."""
        while (now := time.monotonic()) < until and not ended():
            if now >= self._look_at:
                for node in self._observers:
                    node.take_data()
                self._look_at = time.monotonic() + NAP
            rest = min(self._look_at, until) if self._observers else until
            self._serve_prompt(rest, ended)

    def _serve_prompt(self, until: float, ended: Callable[[], bool]) -> None:
        prompt = self._prompt
        if not prompt:
            time.sleep(max(0.0, until - time.monotonic()))
            return
        while (left := until - time.monotonic()) > 0 and not ended():
            # one node's answer may be the other's question: wait only when nothing came
            if not sum(node.take_data() for node in prompt):
                waited_for = [s for node in prompt for s in node.data_subscriptions()]
                self._wait.wait(waited_for, left)


def _is_clock(subscription: Subscription) -> bool:
    """Whether this is the subscription that rclpy makes for `use_sim_time`."""
    return subscription.topic == CLOCK.name and not subscription.raw


POLL = 0.1  # s, longest wait before a signal is noticed
TEARDOWN = 4.0  # s to leave the graph, after the last words; then the process ends anyway
MONOTONIC, IN_A_THREAD = 1, 2  # CLOCK_MONOTONIC, SIGEV_THREAD
SERVE = 0.05  # s of data between two looks at parameters, services and timers
CALLBACKS = 50  # that are served at each look, at most
DRAINED = 3000  # callbacks of what has arrived before the end, at most


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
    nodes: list[Any] = []
    code = 0
    try:
        asked()
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        executor = SingleThreadedExecutor()
        for make in makes:
            nodes.append(make())
            executor.add_node(nodes[-1])
        _spin(nodes, executor, stop)
    except InputError as error:
        print(error, file=sys.stderr, flush=True)
        code = 2
    except (rclpy.exceptions.ROSInterruptException, ExternalShutdownException):
        pass
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


def _spin(nodes: list[Any], executor: SingleThreadedExecutor, stop: threading.Event) -> None:
    """Serve the nodes; in lock-step data as it comes, and in between whatever else there is."""
    bulk = [node for node in nodes if node.lockstep] if has_data_path() else []
    data = DataPath(bulk) if bulk else None

    def ended() -> bool:
        return any(node.exit_code is not None for node in nodes)

    while not (stop.is_set() or ended() or _orphaned()):
        if data is None:
            serve(nodes[0], executor, POLL)
            continue
        data.serve(_next_look(nodes), ended)
        for node in bulk:
            node.follow_clock()
        for _ in range(CALLBACKS):
            if not serve(nodes[0], executor, 0.0):
                break
    if data is None:  # what has arrived before the end is not lost
        serve_all(nodes[0], executor, DRAINED)


def _next_look(nodes: list[Any]) -> float:
    """When to serve the executor again: soon, and in time for timers that are even faster."""
    fast = [timer for node in nodes for timer in node.timers if timer.timer_period_ns < SERVE * 1e9]
    left = [timer.time_until_next_call() for timer in fast]
    return time.monotonic() + min([SERVE, *(max(0, ns) / 1e9 for ns in left if ns is not None)])


def serve(node: Any, executor: SingleThreadedExecutor, timeout: float) -> bool:
    """Run a callback that is ready within so many s; whether there was one."""
    entity: Any = None
    try:
        callback, entity, node = executor.wait_for_ready_callbacks(timeout_sec=timeout)
        callback()
        callback.result()
    except TimeoutException:
        return False
    # a broken request, a parameter of a type that does not exist
    except (RCLError, RMWError, ValueError) as error:
        if isinstance(error, ValueError) and not isinstance(entity, Service):
            raise
        node.get_logger().error(f'refused: {first_line(error)}')
    return True


def serve_all(node: Any, executor: SingleThreadedExecutor, most: int) -> None:
    """Run all callbacks that are ready, at most so many.

    For rclpy the time is up after each round, which brings one message of each topic, however many
    wait: that nothing is left it says at the second time.
    """
    idle = 0
    while idle < 2 and most > 0:
        if serve(node, executor, 0.0):
            idle, most = 0, most - 1
        else:
            idle += 1


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
    """Notification of a POSIX timer: `struct sigevent`."""

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
    once = (ctypes.c_long * 4)(0, 0, *divmod(int(seconds * NANOSECONDS), NANOSECONDS))
    libc.timer_settime(timer, 0, once, None)
    try:
        yield
    finally:
        libc.timer_delete(timer)


def _orphaned() -> bool:
    parent = os.environ.get(PARENT)
    return parent is not None and os.getppid() != int(parent)


def main_of(*makes: Callable[[], Any]) -> NoReturn:
    """Entry point of an executable with one node, or several."""
    # all is closed and said: Python would take a second to unload numba and the middleware
    os._exit(live(makes))
