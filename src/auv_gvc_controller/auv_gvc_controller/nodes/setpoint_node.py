"""Set-points as a node: `cmd_vel` and `cmd_accel`, published ahead of the odometry."""

import time
from typing import Any

import numpy as np

from auv_dynamics.ros import interface, topics
from auv_dynamics.ros.node_interface import NodeInterface, hears_odometry, steady_timer
from auv_dynamics.ros.node_main import BulkNode, main_of
from auv_dynamics.ros.parameters import declare_settings
from auv_gvc_controller.control.odometry_guard import Limits, Now, OdometryGuard
from auv_gvc_controller.control.setpoint import SetpointSettings, make_setpoint

BLOCK = 256  # set-points that are evaluated at once
PATIENCE = 0.3  # s without odometry after which stamps that have gone back are believed


class SetpointNode(BulkNode):
    """Publishes nu_d and nu_d_dot for every step up to `horizon` steps ahead.

    At least up to the next odometry, which must find its set-point when it comes.
    """

    def __init__(self, **options: Any):
        super().__init__('setpoint_node', **options)
        self.graph = NodeInterface(self)
        p = declare_settings(self, SetpointSettings)
        grid, self._horizon = p.grid(self.get_name()), p.horizon
        self._step_ns, self._last = grid.step_ns, grid.last
        self._setpoint = make_setpoint(p.setpoint, grid.duration)
        self.graph.must_hold = self._horizon
        self._publish_velocity = self.graph.output(topics.CMD_VEL)
        self._publish_acceleration = self.graph.output(topics.CMD_ACCEL)
        odometry = topics.one_at_a_time() if self.lockstep else topics.newest_measurement(1)
        self.graph.listen(topics.ODOM, self._on_odometry, odometry)
        # in lock-step the odometry may go on for `horizon` steps while this node does not look
        gap = max(interface.NANOSECONDS, (10 + self._horizon) * self._step_ns)
        self._guard = OdometryGuard(gap, Limits(), lockstep=False, patience=PATIENCE)
        self._newest = self._next = self._first = 0
        self._gap = self._stride = 1  # steps from one odometry to the next; the usual number
        self._rows = np.empty(0)  # of the steps from `_first` on
        # in lock-step the odometry asks; this is for when the subscribers match after it
        steady_timer(self, 0.1 if self.lockstep else 0.02, self._publish)
        self._heard: float | None = None  # steady clock, s
        self.graph.in_trouble_while(lambda: hears_odometry(self, topics.ODOM, self._heard))
        self.begin(f'publishes set-points every {grid.step:g} s, once there is odometry')

    def _on_odometry(self, ns: int, _: tuple[float, ...]) -> None:
        self._heard, restarts = time.monotonic(), self._guard.restarts
        elapsed = self._guard.accept(ns, (), Now(self._heard))  # whatever the speed
        newest = (ns - self._guard.origin) // self._step_ns
        if elapsed:
            gap = max(1, newest - self._newest)
            self._gap, self._stride = gap, min(gap, self._gap)  # a single delay is not the usual
        elif self._guard.restarts > restarts:  # what was published has stamps of the old time
            self._next = newest
        else:  # the first one, or the clock has jumped forward: no step is published twice
            self._next = max(self._next, newest)
        self._newest = newest
        self._publish()

    def _publish(self) -> None:
        if self._guard.last is None or not self.graph.ready():
            return
        until = self._newest + max(self._horizon, self._stride)
        until = until if self._last is None else min(until, self._last)
        # what lies behind the odometry is of no use to anybody: in real time after a delay of this
        # node, without an end after a jump of the clock
        if self._last is None or not self.lockstep:
            self._next = max(self._next, self._newest - self._horizon)
        while self._next <= until:
            row = self._row(self._next)
            ns = self._guard.origin + self._next * self._step_ns
            self._publish_velocity(ns, row[:6])
            self._publish_acceleration(ns, row[6:])
            self.graph.latest_ns = ns
            self._next += 1

    def _row(self, k: int) -> np.ndarray:
        if not self._first <= k < self._first + len(self._rows):
            self._first = k
            t = np.arange(k, k + BLOCK) * (self._step_ns / interface.NANOSECONDS)
            values, slopes = self._setpoint.value(t), self._setpoint.derivative(t)
            self._rows = np.concatenate([values, slopes], axis=1)
        return self._rows[k - self._first]


def main() -> None:
    """Run the node."""
    main_of(SetpointNode)
