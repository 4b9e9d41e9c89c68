"""The driver's link and the simulated autopilot, joined by bytes, in a time of the test's own."""

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np
from ardusub_autopilot import Autopilot, Settings, vehicle_of
from navigation import Sample
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from udp import UdpPort
from vehicle_link import LinkSettings, VehicleLink
from wrench_mapping import FOUR, MANUAL_CONTROL, WrenchMapping

PERIOD = 4_000_000  # ns
SECOND = 1_000_000_000
Booted = partial(Settings, position_after=0.0, ready_after=0.0)  # in the time of a test


class Wire:
    """Packs messages as one side does, keeps the bytes."""

    def __init__(self, system: int, component: int):
        self.data: list[bytes] = []
        self._sender = mavlink.MAVLink(self, srcSystem=system, srcComponent=component)

    def send(self, message: Any) -> None:
        self._sender.send(message)

    def write(self, data: bytes) -> None:
        self.data.append(bytes(data))

    def take(self) -> list[bytes]:
        data, self.data = self.data, []
        return data


class Pair:
    """Vehicle and link; `up` and `down` may drop or spoil what travels."""

    def __init__(self, settings: Settings | None = None, link: LinkSettings | None = None):
        self.now = 5_000 * SECOND  # steady clock of this side
        self.settings = settings or Booted()
        link = link or LinkSettings()
        self._ups, self._downs = Wire(255, 0), Wire(1, 1)
        self.up: Callable[[bytes], bytes] = bytes
        self.down: Callable[[bytes], bytes] = bytes
        self.said: list[str] = []
        self.sent: list[Any] = []
        self.samples: list[Sample] = []
        self.share = 1.0
        self.tau: Any = None  # of the last run
        self.link = VehicleLink(link, self._ups.send, self.said.append)
        dofs = FOUR if link.how == MANUAL_CONTROL else tuple(range(6))
        vehicle = vehicle_of(self.settings.vehicle)
        self.mapping = WrenchMapping(vehicle, dofs, self.settings.voltage)
        self._port = UdpPort('udpin:127.0.0.1:0', 255, 0)
        self.boot()

    def boot(self) -> None:
        """Start the autopilot anew."""
        self.booted = self.now
        self.autopilot = Autopilot(self.settings, self._downs.send)

    @property
    def broken(self) -> int:
        return self._port.broken

    def run(self, seconds: float, tau: Any = None) -> None:
        """Let time pass; each sample is answered with the wrench tau."""
        self.tau = tau
        axes_of = cache(lambda gain: self.mapping.axes(np.array(tau), gain))
        for _ in range(round(seconds * SECOND / PERIOD)):
            self.now += PERIOD
            for message in self._over(self._ups, self.up):
                self.sent.append(message)
                self.autopilot.receive(message, self.now - self.booted)
            self.autopilot.advance(self.now - self.booted)
            for message in self._over(self._downs, self.down):
                sample = self.link.receive(message, self.now)
                if sample is None:
                    continue
                self.samples.append(sample)
                if tau is not None:
                    axes, self.share = axes_of(self.link.gain or 1.0)
                    self.link.command(axes, self.now)
            self.link.tick(self.now)

    def stand_still(self, seconds: float) -> None:
        """Stop the autopilot, its clock as well, and then let it go on."""
        ways, self.up, self.down = (self.up, self.down), nothing, nothing
        self.booted += round(seconds * SECOND)
        self.run(seconds)
        self.up, self.down = ways

    def steer(self, seconds: float, x: int = 600, every: float = 0.04) -> None:
        """Let somebody else's joystick say something every so many s."""
        message = mavlink.MAVLink_manual_control_message(1, x, 0, 500, 0, 0)
        joystick = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
        for _ in range(round(seconds / every)):
            data = message.pack(joystick)
            self.autopilot.receive(*self._port.parse(data), self.now - self.booted)
            self.run(every, self.tau)

    def flown(self, tau: Any = None) -> 'Pair':
        """The pair once wrenches reach the motors."""
        self.link.pilot.want(True, self.now)
        self.run(1.2, tau=np.zeros(6) if tau is None else tau)
        assert self.autopilot.armed
        return self

    def _over(self, wire: Wire, through: Callable[[bytes], bytes]) -> list[Any]:
        return [m for data in wire.take() for m in self._port.parse(through(data))]


def nothing(_: bytes) -> bytes:
    return b''
