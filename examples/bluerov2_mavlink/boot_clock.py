"""From the time since the vehicle's boot to the steady clock of this machine, by TIMESYNC."""

from collections import deque
from typing import NamedTuple

ENOUGH = 5  # exchanges before times are believed
KEPT = 32  # exchanges; at 1 Hz the two crystals part by less than a millisecond
JUMP = 50_000_000  # ns by which an offset must differ to be another boot


class Exchange(NamedTuple):
    """Request sent, answered at the vehicle, answer received; ns of the three moments' clocks."""

    sent: int
    remote: int
    received: int

    @property
    def round_trip(self) -> int:
        """Time on the way, ns."""
        return self.received - self.sent

    @property
    def offset(self) -> int:
        """Local time less boot time, ns; wrong by at most half the round trip."""
        return (self.sent + self.received) // 2 - self.remote


class BootClock:
    """Offset of the vehicle's boot clock, from the quickest of the last exchanges."""

    def __init__(self) -> None:
        self._exchanges: deque[Exchange] = deque(maxlen=KEPT)

    def reset(self) -> None:
        """Forget everything, as after a restart of the vehicle."""
        self._exchanges.clear()

    def add(self, exchange: Exchange) -> bool:
        """Keep an exchange; False when it shows that the vehicle has been started anew."""
        best = self._best()
        apart = best is not None and abs(exchange.offset - best.offset)
        if best is not None and apart > JUMP + (exchange.round_trip + best.round_trip) // 2:
            self.reset()
            self._exchanges.append(exchange)
            return False
        self._exchanges.append(exchange)
        return True

    def local(self, boot_ns: int) -> int | None:
        """Steady local time in ns of a boot time, None until enough is known."""
        best = self._best()
        if best is None or len(self._exchanges) < ENOUGH:
            return None
        return boot_ns + best.offset

    @property
    def uncertainty(self) -> float | None:
        """Half the quickest round trip, s; None before the first exchange."""
        best = self._best()
        return None if best is None else best.round_trip / 2e9

    def _best(self) -> Exchange | None:
        return min(self._exchanges, key=lambda one: one.round_trip, default=None)
