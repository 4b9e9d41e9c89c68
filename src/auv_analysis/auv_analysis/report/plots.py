"""The kinds of plots, how they look, and their files: PNG and PDF with title and caption.

Kinds: `time_panels`, `heat_map` with numbers, `distribution`, `small_multiples`, `before_after`.
"""

import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import LogLocator, NullLocator
from PIL import Image

from auv_analysis.metrics.quantities import Quantity, mathtext
from auv_analysis.metrics.statistics import Part
from auv_analysis.output.parallel import results
from auv_analysis.output.text import fixed, number, plain, typeset
from auv_analysis.report.digest import RunDigest
from auv_analysis.scenario.fault_words import line_of
from auv_dynamics.vehicle import DOFS

COLOURS = ('#0072B2', '#E69F00', '#009E73', '#CC79A7', '#D55E00', '#56B4E9')  # Okabe and Ito
DASHES = ('-', (0, (4, 1.6)), (0, (1, 1.3)), (0, (6, 1.4, 1, 1.4)), (0, (9, 2)), (0, (3, 1, 1, 1)))
NOTHING = '#ececec'  # where there are no samples
FAULT, FAULT_INK = '#fcefd6', '#8a5a00'  # where something has failed, and its number
GREY = '#6b6b6b'
PALETTE = 128  # colours of a PNG
WHITE = 0xFFFFFFFF
WIDTH = 6.27  # in, text of Taylor & Francis's LaTeX class in large format: A4, margins of 1 in
DPI = 184
GROUPS = (range(3), range(3, 6))  # linear, angular
MOST_NAMED = 60  # rows whose names and numbers still have room
TALLEST = 11.0  # in
ROW, MARGIN = 0.21, 0.85  # in
DECADES = 4.0  # that a logarithmic scale spans at most
APART = 20.0  # ratio of the extremes from which a scale is logarithmic
BLANK = '#f2f2f2'
RUNS = (  # of three runs and more
    '#1a1a1a', '#D55E00', '#0072B2', '#009E73', '#CC79A7', '#E69F00', COLOURS[-1], '#8c8c8c',
)  # fmt: skip
MOST_LINES = len(RUNS)  # that can be told apart in a panel
STYLE = {
    'font.family': 'STIXGeneral', 'mathtext.fontset': 'stix', 'font.size': 8.3,
    'axes.labelsize': 8.3, 'axes.titlesize': 8.3, 'axes.titlepad': 4.4, 'axes.linewidth': 0.6,
    'axes.spines.top': False, 'axes.spines.right': False, 'axes.grid': True,
    'axes.axisbelow': True, 'axes.xmargin': 0.0, 'axes.formatter.limits': (-5, 6),
    'grid.color': '#e6e6e6', 'grid.linewidth': 0.5, 'lines.linewidth': 1.0,
    'lines.solid_joinstyle': 'round', 'xtick.major.width': 0.6, 'ytick.major.width': 0.6,
    'xtick.labelsize': 7.5, 'ytick.labelsize': 7.5, 'legend.frameon': False,
    'legend.fontsize': 7.8, 'legend.handlelength': 1.6, 'legend.columnspacing': 1.2,
    'legend.borderaxespad': 0.0, 'pdf.fonttype': 42, 'figure.dpi': DPI, 'savefig.dpi': DPI,
    'agg.path.chunksize': 1000,  # a line that fills its panel takes 40 MB at once
}  # fmt: skip
Drawn = tuple[Figure | None, str, str]  # with title and caption


@dataclass(frozen=True)
class FigureRecord:
    """One figure of a report.

    Attributes
    ----------
    name : of its files, without ending
    title, caption : plain text
    png, pdf : its files; None where there is nothing to draw and the caption says why

    """

    name: str
    title: str
    caption: str
    png: Path | None
    pdf: Path | None


def style() -> AbstractContextManager[None]:
    """Context in which figures are drawn and saved; the caller's settings come back after it."""
    return matplotlib.style.context(['default', STYLE])


def new_figure(height: float) -> Figure:
    """Empty figure of a height in inches, as wide as the text of a page, without pyplot."""
    layout = ConstrainedLayoutEngine(w_pad=0.05, h_pad=0.04, wspace=0.03, hspace=0.03)
    return Figure(figsize=(WIDTH, height), layout=layout)


def save(figure: Figure, folder: Path, name: str) -> tuple[Path, Path]:
    """Write <name>.png and <name>.pdf, the same bytes every time; return both paths."""
    png, pdf = folder / f'{name}.png', folder / f'{name}.pdf'
    # once each by the canvases themselves: savefig would draw every figure twice
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    _few_colours(np.asarray(canvas.buffer_rgba())).save(png, dpi=(DPI, DPI))
    figure.set_layout_engine('none')  # anew, it would lie otherwise in the PDF
    dates = {'CreationDate': None, 'Creator': None, 'Producer': None}
    FigureCanvasPdf(figure).print_pdf(pdf, metadata=dates)
    return png, pdf


def _few_colours(pixels: np.ndarray) -> Image.Image:
    """Image of RGBA pixels (h, w, 4) with a palette: a third of the bytes, so a report is small.

    White, which most of them are, has an entry of its own and is not looked at any further.
    """
    inked = np.squeeze(pixels.view(np.uint32) != WHITE, axis=-1)
    inked[0, 0] = True  # one at least
    few = Image.fromarray(pixels[inked][np.newaxis]).convert('RGB')
    # by the largest error: a small bar keeps its colour as well
    few = few.quantize(PALETTE - 1, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    entries = np.full(inked.shape, PALETTE - 1, np.uint8)
    entries[inked] = np.asarray(few)[0]
    image = Image.fromarray(entries)
    colours = few.getpalette() or []
    image.putpalette([*colours, *[255] * (3 * PALETTE - len(colours))])
    return image


def _saved(folder: Path, name: str, make: Callable[[], Drawn]) -> FigureRecord:
    """Draw and save a figure; where there is nothing to draw, the caption says why."""
    figure, title, caption = make()
    with warnings.catch_warnings():
        warnings.filterwarnings('ignore', 'Glyph')  # of a name: its caption has it in any script
        files = (None, None) if figure is None else save(figure, folder, name)
    return FigureRecord(name, title, caption, *files)


def save_figures(folder: Path, drawn: Mapping[str, Callable[[], Drawn]]) -> dict[str, FigureRecord]:
    """Draw and save figures in the style of reports.

    Parameters
    ----------
    folder : where the files go; made when it is not there
    drawn : name -> what makes the figure, its title and its caption

    """
    folder.mkdir(parents=True, exist_ok=True)
    with style():
        made = results([partial(_saved, folder, name, make) for name, make in drawn.items()])
        return dict(zip(drawn, made, strict=True))


@dataclass(frozen=True, eq=False)
class Curve:
    """A line of a panel: abscissae and ordinates (n,), name in the legend, matplotlib's look."""

    x: np.ndarray
    y: np.ndarray
    label: str
    look: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Panel:
    """A pair of axes: curves, a title above and the label of the vertical axis with its unit."""

    curves: Sequence[Curve]
    label: str = ''
    title: str = ''


def look(index: int) -> dict[str, Any]:
    """Colour and dashes of one of `MOST_LINES` lines."""
    return {'color': RUNS[index % len(RUNS)], 'linestyle': DASHES[index % len(DASHES)]}


def small_multiples(
    count: int, across: int = 3, *, height: float = 1.9, **axes: Any
) -> tuple[Figure, list[Axes]]:
    """Figure of equal panels in rows, and its panels; what is left of the last row is empty.

    Parameters
    ----------
    count : of panels
    across : panels in a row, at most
    height : of a row, in
    axes : of matplotlib's `subplots`, such as sharex

    """
    across = min(across, count)
    down = -(-count // across)
    figure = new_figure(0.5 + height * down)
    panels = list(figure.subplots(down, across, squeeze=False, **axes).ravel())
    for unused in panels[count:]:
        unused.set_axis_off()
    for bottom in panels[max(count - across, 0) : count]:
        bottom.tick_params(labelbottom=True)  # nothing is below it
    return figure, panels[:count]


def time_panels(panels: Sequence[Panel], across: int = 1, height: float = 1.7) -> Figure:
    """Curves over one time axis, a panel each, with one legend above."""
    figure, grid = small_multiples(len(panels), across, height=height, sharex=True)
    for index, (axes, panel) in enumerate(zip(grid, panels, strict=True)):
        for curve in panel.curves:
            axes.plot(curve.x, curve.y, **{'label': curve.label or '_', **curve.look})
        axes.set_ylabel(panel.label)
        letter(axes, index, panel.title)
    for axes in grid[-min(across, len(grid)) :]:
        axes.set_xlabel('$t$ (s)')
    shared_legend(figure)
    return figure


def shared_legend(figure: Figure, place: str = 'outside upper right') -> None:
    """One legend of all panels; a name that several have stands once."""
    found = [axes.get_legend_handles_labels() for axes in figure.axes]
    named = {
        label: handle
        for handles, labels in found
        for handle, label in zip(handles, labels, strict=True)
    }
    if named:
        look: dict[str, Any] = {'loc': place, 'ncols': min(len(named), 6), 'handlelength': 2.4}
        figure.legend([*named.values()], [*named], **look)


def distribution(
    axes: Axes, samples: Mapping[str, np.ndarray], looks: Mapping[str, Mapping[str, Any]]
) -> None:
    """Empirical distribution functions: the share of all samples at or below each value.

    Parameters
    ----------
    axes : gets a stepped line per name
    samples : name -> (n,); what is not finite counts and is not drawn
    looks : name -> matplotlib's look of its line

    """
    for name, values in samples.items():
        finite = np.sort(values[np.isfinite(values)])
        share = np.arange(1, len(finite) + 1) / len(values)
        axes.plot(finite, share, drawstyle='steps-post', label=name, **looks.get(name, {}))
    axes.set_ylim(0.0, 1.0)


def before_after(
    axes: Axes, names: Sequence[str], before: np.ndarray, after: np.ndarray, bold: str = ''
) -> None:
    """A row per name with a circle for what was and a diamond for what is.

    Parameters
    ----------
    axes : gets the rows, the first at the top
    names : (n,) of the rows
    before, after : (n,)
    bold : name that is set in bold

    """
    rows = np.arange(len(names))
    axes.hlines(rows, before, after, color='#c8c8c8', linewidth=2.2, zorder=1)
    axes.plot(before, rows, 'o', color=GREY, markersize=6, label='before')
    axes.plot(after, rows, 'D', color=COLOURS[0], markersize=5.5, label='after')
    axes.set_yticks(rows, names)
    for tick, name in zip(axes.get_yticklabels(), names, strict=True):
        tick.set_fontweight('bold' if name == bold else 'normal')
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.margins(x=0.06)
    legend_above(axes, 2)


def moving(part: Part, skip: Sequence[str] = ()) -> list[int]:
    """Indices of the columns that are drawn: not in `skip`, recorded and not zero throughout."""
    return [i for i in range(6) if DOFS[i] not in skip and part.peak[i] > 0.0]


def unrecorded(part: Part, skip: Sequence[str] = ()) -> list[str]:
    """Degrees of freedom not in `skip` of which nothing was recorded."""
    return [dof for dof, x in zip(DOFS, part.peak, strict=True) if np.isnan(x) and dof not in skip]


def shade(axes: Axes, run: RunDigest) -> None:
    """Grey where a run has no samples, over whatever is drawn there; the limits stay.

    Under it, in another colour and with its number, every fault.
    """
    limits = axes.get_xlim()
    for begin, end in run.gaps:
        axes.axvspan(begin, end, color=NOTHING, linewidth=0, zorder=2.5)
    for mark in run.faults:
        begin, end = max(mark.start, limits[0]), min(mark.end, limits[1])
        if begin >= end:
            continue
        axes.axvspan(begin, end, color=FAULT, linewidth=0, zorder=0.4)
        axes.text(
            (begin + end) / 2, 0.985 - 0.11 * line_of(mark, run.faults), f'{mark.number}',
            transform=axes.get_xaxis_transform(), ha='center', va='top', fontsize=6.5,
            color=FAULT_INK, zorder=3.5,
        )  # fmt: skip
    axes.set_xlim(limits)


def shade_sentence(run: RunDigest) -> str:
    """Legend of the spans that `shade` draws, to be added to a caption."""
    listed = '; '.join(f'{mark.number} {mark.label}, {mark.times}' for mark in run.faults)
    text = ' Grey spans: no samples.' if run.gaps else ''
    return f'{text} Shaded: {listed}.' if listed else text


def key(axes: Axes, quantity: Quantity, columns: Sequence[int]) -> None:
    """Name the lines above the panel, at its right."""
    handles = [Line2D([], [], color=COLOURS[i]) for i in columns]
    names = [f'{mathtext(quantity.components[i])} {DOFS[i]}' for i in columns]
    legend_above(axes, len(columns), handles, names)


def legend_above(axes: Axes, columns: int, *named: Any, **look: Any) -> None:
    """Legend above the panel, at its right; `named`: handles and labels, if not all lines."""
    axes.legend(*named, loc='lower right', bbox_to_anchor=(1.0, 1.02), ncols=columns, **look)


def logarithmic(axes: Axes, *directions: str) -> None:
    """Logarithmic 'x' or 'y'; plain text, where it is short, is laid out far faster than powers."""

    def decade(x: float, _: int) -> str:
        return f'{x:g}' if 1e-4 <= x <= 1e5 else f'$10^{{{np.log10(x):.0f}}}$'

    shown = [np.asarray(line.get_xydata(), float) for line in axes.lines]
    marks = [np.asarray(marks.get_offsets(), float) for marks in axes.collections]
    shown += [np.concatenate(marks)] if marks else []
    for direction in directions:
        values = [points[:, 'xy'.index(direction)] for points in shown]
        if not any(len(v) > 2 and np.any(v > 0) and not np.any(v < 0) for v in values):
            continue  # nothing positive to show: a logarithmic axis has no place for it
        axes.set(**{f'{direction}scale': 'log'})
        axis = getattr(axes, f'{direction}axis')
        axis.set_major_formatter(decade)
        axis.set_minor_locator(NullLocator())


def symmetric(axes: Axes, linear: float) -> None:
    """Axis that is linear around zero and logarithmic beyond a power of ten next to `linear`.

    Dotted lines mark where the one ends and the other begins.
    """
    first = round(np.log10(linear))
    low, high = axes.dataLim.intervaly
    axes.set_yscale('symlog', linthresh=10.0**first, linscale=0.8)
    for level in (-(10.0**first), 10.0**first):
        axes.axhline(level, color=GREY, linewidth=0.7, linestyle=(0, (1, 2)))
    last = int(np.ceil(np.log10(max(abs(low), abs(high), 10.0 ** (first + 1)))))
    powers = range(first, last + 1, 1 + (last - first) // 4)
    ticks = [0.0, *(10.0**k for k in powers if 10.0**k <= high)]
    ticks += [-(10.0**k) for k in powers if -(10.0**k) >= low]
    names = [
        '0' if x == 0 else f'${"-" if x < 0 else ""}10^{{{np.log10(abs(x)):.0f}}}$' for x in ticks
    ]
    axes.set_yticks(ticks, names)
    axes.yaxis.set_minor_locator(NullLocator())


def letter(axes: Axes, index: int, text: str = '') -> None:
    """Title (a), (b), ... at the panel's left, beside the power of ten of its numbers, if any."""
    # its height is given where nothing is below it: to find one takes a seventh of a figure's time
    free = axes.xaxis.get_ticks_position() != 'top'
    title = f'({"abcdefghijkl"[index]}) {text}'.rstrip()
    axes.set_title(title, loc='left', y=1.0 if free else None)
    axes.yaxis.get_offset_text().set(x=-0.01, ha='right')


@dataclass(frozen=True, eq=False)
class HeatMap:
    """Cells of one scale.

    Attributes
    ----------
    values : (r, c), NaN where nothing is known
    columns : names (c,)
    label : of the scale, with its unit
    colours : name of a colour map
    scale : of the colours; None: from the values
    decimals : of the numbers in the cells; None: two significant digits

    """

    values: np.ndarray
    columns: Sequence[str]
    label: str
    colours: str = 'cividis_r'
    scale: Normalize | None = None
    decimals: int | None = None

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


def heat_map(rows: Sequence[str], grids: Sequence[HeatMap]) -> Figure:
    """Grids that share their rows, side by side.

    Parameters
    ----------
    rows : names (r,)
    grids : at least one

    """
    height = min(MARGIN + ROW * len(rows), TALLEST)
    figure = new_figure(height)
    ratios = [len(grid.columns) for grid in grids]
    panels = figure.subplots(1, len(grids), squeeze=False, width_ratios=ratios)[0]
    size = min(8.0, 72 * (height - MARGIN) / max(len(rows), 1) * 0.85)
    for i, (axes, grid) in enumerate(zip(panels, grids, strict=True)):
        draw_grid(axes, grid, fontsize=size if len(rows) <= MOST_NAMED else 0.0)
        name_rows(axes, rows if i == 0 else [], len(rows))
        place: dict[str, Any] = {'location': 'bottom', 'aspect': 30, 'fraction': 0.05}
        scale_bar(figure, axes.images[0], grid.label, ax=axes, **place)
    return figure


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


def draw_grid(axes: Axes, grid: HeatMap, *, fontsize: float = 7.0) -> None:
    """Cells with their numbers; what is zero is pale, what is unknown is crossed out.

    Parameters
    ----------
    axes : gets the image
    grid : what is drawn
    fontsize : of the numbers, points; 0: none

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
    if fontsize:
        shades = colours(norm(hidden))
        for (i, j), value in np.ndenumerate(values):
            if np.isfinite(value):
                axes.text(j, i, _text(value, grid), ha='center', va='center', fontsize=fontsize,
                          color=GREY if value == 0 else _ink(shades[i, j]))  # fmt: skip


def _text(value: float, grid: HeatMap) -> str:
    if value == 0.0:
        return '0'
    if grid.decimals is not None:
        return fixed(value, grid.decimals)
    return typeset(number(value, 2))


def _ink(colour: np.ndarray) -> str:
    """Black or white, whichever is read better on a colour."""
    red, green, blue, _ = colour
    return 'black' if 0.299 * red + 0.587 * green + 0.114 * blue > 0.5 else 'white'
