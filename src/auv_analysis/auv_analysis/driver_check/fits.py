"""How well each reading of pose and twist fits the motion, and what can be said from it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from auv_analysis.driver_check.hypotheses import CHILD, Hypothesis
from auv_analysis.driver_check.motion import Compared, Motion, compared

STILL = 0.02  # m/s, rad/s: motion below this says nothing about axes
FITS = 0.3  # of the speed: a reading that is off by more is not the right one
BEATS = 4.0  # times: a reading that fits so much better is right, and the other is not
CLOSE = 0.1  # of the speed: readings that fit so well are not beaten


@dataclass(frozen=True)
class Fits:
    """Readings of one half of the twist.

    Attributes
    ----------
    by_path, by_twist : speed by the pose and by the twist, root mean square, noise taken off
    noise : of the difference of both
    off : reading -> root mean square of path rate less velocity, of the larger speed
    constant : (3,) velocity that remains between them if the right reading is taken
    rest : what is off then, of the larger speed
    factor : by which the twist had to be multiplied, and
    scaled : what is off then, of the larger speed

    """

    by_path: float
    by_twist: float
    noise: float
    off: Mapping[str, float]
    constant: tuple[float, ...]
    rest: float
    factor: float
    scaled: float

    @property
    def speed(self) -> float:
        """The larger one."""
        return max(self.by_path, self.by_twist)

    @property
    def told(self) -> bool:
        """Whether there is motion enough to tell readings apart."""
        return self.speed > STILL and self.speed > self.noise

    @property
    def best(self) -> str:
        """The reading that fits best."""
        return min(self.off, key=self.off.__getitem__)

    def beaten(self, name: str) -> bool:
        """Whether a reading is out of the question."""
        return self.off[name] > max(BEATS * self.off[self.best], CLOSE)

    @property
    def right(self) -> bool:
        """Whether the right reading fits, and none fits far better."""
        return self.off[CHILD] <= FITS and not self.beaten(CHILD)

    @property
    def others(self) -> list[str]:
        """Readings beside the right one that fit as well, so far."""
        return [
            name
            for name, off in self.off.items()
            if name != CHILD and off <= FITS and not self.beaten(name)
        ]


def fits_of(motion: Motion, hypotheses: Sequence[Hypothesis]) -> Fits:
    """Compare every reading with the motion; the first one is the right one."""
    pairs = {one.name: compared(motion, *one.read(motion)) for one in hypotheses}
    by_path, by_twist, _ = pairs[CHILD].sizes()
    right, speed = pairs[CHILD], max(by_path, by_twist, np.finfo(float).tiny)
    off = {}
    for name, pair in pairs.items():
        path, velocity, apart = pair.sizes()
        off[name] = apart / max(path, velocity, np.finfo(float).tiny)
    constant = (right.path - right.velocity).mean(axis=0)
    factor = _factor(right)
    return Fits(
        by_path,
        by_twist,
        right.noise(),
        off,
        tuple(constant.tolist()),
        right._replace(path=right.path - constant).sizes()[2] / speed,
        factor,
        right._replace(velocity=factor * right.velocity).sizes()[2] / speed,
    )


def _factor(pair: Compared) -> float:
    squares = float((pair.velocity**2).sum())
    return float((pair.path * pair.velocity).sum()) / squares if squares else 1.0
