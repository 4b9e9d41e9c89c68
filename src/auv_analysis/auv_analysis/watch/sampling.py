"""When to listen: always, or now and then where so much is published that listening would cost."""

BUDGET = 2000.0  # messages per second that are listened to without a pause
CALM = 0.8  # part of the budget below which one listens all the time again
LISTEN = 0.15  # s of every period
PERIOD = 1.0  # s


class Sampling:
    """Decides whether to listen.

    Each message costs its publisher and the machine something for every subscriber. A graph in
    lock-step publishes as fast as it can, so that somebody who hears everything slows it down.

    Attributes
    ----------
    sampled : whether there are pauses

    """

    def __init__(self) -> None:
        self.sampled = False
        self._begin = 0.0

    def listens(self, now: float, load: float) -> bool:
        """Whether to listen at a steady time in s, at so many messages published per second."""
        if self.sampled and load < CALM * BUDGET:
            self.sampled = False
        elif not self.sampled and load > BUDGET:
            self.sampled, self._begin = True, now - LISTEN
        if now - self._begin >= PERIOD:
            self._begin = now
        return not self.sampled or now - self._begin < LISTEN
