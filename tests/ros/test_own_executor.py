"""Our nodes in an executor of somebody else's, and as a user starts them: public rclpy alone."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from geometry_msgs.msg import WrenchStamped
from helpers.node_processes import fresh_domain, start_node, stop
from helpers.nodes_in_process import Program, program

from auv_dynamics.nodes.plant_node import PlantNode
from auv_dynamics.ros import convert, node_main, topics
from auv_dynamics.ros.interface import Frames
from auv_dynamics.ros.node_interface import steady_timer
from auv_gvc_controller.nodes.controller_node import ControllerNode
from auv_gvc_controller.nodes.setpoint_node import SetpointNode

PLANT: dict[str, Any] = {'vehicle': 'herman2018', 'publish_clock': False}
CONTROLLER: dict[str, Any] = {
    'vehicle': 'herman2018', 'law': 'gvc', 'limits.wrench': [1e5],
    'gains.k_D': [12.0], 'gains.k_I': [1.0], 'gains.Lambda': [0.8], 'gains.Gamma': [60.0],
}  # fmt: skip
AHEAD = (0.2, 0.0, 0.0, 0.0, 0.0, 0.1)


@pytest.fixture
def house(monkeypatch: pytest.MonkeyPatch) -> Iterator[Program]:
    def taken(*_: Any) -> None:
        raise AssertionError('past the executor')

    monkeypatch.setattr(node_main, 'taken', taken)
    monkeypatch.setattr(node_main, 'DataWait', taken)
    with program() as made:
        yield made


def test_plant_and_controller_share_the_executor_of_a_user(house: Program) -> None:
    plant = house.add(PlantNode, PLANT)
    controller = house.add(ControllerNode, CONTROLLER)
    user = rclpy.create_node('user', context=house.context, use_global_arguments=False)
    house.executor.add_node(user)
    setpoints = user.create_publisher(topics.CMD_VEL.type, topics.CMD_VEL.name, 10)
    wrenches: list[WrenchStamped] = []
    user.create_subscription(WrenchStamped, topics.WRENCH.name, wrenches.append, 10)

    def publish() -> None:
        setpoints.publish(convert.twist(plant.graph.latest_ns, AHEAD, Frames()))

    steady_timer(user, 0.02, publish)
    house.until(lambda: plant.plant.x[7] > 0.05 and len(wrenches) > 20)
    assert not plant.bulk
    assert not controller.bulk
    assert (plant.take_data(), controller.take_data()) == (0, 0)
    assert plant.graph.refused.total() == 0
    user.destroy_node()


def test_broken_bytes_are_refused_and_leave_the_executor_alone(house: Program) -> None:
    plant = house.add(PlantNode, PLANT)
    user = rclpy.create_node('user', context=house.context, use_global_arguments=False)
    house.executor.add_node(user)
    broken = user.create_publisher(WrenchStamped, topics.WRENCH.name, topics.every_step())
    house.until(lambda: broken.get_subscription_count() > 0)
    broken.publish(b'\0\1\0\0\7')
    house.until(lambda: plant.graph.refused.total() == 1)
    k = plant.plant.k
    house.until(lambda: plant.plant.k > k + 5)
    user.destroy_node()


def test_a_run_in_lock_step_needs_no_data_path_either(house: Program) -> None:
    run = {'lockstep': True, 'duration': 0.5, 'expected_subscribers': ['odom=2']}
    house.add(SetpointNode, {'lockstep': True, 'duration': 0.5, 'setpoint.surge.offset': 0.2})
    house.add(ControllerNode, {**CONTROLLER, 'lockstep': True, 'setpoint_pairing': 'exact',
                               'setpoint_acceleration': 'topic'})  # fmt: skip
    plant = house.add(PlantNode, {**PLANT, **run})
    house.until(lambda: plant.exit_code is not None)
    assert (plant.exit_code, plant.plant.k) == (0, 50)


def test_a_node_that_a_user_starts_keeps_its_scheduling_class(tmp_path: Path) -> None:
    bag = ['-p', f'bag:={tmp_path / "bag"}', '-p', 'strict:=false']
    for name, given in {'setpoint_node': [], 'recorder_node': bag}.items():
        process = start_node(name, fresh_domain(), *given)
        assert 'begins' in process.stdout.readline()
        policy = os.sched_getscheduler(process.pid)
        stop(process)
        assert policy == os.SCHED_OTHER
