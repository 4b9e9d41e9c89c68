"""What a node says while it lives, and the end of its process."""

import itertools
import math
import os
import subprocess
import sys
import threading
from types import SimpleNamespace
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from helpers.node_processes import PATIENCE, environment, fresh_domain
from helpers.nodes_in_process import odometry, program
from helpers.patience import patience
from rclpy.duration import Duration
from rclpy.service import Service

from auv_analysis.nodes.analysis_node import AnalysisNode
from auv_dynamics.ros import convert, node_interface, node_main, topics
from auv_dynamics.ros.interface import PARENT
from auv_dynamics.ros.node_main import BulkNode
from auv_gvc_controller.nodes.setpoint_node import SetpointNode


class Made(BulkNode):
    """A node with what every node has in common."""

    def __init__(self, **options: Any):
        super().__init__('made', **options)
        self.graph = node_interface.NodeInterface(self)


STUCK = """
import ctypes, sys
from auv_dynamics.ros import node_main
from auv_dynamics.ros.node_main import BulkNode

class Stuck(BulkNode):
    def __init__(self):
        super().__init__('stuck')
        print('said')  # and not flushed
        self.exit_code = int(sys.argv[1])

    def destroy_node(self):
        ctypes.PyDLL(None).sleep(60)  # with the GIL held

node_main.TEARDOWN = 0.5
sys.exit(node_main.live([Stuck], args=[]))
"""


@pytest.mark.parametrize('code', [0, 1])
def test_a_teardown_without_end_does_not_change_the_exit_code(code: int) -> None:
    command = [sys.executable, '-c', STUCK, str(code)]
    env = environment(fresh_domain()) | {'PYTHONUNBUFFERED': ''}
    ended = subprocess.run(
        command, env=env, stdout=subprocess.PIPE, text=True, timeout=PATIENCE, check=False
    )
    assert (ended.returncode, ended.stdout) == (code, 'said\n')


@pytest.mark.parametrize('orphaned', [False, True])
def test_all_that_has_arrived_before_the_end_is_taken(monkeypatch, orphaned: bool) -> None:
    """That of `auv run`, by which it was started, is its end as well."""
    monkeypatch.setenv(PARENT, str(os.getppid()))
    assert not node_main._orphaned()
    stop, taken = threading.Event(), []
    if orphaned:
        monkeypatch.setenv(PARENT, str(os.getpid()))
    else:
        stop.set()
    guard = threading.Timer(patience(30.0), stop.set)
    with program() as made:
        node = made.add(Made, {'lockstep': False})
        node.create_subscription(topics.WRENCH.type, 'late', taken.append, topics.every_step())
        says = made.node.create_publisher(topics.WRENCH.type, 'late', topics.every_step())
        made.until(says.get_subscription_count)
        for _ in range(30):
            says.publish(topics.WRENCH.type())
        assert says.wait_for_all_acked(Duration(seconds=patience(30.0)))
        guard.start()
        node_main._spin([node], made.executor, stop)
        guard.cancel()
        assert stop.is_set() != orphaned
        assert len(taken) == 30


@pytest.mark.parametrize('lockstep', [True, False])
@pytest.mark.parametrize(
    ('kind', 'more'), [(SetpointNode, {}), (AnalysisNode, {'vehicle': 'rexrov'})]
)
def test_odometry_that_stays_away_is_told_in_real_time(
    kind: type, more: dict[str, str], lockstep: bool
) -> None:
    with program() as made:
        made.add(kind, {**more, 'lockstep': lockstep})
        made.listen(topics.DIAGNOSTICS)
        told = made.heard[topics.DIAGNOSTICS.name]

        def health() -> tuple[bytes, str]:
            return (told[-1].status[0].level, told[-1].status[0].message) if told else (b'', '')

        silent, step = DiagnosticStatus.STALE, itertools.count()
        for _ in range(2):  # also after it has come back
            made.until(lambda: silent in health(), 'no odometry')

            def goes_on() -> bool:
                made.publish(topics.ODOM, odometry(next(step) * 10_000_000, [0, 0, 0, 1, *[0] * 9]))
                return health() == (DiagnosticStatus.OK, 'ok')

            made.until(goes_on, 'odometry')
            if lockstep:
                del told[:]
                made.until(lambda: len(told) > 2, 'two seconds')
                assert health() == (DiagnosticStatus.OK, 'ok'), 'there a pause is no fault'
                return
            made.until(lambda: health()[1].startswith('no odometry for '), 'silence')


def test_in_lock_step_the_time_of_a_node_is_the_newest_that_is_simulated() -> None:
    stop, looks = threading.Event(), itertools.count()
    with program() as made:
        node = made.add(Made, {'lockstep': True, 'use_sim_time': True})
        node.bulk = True  # nobody else takes what arrives
        made.listen(topics.CLOCK)
        for ns in (3, 8):
            made.publish(topics.CLOCK, topics.CLOCK.type(clock=convert.stamp(ns)), subscribers=2)
        made.until(lambda: len(made.heard[topics.CLOCK.name]) == 2)

        def look() -> None:
            if node.get_clock().now().nanoseconds == 8 or next(looks) > patience(1000.0):
                stop.set()

        node_interface.steady_timer(node, 0.01, look)
        node_main._spin([node], made.executor, stop)
        assert node.get_clock().now().nanoseconds == 8


def serving(entity: Any = None) -> SimpleNamespace:
    """An executor that never runs out of callbacks; those of an entity raise ValueError."""

    def result() -> None:
        if entity is not None:
            raise ValueError('no number')

    def callback() -> None:
        calls.append(len(calls))

    callback.result = result
    calls: list[int] = []
    logger = SimpleNamespace(error=calls.append)
    node = SimpleNamespace(get_logger=lambda: logger)
    ready = callback, entity, node
    return SimpleNamespace(calls=calls, wait_for_ready_callbacks=lambda timeout_sec: ready)


def test_no_more_is_served_than_is_asked_for_and_a_broken_request_is_refused() -> None:
    busy = serving()
    node_main.serve_all(None, busy, 7)
    assert busy.calls == [*range(7)]
    asked = serving(object.__new__(Service))
    assert node_main.serve(None, asked, 0.0)
    assert asked.calls == [0, 'refused: no number']
    with pytest.raises(ValueError, match='no number'):  # our own mistake, which ends the node
        node_main.serve(None, serving(object()), 0.0)


def test_the_worst_is_told_of_what_has_a_text() -> None:
    health = [(node_interface.OK, ''), (node_interface.WARN, 'a'), (node_interface.STALE, 'b'),
              (node_interface.ERROR, 'c')]  # fmt: skip
    for k in range(4):
        assert node_interface.worst([*health[k::-1], (node_interface.ERROR, '')]) == health[k]


def test_timers_that_are_faster_than_a_look_at_services_are_served_in_time(monkeypatch) -> None:
    monkeypatch.setattr('time.monotonic', lambda: 7.0)

    def next_look(*timers: tuple[float, float | None]) -> float:
        made = [SimpleNamespace(timer_period_ns=period * 1e9, time_until_next_call=lambda s=left: s)
                for period, left in timers]  # fmt: skip
        return node_main._next_look([SimpleNamespace(timers=[one]) for one in made])

    assert next_look() == next_look((0.05, 1e7), (1.0, 0.0)) == 7.05
    assert next_look((0.04, None), (0.03, 2e7), (0.02, 1e7)) == 7.01
    assert next_look((0.04, -5.0)) == 7.0


@pytest.mark.parametrize(('loud', 'logged'), [(math.inf, [1, 4]), (0.0, [1, 2, 3, 4, 5])])
def test_the_like_of_a_report_is_not_logged_at_once_again(
    monkeypatch, capfd: pytest.CaptureFixture, loud: float, logged: list[int]
) -> None:
    monkeypatch.setattr(node_interface, 'LOUD', loud)
    reports = [
        f'{topic}: found {k}'
        for k, topic in enumerate(('odom', 'odom', 'odom', 'twist', 'odom'), 1)
    ]
    with program() as made:
        graph = made.add(Made, {}).graph
        monkeypatch.setattr('time.monotonic', lambda: 7.0)
        for report in reports:
            graph.complain(report)
            assert graph.trouble == report
    said = [line for line in capfd.readouterr().err.splitlines() if '[ERROR]' in line]
    assert [int(line.rpartition(' ')[2]) for line in said] == logged


def test_what_lasts_is_logged_once_and_then_every_ten_seconds(monkeypatch) -> None:
    said: list[tuple[str, str]] = []

    class Logger:
        def __getattr__(self, level: str):
            return lambda text: said.append((level, text))

    lasting, now = node_interface.Lasting(Logger()), 0.0
    monkeypatch.setattr('time.monotonic', lambda: now)
    for now in range(100, 125):
        lasting.see(node_interface.WARN, f'no set-point for {now} s')
    assert said == [('warning', f'no set-point for {at} s') for at in (101, 111, 121)]
    lasting.see(node_interface.OK, '')
    assert said[3:] == [('info', 'over: no set-point for 124 s')]
    lasting.see(node_interface.ERROR, 'too short')
    lasting.see(node_interface.OK, '')
    assert len(said) == 4
    for now in (130, 131):
        lasting.see(node_interface.ERROR, f'two of them for {now - 130} s')
    assert said[4:] == [('error', 'two of them for 1 s')], 'which `auv run` repeats'
