"""Controllers held against each other in the same rollouts."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from auv_analysis.exploration.opening import Sweep
from auv_analysis.exploration.quantiles import ordered
from auv_analysis.measures import Measure
from auv_analysis.studies.pairs import log_ratios, paired

Row = dict[str, Any]


def pairs(sweep: Sweep, values: np.ndarray, measure: Measure) -> Iterator[Row]:
    """For each two controllers, the ratio of their figures in the same rollouts, as `Pairs`.

    Only rollouts that both finished count; a time that does not exist is later than any other.

    Parameters
    ----------
    sweep : whose rows they are
    values : (n,) of the measure in all rows
    measure : what is compared

    """
    at = ordered(values, measure.unit)
    usable = (sweep.status == 0) & ~np.isnan(at)
    for first, second, mine, other in sweep.pairs:
        both = usable[mine] & usable[other]
        d = log_ratios(at[mine[both]], at[other[both]])
        if len(d) == 0:
            continue
        found = paired(d)
        low, high = found.interval or (None, None)
        yield {
            'figure': measure.name,
            'label': measure.label,
            'controller': sweep.controllers[first],
            'other': sweep.controllers[second],
            'rollouts': len(d),
            'smaller_percent': 100 * found.smaller,
            'equal_percent': float(100 * np.mean(d == 0)),
            'larger_percent': 100 * found.larger,
            'effect': found.effect,
            'ratio': found.ratio,
            'ratio_low': low,
            'ratio_high': high,
        }
