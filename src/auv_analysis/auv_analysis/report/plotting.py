"""How the figures look: symbols, colours, panels, honest decimation and saving."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import NullLocator
from PIL import Image

from auv_analysis.report.sketch import Sketch
from auv_analysis.report.statistics import Part
from auv_dynamics.vehicle import DOFS

COLOURS = ('#0072B2', '#E69F00', '#009E73', '#CC79A7', '#D55E00', '#56B4E9')  # Okabe and Ito
DASHES = ('-', (0, (4, 1.6)), (0, (1, 1.3)), (0, (6, 1.4, 1, 1.4)), (0, (9, 2)), (0, (3, 1, 1, 1)))
NOTHING = '#ececec'  # where there are no samples
FAULT, FAULT_INK = '#fcefd6', '#8a5a00'  # where something has failed, and its number
GREY = '#6b6b6b'
PALETTE = 64  # colours of a PNG
WIDTH = 6.27  # in, text of Taylor & Francis's LaTeX class in large format: A4, margins of 1 in
DPI = 184
GROUPS = (range(3), range(3, 6))  # linear, angular
STYLE = {
    'font.family': 'STIXGeneral',
    'mathtext.fontset': 'stix',
    'font.size': 8.3,
    'axes.labelsize': 8.3,
    'axes.titlesize': 8.3,
    'axes.titlepad': 4.4,
    'axes.linewidth': 0.6,
    'axes.spines.top': False,
    'axes.spines.right': False,
    'axes.grid': True,
    'axes.axisbelow': True,
    'axes.xmargin': 0.0,
    'axes.formatter.limits': (-5, 6),
    'grid.color': '#e6e6e6',
    'grid.linewidth': 0.5,
    'lines.linewidth': 1.0,
    'lines.solid_joinstyle': 'round',
    'xtick.major.width': 0.6,
    'ytick.major.width': 0.6,
    'xtick.labelsize': 7.5,
    'ytick.labelsize': 7.5,
    'legend.frameon': False,
    'legend.fontsize': 7.8,
    'legend.handlelength': 1.6,
    'legend.columnspacing': 1.2,
    'legend.borderaxespad': 0.0,
    'pdf.fonttype': 42,
    'figure.dpi': DPI,
    'savefig.dpi': DPI,
}


@dataclass(frozen=True)
class Quantity:
    """What a panel shows: a name, six symbols and the units of the two groups."""

    name: str
    symbols: tuple[str, ...]
    units: tuple[str, str]

    def unit(self, column: int) -> str:
        """Unit of a column."""
        return self.units[column // 3]

    def label(self, columns: Sequence[int]) -> str:
        """Axis label of columns of one group, with their unit."""
        return f'{", ".join(self.symbols[i] for i in columns)} ({self.unit(columns[0])})'


def _six(template: str, letters: str) -> tuple[str, ...]:
    return tuple(f'${template.format(letter)}$' for letter in letters)


VELOCITY, WRENCH = ('m/s', 'rad/s'), ('N', 'N m')
ERROR = Quantity('velocity error', _six(r'\Delta {}', 'uvwpqr'), VELOCITY)
LUMPED = Quantity('lumped estimation error', _six('w_{}', 'XYZKMN'), WRENCH)
DELTA_XI = Quantity('velocity deformation', _six(r'\Delta\xi_{}', '123456'), VELOCITY)
DELTA_PI = Quantity('input deformation', _six(r'\Delta\pi_{}', '123456'), WRENCH)
INPUT = Quantity('input', _six(r'\tau_{}', 'XYZKMN'), WRENCH)
UNCERTAINTY = Quantity('lumped uncertainty', _six('F_{}', 'XYZKMN'), WRENCH)


def style() -> AbstractContextManager[None]:
    """Context in which figures are drawn and saved; the caller's settings come back after it."""
    return matplotlib.style.context(['default', STYLE])


def new_figure(height: float, width: float = WIDTH) -> Figure:
    """Empty figure of a size in inches, without pyplot."""
    layout = ConstrainedLayoutEngine(w_pad=0.05, h_pad=0.04, wspace=0.03, hspace=0.03)
    figure = Figure(figsize=(width, height), layout=layout)
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, folder: Path, name: str) -> tuple[Path, Path]:
    """Write <name>.png and <name>.pdf, the same bytes every time; return both paths."""
    folder.mkdir(parents=True, exist_ok=True)
    png, pdf = folder / f'{name}.png', folder / f'{name}.pdf'
    # once each by the canvases themselves: savefig would draw every figure twice
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    drawn = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert('RGB')
    # few colours: a fifth of the bytes, so that a report stays small
    few = drawn.quantize(PALETTE, dither=Image.Dither.NONE)
    few.save(png, optimize=True, dpi=(DPI, DPI))
    figure.set_layout_engine('none')  # laid out once is enough
    dates = {'CreationDate': None, 'Creator': None, 'Producer': None}
    FigureCanvasPdf(figure).print_pdf(pdf, metadata=dates)
    return png, pdf


def moving(part: Part, skip: Sequence[str] = ()) -> list[int]:
    """Indices of the columns that are drawn: not in `skip` and not zero throughout."""
    return [i for i in range(6) if DOFS[i] not in skip and part.peak[i] != 0.0]


def groups(columns: Sequence[int]) -> list[list[int]]:
    """Those columns that are linear, then those that are angular; no group is empty."""
    split = ([i for i in columns if i in members] for members in GROUPS)
    return [members for members in split if members]


def draw_lines(axes: Axes, run: Sketch, signal: str, part: str, columns: Sequence[int]) -> None:
    """Lines of some columns of a signal over a part of the time, in their colours."""
    ends = []
    for i in columns:
        t, y = run.drawn(signal, i, part)
        axes.plot(t, y, color=COLOURS[i])
        ends = [t[0], t[-1]]
    axes.set_xlim(*ends)
    shade(axes, run)


def shade(axes: Axes, run: Sketch) -> None:
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
        level = sum(
            other.start <= mark.start < other.end for other in run.faults[: mark.number - 1]
        )
        axes.text(
            (begin + end) / 2, 0.985 - 0.11 * (level % 4), f'{mark.number}',
            transform=axes.get_xaxis_transform(), ha='center', va='top', fontsize=6.5,
            color=FAULT_INK, zorder=3.5,
        )  # fmt: skip
    axes.set_xlim(limits)


def shade_sentence(run: Sketch) -> str:
    """What the spans that `shade` draws are, to be added to a caption."""
    listed = '; '.join(f'{mark.number} {mark.label}, {mark.times}' for mark in run.faults)
    text = ' Grey spans: no samples.' if run.gaps else ''
    return f'{text} Shaded: {listed}.' if listed else text


def key(axes: Axes, quantity: Quantity, columns: Sequence[int]) -> None:
    """Name the lines above the panel, at its right."""
    handles = [axes.plot([], [], color=COLOURS[i])[0] for i in columns]
    place: dict[str, Any] = {
        'loc': 'lower right',
        'bbox_to_anchor': (1.0, 1.02),
        'ncols': len(columns),
    }
    axes.legend(handles, [f'{quantity.symbols[i]} {DOFS[i]}' for i in columns], **place)


def logarithmic(axes: Axes, *directions: str) -> None:
    """Logarithmic 'x' or 'y'; plain text, where it is short, is laid out far faster than powers."""

    def decade(x: float, _: int) -> str:
        return f'{x:g}' if 1e-4 <= x <= 1e5 else f'$10^{{{np.log10(x):.0f}}}$'

    shown = [np.asarray(line.get_xydata(), float) for line in axes.lines]
    marks = [np.asarray(marks.get_offsets(), float) for marks in axes.collections]
    shown += [np.concatenate(marks)] if marks else []
    for direction in directions:
        values = [points[:, 'xy'.index(direction)] for points in shown]
        if not any(len(v) > 2 and np.any(v > 0) and np.all(v >= 0) for v in values):
            continue  # nothing positive to show: a logarithmic axis has no place for it
        axes.set(**{f'{direction}scale': 'log'})
        axis = getattr(axes, f'{direction}axis')
        axis.set_major_formatter(decade)
        axis.set_minor_locator(NullLocator())


def symmetric(axes: Axes, linear: float) -> float:
    """Axis that is linear around zero and logarithmic beyond a power of ten next to `linear`.

    Dotted lines mark where the one ends and the other begins; returns that power of ten.

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
    return 10.0**first


def letter(axes: Axes, index: int, text: str = '') -> None:
    """Title (a), (b), ... at the panel's left."""
    axes.set_title(f'({"abcdefghijkl"[index]}) {text}'.rstrip(), loc='left')
