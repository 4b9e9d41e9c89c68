"""Figures of a sweep: distributions, what matters, combinations of two paths, failures, indices."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from auv_analysis.metrics.measures import BY_NAME, Measure
from auv_analysis.output.text import join, plain, typeset
from auv_analysis.report import plots
from auv_analysis.report.plots import (
    COLOURS,
    GREY,
    FigureRecord,
    Grid,
    draw_grid,
    heat_map,
    save_figures,
    scale_bar,
    small_heads,
)
from auv_analysis.studies.compare.plots import look
from auv_analysis.studies.sweep.analysis import SAMPLE, Results, Row
from auv_analysis.studies.sweep.factors import Varied, cut, short_names, with_unit

ACROSS = 3  # panels in a row
MOST_PATHS = 6  # whose dependence is drawn
MOST_GRIDS = 3  # controllers side by side
LETTERS = 'abcd'  # of grids side by side
WIDE = 30.0  # ratio from which an axis is logarithmic
WIDTH = 0.6  # of the bars of all controllers at one value
Drawn = tuple[Figure, str, str]
PREFERRED = (
    'overall.velocity_error.settling_time',
    'overall.velocity_error.rms.linear',
    'overall.velocity_error.rms.angular',
    'kinetic_energy.mean',
    'overall.effort.rms.linear',
    'overall.coupling.delta_xi_max.angular',
)


def draw(results: Results, folder: Path) -> dict[str, FigureRecord]:
    """Draw the figures that the rows of a sweep allow, as PNG and PDF: name -> figure.

    Parameters
    ----------
    results : of `analysed`
    folder : where the files go; made when it is not there

    """
    chosen, tables = main_measures(results), results.tables
    drawn: dict[str, Callable[[], Drawn]] = {}
    if results.measures:
        drawn['distributions'] = partial(_distributions, results)
    if tables['influence']:
        drawn['influence'] = partial(_influence, results)
    if tables['dependence']:
        for i, varied in enumerate(results.most_influential()[:MOST_PATHS], start=1):
            drawn[f'dependence_{i}'] = partial(dependence, results, varied, chosen)
    if tables['together']:
        drawn['together'] = partial(together, results, chosen[:2])
    if tables['failures']:
        drawn['failures'] = partial(failures, results)
    methods = {row['method'] for row in tables['indices']}
    if 'sobol' in methods:
        drawn['total_indices'] = partial(total_indices, results)
    if 'morris' in methods:
        drawn['elementary_effects'] = partial(effects, results, chosen)
    return save_figures(folder, drawn)


def main_measures(results: Results, count: int = 6) -> list[Measure]:
    """The measures that are drawn where there is no room for all: settling and errors first."""
    order = {name: i for i, name in enumerate(PREFERRED)}
    ranked = sorted(results.measures, key=lambda m: order.get(m.name, len(order)))
    return ranked[:count]


def logarithmic(axes: Axes, direction: str, values: np.ndarray) -> None:
    """Logarithmic axis where all values are positive and far apart."""
    known = values[np.isfinite(values)]
    if len(known) and known.min() > 0 and known.max() > WIDE * known.min():
        axes.set(**{f'{direction}scale': 'log'})


def _distributions(results: Results) -> Drawn:
    down = -(-len(results.measures) // 4)
    figure = plots.new_figure(0.4 + 1.75 * down)
    panels = figure.subplots(down, 4, squeeze=False, sharey=True).ravel()
    controllers = results.sweep.controllers
    for axes, measure in zip(panels, results.measures, strict=False):
        shown = []
        for i, controller in enumerate(controllers):
            x, y = results.lines[measure.name, controller]
            axes.plot(x, y, drawstyle='steps-post', label=controller, **look(i))
            shown.append(x)
        logarithmic(axes, 'x', np.concatenate(shown))
        axes.set_title(measure.label, loc='left', fontsize='medium')
        axes.set_xlabel(measure.unit, fontsize='medium')
        axes.tick_params(labelsize='small')
        axes.set_ylim(0, 102)
        axes.margins(x=0.05)
    for axes in panels[len(results.measures) :]:
        axes.set_axis_off()
    for axes in panels[::4]:
        axes.set_ylabel('rows (%)')
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc='outside upper right', ncols=6, handlelength=2.6)
    title = 'Distributions'
    caption = (
        f'{title} of the measures over the rollouts of each controller: the share of rows at or '
        'below a value. Where a line of settling times ends below 100 %, the rest never settled.'
    )
    return figure, title, caption + fixed_sentence(results)


def fixed_sentence(results: Results) -> str:
    """Which measures are the same in every row, or have no value."""
    from auv_analysis.metrics.measures import BY_NAME

    zero = [BY_NAME[name].label for name, value in results.fixed.items() if value == 0.0]
    same = [BY_NAME[name].label for name, value in results.fixed.items() if value]
    none = [BY_NAME[name].label for name, value in results.fixed.items() if value is None]
    parts = [
        f'{word}: {join(labels)}.'
        for word, labels in (
            ('Zero in every row and not drawn', zero),
            ('The same in every row', same),
            ('Without a value in any row', none),
        )
        if labels
    ]
    return ' '.join(['', *parts])


def _influence(results: Results) -> Drawn:
    paths = [v.path for v in results.most_influential()]
    names = short_names(results.varied)
    grids = []
    for controller in results.sweep.controllers[:MOST_GRIDS]:
        cells = {
            (row['figure'], row['path']): row['explained_percent']
            for row in results.tables['influence']
            if row['controller'] == controller
        }
        values = [[cells.get((m.name, path), np.nan) for path in paths] for m in results.measures]
        grids.append(
            Grid(
                np.array(values),
                [names[path] for path in paths],
                f'{controller}: explained (%)',
                'Blues',
                Normalize(0.0, 100.0),
                decimals=0,
            )
        )
    figure = heat_map([m.label for m in results.measures], grids)
    small_heads(figure, grids)
    title = 'What matters'
    caption = (
        f'{title}: share of the variance of the ranks of a figure that lies between the groups of '
        'a path (bins of a number, or its values), corrected for their number; the paths in the '
        'order of their mean share. A pale 0: no more than chance; crossed out: of another '
        'controller.'
    )
    left = results.sweep.controllers[MOST_GRIDS:]
    if left:
        caption += f' {join(left)}: in influence.parquet.'
    return figure, title, caption


def dependence(
    results: Results, varied: Varied, measures: Sequence[Measure]
) -> tuple[Figure, str, str]:
    """Quantiles of measures in the groups of a path. Returns figure, title and caption."""
    down = -(-len(measures) // ACROSS)
    figure = plots.new_figure(0.5 + 1.95 * down)
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
    figure.supxlabel(name, fontsize='medium')
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
    axes.set_title(measure.label, loc='left', fontsize='medium')
    axes.set_ylabel(measure.unit, fontsize='medium')
    axes.tick_params(labelsize='small')
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
    figure = heat_map([BY_NAME[name].label for name in figures], grids)
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
    figure = plots.new_figure(0.5 + 2.0 * down)
    panels = figure.subplots(down, ACROSS, squeeze=False).ravel()
    for axes, measure in zip(panels, shown, strict=False):
        mine = [row for row in rows if row['figure'] == measure.name]
        for row in mine:
            style = look(paths.index(row['path']))
            marker = 'os^vPX'[controllers.index(row['controller']) % 6]
            axes.plot(row['mu_star'], row['sigma'], marker, color=style['color'], markersize=5)
        ends = [0.0, max((row['mu_star'] for row in mine), default=1.0) * 1.1]
        axes.plot(ends, ends, color=plots.GREY, linewidth=0.7, linestyle=(0, (1, 2)))
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


def together(results: Results, measures: Sequence[Measure]) -> Drawn:
    """Medians over the two paths that matter most: a row of panels per measure."""
    controllers = [
        name
        for name in results.sweep.controllers
        if any(row['controller'] == name for row in results.tables['together'])
    ][:MOST_GRIDS]
    figure = plots.new_figure(0.5 + 2.6 * len(measures))
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
            axes.set_title(f'{controller}: {measure.label}', loc='left', pad=22, fontsize='medium')
            axes.set_ylabel(names[first.path])
            axes.set_xlabel(names[second.path])
            axes.xaxis.set_label_position('bottom')
            scale_bar(figure, axes.images[0], measure.unit, ax=axes, fraction=0.05)
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
    figure = plots.new_figure(0.5 + 2.2 * down)
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
        axes.set_title(names[path], loc='left', fontsize='medium')
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
