"""The analysis node against the independent implementation, every axis different."""

from collections.abc import Iterator
from pathlib import Path

import herman_reference as reference
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from helpers import nodes_in_process as by_hand
from helpers.nodes_in_process import Program, program, write_vehicle
from numpy.testing import assert_allclose
from rclpy.serialization import serialize_message
from reference_cases import off_centre

from auv_analysis.nodes import analysis_node
from auv_analysis.nodes.analysis_node import AnalysisNode
from auv_dynamics.ros import topics
from auv_dynamics.ros.interface import DEPTH

STEP = 10_000_000
EVERY = 3
RNG = np.random.default_rng(7)
NU, NU_D, TAU, F, ESTIMATE = (RNG.uniform(-1, 1, (10, 6)) * scale for scale in (1, 2, 80, 30, 20))
SAID = {  # topic -> what it is of step k, by the independent implementation, and its unit's size
    'analysis/kinetic_energy': lambda k: energy(NU[k]),
    'analysis/kinetic_energy_shares': lambda k: 100 * energy(NU[k]) / energy(NU[k]).sum(),
    'analysis/delta_xi': lambda k: np.linalg.solve(UPSILON, NU[k]) - NU[k],
    'analysis/delta_pi': lambda k: UPSILON.T @ TAU[k] - TAU[k],
    'analysis/lumped_error': lambda k: ESTIMATE[k] - F[k],
}
UPSILON, N = reference.decompose(reference.vehicle_matrices(off_centre())['M'])


def energy(nu: np.ndarray) -> np.ndarray:
    return reference.kinetic_energy(N, UPSILON, nu)[1]


def of_step(k: int) -> dict[topics.Topic, object]:
    x = np.array([1.0, -2.0, 3.0, 0.5, -0.5, 0.5, 0.5, *NU[k]])
    values = {topics.CMD_VEL: NU_D, topics.WRENCH: TAU, topics.DISTURBANCE: F}
    values[topics.DISTURBANCE_ESTIMATE] = ESTIMATE
    said = {t: by_hand.six(t.type, k * STEP, rows[k]) for t, rows in values.items()}
    return {topics.ODOM: by_hand.odometry(k * STEP, x), **said}


@pytest.fixture(scope='module')
def vehicle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_vehicle(tmp_path_factory.mktemp('vehicle'), off_centre())


@pytest.fixture
def analysis(vehicle: Path) -> Iterator[Program]:
    with program() as made:
        made.add(AnalysisNode, {'vehicle': str(vehicle), 'every': EVERY})
        made.listen(*topics.ANALYSIS_TOPICS, topics.DIAGNOSTICS)
        assert {topic.name for topic in topics.ANALYSIS_TOPICS} == {*SAID}
        for name in SAID:
            made.until(lambda n=name: made.node.count_publishers(n), name)
        yield made


def heard(made: Program, name: str, count: int) -> list:
    return made.until(lambda: len(made.heard[name]) >= count and made.heard[name], name)


def test_every_published_axis_is_that_of_the_independent_implementation(analysis) -> None:
    assert not np.isclose(UPSILON[np.triu_indices(6, 1)], 0.0).all(axis=0)
    for k in range(10):
        for topic, message in of_step(k).items():
            analysis.publish(topic, message)
    for name, expected in SAID.items():
        found = heard(analysis, name, 4)
        assert [by_hand.ns_of(m) for m in found] == [k * STEP for k in range(0, 10, EVERY)], name
        for k, message in zip(range(0, 10, EVERY), found, strict=True):
            assert by_hand.frames_of(message) == ('base_link_fsd',)
            assert_allclose(by_hand.six_of(message), expected(k), rtol=1e-9, atol=1e-12)


def test_messages_that_come_in_any_order_are_paired_by_their_stamps(analysis) -> None:
    messages = {k: of_step(k) for k in range(8)}
    order = [topics.DISTURBANCE_ESTIMATE, topics.WRENCH, topics.ODOM, topics.CMD_VEL]
    for topic in [*order, topics.DISTURBANCE]:
        for k in range(8):
            analysis.publish(topic, messages[k][topic])
    for name, expected in SAID.items():
        for k, message in zip((0, 3, 6), heard(analysis, name, 3), strict=True):
            assert by_hand.ns_of(message) == k * STEP
            assert_allclose(by_hand.six_of(message), expected(k), rtol=1e-9, atol=1e-12)


def give(made: Program, topic: topics.Topic, message: object) -> None:
    """Hand a message to the node as the middleware would."""
    (node,) = made.nodes
    (end,) = [one for one in node.subscriptions if one.topic_name == f'/{topic.name}']
    end.callback(serialize_message(message), {})


def test_as_many_wait_for_their_odometry_as_the_middleware_keeps_twice(analysis) -> None:
    rows = np.arange(2 * DEPTH + 1)  # the first one has no room
    for ns in rows:
        give(analysis, topics.WRENCH, by_hand.six(topics.WRENCH.type, int(ns), TAU[1]))
    for ns in (0, 8000, 9000, 1):  # one of three is due: 0 and 1
        x = np.array([1.0, -2.0, 3.0, 0.5, -0.5, 0.5, 0.5, *NU[1]])
        give(analysis, topics.ODOM, by_hand.odometry(ns, x))
    (found,) = heard(analysis, 'analysis/delta_pi', 1)
    assert by_hand.ns_of(found) == 1


def test_a_step_that_is_complete_makes_room_for_another(
    analysis, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(analysis_node, 'CAPACITY', 6)
    for k in range(7):  # two of 0, 3 and 6 may wait
        for topic, message in of_step(k).items():
            if k != 0 or topic is topics.ODOM:
                give(analysis, topic, message)
    give(analysis, topics.WRENCH, of_step(0)[topics.WRENCH])
    found = heard(analysis, 'analysis/delta_pi', 3)
    assert [by_hand.ns_of(message) for message in found] == [3 * STEP, 6 * STEP, 0]


def test_a_run_that_begins_anew_is_not_paired_with_what_was_before(analysis) -> None:
    for k in range(4):
        for topic, message in of_step(k).items():
            give(analysis, topic, message)
    for k in (4, 5, 3, 1, 2, 0):  # 3 and 0 are due again
        give(analysis, topics.ODOM, of_step(k)[topics.ODOM])
    found = heard(analysis, 'analysis/delta_xi', 4)
    assert [by_hand.ns_of(message) for message in found] == [k * STEP for k in (0, 3, 3, 0)]
    analysis.spin(0.1)
    assert len(analysis.heard['analysis/delta_pi']) == 2


def test_a_message_that_is_refused_is_counted_and_holds_nothing_up(analysis) -> None:
    strange = of_step(0)
    strange[topics.WRENCH].header.frame_id = 'elsewhere'
    for topic, message in reversed(strange.items()):  # all of them wait for the odometry
        give(analysis, topic, message)
    for k in range(1, 4):
        for topic, message in of_step(k).items():
            give(analysis, topic, message)
    (found,) = heard(analysis, 'analysis/delta_pi', 1)
    assert by_hand.ns_of(found) == 3 * STEP
    for other in {*SAID} - {'analysis/delta_pi'}:
        assert len(heard(analysis, other, 2)) == 2
    told = analysis.heard['/diagnostics']

    def refused() -> list[str]:
        last = {pair.key: pair.value for pair in told[-1].status[0].values} if told else {}
        return [key for key, value in last.items() if 'wrench' in key and value == '1']

    analysis.until(refused, 'the report')


def test_nothing_is_said_before_all_who_are_expected_listen(vehicle: Path) -> None:
    expected = [f'{topics.DELTA_XI.name}=2']
    given = {'vehicle': str(vehicle), 'every': 1, 'expected_subscribers': expected}
    with program() as made:
        made.add(AnalysisNode, given)
        made.listen(topics.DELTA_XI)
        made.until(lambda: made.node.count_publishers(topics.DELTA_XI.name), 'the node')
        give(made, topics.ODOM, of_step(0)[topics.ODOM])
        first = made.heard[topics.DELTA_XI.name]
        made.listen(topics.DELTA_XI)
        made.until(made.nodes[0].graph.ready, 'both')
        give(made, topics.ODOM, of_step(1)[topics.ODOM])
        heard(made, topics.DELTA_XI.name, 1)
        assert [by_hand.ns_of(message) for message in first] == [STEP]


def test_what_never_comes_holds_nothing_else_up(analysis, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(analysis_node, 'CAPACITY', 6)
    messages = {k: of_step(k) for k in range(10)}
    for k in range(10):  # two of 0, 3, 6 and 9 may wait
        analysis.publish(topics.ODOM, messages[k][topics.ODOM])
    heard(analysis, 'analysis/delta_xi', 4)
    for k in (0, 3, 6, 9):
        analysis.publish(topics.WRENCH, messages[k][topics.WRENCH])
    found = heard(analysis, 'analysis/delta_pi', 2)
    analysis.spin(0.1)
    assert [by_hand.ns_of(message) for message in found] == [6 * STEP, 9 * STEP]


def test_health_tells_the_vehicle_the_newest_step_and_the_error_of_its_velocity(analysis) -> None:
    told = analysis.heard['/diagnostics']
    (silent,) = analysis.until(lambda: told and told[-1].status, 'diagnostics')
    assert (silent.level, silent.message) == (DiagnosticStatus.STALE, 'nobody publishes /odom')
    mute = analysis.node.create_publisher(topics.ODOM.type, topics.ODOM.name, 10)
    analysis.until(lambda: told[-1].status[0].message == 'no odometry yet', 'a publisher')
    analysis.node.destroy_publisher(mute)
    for k in range(5):
        for topic in (topics.CMD_VEL, topics.ODOM):
            analysis.publish(topic, of_step(k)[topic])

    def of_step_three() -> DiagnosticStatus | None:
        return told[-1].status[0] if by_hand.ns_of(told[-1]) == 3 * STEP else None

    status = analysis.until(of_step_three, 'diagnostics of step 3')
    facts = {pair.key: pair.value for pair in status.values}
    assert (status.level, status.message) == (DiagnosticStatus.OK, 'ok')
    assert (status.name, status.hardware_id) == ('/analysis_node', 'rexrov')
    expected = np.abs(NU_D[3] - NU[3]).max()
    assert float(facts['largest velocity error']) == pytest.approx(expected, rel=1e-12)


def test_where_sensors_lie_the_truth_is_looked_at(vehicle: Path) -> None:
    with program() as made:
        made.add(AnalysisNode, {'vehicle': str(vehicle), 'every': 1, 'ground_truth': True})
        made.listen(topics.DELTA_XI, topics.DIAGNOSTICS)
        told = made.heard['/diagnostics']
        made.until(lambda: told, 'diagnostics')
        assert told[0].status[0].message == 'nobody publishes /ground_truth/odom'
        made.publish(topics.GROUND_TRUTH, of_step(2)[topics.ODOM])
        (message,) = heard(made, 'analysis/delta_xi', 1)
        expected = SAID['analysis/delta_xi'](2)
        assert_allclose(by_hand.six_of(message), expected, rtol=1e-9, atol=1e-12)


def test_however_few_steps_are_looked_at_they_are_waited_for(
    analysis, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(analysis_node, 'CAPACITY', EVERY - 1)
    for message_of_topic in of_step(0).items():
        give(analysis, *message_of_topic)
    for name in SAID:
        assert by_hand.ns_of(heard(analysis, name, 1)[0]) == 0
