"""Time of a bag against the steady clock: rate, pause, step."""

import math

from auv_dynamics.ros.interface import NANOSECONDS

HELD = math.inf
GAP = 60 * NANOSECONDS  # ns without a message, from which it is a gap


class Playback:
    """Says when a message is due; times are s of the steady clock and ns of the bag.

    Due times are counted from one place in the bag, not from message to message, so that nothing
    drifts.

    Parameters
    ----------
    rate : seconds of the bag per second; 0: as fast as possible
    paused : whether it begins paused
    skips_gaps : whether a message behind a gap is due at once

    Attributes
    ----------
    rate, paused : as they are now

    """

    def __init__(self, rate: float, paused: bool = False, *, skips_gaps: bool = False):
        self.rate, self.paused, self._skips_gaps = rate, paused, skips_gaps
        self._place: tuple[float, int] | None = None  # a time of the clock, and of the bag then
        self._reached = 0
        self._until = -1  # ns up to which is played although it is paused

    def restart(self) -> None:
        """Forget the place in the bag: the next message is the first one."""
        self._place, self._reached, self._until = None, 0, -1

    def wait(self, now: float, ns: int) -> float:
        """Seconds until a message of this log time is due; 0 or less: it is; HELD: paused."""
        if self._place is None:
            self._place, self._reached = (now, ns), ns
        if self.paused:
            return 0.0 if ns <= self._until else HELD
        if self.rate == 0.0:
            return 0.0
        if self._skips_gaps and ns - self._reached > GAP:
            self._place = now, ns
        clock, place = self._place
        return clock + (ns - place) / (self.rate * NANOSECONDS) - now

    def played(self, ns: int) -> None:
        """Note that a message of this log time was published."""
        self._reached = max(self._reached, ns)

    def pause(self, now: float, ns: int) -> None:
        """Hold; `ns` is the log time of the next message."""
        if not self.paused:
            self._hold(now, ns)
            self.paused = True

    def run(self, now: float) -> None:
        """Go on from where it was held."""
        if self.paused:
            self.paused = False
            self._place = (now, self._reached) if self._place else None

    def step(self, ns: int) -> None:
        """Although paused, play everything up to the log time `ns`."""
        self._until = ns

    def change_rate(self, now: float, ns: int, rate: float) -> None:
        """Go on from here at another rate; `ns` is the log time of the next message."""
        if not self.paused:
            self._hold(now, ns)
        self.rate = rate

    def _hold(self, now: float, ns: int) -> None:
        """Begin to count from the present place: between two messages, never beyond the next."""
        if self._place is None:
            return
        clock, place = self._place
        here = place + round((now - clock) * self.rate * NANOSECONDS)
        self._reached = max(self._reached, min(here, ns) if self.rate else self._reached)
        self._place = now, self._reached
