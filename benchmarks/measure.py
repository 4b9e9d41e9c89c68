"""Ratios that hold on a machine that is not quiet: subjects and reference in turns."""

import gc
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

RUNS = 7
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

    """

    value: float
    unit: str
    ratio: float | None
    reference: float | None
    runs: int
    spread: tuple[float, float] | None = None


def interleaved(
    subjects: Mapping[str, Callable[[], float]],
    reference: Callable[[], float],
    unit: str,
    runs: int = RUNS,
) -> dict[str, Measured]:
    """Ratio of each subject to one reference, in turns, so that all see the same machine.

    Parameters
    ----------
    subjects, reference : each call measures once and returns a time or a speed in `unit`;
        all are called once before, unmeasured
    runs : rounds; every second one goes backwards

    """
    parts = {**subjects, REFERENCE: reference}
    for part in parts.values():
        part()
    rounds: list[dict[str, float]] = []
    for run in range(runs):
        order = list(parts)[:: -1 if run % 2 else 1]
        rounds.append({name: parts[name]() for name in order})
    return {name: _measured(rounds, name, unit) for name in subjects}


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
