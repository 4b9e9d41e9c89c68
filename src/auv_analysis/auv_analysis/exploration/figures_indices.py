"""Sensitivity indices as figures: Sobol's total indices as cells, Morris's effects as points."""

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from auv_analysis.comparison.lines import look
from auv_analysis.exploration.names import short_names
from auv_analysis.exploration.results import Results
from auv_analysis.measures import BY_NAME, Measure
from auv_analysis.report import plotting
from auv_analysis.report.grids import Grid, grid_figure, small_heads
from auv_analysis.report.text import plain, typeset

LETTERS = 'abcd'  # of grids side by side
ACROSS = 3
Drawn = tuple[Figure, str, str]


def total_indices(results: Results) -> Drawn:
    """Total indices of Sobol of each measure. Returns figure, title and caption."""
    rows = [r for r in results.tables['indices'] if r['method'] == 'sobol' and r['with'] is None]
    names = short_names(results.varied)
    paths = list(dict.fromkeys(row['path'] for row in rows))
    figures = list(dict.fromkeys(row['figure'] for row in rows))
    cases = list(dict.fromkeys((row['controller'], row['case']) for row in rows))
    grids, said = [], []
    for letter, (controller, case) in zip(LETTERS, cases, strict=False):
        cells = {(row['figure'], row['path']): row['ST'] for row in rows
                 if (row['controller'], row['case']) == (controller, case)}  # fmt: skip
        values = [[cells.get((figure, path)) for path in paths] for figure in figures]
        label = f'({letter}) $S_T$'
        said.append(f'({letter}) {controller}{f", {case}" if case else ""}')
        heads = [names[path] for path in paths]
        known = np.array(values, float)
        grids.append(Grid(known, heads, label, 'Blues', Normalize(0.0, 1.0), decimals=2))
    figure = grid_figure([BY_NAME[name].label for name in figures], grids)
    small_heads(figure, grids)
    title = 'Total sensitivity indices'
    caption = (
        f'{title} of Sobol: the share of the variance of a figure that would be left if all but '
        'this path were known, its interactions included; an estimate may leave 0 to 1. Crossed '
        'out: the figure does not vary, or does not exist in all rows. '
        f'{"; ".join(said)}.'
    )
    if len(cases) > len(LETTERS):
        caption += f' The first {len(LETTERS)} of {len(cases)} cases; all are in indices.parquet.'
    return figure, title, caption


def effects(results: Results, measures: Sequence[Measure]) -> Drawn:
    """Elementary effects of Morris: their mean size and their spread."""
    rows = [row for row in results.tables['indices'] if row['method'] == 'morris']
    shown = [m for m in measures if any(row['figure'] == m.name for row in rows)]
    names, paths = short_names(results.varied), list(dict.fromkeys(row['path'] for row in rows))
    controllers = list(dict.fromkeys(row['controller'] for row in rows))
    down = -(-len(shown) // ACROSS)
    figure = plotting.new_figure(0.5 + 2.0 * down)
    panels = figure.subplots(down, ACROSS, squeeze=False).ravel()
    for axes, measure in zip(panels, shown, strict=False):
        mine = [row for row in rows if row['figure'] == measure.name]
        for row in mine:
            style = look(paths.index(row['path']))
            marker = 'os^vPX'[controllers.index(row['controller']) % 6]
            axes.plot(row['mu_star'], row['sigma'], marker, color=style['color'], markersize=5)
        ends = [0.0, max((row['mu_star'] for row in mine), default=1.0) * 1.1]
        axes.plot(ends, ends, color=plotting.GREY, linewidth=0.7, linestyle=(0, (1, 2)))
        axes.set_title(f'{measure.label} ({measure.unit})', loc='left', fontsize='medium')
        axes.tick_params(labelsize='small')
        axes.margins(0.1)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(lambda x, _: typeset(plain(x, 3)))
    for axes in panels[len(shown) :]:
        axes.set_axis_off()
    figure.supxlabel(r'$\mu^*$: mean size of the effect', fontsize='medium')
    figure.supylabel(r'$\sigma$: its spread', fontsize='medium')
    handles = [panels[0].plot([], [], 'o', color=look(i)['color'])[0] for i in range(len(paths))]
    labels = [names[path] for path in paths]
    for i, controller in enumerate(controllers if len(controllers) > 1 else []):
        handles += panels[0].plot([], [], 'os^vPX'[i % 6], color='black')
        labels.append(controller)
    figure.legend(handles, labels, loc='outside upper center', ncols=4)
    title = 'Elementary effects'
    caption = (
        f'{title} of Morris: how much a figure changes when one path goes through its whole range, '
        'at random values of the others; above the dotted line the effect depends more on the '
        'others than it is large.'
    )
    return figure, title, caption
