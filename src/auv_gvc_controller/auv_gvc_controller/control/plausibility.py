"""Magnitudes that are believed: what lies beyond is a broken message, not a motion."""

import math
from dataclasses import dataclass

ZERO = (0.0,) * 6


@dataclass(frozen=True)
class Limits:
    """Largest magnitudes of a body-frame 6-vector's linear and angular part.

    Attributes
    ----------
    speed, rate : m/s and rad/s
    acceleration : m/s2 and rad/s2

    """

    speed: float = math.inf
    rate: float = math.inf
    acceleration: float = math.inf

    def check_velocity(self, nu: tuple[float, ...]) -> None:
        """Raise ValueError for a velocity (6,) that no vehicle has."""
        self._check('twist', nu, (self.speed, self.rate), ('m/s', 'rad/s'))

    def check_acceleration(self, nu_dot: tuple[float, ...]) -> None:
        """Raise ValueError for an acceleration (6,) that no vehicle has."""
        self._check('accel', nu_dot, (self.acceleration,) * 2, ('m/s2', 'rad/s2'))

    @staticmethod
    def _check(
        key: str, values: tuple[float, ...], most: tuple[float, ...], units: tuple[str, ...]
    ) -> None:
        for part, first, limit, unit in zip(
            ('linear', 'angular'), (0, 3), most, units, strict=True
        ):
            size = math.hypot(*values[first : first + 3])
            if not size <= limit:  # NaN is not believed either
                text = f'expected at most {limit:g} {unit}, found {size:g}'
                raise ValueError(f'{key}.{part}: {text}')
