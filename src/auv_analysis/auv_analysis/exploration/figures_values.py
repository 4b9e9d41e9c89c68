"""Figures of a sweep over its values: two paths together, and where rows fail."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from auv_analysis.exploration.names import cut, short_names
from auv_analysis.exploration.results import Results, Row
from auv_analysis.measures import Measure
from auv_analysis.report import plotting
from auv_analysis.report.grids import Grid, draw_grid
from auv_analysis.report.plotting import COLOURS, GREY
from auv_analysis.report.text import typeset

MOST_GRIDS = 3  # controllers side by side
Drawn = tuple[Figure, str, str]


def together(results: Results, measures: Sequence[Measure]) -> Drawn:
    """Medians over the two paths that matter most: a row of panels per measure."""
    controllers = [
        name
        for name in results.sweep.controllers
        if any(row['controller'] == name for row in results.tables['together'])
    ][:MOST_GRIDS]
    figure = plotting.new_figure(0.5 + 2.6 * len(measures))
    panels = figure.subplots(len(measures), len(controllers), squeeze=False)
    first, second = results.pair
    names = short_names(results.varied)
    for measure, row in zip(measures, panels, strict=True):
        medians = [c['median'] for c in results.tables['together'] if c['figure'] == measure.name]
        known = np.array([m for m in medians if m is not None])
        scale = Grid(known, (), '').norm()
        for controller, axes in zip(controllers, row, strict=True):
            cells = [
                cell
                for cell in results.tables['together']
                if (cell['controller'], cell['figure']) == (controller, measure.name)
            ]
            _one_pair(axes, cells, measure.label, scale)
            axes.set_title(f'{controller}: {measure.label}', loc='left', pad=22, fontsize=8.5)
            axes.set_ylabel(names[first.path])
            axes.set_xlabel(names[second.path])
            axes.xaxis.set_label_position('bottom')
            figure.colorbar(axes.images[0], ax=axes, label=measure.unit, fraction=0.05)
    title = 'The two paths that matter most'
    caption = (
        f'{title}, together: median of the rows of each combination of {first.path} and '
        f'{second.path}, over whatever else varies; one scale for all controllers; crossed out: '
        'none, or more than half never settle.'
    )
    return figure, title, caption


def _one_pair(axes: Axes, cells: Sequence[Row], label: str, scale: Normalize) -> None:
    down = list(dict.fromkeys(cell['value'] for cell in cells))
    across = list(dict.fromkeys(cell['other_value'] for cell in cells))
    values = np.array([np.nan if c['median'] is None else c['median'] for c in cells])
    values = values.reshape(len(down), len(across))
    heads = [typeset(cut(word)) for word in across]
    draw_grid(axes, Grid(values, heads, label, scale=scale), 6.0)
    axes.set_yticks(range(len(down)), [typeset(cut(word)) for word in down])
    axes.tick_params(labelsize=7)
    if len(across) > 4:
        axes.tick_params(axis='x', labelrotation=60)


def failures(results: Results) -> Drawn:
    """Shares of diverged and refused rows along each path, of all controllers together."""
    paths = list(dict.fromkeys(row['path'] for row in results.tables['failures']))
    names = short_names(results.varied)
    across = min(len(paths), 3)
    down = -(-len(paths) // across)
    figure = plotting.new_figure(0.5 + 2.2 * down)
    panels = figure.subplots(down, across, squeeze=False).ravel()
    for axes, path in zip(panels, paths, strict=False):
        rows = [row for row in results.tables['failures'] if row['path'] == path]
        labels = list(dict.fromkeys(row['value'] for row in rows))
        counts = {label: [r for r in rows if r['value'] == label] for label in labels}
        bottom = np.zeros(len(labels))
        for word, colour in (('diverged', COLOURS[4]), ('refused', GREY)):
            share = np.array([
                100 * sum(r[word] for r in group) / max(sum(r['rows'] for r in group), 1)
                for group in counts.values()
            ])  # fmt: skip
            axes.bar(range(len(labels)), share, bottom=bottom, color=colour, label=word)
            bottom += share
        heads = [typeset(cut(label)) for label in labels]
        axes.set_xticks(range(len(labels)), heads, rotation=90, fontsize=7)
        axes.set_title(names[path], loc='left', fontsize=8.5)
        axes.grid(axis='x', visible=False)
    for axes in panels[::across]:
        axes.set_ylabel('rows (%)')
    for axes in panels[len(paths) :]:
        axes.set_axis_off()
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc='outside upper right', ncols=2)
    title = 'Where it fails'
    caption = (
        f'{title}: share of the rows that diverged or were refused, over the values of each path, '
        'all controllers together; of each one in failures.parquet.'
    )
    return figure, title, caption
