"""Lines in few bytes: what `unpacked` of panel_data.js reads in the browser."""

import base64
import zlib

import numpy as np

TICKS = 2.0**31  # of a time axis whose samples are not a step apart
EXACT = 1e-6  # steps by which a sample may be off its place


class Packer:
    """Takes time axes and values; every array is a run of bytes in one block.

    A time axis is the number of ticks from each sample to the next, uint32. A value is a float32
    without its last byte: 16 significant bits, so that four digits stay. The first bytes of all
    numbers of an array come first, then the second ones: so they compress well.

    """

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0
        self._axes: dict[bytes, int] = {}
        self.axes: list[dict[str, float]] = []

    def add_axis(self, t: np.ndarray, step: float) -> int:
        """Add the times (n,) of a line, rising, s; its number, that of an equal one if there is.

        Parameters
        ----------
        t : (n,) s
        step : s; the times are kept exactly where they are multiples of it apart

        """
        known = np.ascontiguousarray(t, float).tobytes()
        if known not in self._axes:
            tick = step
            if not np.allclose((t - t[0]) / step, np.round((t - t[0]) / step), 0.0, EXACT):
                tick = float(t[-1] - t[0]) / TICKS
            ticks = np.round((t - t[0]) / tick).astype(np.int64)
            at = self._add(np.diff(ticks, prepend=0).astype('<u4').view(np.uint8).reshape(-1, 4))
            self._axes[known] = len(self.axes)
            self.axes.append({'at': at, 'count': len(t), 'start': float(t[0]), 'tick': tick})
        return self._axes[known]

    def add_values(self, y: np.ndarray) -> int:
        """Add the values (n,) of a line; where their bytes begin."""
        rounded = np.ascontiguousarray(y, '<f4').view('<u4') + np.uint32(0x80)
        return self._add(rounded.view(np.uint8).reshape(-1, 4)[:, 1:])

    def _add(self, numbers: np.ndarray) -> int:
        at = self._size
        self._parts.append(np.ascontiguousarray(numbers.T).tobytes())
        self._size += numbers.size
        return at

    def packed(self) -> str:
        """All arrays, deflated, in Base64."""
        return packed(b''.join(self._parts))


def packed(content: bytes) -> str:
    """Content, deflated, in Base64."""
    return base64.b64encode(zlib.compress(content, 9)).decode('ascii')
