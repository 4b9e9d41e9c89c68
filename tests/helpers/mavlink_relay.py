"""A wire between driver and vehicle that can be cut, and programs of the example as processes."""

import select
import socket
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path

from helpers.fork_server import Process
from helpers.node_processes import environment, fork_server
from helpers.patience import patience

EXAMPLE = Path(__file__).resolve().parents[2] / 'examples' / 'bluerov2_mavlink'


def start_program(name: str, domain: int, *arguments: str) -> subprocess.Popen:
    """Start a program of the example; its output is captured."""
    return subprocess.Popen(
        [sys.executable, str(EXAMPLE / name), *arguments],
        env=environment(domain), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip


def fork_program(name: str, domain: int, *arguments: str) -> Process:
    """The same in little time."""
    return fork_server().start([str(EXAMPLE / name), *arguments], environment(domain))


def free_port(domain: int) -> int:
    """UDP port that nobody has, of those that the system gives to nobody and DDS does not use."""
    for port in range(2000 + 10 * domain, 2010 + 10 * domain):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, suppress(OSError):
            probe.bind(('127.0.0.1', port))
            return port
    raise AssertionError(f'no free port of domain {domain}')


class Relay:
    """Passes datagrams between a vehicle that sends to `port` and a driver that listens."""

    def __init__(self, driver: int):
        self._vehicle_side, self._driver_side = (
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)
        )
        self._vehicle_side.bind(('127.0.0.1', 0))
        self._driver_side.bind(('127.0.0.1', 0))
        self.driver = ('127.0.0.1', driver)
        self._vehicle: tuple[str, int] | None = None
        self.port = self._vehicle_side.getsockname()[1]
        self.cut = self._ended = False
        self._thread = threading.Thread(target=self._pass, daemon=True)
        self._thread.start()

    def inject(self, data: bytes) -> None:
        """Send the driver a datagram that is not the vehicle's."""
        self._driver_side.sendto(data, self.driver)

    def close(self) -> None:
        """End the thread."""
        self._ended = True
        self._thread.join(timeout=patience(5.0))

    def _pass(self) -> None:
        sides = [self._vehicle_side, self._driver_side]
        while not self._ended:
            for side in select.select(sides, [], [], 0.1)[0]:
                data, address = side.recvfrom(65535)
                if side is self._vehicle_side:
                    self._vehicle = address
                if self.cut:
                    continue
                if side is self._vehicle_side:
                    self._driver_side.sendto(data, self.driver)
                elif self._vehicle is not None:
                    self._vehicle_side.sendto(data, self._vehicle)
        for side in sides:
            side.close()
