"""A simulated BlueROV2 with an ArduSub-like autopilot, over UDP, in real time.

python examples/bluerov2_mavlink/ardusub_endpoint.py --connection udpout:127.0.0.1:14550
"""

import argparse
import select
import signal
import time

from ardusub_autopilot import MODES, Autopilot, Settings
from udp import UdpPort

PERIOD = 0.005  # s


def main() -> None:
    """Run until SIGTERM or SIGINT."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--connection', default='udpout:127.0.0.1:14550')
    parser.add_argument('--system', type=int, default=1, help='MAVLink id of the vehicle')
    parser.add_argument('--vehicle', default='bluerov2_heavy')
    parser.add_argument('--thrusters', choices=('square', 'measured'), default='square')
    parser.add_argument('--voltage', type=float, default=16.0)
    parser.add_argument('--gain', type=float, default=0.5, help='pilot gain of MANUAL_CONTROL')
    parser.add_argument('--mode', choices=MODES.values(), default='MANUAL', help='at boot')
    parser.add_argument('--firmware', default='4.5.0', help='version that it behaves like')
    parser.add_argument('--position-after', type=float, default=50.0, help='s from boot')
    parser.add_argument('--ready-after', type=float, default=10.0, help='s from boot, to arm')
    parser.add_argument(
        '--velocity-bias', type=float, nargs=3, default=[0.0] * 3, help='of the estimator, m/s'
    )
    parser.add_argument('--eta', type=float, nargs=6, default=[0.0] * 6, help='NED, rad')
    options = parser.parse_args()
    mode = next(number for number, name in MODES.items() if name == options.mode)
    settings = Settings(
        options.vehicle, tuple(options.eta), (0.0,) * 6,
        options.thrusters, options.voltage, options.gain, mode,
        tuple(int(number) for number in f'{options.firmware}.0.0'.split('.')[:3]),
        options.position_after, options.ready_after, tuple(options.velocity_bias),
    )  # fmt: skip
    port = UdpPort(options.connection, options.system, 1)
    autopilot = Autopilot(settings, port.send)
    stopped = []
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stopped.append(True))
    boot = time.monotonic_ns()
    print(f'{options.vehicle}: {options.connection}', flush=True)
    while not stopped:
        for message, address in port.receive():
            port.answer(address)
            autopilot.receive(message, time.monotonic_ns() - boot)
        autopilot.advance(time.monotonic_ns() - boot)
        select.select([port], [], [], PERIOD)
    port.close()
    state = 'armed' if autopilot.armed else 'disarmed'
    print(f'{state}, motors {autopilot.pulses}, inputs {autopilot.channels}', flush=True)


if __name__ == '__main__':
    main()
