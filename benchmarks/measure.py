"""Ratios that hold on a machine that is not quiet: subjects and reference in turns."""

import gc
import statistics
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from load import Load, look

LEAST, RUNS = 3, 7  # rounds
ALIKE = 1.05  # largest over smallest ratio of rounds that need no further one
LONG = 40.0  # s of rounds, after which there is no further one
REFERENCE = ''  # its name among the subjects


@dataclass(frozen=True)
class Measured:
    """What one key of `results.json` says.

    Attributes
    ----------
    value, reference : median of the subject and of the reference, in `unit`; no reference: None
    ratio : median of the ratios run by run; None where there is no reference
    spread : smallest and largest of these ratios
    runs : number of them
    load : of others meanwhile

    """

    value: float
    unit: str
    ratio: float | None
    reference: float | None
    runs: int
    spread: tuple[float, float] | None = None
    load: Load | None = None


def interleaved(
    subjects: Mapping[str, Callable[[], float]],
    reference: Callable[[], float],
    unit: str,
    runs: int = RUNS,
    *,
    warm: bool = True,
) -> dict[str, Measured]:
    """Ratio of each subject to one reference, in turns, so that all see the same machine.

    There are at least three rounds; further ones only while the ratios differ, and not for long.

    Parameters
    ----------
    subjects, reference : each call measures once and returns a time or a speed in `unit`;
        all are called once before, unmeasured
    runs : rounds at most; every second one goes backwards
    warm : whether the unmeasured calls are made

    """
    parts = {**subjects, REFERENCE: reference}
    for part in parts.values() if warm else ():
        part()
    rounds: list[dict[str, float]] = []
    began = time.monotonic()
    while len(rounds) < runs and not _enough(rounds, subjects, time.monotonic() - began):
        values = {}
        for name in list(parts)[:: -1 if len(rounds) % 2 else 1]:
            look()
            values[name] = parts[name]()
        rounds.append(values)
    return {name: _measured(rounds, name, unit) for name in subjects}


def _enough(rounds: Sequence[Mapping[str, float]], subjects: Iterable[str], elapsed: float) -> bool:
    if len(rounds) < LEAST:
        return False
    ratios = [[values[name] / values[REFERENCE] for values in rounds] for name in subjects]
    return elapsed > LONG or all(max(each) <= ALIKE * min(each) for each in ratios)


def _measured(rounds: list[dict[str, float]], name: str, unit: str) -> Measured:
    ratios = [values[name] / values[REFERENCE] for values in rounds]
    return Measured(
        value=statistics.median(values[name] for values in rounds),
        unit=unit,
        ratio=statistics.median(ratios),
        reference=statistics.median(values[REFERENCE] for values in rounds),
        runs=len(rounds),
        spread=(min(ratios), max(ratios)),
    )


def seconds(work: Callable[[], Any]) -> float:
    """Wall time of a call, s, without what the garbage collector does for others."""
    gc.collect()
    gc.disable()
    try:
        start = time.perf_counter()
        work()
        return time.perf_counter() - start
    finally:
        gc.enable()


def cost(work: Callable[[], Any], count: float = 1) -> Callable[[], float]:
    """Measurement in s per item, of a call that does `count` of them."""
    return lambda: seconds(work) / count


def speed(work: Callable[[], Any], count: float = 1) -> Callable[[], float]:
    """Measurement in items per s, of a call that does `count` of them."""
    return lambda: count / seconds(work)
