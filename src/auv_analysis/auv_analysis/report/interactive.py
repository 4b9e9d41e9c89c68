"""The interactive part of a report's page: packed lines, models of the panels, scripts."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

from auv_analysis.metrics.summary import TRANSIENT
from auv_analysis.report.packing import Packer, packed
from auv_analysis.report.panel import Panel, PanelLine, PanelSet
from auv_analysis.report.panel_models import DASHES, model
from auv_analysis.report.panels import panel_sets
from auv_analysis.report.plotting import COLOURS
from auv_analysis.report.sketch import Sketch
from auv_analysis.report.traces import COLUMNS, Line, broken, thinned
from auv_analysis.scenario.fault_words import Mark
from auv_dynamics.vehicle import DOFS

POINTS = 300_000  # of all panels together, at most 1.3 MB of the page
FEWEST = 200  # columns of pixels that a line keeps however many lines there are
HERE = Path(__file__).parent
KINDS = {'line': ('line',), 'log': ('log',), 'both': ('line', 'log'), 'stack': ('stack',)}
SCRIPTS = ('panel_data.js', 'panel_view.js', 'panels.js')


@dataclass(frozen=True)
class Interactive:
    """Panels of a report, ready for its template.

    Attributes
    ----------
    sets : section -> its panels
    runs : names of the runs, each with the dashes of its lines, px
    data : packed lines
    index : packed JSON: models, axes, which line is where
    library : source of BokehJS
    scripts : ours
    start, end : of the time axis, s
    faults : what is shaded, in words
    dofs : degree of freedom -> colour
    transient : length of the first phase, s

    """

    sets: dict[str, PanelSet]
    runs: dict[str, str]
    data: str
    index: str
    library: str
    scripts: str
    start: float
    end: float
    faults: str

    dofs: ClassVar = dict(zip(DOFS, COLOURS, strict=True))
    transient: ClassVar = TRANSIENT


def interactive(runs: Mapping[str, Sketch]) -> Interactive:
    """Panels of some runs with all that a page needs to show them.

    Parameters
    ----------
    runs : name -> sketch; one at least

    """
    from bokeh.resources import Resources  # loads slowly

    sets = panel_sets(runs)
    panels = [panel for members in sets.values() for panel in members.panels]
    names, packer = list(runs), Packer()
    marks = _marks(runs)
    columns = _columns(panels)
    start = min(run.start for run in runs.values())
    end = max(run.start + run.duration for run in runs.values())
    index: dict[str, Any] = {
        'panels': {panel.name: _entry(panel, packer, columns) for panel in panels},
        'models': {name: model(*form, marks) for name, form in _forms(panels).items()},
        'axes': packer.axes,
        'runs': {name: DASHES[i % len(DASHES)] for i, name in enumerate(names)},
        'start': start,
        'end': end,
    }
    return Interactive(
        sets=sets,
        runs={name: ' '.join(map(str, dash)) for name, dash in index['runs'].items()},
        data=packer.packed(),
        index=packed(json.dumps(index, allow_nan=False).encode()),
        library='\n'.join(Resources(mode='inline', components=['bokeh']).js_raw),
        scripts='\n'.join((HERE / name).read_text(encoding='utf-8') for name in SCRIPTS),
        start=start,
        end=end,
        faults='; '.join(f'{mark.number} {mark.label}, {mark.times}' for mark in marks),
    )


def _marks(runs: Mapping[str, Sketch]) -> tuple[Mark, ...]:
    """Faults that all runs have."""
    of_each = {run.faults for run in runs.values()}
    return next(iter(of_each)) if len(of_each) == 1 else ()


def _columns(panels: list[Panel]) -> int:
    """Columns of pixels in which lines are thinned, so that all of them stay within `POINTS`."""
    points = sum(len(line.line[0]) for panel in panels for line in panel.lines)
    return COLUMNS if points <= POINTS else max(FEWEST, COLUMNS * POINTS // points)


def _forms(panels: list[Panel]) -> dict[str, tuple[int, str]]:
    """Name -> number of lines and kind, of the models that panels need."""
    forms = {(len(panel.lines), kind) for panel in panels for kind in KINDS[panel.kind]}
    return {f'{kind} {lines}': (lines, kind) for lines, kind in sorted(forms)}


def _entry(panel: Panel, packer: Packer, columns: int) -> dict[str, Any]:
    return {
        'label': panel.label,
        'unit': panel.unit,
        'kinds': KINDS[panel.kind],
        'keys': [asdict(key) for key in panel.keys],
        'lines': [_packed_line(line, packer, columns) for line in panel.lines],
    }


def _packed_line(line: PanelLine, packer: Packer, columns: int) -> dict[str, Any]:
    t, y = broken(_thinned(line.line, columns), line.gaps, line.step)
    return {
        'run': line.run,
        'key': line.key,
        'axis': packer.add_axis(t, line.step),
        'at': packer.add_values(y),
    }


def _thinned(line: Line, columns: int) -> Line:
    t, y = line
    if columns == COLUMNS or len(t) <= 2 * columns:
        return t, y
    return thinned(t, y, t[0], t[-1], columns=columns)
