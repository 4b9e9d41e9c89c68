"""Interactive panels over time: Bokeh figures of all controllers that share one time axis."""

import base64
import json
import math
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from auv_analysis.metrics.quantities import SIGNALS
from auv_analysis.metrics.settling import TRANSIENT
from auv_analysis.report.digest import ESTIMATES, RunDigest
from auv_analysis.report.plots import COLOURS, GREY, moving, unrecorded
from auv_analysis.report.traces import broken, thinned
from auv_analysis.scenario.fault_words import Mark, line_of
from auv_dynamics.vehicle import DOFS

INK, BOUND, IDENTITY = '#1a1a1a', '#D55E00', '#56B4E9'
FAULT = '#e69f00'
HEIGHT = 215  # px
THIN, LINE, WIDE = 1.0, 1.6, 3.0  # px, widths of lines
LEFT = 58  # px, so that the time axes of all panels lie above each other
POINTS = 300_000  # of all panels together, so that a page stays small
FEWEST = 200  # px across, in which a line is drawn however many lines there are
DASHES: tuple[list[int], ...] = ([], [7, 3], [2, 2], [10, 2, 2, 2], [15, 4], [5, 2, 2, 2, 2, 2])
HERE = Path(__file__).parent
GROUPS = {'linear': range(3), 'angular': range(3, 6)}
SECTIONS = {  # part of the report -> its signals, beginnings of the figures its panels stand for
    'errors': (('error',), ('errors_',)),
    'estimates': (('lumped_error', 'F', *ESTIMATES), ('lumped_error_', 'uncertainty_')),
    'inputs': (('tau', 'applied'), ('inputs_', 'compared_inputs')),
    'certificates': ((), ('certificate_',)),
    'energy': (('energy',), ('kinetic_energy',)),
    'couplings': (('delta_xi', 'delta_pi'), ('delta_xi', 'delta_pi')),
}


@dataclass(frozen=True, eq=False)
class TimeCurve:
    """A line of a run: its degree of freedom or what it is, colour, times and values (n,).

    It breaks at some times, s.
    """

    run: str
    key: str
    colour: str
    t: np.ndarray
    y: np.ndarray
    width: float = LINE
    breaks: Sequence[float] = ()

    @property
    def dof(self) -> str:
        """Its degree of freedom; '' of a line that has none."""
        return self.key if self.key in DOFS else ''


@dataclass(frozen=True, eq=False)
class TimePanel:
    """One pair of axes over time: 'line', 'log' with a logarithmic vertical axis, or 'stack'."""

    name: str
    title: str
    label: str
    curves: tuple[TimeCurve, ...]
    kind: Literal['line', 'log', 'stack'] = 'line'


@dataclass(frozen=True)
class PanelSet:
    """Panels of a part of the report, in the place of some figures."""

    panels: tuple[TimePanel, ...]
    figures: tuple[str, ...]

    def stands_for(self, figure: str) -> bool:
        """Whether these panels show what the figure of that name shows."""
        return figure.startswith(self.figures)


@dataclass(frozen=True)
class Interactive:
    """Panels of a report, ready for its template.

    Attributes
    ----------
    sets : part of the report -> its panels
    runs : name of a run -> dashes of its lines, px
    data : Bokeh's document, deflated, in Base64: nothing in it is read as HTML
    library, script : source of BokehJS, and ours
    faults : what is shaded, in words
    start, end : of the time axis, s
    dofs : degree of freedom -> colour

    """

    sets: Mapping[str, PanelSet]
    runs: Mapping[str, str]
    data: str
    library: str
    script: str
    faults: str
    start: float
    end: float
    dofs: Mapping[str, str] = field(default_factory=lambda: dict(zip(DOFS, COLOURS, strict=True)))
    transient: float = TRANSIENT


def interactive(runs: Mapping[str, RunDigest]) -> Interactive:
    """Panels of some runs with all that a page needs to show them; one run at least."""
    sets = panel_sets(runs)
    marks = _marks(runs)
    start = min(run.start for run in runs.values())
    end = max(run.start + run.duration for run in runs.values())
    dashes = {name: DASHES[i % len(DASHES)] for i, name in enumerate(runs)}
    panels = [panel for members in sets.values() for panel in members.panels]
    return Interactive(
        sets=sets,
        runs={name: ' '.join(map(str, dash)) for name, dash in dashes.items()},
        data=packed(json.dumps(document(panels, dashes, marks, (start, end)), allow_nan=False)),
        library=library(),
        script=(HERE / 'panels.js').read_text(encoding='utf-8'),
        faults='; '.join(f'{mark.number} {mark.label}, {mark.times}' for mark in marks),
        start=start,
        end=end,
    )


def library() -> str:
    """BokehJS, which draws the panels."""
    from bokeh.resources import Resources  # loads slowly

    return '\n'.join(Resources(mode='inline', components=['bokeh']).js_raw)


def packed(text: str) -> str:
    """A text, deflated, in Base64."""
    return base64.b64encode(zlib.compress(text.encode(), 9)).decode('ascii')


def _marks(runs: Mapping[str, RunDigest]) -> tuple[Mark, ...]:
    """Faults that all runs have."""
    of_each = {run.faults for run in runs.values()}
    return next(iter(of_each)) if len(of_each) == 1 else ()


def document(
    panels: Sequence[TimePanel],
    dashes: Mapping[str, list[int]],
    faults: Sequence[Mark],
    ends: tuple[float, float],
) -> list[Any]:
    """Bokeh's JSON of a document, and names of its roots: a figure per panel, ranges shared."""
    from bokeh.core.property.validation import validate  # loads slowly
    from bokeh.document import Document
    from bokeh.models import CrosshairTool, Range1d
    from bokeh.models.annotations import Span

    time = Range1d(start=ends[0], end=ends[1], bounds=ends)
    cursor = CrosshairTool(overlay=Span(dimension='height', line_dash=[3, 3], line_color=GREY))
    found = Document()
    columns = _columns(panels)
    # else all models are collected anew at every figure, and every value is checked
    with found.models.freeze(), validate(False):
        for panel in panels:
            plot = _figure(panel, dashes, columns, time)
            plot.add_tools(cursor)
            for mark in faults:
                _shade(plot, mark, faults)
            found.add_root(plot)
    roots = {str(plot.name): plot.id for plot in found.roots}
    return [found.to_json(deferred=False), roots]


def _columns(panels: Sequence[TimePanel]) -> int:
    """Columns of pixels in which lines are thinned, so that all of them stay within `POINTS`."""
    points = sum(len(curve.t) for panel in panels for curve in panel.curves)
    longest = max((len(curve.t) for panel in panels for curve in panel.curves), default=FEWEST)
    return longest if points <= POINTS else max(FEWEST, longest // 2 * POINTS // points)


def _figure(panel: TimePanel, dashes: Mapping[str, list[int]], columns: int, time: Any) -> Any:
    from bokeh.models import HoverTool
    from bokeh.models.annotations import Legend
    from bokeh.plotting import figure

    plot: Any = figure(
        name=panel.name, height=HEIGHT, sizing_mode='stretch_width', x_range=time,
        y_axis_type='log' if panel.kind == 'log' else 'linear', y_axis_label=panel.label,
        tools='xpan,xbox_zoom,xwheel_zoom,reset', active_drag='xbox_zoom', active_scroll=None,
        toolbar_location='right', min_border_left=LEFT, window_axis='x', lod_threshold=None,
        background_fill_color=None, border_fill_color=None, outline_line_color=None,
    )  # fmt: skip
    plot.toolbar.autohide = True
    plot.add_layout(Legend(orientation='horizontal', ncols=3, click_policy='hide'), 'above')
    plot.legend.update(
        label_text_font_size='10px', padding=2, spacing=6, glyph_height=8, glyph_width=18,
        label_height=8, border_line_color=None, background_fill_alpha=0.0,
    )  # fmt: skip
    _draw(plot, panel, dashes, columns)
    if panel.kind != 'stack':
        plot.y_range.only_visible = True
        shown: dict[str, Any] = {'tooltips': [('$name', '$snap_y{%.4g}')]}
        shown |= {'formatters': {'$snap_y': 'printf'}, 'line_policy': 'nearest'}
        plot.add_tools(HoverTool(mode='vline', **shown))
    for axis in (plot.xaxis, plot.yaxis):
        axis.axis_label_text_font_style = 'normal'
        axis.axis_label_text_font_size = '11px'
        axis.minor_tick_line_color = None
    return plot


def _draw(plot: Any, panel: TimePanel, dashes: Mapping[str, list[int]], columns: int) -> None:
    from bokeh.core.property.vectorization import value
    from bokeh.models import ColumnDataSource, Line, VArea
    from bokeh.models.annotations import LegendItem

    sources: dict[bytes, Any] = {}
    base = np.zeros(1)
    for number, curve in enumerate(panel.curves):
        t, y = curve.t, curve.y
        if panel.kind != 'stack' and len(t) > 2 * columns:
            t, y = thinned(t, y, columns=columns)
        t, y = broken((t, y), curve.breaks)
        times = t.tobytes()
        if times not in sources:
            sources[times] = ColumnDataSource({'t': t.astype(np.float32)})
        source = sources[times]
        at, name = f'y{number}', f'{curve.run} {curve.key}'
        if panel.kind == 'stack':
            below, base = base, base + y
            source.data[f'{at}_below'] = np.broadcast_to(below, y.shape).astype(np.float32)
            source.data[at] = base.astype(np.float32)
            glyph: Any = VArea(x='t', y1=f'{at}_below', y2=at, fill_color=curve.colour)
        else:
            source.data[at] = y.astype(np.float32)
            look: dict[str, Any] = {'line_color': curve.colour, 'line_width': curve.width}
            glyph = Line(x='t', y=at, line_dash=dashes[curve.run], **look)
        # not by plot.line, which makes four glyphs of each that nobody selects or mutes
        drawn = plot.add_glyph(source, glyph, name=name, tags=[curve.run, curve.dof])
        plot.legend.items.append(LegendItem(label=value(name), renderers=[drawn]))


def _shade(plot: Any, mark: Mark, faults: Sequence[Mark]) -> None:
    """Shade a fault, its number on it."""
    from bokeh.models.annotations import BoxAnnotation, Label

    box: Any = BoxAnnotation(left=mark.start, fill_color=FAULT, fill_alpha=0.14, line_color=None)
    box.level = 'underlay'
    if not math.isinf(mark.end):
        box.right = mark.end
    plot.add_layout(box)
    number: dict[str, Any] = {'text': f'{mark.number}', 'text_font_size': '10px', 'x_offset': 3}
    height = 120 - 13 * line_of(mark, faults)
    plot.add_layout(Label(x=mark.start, y=height, y_units='screen', **number))


def panel_sets(runs: Mapping[str, RunDigest]) -> dict[str, PanelSet]:
    """Panels of all runs by part of the report; no set is without panels."""
    sets = {}
    for name, (signals, figures) in SECTIONS.items():
        panels = [panel for signal in signals for panel in _six_signals(signal, runs)]
        if name == 'certificates':
            panels = list(_certificates(runs))
        elif name == 'energy':
            panels = [*_kinetic(runs), *_shares(runs), *panels]
        if panels:
            sets[name] = PanelSet(tuple(panels), figures)
    return sets


def different_disturbances(runs: Mapping[str, RunDigest]) -> dict[str, RunDigest]:
    """Runs with a known F that no run before them has."""
    kept: dict[bytes, str] = {}
    for name, run in runs.items():
        if run.knows_disturbance:
            kept.setdefault(run.F_digest, name)
    return {name: runs[name] for name in kept.values()}


def _with(signal: str, runs: Mapping[str, RunDigest]) -> Mapping[str, RunDigest]:
    """Runs that have a signal worth a line."""
    if signal == 'F':
        return different_disturbances(runs)
    there = {name: run for name, run in runs.items() if signal in run.columns}
    if signal == 'lumped_error':
        return {name: run for name, run in there.items() if run.estimates}
    return there


def _six_signals(signal: str, runs: Mapping[str, RunDigest]) -> Iterator[TimePanel]:
    quantity, there = SIGNALS[signal], _with(signal, runs)
    moved = {i for run in there.values() for i in moving(run.part(signal))}
    for group, members in GROUPS.items():
        curves = [
            _curve(name, run, DOFS[i], COLOURS[i], signal, i)
            for name, run in there.items()
            for i in members
            if i in moved and DOFS[i] not in unrecorded(run.part(signal))
        ]
        if curves:
            title = f'{quantity.label.capitalize()}, {group}'
            label = f'{quantity.label} ({quantity.unit_of(members[0])})'
            yield TimePanel(f'{signal}-{group}', title, label, tuple(curves))


def _certificates(runs: Mapping[str, RunDigest]) -> Iterator[TimePanel]:
    there = {name: run for name, run in runs.items() if ('L', 'whole') in run.traces}
    if not there:
        return
    lines = tuple(_curve(name, run, 'L', INK, 'L') for name, run in there.items())
    yield TimePanel('L', 'Lyapunov function, (23)', 'L (J)', lines, 'log')
    looks = {
        'bound': ('bound (28)', BOUND, LINE),
        'identity': ('identity (26)', IDENTITY, WIDE),
        'L_dot': ('measured', INK, THIN),
    }
    for name, run in there.items():
        curves = tuple(
            _curve(name, run, key, colour, signal, width=width)
            for signal, (key, colour, width) in looks.items()
        )
        yield TimePanel(f'rates-{name}', f'Derivative of L, {name}', 'dL/dt (W)', curves)


def _kinetic(runs: Mapping[str, RunDigest]) -> Iterator[TimePanel]:
    looks = {'wanted': ('of the set-point', GREY, WIDE), 'kinetic': ('of the run', INK, LINE)}
    curves = tuple(
        _curve(name, run, key, colour, signal, width=width)
        for name, run in runs.items()
        for signal, (key, colour, width) in looks.items()
        if (signal, 'whole') in run.traces and not np.isnan(run.part(signal).peak[0])
    )
    if curves:
        yield TimePanel('kinetic', 'Kinetic energy', 'kinetic energy (J)', curves)


def _shares(runs: Mapping[str, RunDigest]) -> Iterator[TimePanel]:
    for name, run in runs.items():
        t, parts = run.shares()
        if len(t):
            curves = tuple(TimeCurve(name, DOFS[i], COLOURS[i], t, parts[:, i]) for i in range(6))
            title = f'Shares of ξ1 to ξ6 in the kinetic energy, {name}'
            yield TimePanel(f'shares-{name}', title, 'share (%)', curves, 'stack')


def _curve(
    name: str,
    run: RunDigest,
    key: str,
    colour: str,
    signal: str,
    column: int = 0,
    width: float = LINE,
) -> TimeCurve:
    """Line over the whole run, of its phases where it is drawn in two."""
    parts = ('whole',) if (signal, 'whole') in run.traces else ('early', 'late')
    lines = [run.line(signal, column, part) for part in parts]
    t, y = (np.concatenate(values) for values in zip(*lines, strict=True))
    return TimeCurve(name, key, colour, t, y, width, run.breaks)
