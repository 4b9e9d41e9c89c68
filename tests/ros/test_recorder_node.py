"""The recorder node: everything on disk after a signal, after a kill, and loud when it is not."""

import itertools
import signal
from pathlib import Path

import numpy as np
import pytest
from harness import PATIENCE, assert_one_line, graph, parameters, run_node, stop
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from auv_analysis.bag import read_bag
from auv_dynamics.interface import Frames, nanoseconds
from auv_dynamics.ros import convert, topics

FRAMES = Frames()
STEP = 10_000_000
UPRIGHT = np.array([0, 0, 0, 1, *[0] * 9], float)
TOPICS = ['-p', 'topics:=["odom", "wrench"]']


def publish_step(peer, k: int) -> None:
    peer.publish(topics.ODOM, convert.odometry(k * STEP, UPRIGHT, FRAMES))
    peer.publish(topics.WRENCH, convert.wrench(k * STEP, (1.0 * k,) * 6, FRAMES))


def acknowledged(peer, k: int) -> None:
    peer.until(
        lambda: any(nanoseconds(m.stamp) >= k * STEP for m in peer.heard['recorder/progress']),
        f'progress {k}',
    )


def test_records_every_step_and_leaves_when_it_has_all(tmp_path: Path) -> None:
    attached = tmp_path / 'scenario.yaml'
    attached.write_text('name: by_hand\n')
    arguments = [*TOPICS, *parameters(bag=tmp_path / 'bag', duration=0.2)]
    arguments += ['-p', f'attachments:=["scenario.yaml={attached}"]']
    with graph(('recorder_node', arguments)) as (peer, processes):
        peer.listen(topics.PROGRESS)
        for k in range(21):
            publish_step(peer, k)
        process = processes['recorder_node']
        peer.until(lambda: process.poll() is not None, 'the end')
        assert process.returncode == 0
        acknowledged(peer, 20)
    contents = read_bag(tmp_path / 'bag')
    assert contents.counts['/odom'] == contents.counts['/wrench'] == 21
    assert contents.attachments == {'scenario.yaml': 'name: by_hand\n'}
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
        for k in range(15, 21) if goes_on else ():
            peer.publish(topics.CLOCK, Clock(clock=convert.stamp(k * STEP)))
        peer.until(lambda: process.poll() is not None, 'the end')
        assert process.returncode == 0
    counts = read_bag(tmp_path / 'bag', decode=False).counts
    assert counts['/clock'] == (21 if goes_on else 15)
    assert counts['/odom'] == 21


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
        code, _ = stop(processes['recorder_node'], how)
    assert code == 0
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
        peer.spin(1.2)
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
            publish_step(peer, k)
        process = processes['recorder_node']
        peer.until(lambda: process.poll() is not None, 'the end')
        code, output = stop(process)
    assert code == 1
    assert word in output
    assert 'expected step 2' in output
    assert read_bag(tmp_path / 'bag').counts['/odom'] == 3, 'what came is kept'


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
        for k in range(1, 30_000):
            clock.publish(topics.CLOCK.type(clock=convert.stamp(k)))
        process.send_signal(signal.SIGCONT)
        publish_step(peer, 1)
        if not strict:
            acknowledged(peer, 1)
            peer.until(
                lambda: read_bag(tmp_path / 'bag').counts['/clock'] > 1, 'the first one after'
            )
            process.terminate()
        peer.until(lambda: process.poll() is not None, 'the end')
        ended, output = stop(process)
    assert ended == code, output
    assert ('/clock: expected publication' in output) == strict
    assert strict == ('lost' in output)
    assert strict or "messages that did not arrive: {'/clock'" in output
    assert clocks() < 30_000


def test_records_what_is_not_ours_as_well(tmp_path: Path) -> None:
    with graph(('recorder_node', [*TOPICS, *parameters(bag=tmp_path / 'bag')])) as (
        peer,
        processes,
    ):
        peer.listen(topics.PROGRESS)
        foreign = peer.node.create_publisher(String, 'sonar/remark', 10)
        publish_step(peer, 0)
        peer.until(foreign.get_subscription_count, 'the recorder to discover it')
        foreign.publish(String(data='a foreign word'))
        acknowledged(peer, 0)
        peer.spin(0.5)
        stop(processes['recorder_node'])
    contents = read_bag(tmp_path / 'bag')
    assert contents.types['/sonar/remark'] == 'std_msgs/msg/String'
    assert contents.counts['/sonar/remark'] == 1


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
    ],
)
def test_wrong_parameters_end_in_one_line(arguments: list[str], key: str) -> None:
    assert_one_line(run_node('recorder_node', *arguments), key)
    assert not Path('x').exists()


def test_a_driver_with_best_effort_is_heard_where_that_is_asked_for(tmp_path: Path) -> None:
    one = ['-p', 'topics:=["odom"]']
    wanted = parameters(bag=tmp_path / 'heard', strict=False)
    wanted += ['-p', 'qos_overrides./odom.subscription.reliability:=best_effort']
    deaf = [*one, *parameters(bag=tmp_path / 'deaf', strict=False), '-r', '__node:=deaf']
    with graph(('recorder_node', [*one, *wanted])) as (peer, _):
        peer.listen(topics.PROGRESS)
        qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
        output = peer.node.create_publisher(topics.ODOM.type, 'odom', qos)
        k = itertools.count()

        def progress() -> list:
            output.publish(convert.odometry(next(k) * STEP, UPRIGHT, FRAMES))
            return peer.heard['recorder/progress']

        peer.until(progress, 'a recorded step')
    with graph(('recorder_node', deaf)) as (peer, processes):
        output = peer.node.create_publisher(topics.ODOM.type, 'odom', qos)
        peer.listen(topics.DIAGNOSTICS)

        def said() -> bool:
            found = [status.message for a in peer.heard['/diagnostics'] for status in a.status]
            return any('odom: incompatible QoS' in m and 'reliability' in m for m in found)

        peer.until(said, 'the report of the deaf one')
        assert stop(processes['recorder_node'])[0] == 0
    assert read_bag(tmp_path / 'deaf').counts['/diagnostics'] > 0, 'its report is in its bag'
