"""Health of a graph: who is there, what was refused, what is silent; and a snapshot as JSON."""

import json
from types import SimpleNamespace

import pytest

from auv_analysis.watch.gauge import HEARD, Gauge
from auv_analysis.watch.health import KEPT, SILENT
from auv_analysis.watch.snapshot import NodeState
from auv_dynamics import load_vehicle
from auv_dynamics.ros import interface

STEP = 10_000_000
STATE = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, *[0.1] * 6)


def ends(publishers: int = 1, foreign: str = '', conflicts: tuple = ()) -> SimpleNamespace:
    return SimpleNamespace(
        publishers=publishers, subscribers=2, foreign=foreign, conflicts=conflicts
    )


def texts(gauge: Gauge, now: float) -> list[tuple[str, str]]:
    return [(trouble.level, trouble.text) for trouble in gauge.snapshot(now).troubles]


def topic(gauge: Gauge, now: float, name: str):
    return next(one for one in gauge.snapshot(now).topics if one.name == name)


def test_nobody_there_is_no_trouble() -> None:
    gauge = Gauge(7, '/auv1', begin=100.0)
    gauge.see(101.0, dict.fromkeys(HEARD, ends(0)))
    snapshot = gauge.snapshot(102.0)
    assert (snapshot.domain, snapshot.namespace, snapshot.seconds) == (7, '/auv1', 2.0)
    assert not snapshot.heard
    assert not snapshot.published
    assert snapshot.troubles == ()


def test_diagnostics_are_of_all_namespaces_and_no_sign_of_this_graph() -> None:
    gauge = Gauge(0)
    gauge.see(0.0, {interface.DIAGNOSTICS: ends(), interface.ODOM: ends(0)})
    gauge.hear(0.0, interface.DIAGNOSTICS, 0, 0, None)
    assert not gauge.snapshot(0.0).heard
    assert not gauge.snapshot(0.0).published
    gauge.see(0.0, {interface.ODOM: ends()})
    gauge.hear(0.0, interface.ODOM, 0, 0, STATE)
    assert gauge.snapshot(0.0).heard
    assert gauge.snapshot(0.0).published


def test_a_snapshot_is_plain_json_without_and_with_everything() -> None:
    gauge = Gauge(0, vehicle=load_vehicle('herman2018'))
    json.dumps(gauge.snapshot(0.0).document(), allow_nan=False)
    for k in range(30):
        gauge.hear(k / 10, interface.CMD_VEL, k, k * STEP, (0.3,) * 6)
        gauge.hear(k / 10, interface.ODOM, k, k * STEP, STATE)
        gauge.hear(k / 10, interface.WRENCH, k, k * STEP, (1.0,) * 6)
        gauge.hear(k / 10, interface.PROGRESS, k, k * STEP, None)
    found = json.loads(json.dumps(gauge.snapshot(2.9).document(), allow_nan=False))
    assert found['velocity_error']['now'] == pytest.approx([0.2] * 6)
    assert found['computed'] is True
    assert found['time'] == found['recorded'] == pytest.approx(0.29)
    assert found['pace'] == pytest.approx(0.1)
    assert found['structural_zeros']['delta_xi'] == ['pitch', 'yaw']
    assert {entry['name'] for entry in found['topics']} == set(HEARD)


def test_computed_means_that_the_graph_does_not_publish_it() -> None:
    gauge = Gauge(0, vehicle=load_vehicle('herman2018'))
    gauge.hear(0.0, interface.ODOM, 0, 0, STATE)
    assert gauge.snapshot(0.0).computed
    for name in interface.ANALYSIS_TOPICS:
        gauge.hear(0.0, name, 0, 0, (1.0,) * 6)
    assert not gauge.snapshot(0.0).computed
    assert not Gauge(0).snapshot(0.0).computed


def test_refused_messages_are_one_line_that_fades() -> None:
    gauge = Gauge(0)
    for i in range(3):
        text = f'{interface.WRENCH}: expected finite numbers, found (nan, {i})'
        gauge.refuse(float(i), interface.WRENCH, text)
        gauge.hear(float(i), interface.WRENCH, i, i * STEP, None)
    (trouble,) = gauge.snapshot(3.0).troubles
    assert (trouble.level, trouble.count, trouble.age) == ('error', 3, 1.0)
    assert trouble.text.endswith('found (nan, 2)'), 'the newest of them'
    assert topic(gauge, 3.0, interface.WRENCH).refused == 3
    assert gauge.snapshot(3.0).tau is None
    assert gauge.snapshot(2.0 + KEPT).troubles == ()


def test_endpoints_that_do_not_fit_are_errors() -> None:
    gauge = Gauge(0)
    conflict = f'{interface.ODOM}: incompatible QoS of a and b: reliability'
    seen = {
        interface.ODOM: ends(conflicts=(conflict,)),
        interface.WRENCH: ends(0, foreign='std_msgs/msg/String'),
        interface.CMD_VEL: ends(2),
    }
    gauge.see(0.0, seen)
    found = texts(gauge, 0.1)
    assert found[0] == ('error', conflict)
    assert found[1][0] == 'error'
    assert 'found std_msgs/msg/String' in found[1][1]
    assert found[2] == ('warning', f'{interface.CMD_VEL}: expected one publisher, found 2')


def test_what_is_published_and_does_not_come_is_said() -> None:
    gauge = Gauge(0)
    gauge.see(0.0, {interface.ODOM: ends(), interface.WRENCH: ends(), interface.PROGRESS: ends()})
    gauge.hear(0.0, interface.ODOM, 0, 0, STATE)
    assert texts(gauge, SILENT) == []
    (level, text), *rest = texts(gauge, SILENT + 0.1)
    assert level == 'warning'
    assert text.endswith(f': {interface.ODOM}, {interface.WRENCH}')
    assert rest == []
    gauge.see(4.0, {interface.ODOM: ends(0), interface.WRENCH: ends(0)})
    assert texts(gauge, 5.0) == [], 'a run that has ended is no trouble'


def test_nodes_that_complain_and_nodes_that_fall_silent() -> None:
    gauge = Gauge(0)
    gauge.diagnose(0.0, NodeState('/plant_node', 'ok', 'ok', 0.0, {'step': '7'}))
    gauge.diagnose(0.0, NodeState('/controller_node', 'error', 'refused: odom', 0.0))
    assert texts(gauge, 1.0) == [('error', '/controller_node: refused: odom')]
    names = [(node.name, node.level) for node in gauge.snapshot(1.0).nodes]
    assert names == [('/controller_node', 'error'), ('/plant_node', 'ok')]
    gauge.diagnose(2.0, NodeState('/controller_node', 'ok', 'ok', 0.0))
    assert texts(gauge, 2.5) == []
    levels = {node.name: node.level for node in gauge.snapshot(4.0).nodes}
    assert levels == {'/plant_node': 'stale', '/controller_node': 'ok'}
    assert gauge.snapshot(2.0 + KEPT).nodes == ()


def test_set_points_of_another_clock_are_a_warning() -> None:
    gauge = Gauge(0)
    for k in range(50):
        gauge.hear(k / 100, interface.CMD_VEL, k, 10**18 + k * STEP, (0.1,) * 6)
        gauge.hear(k / 100, interface.ODOM, k, k * STEP, STATE)
    assert texts(gauge, 0.5) == [
        ('warning', f'{interface.CMD_VEL}: expected a set-point of the last second, found none')
    ]


def test_another_run_in_the_same_domain_begins_anew() -> None:
    gauge = Gauge(0)
    gauge.hear(0.0, interface.CMD_VEL, 1, 0, (5.0,) * 6)
    for k in range(100):
        gauge.hear(k / 100, interface.ODOM, k + 1, k * STEP, STATE)
    gauge.hear(3.0, interface.ODOM, 1, 0, STATE)
    snapshot = gauge.snapshot(3.0)
    assert (snapshot.time, snapshot.nu_d) == (0.0, None)


def test_load_is_what_is_published() -> None:
    gauge = Gauge(0)
    for k in range(100):
        for name, every in ((interface.ODOM, 1), (interface.WRENCH, 10)):
            gauge.hear(k / 100, name, every * k, k * STEP, None)
    assert gauge.load(1.0) == pytest.approx(1100.0)
