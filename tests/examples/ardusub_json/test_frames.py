"""Frames and answers of ArduSub's JSON interface, over UDP, by a process of its own."""

import signal
import struct
from collections.abc import Iterator

import numpy as np
import pytest
from helpers.sitl_peer import NEUTRAL, Backend, SitlPeer, backend, read

AHEAD = [1400, 1400, 1600, 1600, 1500, 1500, 1500, 1500]


@pytest.fixture(scope='module')
def running() -> Iterator[Backend]:
    with backend('--vehicle', 'bluerov2_heavy', '--eta', '1', '2', '3', '0', '0', '0.5') as process:
        yield process


def joined(peer: SitlPeer) -> SitlPeer:
    """The peer, once the backend has taken it for its autopilot; two frames are answered."""
    peer.count = 0
    peer.send(peer.packet(NEUTRAL))
    while peer.is_silent(1.1):  # another one was there a moment ago
        peer.send(peer.packet(NEUTRAL))
    peer.count = 1
    peer.send(peer.packet(NEUTRAL))
    while read(peer.heard())['timestamp'] < 2 / peer.rate:
        pass  # what was sent twice may be answered twice
    peer.count = 2
    return peer


@pytest.fixture(scope='module')
def one(running: Backend) -> SitlPeer:
    return joined(SitlPeer(running.port))


@pytest.fixture
def peer(one: SitlPeer) -> SitlPeer:
    one.rate, one.channels = 400, 16
    joined(one)
    one.frame()  # so that frame 0 goes back
    one.count = 0
    return one


def test_the_first_answer_is_one_frame_after_the_start(peer: SitlPeer) -> None:
    first = peer.frame()
    assert first['timestamp'] == 1 / 400
    assert first['position'] == pytest.approx([1, 2, 3], abs=1e-4)
    assert first['attitude'] == pytest.approx([0, 0, 0.5], abs=1e-4)
    assert first['quaternion'] == pytest.approx([np.cos(0.25), 0, 0, np.sin(0.25)], abs=1e-4)


@pytest.mark.parametrize('rate', [50, 400, 1200, 333])
def test_time_advances_by_one_frame(peer: SitlPeer, rate: int) -> None:
    peer.rate = rate
    t = peer.run(20 / rate)['timestamp']
    assert t == pytest.approx(np.arange(1, 21) / rate, rel=1e-12)


def test_a_rate_that_changes_on_the_way_goes_on_in_time(peer: SitlPeer) -> None:
    peer.rate = 1200
    before = peer.run(0.05, AHEAD)
    peer.rate = 400
    after = peer.run(0.05, AHEAD)
    t = np.concatenate([before['timestamp'], after['timestamp']])
    assert np.diff(t) == pytest.approx([1 / 1200] * 59 + [1 / 400] * 20)
    speed = np.concatenate([before['velocity'], after['velocity']]) @ [np.cos(0.5), np.sin(0.5), 0]
    assert (np.diff(speed) > 0).all()


def test_frames_of_32_channels_move_it_as_those_of_16(peer: SitlPeer) -> None:
    few = peer.run(0.5, AHEAD)
    peer.count, peer.channels = 0, 32
    many = peer.run(0.5, AHEAD)
    assert np.linalg.norm(few['velocity'][-1]) > 0.05
    assert np.array_equal(few['velocity'], many['velocity'])


def test_a_repeated_frame_has_the_same_answer_and_no_step(peer: SitlPeer) -> None:
    peer.run(0.1)
    packet = peer.packet(AHEAD)
    answers = []
    for _ in range(3):
        peer.send(packet)
        answers.append(peer.heard())
    assert answers[0] == answers[1] == answers[2]
    peer.count += 1
    assert peer.frame()['timestamp'] == pytest.approx(42 / 400)


def test_repeated_frames_that_have_piled_up_are_answered_once(
    peer: SitlPeer, running: Backend
) -> None:
    peer.run(0.1)
    running.process.send_signal(signal.SIGSTOP)
    for _ in range(5):
        peer.send(peer.packet(NEUTRAL))
    running.process.send_signal(signal.SIGCONT)
    peer.heard()
    assert peer.is_silent()


def test_a_count_that_goes_back_is_a_restart(peer: SitlPeer, running: Backend) -> None:
    first = peer.frame(AHEAD)
    moved = peer.run(1.0, AHEAD)
    assert np.linalg.norm(moved['position'][-1] - first['position']) > 0.05
    peer.count = 0
    again = peer.frame(AHEAD)
    assert all(np.array_equal(first[key], again[key]) for key in first)
    running.until('ArduSub has started again')


def test_an_autopilot_at_another_port_takes_over_once_the_first_is_silent(
    peer: SitlPeer, running: Backend
) -> None:
    peer.run(0.2)
    other = SitlPeer(running.port)
    other.count = 7
    peer.send(peer.packet(NEUTRAL))  # and right behind it
    other.send(other.packet(NEUTRAL))
    assert read(peer.heard())['timestamp'] == pytest.approx(81 / 400)
    peer.count += 1
    assert other.is_silent()
    running.until('a second sender')
    assert joined(other).frame()['timestamp'] == 3 / 400
    other.socket.close()
    assert joined(peer).frame()['timestamp'] == 3 / 400


@pytest.mark.parametrize(
    'data',
    [
        b'',
        b'\x1a',
        struct.pack('<HHI16H', 18459, 400, 1, *NEUTRAL),
        struct.pack('<HHI15H', 18458, 400, 1, *NEUTRAL[1:]),
        struct.pack('<HHI17H', 18458, 400, 1, *NEUTRAL, 1500),
        struct.pack('<HHI16H', 29569, 400, 1, *NEUTRAL),
        struct.pack('>HHI16H', 18458, 400, 1, *NEUTRAL),
        struct.pack('<HHI16H', 18458, 0, 1, *NEUTRAL),
        b'{"timestamp":1}\n' * 100,
    ],
)
def test_what_is_no_frame_is_dropped(peer: SitlPeer, running: Backend, data: bytes) -> None:
    peer.frame()
    peer.send(data)
    assert peer.is_silent(0.05)
    assert peer.frame()['timestamp'] == 2 / 400
    running.until('bytes are no frame')


def test_pulses_of_all_widths_keep_the_answer_finite(peer: SitlPeer) -> None:
    for width in (0, 1, 900, 1100, 1499, 1501, 1900, 2100, 65535):
        peer.run(0.5, [width, 65535 - width] * 8)  # `read` looks at each answer


def test_an_autopilot_that_is_gone_does_no_harm(peer: SitlPeer, running: Backend) -> None:
    gone = joined(SitlPeer(running.port))
    gone.send(gone.packet(NEUTRAL))
    gone.socket.close()
    assert joined(peer).frame()['timestamp'] == 3 / 400
