"""MAVLink 2 over UDP: one peer, a message per parse, nothing that is broken gets through."""

import socket
from collections.abc import Iterator
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

LARGEST = 65535  # bytes of a datagram
MOST = 500  # datagrams that are taken at once
LAST_PORT = 65535
CONNECTION = 'udpin:HOST:PORT or udpout:HOST:PORT'


class UdpPort:
    """A socket that hears MAVLink and answers its peer.

    Parameters
    ----------
    connection : 'udpin:HOST:PORT' listens there, and the peer is whoever `answer` names;
        'udpout:HOST:PORT' sends there from the start
    system, component : MAVLink ids that are sent

    Raises
    ------
    ValueError : no such connection
    OSError : the port cannot be had

    """

    def __init__(self, connection: str, system: int, component: int):
        kind, _, address = connection.partition(':')
        host, _, port = address.rpartition(':')
        known = kind in ('udpin', 'udpout') and host and port.isdecimal()
        if not known or int(port) > LAST_PORT:
            raise ValueError(f'expected {CONNECTION}, found {connection!r}')
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._peer: tuple[str, int] | None = None
        if kind == 'udpin':
            self._socket.bind((host, int(port)))
        else:
            self._peer = (host, int(port))
        self._sender = mavlink.MAVLink(self, srcSystem=system, srcComponent=component)
        self.broken = 0  # what was no message, or had another checksum

    def fileno(self) -> int:
        """File descriptor, to wait for."""
        return self._socket.fileno()

    def is_peer(self, address: tuple[str, int]) -> bool:
        """Whether this is where messages are sent to."""
        return address == self._peer

    def answer(self, address: tuple[str, int]) -> None:
        """Send to this address from now on."""
        self._peer = address

    def send(self, message: Any) -> None:
        """Send a message to the peer; nothing while there is none."""
        if self._peer is not None:
            self._sender.send(message)

    def write(self, data: bytes) -> None:
        """Send a datagram; a peer that is away loses it."""
        if self._peer is None:
            return
        try:
            self._socket.sendto(bytes(data), self._peer)
        except OSError:  # refused or unreachable: as lost as in the air
            return

    def receive(self) -> Iterator[tuple[Any, tuple[str, int]]]:
        """Messages that have arrived, with the address of each."""
        for _ in range(MOST):
            try:
                data, address = self._socket.recvfrom(LARGEST)
            except BlockingIOError:
                return
            for message in self.parse(data):
                yield message, address

    def parse(self, data: bytes) -> Iterator[Any]:
        """Messages of one datagram; what a broken one leaves does not reach the next."""
        parser = mavlink.MAVLink(None)
        parser.robust_parsing = True
        for message in parser.parse_buffer(data) or []:
            if message.get_type() == 'BAD_DATA':
                self.broken += 1
            else:
                yield message

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()
