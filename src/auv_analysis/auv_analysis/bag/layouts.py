"""Where the numbers of a message lie when its strings have a known length: CDR, little endian."""

import struct
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from auv_analysis.bag.roles import KINDS, ODOMETRY, READERS
from auv_analysis.bag.tables import gather
from auv_dynamics.ros import interface

CDR = 4  # bytes of the encapsulation, from which alignment counts
STAMP = slice(CDR, CDR + 8)  # sec and nanosec
LATEST = 1 << 31  # s: from here on it depends on the schema whether a stamp is negative
NEARLY = 1e-3 - 1e-9  # of the norm of a quaternion: beyond, the reader of single messages decides
UNIT = np.array([1.0, 2.0, 4.0, 10.0]) / 11.0  # a quaternion of four different entries


@dataclass(frozen=True)
class Layout:
    """Places in a serialized message, bytes from its beginning.

    Attributes
    ----------
    size : bytes that a message has at least
    strings : bytes up to here hold encapsulation, stamp and strings
    shared : (strings,) 255 for each of these bytes that every message must share, else 0
    like : these bytes
    runs : place and count of float64 numbers that stand together
    order : permutation of these numbers into a row
    frames : ids in the strings; of a message without child frame, its one frame twice

    """

    size: int
    strings: int
    shared: np.ndarray
    like: np.ndarray
    runs: list[tuple[int, int]]
    order: np.ndarray
    frames: interface.Frames

    @property
    def is_state(self) -> bool:
        """Whether rows are states (13,), with a quaternion at 3 to 6."""
        return len(self.order) > 6

    def fits(self, message: bytes) -> bool:
        """Whether a message has this layout and these strings."""
        start = np.zeros(1, np.int64)
        return len(message) >= self.size and self._alike(gather(message, start, self.strings))

    def is_in(self, frames: interface.Frames | None) -> bool:
        """Whether the frames in the strings are those."""
        if frames is None:
            return False
        own = frames if self.is_state else interface.Frames(frames.base, frames.base)
        return self.frames == own

    def read(
        self, data: bytes, starts: np.ndarray, sizes: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Stamps (n,) in ns and rows (n, 13) or (n, 6) of messages in a buffer.

        None where one of them has another layout, other strings or numbers that must not be used.
        """
        if np.any(sizes < self.size):
            return None
        head = gather(data, starts, self.strings)
        sec, nanosec = head[:, STAMP].copy().view('<u4').astype(np.int64).T
        odd = (sec >= LATEST) | (nanosec >= interface.NANOSECONDS)
        if not self._alike(head) or np.any(odd):
            return None
        parts = [gather(data, starts + at, 8 * count).view('<f8') for at, count in self.runs]
        rows = np.concatenate(parts, axis=1)[:, self.order] if self.is_state else parts[0]
        usable = np.all(np.abs(rows) < interface.LARGEST / 4.0)  # NaN: false
        if self.is_state and usable:
            q = rows[:, 3:7]
            usable = np.all(np.abs(np.sqrt(np.einsum('ij,ij->i', q, q)) - 1.0) < NEARLY)
        return (sec * interface.NANOSECONDS + nanosec, rows) if usable else None

    def _alike(self, heads: np.ndarray) -> bool:
        return not np.any((heads ^ self.like) & self.shared)


def learned(message: bytes, role: str, decoder: Callable[[bytes], Any]) -> Layout | None:
    """Layout of messages with the strings of this one.

    Parameters
    ----------
    message : serialized, of the type that the role asks for
    role : our name of its topic
    decoder : of the channel: it must find what the layout finds

    Returns
    -------
    layout : None where there is none, so that every message has to be decoded

    """
    layout = _layout(KINDS[role], message)
    return layout and _proven(layout, message, role, decoder)


def _layout(kind: str, message: bytes) -> Layout | None:
    """Layout by the definition of the type, not proven yet."""
    if len(message) < CDR or message[1] & 1 == 0:
        return None
    place, shared = STAMP.stop, [0, 1]
    for _ in range(2 if kind == ODOMETRY else 1):
        place = _aligned(place, 4)
        if place + 4 > len(message):
            return None
        end = place + 4 + struct.unpack_from('<I', message, place)[0]
        if end > len(message):
            return None
        shared += range(place, end)
        place = end
    strings, place = place, _aligned(place, 8)
    if kind == ODOMETRY:  # position, quaternion x y z w, 36 covariances; twist, 36 covariances
        runs = [(place, 7), (place + 8 * (7 + 36), 6)]
        order, size = [0, 1, 2, 6, 3, 4, 5, *range(7, 13)], place + 8 * (7 + 36 + 6 + 36)
    else:
        runs, order, size = [(place, 6)], list(range(6)), place + 8 * 6
    if size > len(message):
        return None
    like = np.frombuffer(message, np.uint8, strings)
    mask = np.zeros(strings, np.uint8)
    mask[shared] = 255
    return Layout(size, strings, mask, like, runs, np.array(order), interface.Frames())


def _proven(
    layout: Layout, message: bytes, role: str, decoder: Callable[[bytes], Any]
) -> Layout | None:
    """The layout with its frames, when the decoder finds the same in a different number each."""
    values = np.arange(1.0, len(layout.order) + 1.0)
    if layout.is_state:
        values[3:7] = UNIT
    sample = bytearray(message[: layout.size])
    struct.pack_into('<II', sample, STAMP.start, 0x1234567, 0x2345678)
    there = iter(values[np.argsort(layout.order)])
    for at, count in layout.runs:
        for i in range(count):
            struct.pack_into('<d', sample, at + 8 * i, next(there))
    try:
        decoded = decoder(bytes(sample))
        frame = decoded.header.frame_id
        frames = interface.Frames(frame, decoded.child_frame_id if layout.is_state else frame)
        ns, row = READERS[role](decoded, frames)
    except Exception:  # whatever a foreign schema leads to: then every message is decoded
        return None
    found = layout.read(bytes(sample), np.zeros(1, np.int64), np.array([layout.size]))
    same = found is not None and found[0][0] == ns and np.array_equal(found[1][0], row)
    return replace(layout, frames=frames) if same else None


def _aligned(place: int, size: int) -> int:
    return place + (CDR - place) % size
