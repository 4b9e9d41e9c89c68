"""What `make bench-growth` measures: cost as a function of one size."""

import os
import statistics
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path

from bench_nodes import OWN, recorded_topics
from loops import case1, varied
from made_bags import make_bag
from measure import seconds
from table import quantity

from auv_analysis import load_run
from auv_analysis.simulation.rollouts import rollouts

BRIEF = 1.0  # s below which a measurement is repeated and its median taken
REPEATS = 5
CORES = len(os.sched_getaffinity(0))

Cost = Callable[[float], float]  # size -> s


@dataclass(frozen=True)
class Curve:
    """Cost against one size.

    Attributes
    ----------
    what, title : in words, and short
    unit : of the size
    sizes : increasing
    per : what a column beside the time is divided by, and `share` how much of it a size has
    expected : of the slope
    measurement : context that gives the cost in s of a size

    """

    name: str
    what: str
    title: str
    unit: str
    sizes: tuple[float, ...]
    per: str
    share: Callable[[float], float]
    expected: str
    measurement: Callable[[], AbstractContextManager[Cost]]

    def each(self, size: float, cost: float) -> str:
        """Cost per unit of the size, as the table shows it."""
        return quantity(cost / self.share(size), 's')


def typical(work: Callable[[], object]) -> float:
    """Wall time of a call in s: the median of some, where one is brief."""
    work()
    first = seconds(work)
    if first > BRIEF:
        return first
    return statistics.median([first, *(seconds(work) for _ in range(REPEATS - 1))])


@contextmanager
def _batch() -> Iterator[Cost]:
    scenario = case1(10.0)
    yield lambda size: typical(lambda: rollouts(scenario, 'gvc', varied(round(size))))


@contextmanager
def _horizon() -> Iterator[Cost]:
    changes = varied(8)
    yield lambda size: typical(lambda: rollouts(case1(size), 'gvc', changes))


@contextmanager
def _threads() -> Iterator[Cost]:
    scenario, changes = case1(10.0), varied(4096)
    yield lambda size: typical(lambda: rollouts(scenario, 'gvc', changes, threads=round(size)))


@contextmanager
def _bag() -> Iterator[Cost]:
    with tempfile.TemporaryDirectory() as folder:

        def cost(duration: float) -> float:
            bag = make_bag(Path(folder) / f'{duration:g}', round(duration * 100))
            return typical(lambda: load_run(bag))

        yield cost


CURVES = (
    Curve(
        'batch', 'Rollouts of Case 1 over 10 s in one batch, one thread, parameters included',
        'batch size', 'rollouts', (1, 10, 100, 1_000, 10_000, 100_000),
        'per rollout', lambda size: size, '1 is in proportion', _batch,
    ),
    Curve(
        'horizon', 'Eight rollouts of Case 1 over a horizon, one thread',
        'horizon', 's simulated', (10, 100, 1_000, 3_600, 36_000),
        'per simulated second', lambda size: size, '1 is in proportion', _horizon,
    ),
    Curve(
        'threads', '4 096 rollouts of Case 1 over 10 s',
        'threads', 'threads', tuple(range(1, CORES + 1)),
        'times threads', lambda size: 1 / size, '-1 is in inverse proportion', _threads,
    ),
    Curve(
        'topics', 'A step of the node graph; each topic beside its own has a message per step',
        'recorded topics', 'topics', tuple(OWN + more for more in (0, 4, 16, 32)),
        'per topic', lambda size: size, '1 is in proportion', recorded_topics,
    ),
    Curve(
        'bag', 'A bag of Case 1 at 100 Hz to arrays, eight topics',
        'bag length', 's recorded', (10, 100, 1_000, 10_000),
        'per recorded second', lambda size: size, '1 is in proportion', _bag,
    ),
)  # fmt: skip
