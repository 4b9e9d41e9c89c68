"""Figure of the growth curves: points, the fitted slope, and what growth in proportion would be."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from curves import CURVES
from matplotlib.axes import Axes

from auv_analysis.report.plotting import COLOURS, DPI, GREY, letter, new_figure, style

COLUMNS = 3
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
    axes.margins(0.06)
    axes.legend(loc='upper left')
