"""Every point that a search looked at, with what came of it."""

from dataclasses import dataclass, field

import numpy as np

from auv_analysis.tuning.measures import Measures

STAGES = ('global', 'refine', 'gradient')  # a Sobol point or a start, a step, a difference


@dataclass
class Tried:
    """Points in the order in which they were evaluated.

    Attributes
    ----------
    batches : x (B, n), measures (B,), room (B,) and stages (B,) of each batch

    """

    batches: list[tuple[np.ndarray, Measures, np.ndarray, np.ndarray]] = field(default_factory=list)

    def add(self, x: np.ndarray, measures: Measures, room: np.ndarray, stages: np.ndarray) -> None:
        """Add a batch of points (B, n)."""
        self.batches.append((x, measures, room, stages))

    def since(self, batch: int = 0) -> tuple[np.ndarray, Measures, np.ndarray, np.ndarray]:
        """The same of all batches from an index on, as one."""
        x, measures, room, stages = zip(*self.batches[batch:], strict=True)
        together = Measures(*map(np.concatenate, zip(*measures, strict=True)))
        return np.concatenate(x), together, np.concatenate(room), np.concatenate(stages)

    def __len__(self) -> int:
        return sum(len(x) for x, *_ in self.batches)
