"""Numbers as coloured cells: rows by columns, on one scale, with what is zero or unknown marked."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import LogLocator

from auv_analysis.output.text import fixed, number, plain, typeset
from auv_analysis.report import plotting
from auv_analysis.report.plotting import GREY

MOST_NAMED = 60  # rows whose names and numbers still have room
TALLEST = 11.0  # in
ROW, MARGIN = 0.21, 0.85  # in
DECADES = 4.0  # that a logarithmic scale spans at most
APART = 20.0  # ratio of the extremes from which a scale is logarithmic
BLANK = '#f2f2f2'
ALWAYS = '≡ 0'  # zero for every motion


@dataclass(frozen=True, eq=False)
class Grid:
    """Cells of one scale.

    Attributes
    ----------
    values : (r, c), NaN where nothing is known
    columns : names (c,)
    label : of the scale, with its unit
    colours : name of a colour map
    scale : of the colours; None: from the values
    decimals : of the numbers in the cells; None: two significant digits
    structural : (r, c) whether a zero follows from the structure of M; None: not known

    """

    values: np.ndarray
    columns: Sequence[str]
    label: str
    colours: str = 'cividis_r'
    scale: Normalize | None = None
    decimals: int | None = None
    structural: np.ndarray | None = None

    def norm(self) -> Normalize:
        """Scale of the colours: logarithmic where positive values are far apart."""
        known = self.values[np.isfinite(self.values)]
        if self.scale is not None:
            return self.scale
        positive = known[known > 0]
        if len(positive) == 0 or known.min() < 0:
            return Normalize(*(known.min(), known.max()) if len(known) else (0.0, 1.0))
        high = positive.max()
        if high > APART * positive.min():
            return LogNorm(max(positive.min(), high * 10.0**-DECADES), high, clip=True)
        return Normalize(0.0, high)


def grid_figure(
    rows: Sequence[str], grids: Sequence[Grid], width: float = plotting.WIDTH
) -> Figure:
    """Grids that share their rows, side by side.

    Parameters
    ----------
    rows : names (r,)
    grids : at least one
    width : in

    """
    height = min(MARGIN + ROW * len(rows), TALLEST)
    figure = plotting.new_figure(height, width)
    ratios = [len(grid.columns) for grid in grids]
    panels = figure.subplots(1, len(grids), squeeze=False, width_ratios=ratios)[0]
    size = min(8.0, 72 * (height - MARGIN) / max(len(rows), 1) * 0.85)
    for i, (axes, grid) in enumerate(zip(panels, grids, strict=True)):
        draw_grid(axes, grid, size if len(rows) <= MOST_NAMED else 0.0)
        name_rows(axes, rows if i == 0 else [], len(rows))
        place: dict[str, Any] = {'location': 'bottom', 'aspect': 30, 'fraction': 0.05}
        scale_bar(figure, axes.images[0], grid.label, ax=axes, **place)
    return figure


def small_heads(figure: Figure, grids: Sequence[Grid]) -> None:
    """Heads that are paths: small, and upright where there are more than two."""
    for axes, grid in zip(figure.axes, grids, strict=False):
        angle = 90 if len(grid.columns) > 2 else 0
        axes.tick_params(axis='x', labelrotation=angle, labelsize='small')


def scale_bar(figure: Figure, image: ScalarMappable, label: str, **place: Any) -> None:
    """Colour bar with few enough numbers."""
    bar = figure.colorbar(image, label=label, **place)
    if isinstance(image.norm, LogNorm):
        bar.ax.minorticks_off()
        axis = bar.ax.xaxis if bar.orientation == 'horizontal' else bar.ax.yaxis
        low, high = np.log10(image.get_clim())
        axis.set_major_locator(LogLocator(subs=(1.0,) if high - low > 2.2 else (1.0, 2.0, 5.0)))
        axis.set_major_formatter(lambda x, _: typeset(plain(x, 1)))


def name_rows(axes: Axes, rows: Sequence[str], count: int) -> None:
    """Names at the left, of every k-th row where there is no room for all."""
    if not rows:
        axes.set_yticks([])
        return
    step = -(-count // MOST_NAMED)
    axes.set_yticks(range(0, count, step), rows[::step])


def draw_grid(axes: Axes, grid: Grid, size: float = 7.0) -> None:
    """Cells with their numbers; what is zero is pale, what is unknown is crossed out.

    Parameters
    ----------
    axes : gets the image
    grid : what is drawn
    size : of the numbers, points; 0: none

    """
    values = np.asarray(grid.values, float)
    hidden = np.ma.masked_where(~np.isfinite(values) | (values == 0.0), values)
    norm, colours = grid.norm(), matplotlib.colormaps[grid.colours].with_extremes(bad=BLANK)
    axes.imshow(hidden, norm=norm, cmap=colours, aspect='auto', interpolation='nearest')
    axes.set_xticks(range(len(grid.columns)), grid.columns)
    axes.tick_params(length=0, top=True, bottom=False, labeltop=True, labelbottom=False)
    axes.grid(False)
    axes.spines[:].set_visible(False)
    for i, j in zip(*np.nonzero(~np.isfinite(values)), strict=True):
        frame = Rectangle((j - 0.5, i - 0.5), 1, 1, fill=False, hatch='///', linewidth=0)
        frame.set_edgecolor('#c9c9c9')
        axes.add_patch(frame)
    if size:
        for (i, j), value in np.ndenumerate(values):
            if np.isfinite(value):
                always = grid.structural is not None and grid.structural[i, j]
                text = ALWAYS if always else _text(value, grid)
                axes.text(j, i, text, ha='center', va='center', fontsize=size,
                          color=GREY if value == 0 else _ink(colours(norm(value))))  # fmt: skip


def _text(value: float, grid: Grid) -> str:
    if value == 0.0:
        return '0'
    if grid.decimals is not None:
        return fixed(round(value, grid.decimals) + 0.0, grid.decimals)  # never a minus zero
    return typeset(number(value, 2))


def _ink(colour: tuple[float, float, float, float]) -> str:
    """Black or white, whichever is read better on a colour."""
    red, green, blue, _ = colour
    return 'black' if 0.299 * red + 0.587 * green + 0.114 * blue > 0.5 else 'white'
