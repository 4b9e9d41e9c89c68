"""When to arm, to command and to let go: decides, sends nothing."""

from dataclasses import dataclass
from typing import NamedTuple

from wrench_mapping import NEUTRAL, PilotAxes

MANUAL = 19  # ArduSub's mode in which the pilot's axes go to the motors
AGAIN = 1_000_000_000  # ns between two requests of a kind
KEEP_ALIVE = 100_000_000  # ns between two neutral inputs
ON_ITS_WAY = 300_000_000  # ns in which a heartbeat may be older than an acknowledgement


@dataclass(frozen=True)
class Timeouts:
    """Silence of the wrench, ns: neutral after `neutral`, disarmed after `disarm`."""

    neutral: int = 500_000_000
    disarm: int = 3_000_000_000


class Deed(NamedTuple):
    """What to send now: arm or disarm (None: neither), the mode, the axes (None: none)."""

    arm: bool | None = None
    mode: bool = False
    axes: PilotAxes | None = None


class Pilot:
    """The driver's hand on the vehicle.

    It takes the vehicle when asked to, arms it while wrenches come, and lets go when they cease.
    It never takes back what somebody else has taken: after a disarming, a change of mode or a
    restart that it did not ask for, it wants to be asked again.

    Parameters
    ----------
    timeouts : of the wrench

    """

    def __init__(self, timeouts: Timeouts):
        self._timeouts = timeouts
        self.wanted = self.armed = False
        self.mode: int | None = None
        self.why = 'not asked to arm'
        self._axes = NEUTRAL
        self._heard: int | None = None  # ns of the last command
        self._disarming = self._had_mode = self._lost = False
        self._asked: dict[str, int] = {}
        self._sent = self._since = 0
        self._acknowledged = -ON_ITS_WAY

    def want(self, on: bool, now: int) -> None:
        """Take the vehicle, or let it go: neutral, then disarmed."""
        self._disarming = not on and self.armed
        self.wanted, self.why = on, '' if on else 'asked to disarm'
        self._had_mode, self._axes = False, NEUTRAL
        self._since, self._heard = now, None

    def acknowledged(self, now: int) -> None:
        """Take that arming or disarming, whichever was asked for last, has been accepted."""
        armed = self._asked.get('arm', -1) > self._asked.get('disarm', -1)
        self._acknowledged = now
        if self.mode is not None and armed != self.armed and (armed or self._disarming):
            self.armed, self._disarming = armed, self._disarming and armed

    def vehicle(self, armed: bool, mode: int, now: int) -> str:
        """Take what a heartbeat says; a text when somebody else has taken the vehicle."""
        if now - self._acknowledged < ON_ITS_WAY:
            armed = self.armed
        fell, self.armed, self.mode = self.armed and not armed, armed, mode
        lost, self._lost = self._lost, False
        own = self._disarming and not lost
        self._disarming = self._disarming and armed
        if self.wanted and fell and not own:
            return self.let_go('disarmed by the vehicle or by somebody else')
        if self.wanted and self._had_mode and mode != MANUAL:
            return self.let_go(f'mode {mode} set by somebody else')
        self._had_mode = self._had_mode or (self.wanted and mode == MANUAL)
        return ''

    def let_go(self, why: str) -> str:
        """Send nothing more until asked again."""
        self.wanted = self._disarming = self._had_mode = False
        self._axes, self.why = NEUTRAL, why
        return f'{why}: not commanded until ~/arm is called'

    def command(self, axes: PilotAxes, now: int) -> None:
        """Take the axes of a wrench."""
        self._axes, self._heard = axes, now

    def silence(self) -> None:
        """Forget the command: the vehicle is not heard."""
        self._axes, self._lost = NEUTRAL, True

    @property
    def commands(self) -> bool:
        """Whether wrenches reach the motors."""
        return self.wanted and self.armed and self.mode == MANUAL and not self._disarming

    def due(self, now: int, *, fresh: bool = False) -> Deed:
        """What to send at a time in ns; `fresh` at once, because a command has just come."""
        if not (self.wanted or self._disarming):
            return Deed()
        heard = self._heard is not None and now - self._heard <= self._timeouts.neutral
        silence = now - (self._since if self._heard is None else self._heard)
        if self.armed and self.wanted and silence > self._timeouts.disarm:
            self._disarming = True
        elif heard and self.wanted:
            self._disarming = False
        arm = None
        if self._disarming and self.armed:
            arm = False if self._may_ask('disarm', now) else None
        elif heard and not self.armed and self.mode == MANUAL and self._may_ask('arm', now):
            arm = True
        mode = self.wanted and self.mode != MANUAL and self._may_ask('mode', now)
        axes, flows = None, self.commands and heard
        if (fresh and flows) or now - self._sent >= KEEP_ALIVE:
            self._sent = now
            axes = self._axes if flows else NEUTRAL
        return Deed(arm, mode, axes)

    def _may_ask(self, what: str, now: int) -> bool:
        if now - self._asked.get(what, -AGAIN) < AGAIN:
            return False
        self._asked[what] = now
        return True
