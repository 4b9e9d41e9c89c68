"""Faults of a scenario: what of the sensors, actuators and links fails, from when to when."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

SENSING = ('sensor_drop_out', 'sensor_delay', 'sensor_bias')
ACTING = ('thruster', 'actuator', 'wrench_loss')
KINDS = (*SENSING, *ACTING)
RANDOM = ('sensor_drop_out', 'wrench_loss')  # of a probability
END = 1 << 62  # step at which what has no end ends


class FaultShape(NamedTuple):
    """What the kernel must know before it starts.

    Attributes
    ----------
    any : whether there is any fault
    delay : longest delay of the sensors, steps

    """

    any: bool
    delay: int


@dataclass(frozen=True)
class Fault:
    """One entry of `faults`.

    Attributes
    ----------
    spec : as the scenario writes it; `thruster` is a name
    first, end : it is there at steps k with first <= k < end
    nth : of its kind, from 0: with the kind it says which random stream is its own

    """

    spec: Mapping[str, Any]
    first: int
    end: int
    nth: int

    @property
    def kind(self) -> str:
        """One of `KINDS`."""
        return self.spec['kind']

    def there(self, k: np.ndarray) -> np.ndarray:
        """(n,) whether it is there at steps k (n,)."""
        return (k >= self.first) & (k < self.end)

    @property
    def stays(self) -> bool:
        """Whether it lasts to the end of the run."""
        return self.end == END


@dataclass(frozen=True)
class Faults:
    """Faults of a scenario.

    Attributes
    ----------
    entries : in the scenario's order
    step : s
    thrusters : names of those that the wrench is allocated to; none where it is not

    """

    entries: tuple[Fault, ...]
    step: float
    thrusters: tuple[str, ...]

    def of(self, *kinds: str) -> list[Fault]:
        """Entries of these kinds."""
        return [fault for fault in self.entries if fault.kind in kinds]

    @property
    def sensing(self) -> bool:
        """Whether any of them stands between the true and the measured state."""
        return bool(self.of(*SENSING))

    @property
    def acting(self) -> bool:
        """Whether any of them stands between the command and the applied wrench."""
        return bool(self.of(*ACTING))

    @property
    def random(self) -> bool:
        """Whether the seed matters to any of them."""
        return any(fault.spec.get('probability', 1.0) < 1.0 for fault in self.of(*RANDOM))

    def delay_of(self, fault: Fault) -> int:
        """Steps that a `sensor_delay` takes."""
        return round(fault.spec['delay'] / self.step)

    @property
    def shape(self) -> FaultShape:
        """What the kernel must know."""
        delays = [self.delay_of(fault) for fault in self.of('sensor_delay')]
        return FaultShape(bool(self.entries), max(delays, default=0))


NONE = Faults((), 1.0, ())
