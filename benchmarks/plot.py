"""Figure of the growth curves: points, the fitted slope, and what growth in proportion would be."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from curves import CURVES
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from auv_analysis.report.plots import COLOURS, DPI, GREY, letter, new_figure, style

COLUMNS = 3
MANY_DECADES = 2.5  # beyond which only powers of ten are named
PANEL = 2.3  # in, height of a row


def plot(results: Mapping[str, Any], path: Path) -> None:
    """Draw every measured curve, cost against size, both logarithmic."""
    curves = [curve for curve in CURVES if curve.name in results]
    rows = -(-len(curves) // COLUMNS)
    with style():
        figure = new_figure(PANEL * rows + 0.1)
        grid = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
        for index, (axes, curve) in enumerate(zip(grid, curves, strict=False)):
            _draw(axes, results[curve.name])
            axes.set_xlabel(curve.unit)
            letter(axes, index, curve.title)
        for axes in grid[::COLUMNS]:
            axes.set_ylabel('time (s)')
        for axes in grid[len(curves) :]:
            axes.remove()
        figure.savefig(path, dpi=DPI)


def _draw(axes: Axes, found: Mapping[str, Any]) -> None:
    size, cost = np.array(found['points'], float).T
    line = cost[-1] * (size / size[-1]) ** found['slope']
    axes.plot(size, line, color=GREY, linestyle=(0, (4, 2)), label=f'slope {found["slope"]:.2f}')
    axes.plot(size, cost, 'o-', color=COLOURS[0], markersize=3.5)
    axes.set(xscale='log', yscale='log')
    axes.margins(0.08, 0.15)
    axes.set_xticks(size, [short(value) for value in size])
    decades = np.log10(cost.max() / cost.min())
    subs = (1.0, 2.0, 5.0) if decades < MANY_DECADES else (1.0,)
    axes.yaxis.set_major_locator(LogLocator(subs=subs))
    axes.yaxis.set_major_formatter(lambda value, _: f'{value:g}')
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_locator(NullLocator())
    axes.legend(loc='best')


def short(size: float) -> str:
    """A size as a tick's label: thousands as k."""
    return f'{size / 1000:g}k' if size >= 1000 else f'{size:g}'
