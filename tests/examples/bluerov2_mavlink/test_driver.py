"""The driver as a process, with a simulated vehicle on the other side of a wire."""

import signal
import socket
import time
from collections.abc import Callable
from itertools import pairwise
from typing import Any
from unittest.mock import Mock

import driver as driver_module
import numpy as np
import pytest
from driver import COMPONENT, SET, Driver
from helpers.mavlink_relay import Relay, fork_program, free_port, start_program
from helpers.node_processes import PATIENCE, Peer, fresh_domain, parameters, stop
from helpers.nodes_in_process import program
from helpers.patience import FACTOR, patience
from navigation import Exchange
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from std_srvs.srv import SetBool
from udp import UdpPort
from vehicle_link import LinkSettings
from wrench_mapping import FOUR, MANUAL_CONTROL

from auv_dynamics.files.errors import InputError
from auv_dynamics.ros import convert, interface, topics
from auv_dynamics.ros.interface import NANOSECONDS, BadMessageError, Frames

FRAMES = Frames()
SOON = ('--position-after', '0.5', '--ready-after', '1')  # after boot, for a test
AT_REST = f'disarmed, motors {[1500] * 8}, inputs {[1500] * 6}'
PUSH = (12.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Sea:
    """Driver, wire and vehicle, and a controller of the test's own: it answers with one wrench."""

    def __init__(self, start: Callable[..., Any] = fork_program) -> None:
        self.domain = fresh_domain()
        port = free_port(self.domain)
        self.relay = Relay(port)
        self.driver = start(
            'driver.py', self.domain, '--ros-args',
            *parameters(connection=f'udpin:127.0.0.1:{port}', autoarm=True),
            *parameters(disarm_timeout=patience(1.0), rate=50.0 / FACTOR**0.5),
        )  # fmt: skip
        self.vehicle = self.launch()
        self.peer = Peer(self.domain)
        self.peer.listen(topics.DIAGNOSTICS)
        self.odometry: list[tuple[int, np.ndarray]] = []
        self.tau: tuple | None = None
        self._wrench = self.peer.node.create_publisher(topics.WRENCH.type, 'wrench', 10)
        self.peer.node.create_subscription(
            topics.ODOM.type, 'odom', self._on_odometry, topics.newest_measurement(1)
        )

    def launch(self):
        """A vehicle that has just been booted."""
        return fork_program(
            'ardusub_endpoint.py',
            self.domain,
            '--connection',
            f'udpout:127.0.0.1:{self.relay.port}',
            *SOON,
        )

    def say(self, tau: tuple, ns: int) -> None:
        self._wrench.publish(convert.wrench(ns, tau, FRAMES))

    def _on_odometry(self, message) -> None:
        ns, x = interface.read_odometry(message, FRAMES)
        self.odometry.append((ns, np.array(x)))
        if self.tau is not None:
            self.say(self.tau, ns)

    @property
    def surge(self) -> float:
        return self.odometry[-1][1][7] if self.odometry else 0.0

    def facts(self) -> dict[str, str]:
        """What the driver's diagnostics said last."""
        for array in reversed(self.peer.heard['/diagnostics']):
            for status in array.status:
                if status.name == '/bluerov2_driver':
                    return {'': status.message, **{v.key: v.value for v in status.values}}
        return {}

    def until(self, done, what: str) -> None:
        self.peer.until(done, what)

    def catch_up(self) -> None:
        """Take what has come while nobody listened, until the odometry is of now."""

        def age() -> float:
            return (self.peer.node.get_clock().now().nanoseconds - self.odometry[-1][0]) / 1e9

        self.until(lambda: self.odometry and age() < patience(0.5), 'odometry of now')
        assert age() > -0.05

    def go_ahead(self) -> None:
        """Wait until the push is seen; where the driver disarmed the vehicle, arm it again."""

        def ahead() -> bool:
            if '~/arm (' in self.facts().get('', ''):
                self.peer.heard['/diagnostics'].clear()
                self.peer.call(SetBool, 'bluerov2_driver/arm', SetBool.Request(data=True))
            return self.surge > 0.2

        self.until(ahead, 'the vehicle to go ahead')

    def more(self, count: int = 10) -> None:
        """Wait for so many more odometry messages."""
        enough = len(self.odometry) + count
        self.until(lambda: len(self.odometry) >= enough, 'odometry')

    def close(self) -> None:
        self.peer.close()
        self.relay.close()
        for process in (self.driver, self.vehicle):
            if process.poll() is None:
                process.kill()
            if not process.stdout.closed:
                print(process.communicate(timeout=PATIENCE)[0])


@pytest.fixture(scope='module')
def running():
    sea = Sea()
    try:
        yield sea
        stamps = [ns for ns, _ in sea.odometry]
        assert all(a < b for a, b in pairwise(stamps)), 'whatever happened, time goes forward'
        assert stop(sea.driver)[0] == 0
        code, output = stop(sea.vehicle)
        assert code == 0
        assert AT_REST in output, 'the driver leaves no vehicle behind that runs'
    finally:
        sea.close()


@pytest.fixture
def sea(running):
    """The vehicle under way; a test that needs it otherwise puts it back."""
    running.tau = PUSH
    running.catch_up()
    running.go_ahead()
    running.peer.heard['/diagnostics'].clear()  # what they say from now on is of now
    return running


def test_a_push_ahead_goes_ahead_and_stamps_are_of_now(sea) -> None:
    sea.more()
    sea.catch_up()
    _, x = sea.odometry[-1]
    assert x[0] > 0.0
    assert np.abs(x[8:]).max() < 0.1


def test_the_diagnostics_tell_the_vehicle(sea) -> None:
    sea.until(sea.facts, 'diagnostics')
    found = sea.facts()
    assert found['firmware'] == 'ArduSub 4.5.0'
    assert (found['mode'], found['armed'], found['commanded']) == ('19', 'True', 'True')
    assert (found['battery (V)'], found['pilot gain']) == ('16.0', '1.0')


def test_a_wrench_that_falls_silent_is_let_go_and_taken_up_again(sea) -> None:
    sea.tau = None
    sea.until(lambda: sea.facts().get('armed') == 'False', 'a disarmed vehicle')
    sea.until(lambda: sea.surge < 0.2, 'the water to brake it')
    sea.tau = PUSH
    sea.until(lambda: sea.surge > 0.2, 'the vehicle to go ahead')


def test_a_cut_link_gives_no_odometry_and_says_so_until_it_is_back(sea) -> None:
    sea.relay.cut = True
    try:
        sea.until(lambda: 'waits for ATTITUDE, LOCAL_POSITION' in sea.facts().get('', ''), 'it')
        before = len(sea.odometry)
        sea.peer.spin(0.3)
        assert len(sea.odometry) == before, 'nothing old is repeated'
    finally:
        sea.relay.cut = False
    sea.more()
    sea.until(lambda: sea.facts().get('vehicle heard') == 'True', 'the report')


def test_a_vehicle_that_is_started_anew_is_not_armed_unasked(sea) -> None:
    last = sea.odometry[-1][0]
    sea.vehicle.kill()
    sea.vehicle.communicate(timeout=PATIENCE)
    sea.vehicle = sea.launch()
    sea.until(lambda: '~/arm (vehicle restarted' in sea.facts().get('', ''), 'the report')
    sea.more()
    assert sea.odometry[-1][0] > last
    assert sea.surge == 0.0
    assert sea.facts()['armed'] == 'False'
    sea.peer.call(SetBool, 'bluerov2_driver/arm', SetBool.Request(data=True))
    sea.until(lambda: sea.surge > 0.2, 'the vehicle to go ahead')


def test_broken_and_foreign_packets_are_counted_and_change_nothing(sea) -> None:
    stranger = mavlink.MAVLink(None, srcSystem=9, srcComponent=1)
    false = mavlink.MAVLink_local_position_ned_message(10**8, *[50.0] * 6).pack(stranger)
    for data in (bytes(false), bytes(false[:-2]) + b'\0\0', b'no message at all', bytes(false[:9])):
        sea.relay.inject(data)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as elsewhere:  # as if it were the vehicle
        vehicle = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        elsewhere.sendto(
            mavlink.MAVLink_local_position_ned_message(10**8, *[50.0] * 6).pack(vehicle),
            sea.relay.driver,
        )
    sea.until(lambda: int(sea.facts().get('MAVLink refused', 0)) > 1, 'the strangers counted')
    sea.until(lambda: int(sea.facts().get('MAVLink broken', 0)) > 1, 'the broken ones counted')
    sea.more()
    assert 0.1 < sea.surge < 2.0


@pytest.mark.parametrize(
    ('kind', 'tau', 'age'), [('age', PUSH, 2.0), ('not finite', (np.nan,) * 6, 0.0)]
)
def test_a_wrench_that_must_not_be_used_is_refused(sea, kind, tau, age) -> None:
    def refused() -> int:
        return sum(
            int(count) for key, count in sea.facts().items()
            if key.startswith('refused wrench') and kind in key
        )  # fmt: skip

    sea.until(sea.facts, 'diagnostics')
    before, limit = refused(), time.monotonic() + PATIENCE
    while refused() == before:
        assert time.monotonic() < limit
        sea.say(tau, sea.peer.node.get_clock().now().nanoseconds - round(age * NANOSECONDS))
        sea.peer.spin(0.2)
    sea.more()
    assert np.isfinite(sea.odometry[-1][1]).all()


@pytest.mark.parametrize(
    ('start', 'number'),
    [(start_program, signal.SIGINT), (fork_program, signal.SIGHUP)],
    ids=['SIGINT', 'SIGHUP'],
)
def test_a_signal_leaves_the_vehicle_disarmed_its_inputs_neutral(start, number) -> None:
    sea = Sea(start)
    try:
        sea.tau = PUSH
        sea.go_ahead()
        code, output = stop(sea.driver, number)
        assert code == 0
        assert AT_REST in stop(sea.vehicle)[1]
        assert 'waits for' in output, 'what it waited for stands in the log'
    finally:
        sea.close()


GIVEN = {
    'vehicle': 'bluerov2', 'supply_voltage': 14.0, 'command': MANUAL_CONTROL, 'rate': 20.0,
    'vehicle_system': 7, 'system': 254,
    'link_timeout': 2.0, 'wrench_timeout': 0.25, 'disarm_timeout': 4.0,
}  # fmt: skip
TIMES = (2 * NANOSECONDS, MANUAL_CONTROL, NANOSECONDS // 4, 4 * NANOSECONDS)


def test_every_parameter_is_heard_and_nothing_is_armed_unasked(monkeypatch) -> None:
    made = {name: Mock(wraps=getattr(driver_module, name))
            for name in ('VehicleLink', 'WrenchMapping', 'UdpPort')}  # fmt: skip
    for name, mock in made.items():
        monkeypatch.setattr(driver_module, name, mock)
    with program() as peer:
        place = f'udpin:127.0.0.1:{free_port(peer.context.get_domain_id())}'
        node = peer.add(Driver, {'connection': place, **GIVEN})
        with pytest.raises(InputError, match='expected a free UDP port, found address already in'):
            peer.add(Driver, {'connection': place})
        with pytest.raises(InputError, match=r'connection: expected udpin:.*, found tcp:sub:14550'):
            peer.add(Driver, {'connection': 'tcp:sub:14550'})
        with pytest.raises(InputError, match='vehicle_system: expected a number from 1 to 255'):
            peer.add(Driver, {'vehicle_system': 256})
        first = {name: mock.call_args_list[0].args for name, mock in made.items()}
        assert first['VehicleLink'][0] == LinkSettings(7, 254, 6, 20.0, *TIMES)
        vehicle, *rest = first['WrenchMapping']
        assert (vehicle.name, *rest) == ('bluerov2', FOUR, 14.0)
        assert first['UdpPort'] == (place, 254, COMPONENT)
        assert not node._link.pilot.wanted
        node._link.gain, now = 0.5, node.get_clock().now().nanoseconds
        strong = (1000.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        node._on_wrench(now, strong)
        _, share = node._mapping.axes(np.array(strong), 0.5)
        assert node.graph.facts['share of the wrench'] == pytest.approx(share, abs=5e-4)
        with pytest.raises(BadMessageError, match='wrench: age'):
            node._on_wrench(now + 2 * NANOSECONDS, strong)
        node._link.differences += ['one', 'another']
        node._link.clock.add(Exchange(1_000_000, 7, 4_000_000))
        node._link.inputs, node._link.voltage, node._link.gain_from = (1501, 1502), 15.5, 'told'
        node._link.refused, node._port.broken, node._link.pilot.mode = 3, 4, 2
        node._report()
        facts = node.graph.facts
        assert (facts['differs'], facts['inputs']) == ('one; another', '(1501, 1502)')
        assert (facts['time uncertain by (s)'], facts['battery (V)']) == (0.0015, 15.5)
        assert (facts['MAVLink refused'], facts['MAVLink broken'], facts['mode']) == (3, 4, 2)
        assert (facts['pilot gain'], facts['vehicle heard'], facts['armed']) == (
            '0.5 told', False, False,
        )  # fmt: skip
        assert node._waiting() == 'waits for a heartbeat of system 7'
        epoch = node._epoch
        for later, follows in ((SET // 2, False), (-2 * SET, True)):
            node._epoch = epoch + later
            node._report()
            assert (abs(node._epoch - epoch) < SET // 4) == follows, 'the clock was set'


@pytest.mark.parametrize(
    'place',
    ['tcp:127.0.0.1:14550', 'udpin:14550', 'udpout:127.0.0.1:rov', 'udpin:127.0.0.1:65536'],
)
def test_what_is_no_connection_is_refused(place: str) -> None:
    with pytest.raises(ValueError, match='expected udpin:HOST:PORT or udpout:HOST:PORT'):
        UdpPort(place, 255, COMPONENT)


def test_a_peer_that_cannot_be_reached_is_no_error() -> None:
    port = UdpPort('udpout:255.255.255.255:9', 255, COMPONENT)  # broadcast, which is forbidden
    port.send(mavlink.MAVLink_timesync_message(0, 0))
    port.close()
