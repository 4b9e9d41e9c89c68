"""What a figure shows: its lines by the words of its legend, levels, spans, bands, cells."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.shown import figure_lines
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from PIL import Image

from auv_analysis.report import panels as interactive
from auv_analysis.report import plots

Curves = dict[str, list[tuple[np.ndarray, np.ndarray]]]


@contextmanager
def captured(*, panels: bool = False) -> Iterator[dict[str, Figure]]:
    """Figures by name, as they are composed; nothing is rendered. A caption is sentences.

    The PDF of a figure says in lines what it shows. `panels`: with what a browser draws of them.
    """
    found: dict[str, Figure] = {}
    composed = plots._saved

    def saved(*of: Any) -> plots.FigureRecord:
        record = composed(*of)
        assert record.title[-1] != '.' == record.caption[-1], record
        return record

    def save(figure: Figure, folder: Path, name: str) -> tuple[Path, Path]:
        found[name] = figure
        png, pdf = folder / f'{name}.png', folder / f'{name}.pdf'
        Image.new('1', (720, 300 + len(found)), 'white').save(png)
        pdf.write_text('\n'.join(figure_lines(figure)), encoding='utf-8')
        return png, pdf

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plots, 'save', save)
        patch.setattr(plots, '_saved', saved)
        if not panels:
            patch.setattr(interactive, 'document', lambda *_: [])
            patch.setattr(interactive, 'library', str)
        yield found


@contextmanager
def undrawn() -> Iterator[None]:
    """Figures are not composed either: blank files stand for all, for tests that look elsewhere."""

    def saved(folder: Path, name: str, _: Any) -> plots.FigureRecord:
        files = [folder / f'{name}.{kind}' for kind in ('png', 'pdf')]
        Image.new('1', (720, 300), 'white').save(files[0])
        files[1].touch()
        return plots.FigureRecord(name, 'Not drawn', 'Not drawn.', *files)

    with captured(), pytest.MonkeyPatch.context() as patch:
        patch.setattr(plots, '_saved', saved)
        yield


def lines(axes: Axes) -> list[Line2D]:
    """Lines that show data: no borders, no keys without points."""
    return [
        line for line in axes.lines
        if line.get_transform() == axes.transData and np.size(line.get_xdata())
    ]  # fmt: skip


def points(line: Line2D) -> tuple[np.ndarray, np.ndarray]:
    """Abscissae and ordinates."""
    return np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)


def _look(line: Line2D) -> dict[str, Any]:
    dashes = line._unscaled_dash_pattern  # type: ignore[attr-defined]  # no public way to it
    return {
        'colour': to_hex(line.get_color()),
        'dashes': dashes if line.get_linestyle() != 'None' else None,
        'marker': line.get_marker(),
        'width': line.get_linewidth(),
    }


def angles(axes: Axes) -> set[float]:
    """By how much the words below a panel are turned, deg."""
    return {label.get_rotation() for label in axes.get_xticklabels()}


def legend(axes: Axes) -> Legend:
    """The legend of a panel, else the first of its figure."""
    own = axes.get_legend()
    return own if own is not None else axes.figure.legends[0]


def named(axes: Axes, key: Legend | None = None) -> Curves:
    """Lines of a panel by the words that stand beside their look in a legend.

    What all handles of the legend share tells nothing and is not compared.
    """
    key = legend(axes) if key is None else key
    handles = [h for h in key.legend_handles if isinstance(h, Line2D)]
    words = [text.get_text() for text in key.get_texts()]
    looks = [_look(handle) for handle in handles]
    telling = [part for part in looks[0] if len({str(look[part]) for look in looks}) > 1]
    telling = telling or ['colour', 'dashes']
    found: Curves = {}
    for word, look in zip(words, looks, strict=False):
        mine = [
            line for line in lines(axes)
            if all(str(_look(line)[part]) == str(look[part]) for part in telling)
        ]  # fmt: skip
        found[word] = [points(line) for line in mine]
    return found


def levels(axes: Axes, across: str = 'y') -> list[float]:
    """Where the horizontal (y) or vertical (x) border lines are."""
    transform = axes.get_yaxis_transform() if across == 'y' else axes.get_xaxis_transform()
    get = Line2D.get_ydata if across == 'y' else Line2D.get_xdata
    return [float(get(line)[0]) for line in axes.lines if line.get_transform() == transform]


def spans(axes: Axes) -> list[tuple[str, float, float]]:
    """Colour, begin and end of what is shaded over a time."""
    patches = [p for p in axes.patches if p.get_transform() != axes.transData]
    boxes = [(to_hex(p.get_facecolor()), p.get_path().transformed(p.get_patch_transform()))
             for p in patches]  # fmt: skip
    return [(c, *(float(f(path.vertices[:, 0])) for f in (np.min, np.max))) for c, path in boxes]


def bands(axes: Axes) -> list[tuple[str, np.ndarray, np.ndarray, np.ndarray]]:
    """Colour, abscissae, lower and upper edge of each filled band, in the order drawn."""
    found = []
    for band in axes.collections:
        if not len(band.get_facecolor()) or not len(band.get_paths()):
            continue
        vertices = np.concatenate([path.vertices for path in band.get_paths()])
        x = np.unique(vertices[:, 0])
        edges = [[f(vertices[vertices[:, 0] == at, 1]) for at in x] for f in (np.min, np.max)]
        found.append((to_hex(band.get_facecolor()[0]), x, *map(np.array, edges)))
    return found


def holds(axes: Axes) -> bool:
    """Whether all points of lines and marks are within the limits of a panel."""
    shown = [np.c_[points(line)] for line in lines(axes)]
    shown += [np.asarray(marks.get_offsets(), float) for marks in axes.collections]
    at = np.concatenate(shown)
    ends = np.sort([axes.get_xlim(), axes.get_ylim()])
    return bool(np.all((at >= ends[:, 0]) & (at <= ends[:, 1]) | np.isnan(at)))


def ticks(axes: Axes, across: str = 'x') -> Mapping[float, str]:
    """Words at their places along an axis."""
    axis = axes.xaxis if across == 'x' else axes.yaxis
    texts = (label.get_text() for label in axis.get_ticklabels())
    return dict(zip(axis.get_ticklocs(), texts, strict=True))


def same(curve: tuple[np.ndarray, np.ndarray], t: np.ndarray, y: np.ndarray) -> None:
    """Hold a line against what it has to show; where it breaks, it has a NaN."""
    x, values = curve
    there = ~np.isnan(values)
    near(x[there], t, 1e-9, 1e-9)
    near(values[there], y, 1e-9, 1e-12)


def near(found: np.ndarray, wanted: np.ndarray, rel: float = 1e-6, least: float = 1e-12) -> None:
    """As `pytest.approx`, which takes a thousand times as long for each of many numbers."""
    assert found.shape == np.shape(wanted)
    off = ~(np.abs(found - wanted) <= np.maximum(rel * np.abs(wanted), least))
    assert not off.any(), (off.sum(), found[off][:3], np.asarray(wanted)[off][:3])


def _colour_bar(axes: Axes) -> str:
    bar = axes.images[0].colorbar
    return '' if bar is None else bar.ax.get_xlabel() or bar.ax.get_ylabel()


def cells(axes: Axes, rows: Axes | None = None) -> dict[tuple[str, str], float]:
    """Values of an image by the words of its row and of its column, NaN where there is none.

    The number that stands in a cell has to be that of its colour. `rows` is the panel that names
    the rows, where this one does not.
    """
    across, down = ticks(axes), ticks(rows or axes, 'y')
    values = np.ma.filled(axes.images[0].get_array().astype(float), np.nan)
    words = {tuple(map(round, text.get_position()[::-1])): text.get_text() for text in axes.texts}
    found = {}
    for (i, j), value in np.ndenumerate(values):
        word = words.get((i, j), '')
        nothing = word in ('0', '0.0') and np.isnan(value)
        found[down[i], across[j]] = 0.0 if nothing else value
        if word and not nothing:
            shown, half = _number(word)
            assert abs(shown - value) <= half * (1 + 1e-6), (word, value)
    unknown = {place for place, value in found.items() if np.isnan(value)}
    crossed = {
        (down[round(patch.get_y() + 0.5)], across[round(patch.get_x() + 0.5)])
        for patch in axes.patches
        if isinstance(patch, Rectangle) and patch.get_hatch()
    }
    assert crossed == unknown, 'what is unknown is crossed out, and nothing else'
    return found


def _number(word: str) -> tuple[float, float]:
    """A number of a cell, and half a unit of its last digit."""
    plain = word.replace('−', '-').replace('\u202f', '').strip('$').rstrip('}')
    mantissa, _, power = plain.partition(r'\cdot10^{')
    scale = 10.0 ** int(power or 0)
    return float(mantissa) * scale, 0.5 * scale * 10.0 ** -len(mantissa.partition('.')[2])


def heat_maps(figure: Figure) -> dict[str, dict[tuple[str, str], float]]:
    """Label of the colour bar -> cells, of grids side by side that share their rows."""
    grids = [axes for axes in figure.axes if axes.images]
    return {_colour_bar(axes): cells(axes, grids[0]) for axes in grids}


def bars(axes: Axes, key: Legend | None = None) -> dict[str, list[tuple[float, float, float]]]:
    """Word of the legend -> place, begin and end of its bars."""
    key = legend(axes) if key is None else key
    colours = {
        to_hex(h.get_color() if isinstance(h, Line2D) else h.get_facecolor()): t.get_text()
        for h, t in zip(key.legend_handles, key.get_texts(), strict=True)
    }
    found: dict[str, list[tuple[float, float, float]]] = {}
    for bar in axes.patches:
        x, y, wide, high = bar.get_x(), bar.get_y(), bar.get_width(), bar.get_height()
        lying = max(wide, 0.78) != wide or abs(high - 0.78) < 1e-9
        place, begin, end = (y + high / 2, x, x + wide) if lying else (x + wide / 2, y, y + high)
        found.setdefault(colours[to_hex(bar.get_facecolor())], []).append((place, begin, end))
    return found
