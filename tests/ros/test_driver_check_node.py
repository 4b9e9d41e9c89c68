"""`auv check-driver` beside real drivers: each fault fails its check, and nothing is published."""

import json
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from geometry_msgs.msg import WrenchStamped
from helpers import faulty_drivers
from helpers.artists import captured
from helpers.faulty_drivers import NAMES
from helpers.node_processes import PATIENCE, Peer, environment, fork_server, fresh_domain
from helpers.patience import patience
from helpers.stalls import undisturbed
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message

from auv_analysis.cli.main import main
from auv_analysis.driver.checks import PASSIVE, judge, refusal
from auv_analysis.driver.evidence import (
    FAIL,
    NOT_CHECKED,
    PASS,
    CheckResult,
    DriverRecord,
    Settings,
)
from auv_analysis.driver.odometry_log import NO_STAMP
from auv_analysis.nodes.driver_check_node import COMMANDER, RosDriverClient, _arrived
from auv_dynamics.ros import convert, interface, topics
from auv_dynamics.ros.interface import Frames

SECONDS = 2.0  # of listening
SLOW = 1.2 * faulty_drivers.SLOW  # Hz: it is slower where the machine stands still, not faster
TOPICS = {interface.ODOM: interface.ODOM, interface.WRENCH: interface.WRENCH}
# a machine that is busy with other tests may keep all of them waiting
PATIENT = Settings(timeout=patience(4.0), gap=patience(4.0))


@pytest.fixture(scope='module')
def domain() -> Iterator[int]:
    """Domain with all faulty drivers in it."""
    found = fresh_domain()
    process = fork_server().start([faulty_drivers.__file__], environment(found))
    try:
        assert any(line == 'ready\n' for line in process.stdout)
        yield found
    finally:
        process.kill()
        print(process.communicate(timeout=PATIENCE)[0])


def test_who_publishes_the_odometry_is_seen() -> None:
    number = fresh_domain()
    with closing(RosDriverClient(number, '/', TOPICS, Frames())) as client:
        assert not client.publishes()
        with closing(Peer(number)) as peer:
            peer.node.create_publisher(topics.ODOM.type, topics.ODOM.name, 1)
            peer.until(client.publishes, 'the publisher')


def test_ages_are_told_by_the_clock_of_this_machine() -> None:
    assert _arrived({'source_timestamp': 3, 'received_timestamp': 7}) == 7


FAULTY = [  # driver, checks that fail, and words of their advice
    ('ros_frames', {'frames'}, 'frame_converter_node'),
    ('world_twist', {'twist_frame'}, 'R(q)^T v'),
    ('w_first', {'upright', 'twist_frame', 'angular_frame'}, 'w written first'),
    ('nan', {'finite'}, 'no measurement'),
    ('garbled', {'finite'}, 'no measurement'),
    ('best_effort', {'qos_recorder'}, 'publish reliable'),
    ('frozen', {'stamps', 'age'}, 'the time at which its numbers were measured'),
    ('old', {'age'}, 'publish at once'),
    ('plain_wrench', {'wrench_subscriber'}, 'without its stamp'),
]


@pytest.fixture(scope='module')
def judged(domain: int) -> dict[str, dict[str, CheckResult]]:
    """Driver -> check -> finding."""
    return undisturbed(lambda: judged_once(domain), as_promised)


def as_promised(found: dict[str, dict[str, CheckResult]]) -> bool:
    slow = found['slow']['rate'].numbers['rate_hz']
    alone = all(failed(found[driver]) == ids for driver, ids, _ in FAULTY)
    return alone and not failed(found['healthy']) and slow < SLOW


def judged_once(domain: int) -> dict[str, dict[str, CheckResult]]:
    clients = {name: RosDriverClient(domain, f'/{name}', TOPICS, Frames()) for name in NAMES}
    found = {}
    try:
        limit = time.monotonic() + PATIENCE
        until = None
        while until is None or time.monotonic() < until:
            assert time.monotonic() < limit
            for client in clients.values():
                client.listen(0.005)
            if until is None and all(len(client.buffer) for client in clients.values()):
                until = time.monotonic() + SECONDS
        logs = {
            name: client.log(int(client.buffer.log(0, 0).arrived_ns[0]))
            for name, client in clients.items()
        }  # all at one time: judging takes a while, in which nobody listens
        for name, client in clients.items():
            settings = Settings() if name == 'slow' else PATIENT
            listed = judge(DriverRecord(client.graph('the test'), logs[name], settings), PASSIVE)
            found[name] = {one.id: one for one in listed}
    finally:
        for client in clients.values():
            client.close()
    return found


def failed(found: dict[str, CheckResult]) -> set[str]:
    return {id for id, one in found.items() if one.verdict == FAIL}


@pytest.mark.parametrize('commands', [False, True])
def test_nothing_is_published_until_it_speaks(commands: bool) -> None:
    domain = fresh_domain()
    peer, client = Peer(domain), RosDriverClient(domain, '/', TOPICS, Frames(), commands=commands)
    name = COMMANDER if commands else interface.OBSERVER
    try:

        def listens() -> bool:
            client.listen(0.01)
            return peer.node.count_subscribers('odom') > 0 and name in peer.node.get_node_names()

        peer.until(listens)
        published = peer.node.get_publisher_names_and_types_by_node
        assert published(name, '/') == []
        assert peer.node.get_client_names_and_types_by_node(name, '/') == []
        if not commands:
            with pytest.raises(RuntimeError, match='publishes nothing'):
                client.advertise()
            return
        client.advertise()
        peer.until(
            lambda: published(name, '/') == [('/wrench', ['geometry_msgs/msg/WrenchStamped'])]
        )
        with pytest.raises(RuntimeError, match='odometry'):
            client.send((0.0,) * 6)  # nothing has been heard yet
        client.retire()
        peer.until(lambda: published(name, '/') == [])
    finally:
        client.close()
        peer.close()


def test_two_that_command_see_each_other_although_they_have_one_name() -> None:
    domain = fresh_domain()
    clients = [RosDriverClient(domain, '/', TOPICS, Frames(), commands=True) for _ in '12']
    try:
        assert [client.advertise() for client in clients] == [False, False]
        limit = time.monotonic() + PATIENCE
        while not all(client.others() == [f'/{COMMANDER}'] for client in clients):
            assert time.monotonic() < limit
            for client in clients:
                client.listen(0.05)
        clients[0].retire()
        while clients[1].others():
            assert time.monotonic() < limit
            clients[1].listen(0.05)
    finally:
        for client in clients:
            client.close()


def test_who_would_take_a_wrench_is_seen_with_what_it_asks_for() -> None:
    domain = fresh_domain()
    peer, client = Peer(domain), RosDriverClient(domain, '/', TOPICS, Frames())
    onlooker = Node(interface.RECORDER, context=peer.context)
    kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    try:
        onlooker.create_subscription(WrenchStamped, '/onlooked', print, 1)
        peer.node.create_subscription(WrenchStamped, '/wrench', print, kept)
        peer.node.create_subscription(WrenchStamped, '/thrust', print, 1)
        peer.node.create_publisher(topics.CLOCK.type, topics.CLOCK.name, 1)

        def sees_all() -> bool:
            client.listen(0.05)
            seen = client.graph('here')
            nodes = [end.node for end in (*seen.wrench_subscribers, *seen.clock_publishers)]
            named = '/onlooked' in seen.topics and nodes == 2 * ['/test_peer']
            return named and seen.listeners == {'/thrust': ('/test_peer',)}

        peer.until(sees_all)
        conflict = client.graph('here').conflicts['wrench']
        assert conflict == 'volatile publisher and transient local subscription'
    finally:
        client.close()
        onlooker.destroy_node()
        peer.close()


def test_what_was_applied_is_heard_by_who_commands() -> None:
    domain = fresh_domain()
    peer = Peer(domain)
    client = RosDriverClient(domain, '/', TOPICS, Frames(), commands=True)
    tau = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    try:
        output = peer.node.create_publisher(WrenchStamped, 'wrench_applied', 10)

        def heard() -> int:
            output.publish(convert.wrench(7, tau, Frames()))
            client.listen(0.05)
            return len(client.log(0).applied)

        peer.until(heard)
        assert client.log(0).applied[0].tolist() == [*tau]
        clock = peer.node.create_publisher(topics.CLOCK.type, topics.CLOCK.name, 10)

        def shown() -> int:
            clock.publish(topics.CLOCK.type(clock=convert.stamp(7)))
            client.listen(0.05)
            return len(client.log(0).clock_ns)

        peer.until(shown)
        log = client.log(0)
        assert log.clock_ns[0] == 7
        assert log.applied_arrived_ns[0] <= log.clock_arrived_ns[0] <= log.ended_ns
        take = {one.topic_name: one.callback for one in client._node.data_subscriptions()}
        odom = bytes(serialize_message(convert.odometry(1, np.eye(13)[3], Frames())))
        no_stamp = convert.odometry(1, np.eye(13)[3], Frames())
        no_stamp.header.stamp.nanosec = interface.NANOSECONDS
        none = bytes(serialize_message(no_stamp))
        broken = b'\0\1\0\0\7'
        for topic, data, number in (
            ('/odom', odom, 3), ('/odom', broken, 4), ('/odom', odom, 5),
            ('/wrench_applied', broken, 9), ('/odom', odom, 6), ('/odom', none, 7),
        ):  # fmt: skip
            about = {'publication_sequence_number': number, 'source_timestamp': 10 * number}
            take[topic](data, about)
        take['/odom'](odom, {'received_timestamp': 8})
        assert client.log(0).lost == 0
        assert client.log(0).stamp_ns.tolist() == [1, 1, 1, NO_STAMP, 1]
        assert client.log(0).published_ns.tolist() == [30, 50, 60, 70, 8]
        assert client.log(0).unreadable == {'/odom': 1, 'wrench_applied': 1}
    finally:
        client.close()
        peer.close()


def test_a_healthy_driver_passes(judged) -> None:
    found = judged['healthy']
    assert failed(found) == set()
    passed = {id for id, one in found.items() if one.verdict == PASS}
    assert passed > {'odom_publisher', 'wrench_subscriber', 'qos_recorder', 'qos_wrench', 'frames'}
    assert passed > {'stamps', 'age', 'twist_frame', 'angular_frame', 'axis_surge', 'axis_sway'}
    assert '/healthy/driver' in found['odom_publisher'].found


@pytest.mark.parametrize(('driver', 'ids', 'words'), FAULTY)
def test_a_faulty_driver_fails_the_check_of_its_fault_alone(judged, driver, ids, words) -> None:
    found = judged[driver]
    assert failed(found) == ids
    assert any(words in found[id].advice for id in ids)


def test_a_slow_driver_fails_by_its_rate(judged) -> None:
    finding = judged['slow']['rate']
    assert finding.verdict == FAIL
    assert 0.0 < finding.numbers['rate_hz'] < SLOW


def test_a_conflict_of_policies_is_that_of_the_middleware(judged) -> None:
    finding = judged['best_effort']['qos_recorder']
    assert 'reliability best_effort' in finding.found
    assert 'best effort publisher and reliable subscription' in finding.found


def test_the_command_leaves_its_document_and_a_report(
    domain: int, tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
    where = '--namespace', '/ros_frames', '--out', str(tmp_path / 'out')
    with captured(), pytest.raises(SystemExit, match='1'):
        main(['check-driver', *where, '--seconds', str(patience(1.0)), '--json'])
    document = json.loads(capsys.readouterr().out)
    assert {one['id']: one['verdict'] for one in document['checks']}['frames'] == FAIL
    assert json.loads((tmp_path / 'out' / 'check.json').read_text()) == document
    assert (tmp_path / 'out' / 'report.html').is_file()


def test_what_there_is_elsewhere_is_named(domain: int) -> None:
    client = RosDriverClient(domain, '/', TOPICS, Frames())
    try:
        limit = time.monotonic() + PATIENCE
        while len(named := client.graph('here').elsewhere) < len(NAMES) or not all(
            node.endswith('/driver') for nodes in named.values() for node in nodes
        ):
            assert time.monotonic() < limit
            client.listen(0.1)
        found = judge(DriverRecord(client.graph('here'), client.log(0), Settings()), PASSIVE)
    finally:
        client.close()
    assert found[0].verdict == FAIL
    assert 'nav_msgs/msg/Odometry is on' in found[0].found
    assert '/healthy/odom of /healthy/driver' in found[0].found
    assert {one.verdict for one in found if one.id in ('rate', 'frames')} == {NOT_CHECKED}


def test_with_another_commander_nothing_is_sent(domain: int) -> None:
    peer = Peer(domain)
    peer.node.create_publisher(WrenchStamped, '/healthy/wrench', topics.every_step())
    client = RosDriverClient(domain, '/healthy', TOPICS, Frames(), commands=True)
    try:

        def known() -> bool:
            client.listen(0.05)
            return len(client.buffer) > 50 and client.others() == ['/test_peer']

        peer.until(known, 'the other commander')
        settings = Settings(timeout=patience(4.0), actuates=True)
        found = judge(DriverRecord(client.graph('here'), client.log(0), settings), PASSIVE)
        assert client.others() == ['/test_peer']
        assert 'wrench_publishers' in refusal(found)  # and whatever a busy machine adds
    finally:
        client.close()
        peer.close()
