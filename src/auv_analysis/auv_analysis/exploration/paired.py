"""Controllers held against each other in the same rollouts."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from auv_analysis.exploration.opening import Sweep
from auv_analysis.exploration.quantiles import finite, ordered
from auv_analysis.measures import Measure

Row = dict[str, Any]


def paired(sweep: Sweep, values: np.ndarray, measure: Measure) -> Iterator[Row]:
    """For each two controllers, in how many rollouts the one's figure is the smaller one.

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
        a, b = at[mine[both]], at[other[both]]
        if len(a) == 0:
            continue
        comparable = np.isfinite(a) & np.isfinite(b) & (b > 0)
        ratios = a[comparable] / b[comparable]
        yield {
            'figure': measure.name,
            'label': measure.label,
            'controller': sweep.controllers[first],
            'other': sweep.controllers[second],
            'rollouts': len(a),
            'smaller_percent': float(100 * np.mean(a < b)),
            'equal_percent': float(100 * np.mean(a == b)),
            'larger_percent': float(100 * np.mean(a > b)),
            'median_ratio': finite(np.median(ratios)) if len(ratios) else None,
        }
