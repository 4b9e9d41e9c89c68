"""A driver for a BlueROV2 with ArduSub: offers `odom`, takes `wrench`, speaks MAVLink.

    python examples/bluerov2_mavlink/driver.py --ros-args -p autoarm:=true

README.md beside it says what it needs, what it does and where its limits are.
"""

import time
from typing import Any

import numpy as np
from pilot import Timeouts
from pilot_messages import FOUR, MANUAL_CONTROL, OVERRIDE
from std_srvs.srv import SetBool
from udp import UdpPort
from vehicle_link import LinkSettings, VehicleLink
from wrench_mapping import WrenchMapping

from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros import topics
from auv_dynamics.ros.interface import BadMessageError
from auv_dynamics.ros.node_interface import ERROR, NodeInterface, steady_timer
from auv_dynamics.ros.node_main import BulkNode, main_of
from auv_dynamics.ros.parameters import declare, refuse_unknown

POLL = 0.004  # s between two looks at the socket
LAST_WORDS = 0.05  # s that they need to leave


class Driver(BulkNode):
    """Wiring: MAVLink on one side, odometry and wrench on the other."""

    prompt = True

    def __init__(self) -> None:
        super().__init__('bluerov2_driver')
        self.graph = NodeInterface(self)
        settings = self._settings()
        how, voltage = settings.how, self._number('supply_voltage', 16.0, 'V at the thrusters')
        connection = declare(
            self, 'connection', str, 'udpin:127.0.0.1:14550', 'udpin or udpout:HOST:PORT'
        )
        system = declare(
            self, 'system', int, 255, "own MAVLink id; the vehicle's SYSID_MYGCS",
            at_least=1, at_most=255,
        )  # fmt: skip
        vehicle = declare(self, 'vehicle', str, 'bluerov2_heavy', 'vehicle file, or bare name')
        autoarm = declare(self, 'autoarm', bool, False, 'arm without being asked by ~/arm')
        refuse_unknown(self)
        dofs = FOUR if how == MANUAL_CONTROL else tuple(range(6))
        self._mapping = WrenchMapping(load_vehicle(vehicle), dofs, voltage)
        try:
            self._port = UdpPort(connection, system, 0)
        except (ValueError, OSError) as error:
            raise InputError(self.get_name(), 'connection', 'a free UDP port', error) from None
        self._link = VehicleLink(settings, self._port.send, self.graph.complain)
        self._stale = settings.wrench.neutral
        # stamps follow the steady clock: a step of the system's clock does not reach them
        self._epoch = self.get_clock().now().nanoseconds - time.monotonic_ns()
        self._say_odometry = self.graph.output(topics.ODOM)
        self.graph.listen(topics.WRENCH, self._on_wrench, topics.newest_command())
        self.create_service(SetBool, '~/arm', self._on_arm)
        self.graph.in_trouble_while(lambda: (ERROR, self._not_commanded()))
        if autoarm:
            self._link.pilot.want(True, time.monotonic_ns())
        steady_timer(self, POLL, self._poll)
        steady_timer(self, 0.1, self._report)

    def _number(self, name: str, default: float, text: str) -> float:
        return declare(self, name, float, default, text, at_least=0.001)

    def _settings(self) -> LinkSettings:
        neutral = self._number('wrench_timeout', 0.5, 's without a wrench: neutral')
        disarm = self._number('disarm_timeout', 3.0, 's without a wrench: disarmed')
        silence = self._number('link_timeout', 1.0, 's without a position: neutral')
        return LinkSettings(
            system=declare(self, 'vehicle_system', int, 1, "the vehicle's MAVLink id", at_least=1),
            rate=self._number('rate', 50.0, 'Hz, of the odometry'),
            timeout=round(silence * 1e9),
            how=declare(
                self, 'command', str, OVERRIDE, 'six axes, or four for any pilot gain',
                one_of=(OVERRIDE, MANUAL_CONTROL),
            ),
            wrench=Timeouts(round(neutral * 1e9), round(disarm * 1e9)),
        )  # fmt: skip

    def _poll(self) -> None:
        """Take what the vehicle has said, publish what follows, send what is due."""
        for message, address in self._port.receive():
            if not self._is_ours(message, address):
                self._link.refused += 1
                continue
            sample = self._link.receive(message, time.monotonic_ns())
            if sample is not None and self.graph.ready():
                ns = sample.ns + self._epoch
                self._say_odometry(ns, sample.x)
                self.graph.latest_ns = ns
        self._link.tick(time.monotonic_ns())

    def _is_ours(self, message: Any, address: tuple[str, int]) -> bool:
        """Whether an address is the vehicle's; another one may become it while none is heard."""
        if not self._link.hears() and self._link.is_vehicle(message):
            self._port.answer(address)
        return self._port.is_peer(address)

    def _on_wrench(self, ns: int, tau: tuple) -> None:
        now = time.monotonic_ns()
        age = now + self._epoch - ns
        if not -self._stale <= age <= self._stale:
            found = f'{age / 1e9:.3g} s'
            raise BadMessageError(f'wrench: age: expected at most {self._stale / 1e9:g} s, {found}')
        axes, share = self._mapping.axes(np.array(tau), self._link.gain or 1.0)
        self.graph.facts['share of the wrench'] = round(share, 3)
        self._link.command(axes, now)

    def _on_arm(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self._link.pilot.want(request.data, time.monotonic_ns())
        word = 'arms when wrenches come' if request.data else 'neutral, then disarmed'
        response.success, response.message = True, word
        return response

    def _report(self) -> None:
        """Keep what the diagnostics say; what is not right is said again."""
        link = self._link
        uncertainty = link.clock.uncertainty
        self.graph.facts.update(
            {
                'vehicle heard': link.hears(),
                'armed': link.pilot.armed,
                'commanded': link.pilot.commands,
                'mode': link.pilot.mode,
                'MAVLink refused': link.refused,
                'MAVLink broken': self._port.broken,
                'time uncertain by (s)': uncertainty and round(uncertainty, 6),
                'battery (V)': link.voltage,
            }
        )

    def _not_commanded(self) -> str:
        """Why wrenches do not reach the motors, as long as they do not."""
        link = self._link
        if not link.hears():
            return 'vehicle not heard'
        if not link.pilot.wanted:
            return f'not commanded: {link.pilot.why}'
        return '' if link.pilot.commands else 'not armed'

    def close(self) -> None:
        """Leave the vehicle neutral and disarmed."""
        self._link.leave()
        time.sleep(LAST_WORDS)  # the socket's buffer goes with the process
        self._port.close()


if __name__ == '__main__':
    main_of(Driver)
