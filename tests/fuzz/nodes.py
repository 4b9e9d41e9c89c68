"""Broken messages on real nodes: refused and counted, the node goes on, no wrench runs away."""

import math
import random
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rclpy.duration import Duration
from rclpy.serialization import deserialize_message, serialize_message

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from helpers.node_processes import GAINS, Peer, fresh_domain, parameters, start_node
from helpers.patience import patience
from scramble import SPECIAL, scrambled

from auv_analysis.bag.reading import read_bag
from auv_dynamics.nodes.frame_converter_node import ENU_FLU
from auv_dynamics.ros import convert, topics
from auv_dynamics.ros.interface import ROS_FRAMES, Frames, wrench_of

X = np.array([0, 0, 0, 1, 0, 0, 0, 0.1, 0, 0, 0, 0, 0], float)
TWIST = (0.2, 0.0, 0.0, 0.0, 0.0, 0.0)
LIMIT = 500.0
VEHICLE = parameters(vehicle='herman2018')
CONTROLLER = [*VEHICLE, *parameters(law='gvc'), *GAINS, *parameters(limits__wrench=f'[{LIMIT}]')]
ENU_ODOM, ENU_CMD_VEL, FLU_WRENCH = (
    replace(topic, name=f'{ENU_FLU}/{topic.name}')
    for topic in (topics.ODOM, topics.CMD_VEL, topics.WRENCH)
)


class Fuzzed(NamedTuple):
    """A node: what it is started with, what it hears, and what it must go on to say."""

    arguments: list[str]
    inputs: tuple[topics.Topic, ...]
    output: topics.Topic


NODES = {
    'controller_node': Fuzzed(CONTROLLER, (topics.ODOM, topics.CMD_VEL), topics.WRENCH),
    'plant_node': Fuzzed(VEHICLE, (topics.WRENCH,), topics.ODOM),
    'setpoint_node': Fuzzed(
        parameters(setpoint__surge__offset=0.2, horizon=5), (topics.ODOM,), topics.CMD_VEL
    ),
    'analysis_node': Fuzzed(
        VEHICLE,
        (topics.ODOM, topics.CMD_VEL, topics.WRENCH, topics.DISTURBANCE),
        topics.KINETIC_ENERGY,
    ),
    'recorder_node': Fuzzed(
        [*parameters(strict=False), '-p', 'topics:=["odom", "cmd_vel", "wrench"]'],
        (topics.ODOM, topics.CMD_VEL, topics.WRENCH, topics.PROGRESS),
        topics.DIAGNOSTICS,
    ),
    'frame_converter_node': Fuzzed([], (ENU_ODOM, ENU_CMD_VEL, topics.WRENCH), FLU_WRENCH),
}
TOGETHER = 50  # broken messages between two good ones


class NodeFailedError(AssertionError):
    """A node did what it must not do."""


def good(topic: topics.Topic, ns: int, values: Sequence[float] | None = None) -> Any:
    """A message that is in order, or has these numbers."""
    frames = ROS_FRAMES if topic in (ENU_ODOM, ENU_CMD_VEL) else Frames()
    if topic.type is topics.ODOM.type:
        return convert.odometry(ns, X if values is None else np.array(values), frames)
    if topic is topics.PROGRESS:
        return topics.PROGRESS.type(stamp=convert.stamp(ns))
    make = convert.wrench if topic.type is topics.WRENCH.type else convert.twist
    return make(ns, TWIST if values is None else values, frames)


def broken(topic: topics.Topic, ns: int, rng: random.Random) -> bytes:
    """A message in which bytes, or a number that is well formed, are not what they should be."""
    if rng.random() < 0.3 and topic is not topics.PROGRESS:
        values = list(X if topic.type is topics.ODOM.type else TWIST)
        values[rng.randrange(len(values))] = rng.choice(SPECIAL)
        return bytes(serialize_message(good(topic, ns, values)))
    stamp = ns if rng.random() < 0.7 else rng.choice((0, 10**18, ns - 10**9, ns + 10**10))
    # an empty one stops the middleware's reliable stream for good: its publisher is then silent,
    # which the watchdogs see, and nobody hears what it says afterwards
    return scrambled(bytes(serialize_message(good(topic, stamp))), rng) or b'\0'


def fuzz_node(name: str, count: int, seed: int, folder: Path) -> dict[str, int]:
    """Throw broken messages at a node; counts of what was sent and heard.

    Raises
    ------
    NodeFailedError : it ended, fell silent, or said what must not be said

    """
    rng, domain = random.Random(f'{seed} {name}'), fresh_domain()
    arguments = NODES[name].arguments
    if name == 'recorder_node':
        arguments = [*arguments, *parameters(bag=folder / 'bag')]
    peer = Peer(domain)
    process = start_node(name, domain, *arguments)
    try:
        told = _session(peer, process, name, count, rng)
    finally:
        peer.close()
        process.terminate()
        try:
            output, _ = process.communicate(timeout=patience(30))
        except subprocess.TimeoutExpired:
            process.kill()
            output, _ = process.communicate()
        (folder / f'{name}.log').write_text(output)
        if process.returncode != 0 or 'Traceback' in output:
            tail = '\n'.join(output.splitlines()[-15:])
            raise NodeFailedError(f'{name} ended with {process.returncode}:\n{tail}')
    if name == 'recorder_node':
        odd = [note for note in read_bag(folder / 'bag').notes if 'left out' not in note]
        if odd:
            raise NodeFailedError(f'the bag cannot be read as a whole: {odd}')
    return told


def _session(
    peer: Peer, process: subprocess.Popen, name: str, count: int, rng: random.Random
) -> dict[str, int]:
    heard: list[bytes] = []
    _, inputs, output = NODES[name]
    peer.node.create_subscription(
        output.type, output.name, heard.append, topics.every_step(), raw=True
    )
    publishers = {
        topic: peer.node.create_publisher(topic.type, topic.name, topics.every_step())
        for topic in inputs
    }
    peer.until(
        lambda: (
            all(p.get_subscription_count() for p in publishers.values())
            and peer.node.count_publishers(output.name)
        ),
        f'{name} to be there',
    )
    sent = answers = 0
    while sent < count:
        for _ in range(min(TOGETHER, count - sent)):
            topic = rng.choice(inputs)
            publishers[topic].publish(broken(topic, time.time_ns(), rng))
            sent += 1
        peer.spin(0.01)
        answers += _judge(name, heard)
        if process.poll() is not None:
            return {'sent': sent, 'answers': answers}  # the caller tells of it

    def lives() -> int:
        now = time.time_ns()
        for topic in sorted(inputs, key=lambda t: t.type is topics.ODOM.type):
            publishers[topic].publish(good(topic, now))
        peer.spin(0.02)
        return _judge(name, heard)

    answers += peer.until(lives, f'{name} to go on with good messages')
    # who has not met a publisher yet takes nothing of it: the recorder would end with none
    for topic, publisher in publishers.items():
        arrived = publisher.wait_for_all_acked(Duration(seconds=patience(30)))
        if not arrived:
            raise NodeFailedError(f'{name} does not take {topic.name} any more')
    return {'sent': sent, 'answers': answers}


def _judge(name: str, heard: list[bytes]) -> int:
    """Look at what a node has said; how much that was."""
    count = len(heard)
    for data in heard:
        if NODES[name].output.type is topics.WRENCH.type:
            tau = wrench_of(deserialize_message(data, topics.WRENCH.type))
            limit = LIMIT if name == 'controller_node' else math.inf  # the converter clips nothing
            if not all(math.isfinite(value) and abs(value) <= limit for value in tau):
                raise NodeFailedError(f'a wrench of {tau}')
    heard.clear()
    return count
