"""A driver for a BlueROV2 with ArduSub: offers `odom`, takes `wrench`, speaks MAVLink.

    python examples/bluerov2_mavlink/driver.py --ros-args -p autoarm:=true

README.md beside it says what it needs, what it does and where its limits are.
"""

import time
from typing import Any

import numpy as np
from std_srvs.srv import SetBool
from udp import CONNECTION, UdpPort
from vehicle_link import LinkSettings, VehicleLink
from wrench_mapping import FOUR, MANUAL_CONTROL, OVERRIDE, WrenchMapping

from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError, reason
from auv_dynamics.ros import topics
from auv_dynamics.ros.interface import BadMessageError
from auv_dynamics.ros.node_interface import ERROR, NodeInterface, steady_timer
from auv_dynamics.ros.node_main import BulkNode, main_of
from auv_dynamics.ros.parameters import declare, refuse_unknown
from auv_dynamics.vehicle.vehicle import Vehicle

POLL = 0.004  # s between two looks at the socket
COMPONENT = 191  # MAVLink's onboard computer: two stations of one id are told apart by it
SET = 200_000_000  # ns by which the system's clock must have been set for stamps to follow
LAST_WORDS = 1.5  # s for letting go at the end, at most


class Driver(BulkNode):
    """Wiring: MAVLink on one side, odometry and wrench on the other."""

    def __init__(self, **options: Any) -> None:
        super().__init__('bluerov2_driver', **options)
        self.graph = NodeInterface(self)
        connection = declare(self, 'connection', str, 'udpin:127.0.0.1:14550', CONNECTION)
        name = declare(self, 'vehicle', str, 'bluerov2_heavy', 'vehicle file, or bare name')
        voltage = self._number('supply_voltage', 16.0, 'V at the thrusters')
        autoarm = declare(self, 'autoarm', bool, False, 'arm without being asked by ~/arm')
        vehicle = load_vehicle(name)
        settings = self._settings(vehicle)
        refuse_unknown(self)
        dofs = FOUR if settings.how == MANUAL_CONTROL else tuple(range(6))
        self._mapping = WrenchMapping(vehicle, dofs, voltage)
        try:
            self._port = UdpPort(connection, settings.station, COMPONENT)
        except OSError as error:
            found = reason(error)
            raise InputError(self.get_name(), 'connection', 'a free UDP port', found) from None
        except ValueError:
            raise InputError(self.get_name(), 'connection', CONNECTION, connection) from None
        self._link = VehicleLink(settings, self._port.send, self.graph.complain)
        self._waits: list[str] = []
        self._stale = settings.neutral
        # stamps follow the steady clock, and the system's where that is set
        self._epoch = self.get_clock().now().nanoseconds - time.monotonic_ns()
        self._say_odometry = self.graph.output(topics.ODOM)
        self.graph.listen(topics.WRENCH, self._on_wrench, topics.newest_command())
        self.create_service(SetBool, '~/arm', self._on_arm)
        self.graph.in_trouble_while(lambda: (ERROR, self._waiting()))
        if autoarm:
            self._link.pilot.want(True, time.monotonic_ns())
        steady_timer(self, POLL, self._poll)
        steady_timer(self, 0.1, self._report)

    def _number(self, name: str, default: float, text: str) -> float:
        return declare(self, name, float, default, text, at_least=0.001)

    def _settings(self, vehicle: Vehicle) -> LinkSettings:
        neutral = self._number('wrench_timeout', 0.5, 's without a wrench: neutral')
        disarm = self._number('disarm_timeout', 3.0, 's without a wrench: disarmed')
        silence = self._number('link_timeout', 1.0, 's without a position: neutral')
        return LinkSettings(
            system=declare(
                self, 'vehicle_system', int, 1, "the vehicle's MAVLink id", at_least=1, at_most=255
            ),
            station=declare(
                self, 'system', int, 255, "own MAVLink id; the vehicle's SYSID_MYGCS",
                at_least=1, at_most=255,
            ),
            thrusters=vehicle.thrusters.matrix.shape[1] if vehicle.thrusters else 0,
            rate=self._number('rate', 50.0, 'Hz, of the odometry'),
            timeout=round(silence * 1e9),
            how=declare(
                self, 'command', str, OVERRIDE, 'six axes, or four for any pilot gain',
                one_of=(OVERRIDE, MANUAL_CONTROL),
            ),
            neutral=round(neutral * 1e9),
            disarm=round(disarm * 1e9),
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

    def _follow_clock(self) -> None:
        """Go by the clock that was set: the controller judges the age of stamps by it."""
        before, now = time.monotonic_ns(), self.get_clock().now().nanoseconds
        took = time.monotonic_ns() - before
        later = now - before - took // 2 - self._epoch
        if abs(later) > SET + took:
            self._epoch += later
            self.graph.complain(f'the clock was set by {later / 1e9:.3g} s: so are the stamps')

    def _report(self) -> None:
        """Keep what the diagnostics say; what is waited for is said as soon as it changes."""
        self._follow_clock()
        link = self._link
        uncertainty, profile = link.clock.uncertainty, link.profile
        self.graph.facts.update(
            {
                'vehicle heard': link.hears(),
                'firmware': profile.firmware,
                'differs': '; '.join(link.differences),
                'armed': link.pilot.armed,
                'commanded': link.pilot.commands,
                'mode': link.pilot.mode,
                'inputs': str(link.inputs),
                'pilot gain': f'{link.gain} {link.gain_from}'.strip(),
                'MAVLink refused': link.refused,
                'MAVLink broken': self._port.broken,
                'time uncertain by (s)': uncertainty and round(uncertainty, 6),
                'battery (V)': link.voltage,
            }
        )
        waits = link.waits_for(time.monotonic_ns())
        if waits == self._waits:
            return
        if new := [what for what in waits if what not in self._waits]:
            self.get_logger().info(f'waits for {", ".join(new)}')
        self._waits = waits
        self.graph.publish_diagnostics()

    def _waiting(self) -> str:
        return f'waits for {", ".join(self._waits)}' if self._waits else ''

    def close(self) -> None:
        """Leave the vehicle neutral and disarmed, and wait until it shows that."""
        pilot, until = self._link.pilot, time.monotonic() + LAST_WORDS
        if pilot.wanted:
            pilot.want(False, time.monotonic_ns())
        while pilot.letting_go and time.monotonic() < until:
            self._poll()
            time.sleep(POLL)
        self._port.close()


if __name__ == '__main__':
    main_of(Driver)
