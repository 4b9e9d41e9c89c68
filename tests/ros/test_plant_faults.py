"""Faults on a real plant node: simulated inside it in lock-step, really withheld in real time."""

import time
from typing import Any

import numpy as np
import pytest
from helpers.node_processes import Peer, graph, parameters
from helpers.nodes_in_process import program
from helpers.patience import patience
from helpers.stalls import PAUSE, undisturbed
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics.files.errors import InputError
from auv_dynamics.nodes.plant_node import PlantNode
from auv_dynamics.ros import convert, interface, topics
from auv_dynamics.ros.interface import Frames

STEP = 10_000_000
HEARD = (topics.ODOM, topics.GROUND_TRUTH, topics.WRENCH_APPLIED)
PLANT = 'plant_node'


def faults(**entries: dict[str, Any]) -> list[str]:
    """Parameters of faults by name; `_from` is `from`."""
    names = ', '.join(f'"{name}"' for name in entries)
    given = ['-p', f'faults.names:=[{names}]']
    for name, entry in entries.items():
        given += parameters(**{f'faults__{name}__{k.strip("_")}': v for k, v in entry.items()})
    return given


def step_of(message: Any, step: int = STEP) -> int:
    return interface.nanoseconds(message.header.stamp) // step


def velocity(message: Any) -> float:
    return message.twist.twist.linear.x


def lock_step(peer: Peer, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Answer steps 0 ... n - 1, wrench k is k + 1 N in surge: measured, true surge, applied."""
    peer.listen(*HEARD)
    odom, truth, applied = (peer.heard[topic.name] for topic in HEARD)
    for k in range(n):
        peer.until(lambda k=k: len(odom) > k, f'odometry {k}')
        peer.publish(topics.WRENCH, convert.wrench(k * STEP, (k + 1.0, 0, 0, 0, 0, 0), Frames()))
    peer.until(lambda: len(applied) == n and len(truth) > n, 'all answers')
    assert [step_of(m) for m in odom[:n]] == list(range(n)), 'no message is withheld'
    assert [step_of(m) for m in applied] == list(range(n))
    series = [velocity(m) for m in odom[:n]], [velocity(m) for m in truth[:n]]
    return *map(np.array, series), np.array([m.wrench.force.x for m in applied])


def test_lock_step_repeats_delays_biases_and_keeps() -> None:
    given = faults(
        gone={'kind': 'sensor_drop_out', '_from': 0.05, 'to': 0.1},
        late={'kind': 'sensor_delay', 'delay': 0.03, '_from': 0.15, 'to': 0.2},
        tilt={'kind': 'sensor_bias', 'velocity': '[0.5, 0.0, 0.0, 0.0, 0.0, 0.0]', '_from': 0.25},
        mute={'kind': 'wrench_loss', '_from': 0.05, 'to': 0.1, 'timeout': 0.03},
        half={'kind': 'actuator', 'axis': 'surge', 'efficiency': 0.5, '_from': 0.2, 'to': 0.25},
        jam={'kind': 'actuator', 'axis': 'surge', 'stuck': -7.0, '_from': 0.25},
    )
    ready = ['-p', 'expected_subscribers:=["odom=1", "wrench_applied=1", "ground_truth/odom=1"]']
    plant = parameters(vehicle='herman2018', lockstep=True, duration=1.0)
    with graph((PLANT, [*plant, *ready, *given])) as (peer, _):
        measured, true, applied = lock_step(peer, 30)
    assert (np.diff(true) != 0).all(), 'the vehicle goes on'
    assert_array_equal(measured[:5], true[:5])
    assert_array_equal(measured[5:10], [true[4]] * 5)
    assert_array_equal(measured[10:15], true[10:15])
    assert_array_equal(measured[15:20], true[[14, 14, 14, 15, 16]])
    assert_array_equal(measured[20:25], true[20:25])
    assert_allclose(measured[25:], true[25:] + 0.5, rtol=1e-12)
    assert_array_equal(applied[:10], [1, 2, 3, 4, 5, 5, 5, 5, 0, 0])
    assert_array_equal(applied[10:20], np.arange(11, 21))
    assert_array_equal(applied[20:25], np.arange(21, 26) / 2)
    assert_array_equal(applied[25:], [-7.0] * 5)


def test_real_time_withholds_odometry_and_ignores_wrenches() -> None:
    heard_again = 200  # step: 80 after the loss, of which the watchdog waits for 50
    last = heard_again + 270  # of which a pause makes up for 200

    def held(applied: np.ndarray) -> bool:
        return bool(120 >= applied[125] >= applied[119] > 0)  # of step 119 at the latest

    def goes_on(applied: np.ndarray) -> bool:
        return bool(applied[-10:].min() > heard_again)

    true, stamps, applied, _ = undisturbed(
        lambda: in_real_time(heard_again, last),
        lambda found: held(found[2]) and goes_on(found[2]),
        lambda found: found[3] > PAUSE,
    )
    assert true == list(range(last + 1))
    # lost from 30 to before 50; what was measured from 80 on was still under way at 100
    assert stamps == [*range(30), *range(50, 80), *range(100, last + 1)]
    meanwhile = set(applied[120:heard_again]) - {0.0}
    assert len(meanwhile) <= 1, 'the last one is held, then none: none that came meanwhile'
    assert held(applied), 'the last one is held'
    assert (applied[heard_again - 15 : heard_again] == 0).all(), 'then the watchdog has zeroed it'
    assert goes_on(applied), 'and wrenches are heard again'


def in_real_time(heard_again: int, last: int) -> tuple[list[int], list[int], np.ndarray, float]:
    """Steps of truth and odometry and the applied surge force, answering step k with k + 1 N.

    And the longest time, s, in which no truth was heard: the plant stood still, or this process.

    The twist has the stamps of the odometry. Where a machine is given patience steps are longer:
    to hear 400 messages a second is work.
    """
    h, ns = patience(0.01), round(patience(STEP))  # s, ns
    given = faults(
        gone={'kind': 'sensor_drop_out', '_from': 30 * h, 'to': 50 * h},
        late={'kind': 'sensor_delay', 'delay': 20 * h, '_from': 60 * h, 'to': 100 * h},
        mute={'kind': 'wrench_loss', '_from': 120 * h, 'to': heard_again * h},
    )
    plant = parameters(vehicle='herman2018', step=h, duration=last * h, wrench_timeout=50 * h)
    ready = 'expected_subscribers:=["odom=2","twist=1","wrench_applied=1","ground_truth/odom=2"]'
    with graph((PLANT, [*plant, '-p', ready, *given])) as (peer, _):
        peer.listen(*HEARD, topics.TWIST)
        say = peer.node.create_publisher(topics.WRENCH.type, topics.WRENCH.name, 10)

        def answer(message: Any) -> None:
            k = step_of(message, ns)
            say.publish(convert.wrench(k * ns, (k + 1.0, 0, 0, 0, 0, 0), Frames()))

        qos, came = topics.every_step(), list[float]()
        peer.node.create_subscription(topics.ODOM.type, topics.ODOM.name, answer, qos)
        kind, name = topics.GROUND_TRUTH.type, topics.GROUND_TRUTH.name
        peer.node.create_subscription(kind, name, lambda _: came.append(time.monotonic()), qos)
        truth = peer.heard[topics.GROUND_TRUTH.name]
        peer.until(lambda: truth and step_of(truth[-1], ns) == last, 'the end')
        peer.until(lambda: len(peer.heard[topics.WRENCH_APPLIED.name]) > last, 'every wrench')
        applied = np.array([m.wrench.force.x for m in peer.heard[topics.WRENCH_APPLIED.name]])
        steps = [step_of(m, ns) for m in peer.heard['odom']]
        peer.until(lambda: len(peer.heard['twist']) == len(steps), 'every twist')
        assert [step_of(m, ns) for m in peer.heard['twist']] == steps
        return [step_of(m, ns) for m in truth], steps, applied, float(np.diff(came).max())


@pytest.mark.parametrize(
    ('entry', 'words'),
    [
        ({'kind': 'sensor_freeze'}, ('faults.a.kind', 'sensor_drop_out')),
        ({'kind': 'sensor_bias'}, ('faults.a', 'velocity, attitude')),
        ({'kind': 'sensor_drop_out', '_from': 0.5, 'to': 0.2}, ('faults.a.to', 'after from')),
        ({'kind': 'actuator', 'axis': 'yaw'}, ('faults.a', 'efficiency or stuck')),
        ({'kind': 'thruster', 'thruster': 'T1', 'stuck': 1.0}, ('faults.a.thruster', 'has none')),
        ({'kind': 'thruster', 'thruster': 'T1', 'stuck': 1.0}, ('a.thruster', '{thrusters: true}')),
        ({'kind': 'wrench_loss', 'delay': 1.0}, ('faults.a.delay', 'one of')),
    ],
)
def test_wrong_faults_end_with_one_line(entry: dict[str, Any], words: tuple[str, ...]) -> None:
    vehicle = 'bluerov2_heavy' if '{thrusters: true}' in words else 'herman2018'
    plant = parameters(vehicle=vehicle, lockstep=True, duration=1.0)
    with program() as made, pytest.raises(InputError) as caught:
        made.add(PlantNode, [*plant, *faults(a=entry)])
    assert all(word in str(caught.value) for word in words)
