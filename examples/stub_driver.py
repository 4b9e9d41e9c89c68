"""A vehicle driver in the plant's place: it offers `odom`, takes `wrench`, keeps its own time.

    .venv/bin/python examples/stub_driver.py --seconds 5

A real driver does the same with a DVL, an AHRS and thrusters. This one asks the model of the
vehicle what the wrench would do. It starts `setpoint_node` and `controller_node` beside itself.
"""

import argparse
import math
import os
import subprocess
import time

import numpy as np
import rclpy
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node

from auv_analysis.graph.experiment import environment
from auv_analysis.graph.supervisor import executable
from auv_dynamics import load_vehicle
from auv_dynamics.plant.plant import Plant, initial_state
from auv_dynamics.plant.uncertainty import make_uncertainty
from auv_dynamics.ros import convert
from auv_dynamics.ros.interface import Frames

PERIOD = 0.02  # s: 50 Hz, as a navigation filter may give
TIMEOUT = 0.5  # s without a wrench: no thrust
SURGE = 0.4  # m/s, the set-point
NODES = {
    'setpoint_node': ('auv_gvc_controller', [f'setpoint.surge.offset:={SURGE}', 'step:=0.02']),
    'controller_node': (
        'auv_gvc_controller',
        ['law:=gvc', 'vehicle:=herman2018_neutral', 'gains.k_D:=[4.0]', 'gains.k_I:=[1.0]',
         'gains.Lambda:=[0.8]', 'gains.Gamma:=[2.0]', 'setpoint_acceleration:=topic',
         'limits.wrench:=[300.0]'],
    ),
}  # fmt: skip


class StubDriver(Node):
    """What the controller needs of a vehicle: odometry, and somebody who takes the wrench."""

    def __init__(self) -> None:
        super().__init__('stub_driver')
        vehicle, start = load_vehicle('herman2018_neutral'), np.zeros(6)
        truth = make_uncertainty(vehicle, [], 'stub_driver', [])
        self.plant = Plant(truth, PERIOD, 'rk4', initial_state(start, start))
        self.tau, self._heard = (0.0,) * 6, 0.0
        self._odom = self.create_publisher(Odometry, 'odom', 10)
        self.create_subscription(WrenchStamped, 'wrench', self._on_wrench, 1)
        self.create_timer(PERIOD, self._tick)

    def _on_wrench(self, message: WrenchStamped) -> None:
        force, torque = message.wrench.force, message.wrench.torque
        tau = (force.x, force.y, force.z, torque.x, torque.y, torque.z)
        if all(map(math.isfinite, tau)):
            self.tau, self._heard = tau, time.monotonic()

    def _tick(self) -> None:
        if time.monotonic() - self._heard > TIMEOUT:
            self.tau = (0.0,) * 6
        self.plant.answer(self.tau)
        self.plant.advance()
        now = self.get_clock().now().nanoseconds
        self._odom.publish(convert.odometry(now, self.plant.measured, Frames()))


def main() -> None:
    """Run driver, set-points and controller for a while and print the speed that was reached."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seconds', type=float, default=5.0)
    parser.add_argument('--domain-id', type=int, default=72)
    options = parser.parse_args()
    os.environ.update(environment(options.domain_id))
    rclpy.init()
    driver = StubDriver()
    processes = []
    for node, (package, parameters) in NODES.items():
        arguments = [word for parameter in parameters for word in ('-p', parameter)]
        command = [str(executable(package, node)), '--ros-args', *arguments]
        processes.append(subprocess.Popen(command, env=os.environ))
    try:
        until = None
        while until is None or time.monotonic() < until:
            rclpy.spin_once(driver, timeout_sec=0.1)
            if until is None and any(driver.tau):
                until = time.monotonic() + options.seconds  # from the first wrench on
    finally:
        for process in processes:
            process.terminate()
        for process in processes:
            process.wait()
        reached = driver.plant.x[7]
        driver.destroy_node()
        rclpy.try_shutdown()
    print(f'surge {reached:.3f} m/s, set-point {SURGE} m/s')


if __name__ == '__main__':
    main()
