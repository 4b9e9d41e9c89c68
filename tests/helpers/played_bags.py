"""Small bags to be played, and a node that plays them beside a peer."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from subprocess import Popen
from typing import Any

from helpers.made_messages import STRING, Bag, new, odometry, serialized, stamped
from helpers.node_processes import Peer, graph, parameters
from helpers.nodes_in_process import program

from auv_analysis.bag.step_topics import ODOMETRY
from auv_analysis.nodes.replay_node import ReplayNode
from auv_dynamics.ros import topics
from auv_dynamics.ros.interface import nanoseconds

STEP = 10_000_000
STATE = (0.0, 0.0, 0.0, 1.0, *(0.0,) * 9)
ROOT = 'replay'


def fill(bag: Bag, steps: range) -> None:
    """Odometry, set-points a little ahead, wrench and a remark of each step."""
    for k in steps:
        ns = k * STEP
        for ahead in range(3) if k == steps.start else (2,):
            if k + ahead < steps.stop:
                at = (k + ahead) * STEP
                data = serialized(stamped('Twist', at, (0.1 * (k + ahead),) * 6))
                bag.add('/cmd_vel', 'geometry_msgs/msg/TwistStamped', at, data)
        bag.add('/odom', ODOMETRY, ns, serialized(odometry(ns, STATE)))
        data = serialized(stamped('Wrench', ns, (1.0 * k,) * 6))
        bag.add('/wrench', 'geometry_msgs/msg/WrenchStamped', ns, data)
        bag.add('/remark', STRING, ns, serialized(new(STRING, f'step {k}')))


def made(folder: Path, steps: int = 50, files: int = 1) -> Path:
    """Bag of so many steps in so many files."""
    share = steps // files
    for i in range(files):
        bag = Bag(folder / f'bag_{i}.mcap', chunk_size=2000)
        fill(bag, range(i * share, (i + 1) * share))
        bag.close()
    return folder


def odometry_alone(path: Path, steps: int) -> Path:
    """Bag of many odometry messages."""
    bag = Bag(path)
    message = odometry(0, STATE)
    for k in range(steps):
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(k * STEP, 10**9)
        bag.add('/odom', ODOMETRY, k * STEP, serialized(message))
    return bag.close()


def there(topic: topics.Topic, root: str = ROOT) -> topics.Topic:
    """One of our topics in the namespace of a replay."""
    return topics.Topic(f'{root}/{topic.name}', topic.type)


def steps_of(peer: Peer, topic: topics.Topic) -> list[int]:
    """Numbers of the steps whose messages a peer has heard."""
    return [nanoseconds(message.header.stamp) // STEP for message in peer.heard[topic.name]]


@contextmanager
def playing(
    folder: Path, domain: int | None = None, **values: Any
) -> Iterator[tuple[Peer, ReplayNode]]:
    """A replay of a bag with parameters, in this process, and a peer in its domain."""
    with program(domain) as peer:
        yield peer, peer.add(ReplayNode, {'bag': str(folder), **values})


@contextmanager
def process(bag: Path, *extra: str, **values: Any) -> Iterator[tuple[Peer, Popen]]:
    """The same as a process."""
    arguments = [*parameters(bag=bag, **values), *extra]
    with graph(('replay_node', arguments)) as (peer, processes):
        yield peer, processes['replay_node']


def ended(peer: Peer, played: Popen | ReplayNode) -> int:
    """Exit code of a replay that comes to its end."""

    def code() -> int | None:
        return played.exit_code if isinstance(played, ReplayNode) else played.poll()

    peer.until(lambda: code() is not None, 'the end of the replay')
    peer.spin(0.2)  # what is still under way to the peer
    return code() or 0
