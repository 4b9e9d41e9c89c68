"""Real nodes as processes, and a rclpy participant that talks to them."""

import itertools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import rclpy
from helpers.fork_server import ForkServer, Process
from helpers.patience import patience
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.srv import GetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from auv_analysis.graph.domain import is_free
from auv_dynamics.ros import topics
from auv_dynamics.ros.endpoints import UNNAMED
from auv_dynamics.ros.node_main import serve_all
from auv_dynamics.ros.security import loopback

PATIENCE = patience(30.0)  # s, after which a test that waits has failed
_domains = itertools.count()


def fresh_domain() -> int:
    """Domain id of its own for each test, apart from those of parallel workers."""
    worker = int(os.environ.get('PYTEST_XDIST_WORKER', 'gw0')[2:])
    share = 100 // int(os.environ.get('PYTEST_XDIST_WORKER_COUNT', '1'))
    limit = time.monotonic() + PATIENCE
    while time.monotonic() < limit:
        domain = 1 + worker * share + (os.getpid() + next(_domains)) % share
        if is_free(domain):  # `auv` picks its own from all of them
            return domain
    raise RuntimeError(f'none of the {share} domains of this worker is free')


def environment(domain: int) -> dict[str, str]:
    """Environment of a process on the loopback in a domain."""
    return {**os.environ, **loopback(), 'ROS_DOMAIN_ID': str(domain), 'PYTHONUNBUFFERED': '1'}


@cache
def fork_server() -> ForkServer:
    """The process that forks the programs of this run."""
    return ForkServer()


def start_node(name: str, domain: int, *arguments: str) -> Process:
    """Start one of our nodes; its output is captured."""
    given = ['--ros-args', *arguments] if arguments else []
    return fork_server().start([name, *given], environment(domain))


def run_node(name: str, *arguments: str) -> subprocess.CompletedProcess:
    """Run a node that is expected to end by itself."""
    process = start_node(name, fresh_domain(), *arguments)
    output, _ = process.communicate(timeout=PATIENCE)
    return subprocess.CompletedProcess(process.args, process.returncode, output, '')


def assert_one_line(ended: subprocess.CompletedProcess, *words: str) -> None:
    """Wrong input: exit code 2 and one line with the words in it, `expected` and `found`."""
    assert ended.returncode == 2, ended.stdout
    lines = ended.stdout.strip().splitlines()
    assert len(lines) == 1, ended.stdout
    for word in (*words, 'expected', 'found'):
        assert word in lines[0]


def stop(process: subprocess.Popen, how: int = signal.SIGTERM) -> tuple[int, str]:
    """End a process; its exit code and output."""
    if process.poll() is None:
        process.send_signal(how)
    output, _ = process.communicate(timeout=PATIENCE)
    return process.returncode, output


def parameters(**values: Any) -> list[str]:
    """Command-line parameters; `__` stands for a dot."""
    listed = []
    for name, value in values.items():
        text = str(value).lower() if isinstance(value, bool) else str(value)
        listed += ['-p', f'{name.replace("__", ".")}:={text}']
    return listed


GAINS = parameters(
    gains__k_D='[12.0]', gains__k_I='[1.0]', gains__Lambda='[0.8]', gains__Gamma='[60.0]'
)
CONTROLLER = [*parameters(law='gvc', vehicle='herman2018', limits__wrench='[1e5]'), *GAINS]


class Peer:
    """A participant of the test's own: publishes, listens, calls services."""

    def __init__(self, domain: int):
        os.environ.update(loopback())
        self.context = Context()
        rclpy.init(
            context=self.context,
            domain_id=domain,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        bare = {'start_parameter_services': False, 'enable_rosout': False}
        self.node = rclpy.create_node('test_peer', context=self.context, **bare)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.heard: dict[str, list[Any]] = {}
        self._outputs: dict[str, Any] = {}

    def listen(self, *heard: topics.Topic) -> None:
        """Keep what is published on topics."""
        for topic in heard:
            self.heard[topic.name] = []
            self.node.create_subscription(
                topic.type, topic.name, self.heard[topic.name].append, topics.every_step()
            )

    def publish(self, topic: topics.Topic, message: Any, *, subscribers: int = 1) -> None:
        """Publish once a subscriber has matched."""
        is_new = topic.name not in self._outputs
        if is_new:
            self._outputs[topic.name] = self.node.create_publisher(
                topic.type, topic.name, topics.every_step()
            )
        output = self._outputs[topic.name]
        self.until(lambda: output.get_subscription_count() >= subscribers, f'match {topic.name}')
        if is_new:
            self._matched_by_all(topic)
        output.publish(message)

    def _matched_by_all(self, topic: topics.Topic) -> None:
        """Wait until nodes know of a new publisher: a best-effort end misses what comes before.

        Publishers are told in the order of their making: whoever answers a request has been told
        of the client's, which was made later.
        """

        def nodes() -> set[str]:
            found = self.node.get_subscriptions_info_by_topic(topic.name)
            known = {f'{one.node_namespace.rstrip("/")}/{one.node_name}' for one in found}
            return known - {'/test_peer'}  # which has no services

        def asked() -> set[str]:
            services = dict(self.node.get_service_names_and_types())
            return {node for node in nodes() if f'{node}/get_parameters' in services}

        limit = time.monotonic() + patience(1.0)  # a tool has no parameters, and answers nothing
        self.until(
            lambda: (
                asked() == nodes()
                or (time.monotonic() > limit and not any(UNNAMED in node for node in nodes()))
            )
        )
        for node in asked():
            self.call(GetParameters, f'{node}/get_parameters')

    def until(
        self, done: Callable[[], Any], what: str = 'condition', limit: float = PATIENCE
    ) -> Any:
        """Spin until something is true; fail when it takes too long."""
        end = time.monotonic() + limit
        while not (result := done()):
            assert time.monotonic() < end, f'{what} within {limit:g} s'
            self.executor.spin_once(timeout_sec=0.05)
        return result

    def spin(self, seconds: float) -> None:
        """Listen for a while, to see that something does not come."""
        limit = time.monotonic() + seconds
        while (left := limit - time.monotonic()) > 0:
            self.executor.spin_once(timeout_sec=left)
        serve_all(self.node, self.executor, 1000)  # what has come while it got no turn

    def call(self, kind: type, name: str, request: Any = None, *, once: bool = False) -> Any:
        """Call a service; `once`: a question that changes something is not asked again."""
        client = self.node.create_client(kind, name)
        self.until(client.service_is_ready, f'service {name}')
        if once:  # as above: then both ends of this client are known
            self.call(GetParameters, f'{name.rpartition("/")[0]}/get_parameters')
        futures = []

        def done() -> bool:
            # an answer is lost when it comes before both ends have matched: ask again
            if len(futures) < 1 + (0 if once else (time.monotonic() - began) // 2):
                futures.append(client.call_async(request or kind.Request()))
            return any(future.done() for future in futures)

        began = time.monotonic()
        self.until(done, f'answer of {name}')
        return next(future.result() for future in futures if future.done())

    def close(self) -> None:
        """Leave the domain."""
        self.node.destroy_node()
        self.executor.shutdown()
        rclpy.try_shutdown(context=self.context)


def change(peer: Peer, transition: int) -> bool:
    """Ask the controller for a transition; whether it was made."""
    request = ChangeState.Request(transition=Transition(id=transition))
    return peer.call(ChangeState, 'controller_node/change_state', request, once=True).success


@contextmanager
def graph(
    *nodes: tuple[str, list[str]], domain: int | None = None
) -> Iterator[tuple[Peer, dict[str, subprocess.Popen]]]:
    """Nodes in a domain, by default a fresh one, and a peer beside them; all are ended after it."""
    domain = fresh_domain() if domain is None else domain
    peer = Peer(domain)
    processes = {name: start_node(name, domain, *arguments) for name, arguments in nodes}
    try:
        yield peer, processes
    finally:
        peer.close()
        for name, process in processes.items():
            died = process.poll()
            if died is None:
                process.kill()
            if not process.stdout.closed:
                output, _ = process.communicate(timeout=PATIENCE)
                print(f'--- {name}, exit code {died}\n{output}')  # shown when the test fails


def start_auv(
    *arguments: str, cwd: Path | None = None, domain: int | None = None, **extra: str
) -> Process:
    """Start `auv`, in a domain of the test's."""
    return fork_server().start(['auv', *arguments], _of_auv(domain, extra), str(cwd or ''))


def start_installed_auv(
    *arguments: str,
    cwd: Path | None = None,
    domain: int | None = None,
    stdin: int = subprocess.DEVNULL,
    stdout: int = subprocess.PIPE,
    **extra: str,
) -> subprocess.Popen:
    """Start the installed command, which starts the installed nodes and ends them if it dies."""
    command = [str(Path(sys.executable).with_name('auv')), *arguments]
    streams = {'stdin': stdin, 'stdout': stdout, 'stderr': subprocess.PIPE}
    return subprocess.Popen(command, cwd=cwd, env=_of_auv(domain, extra), text=True, **streams)


def _of_auv(domain: int | None, extra: dict[str, str]) -> dict[str, str]:
    # not a domain of its own choice: a parallel test may be about to use the same
    number = fresh_domain() if domain is None else domain
    return {**os.environ, 'ROS_DOMAIN_ID': str(number), **extra}


def auv(*arguments: str, **options: Any) -> subprocess.CompletedProcess:
    """Run `auv` to its end."""
    return _to_its_end(start_auv(*arguments, **options))


def installed_auv(*arguments: str, **options: Any) -> subprocess.CompletedProcess:
    """Run the installed command to its end."""
    return _to_its_end(start_installed_auv(*arguments, **options))


def _to_its_end(process: Process | subprocess.Popen) -> subprocess.CompletedProcess:
    said = process.communicate(timeout=patience(600))
    return subprocess.CompletedProcess(process.args, process.returncode, *said)
