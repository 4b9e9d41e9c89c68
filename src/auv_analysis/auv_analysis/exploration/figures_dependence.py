"""How the main figures depend on one path: bands over a number, bars over what may be chosen."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from auv_analysis.comparison.lines import look
from auv_analysis.exploration.names import cut, short_names, with_unit
from auv_analysis.exploration.results import SAMPLE, Results, Row
from auv_analysis.exploration.varied import Varied
from auv_analysis.measures import Measure
from auv_analysis.report import plotting
from auv_analysis.report.text import typeset

MOST_PATHS = 6
ACROSS = 3
WIDE = 30.0  # ratio from which an axis is logarithmic
WIDTH = 0.6  # of the bars of all controllers at one value


def dependence(
    results: Results, varied: Varied, measures: Sequence[Measure]
) -> tuple[Figure, str, str]:
    """Quantiles of measures in the groups of a path. Returns figure, title and caption."""
    down = -(-len(measures) // ACROSS)
    figure = plotting.new_figure(0.5 + 1.95 * down)
    panels = figure.subplots(down, ACROSS, squeeze=False).ravel()
    controllers = [name for name in results.sweep.controllers if varied.concerns(name)]
    for axes, measure in zip(panels, measures, strict=False):
        for i, controller in enumerate(controllers):
            rows = [
                row
                for row in results.tables['dependence']
                if (row['controller'], row['path'], row['figure'])
                == (controller, varied.path, measure.name)
            ]
            style = look(results.sweep.controllers.index(controller))
            if varied.binned:
                _points(axes, results, varied, measure, controller)
                _bands(axes, rows, style)
            else:
                _bars(axes, rows, style, (i + 0.5) / len(controllers) - 0.5)
        _finish(axes, varied, measure)
    for axes in panels[len(measures) :]:
        axes.set_axis_off()
    name = with_unit(short_names(results.varied)[varied.path], varied)
    figure.supxlabel(name, fontsize=9.5)
    handles = [panels[0].plot([], [], **look(results.sweep.controllers.index(c)))[0]
               for c in controllers]  # fmt: skip
    figure.legend(handles, controllers, loc='outside upper right', ncols=6, handlelength=2.6)
    title = f'Dependence on {varied.path}'
    caption = (
        f'{title}{f" ({varied.meaning})" if varied.meaning else ""}: median, '
        'middle half and 5–95 % of the rows, over whatever else varies; a time that does not exist '
        'counts as late, and what lies there is not drawn.'
    )
    if varied.binned:
        caption += f' Points: at most {SAMPLE} rows of each controller.'
    return figure, title, caption


def _array(rows: Sequence[Row], name: str) -> np.ndarray:
    return np.array([np.nan if row[name] is None else row[name] for row in rows], float)


def _bands(axes: Axes, rows: Sequence[Row], style: dict[str, Any]) -> None:
    x, colour = _array(rows, 'middle'), style['color']
    for low, high, alpha in (('low', 'high', 0.14), ('quarter', 'three_quarters', 0.24)):
        axes.fill_between(x, _array(rows, low), _array(rows, high), color=colour, alpha=alpha,
                          linewidth=0)  # fmt: skip
    axes.plot(x, _array(rows, 'median'), **style)


def _points(
    axes: Axes, results: Results, varied: Varied, measure: Measure, controller: str
) -> None:
    rows = results.rows_of(controller)
    rows = rows[:: max(len(rows) // SAMPLE, 1)][:SAMPLE]
    if varied.numbers is not None:
        colour = look(results.sweep.controllers.index(controller))['color']
        axes.plot(varied.numbers[rows], results.values[measure.name][rows], '.', color=colour,
                  markersize=2, alpha=0.35, markeredgewidth=0, rasterized=True)  # fmt: skip


def _bars(axes: Axes, rows: Sequence[Row], style: dict[str, Any], offset: float) -> None:
    x = np.arange(len(rows)) + WIDTH * offset
    colour = style['color']
    axes.vlines(x, _array(rows, 'low'), _array(rows, 'high'), color=colour, linewidth=1.0)
    middle = _array(rows, 'quarter'), _array(rows, 'three_quarters')
    axes.vlines(x, *middle, color=colour, linewidth=4.0, alpha=0.5)
    axes.plot(x, _array(rows, 'median'), 'o', color=colour, markersize=4)


def _finish(axes: Axes, varied: Varied, measure: Measure) -> None:
    axes.set_title(measure.label, loc='left', fontsize=8.5)
    axes.set_ylabel(measure.unit, fontsize=8.5)
    axes.tick_params(labelsize=7.5)
    axes.margins(x=0.03, y=0.08)
    if varied.binned and varied.numbers is not None:
        low, high = varied.numbers.min(), varied.numbers.max()
        if low > 0 and high > WIDE * low:
            axes.set_xscale('log')
    else:
        labels = [typeset(cut(label)) for label in varied.labels]
        axes.set_xticks(range(len(labels)), labels)
        axes.set_xlim(-0.6, len(labels) - 0.4)
        if sum(map(len, labels)) > 20:
            axes.tick_params(axis='x', labelrotation=60)
    low, high = axes.dataLim.intervaly
    if low > 0 and high > WIDE * low:
        axes.set_yscale('log')
