"""The plant as a node: odometry out, wrench in, in lock-step or in real time."""

import sys
import time
from typing import Any

import numpy as np
from rclpy.duration import Duration
from std_srvs.srv import SetBool, Trigger

from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.kernel.integrator import TABLEAUS
from auv_dynamics.nodes.stepping import LockStep, RealTime
from auv_dynamics.plant.actuators import make_actuators
from auv_dynamics.plant.faults import FaultSetting, make_faults
from auv_dynamics.plant.parameters import part
from auv_dynamics.plant.plant import Plant, initial_state
from auv_dynamics.plant.sensors import SensorNoise
from auv_dynamics.plant.uncertainty import make_uncertainty
from auv_dynamics.ros import topics
from auv_dynamics.ros.endpoints import NAMELESS, full_name, other_publishers
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.ros.node_interface import NodeInterface, Peers, steady_timer
from auv_dynamics.ros.node_main import BulkNode, main_of
from auv_dynamics.ros.parameters import (
    declare,
    declare_grid,
    declare_spec,
    declare_specs,
    refuse_unknown,
)

MET = 0.5  # s after its birth in which those who are there already are met, before it starts
NEW = 3.0  # s after its start in which it gives way to another clock, and may wait for its name


class PlantNode(BulkNode):
    """A 6-DOF vehicle: integrates equations (1) and (2) between two wrenches."""

    prompt = True

    def __init__(self, **options: Any):
        super().__init__('plant_node', **options)
        self._born, self._rivals_since = time.monotonic(), 0.0
        self.graph = NodeInterface(self)
        self._declare()
        refuse_unknown(self)
        self.graph.must_hold = self.window
        self._publish_odometry = self.graph.output(topics.ODOM)
        self._publish_clock = self.graph.output(topics.CLOCK) if self._offers_clock else None
        self._publish_twist = self.graph.output(topics.TWIST)
        self._publish_disturbance = self.graph.output(topics.DISTURBANCE)
        self._publish_applied = self.graph.output(topics.WRENCH_APPLIED) if self._acts else None
        self._publish_truth = self.graph.output(topics.GROUND_TRUTH) if self._senses else None
        self.peers = Peers(self, self._start_after)
        self.graph.also_ready_when(self.peers.not_ready)
        self.pace = LockStep(self) if self.lockstep else RealTime(self)
        qos = topics.one_at_a_time() if self.lockstep else topics.newest_command()
        self.graph.listen(topics.WRENCH, self.pace.wrench, qos)
        self.create_service(SetBool, '~/run', self._on_run)
        self.create_service(Trigger, '~/reset', self._on_reset)
        self.paused = self._start_paused
        self._started: float | None = None
        steady_timer(self, 0.05, self._start)

    def _declare(self) -> None:
        path = declare(self, 'vehicle', str, '', 'vehicle file, or bare name of a shipped one')
        if not path:
            raise InputError(self.get_name(), 'vehicle', 'a vehicle file', None)
        grid = declare_grid(self)
        self.step_ns, self.last = grid.step_ns, grid.last
        self._start_paused = declare(
            self, 'start_paused', bool, False, 'wait for ~/run before step 0'
        )
        self._offers_clock = declare(
            self, 'publish_clock', bool, True, 'publish /clock; false beside another that does'
        )
        self.window = declare(
            self, 'recorder_window', int, 0, 'most steps ahead of recorder/progress; 0: any',
            at_least=0, at_most=topics.DEPTH - 1,
        )  # fmt: skip
        integrator = declare(
            self, 'integrator', str, 'ode5', 'integration method', one_of=list(TABLEAUS)
        )
        seed = declare(
            self, 'seed', int, 0, 'seed of the random numbers of sensors and faults', at_least=0
        )
        eta = self._six('initial.eta', 'position, m, and Euler angles, rad, NED')
        nu = self._six('initial.nu', 'velocity, m/s and rad/s, body frame')
        self._start_after = (
            declare(self, 'start_after', list[str], None, 'nodes whose ~/ready is awaited') or []
        )
        default = 30.0 if self.lockstep else 0.5
        self.wrench_timeout = declare(
            self, 'wrench_timeout', float, default,
            's without a wrench: then zero wrench in real time; in lock-step the run fails',
            at_least=0.0,
        )  # fmt: skip
        disturbances = declare_specs(self, 'disturbance')
        actuators, sensors = (
            declare_spec(self, key, part(key)) or None for key in ('actuators', 'sensors')
        )
        name, vehicle = self.get_name(), load_vehicle(path)
        self.graph.hardware_id = vehicle.name
        allocated = bool((actuators or {}).get('thrusters', False))
        faults = make_faults(
            *declare_specs(self, 'faults'),
            FaultSetting(
                grid.step, grid.duration, vehicle.thrusters, allocated, vehicle.name, name
            ),
        )
        self._acts = actuators is not None or faults.acting
        self._senses = sensors is not None or faults.sensing
        self.plant = Plant(
            make_uncertainty(vehicle, disturbances[0], name, disturbances[1]),
            grid.step,
            integrator,
            initial_state(eta, nu),
            make_actuators(actuators, vehicle, grid.step, name),
            SensorNoise(sensors or {}, seed, faults) if self._senses else None,
            faults,
            seed,
        )

    def _six(self, name: str, text: str) -> np.ndarray:
        values = declare(self, name, list[float], [0.0] * 6, f'initial {text}')
        if len(values) != 6 or not np.all(np.isfinite(values)):
            raise InputError(self.get_name(), name, '6 finite numbers', values)
        return np.array(values)

    def _start(self) -> None:
        now = time.monotonic()
        newcomer = self._started is None or now - self._started < NEW
        if newcomer and self._publish_clock is not None and not self._is_only_clock(now):
            return
        met = now - self._born >= MET and self.exit_code is None
        if met and self.graph.ready() and not self.peers.not_ready() and not self.paused:
            if self._started is None:
                self._started = now
                pace = 'lock-step' if self.lockstep else 'real time'
                step = f'{self.step_ns / NANOSECONDS:g} s'
                self.begin(f'simulates {self.graph.hardware_id} in {pace}, {step} per step')
            self.pace.start()

    def _is_only_clock(self, now: float) -> bool:
        """Whether nobody else publishes `/clock`; who came later ends with one line."""
        names = sorted(map(full_name, other_publishers(self, topics.CLOCK.name)))
        self._rivals_since = (self._rivals_since or now) if names else 0.0
        if not names or (NAMELESS in names and now - self._rivals_since < NEW):
            return not names
        if self.exit_code is None:
            expected = f'nobody else who publishes {topics.CLOCK.name}, or false'
            found = ', '.join(names)
            print(InputError(self.get_name(), 'publish_clock', expected, found), file=sys.stderr)
            self.exit_code = 2
        return False

    def publish_state(self, measured: int | None) -> None:
        """Publish step k; odometry first, since the controller waits for it.

        `measured` is the step that odometry and twist are stamped with, None withholds them.
        """
        plant, ns = self.plant, self.plant.k * self.step_ns
        if measured is not None:
            self._publish_odometry(measured * self.step_ns, plant.measured)
        if self._publish_clock is not None:
            self._publish_clock(ns, ())
        if measured is not None:
            self._publish_twist(measured * self.step_ns, plant.measured[7:])
        if self._publish_truth is not None:
            self._publish_truth(ns, plant.x)
        self.graph.latest_ns = ns
        self.graph.facts['step'] = plant.k

    def publish_forces(self, k: int, applied: tuple[float, ...], F: tuple[float, ...]) -> None:
        """Publish what was applied at step k and F, what opposed it in (1)."""
        self._publish_disturbance(k * self.step_ns, F)
        if self._publish_applied is not None:
            self._publish_applied(k * self.step_ns, applied)

    def end(self, code: int, text: str = '') -> None:
        """End the node: 1 with the reason when the run failed."""
        if text:
            self.get_logger().error(text)
        if code == 0:
            for publisher in self.graph.publishers.values():
                publisher.wait_for_all_acked(Duration(seconds=5.0))
        self.exit_code = code

    def _on_run(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        reason = ''
        if request.data:
            reason = self.peers.not_ready() or ('' if self.graph.ready() else 'plant_node')
        if not reason:
            self.paused = not request.data
            self.pace.resume() if request.data else self.pace.pause()
        word = 'running' if request.data else 'paused'
        response.success, response.message = not reason, reason or word
        return response

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        step = self.pace.reset()
        response.success, response.message = True, f'state of the start from step {step}'
        return response


def main() -> None:
    """Run the node."""
    main_of(PlantNode)
