"""The recorder node: everything on disk after a signal, after a kill, and loud when it is not."""

import itertools
import math
import re
import signal
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from helpers.node_processes import (
    PATIENCE,
    Peer,
    fresh_domain,
    graph,
    parameters,
    run_node,
    stop,
)
from helpers.nodes_in_process import Program, assert_refused, program
from helpers.patience import patience
from mcap.reader import make_reader
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu
from std_msgs.msg import Header, String

from auv_analysis.bag.chunks import MessageTable
from auv_analysis.bag.mcap_file import McapFile
from auv_analysis.bag.output import LEAST_SIZE, Storage
from auv_analysis.bag.reading import read_bag
from auv_analysis.graph.node_settings import RecorderSettings
from auv_analysis.nodes import recorder, recorder_node
from auv_analysis.nodes.recorder_node import (
    LostStepError,
    PublicationLedger,
    RecorderNode,
    StepLedger,
)
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros import convert, topics
from auv_dynamics.ros.interface import DEPTH, NANOSECONDS, Frames, nanoseconds
from auv_dynamics.ros.rclpy_internals import has_data_path, raw_class

FRAMES = Frames()
STEP = 10_000_000
UPRIGHT = np.array([0, 0, 0, 1, *[0] * 9], float)
TOPICS = ['-p', 'topics:=["odom", "wrench"]']


def publish_step(peer, k: int, *, there: bool = True) -> None:
    """Publish a step; not `there`: the recorder may have ended at what came before."""
    peer.publish(topics.ODOM, convert.odometry(k * STEP, UPRIGHT, FRAMES), subscribers=there)
    tau = (1.0 * k,) * 6
    peer.publish(topics.WRENCH, convert.wrench(k * STEP, tau, FRAMES), subscribers=there)


def acknowledged(peer, k: int) -> None:
    peer.until(
        lambda: any(nanoseconds(m.stamp) >= k * STEP for m in peer.heard['recorder/progress']),
        f'progress {k}',
    )


def test_records_every_step_and_leaves_when_it_has_all(tmp_path: Path) -> None:
    attached = tmp_path / 'scenario.yaml'
    attached.write_text('name: by_hand\n')
    arguments = [*TOPICS, *parameters(bag=tmp_path / 'bag', duration=0.2)]
    arguments += ['-p', f'attachments:=["{attached}", "other.yaml={attached}"]']
    with graph(('recorder_node', arguments)) as (peer, processes):
        peer.listen(topics.PROGRESS)
        process = processes['recorder_node']
        for k in range(21):
            publish_step(peer, k)
            if k == 19:
                acknowledged(peer, 19)
                peer.spin(0.2)
                assert process.poll() is None, 'one step is left'
        peer.until(lambda: process.poll() is not None, 'the end')
        assert process.returncode == 0
        acknowledged(peer, 20)
    contents = read_bag(tmp_path / 'bag')
    assert contents.counts['/odom'] == contents.counts['/wrench'] == 21
    assert contents.attachments['scenario.yaml'] == 'name: by_hand\n'
    assert contents.attachments['other.yaml'] == 'name: by_hand\n'
    assert contents.notes == []
    assert (contents.first, contents.last) == (0, 20 * STEP), 'log time is the header stamp'


@pytest.mark.parametrize('goes_on', [True, False])
def test_the_clock_of_the_last_steps_is_waited_for(tmp_path: Path, goes_on: bool) -> None:
    """A recorder that was held up has all steps before all of the clock."""
    arguments = [*TOPICS, *parameters(bag=tmp_path / 'bag', duration=0.2)]
    with graph(('recorder_node', arguments)) as (peer, processes):
        peer.listen(topics.PROGRESS)
        for k in range(21):
            publish_step(peer, k)
            if k < 15:
                peer.publish(topics.CLOCK, Clock(clock=convert.stamp(k * STEP)))
        acknowledged(peer, 20)
        process = processes['recorder_node']
        peer.spin(0.3)
        assert process.poll() is None
        for k in range(15, 21) if goes_on else ():
            peer.publish(topics.CLOCK, Clock(clock=convert.stamp(k * STEP)))
        peer.until(lambda: process.poll() is not None, 'the end')
        assert process.returncode == 0
    counts = read_bag(tmp_path / 'bag', decode=False).counts
    assert counts['/clock'] == (21 if goes_on else 15)
    assert counts['/odom'] == 21


def of_analysis(topic: topics.Topic, ns: int) -> Any:
    message = topic.type()
    message.header.stamp = convert.stamp(ns)
    return message


def test_the_analysis_of_the_last_step_is_waited_for(tmp_path: Path) -> None:
    arguments = [*TOPICS, *parameters(bag=tmp_path / 'bag', duration=0.2, analysis_every=6)]
    with graph(('recorder_node', arguments)) as (peer, processes):
        peer.listen(topics.PROGRESS)
        for k in range(21):
            publish_step(peer, k)
        acknowledged(peer, 20)
        for k in (12, 18):
            peer.spin(0.3)
            for topic in reversed(topics.ANALYSIS_TOPICS):
                assert processes['recorder_node'].poll() is None
                peer.publish(topic, of_analysis(topic, k * STEP))
        peer.until(lambda: processes['recorder_node'].poll() is not None, 'the end')
        assert processes['recorder_node'].returncode == 0
    assert read_bag(tmp_path / 'bag', decode=False).counts[f'/{topics.LUMPED_ERROR.name}'] == 2


def test_in_real_time_progress_is_that_of_odometry_and_whoever_comes_late_hears_it(
    tmp_path: Path,
) -> None:
    expected = ['odom', 'cmd_vel', 'cmd_accel']
    given = {'bag': str(tmp_path / 'bag'), 'topics': expected, 'strict': False}
    with program() as made:
        made.add(RecorderNode, given)
        for k in range(3):
            publish_step(made, k)
        made.spin(0.3)
        made.listen(topics.PROGRESS, topics.DIAGNOSTICS)
        acknowledged(made, 2)
        assert made.heard['recorder/progress'][0].frame_id == 'base_link_fsd'
        said = made.heard[topics.DIAGNOSTICS.name]

        def told() -> dict[str, str]:
            return {pair.key: pair.value for pair in said[-1].status[0].values} if said else {}

        made.until(lambda: told().get('complete') == '2', 'what is complete')
        assert told()['behind'] == 'none'
        made.until(lambda: nanoseconds(said[-1].header.stamp) == 2 * STEP, 'the stamp of a step')


@pytest.mark.parametrize('how', [signal.SIGTERM, signal.SIGINT])
def test_a_signal_closes_the_bag(tmp_path: Path, how: int) -> None:
    with graph(('recorder_node', [*TOPICS, *parameters(bag=tmp_path / 'bag')])) as (
        peer,
        processes,
    ):
        peer.listen(topics.PROGRESS)
        for k in range(10):
            publish_step(peer, k)
        acknowledged(peer, 9)
        code, output = stop(processes['recorder_node'], how)
    assert code == 0
    assert 'did not arrive' not in output
    assert re.search(rf'code 0: recorded \d+ messages into {tmp_path}/bag\n', output)
    contents = read_bag(tmp_path / 'bag')
    assert contents.notes == []
    assert contents.counts['/odom'] == 10
    assert (tmp_path / 'bag' / 'metadata.yaml').is_file()


def test_a_kill_loses_at_most_the_last_second(tmp_path: Path) -> None:
    """Rivals leave an mcap that no reader opens (rosbag2#1953, #2133)."""
    with graph(('recorder_node', [*TOPICS, *parameters(bag=tmp_path / 'bag')])) as (
        peer,
        processes,
    ):
        peer.listen(topics.PROGRESS)
        for k in range(10):
            publish_step(peer, k)
        acknowledged(peer, 9)
        path = tmp_path / 'bag' / 'bag_0.mcap'
        peer.until(lambda: path.stat().st_size > 5000, 'the chunk to be closed')
        peer.spin(patience(1.2))
        processes['recorder_node'].kill()
        processes['recorder_node'].wait(PATIENCE)
    contents = read_bag(tmp_path / 'bag')
    assert contents.counts['/odom'] == contents.counts['/wrench'] == 10
    assert 'not finished' in ' '.join(contents.notes)


@pytest.mark.parametrize(('steps', 'word'), [((0, 1, 3), 'lost'), ((0, 1, 1), 'doubled')])
def test_a_lost_or_doubled_step_is_an_error(tmp_path: Path, steps: tuple, word: str) -> None:
    with graph(('recorder_node', [*TOPICS, *parameters(bag=tmp_path / 'bag')])) as (
        peer,
        processes,
    ):
        for k in steps:
            publish_step(peer, k, there=not k)
        process = processes['recorder_node']
        peer.until(lambda: process.poll() is not None, 'the end')
        code, output = stop(process)
    assert code == 1
    assert word in output
    assert 'expected step 2' in output
    assert read_bag(tmp_path / 'bag').counts['/odom'] == 3, 'what came is kept'


def test_the_ledger_says_which_step_is_due_when_and_who_is_behind() -> None:
    ledger = StepLedger(['odom', 'wrench'], 10)
    assert (ledger.complete, ledger.behind()) == (-1, 'none')
    for topic, ns in (('odom', 100), ('odom', 110), ('wrench', 100), ('odom', 120)):
        ledger.add(topic, ns)
    assert (ledger.complete, ledger.complete_ns, ledger.behind()) == (0, 100, 'wrench at step 0')
    ledger.add('wrench', 110)
    assert (ledger.complete, ledger.complete_ns) == (1, 110)
    with pytest.raises(
        LostStepError, match=r'odom: expected step 3 \(130 ns\), found 150 ns: lost'
    ):
        ledger.add('odom', 150)
    with pytest.raises(LostStepError, match=r'step 2 \(120 ns\), found 110 ns: doubled'):
        ledger.add('wrench', 110)
    with pytest.raises(LostStepError, match='found 121 ns'):
        ledger.add('wrench', 121)


def test_without_a_grid_gaps_are_counted_by_the_time_since_the_message_before() -> None:
    ledger = StepLedger(['odom'], 10, strict=False)
    complete = []
    for ns in (3, 14, 41, 30, 50, 63):  # 30 came late
        ledger.add('odom', ns)
        complete.append(ledger.complete)
    assert ledger.gaps == {'odom': 2}
    assert complete == [0, 1, 3, 3, 4, 6]


def test_publications_are_followed_by_their_numbers() -> None:
    counted = PublicationLedger(strict=False)
    for number in (7, 8, None, 11, 12, 15, 3, 7):  # it has begun anew before 3
        counted.add('clock', number)
    assert counted.gaps == {'clock': 2 + 2 + 3}
    strict = PublicationLedger()
    strict.add('clock', 7)
    with pytest.raises(LostStepError, match='clock: expected publication 8, found 9: lost'):
        strict.add('clock', 9)


def test_numbers_of_two_publishers_in_turn_are_no_gaps(tmp_path: Path) -> None:
    given = {'bag': str(tmp_path / 'bag'), 'topics': ['odom'], 'strict': False}
    with program() as made:
        recorder = made.add(RecorderNode, given)
        kind, name = topics.CMD_VEL.type, topics.CMD_VEL.name
        one, other = (made.node.create_publisher(kind, name, 10) for _ in range(2))
        made.until(lambda: recorder.count_publishers(name) == 2, 'both')
        made.until(one.get_subscription_count, 'the recorder')
        made.until(other.get_subscription_count, 'the recorder')
        newest = recorder._publications._newest
        for output, number in ((one, 1), (one, 2), (one, 3), (other, 1), (one, 4)):
            output.publish(convert.twist(number, [0.0] * 6, Frames()))
            made.until(lambda n=number: newest.get(name) == n, 'a message')
        assert recorder._publications.gaps == {}


LAST = 123_456_789  # ns


@pytest.mark.parametrize(('strict', 'code'), [(True, 1), (False, 0)])
def test_a_gap_on_a_topic_without_steps_is_seen(tmp_path: Path, strict: bool, code: int) -> None:
    """A publisher that keeps ten messages, a recorder that sleeps: the middleware drops some."""
    arguments = [*TOPICS, *parameters(bag=tmp_path / 'bag', strict=strict)]

    def clocks() -> int:
        return read_bag(tmp_path / 'bag').counts.get('/clock', 0)

    with graph(('recorder_node', arguments)) as (peer, processes):
        process = processes['recorder_node']
        peer.listen(topics.PROGRESS)
        clock = peer.node.create_publisher(topics.CLOCK.type, topics.CLOCK.name, 10)
        peer.until(clock.get_subscription_count, 'the recorder')
        publish_step(peer, 0)
        clock.publish(topics.CLOCK.type(clock=convert.stamp(0)))
        acknowledged(peer, 0)
        peer.until(lambda: clocks() > 0, 'the first one')
        process.send_signal(signal.SIGSTOP)
        next_one = bytes(serialize_message(topics.CLOCK.type(clock=convert.stamp(1))))
        for _ in range(1, 29_000):
            clock.publish(next_one)
        process.send_signal(signal.SIGCONT)
        publish_step(peer, 1, there=not strict)  # who stood still for long has to be met again
        after = LAST.to_bytes(4, 'little')

        def heard() -> bool:
            clock.publish(topics.CLOCK.type(clock=convert.stamp(LAST)))
            return process.poll() is not None if strict else after in whole(tmp_path / 'bag')

        peer.until(heard, 'what came after the gap')
        if not strict:
            acknowledged(peer, 1)
            process.terminate()
        peer.until(lambda: process.poll() is not None, 'the end')
        ended, output = stop(process)
    assert ended == code, output
    assert ('/clock: expected publication' in output) == strict
    assert strict == ('lost' in output)
    assert strict or "messages that did not arrive: {'/clock'" in output
    assert clocks() < 29_000


KEPT = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)


def logged(bag: Path) -> dict[str, list]:
    """Messages of each topic with their times."""
    with (bag / f'{bag.name}_0.mcap').open('rb') as file:
        found: dict[str, list] = {}
        for _, channel, message in make_reader(file).iter_messages():
            found.setdefault(channel.topic, []).append(message)
    return found


def published(peer: Any, topic: str, kind: type, qos: QoSProfile | int, *messages: Any) -> Any:
    """Publisher of messages that somebody hears."""
    output = peer.node.create_publisher(kind, topic, qos)
    peer.until(output.get_subscription_count, f'the recorder on {topic}')
    for message in messages:
        output.publish(message)
    return output


def test_records_what_others_publish_as_they_offer_it(tmp_path: Path, monkeypatch: Any) -> None:
    """Best effort, latched, of a type that is not installed, and of one that is not defined."""
    folder = tmp_path / 'share' / 'sonar_msgs' / 'msg'
    folder.mkdir(parents=True)
    (folder / 'Ping.msg').write_text('float64 range\n')
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    domain = fresh_domain()
    early = Peer(domain)
    description = early.node.create_publisher(String, '/robot_description', KEPT)
    description.publish(String(data='<robot/>'))
    arguments = [*TOPICS, *parameters(bag=tmp_path / 'bag', exclude='secret|private')]
    with graph(('recorder_node', arguments), domain=domain) as (peer, processes):
        peer.listen(topics.PROGRESS)
        publish_step(peer, 0)
        secret = peer.node.create_publisher(String, 'camera/secret', 1)
        peer.node.create_publisher(raw_class('sonar_msgs/msg/Secret'), 'sonar/new', 1)
        ping = b'\0\1\0\0' + bytes(8)
        published(peer, 'sonar/ping', raw_class('sonar_msgs/msg/Ping'), BEST_EFFORT, ping)
        published(peer, 'imu', Imu, BEST_EFFORT, Imu())
        early.node.create_publisher(Header, 'imu', 1)  # of another type than the recorded one
        published(peer, 'remark', String, 10, String(data='reliable'))
        later = published(peer, 'remark', String, BEST_EFFORT)

        def both() -> bool:
            later.publish(String(data='with best effort'))
            process = processes['recorder_node']
            return process.poll() is None and b'with best effort' in whole(tmp_path / 'bag')

        peer.until(both, 'the later publisher to be recorded')
        assert not secret.get_subscription_count()
        code, output = stop(processes['recorder_node'])
    early.close()
    assert code == 0, output
    last = output.strip().splitlines()[-1]
    assert '/sonar/new (no definition of sonar_msgs/msg/Secret)' in last
    assert '/imu of std_msgs/msg/Header' in last
    counts = read_bag(tmp_path / 'bag').counts
    assert counts['/imu'] == counts['/sonar/ping'] == counts['/robot_description'] == 1
    assert counts['/remark'] > 1
    assert '/camera/secret' not in counts
    assert logged(tmp_path / 'bag')['/sonar/ping'][0].data == ping
    told = yaml.safe_load((tmp_path / 'bag' / 'metadata.yaml').read_text())
    offered = {
        entry['topic_metadata']['name']: entry['topic_metadata']['offered_qos_profiles'][0]
        for entry in told['rosbag2_bagfile_information']['topics_with_message_count']
    }
    assert offered['/imu']['reliability'] == 'best_effort'
    assert offered['/robot_description']['durability'] == 'transient_local'


def whole(bag: Path) -> bytes:
    """What is on the disk, without compression."""
    return b''.join(
        bytes(item.data)
        for path in bag.glob('*.mcap')
        for item in McapFile(path).records()
        if isinstance(item, MessageTable)
    )


@pytest.mark.parametrize(
    ('strict', 'simulated', 'origin'),
    [
        (True, False, 5 * STEP),  # lock-step: the time of the steps
        (False, True, 5 * STEP),  # a simulated clock
        (False, False, None),  # the system's
        (False, False, 5 * STEP),  # a driver whose clock began with it
    ],
)
def test_a_bag_spans_what_was_recorded(
    tmp_path: Path, strict: bool, simulated: bool, origin: int | None
) -> None:
    """Whatever others stamp, and before the first step too: the time when a message came."""
    bag = tmp_path / 'bag'
    arguments = [*TOPICS, *parameters(bag=bag, strict=strict, use_sim_time=simulated)]
    with graph(('recorder_node', arguments)) as (peer, processes):
        peer.listen(topics.PROGRESS)
        begin = peer.node.get_clock().now().nanoseconds if origin is None else origin
        remark = published(peer, 'remark', String, 10, String(data='without a stamp'))
        strange = [Header(stamp=Time(sec=sec, nanosec=ns)) for sec, ns in ((2**31 - 1, 0), (-1, 0))]
        published(peer, 'epoch', Header, 10, *strange, Header(stamp=Time(nanosec=2**32 - 1)))
        if simulated:
            clock = Clock(clock=convert.stamp(begin))
            peer.publish(topics.CLOCK, clock, subscribers=2)
        for k in range(3):
            stamp = begin + k * STEP
            peer.publish(topics.ODOM, convert.odometry(stamp, UPRIGHT, FRAMES))
            peer.publish(topics.WRENCH, convert.wrench(stamp, (0.0,) * 6, FRAMES))
        far = convert.twist((2**31 - 1) * NANOSECONDS, (0.0,) * 6, FRAMES)  # of another clock
        peer.publish(topics.CMD_VEL, far)
        broken = convert.wrench(0, (0.0,) * 6, FRAMES)
        broken.header.stamp = Time(sec=-1)
        peer.until(lambda: peer.heard['recorder/progress'], 'the steps')
        peer.publish(topics.WRENCH, broken)
        remark.publish(String(data='at the end'))
        peer.until(lambda: whole(bag).count(b'at the end'), 'the last word')
        assert stop(processes['recorder_node'])[0] == 0
    found = logged(bag)
    assert len(found['/epoch']) == 3
    assert (len(found['/wrench']), len(found['/cmd_vel'])) == (4, 1)
    assert [m.log_time for m in found['/odom']] == [begin + k * STEP for k in range(3)]
    times = [message.log_time for messages in found.values() for message in messages]
    assert max(times) - min(times) < 2 * PATIENCE * NANOSECONDS
    source = found['/remark'][0].publish_time
    assert abs(source - peer.node.get_clock().now().nanoseconds) < 10 * PATIENCE * NANOSECONDS


def test_a_recorder_takes_its_own_vehicle_and_what_it_is_told(tmp_path: Path) -> None:
    """Two vehicles in one domain; each bag says whose it is."""
    own = ['-r', '__ns:=/auv1', '-p', 'extra_topics:=["/auv2/ping"]']
    arguments = [*TOPICS, *own, *parameters(bag=tmp_path / 'bag')]
    with graph(('recorder_node', arguments)) as (peer, processes):
        for k, space in itertools.product(range(3), ('/auv1', '/auv2')):
            output, wrench = f'{space}/odom', f'{space}/wrench'
            for name, message in (
                (output, convert.odometry(k * STEP, UPRIGHT, FRAMES)),
                (wrench, convert.wrench(k * STEP, (0.0,) * 6, FRAMES)),
            ):
                topic = topics.Topic(name, type(message))
                peer.publish(topic, message, subscribers=space == '/auv1')
        published(peer, '/auv2/ping', String, 10, String(data='asked for'))
        published(peer, '/auv1/sonar', String, 10, String(data='inside'))
        published(peer, '/tf', String, 10, String(data='global'))
        peer.until(lambda: b'global' in whole(tmp_path / 'bag'), 'the last message')
        assert stop(processes['recorder_node'])[0] == 0
    contents = read_bag(tmp_path / 'bag')
    strangers = {topic for topic in contents.counts if topic.startswith('/auv2')}
    assert strangers == {'/auv2/ping'}
    assert {'/auv1/odom', '/auv1/sonar', '/tf'} <= set(contents.counts)
    assert contents.namespace == '/auv1'


OF_ALL = ('/tf', '/tf_static', '/robot_description')  # in any namespace


@pytest.mark.parametrize(
    ('extra', 'exclude', 'taken'),
    [
        ((), None, {'/auv1/imu'}),
        (('/auv10/imu', '/rosout'), None, {'/auv1/imu', '/auv10/imu', '/rosout'}),
        (('all',), None, {'/auv1/imu', '/auv10/imu', '/imu'}),
        (('all', '/rosout'), '^/auv1/|out', {'/auv10/imu', '/imu'}),
    ],
)
def test_which_topics_are_wanted(extra: tuple, exclude: str | None, taken: set[str]) -> None:
    wanted = recorder.Wanted('/auv1', extra, re.compile(exclude) if exclude else None)
    there = ('/auv1/imu', '/auv10/imu', '/imu', *OF_ALL, '/rosout', '/parameter_events')
    assert {topic for topic in there if topic in wanted} == taken | set(OF_ALL)
    assert '/rosout' not in recorder.Wanted('/')
    assert '/imu' in recorder.Wanted('/')


def test_who_keeps_nothing_for_late_comers_is_heard_beside_who_does() -> None:
    kept, not_kept = (SimpleNamespace(qos_profile=qos) for qos in (KEPT, QoSProfile(depth=1)))
    assert recorder.adapted([kept]).depth == DEPTH
    assert recorder.adapted([kept, kept]).durability == DurabilityPolicy.TRANSIENT_LOCAL
    assert recorder.adapted([kept, not_kept]).durability == DurabilityPolicy.VOLATILE
    assert recorder.adapted([kept], not_kept.qos_profile).durability == DurabilityPolicy.VOLATILE


def test_what_has_arrived_is_taken_before_a_subscription_is_made_anew() -> None:
    """As a publisher that asks for less has come, which the old one would not hear."""
    called: dict[str, tuple] = {}

    class Recorded:
        def __getattr__(self, name: str) -> Any:
            return lambda *given, **_: called.update({name: given})

    others = recorder.OtherTopics(Recorded(), recorder.Wanted('/', ('/x',)), print)
    others._kinds['/x'] = 'std_msgs/msg/String'
    others._heard['/x'] = SimpleNamespace(qos_profile=QoSProfile(depth=1))
    offered = {'durability': DurabilityPolicy.TRANSIENT_LOCAL}  # more than was asked for
    weak = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT, **offered)
    others._adapt('/x', [SimpleNamespace(qos_profile=weak)])
    assert [*called] == ['take_data', 'drop_data', 'create_subscription', 'add_data']
    qos = called['create_subscription'][3]
    assert (qos.reliability, qos.durability) == (weak.reliability, DurabilityPolicy.VOLATILE)


def test_what_cannot_be_recorded_is_said_once_and_not_tried_again() -> None:
    said, found = [], [SimpleNamespace(topic_type='no_such_msgs/msg/X')]
    node: Any = SimpleNamespace(
        get_topic_names_and_types=lambda: [('/x', []), ('/odom', []), ('/auv2/x', [])],
        get_publishers_info_by_topic=lambda topic: said.append(topic) or found,
        get_logger=lambda: SimpleNamespace(warning=said.append),
    )
    others = recorder.OtherTopics(node, recorder.Wanted('/', exclude=re.compile('auv2')), print)
    for _ in range(2):
        others.look({'/odom'})
    why = 'no definition of no_such_msgs/msg/X'
    assert said == ['/x', f'/x: not recorded, {why}']
    assert others.left == {'/x': why}


def test_a_bag_says_how_its_topics_were_remapped(tmp_path: Path, timers) -> None:
    renamed = ['--ros-args', '-r', '__ns:=/auv1', '-r', 'wrench:=/thrust']
    with program() as made:
        given = {'bag': str(tmp_path / 'bag'), 'topics': ['odom', 'wrench']}
        node = made.add(RecorderNode, given, cli_args=renamed)
        give_steps(node, 0)
        made.drop(node)
    contents = read_bag(tmp_path / 'bag')
    assert contents.names == {'/thrust': '/auv1/wrench'}
    assert contents.counts['/thrust'] == contents.counts['/auv1/odom'] == 1


RENAMED: Any = SimpleNamespace(
    get_name=lambda: 'recorder_node', get_namespace=lambda: '/auv1',
    resolve_topic_name=lambda name: name if name.startswith('/') else f'/auv1/{name}',
)  # fmt: skip


def test_the_storage_is_that_of_the_parameters(tmp_path: Path, monkeypatch) -> None:
    """The pace of the files is that of the first of the topics."""
    monkeypatch.setattr(recorder, 'BagWriter', lambda *given: given)
    disks = {tmp_path: SimpleNamespace(free=77)}
    monkeypatch.setattr('shutil.disk_usage', disks.get)

    def made(**changed: Any) -> tuple[Path, dict[str, str], Storage]:
        values = {'topics': ('wrench', 'odom'), 'max_size': 1 << 21, 'max_duration': 2.5}
        values |= {'bag': str(tmp_path / 'a' / 'bag'), 'compression': 'lz4', 'chunk_size': 2000}
        settings = RecorderSettings(**values | {'free_space': 77} | changed)
        return recorder.make_writer(RENAMED, settings)

    bag, attachments, storage = made()
    assert bag == tmp_path / 'a' / 'bag'
    assert storage == Storage('lz4', 2000, 1 << 21, 2_500_000_000, '/auv1/wrench', 77)
    assert made(topics=())[2].pace == ''
    least = LEAST_SIZE + len(attachments['recording.yaml'])
    for name, value, smaller in (('max_size', least, least - 1), ('max_duration', 1.0, 0.999)):
        assert made(**{name: value})
        with pytest.raises(InputError, match=f'storage.{name}'):
            made(**{name: smaller})
    with pytest.raises(InputError, match=r'storage\.free_space.*77 bytes free'):
        made(free_space=78)
    with pytest.raises(InputError) as caught:
        made(topics=('wrnch', 'warp'))
    assert caught.value.expected.endswith(' (nearest: wrench)')


def test_other_topics_are_named_as_the_node_names_them() -> None:
    settings = RecorderSettings(extra_topics=('all', 'ping', '/auv2/ping'), exclude='secret')
    taken = 'all', '/auv1/ping', '/auv2/ping'
    assert recorder.make_wanted(RENAMED, settings) == recorder.Wanted(
        '/auv1', taken, re.compile('secret')
    )


def test_refuses_a_folder_that_holds_a_bag(tmp_path: Path) -> None:
    bag = tmp_path / 'bag'
    bag.mkdir()
    (bag / 'bag_0.mcap').write_bytes(b'precious')
    ended = run_node('recorder_node', *parameters(bag=bag))
    assert ended.returncode == 2, ended.stdout
    assert len(ended.stdout.strip().splitlines()) == 1
    assert 'expected a folder without a bag' in ended.stdout
    assert (bag / 'bag_0.mcap').read_bytes() == b'precious'


@pytest.mark.parametrize(
    ('arguments', 'key'),
    [
        ([], 'bag'),
        (['-p', 'topics:=["warp"]', '-p', 'bag:=x'], 'topics'),
        (['-p', 'attachments:=["none.yaml"]', '-p', 'bag:=x'], 'none.yaml'),
        (parameters(bag='x', storage__compression='gzip'), 'storage.compression'),
        (parameters(bag='/dev/null/x'), '/dev/null/x'),
        (parameters(bag='x', lockstep=True), 'lockstep'),
        (parameters(bag='x', exclude='(imu'), 'exclude'),
        (['-p', 'extra_topics:=["a b"]', '-p', 'bag:=x'], 'extra_topics'),
    ],
)
def test_wrong_parameters_end_in_one_line(arguments: list[str], key: str) -> None:
    assert_refused(RecorderNode, arguments, key)
    assert not Path('x').exists()


def test_a_driver_with_best_effort_is_heard_where_that_is_asked_for(tmp_path: Path) -> None:
    one = ['-p', 'topics:=["odom"]']
    wanted = parameters(bag=tmp_path / 'heard', strict=False)
    wanted += ['-p', 'qos_overrides./odom.subscription.reliability:=best_effort']
    deaf = [*one, *parameters(bag=tmp_path / 'deaf', strict=False), '-r', '__node:=deaf']
    with graph(('recorder_node', [*one, *wanted])) as (peer, _):
        peer.listen(topics.PROGRESS)
        output = peer.node.create_publisher(topics.ODOM.type, 'odom', BEST_EFFORT)
        k = itertools.count()

        def progress() -> list:
            output.publish(convert.odometry(next(k) * STEP, UPRIGHT, FRAMES))
            return peer.heard['recorder/progress']

        peer.until(progress, 'a recorded step')
    with graph(('recorder_node', deaf)) as (peer, processes):
        output = peer.node.create_publisher(topics.ODOM.type, 'odom', BEST_EFFORT)
        peer.listen(topics.DIAGNOSTICS)

        def said() -> bool:
            found = [status.message for a in peer.heard['/diagnostics'] for status in a.status]
            return sum('odom: incompatible QoS' in m and 'reliability' in m for m in found) > 3

        peer.until(said, 'the report of the deaf one, as long as it lasts')
        code, output = stop(processes['recorder_node'])
    assert code == 1
    assert 'expected topics without any message: odom' in output
    assert read_bag(tmp_path / 'deaf').counts['/diagnostics'] > 0, 'its report is in its bag'


Do = Callable[[], None]
DAY = 86_400 * NANOSECONDS


@pytest.fixture
def timers(monkeypatch: pytest.MonkeyPatch) -> list[Do]:
    """What the recorder's timers do, when a test says so: report, keep, look."""
    found: list[Do] = []
    monkeypatch.setattr(recorder_node, 'steady_timer', lambda node, period, do: found.append(do))
    return found


def recorder_in(made: Program, bag: Path, **given: Any) -> RecorderNode:
    return made.add(RecorderNode, {'bag': str(bag), 'topics': ['odom', 'wrench'], **given})


def give(node: RecorderNode, topic: str, message: Any, **way: int) -> None:
    """Hand a message to a recorder with what the middleware knows of its way."""
    name = node.resolve_topic_name(topic)
    (end,) = [one for one in node.subscriptions if one.topic_name == name and one.raw]
    end.callback(serialize_message(message), way)


def give_steps(node: RecorderNode, *steps: int, origin: int = 0) -> None:
    for k in steps:
        give(node, 'odom', convert.odometry(origin + k * STEP, UPRIGHT, FRAMES))
        give(node, 'wrench', convert.wrench(origin + k * STEP, (0.0,) * 6, FRAMES))


def give_error(node: RecorderNode, ns: int, **way: int) -> None:
    give(node, topics.LUMPED_ERROR.name, convert.wrench(ns, (0.1,) * 6, FRAMES), **way)


def give_clock(node: RecorderNode, ns: int) -> None:
    give(node, topics.CLOCK.name, Clock(clock=convert.stamp(ns)))


def times(bag: Path) -> dict[str, list[tuple[int, int]]]:
    """Log and publish times of each topic's messages."""
    return {
        topic: [(one.log_time, one.publish_time) for one in found]
        for topic, found in logged(bag).items()
    }


def test_in_lock_step_what_is_said_of_a_step_has_its_time(tmp_path: Path, timers) -> None:
    bag = tmp_path / 'bag'
    with program() as made:
        node = recorder_in(made, bag)
        assert node.lockstep
        health = DiagnosticArray()
        give(node, '/diagnostics', health, source_timestamp=3)  # waits for the first step
        give_steps(node, 5, 6)
        give_error(node, 5 * STEP, source_timestamp=77)
        give_error(node, 6 * STEP)
        give_clock(node, 5 * STEP)
        give(node, '/diagnostics', health, source_timestamp=88, received_timestamp=99)
        give(node, '/diagnostics', health, source_timestamp=-88)
        made.drop(node)
    found, steps = times(bag), [(k * STEP, k * STEP) for k in (5, 6)]
    assert found['/odom'] == found['/wrench'] == steps
    assert found['/analysis/lumped_error'] == [(5 * STEP, 77), steps[1]]
    assert found['/clock'] == steps[:1]
    assert found['/diagnostics'] == [(5 * STEP, 3), (6 * STEP, 88), (6 * STEP, 0)]


def test_in_real_time_it_has_the_time_when_it_came(tmp_path: Path, timers) -> None:
    bag = tmp_path / 'bag'
    with program() as made:
        node = recorder_in(made, bag, strict=False)
        assert not node.lockstep
        now = node.get_clock().now().nanoseconds
        give_steps(node, 0, origin=now)
        came = {'received_timestamp': now + 7, 'source_timestamp': now + 3}
        give_error(node, now, **came)
        give(node, 'odom', convert.odometry(0, UPRIGHT, FRAMES), **came)  # without a stamp
        give_clock(node, 0)
        for ns in (now + DAY, now + DAY + 1):  # the latter is of another clock
            give(node, 'twist', convert.twist(ns, (0.0,) * 6, FRAMES), **came)
        made.drop(node)
    found = times(bag)
    assert found['/twist'] == [(now + 7, now + 3), (now + DAY, now + DAY)]
    assert found['/analysis/lumped_error'] == [(now + 7, now + 3)]
    assert found['/odom'] == [(now, now), (now + 7, now + 3)]
    assert found['/clock'] == [(0, 0)]


def test_in_real_time_what_comes_without_a_step_has_the_time_when_it_came(
    tmp_path: Path, timers
) -> None:
    with program() as made:
        node = recorder_in(made, tmp_path / 'bag', strict=False)
        give(node, '/diagnostics', DiagnosticArray(), received_timestamp=7, source_timestamp=3)
        made.drop(node)
    assert times(tmp_path / 'bag')['/diagnostics'] == [(7, 3)]


def clock_of(now: int, *, strict: bool, simulated: bool = False) -> recorder.GraphClock:
    """The time of a graph whose node's clock shows this, in ns."""
    shown = SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=now))
    told = SimpleNamespace(value=simulated)
    node: Any = SimpleNamespace(get_parameter=lambda _: told, get_clock=lambda: shown)
    return recorder.GraphClock(node, strict)


@pytest.mark.parametrize(
    ('messages', 'seconds'),
    [([b''] * 10_001, 0.0), ([bytes(1 << 24), b'x'], 0.0), ([b'', b''], 60.1)],
    ids=['count', 'size', 'time'],
)
def test_what_comes_before_the_first_step_waits_within_bounds(
    monkeypatch: pytest.MonkeyPatch, messages: list[bytes], seconds: float
) -> None:
    clock, now = clock_of(0, strict=True), 100.0
    monkeypatch.setattr('time.monotonic', lambda: now)
    for later in (0.0, min(seconds, 60.0)):
        now = 100.0 + later
        for message in messages[:-1]:
            clock.hold(('/x', 'kind', message, {}))
        assert len(clock.released()) == len(messages) - 1
        assert clock.latest == -1, 'they have to wait on'
    now = 100.0 + seconds
    for message in messages:
        clock.hold(('/x', 'kind', message, {}))
    assert len(clock.released()) == len(messages)
    assert (clock.latest, clock.early) == (0, [])


def test_the_time_of_a_graph_is_moved_to_the_epoch_of_its_steps_where_that_is_another_one() -> None:
    for stamp, received, expected in (
        (7 + DAY, 5, 5), (8 + DAY, 5, 6 + DAY), (8 + DAY, None, 8 + DAY), (9, None, 7),
    ):  # fmt: skip
        clock = clock_of(7, strict=False)
        assert clock.now(received) is None
        clock.follow(stamp)
        clock.follow(0)  # the first one tells
        assert clock.now(received) == expected
    late = clock_of(8 + DAY, strict=False)
    late.follow(0)
    assert late.now(5) == 0, 'before the beginning of that epoch'
    simulated = clock_of(0, strict=False, simulated=True)
    assert simulated.now(5) is None
    simulated.follow(3)
    assert simulated.now(5) == 3
    assert clock_of(7, strict=False, simulated=True).now(5) == 7


def test_what_waits_for_too_long_is_written_between_the_steps(
    tmp_path: Path, timers, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder, 'EARLY_COUNT', -1)
    with program() as made:
        node = recorder_in(made, tmp_path / 'bag')
        give(node, '/diagnostics', DiagnosticArray(), source_timestamp=3)
        timers[1]()
        give_steps(node, 5)
        made.drop(node)
    assert times(tmp_path / 'bag')['/diagnostics'] == [(0, 3)]


def test_a_topic_is_described_as_it_was_offered_when_its_first_message_came(
    tmp_path: Path, timers
) -> None:
    with program() as made:
        node = recorder_in(made, tmp_path / 'bag')
        remark = made.node.create_publisher(String, '/remark', BEST_EFFORT)
        made.until(lambda: timers[2]() or remark.get_subscription_count(), 'the recorder')
        give(node, '/remark', String(data='early'))  # its publisher goes before the first step
        made.node.destroy_publisher(remark)
        made.until(lambda: not node.count_publishers('/remark'), 'the end of the publisher')
        give_steps(node, 0)
        made.drop(node)
    told = yaml.safe_load((tmp_path / 'bag' / 'metadata.yaml').read_text())
    entries = told['rosbag2_bagfile_information']['topics_with_message_count']
    found = {one['topic_metadata']['name']: one['topic_metadata'] for one in entries}
    assert found['/remark']['offered_qos_profiles'][0]['reliability'] == 'best_effort'
    digest = found['/odom']['type_description_hash']
    assert digest.startswith('RIHS01_'), 'known without any publisher'


def test_a_loss_on_a_topic_of_the_analysis_stays_an_error_at_the_end(
    tmp_path: Path, timers
) -> None:
    with program() as made:
        node = recorder_in(made, tmp_path / 'bag', duration=0.2)
        for number in (4, 5):
            give_error(node, 0, publication_sequence_number=number)
        assert node.exit_code is None
        give_error(node, 0, publication_sequence_number=7)
        assert node.exit_code == 1
        give_steps(node, *range(21))
        timers[0]()
        assert node.exit_code == 1


def test_the_analysis_of_the_first_step_is_waited_for(tmp_path: Path, timers) -> None:
    with program() as made:
        node = recorder_in(made, tmp_path / 'bag', duration=0.2, analysis_every=50)
        give_steps(node, *range(21))
        for topic in reversed(topics.ANALYSIS_TOPICS):  # one may be behind another
            timers[0]()
            assert node.exit_code is None
            give(node, topic.name, of_analysis(topic, 0))
        timers[0]()
        assert node.exit_code == 0


@pytest.mark.parametrize('clock', [False, True])
def test_a_clock_is_waited_for_where_there_is_one(
    tmp_path: Path, timers, monkeypatch: pytest.MonkeyPatch, clock: bool
) -> None:
    monkeypatch.setattr(recorder_node, 'PATIENCE', math.inf)
    with program() as made:
        node = recorder_in(made, tmp_path / 'bag', duration=0.2)
        give_steps(node, *range(21))
        if clock:
            give_clock(node, 0)
            timers[0]()
            assert node.exit_code is None
            give_clock(node, 20 * STEP)
        timers[0]()
        assert node.exit_code == 0


def test_progress_is_said_once_and_repeated_now_and_then(tmp_path: Path, timers) -> None:
    with program() as made:
        made.listen(topics.PROGRESS)
        node = recorder_in(made, tmp_path / 'bag')
        report, keep, _ = timers
        made.until(lambda: made.node.count_publishers('recorder/progress'), 'the recorder')
        said = []
        for k, do in ((None, report), (None, keep), (0, report), (None, report), (None, keep)):
            if k is not None:
                give_steps(node, k)
            do()
            assert node.graph.latest_ns == 0
            made.spin(0.1)
            said.append([nanoseconds(one.stamp) for one in made.heard['recorder/progress']])
    assert said == [[], [], [0], [0], [0, 0]]


def test_what_has_arrived_is_taken_before_the_bag_is_closed(tmp_path: Path, timers) -> None:
    with program() as made:
        node = recorder_in(made, tmp_path / 'bag')
        node.bulk = has_data_path()  # with one, nobody takes its data in between
        made.listen(topics.WRENCH)
        for k in range(3):
            publish_step(made, k)
        made.until(lambda: len(made.heard['wrench']) == 3, 'the steps')
        made.spin(0.1)
        made.drop(node)
    assert read_bag(tmp_path / 'bag', decode=False).counts['/odom'] == 3


def test_where_only_setpoints_are_expected_progress_is_theirs(tmp_path: Path, timers) -> None:
    with program() as made:
        node = recorder_in(made, tmp_path / 'bag', topics=['cmd_vel'], strict=False, duration=0.02)
        give_steps(node, *range(9))
        for k in range(3):
            assert node.exit_code is None
            give(node, 'cmd_vel', convert.twist(k * STEP, (0.0,) * 6, FRAMES))
            timers[0]()
        assert node.exit_code == 0


def test_steps_and_messages_that_did_not_arrive_are_said_at_the_end(
    tmp_path: Path, timers, capfd: pytest.CaptureFixture
) -> None:
    with program() as made:
        node = recorder_in(made, tmp_path / 'bag', strict=False)
        give_steps(node, 0, 1, 4)
        for number in (4, 6):
            give_error(node, 0, publication_sequence_number=number)
            seen = {'publication_sequence_number': 2 * number}
            give(node, 'twist', convert.twist(0, (0.0,) * 6, FRAMES), **seen)
            give(node, '/diagnostics', DiagnosticArray(), **seen)  # of several that count
        made.drop(node)
    said = capfd.readouterr().err
    assert 'steps of 0.01 s without a message, or' in said, 'a driver may have another period'
    assert "'odom': 2, 'wrench': 2, 'analysis/lumped_error': 1, 'twist': 3}" in said


def test_in_lock_step_a_set_point_that_is_lost_is_an_error(tmp_path: Path, timers) -> None:
    with program() as made:
        node = recorder_in(made, tmp_path / 'bag', topics=['odom', 'cmd_vel'])
        for k, code in ((0, None), (1, None), (3, 1)):
            give(node, 'cmd_vel', convert.twist(k * STEP, (0.0,) * 6, FRAMES))
            assert node.exit_code == code


def test_where_the_clock_is_set_no_time_has_passed() -> None:
    ledger = StepLedger(['odom', 'wrench'], 10, strict=False)
    for ns in (0, 10, 2 * DAY, 2 * DAY + 10, 2 * DAY + 30):
        ledger.add('odom', ns)
        ledger.add('wrench', ns)
    assert (ledger.complete, ledger.gaps) == (4, {'odom': 1, 'wrench': 1})
    ledger.add('odom', 7 * DAY)  # a stray
    for ns in (2 * DAY + 40, 2 * DAY + 50):
        ledger.add('odom', ns)
        ledger.add('wrench', ns)
    assert (ledger.complete, ledger.furthest) == (5, 5), 'nor with the stray'
    assert ledger.gaps == {'odom': 1, 'wrench': 1}
    ledger.add('odom', 3 * DAY + 50)
    assert ledger.furthest == DAY // 10 + 5, 'that of a day has'
    assert ledger.gaps['odom'] == DAY // 10


def test_in_real_time_a_message_without_a_stamp_begins_no_run(tmp_path: Path, timers) -> None:
    """The zero wrench of a controller that has not heard the vehicle yet."""
    with program() as made:
        node = recorder_in(made, tmp_path / 'bag', strict=False, duration=0.2)
        give(node, 'wrench', convert.wrench(0, (0.0,) * 6, FRAMES))
        give_steps(node, *range(20), origin=made.node.get_clock().now().nanoseconds)
        timers[0]()
        assert node.exit_code is None
        made.drop(node)
    assert len(logged(tmp_path / 'bag')['/wrench']) == 21


@pytest.mark.parametrize('withheld', ['one', 'all'])
@pytest.mark.parametrize(('strict', 'ends'), [(False, True), (True, False)])
def test_in_real_time_the_last_measurement_need_not_come(
    tmp_path: Path, timers, monkeypatch: pytest.MonkeyPatch, strict: bool, ends: bool, withheld: str
) -> None:
    with program() as made:
        node = recorder_in(made, tmp_path / 'bag', strict=strict, duration=0.2, analysis_every=4)
        give_steps(node, *range(20))
        monkeypatch.setattr(recorder_node, 'PATIENCE', -1.0)
        timers[0]()
        assert node.exit_code is None, 'no topic has come to the last step'
        if withheld == 'one':
            give(node, 'wrench', convert.wrench(20 * STEP, (0.0,) * 6, FRAMES))
        else:
            give_clock(node, 19 * STEP)
            timers[0]()
            assert node.exit_code is None, 'nor the clock'
            give_clock(node, 20 * STEP)
        monkeypatch.setattr(recorder_node, 'PATIENCE', math.inf)
        timers[0]()
        assert node.exit_code is None, 'the other one may be under way'
        monkeypatch.setattr(recorder_node, 'PATIENCE', -1.0)
        timers[0]()
        assert node.exit_code == (0 if ends else None)


def test_who_has_left_before_the_end_is_not_waited_for_without_end(
    tmp_path: Path, timers, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture
) -> None:
    """A plant that is killed, with nobody beside it who would notice."""
    with program() as made:
        node = recorder_in(made, tmp_path / 'bag', strict=False, duration=0.2)
        longer = recorder_in(made, tmp_path / 'longer', strict=False, duration=1000.0)
        timers[0]()
        odometry = made.node.create_publisher(topics.ODOM.type, 'odom', 10)
        made.node.create_publisher(topics.WRENCH.type, 'wrench', 10)
        give_steps(node, *range(15))
        give_steps(longer, *range(15))
        made.spin(0.3)
        monkeypatch.setattr(recorder_node, 'GONE', 0.0)
        timers[0]()
        assert node.exit_code is None, 'it may only be silent for a while'
        made.node.destroy_publisher(odometry)
        made.until(lambda: not made.node.count_publishers('odom'), 'its end')
        monkeypatch.setattr(recorder_node, 'GONE', PATIENCE)
        timers[0]()
        assert node.exit_code is None, 'what it sent may be under way'
        monkeypatch.setattr(recorder_node, 'GONE', 0.0)
        for report in (timers[0], timers[3]):
            report()
        assert node.exit_code == 1
        assert longer.exit_code is None, 'its time has not passed'
        made.drop(node)
    assert 'came to step 14 of 20: nobody publishes odom any more' in capfd.readouterr().err
    assert read_bag(tmp_path / 'bag', decode=False).counts['/odom'] == 15


def test_a_topic_that_stays_away_does_not_make_a_recording_endless(
    tmp_path: Path, timers, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture
) -> None:
    """A controller has died; a vehicle goes on saying where it is."""
    with program() as made:
        node = recorder_in(made, tmp_path / 'bag', strict=False, duration=0.2)
        strict = recorder_in(made, tmp_path / 'strict', duration=0.2)
        give_steps(node, *range(15))
        give_steps(strict, *range(15))
        made.spin(0.3)
        monkeypatch.setattr(recorder_node, 'GONE', 0.0)
        monkeypatch.setattr(recorder_node, 'PATIENCE', math.inf)
        made.node.create_publisher(topics.ODOM.type, 'odom', 10)
        made.node.create_publisher(topics.WRENCH.type, 'wrench', 10)
        made.until(lambda: made.node.count_publishers('wrench'), 'their names')
        for k in range(15, 21):
            timers[0]()
            assert node.exit_code is None
            for one in (node, strict):
                give(one, 'odom', convert.odometry(k * STEP, UPRIGHT, FRAMES))
        timers[0]()
        assert node.exit_code is None, 'a wrench may be under way'
        for report in (timers[0], timers[3], timers[3]):
            report()
        assert node.exit_code == 1
        assert strict.exit_code is None, 'in lock-step the plant waits for it'
        made.drop(node)
    assert 'came to step 20 without wrench' in capfd.readouterr().err
