"""Signals while a program takes part in a graph: they wait until rclpy has done what it does."""

import signal
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from helpers.node_processes import PATIENCE, Peer, fresh_domain
from rclpy.context import Context
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import Header
from std_srvs.srv import SetBool

from auv_dynamics.files.errors import FailedError, InputError, on_signals
from auv_dynamics.ros import convert, topics
from auv_dynamics.ros.participant import Participant, Watcher
from auv_dynamics.ros.rclpy_internals import RCLError
from auv_dynamics.ros.security import loopback

CALLS: list[tuple[str, str, Callable[[Watcher], Any]]] = [
    ('_executor', 'spin_once', lambda graph: graph.spin(0.1)),
    ('_node', 'get_node_names_and_namespaces', Watcher.nodes),
    ('_node', 'get_topic_names_and_types', Watcher.endpoints),
    ('_run', 'service_is_ready', Watcher.ask_to_run),
    ('_node', 'destroy_node', Watcher.close),
]


@pytest.fixture
def domain(monkeypatch) -> int:
    for name, value in loopback().items():
        monkeypatch.setenv(name, value)
    return fresh_domain()


@pytest.fixture
def graph(domain: int) -> Iterator[Watcher]:
    made = Watcher(domain)
    yield made
    Node.destroy_node(made._node)  # else it is in the domain until Python looks for garbage
    made._context.try_shutdown()


@pytest.fixture
def peer(graph: Watcher) -> Iterator[Peer]:
    made = Peer(graph._context.get_domain_id())
    yield made
    made.close()


def test_where_ros_does_not_start_one_line_says_why(monkeypatch) -> None:
    def fail(**_: Any) -> None:
        raise RCLError("Failed to create log directory 'nobody/.ros/log': 2\nat a line")

    monkeypatch.setattr(rclpy, 'init', fail)
    with pytest.raises(FailedError, match=r"^ROS does not start: Failed .*'nobody/.ros/log': 2$"):
        Watcher(7)


def test_who_cannot_be_made_leaves_the_domain() -> None:
    contexts: list[Context] = []
    domains: list[int] = []

    def refuse(context: Context) -> Node:
        contexts.append(context)
        domains.append(context.get_domain_id())
        raise InputError('x', 'y', 'z', 'w')

    domain = fresh_domain()
    with pytest.raises(InputError):
        Participant(domain, refuse)
    assert not contexts[0].ok()
    assert domains == [domain]


def until(graph: Watcher, done: Callable[[], bool]) -> None:
    limit = time.monotonic() + PATIENCE
    while not done():
        assert time.monotonic() < limit
        graph.spin(0.05)


def test_who_hears_the_wrench_is_another_vehicle(graph: Watcher, peer: Peer) -> None:
    peer.node.create_subscription(topics.WRENCH.type, '/auv1/wrench', print, 1)
    until(graph, lambda: graph.endpoints() == ['test_peer on /auv1/wrench'])


def test_who_says_how_it_is_lives(graph: Watcher, peer: Peer) -> None:
    said = DiagnosticArray(status=[DiagnosticStatus(name='/plant_node')])
    peer.publish(topics.DIAGNOSTICS, said)
    until(graph, lambda: graph.alive == {'plant_node'})


def test_what_the_plant_waits_for_is_told(graph: Watcher) -> None:
    told = graph.complete_ns, graph.running, graph.waits_for
    assert told == (-1, False, 'plant_node to appear')
    graph._asked = Future()
    graph._asked.set_result(SetBool.Response(success=False, message='analysis_node'))
    assert not graph.ask_to_run()
    assert graph.waits_for == 'analysis_node to be ready'
    assert graph._asked is None, 'it can be asked again'


def test_progress_does_not_go_back(graph: Watcher) -> None:
    for ns in (5, 3):
        graph._on_progress(Header(stamp=convert.stamp(ns)))
    assert graph.complete_ns == 5


def interrupted(inner: Callable[..., Any], ended: list[str]) -> Callable[..., Any]:
    """The same with a signal on its way."""

    def call(*args: Any, **options: Any) -> Any:
        signal.raise_signal(signal.SIGINT)
        found = inner(*args, **options)
        ended.append(inner.__name__)
        return found

    return call


@pytest.mark.parametrize(('part', 'name', 'call'), CALLS, ids=[name for _, name, _ in CALLS])
def test_a_signal_waits_until_rclpy_has_done_it(graph, monkeypatch, part, name, call) -> None:
    ended: list[str] = []
    inner = getattr(graph, part)
    monkeypatch.setattr(inner, name, interrupted(getattr(inner, name), ended))
    with pytest.raises(KeyboardInterrupt):
        call(graph)
    assert ended == [name]


def test_so_it_does_while_the_participant_is_made(domain, monkeypatch) -> None:
    ended: list[str] = []
    inner = interrupted(Node.create_client, ended)
    monkeypatch.setattr(Node, 'create_client', inner)
    with pytest.raises(KeyboardInterrupt):
        Watcher(domain)
    assert ended == ['create_client']


def test_who_takes_signals_in_another_way_is_told_in_that_way(graph, monkeypatch) -> None:
    ended: list[str] = []
    told: list[int] = []
    inner = interrupted(graph._node.get_node_names_and_namespaces, ended)
    monkeypatch.setattr(graph._node, 'get_node_names_and_namespaces', inner)
    with on_signals(lambda: told.append(len(ended))):
        graph.nodes()
    assert told == [1], 'once, after it'
