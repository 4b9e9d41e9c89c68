"""ArduSub's side of the JSON interface, and the backend for it to talk to.

Written from the interface's description and from how SITL reads an answer: it looks for a key, and
for its numbers directly behind the colon.
"""

import contextlib
import os
import re
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import json_backend
import numpy as np
from helpers.node_processes import fork_server
from helpers.patience import patience
from json_backend import Frame, made, options_of, parse

ROOT = Path(__file__).resolve().parents[2]
BACKEND = ROOT / 'examples' / 'ardusub_json' / 'json_backend.py'
NEUTRAL = [1500] * 16
KEYS = ('timestamp', 'gyro', 'accel_body', 'position', 'attitude', 'quaternion', 'velocity')
NUMBER = r'-?\d+(?:\.\d+)?(?:e[-+]?\d+)?'
NUMBERS = re.compile(rf'\[({NUMBER}(?:, *{NUMBER})*)\]|{NUMBER}')
PATIENCE = patience(60.0)  # s, for a kernel that has to be compiled


def read(data: bytes) -> dict[str, Any]:
    """Values of an answer, as SITL finds them."""
    text = data.decode('ascii')
    assert text[0] == text[-1] == '\n'
    assert '\n' not in text[1:-1]
    values = {}
    for key in KEYS:
        at = text.index(key) + len(key) + 2  # its quotation mark and the colon
        found = NUMBERS.match(text, at)
        assert found, text[at:]
        numbers = [float(n) for n in found[0].strip('[]').split(',')]
        values[key] = np.array(numbers) if found[1] else numbers[0]
    assert all(np.isfinite(value).all() for value in values.values())
    return values


class SitlPeer:
    """An autopilot that waits for the answer to each frame."""

    def __init__(self, port: int, rate: int = 400, channels: int = 16):
        self.rate, self.channels, self._to = rate, channels, ('127.0.0.1', port)
        self.restart()

    def restart(self) -> None:
        """Begin anew, at another port, as a process that is started again."""
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(PATIENCE)
        self.count = 0

    def packet(self, pulses: Sequence[int], **changes: int) -> bytes:
        """Frame of the present count."""
        magic = changes.get('magic', {16: 18458, 32: 29569}[self.channels])
        widths = [*pulses, *[0] * self.channels][: self.channels]
        head = struct.pack('<HHI', magic, self.rate, changes.get('count', self.count))
        return head + struct.pack(f'<{self.channels}H', *widths)

    def send(self, data: bytes) -> None:
        self.socket.sendto(data, self._to)

    def heard(self) -> bytes:
        return self.socket.recv(65000)

    def frame(self, pulses: Sequence[int] = NEUTRAL) -> dict[str, Any]:
        """Send a frame, wait for its answer."""
        self.send(self.packet(pulses))
        answer = self.heard()
        self.count += 1
        return read(answer)

    def run(self, seconds: float, pulses: Sequence[int] = NEUTRAL) -> dict[str, np.ndarray]:
        """Answers to as many frames as take so long, stacked by key."""
        answers = [self.frame(pulses) for _ in range(round(seconds * self.rate))]
        return {key: np.array([answer[key] for answer in answers]) for key in KEYS}

    def is_silent(self, seconds: float = 0.2) -> bool:
        """Whether nothing comes for a while."""
        self.socket.settimeout(seconds)
        try:
            self.socket.recv(65000)
        except TimeoutError:
            return True
        finally:
            self.socket.settimeout(PATIENCE)
        return False


class DirectPeer(SitlPeer):
    """The same without a network: of what answers frames in this process."""

    def __init__(self, answer: Callable[[Frame], bytes], rate: int = 400):
        self.rate, self.channels, self.count, self._answer = rate, 16, 0, answer

    def send(self, data: bytes) -> None:
        frame = parse(data)
        assert frame
        self._data = self._answer(frame)

    def heard(self) -> bytes:
        return self._data


@contextlib.contextmanager
def direct(*options: str, rate: int = 400) -> Iterator[DirectPeer]:
    """Autopilot of a backend in this process."""
    told = options_of(options)
    physics, bags = made(told)
    begin, paced = (bags.begin if bags else lambda: None), not told.no_time_sync
    yield DirectPeer(json_backend.Backend(None, physics, begin, paced=paced).answer, rate)
    if bags:
        bags.close()


class Backend:
    """The example as a process; `said` are its lines."""

    def __init__(self, *options: str):
        command = [str(BACKEND), '--listen', '127.0.0.1:0', *options]
        self.process = fork_server().start(command, os.environ)
        self.said: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.port = int(self.until('waiting for ArduSub on udp').rpartition(':')[2])

    def _read(self) -> None:
        for line in self.process.stdout:
            self.said.append(line.rstrip('\n'))

    def until(self, text: str) -> str:
        """The line that contains a text, once it is there."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            for line in self.said:
                if text in line:
                    return line
            assert self.process.poll() is None or self._reader.is_alive(), self.said
            time.sleep(0.01)
        raise AssertionError(f'{text!r} is not among {self.said}')

    def ended(self) -> int:
        """Exit code, once it has ended and all is read."""
        code = self.process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        return code


@contextlib.contextmanager
def backend(*options: str) -> Iterator[Backend]:
    """A backend that ends with the test."""
    running = Backend(*options)
    try:
        yield running
    finally:
        running.process.terminate()
        running.process.wait(PATIENCE)
