"""A vehicle file as the physics of ArduSub SITL, over its JSON interface.

python examples/ardusub_json/json_backend.py --vehicle bluerov2_heavy
"""

import argparse
import json
import select
import socket
import struct
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / 'bluerov2_mavlink'))  # ardusub_mixer

from json_bag import Bags
from json_motors import CHANNELS, make_motors
from json_physics import Physics, Reading

from auv_analysis.scenario.scenario import load_scenario
from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import FailedError, InputError, on_signals, reason
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import read_text
from auv_dynamics.plant.actuators import Actuators, make_actuators
from auv_dynamics.plant.rotors import Rotors, make_rotors
from auv_dynamics.plant.uncertainty import make_uncertainty
from auv_dynamics.vehicle.kinematics import euler

# libraries/SITL/examples/JSON/readme.md of ArduPilot: magic, frame rate, frame count, pulses;
# the larger one with SERVO_32_ENABLE 1
LAYOUTS = {18458: struct.Struct('<HHI16H'), 29569: struct.Struct('<HHI32H')}
QUIET = 1.0  # s without a frame after which another sender may take the autopilot's place
SILENCE = 5.0  # s without a frame, which is said


class Frame(NamedTuple):
    """What ArduSub sends: frames per second, number of the frame, pulses (32,) in microseconds."""

    rate: int
    count: int
    pulses: np.ndarray


def parse(data: bytes) -> Frame | None:
    """Frame of a datagram, None where it is none."""
    layout = LAYOUTS.get(int.from_bytes(data[:2], 'little'))
    if layout is None or len(data) != layout.size:
        return None
    _, rate, count, *widths = layout.unpack(data)
    pulses = np.zeros(CHANNELS)
    pulses[: len(widths)] = widths
    return Frame(rate, count, pulses) if rate else None


def line(reading: Reading, *, paced: bool = True) -> bytes:
    """What ArduSub reads: its parser takes no blank after a colon."""
    document: dict[str, Any] = {
        'timestamp': reading.t,
        'imu': {'gyro': reading.gyro.tolist(), 'accel_body': reading.accel_body.tolist()},
        'position': reading.position.tolist(),
        'attitude': euler(reading.quaternion).tolist(),
        'quaternion': reading.quaternion.tolist(),
        'velocity': reading.velocity.tolist(),
    }
    document['no_time_sync'] = int(not paced)
    return b'\n%s\n' % json.dumps(document, separators=(',', ':'), allow_nan=False).encode()


def say(text: str) -> None:
    """Tell the user."""
    print(text, file=sys.stderr, flush=True)


class Backend:
    """Answers the frames of one autopilot, which waits for each answer; others are dropped.

    Parameters
    ----------
    port : UDP socket that does not block
    physics : Physics
    begin : called before the first frame after a start of the autopilot
    paced : whether ArduSub keeps to the clock on the wall

    """

    def __init__(
        self, port: socket.socket, physics: Physics, begin: Callable[[], None], *, paced: bool
    ):
        self._port, self._physics, self._begin, self._paced = port, physics, begin, paced
        self._peer: Any = None
        self._count: int | None = None
        self._answer = b''
        self._heard, self._said = time.monotonic(), set[str]()
        self.frames = self.lost = 0

    def serve(self) -> None:
        """Answer what comes within a second; of frames that have piled up, the newest."""
        if not select.select([self._port], [], [], 1.0)[0]:
            if time.monotonic() - self._heard > SILENCE:
                self._say_once('silent', f'no frame of ArduSub for {SILENCE:g} s: waiting')
            return
        newest = None
        for data, address in self._arrived():
            frame = parse(data)
            if frame is None:
                self._say_once('frame', f'{address}: {len(data)} bytes are no frame: dropped')
            elif self._is_peer(address):
                newest = frame
        if newest is not None:
            self._send(self.answer(newest))

    def answer(self, frame: Frame) -> bytes:
        """Step, and the answer; a frame that comes again has its answer again, without a step."""
        last, self._count = self._count, frame.count
        if frame.count == last:
            return self._answer
        if last is None or frame.count < last:
            if self._physics.t:
                say('ArduSub has started again: back to the start')
            self._physics.reset()
            self._begin()
        else:
            self.lost += frame.count - last - 1
        self._answer = line(self._physics.step(frame.pulses, frame.rate), paced=self._paced)
        self.frames += 1
        return self._answer

    def _arrived(self) -> Iterator[tuple[bytes, Any]]:
        while True:
            try:
                yield self._port.recvfrom(2048)
            except BlockingIOError:
                return

    def _is_peer(self, address: Any) -> bool:
        before, now = self._heard, time.monotonic()
        if address != self._peer:
            if self._peer is not None and now - before < QUIET:
                self._say_once('other', f'{address}: a second sender beside {self._peer}: dropped')
                return False
            self._peer, self._count = address, None
            say(f'ArduSub at {address[0]}:{address[1]}')
        self._heard = now
        self._said.discard('silent')
        return True

    def _send(self, data: bytes) -> None:
        try:
            self._port.sendto(data, self._peer)
        except OSError as error:  # ArduSub sends its frame again
            self._say_once('send', f'{self._peer}: {reason(error)}')

    def _say_once(self, key: str, text: str) -> None:
        if key not in self._said:
            self._said.add(key)
            say(text)


def opened(text: str) -> socket.socket:
    """UDP socket at HOST:PORT; InputError where it cannot be had."""
    host, _, number = text.rpartition(':')
    port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        port.bind((host, int(number)))
    except (OSError, ValueError, OverflowError) as error:
        port.close()
        found = reason(error) if isinstance(error, OSError) else text
        raise InputError('--listen', text, 'HOST:PORT that is free', found) from None
    port.setblocking(False)
    return port


def made(options: argparse.Namespace) -> tuple[Physics, Bags | None]:
    """Vehicle in its water, and what records it."""
    faults, spec = ((lambda: None), 1.0), {}
    if options.scenario:
        scenario = load_scenario(options.scenario)
        vehicle, texts, name = scenario.vehicle, scenario.attachments, scenario.path
        water = scenario.uncertainty, scenario.data['integrator'], scenario.initial
        faults, spec = (scenario.fault_rows, scenario.step), scenario.data.get('actuators', {})
        say(f'{name}: controllers, sensors, limits and delay left out: ArduSub has its own')
    else:
        vehicle, name = load_vehicle(options.vehicle), options.vehicle
        texts = {'vehicle.yaml': read_text(shipped('vehicles', options.vehicle), 'vehicle')}
        start = np.array(options.eta), np.zeros(6)
        water = make_uncertainty(vehicle, [], name, []), 'rk4', start
    if (thrusters := vehicle.thrusters) is None:
        raise InputError(name, 'thrusters', 'a vehicle with thrusters', 'none')
    eta = water[2][0]
    if not (np.isfinite(eta).all() and eta[2] >= 0.0):
        raise InputError(name, 'eta', 'finite numbers, a depth of 0 m or more', eta.tolist())
    motors, text = make_motors(thrusters, options.motors, options.voltage)
    say(f'{vehicle.name}: {text}')
    bags = Bags(options.bag, texts) if options.bag else None
    record = bags.write if bags else lambda *_: None

    lag = {key: spec[key] for key in ('lag', 'rate') if key in spec}
    turning = {'rotors': bool(thrusters.rotors), 'rotor_lag': spec.get('rotor_lag')}

    def actuators(step: float) -> tuple[Actuators, Rotors | None]:
        rotors = make_rotors(turning, thrusters, vehicle.name, step, name)
        return make_actuators(lag or None, vehicle, step, name), rotors

    return Physics(thrusters, motors, *water, actuators, faults, record), bags


def serve(options: argparse.Namespace) -> str:
    """Serve until a signal or the end of `--seconds`; what there was."""
    stopped: list[bool] = []
    with opened(options.listen) as port, on_signals(lambda: stopped.append(True)):
        physics, bags = made(options)
        begin = bags.begin if bags else lambda: None
        backend = Backend(port, physics, begin, paced=not options.no_time_sync)
        say('waiting for ArduSub on udp {}:{}'.format(*port.getsockname()))
        try:
            while not stopped and physics.t < options.seconds:
                backend.serve()
        finally:
            if bags:
                bags.close()
    return f'{physics.t:.3f} s, {backend.frames} frames, {backend.lost} lost'


def options_of(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    water = parser.add_mutually_exclusive_group(required=True)
    water.add_argument('--vehicle', help='vehicle file with thrusters, or bare name')
    water.add_argument('--scenario', help='its vehicle, start, currents, disturbances, faults')
    parser.add_argument('--listen', default='127.0.0.1:9002', metavar='HOST:PORT')
    parser.add_argument('--eta', type=float, nargs=6, default=[0.0] * 6, help='start: NED, rad')
    parser.add_argument('--motors', help='thruster of each motor, - for reversed: --motors=2,-1,3')
    parser.add_argument('--voltage', type=float, help='of the battery, V')
    parser.add_argument('--bag', type=Path, help='record into this folder')
    parser.add_argument('--no-time-sync', action='store_true', help='as fast as both can')
    parser.add_argument('--seconds', type=float, default=float('inf'), help='simulated, then end')
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit code: 0, 1 where the work failed, 2 for wrong input."""
    try:
        say(serve(options_of(arguments)))
    except (InputError, FailedError) as error:
        say(str(error))
        return 2 if isinstance(error, InputError) else 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
