"""Who is there, and whether they would hear each other."""

import numpy as np
import pytest
from helpers.made_odometry import DRIVER, ODOMETRY, WRENCH, found_in, graph, healthy

from auv_analysis.driver.checks import CHECKS
from auv_analysis.driver.evidence import (
    FAIL,
    NOT_CHECKED,
    PASS,
    CheckResult,
    Endpoint,
    GraphSnapshot,
)

pytestmark = pytest.mark.usefixtures('approved')

CONTROLLER = Endpoint('/controller_node', WRENCH)


def seen_in(seen: GraphSnapshot, clocks: int = 0, **settings: object) -> dict[str, CheckResult]:
    ids = [id for id, check in CHECKS.items() if check.group in ('endpoints', 'qos')]
    heard = healthy(clock_ns=np.zeros(clocks, int))
    return found_in(heard, *ids, seen=seen, **settings)


def test_a_driver_alone_passes() -> None:
    assert {one.verdict for one in seen_in(graph()).values()} == {PASS}


@pytest.mark.parametrize(
    ('seen', 'word'),
    [
        ({'elsewhere': {'/auv1/odom': ('/auv1/driver',)}}, '/auv1/odom of /auv1/driver'),
        ({'topics': ('/odometry', '/rosout')}, 'nearest names: /odometry'),
        ({'topics': ('/rosout',)}, 'on no topic there'),
    ],
)
def test_where_nobody_is_it_says_what_there_is_instead(seen: dict, word: str) -> None:
    finding = seen_in(graph(odom_publishers=(), **seen))['odom_publisher']
    assert finding.verdict == FAIL
    assert 'nobody publishes /odom in ROS_DOMAIN_ID=7' in finding.found
    assert word in finding.found
    assert '--namespace or --odom' in finding.advice


def test_another_type_of_odometry_fails() -> None:
    pose = Endpoint(DRIVER, 'geometry_msgs/msg/PoseStamped')
    finding = seen_in(graph(odom_publishers=(pose,)))['odom_publisher']
    assert finding.verdict == FAIL
    assert 'PoseStamped' in finding.found
    assert ODOMETRY in finding.advice


def test_two_sources_of_odometry_fail_and_are_not_judged_further() -> None:
    both = (Endpoint(DRIVER, ODOMETRY), Endpoint('/other', ODOMETRY))
    found = found_in(healthy(), *CHECKS, seen=graph(odom_publishers=both))
    assert found['odom_publisher'].verdict == FAIL
    assert '/other' in found['odom_publisher'].found
    assert found['rate'].verdict == found['twist_frame'].verdict == NOT_CHECKED
    assert 'several publish odometry' in found['rate'].found


def test_a_wrench_without_a_stamp_fails_and_says_why() -> None:
    plain = Endpoint(DRIVER, 'geometry_msgs/msg/Wrench')
    finding = seen_in(graph(wrench_subscribers=(plain,)))['wrench_subscriber']
    assert finding.verdict == FAIL
    assert 'geometry_msgs/msg/Wrench' in finding.found
    assert 'without its stamp a driver cannot tell an old command' in finding.advice


def test_nobody_who_takes_a_wrench_fails() -> None:
    finding = seen_in(graph(wrench_subscribers=(), listeners={'/tau': ('/driver',)}))
    assert finding['wrench_subscriber'].verdict == FAIL
    assert '/tau of /driver' in finding['wrench_subscriber'].found
    assert finding['qos_wrench'].verdict == NOT_CHECKED


def test_another_node_that_takes_it_is_named() -> None:
    other = Endpoint('/thrusters', WRENCH)
    finding = seen_in(graph(wrench_subscribers=(other,)))['wrench_subscriber']
    assert finding.verdict == PASS
    assert 'not the node that publishes odometry' in finding.found


@pytest.mark.parametrize(
    ('ends', 'actuates', 'verdict'),
    [
        ((), False, PASS),
        ((CONTROLLER,), False, PASS),
        ((CONTROLLER, Endpoint('/joystick', WRENCH)), False, FAIL),
        ((Endpoint('/joystick', 'geometry_msgs/msg/Wrench'),), False, FAIL),
        ((), True, PASS),
        ((CONTROLLER,), True, FAIL),
    ],
)
def test_one_commands_and_nobody_with_actuate(ends: tuple, actuates: bool, verdict: str) -> None:
    finding = seen_in(graph(wrench_publishers=ends), actuates=actuates)['wrench_publishers']
    assert finding.verdict == verdict
    if ends and actuates:
        assert '/controller_node' in finding.found
        assert 'even if it is inactive' in finding.advice


@pytest.mark.parametrize(
    ('there', 'clocks', 'sim_time', 'verdict'),
    [(False, 0, False, PASS), (True, 9, False, FAIL), (True, 9, True, PASS),
     (True, 0, True, FAIL), (False, 0, True, FAIL)],
)  # fmt: skip
def test_simulated_time_is_there_if_it_is_expected(there, clocks, sim_time, verdict) -> None:
    ends = (Endpoint('/simulator', 'rosgraph_msgs/msg/Clock'),) if there else ()
    found = seen_in(graph(clock_publishers=ends), clocks, sim_time=sim_time)
    assert found['clock'].verdict == verdict


def test_two_clocks_are_no_simulated_time() -> None:
    ends = (Endpoint('/simulator', 'rosgraph_msgs/msg/Clock'),) * 2
    assert seen_in(graph(clock_publishers=ends), 9, sim_time=True)['clock'].verdict == FAIL


def test_a_conflict_names_the_policy_and_advises() -> None:
    best_effort = (Endpoint(DRIVER, ODOMETRY, reliability='best_effort'),)
    conflict = {'recorder': 'best effort publisher and reliable subscription'}
    found = seen_in(graph(odom_publishers=best_effort, conflicts=conflict))
    assert found['qos_recorder'].verdict == FAIL
    assert 'reliability best_effort' in found['qos_recorder'].found
    assert 'qos_overrides./odom.subscription.reliability' in found['qos_recorder'].advice
    assert found['qos_controller'].verdict == found['qos_wrench'].verdict == PASS


@pytest.mark.parametrize('key', ['controller', 'recorder', 'wrench'])
def test_each_conflict_is_of_the_one_who_has_it(key: str) -> None:
    found = seen_in(graph(conflicts={key: 'they differ'}))
    assert [id for id, one in found.items() if one.verdict == FAIL] == [f'qos_{key}']
    assert found[f'qos_{key}'].found.endswith('durability volatile: they differ')


def test_every_check_is_made_once_in_the_order_of_the_catalogue() -> None:
    for seen in (graph(), graph(odom_publishers=())):
        assert list(found_in(healthy(), *CHECKS, seen=seen)) == list(CHECKS)


def test_a_driver_that_is_announced_and_mute_fails() -> None:
    silent = healthy()
    silent = type(silent)(silent.began_ns, silent.ended_ns, *(a[:0] for a in (
        silent.arrived_ns, silent.stamp_ns, silent.published_ns, silent.x)))  # fmt: skip
    found = found_in(silent, *CHECKS)
    assert found['rate'].verdict == FAIL
    assert 'no odometry came' in found['rate'].found
    assert found['frames'].verdict == NOT_CHECKED
