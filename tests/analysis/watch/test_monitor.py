"""Health of a graph: who is there, what was refused, what is silent; and a snapshot as JSON."""

import json
from types import SimpleNamespace

import pytest

from auv_analysis.watch import monitor as module
from auv_analysis.watch.monitor import (
    HEARD,
    KEPT,
    SILENT,
    GraphMonitor,
)
from auv_analysis.watch.snapshot import NodeState
from auv_dynamics import load_vehicle
from auv_dynamics.ros import interface

STEP = 10_000_000
STATE = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, *[0.1] * 6)


def ends(publishers: int = 1, foreign: str = '', conflicts: tuple = ()) -> SimpleNamespace:
    return SimpleNamespace(
        publishers=publishers, subscribers=2, foreign=foreign, conflicts=conflicts
    )


def texts(monitor: GraphMonitor, now: float) -> list[tuple[str, str]]:
    return [(alert.level, alert.text) for alert in monitor.snapshot(now).alerts]


def topic(monitor: GraphMonitor, now: float, name: str):
    return next(one for one in monitor.snapshot(now).topics if one.name == name)


def test_nobody_there_is_no_trouble() -> None:
    monitor = GraphMonitor(7, '/auv1', begin=100.0)
    monitor.see(101.0, dict.fromkeys(HEARD, ends(0)))
    snapshot = monitor.snapshot(102.0)
    assert (snapshot.domain, snapshot.namespace, snapshot.seconds) == (7, '/auv1', 2.0)
    assert not snapshot.heard
    assert not snapshot.published
    assert snapshot.alerts == ()


def test_diagnostics_are_of_all_namespaces_and_no_sign_of_this_graph() -> None:
    monitor = GraphMonitor(0)
    monitor.see(0.0, {interface.DIAGNOSTICS: ends(), interface.ODOM: ends(0)})
    monitor.hear(0.0, interface.DIAGNOSTICS, 0, 0, None)
    assert not monitor.snapshot(0.0).heard
    assert not monitor.snapshot(0.0).published
    monitor.see(0.0, {interface.ODOM: ends()})
    monitor.hear(0.0, interface.ODOM, 0, 0, STATE)
    assert monitor.snapshot(0.0).heard
    assert monitor.snapshot(0.0).published


def test_a_snapshot_is_plain_json_without_and_with_everything() -> None:
    monitor = GraphMonitor(0, vehicle=load_vehicle('herman2018'))
    json.dumps(monitor.snapshot(0.0).document(), allow_nan=False)
    for k in range(30):
        monitor.hear(k / 10, interface.CMD_VEL, 2 * k, k * STEP, (0.3,) * 6)
        monitor.hear(k / 10, interface.ODOM, k, k * STEP, STATE)
        monitor.hear(k / 10, interface.WRENCH, k, k * STEP, (1.0,) * 6)
        monitor.hear(k / 10, interface.PROGRESS, k, k * STEP, None)
    found = json.loads(json.dumps(monitor.snapshot(2.9).document(), allow_nan=False))
    assert found['velocity_error']['now'] == pytest.approx([0.2] * 6)
    assert (found['nu'], found['nu_d'], found['tau']) == ([0.1] * 6, [0.3] * 6, [1.0] * 6)
    command = next(entry for entry in found['topics'] if entry['name'] == interface.CMD_VEL)
    assert (command['heard'], command['published'], command['age']) == (30, 59, 0.0)
    assert found['computed'] is True
    assert found['time'] == found['recorded'] == pytest.approx(0.29)
    assert found['pace'] == pytest.approx(0.1)
    assert found['structural_zeros']['delta_xi'] == ['pitch', 'yaw']
    assert {entry['name'] for entry in found['topics']} == set(HEARD)


def test_computed_means_that_the_graph_does_not_publish_it() -> None:
    monitor = GraphMonitor(0, vehicle=load_vehicle('herman2018'))
    monitor.hear(0.0, interface.ODOM, 0, 0, STATE)
    assert monitor.snapshot(0.0).computed
    for name in interface.ANALYSIS_TOPICS:
        monitor.hear(0.0, name, 0, 0, (1.0,) * 6)
    assert not monitor.snapshot(0.0).computed
    assert not GraphMonitor(0).snapshot(0.0).computed


def test_refused_messages_are_one_line_that_fades() -> None:
    monitor = GraphMonitor(0)
    monitor.complain(0.0, 'the first trouble')
    for i in range(3):
        text = f'{interface.WRENCH}: expected finite numbers, found (nan, {i})'
        monitor.refuse(float(i), interface.WRENCH, text)
        monitor.hear(float(i), interface.WRENCH, i, i * STEP, None)
    alert, older = monitor.snapshot(3.0).alerts
    assert older.text == 'the first trouble', 'below what is newer'
    assert (alert.level, alert.count, alert.age) == ('error', 3, 1.0)
    assert alert.text.endswith('found (nan, 2)'), 'the newest of them'
    assert topic(monitor, 3.0, interface.WRENCH).refused == 3
    assert monitor.snapshot(3.0).tau is None
    assert monitor.snapshot(2.0 + KEPT).alerts == ()


def test_endpoints_that_do_not_fit_are_errors() -> None:
    monitor = GraphMonitor(0)
    conflict = f'{interface.ODOM}: incompatible QoS of a and b: reliability'
    seen = {
        interface.ODOM: ends(conflicts=(conflict,)),
        interface.WRENCH: ends(0, foreign='std_msgs/msg/String'),
        interface.CMD_VEL: ends(2),
        interface.KINETIC_ENERGY: ends(2),
    }
    monitor.see(0.0, seen)
    found = texts(monitor, 0.1)
    assert found[0] == ('error', conflict)
    assert found[1][0] == 'error'
    assert 'found std_msgs/msg/String' in found[1][1]
    assert found[2:] == [
        ('warning', f'{name}: expected one publisher, found 2')
        for name in (interface.CMD_VEL, interface.KINETIC_ENERGY)
    ]
    counts = {t.name: (t.publishers, t.subscribers) for t in monitor.snapshot(0.1).topics}
    assert [counts[name] for name in seen] == [(1, 2), (0, 2), (2, 2), (2, 2)]


def test_what_is_published_and_does_not_come_is_said() -> None:
    monitor = GraphMonitor(0)
    for now in (0.0, 1.0, 2.0):
        monitor.see(
            now, dict.fromkeys((interface.ODOM, interface.WRENCH, interface.PROGRESS), ends())
        )
    monitor.hear(0.5, interface.ODOM, 0, 0, STATE)
    assert texts(monitor, SILENT) == []
    (alert,) = monitor.snapshot(SILENT + 1.0).alerts
    assert (alert.level, alert.age) == ('warning', SILENT + 0.5), 'since all of them are silent'
    assert alert.text.endswith(f': {interface.ODOM}, {interface.WRENCH}')
    monitor.see(4.0, {interface.ODOM: ends(0), interface.WRENCH: ends(0)})
    assert texts(monitor, 5.0) == [], 'a run that has ended is no alert'


def test_nodes_that_complain_and_nodes_that_fall_silent() -> None:
    monitor = GraphMonitor(0)
    monitor.diagnose(0.0, NodeState('/plant_node', 'ok', 'ok', 0.0, {'step': '7'}))
    monitor.diagnose(0.0, NodeState('/controller_node', 'error', 'refused: odom', 0.0))
    (alert,) = monitor.snapshot(1.0).alerts
    assert (alert.level, alert.text) == ('error', '/controller_node: refused: odom')
    assert alert.age == 1.0
    names = [(node.name, node.level) for node in monitor.snapshot(1.0).nodes]
    assert names == [('/controller_node', 'error'), ('/plant_node', 'ok')]
    monitor.diagnose(2.0, NodeState('/controller_node', 'ok', 'ok', 0.0))
    assert texts(monitor, 2.5) == []
    levels = {node.name: node.level for node in monitor.snapshot(4.0).nodes}
    assert levels == {'/plant_node': 'stale', '/controller_node': 'ok'}
    assert monitor.snapshot(2.0 + KEPT).nodes == ()


def test_of_many_nodes_those_that_spoke_last_are_kept(monkeypatch) -> None:
    monkeypatch.setattr(module, 'MOST', 2)
    monitor = GraphMonitor(0)
    for now, name in enumerate('abac'):
        monitor.diagnose(now, NodeState(name, 'ok', 'ok', 0.0))
        monitor.complain(now, name)
    assert [(node.name, node.age) for node in monitor.snapshot(3.0).nodes] == [('a', 1), ('c', 0)]
    assert [(one.text, one.count) for one in monitor.snapshot(3.0).alerts] == [('c', 1), ('a', 2)]


def test_errors_of_nodes_come_before_their_warnings() -> None:
    monitor = GraphMonitor(0)
    monitor.diagnose(0.0, NodeState('/controller_node', 'warning', 'no set-point', 0.0))
    monitor.diagnose(0.0, NodeState('/plant_node', 'error', 'refused: wrench', 0.0))
    assert texts(monitor, 1.0) == [
        ('error', '/plant_node: refused: wrench'),
        ('warning', '/controller_node: no set-point'),
    ]


def test_set_points_of_another_clock_are_a_warning() -> None:
    monitor = GraphMonitor(0)
    for k in range(50):
        monitor.hear(k / 100, interface.CMD_VEL, k, 10**18 + k * STEP, (0.1,) * 6)
    assert texts(monitor, 0.5) == [], 'odometry may yet come'
    monitor.hear(0.5, interface.ODOM, 0, 0, STATE)
    assert texts(monitor, 0.5) == [
        ('warning', f'{interface.CMD_VEL}: expected a set-point of the last second, found none')
    ]


def test_another_run_in_the_same_domain_begins_anew() -> None:
    monitor = GraphMonitor(0)
    monitor.hear(0.0, interface.CMD_VEL, 1, 0, (5.0,) * 6)
    for k in range(100):
        monitor.hear(k / 100, interface.ODOM, k + 1, k * STEP, STATE)
    monitor.hear(3.0, interface.ODOM, 1, 0, STATE)
    snapshot = monitor.snapshot(3.0)
    assert (snapshot.time, snapshot.nu_d) == (0.0, None)
