"""How old a message is by its own stamp, as far as its clock can be compared with ours."""

from typing import NamedTuple

AUTO, ROS, OWN = 'auto', 'ros', 'own'
CLOCKS = (AUTO, ROS, OWN)
SAME_EPOCH = 86_400 * 10**9  # ns: clocks that are further apart count from different beginnings
DRIFT = 1e-3  # s/s that two free-running clocks may drift apart


class Now(NamedTuple):
    """The present moment on two clocks.

    Attributes
    ----------
    steady : s, never goes back
    ros_ns : ns of the node's clock, 0 where it has not begun

    """

    steady: float
    ros_ns: int = 0


class StampAge:
    """Refuses stamps that are too old, or ahead of the clock.

    Parameters
    ----------
    clock : that wrote the stamps. 'ros': the node's own, so that the age is their difference;
        'own': a free-running one, so that the age counts from the freshest stamp seen; 'auto': as
        'ros' where both count from the same beginning, else as 'own'
    most_ns : largest age, ns

    """

    def __init__(self, clock: str, most_ns: int):
        self._clock, self._most = clock, most_ns
        self.reset()

    def reset(self) -> None:
        """Forget the freshest stamp, as when their clock has jumped."""
        self._freshest: tuple[float, float] | None = None  # steady s minus stamp s, and when

    def of(self, ns: int, now: Now) -> float:
        """Age in s of a stamp, negative ahead of the clock."""
        if self._runs_free(ns, now):
            return self._relative(ns, now.steady)
        return (now.ros_ns - ns) / 1e9

    def _runs_free(self, ns: int, now: Now) -> bool:
        """Whether the stamp's clock cannot be compared with the node's."""
        apart = now.ros_ns == 0 or abs(now.ros_ns - ns) > SAME_EPOCH
        return self._clock == OWN or (self._clock == AUTO and apart)

    def check(self, ns: int, now: Now) -> None:
        """Raise ValueError for a stamp that is too old or ahead of the clock."""
        age, most = self.of(ns, now), self._most / 1e9
        if age > most:
            raise ValueError(f'stamp old: expected at most {most:g} s, found {age:.3g} s')
        if -age > most:
            text = f'expected at most {most:g} s ahead of the clock, found {-age:.3g} s'
            raise ValueError(f'stamp ahead of the clock: {text}')

    def accept(self, ns: int, now: Now) -> None:
        """Remember a stamp that is used."""
        if self._runs_free(ns, now):
            self._freshest = (now.steady - ns / 1e9 - self._relative(ns, now.steady), now.steady)

    def _relative(self, ns: int, steady: float) -> float:
        if self._freshest is None:
            return 0.0
        offset, at = self._freshest
        return max(0.0, steady - ns / 1e9 - offset - DRIFT * (steady - at))
