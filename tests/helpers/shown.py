"""All that a page, a figure or a panel shows to a reader, as lines of text.

How something is laid out (widths of lines, legends in a panel) is left out, but for the size of a
figure, its grid, and sizes and angles of texts that a figure sets. Of data stands a digest.
"""

import base64
import gzip
import json
import zlib
from collections.abc import Iterator
from functools import cache
from html.parser import HTMLParser
from itertools import groupby, zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import Collection, PathCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.mathtext import MathTextParser
from matplotlib.patches import Patch
from matplotlib.spines import Spine
from matplotlib.text import Annotation, Text
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator
from pyarrow import parquet

from auv_analysis.report.results import Table

FEW = 3  # values that are written as they are
CANCELS = 1e3  # what is left of a sum whose terms cancel is noise sooner than a term is


def digest(values: Any) -> str:
    """Some numbers; of many how many, first, last, least, largest, mean, mean of a ramp of them."""
    x = np.ma.filled(np.ma.asarray(values, float), np.nan).ravel()
    known = x[np.isfinite(x)]
    size = np.abs(known).max(initial=0.0)
    if len(x) > FEW and np.ptp(np.diff(x)) <= 1e-9 * size:
        return f'{len(x)} evenly {_number(x[0], size)} to {_number(x[-1], size)}'
    if len(x) > FEW:
        ramp = np.linspace(-1.0, 1.0, len(x))[np.isfinite(x)]
        ends = [known[0], known[-1], known.min(), known.max()] if len(known) else []
        means = [known.mean(), np.mean(known * ramp)] if len(known) else []
        unknown = f' {len(x) - len(known)} unknown' if len(known) < len(x) else ''
        said = [*(_number(v, size) for v in ends), *(_number(v, CANCELS * size) for v in means)]
        return f'{len(x)}{unknown}: {" ".join(said)}'
    return ' '.join(_number(v, size) for v in x)


def _number(value: float, size: float) -> str:
    """A whole number, or four digits; rounding noise is zero."""
    if abs(value) <= 1e-9 * size:
        return '0'
    whole = value == round(value, 0) and abs(value) < 1e4
    return f'{value:.0f}' if whole else f'{value:#.4g}'


def table_lines(table: Table) -> Iterator[str]:
    """Heads with units, and rows."""
    yield f'table {table.name}: {table.caption} Rows are named by {table.stub}.'
    heads = [(head.group, head.label, head.unit and f'({head.unit})') for head in table.columns]
    rows = [
        [(cell.text, cell.remark and f'({cell.remark})', cell.kind and f'[{cell.kind}]')
         for cell in row] for row in table.rows
    ]  # fmt: skip
    for row in [heads, *rows]:
        yield ' | '.join(' '.join(filter(None, parts)) for parts in row)
    yield from [table.note] if table.note else []


# figures


def figure_lines(figure: Figure) -> Iterator[str]:
    """Panels of a figure, artist by artist; ValueError where a text cannot be set."""
    for text in _texts(figure):
        _set(text.get_text())
    yield f'{digest(figure.get_size_inches())} in'
    title = figure.get_suptitle()
    yield from [f'title {title}'] if title else []
    yield from (f'text {_words(text)}' for text in figure.texts if text.get_text() != title)
    for key in figure.legends:
        yield _legend(key)
    for axes in figure.axes:
        if getattr(axes, '_colorbar', None) is not None:
            words = f'{axes.get_xlabel()}{axes.get_ylabel()}'
            ends = digest([*axes.get_xlim(), *axes.get_ylim()])
            yield f'colours: {words} {ends}{_sample(axes.xaxis)}{_sample(axes.yaxis)}'
        elif axes.axison and axes.get_visible():
            yield from _axes_lines(axes)


def _texts(artist: Artist) -> Iterator[Text]:
    """All texts but those of ticks that matplotlib chooses itself."""
    for child in artist.get_children():
        if isinstance(child, Axis):
            fixed = isinstance(child.get_major_locator(), FixedLocator)
            yield from [child.label, *(child.get_ticklabels() if fixed else [])]
        elif isinstance(child, Text):
            yield child
        else:
            yield from _texts(child)


@cache
def _set(text: str) -> None:
    if '$' in text:
        MathTextParser('path').parse(text)


def _axes_lines(axes: Axes) -> Iterator[str]:
    place = axes.get_subplotspec()
    where = ''
    if place is not None:
        rows, columns = place.get_gridspec().get_geometry()
        where = f' {place.rowspan.start},{place.colspan.start} of {rows},{columns}'
    titles = [axes.get_title(loc=side) for side in ('left', 'center', 'right')]
    yield f'axes{where}: {" ".join(filter(None, titles))}'
    for name, axis in (('x', axes.xaxis), ('y', axes.yaxis)):
        limits = '' if getattr(axes, f'get_autoscale{name}_on')() else f' {_limits(axes, name)}'
        alike = getattr(axes, f'get_shared_{name}_axes')().get_siblings(axes)
        scale = f'{axis.get_scale()}{" shared" * (len(alike) > 1)}'
        if axis.get_scale() == 'symlog':
            scale += f' from {_number(axis.get_transform().linthresh, 1.0)}'
        inverted = ' inverted' if axis.get_inverted() else ''
        side = 'bottom' if name == 'x' else 'left'
        bare = '' if axis.get_tick_params().get(f'label{side}', True) else ' bare'
        yield f'  {name} {axis.get_label_text()} {scale}{inverted}{limits}{_ticks(axis)}{bare}'
    kept = [one for one in axes.get_children() if one.get_visible() and one is not axes.patch]
    for (kind, look), group in groupby(kept, key=_kind_and_look):
        if kind and (data := _data(kind, [*group], axes)):
            yield f'  {kind}{look}: {data}'
    if axes.get_legend() is not None:
        yield f'  {_legend(axes.get_legend())}'


def _ticks(axis: Axis) -> str:
    """Ticks that a figure sets itself, with size and angle of their texts where it sets these."""
    locator, look = axis.get_major_locator(), axis.get_tick_params()
    if isinstance(locator, FixedLocator):
        words = [text.get_text() for text in axis.get_ticklabels()]
        places = (_number(at, 1.0) for at in axis.get_ticklocs())
        pairs = zip_longest(places, words, fillvalue='')
        ticks = ' ticks ' + ', '.join(a if a == b else f'{a} {b}' for a, b in pairs)
    elif type(locator) is MaxNLocator:
        ticks = f' ticks at most {locator._nbins}'  # no public way to it
    else:
        ticks = _sample(axis)
    texts = [f' {key[5:]} {value}' for key, value in look.items()
             if key in ('labelsize', 'labelrotation')]  # fmt: skip
    return ticks and ticks + ''.join(texts)


def _sample(axis: Axis) -> str:
    """How an axis writes numbers in a way of its own."""
    write = axis.get_major_formatter()
    if not isinstance(write, FuncFormatter):
        return ''
    return ' ticks ' + ', '.join(write(value, 0) for value in (0.01, 0.5, 20))


def _limits(axes: Axes, name: str) -> str:
    """Ends of an axis; those of the data by this word, exactly."""
    ends = getattr(axes, f'get_{name}lim')()
    of_data = getattr(axes.dataLim, f'interval{name}')
    size = np.abs(ends).max()
    pairs = zip(ends, of_data, strict=True)
    return ' '.join('data' if end == other else _number(end, size) for end, other in pairs)


def _kind_and_look(artist: Artist) -> tuple[str, str]:
    if isinstance(artist, Line2D):
        return 'line', _look(artist)
    if isinstance(artist, AxesImage):
        return 'image', f' {artist.get_cmap().name} {_norm(artist)}'
    if isinstance(artist, Collection):
        return type(artist).__name__, _look(artist)
    if isinstance(artist, Text):
        return ('texts', '') if artist.get_text() and not _is_title(artist) else ('', '')
    if isinstance(artist, Patch) and not isinstance(artist, Spine):
        return type(artist).__name__, _look(artist)
    return '', ''


def _is_title(text: Text) -> bool:
    axes = text.axes
    return axes is not None and text in (axes.title, axes._left_title, axes._right_title)


def _data(kind: str, artists: list[Any], axes: Axes) -> str:
    if kind == 'line':
        return '; '.join(_line(line, axes) for line in artists if np.size(line.get_xdata()))
    if kind == 'texts':
        return '; '.join(map(_words, artists))
    if kind == 'image':
        return '; '.join(f'{one.get_array().shape} {digest(one.get_array())}' for one in artists)
    if isinstance(artists[0], Patch):
        ends = [one.get_path().transformed(one.get_patch_transform()).get_extents().extents
                for one in artists]  # fmt: skip
        return _frame(artists[0], axes) + ' / '.join(map(digest, np.transpose(ends)))
    return '; '.join(_collection(one) for one in artists)


def _line(line: Line2D, axes: Axes) -> str:
    x, y, frame = digest(line.get_xdata()), digest(line.get_ydata()), _frame(line, axes)
    return {'across ': f'across at {y}', 'up ': f'up at {x}'}.get(frame, f'{frame}{x} / {y}')


def _collection(one: Any) -> str:
    points = np.asarray(one.get_offsets(), float)
    if len(points) == 1 and not points.any():
        points = np.concatenate([path.vertices for path in one.get_paths()] or [points])
    values = one.get_array()
    scale = '' if values is None else f' by {one.get_cmap().name} {_norm(one)} {digest(values)}'
    return f'{digest(points[:, 0])} / {digest(points[:, 1])}{scale}'


def _frame(artist: Artist, axes: Axes) -> str:
    """In which coordinates something is drawn."""
    transform = artist.get_transform()
    for word, one in (('across ', axes.get_yaxis_transform()), ('up ', axes.get_xaxis_transform()),
                      ('of the axes ', axes.transAxes)):  # fmt: skip
        if transform == one or getattr(transform, '_b', None) == one:
            return word
    return ''


def _norm(mapped: Any) -> str:
    low, high = mapped.get_clim()
    clips = ' clipped' * mapped.norm.clip
    return f'{type(mapped.norm).__name__} {digest([low, high])}{clips}'


def _look(artist: Any) -> str:
    """Colours, dashes, marker, hatch."""
    if isinstance(artist, Line2D):
        parts = [to_hex(artist.get_color())]
        if artist.get_linestyle() == 'None':
            parts.append('no line')
        elif (dashes := artist._unscaled_dash_pattern)[1]:  # no public way to it
            parts.append(f'dashes {digest(dashes[1])}')
        marker = artist.get_marker()
        if marker not in ('None', None, ''):
            filled = to_hex(artist.get_markerfacecolor(), keep_alpha=True)
            parts.append(f'marker {marker} {filled}')
    elif isinstance(artist, Patch):
        parts = [to_hex(artist.get_facecolor()) if artist.get_fill() else 'empty']
        parts += [f'hatch {artist.get_hatch()}'] if artist.get_hatch() else []
    else:
        faces, edges = map(_colours, (artist.get_facecolor(), artist.get_edgecolor()))
        parts = [faces or edges]
        parts += [f'edged {edges}'] if faces and edges not in ('', faces) else []
        if isinstance(artist, PathCollection) and artist.get_paths():
            parts.append(f'marker {digest(artist.get_paths()[0].vertices)}')
        sizes = np.unique(getattr(artist, 'get_sizes', list)())
        parts += [f'sizes {digest(sizes)}'] if len(sizes) > 1 else []
    label = str(artist.get_label())
    named = label and not label.startswith('_')
    return f' {" ".join(filter(None, parts))}{f" {label!r}" if named else ""}'


def _colours(colours: np.ndarray) -> str:
    kinds = dict.fromkeys(map(to_hex, colours))
    return ' '.join(kinds) if len(kinds) <= 6 else f'{len(kinds)} colours {digest(colours)}'


def _words(text: Text) -> str:
    """A text and where it stands; how far an annotation stands off is layout."""
    at = text.xy if isinstance(text, Annotation) else text.get_position()
    numbers = [value for value in at if not isinstance(value, str)]
    size = '' if text.get_fontsize() == rcParams['font.size'] else f' {text.get_fontsize():.3g} pt'
    return f'{text.get_text()!r}{size} {to_hex(text.get_color())} at {digest(numbers)}'


def _legend(key: Legend) -> str:
    title = key.get_title().get_text()
    looks = [_look(handle) for handle in key.legend_handles]
    words = [text.get_text() for text in key.get_texts()]
    entries = ', '.join(
        f'{word}{look.removesuffix(f" {word!r}")}' for word, look in zip(words, looks, strict=True)
    )
    return f'legend {key._outside_loc or ""} {title}: {entries}'  # no public way to it


# panels of a page


def panel_lines(document: list[Any]) -> Iterator[str]:
    """Figures of Bokeh's JSON: axes, lines, what is shaded, what a cursor tells."""
    models: dict[str, dict[str, Any]] = {}

    def collect(part: Any) -> None:
        if isinstance(part, dict):
            if part.get('type') == 'object':
                models[part['id']] = part
            part = list(part.values())
        if isinstance(part, list):
            for one in part:
                collect(one)

    collect(document[0])

    def get(part: Any, *names: str) -> Any:
        for name in names:
            part = models[part['id']].get('attributes', {}).get(name)
            if part is None:
                return None
        return part

    for root in document[0]['roots']:
        scale = models[get(root, 'y_scale')['id']]['name']
        ends = digest([get(root, 'x_range', name) or 0.0 for name in ('start', 'end')])
        labels = [get(axis, 'axis_label') for axis in [*get(root, 'below'), *get(root, 'left')]]
        yield f'panel {get(root, "name")}: {scale} {labels} from {ends}'
        for one in get(root, 'renderers'):
            glyph, data = get(one, 'glyph'), dict(get(one, 'data_source', 'data')['entries'])
            kind, look = models[glyph['id']]['name'], dict(models[glyph['id']]['attributes'])
            ends = [digest(_array(data[look.pop(name)['field']]))
                    for name in ('x', 'y', 'y1', 'y2') if name in look]  # fmt: skip
            dashes = look.get('line_dash', '')
            colour = look.get('line_color') or look.get('fill_color')
            words = f'{get(one, "name")} {get(one, "tags")} {colour} {dashes}'
            yield f'  {kind} {words}: {" / ".join(ends)}'
        tools = [f'{models[tool["id"]]["name"]} {get(tool, "tooltips") or ""}'.strip()
                 for tool in get(root, 'toolbar', 'tools')]  # fmt: skip
        yield f'  tools {", ".join(tools)}'
        for one in [*(get(root, 'center') or []), *(get(root, 'above') or [])]:
            name = models[one['id']]['name']
            if name == 'BoxAnnotation':
                ends = [get(one, end) for end in ('left', 'right')]
                ends = [end if isinstance(end, float | int) else np.nan for end in ends]
                yield f'  box {digest(ends)}'
            elif name == 'Label':
                yield f'  label {get(one, "text")} at {digest([get(one, "x"), get(one, "y")])}'
            elif name == 'Legend':
                items = [(get(item, 'label')['value'], get(item, 'renderers')[0])
                         for item in get(one, 'items')]  # fmt: skip
                pairs = [(word, get(drawn, 'name')) for word, drawn in items]
                yield '  legend ' + ', '.join(a if a == b else f'{a} = {b}' for a, b in pairs)


def _array(entry: dict[str, Any]) -> np.ndarray:
    data = base64.b64decode(entry['array']['data'])
    return np.frombuffer(gzip.decompress(data) if data[:2] == b'\x1f\x8b' else data, entry['dtype'])


# pages


BLOCKS = frozenset({
    'p', 'h1', 'h2', 'h3', 'li', 'dt', 'dd', 'tr', 'caption', 'figcaption', 'summary', 'pre',
    'div', 'section', 'label', 'legend', 'fieldset',
})  # fmt: skip
UNSEEN = frozenset({'script', 'style', 'dl.provenance'})
ALIKE = frozenset({'head', 'nav', 'button.theme', 'button.csv', 'a.anchor', 'section#quantities'})
VOID = frozenset({'img', 'input', 'meta', 'br', 'path', 'link'})


class _Reader(HTMLParser):
    """Lines of a page: blocks with the name of their tag and their anchor, a row's cells in one."""

    def __init__(self, page: str, left_out: frozenset[str]):
        super().__init__()
        self._left_out = left_out
        self.lines: list[str] = []
        self._line, self._head = '', ''
        self._open: list[str] = []  # elements that are left out, or text as it stands
        self.panels = ''
        self.feed(page)
        self._flush()

    def _flush(self) -> None:
        text = ' '.join(self._line.split()).strip('|‖ ')
        if text:
            self.lines.append(f'{self._head} {text}'.strip())
        self._line, self._head = '', ''

    def handle_starttag(self, tag, attributes):
        about = {name: value or '' for name, value in attributes}
        names = {tag, f'{tag}.{about.get("class")}', f'{tag}#{about.get("id")}'}
        if self._open:
            self._open += [tag] if tag not in VOID else []
            return
        if names & self._left_out or about.get('id') == 'panel-data':
            self._open.append(f'{tag}#panel-data' if about.get('id') == 'panel-data' else tag)
            return
        if tag in BLOCKS:
            self._flush()
            self._head = tag if tag not in ('tr', 'div', 'section') else ''
        if about.get('id'):
            self._line += f'#{about["id"]} '
        if tag in ('td', 'th'):
            self._line += ' ‖ ' if tag == 'th' else ' | '
        looks = {*about.get('class', '').split()} - {'n', 'text'}
        if looks and (tag in ('td', 'th', 'tr') or 'badge' in looks):
            self._line += f'[{" ".join(sorted(looks))}] '
        if tag == 'img':
            self._line += f' alt: {about["alt"].partition(". ")[0]}. '
        for name in ('href', 'value', 'style', 'stroke-dasharray', 'colspan'):
            self._line += f' {name}={about[name]} ' if name in about and tag != 'meta' else ''

    def handle_endtag(self, tag):
        if self._open:
            self._open.pop()
        elif tag in BLOCKS:
            self._flush()

    def handle_data(self, data):
        if self._open:
            self.panels += data if self._open[0].endswith('#panel-data') else ''
        elif self._head == 'pre':
            lines = data.splitlines()
            self._line += f'{len(lines)} lines, first: {lines[0] if lines else ""}'
        else:
            self._line += data


def frame_lines(page: str) -> Iterator[str]:
    """What is alike on all pages: head, links to the sections, buttons, the list of quantities."""
    own = {*page_lines(page, panels=False)}
    yield from (line for line in _Reader(page, UNSEEN).lines if line not in own)


def page_lines(page: str, *, panels: bool) -> Iterator[str]:
    """Sections, sentences, tables and captions of a page, and its panels where asked for."""
    reader = _Reader(page, UNSEEN | ALIKE)
    yield from reader.lines
    if panels:
        text = zlib.decompress(base64.b64decode(reader.panels)).decode()
        yield from panel_lines(json.loads(text))


# files beside a page


def document_lines(found: Any, path: str = '') -> Iterator[str]:
    """A JSON document, objects without others in one line, the first and the last of a list."""
    if isinstance(found, dict):
        inner = {key: value for key, value in found.items() if _holds_objects(value)}
        flat = [f'{key} {_leaf(value)}' for key, value in found.items() if key not in inner]
        yield from [f'{path or "/"}: {", ".join(flat)}'] if flat else []
        for key, value in inner.items():
            yield from document_lines(value, f'{path}/{key}')
    else:
        for i in sorted({0, len(found) - 1}):
            yield from document_lines(found[i], f'{path}/{i + 1} of {len(found)}')


def _holds_objects(value: Any) -> bool:
    return isinstance(value, dict) or (
        isinstance(value, list) and bool(value) and all(isinstance(one, dict) for one in value)
    )


def _leaf(value: Any) -> str:
    try:
        numbers = np.array(value, float) if isinstance(value, list) and value else None
    except (TypeError, ValueError):
        numbers = None
    if numbers is not None:
        return f'{"x".join(map(str, numbers.shape))} {digest(numbers)}'
    if isinstance(value, float):
        return _number(value, 0.0)
    return str(value)


def parquet_lines(path: Path) -> Iterator[str]:
    """Rows of a Parquet file, and what is in each column."""
    table = parquet.read_table(path)
    yield f'{path.name}: {table.num_rows} rows, {", ".join(table.column_names)}'
    for name, found in zip(table.column_names, table.columns, strict=True):
        column = found.combine_chunks().flatten() if pa.types.is_list(found.type) else found
        if pa.types.is_string(column.type):
            words = [*dict.fromkeys(map(str, column.to_pylist()))]
            few = len(words) <= FEW
            yield f'  {name} {", ".join(words if few else [words[0], "…", words[-1]])}'
        elif len(column):
            yield f'  {name} {digest(column.cast(pa.float64(), safe=False).to_numpy())}'
