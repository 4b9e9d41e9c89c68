"""When to arm, to command and to let go: decides, sends nothing."""

from typing import NamedTuple

from wrench_mapping import NEUTRAL, PilotAxes

MANUAL = 19  # ArduSub's mode in which the pilot's axes go to the motors
AGAIN = 1_000_000_000  # ns between two requests of a kind
DISARM_AGAIN = 200_000_000
KEEP_ALIVE = 100_000_000  # ns between two neutral inputs while the vehicle is in hand
LETTING_GO = 50_000_000  # ns between two neutral inputs of letting go
LEAST, MOST = 5, 20  # of these: always; until the motors are seen at rest
ON_ITS_WAY = 300_000_000  # ns in which a heartbeat may be older than an acknowledgement
ARMING = 2_000_000_000  # ns after a request to arm in which a vehicle that is armed obeys that one


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

    ArduSub keeps the last input that it was given, in every mode, and heartbeats are all that its
    failsafe wants. So letting go is an act: neutral inputs, `LEAST` of them where somebody else has
    taken the vehicle and must not be hindered, otherwise until the motors are at rest or `MOST`.

    Parameters
    ----------
    neutral, disarm : ns without a wrench after which it is neutral, disarmed

    """

    def __init__(self, neutral: int, disarm: int):
        self._neutral, self._disarm = neutral, disarm
        self.wanted = self.armed = False
        self.mode: int | None = None
        self.why = 'not asked to arm'
        self._axes = NEUTRAL
        self._heard: int | None = None  # ns of the last command
        self._disarming = self._had_mode = self._lost = False
        self._ended = False  # by who had asked for it: what was armed for it still is disarmed
        self._holds = False  # whether an input of this hand stands in the vehicle
        self._given = self._limit = 0  # neutral inputs of letting go
        self._asked: dict[str, int] = {}
        self._sent = self._since = 0
        self._acknowledged = -ON_ITS_WAY

    def want(self, on: bool, now: int, why: str = 'asked to disarm') -> None:
        """Take the vehicle, or let it go: neutral and disarmed."""
        arming = now - self._asked.get('arm', -AGAIN) < AGAIN
        self._disarming = not on and (self.armed or (self.wanted and arming))
        self._end(MOST)
        self.wanted, self.why, self._ended = on, '' if on else why, not on
        self._since, self._heard = now, None

    def acknowledged(self, now: int) -> None:
        """Take that arming or disarming, whichever was asked for last, has been accepted."""
        if self._lost:  # a vehicle that has disarmed itself meanwhile accepts, too
            return
        armed = self._asked.get('arm', -1) > self._asked.get('disarm', -1)
        self._acknowledged = now
        if armed != self.armed and (armed or self._disarming):
            self.armed, self._disarming = armed, armed and (self._disarming or self._ended)

    def vehicle(self, armed: bool, mode: int, now: int) -> str:
        """Take what a heartbeat says; a text when somebody else has taken the vehicle."""
        if now - self._acknowledged < ON_ITS_WAY:
            armed = self.armed
        fell, rose = self.armed and not armed, armed and not self.armed
        self.armed, self.mode = armed, mode
        lost, self._lost = self._lost, False
        own = self._disarming and not lost
        self._disarming = self._disarming and armed
        if self._ended and rose and now - self._asked.get('arm', -ARMING) < ARMING:
            self._disarming = True  # the request to disarm, or its answer, was lost
        if self.wanted and fell and not own:
            return self.let_go('disarmed by the vehicle or by somebody else')
        if self.wanted and self._had_mode and mode != MANUAL:
            return self.let_go(f'mode {mode} set by somebody else')
        self._had_mode = mode == MANUAL
        return ''

    def motors(self, at_rest: bool) -> None:
        """Take whether the outputs of all motors are neutral."""
        if at_rest and self._given >= LEAST:
            self._limit = 0

    def let_go(self, why: str) -> str:
        """Leave the vehicle to somebody else; nothing more is sent until asked again."""
        self._end(LEAST)
        self.wanted = self._disarming = self._ended = False
        self.why = why
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

    @property
    def letting_go(self) -> bool:
        """Whether something is still to be sent before the vehicle is left alone."""
        return not self.wanted and (self._disarming or self._given < self._limit)

    def is_fed(self, now: int) -> bool:
        """Whether wrenches come."""
        return self._heard is not None and now - self._heard <= self._neutral

    def due(self, now: int, ready: bool, *, fresh: bool = False) -> Deed:
        """What to send at a time in ns.

        Parameters
        ----------
        now : ns
        ready : whether the vehicle may be taken
        fresh : a command has just come, which is sent at once

        """
        if not self.wanted:
            return self._farewell(now)
        fed = self.is_fed(now)
        silence = now - (self._since if self._heard is None else self._heard)
        if self.armed and silence > self._disarm:
            self._disarming = True
        elif fed:
            self._disarming = False
        manual, arm = self.mode == MANUAL, None
        if self._disarming and self.armed:
            arm = False if self._may_ask('disarm', now, DISARM_AGAIN) else None
        elif fed and ready and not self.armed and manual and self._may_ask('arm', now):
            arm = True
        mode = ready and not manual and self._may_ask('mode', now)
        axes, flows = None, self.commands and fed
        is_time = (fresh and flows) or now - self._sent >= KEEP_ALIVE
        if is_time and manual and (ready or self._holds):
            self._sent, self._holds = now, True
            axes = self._axes if flows else NEUTRAL
        return Deed(arm, mode, axes)

    def _farewell(self, now: int) -> Deed:
        arm = axes = None
        if self._disarming and self._may_ask('disarm', now, DISARM_AGAIN):
            arm = False
        if self.letting_go and now - self._sent >= LETTING_GO:
            self._sent, self._given, axes = now, self._given + 1, NEUTRAL
        return Deed(arm, axes=axes)

    def _end(self, limit: int) -> None:
        """Begin anew; what this hand has left in the vehicle is made neutral."""
        self._given, self._limit = 0, limit if self._holds else 0
        self._had_mode = self._holds = False

    def _may_ask(self, what: str, now: int, again: int = AGAIN) -> bool:
        if now - self._asked.get(what, -again) < again:
            return False
        self._asked[what] = now
        return True
