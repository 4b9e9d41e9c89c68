"""Broken messages on real nodes: refused and counted, the node goes on, no wrench runs away."""

import math
import random
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from harness import GAINS, Peer, environment, fresh_domain, parameters, start_node
from scramble import SPECIAL, scrambled

from auv_dynamics.interface import Frames
from auv_dynamics.ros import convert, topics

X = np.array([0, 0, 0, 1, 0, 0, 0, 0.1, 0, 0, 0, 0, 0], float)
LIMIT = 500.0
VEHICLE = parameters(vehicle='herman2018')
CONTROLLER = [*VEHICLE, *parameters(law='gvc'), *GAINS, *parameters(limits__wrench=f'[{LIMIT}]')]
NODES: dict[str, tuple[list[str], tuple[topics.Topic, ...]]] = {
    'controller_node': (CONTROLLER, (topics.ODOM, topics.CMD_VEL)),
    'plant_node': (VEHICLE, (topics.WRENCH,)),
    'setpoint_node': (parameters(setpoint__surge__offset=0.2, horizon=5), (topics.ODOM,)),
    'analysis_node': (
        VEHICLE, (topics.ODOM, topics.CMD_VEL, topics.WRENCH, topics.DISTURBANCE),
    ),
    'recorder_node': (
        parameters(strict=False), (topics.ODOM, topics.CMD_VEL, topics.WRENCH, topics.PROGRESS),
    ),
}  # fmt: skip
OUTPUT = {
    'controller_node': topics.WRENCH, 'plant_node': topics.ODOM, 'setpoint_node': topics.CMD_VEL,
    'analysis_node': topics.KINETIC_ENERGY, 'recorder_node': topics.DIAGNOSTICS,
}  # fmt: skip
TOGETHER = 50  # broken messages between two good ones


class NodeFailedError(AssertionError):
    """A node did what it must not do."""


def good(topic: topics.Topic, ns: int) -> Any:
    """A message that is in order."""
    if topic is topics.ODOM:
        return convert.odometry(ns, X, Frames())
    if topic is topics.PROGRESS:
        return topics.PROGRESS.type(stamp=convert.stamp(ns))
    make = convert.wrench if topic.type is topics.WRENCH.type else convert.twist
    return make(ns, (0.2, 0, 0, 0, 0, 0), Frames())


def broken(topic: topics.Topic, ns: int, rng: random.Random) -> bytes:
    """A message in which bytes, or a number that is well formed, are not what they should be."""
    if rng.random() < 0.3 and topic is not topics.PROGRESS:
        values = list(X) if topic is topics.ODOM else [0.2, 0.0, 0.0, 0.0, 0.0, 0.0]
        values[rng.randrange(len(values))] = rng.choice(SPECIAL)
        make = convert.odometry if topic is topics.ODOM else good
        message = make(ns, values, Frames()) if make is not good else good(topic, ns)
        return bytes(serialize_message(message))
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
    arguments, inputs = NODES[name]
    if name == 'recorder_node':
        arguments = [*arguments, *parameters(bag=folder / 'bag')]
    peer = Peer(domain)
    process = start_node(name, domain, *arguments)
    try:
        return _session(peer, process, name, inputs, count, rng)
    finally:
        peer.close()
        process.terminate()
        try:
            output, _ = process.communicate(timeout=30)
        except subprocess.TimeoutExpired:
            process.kill()
            output, _ = process.communicate()
        (folder / f'{name}.log').write_text(output)
        if process.returncode != 0 or 'Traceback' in output:
            tail = '\n'.join(output.splitlines()[-15:])
            raise NodeFailedError(f'{name} ended with {process.returncode}:\n{tail}')


def _session(
    peer: Peer, process: subprocess.Popen, name: str, inputs: tuple, count: int, rng: random.Random
) -> dict[str, int]:
    heard: list[bytes] = []
    output = OUTPUT[name]
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
        for topic in sorted(inputs, key=lambda t: t is topics.ODOM):
            publishers[topic].publish(good(topic, now))
        peer.spin(0.02)
        return _judge(name, heard)

    answers += peer.until(lives, f'{name} to go on with good messages')
    return {'sent': sent, 'answers': answers}


def _judge(name: str, heard: list[bytes]) -> int:
    """Look at what a node has said; how much that was."""
    count = len(heard)
    for data in heard:
        message = deserialize_message(data, OUTPUT[name].type)
        if name == 'controller_node':
            force, torque = message.wrench.force, message.wrench.torque
            tau = (force.x, force.y, force.z, torque.x, torque.y, torque.z)
            if not all(math.isfinite(value) and abs(value) <= LIMIT for value in tau):
                raise NodeFailedError(f'a wrench of {tau}')
    heard.clear()
    return count


__all__ = ['NODES', 'NodeFailedError', 'environment', 'fuzz_node']
