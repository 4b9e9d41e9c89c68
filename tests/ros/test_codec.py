"""Patched templates against message objects: the same messages, the same refusals."""

import struct
from dataclasses import replace
from functools import cache

import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import AccelStamped, TwistStamped, WrenchStamped
from helpers.strategies import QUICK
from hypothesis import given
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.typesys import Stores, get_typestore
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from auv_dynamics.ros import interface
from auv_dynamics.ros.codec import KINDS, Codec, Layout, first_stamp, verified_layout
from auv_dynamics.ros.interface import BadMessageError, Frames
from auv_dynamics.ros.topics import type_name
from auv_dynamics.vehicle import DOFS

FRAMES = Frames()
STORE = get_typestore(Stores.ROS2_JAZZY)
STAMPS = st.integers(0, (2**31 - 1) * 10**9 + 10**9 - 1)
READ = (Odometry, TwistStamped, AccelStamped, WrenchStamped, JointState)
ANY = st.floats(-2e29, 2e29)  # together below what is absurd
UNIT = (0.5, -0.5, 0.5, 0.5)


def numbers(kind: type, values: list[float]) -> tuple:
    values = tuple(values[: KINDS[kind].size])
    return (*values[:3], *UNIT, *values[7:]) if kind is Odometry else values


def as_message(kind: type, ns: int, values: tuple, frames: Frames = FRAMES):
    return KINDS[kind].make(ns, values, frames)


def as_bytes(kind: type, ns: int, values: tuple, frames: Frames = FRAMES) -> bytes:
    return bytes(serialize_message(as_message(kind, ns, values, frames)))


@cache
def codec_of(kind: type) -> Codec:
    return Codec(kind, FRAMES, 'topic')


def long_way(kind: type) -> Codec:
    """A codec that knows no layout."""
    return Codec(kind, FRAMES, 'topic', patched=False)


@pytest.mark.parametrize('kind', KINDS)
@QUICK
@given(ns=STAMPS, values=st.lists(ANY, min_size=13, max_size=13))
def test_a_patched_template_is_the_message(kind: type, ns: int, values: list) -> None:
    values = numbers(kind, values)
    encoded = codec_of(kind).encode(ns, values)
    assert isinstance(encoded, bytes), 'the layout is known'
    assert deserialize_message(encoded, kind) == as_message(kind, ns, values)
    STORE.deserialize_cdr(encoded, type_name(kind))  # which allows no unused bytes behind it
    assert len(encoded) <= len(as_bytes(kind, ns, values))
    assert first_stamp(encoded, 'topic') == ns


@pytest.mark.parametrize('kind', READ)
@QUICK
@given(ns=STAMPS, values=st.lists(ANY, min_size=13, max_size=13))
def test_numbers_are_read_as_the_message_says(kind: type, ns: int, values: list) -> None:
    values = numbers(kind, values)
    data = as_bytes(kind, ns, values)
    codec = codec_of(kind)
    assert codec.layout.unpack(data) is not None, 'the short way is taken'
    assert codec.decode(data) == long_way(kind).decode(data) == (ns, values)


@pytest.mark.parametrize('kind', READ)
def test_without_a_layout_messages_are_sent_and_read_all_the_same(kind: type) -> None:
    values = numbers(kind, [0.1 * i for i in range(13)])
    sent = long_way(kind).encode(5, values)
    assert sent == deserialize_message(Codec(kind, FRAMES, 'topic').encode(5, values), kind)
    assert Codec(kind, FRAMES, 'topic').decode(bytes(serialize_message(sent))) == (5, values)


@pytest.mark.parametrize('kind', READ)
@pytest.mark.parametrize('bad', [float('nan'), float('inf'), float('-inf'), 1e31])
def test_a_number_that_is_not_finite_is_refused_alike(kind: type, bad: float) -> None:
    for place in range(KINDS[kind].size):
        values = list(numbers(kind, [1.0] * 13))
        values[place] = bad
        data = as_bytes(kind, 3, tuple(values))
        texts = []
        for codec in (codec_of(kind), long_way(kind)):
            with pytest.raises(
                BadMessageError, match=r'topic: (not finite: expected finite numbers|absurd)'
            ) as refusal:
                codec.decode(data)
            texts.append(str(refusal.value))
        assert texts[0] == texts[1], place


FOREIGN = {
    'longer': Frames('odom_ned_2', 'base_link_fsd_2'),
    'as long': Frames('odom_enu', 'base_link_flu'),
    'none': Frames('', ''),
    'the other way round': Frames(FRAMES.base, FRAMES.odom),
}


@pytest.mark.parametrize('kind', READ)
@pytest.mark.parametrize('which', FOREIGN)
def test_another_frame_is_refused_alike(kind: type, which: str) -> None:
    data = as_bytes(kind, 3, numbers(kind, [1.0] * 13), FOREIGN[which])
    for codec in (codec_of(kind), long_way(kind)):
        with pytest.raises(BadMessageError, match=r'topic: header\.frame_id: expected'):
            codec.decode(data)


@pytest.mark.parametrize('kind', READ)
@pytest.mark.parametrize(('sec', 'nanosec'), [(-1, 10**9 - 1), (0, 10**9)])
def test_a_stamp_that_is_none_is_refused_alike(kind: type, sec: int, nanosec: int) -> None:
    message = as_message(kind, 3, numbers(kind, [1.0] * 13))
    message.header.stamp = Time(sec=sec, nanosec=nanosec)
    data = bytes(serialize_message(message))
    for codec in (codec_of(kind), long_way(kind)):
        with pytest.raises(BadMessageError, match='topic: no stamp: expected 0 s or later'):
            codec.decode(data)


def test_another_child_frame_of_equal_length_is_refused() -> None:
    data = as_bytes(Odometry, 3, numbers(Odometry, [1.0] * 13), Frames(base='base_link_flu'))
    with pytest.raises(BadMessageError, match=r"child_frame_id: expected 'base_link_fsd'"):
        Codec(Odometry, FRAMES, 'odom').decode(data)


def test_no_unit_quaternion_is_refused_alike() -> None:
    data = as_bytes(Odometry, 3, (1.0,) * 13)
    for codec in (codec_of(Odometry), long_way(Odometry)):
        with pytest.raises(BadMessageError, match='expected a unit quaternion, found norm 2'):
            codec.decode(data)


@pytest.mark.parametrize(
    ('names', 'effort'),
    [
        (['sway', 'surge', 'heave', 'roll', 'pitch', 'yaw'], [1.0] * 6),
        (['surge', 'sway', 'pitch', 'roll', 'heave', 'yaw'], [1.0] * 6),  # of equal length
        (['surge', 'sway', 'heave', 'roll', 'pitch'], [1.0] * 5),
        (list(DOFS), [1.0] * 5),
        ([], []),
    ],
)
def test_joints_that_are_no_degrees_of_freedom_are_refused_alike(names, effort) -> None:
    message = as_message(JointState, 3, (1.0,) * 6)
    message.name, message.effort = names, effort
    data = bytes(serialize_message(message))
    for codec in (codec_of(JointState), long_way(JointState)):
        with pytest.raises(BadMessageError, match=r"topic: name: expected \['surge'"):
            codec.decode(data)


def test_the_other_byte_order_goes_the_long_way() -> None:
    """A big-endian peer: same lengths, every field swapped."""
    values = numbers(WrenchStamped, [0.5 * i for i in range(13)])
    little = as_bytes(WrenchStamped, 7 * 10**9 + 9, values)
    text = FRAMES.base.encode() + b'\0'
    big = bytearray(b'\x00\x00\x00\x00' + struct.pack('>iI', 7, 9))
    big += struct.pack('>I', len(text)) + text
    big += bytes(-(len(big) - 4) % 8) + struct.pack('>6d', *values)
    assert len(big) == len(little)
    codec = Codec(WrenchStamped, FRAMES, 'wrench')
    assert codec.layout.unpack(bytes(big)) is None
    assert codec.decode(bytes(big)) == (7 * 10**9 + 9, values)
    assert first_stamp(bytes(big), 'topic') == 7 * 10**9 + 9


@pytest.mark.parametrize('frames', [Frames('a', 'a'), Frames('a', ''), Frames('é', 'Länge_2')])
@pytest.mark.parametrize('kind', KINDS)
def test_any_frame_ids_are_sent_and_told_apart(kind: type, frames: Frames) -> None:
    values = numbers(kind, [1.0 + i for i in range(13)])
    encoded = Codec(kind, frames, 'topic').encode(1, values)
    if not isinstance(encoded, bytes):
        encoded = bytes(serialize_message(encoded))
    assert deserialize_message(encoded, kind) == as_message(kind, 1, values, frames)


def test_a_message_whose_fields_are_not_found_has_no_layout(monkeypatch) -> None:
    """Numbers that change on their way, or stand in two places, cannot be patched."""
    kind = KINDS[TwistStamped]

    def doubled(ns, values, frames):
        return kind.make(ns, [2 * value for value in values], frames)

    def repeated(ns, values, frames):
        return kind.make(ns, [values[0]] * 6, frames)

    for make, found in ((doubled, 'found 0'), (repeated, 'found 6')):
        with pytest.raises(LookupError, match=f'expected one place, {found}'):
            Layout(kind._replace(make=make), FRAMES)
    monkeypatch.setitem(KINDS, TwistStamped, kind._replace(make=doubled))
    assert verified_layout(TwistStamped, FRAMES) is None
    assert isinstance(Codec(TwistStamped, FRAMES, 'twist').encode(0, (1.0,) * 6), TwistStamped)


def test_a_layout_that_gives_other_messages_is_not_used(monkeypatch) -> None:
    kind = KINDS[TwistStamped]

    def swapped(ns, values, frames):
        # found, but the second time in other places
        order = reversed(values) if values[0] == pytest.approx(-7e300) else values
        return kind.make(ns, list(order), frames)

    monkeypatch.setitem(KINDS, TwistStamped, kind._replace(make=swapped))
    assert verified_layout(TwistStamped, FRAMES) is None


@pytest.mark.parametrize('part', ['odom', 'base'])
def test_a_layout_that_does_not_see_another_frame_is_not_used(monkeypatch, part: str) -> None:
    kind = KINDS[Odometry]

    def shouted(ns, values, frames):
        return kind.make(ns, values, replace(frames, **{part: getattr(frames, part).upper()}))

    monkeypatch.setitem(KINDS, Odometry, kind._replace(make=shouted))
    assert verified_layout(Odometry, FRAMES) is None


def test_every_kind_is_read_by_the_reader_of_its_topic() -> None:
    for kind in READ:
        data = as_bytes(kind, 11, numbers(kind, [1.0] * 13))
        message = deserialize_message(data, kind)
        assert KINDS[kind].read(message, FRAMES, 'topic') == Codec(kind, FRAMES, 'topic').decode(
            data
        )


def test_first_stamp_of_messages_that_begin_with_one() -> None:
    stamp = as_message(Clock, 5 * 10**9 + 3, ()).clock
    header = bytes(serialize_message(Header(stamp=stamp, frame_id='x')))
    assert first_stamp(header, 'topic') == 5 * 10**9 + 3
    assert interface.nanoseconds(stamp) == 5 * 10**9 + 3
    with pytest.raises(BadMessageError, match=r'^topic: .*found 11 bytes'):
        first_stamp(bytes(11), 'topic')
