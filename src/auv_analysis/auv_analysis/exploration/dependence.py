"""How figures depend on one varied path, or on two, group by group."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from auv_analysis.exploration.opening import STATUSES
from auv_analysis.exploration.quantiles import by_group, finite, ordered, quantiles, spread
from auv_analysis.exploration.varied import Varied
from auv_analysis.measures import Measure

Row = dict[str, Any]
MOST_CELLS = 10  # groups of a path that a table of two has room for


def along(values: np.ndarray, rows: np.ndarray, varied: Varied, measure: Measure) -> Iterator[Row]:
    """Quantiles of a figure in each group of a path.

    Parameters
    ----------
    values : (n,) of all rows
    rows : (m,) indices of the rows that count
    varied : the path
    measure : whose values they are

    """
    groups = by_group(values[rows], varied.codes[rows], len(varied.labels))
    for i, (label, group) in enumerate(zip(varied.labels, groups, strict=True)):
        row: Row = {'path': varied.path, 'figure': measure.name, 'unit': measure.unit}
        row |= {'group': i, 'value': label, 'middle': finite(varied.middles[i])}
        ends = (None, None) if varied.edges is None else map(float, varied.edges[i])
        yield row | dict(zip(('from', 'to'), ends, strict=True)) | spread(group, measure.unit)


def together(
    values: np.ndarray, rows: np.ndarray, pair: Sequence[Varied], measure: Measure
) -> Iterator[Row]:
    """Median of a figure for each combination of the groups of two paths.

    Parameters
    ----------
    values, rows, measure : as of `along`
    pair : two paths; bins are merged until they are few

    """
    first, second = (merged(varied) for varied in pair)
    width = len(second[1])
    codes = first[0][rows] * width + second[0][rows]
    groups = by_group(values[rows], codes, len(first[1]) * width)
    for i, group in enumerate(groups):
        at = quantiles(ordered(group, measure.unit), [0.5])[0]
        names = {'figure': measure.name, 'unit': measure.unit}
        names |= {'path': pair[0].path, 'value': first[1][i // width]}
        names |= {'other_path': pair[1].path, 'other_value': second[1][i % width]}
        known = int(np.isfinite(group).sum())
        yield names | {'rows': len(group), 'known': known, 'median': finite(at)}


def merged(varied: Varied) -> tuple[np.ndarray, list[str]]:
    """Codes and labels of a path with neighbouring bins joined until they are few."""
    labels = list(varied.labels)
    if not varied.binned or len(labels) <= MOST_CELLS:
        return varied.codes, labels
    step = -(-len(labels) // MOST_CELLS)
    starts = [label.split('–')[0] for label in labels[::step]]
    ends = [labels[min(i + step, len(labels)) - 1] for i in range(0, len(labels), step)]
    joined = [f'{a}–{b.split("–")[-1]}' for a, b in zip(starts, ends, strict=True)]
    return varied.codes // step, joined


def failures(varied: Varied, status: np.ndarray, rows: np.ndarray) -> Iterator[Row]:
    """Shares of diverged and refused rows in each group of a path.

    Parameters
    ----------
    varied : the path
    status : (n,) places in `STATUSES`
    rows : (m,) indices of the rows that count

    """
    groups = by_group(status[rows], varied.codes[rows], len(varied.labels))
    for label, group in zip(varied.labels, groups, strict=True):
        row: Row = {'path': varied.path, 'value': label, 'rows': len(group)}
        for place, word in enumerate(STATUSES[1:], start=1):
            count = int((group == place).sum())
            share = 100.0 * count / len(group) if len(group) else None
            row |= {word: count, f'{word}_percent': share}
        yield row
