"""Plots of a sweep: distributions, sensitivities, dependence on one path and on two, failures."""

from collections.abc import Callable, Mapping, Sequence
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
from auv_analysis.report.plots import COLOURS, GREY, Drawn, FigureRecord, HeatMap, heat_map, look
from auv_analysis.studies.sweep.analysis import SAMPLE, Analysis
from auv_analysis.studies.sweep.dataset import Factor, cut, short_names, with_unit
from auv_analysis.studies.sweep.quantiles import Row, ordered, thinned

MOST_PATHS = 6  # whose dependence is drawn
MOST_GRIDS = 3  # controllers side by side
LETTERS = 'abcd'  # of heat maps side by side
MARKERS = 'os^vPX'  # of controllers
WIDE = 30.0  # ratio from which an axis is logarithmic
WIDTH = 0.6  # of the bars of all controllers at one value
PREFERRED = (
    'overall.velocity_error.settling_time',
    'overall.velocity_error.rms.linear',
    'overall.velocity_error.rms.angular',
    'kinetic_energy.mean',
    'overall.effort.rms.linear',
    'overall.coupling.delta_xi_max.angular',
)


def draw(analysis: Analysis, folder: Path) -> dict[str, FigureRecord]:
    """Draw the plots that the rows of a sweep allow, as PNG and PDF: name -> plot."""
    chosen, tables = main_measures(analysis), analysis.tables
    drawn: dict[str, Callable[[], Drawn]] = {}
    if analysis.measures:
        drawn['distributions'] = partial(_distributions, analysis)
    if tables['influence']:
        drawn['influence'] = partial(_influence, analysis)
    if tables['dependence']:
        for i, factor in enumerate(analysis.most_influential()[:MOST_PATHS], start=1):
            drawn[f'dependence_{i}'] = partial(_dependence, analysis, factor, chosen)
    if tables['together']:
        drawn['together'] = partial(_together, analysis, chosen[:2])
    if tables['failures']:
        drawn['failures'] = partial(_failures, analysis)
    methods = {row['method'] for row in tables['indices']}
    if 'sobol' in methods:
        drawn['total_indices'] = partial(_total_indices, analysis)
    if 'morris' in methods:
        drawn['elementary_effects'] = partial(_effects, analysis, chosen)
    return plots.save_figures(folder, drawn)


def main_measures(analysis: Analysis, count: int = 6) -> list[Measure]:
    """The measures that are drawn where there is no room for all: settling and errors first."""
    order = {name: i for i, name in enumerate(PREFERRED)}
    ranked = sorted(analysis.measures, key=lambda m: order.get(m.name, len(order)))
    return ranked[:count]


def _distributions(analysis: Analysis) -> Drawn:
    measures, controllers = analysis.measures, analysis.sweep.controllers
    looks = {name: look(i) for i, name in enumerate(controllers)}
    figure, panels = plots.small_multiples(len(measures), 4, height=1.75, sharey=True)
    for axes, measure in zip(panels, measures, strict=True):
        values = ordered(analysis.values[measure.name], measure.unit)
        samples = {name: thinned(values[analysis.sweep.finished[name]]) for name in controllers}
        plots.distribution(axes, samples, looks)
        _logarithmic(axes, 'x', np.concatenate(list(samples.values())))
        _head(axes, measure)
        axes.set_xlabel(measure.unit, fontsize='medium')
        axes.margins(x=0.05)
    for axes in panels[::4]:
        axes.set_ylabel('share of rows')
    plots.shared_legend(figure)
    title = 'Distributions'
    caption = (
        f'{title} of the measures over the rollouts of each controller: the share of rows at or '
        'below a value. Where a line of settling times ends below 1, the rest never settled.'
    )
    return figure, title, caption + _fixed(analysis.fixed)


def _fixed(fixed: Mapping[str, float | None]) -> str:
    """Measures that are the same in every row, or have no value."""
    groups = {
        'Zero in every row and not drawn': [n for n, value in fixed.items() if value == 0.0],
        'The same in every row': [n for n, value in fixed.items() if value],
        'Without a value in any row': [n for n, value in fixed.items() if value is None],
    }
    return ''.join(
        f' {word}: {join([BY_NAME[name].label for name in names])}.'
        for word, names in groups.items()
        if names
    )


def _influence(analysis: Analysis) -> Drawn:
    paths = [factor.path for factor in analysis.most_influential()]
    grids = []
    for controller in analysis.sweep.controllers[:MOST_GRIDS]:
        rows = [r for r in analysis.tables['influence'] if r['controller'] == controller]
        label = f'{controller}: explained (%)'
        names = [m.name for m in analysis.measures]
        grids.append(_shares(analysis, rows, names, paths, 'explained_percent', label, 100.0))
    figure = heat_map([m.label for m in analysis.measures], grids)
    _small_heads(figure, grids)
    title = 'What matters'
    caption = (
        f'{title}: share of the variance of the ranks of a measure that lies between the groups of '
        'a path (bins of a number, or its values), corrected for their number; the paths in the '
        'order of their mean share. A pale 0: no more than chance; crossed out: of another '
        'controller.'
    )
    left = analysis.sweep.controllers[MOST_GRIDS:]
    if left:
        caption += f' {join(left)}: in influence.parquet.'
    return figure, title, caption


def _shares(
    analysis: Analysis,
    rows: Sequence[Row],
    measures: Sequence[str],
    paths: Sequence[str],
    key: str,
    label: str,
    whole: float = 1.0,
) -> HeatMap:
    """Heat map of shares: measures by paths."""
    names = short_names(analysis.factors)
    cells = {(row['figure'], row['path']): row[key] for row in rows}
    values = np.array([[cells.get((m, path)) for path in paths] for m in measures], float)
    heads, scale = [names[path] for path in paths], Normalize(0.0, whole)
    return HeatMap(values, heads, label, 'Blues', scale, decimals=0 if whole > 1 else 2)


def _total_indices(analysis: Analysis) -> Drawn:
    """Total Sobol' indices of each measure."""
    rows = [r for r in analysis.tables['indices'] if r['method'] == 'sobol' and r['with'] is None]
    paths = list(dict.fromkeys(row['path'] for row in rows))
    measures = list(dict.fromkeys(row['figure'] for row in rows))
    cases = list(dict.fromkeys((row['controller'], row['case']) for row in rows))
    grids, said = [], []
    for letter, (controller, case) in zip(LETTERS, cases, strict=False):
        mine = [r for r in rows if (r['controller'], r['case']) == (controller, case)]
        grids.append(_shares(analysis, mine, measures, paths, 'ST', f'({letter}) $S_T$'))
        said.append(f'({letter}) {controller}{f", {case}" if case else ""}')
    figure = heat_map([BY_NAME[name].label for name in measures], grids)
    _small_heads(figure, grids)
    title = 'Total sensitivity indices'
    caption = (
        f'{title} of Sobol’: the share of the variance of a measure that would be left if all but '
        'this path were known, its interactions included; an estimate may leave 0 to 1. Crossed '
        f'out: the measure does not vary, or does not exist in all rows. {"; ".join(said)}.'
    )
    if len(cases) > len(LETTERS):
        caption += f' The first {len(LETTERS)} of {len(cases)} cases; all are in indices.parquet.'
    return figure, title, caption


def _effects(analysis: Analysis, measures: Sequence[Measure]) -> Drawn:
    """Elementary effects of Morris: their mean size and their standard deviation."""
    rows = [row for row in analysis.tables['indices'] if row['method'] == 'morris']
    shown = [m for m in measures if any(row['figure'] == m.name for row in rows)]
    names, paths = short_names(analysis.factors), list(dict.fromkeys(row['path'] for row in rows))
    controllers = list(dict.fromkeys(row['controller'] for row in rows))
    figure, panels = plots.small_multiples(len(shown), height=2.0)
    for axes, measure in zip(panels, shown, strict=True):
        mine = [row for row in rows if row['figure'] == measure.name]
        for row in mine:
            colour = look(paths.index(row['path']))['color']
            marker = MARKERS[controllers.index(row['controller']) % len(MARKERS)]
            axes.plot(row['mu_star'], row['sigma'], marker, color=colour, markersize=5)
        ends = [0.0, max(row['mu_star'] for row in mine) * 1.1]
        axes.plot(ends, ends, color=GREY, linewidth=0.7, linestyle=(0, (1, 2)))
        _head(axes, measure, unit=True)
        axes.margins(0.1)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(lambda x, _: typeset(plain(x, 3)))
    figure.supxlabel(r'$\mu^*$: mean size of the effect', fontsize='medium')
    figure.supylabel(r'$\sigma$: its standard deviation', fontsize='medium')
    for i, path in enumerate(paths):
        panels[0].plot([], [], 'o', color=look(i)['color'], label=names[path])
    for i, controller in enumerate(controllers if len(controllers) > 1 else []):
        panels[0].plot([], [], MARKERS[i % len(MARKERS)], color='black', label=controller)
    plots.shared_legend(figure)
    title = 'Elementary effects'
    caption = (
        f'{title} of Morris: how much a measure changes when one path goes through its whole '
        'range, at random values of the others; above the dotted line the effect depends more on '
        'the others than it is large.'
    )
    return figure, title, caption


def _dependence(analysis: Analysis, factor: Factor, measures: Sequence[Measure]) -> Drawn:
    """Quantiles of measures in the groups of a path: bands over a number, bars over choices."""
    figure, panels = plots.small_multiples(len(measures), height=1.95)
    every = analysis.sweep.controllers
    controllers = [name for name in every if factor.concerns(name)]
    for axes, measure in zip(panels, measures, strict=True):
        for i, controller in enumerate(controllers):
            mine = (controller, factor.path, measure.name)
            rows = [r for r in analysis.tables['dependence']
                    if (r['controller'], r['path'], r['figure']) == mine]  # fmt: skip
            style = look(every.index(controller)) | {'label': controller}
            if factor.binned and factor.numbers is not None:
                sample = analysis.sweep.finished[controller]
                sample = sample[:: max(len(sample) // SAMPLE, 1)][:SAMPLE]
                values = analysis.values[measure.name][sample]
                axes.plot(factor.numbers[sample], values, '.', color=style['color'], alpha=0.35,
                          markersize=2, markeredgewidth=0, rasterized=True)  # fmt: skip
                _bands(axes, rows, style)
            else:
                _bars(axes, rows, style, (i + 0.5) / len(controllers) - 0.5)
        _finish(axes, factor, measure)
    name = with_unit(short_names(analysis.factors)[factor.path], factor)
    figure.supxlabel(name, fontsize='medium')
    plots.shared_legend(figure)
    title = f'Dependence on {factor.path}'
    caption = (
        f'{title}{f" ({factor.meaning})" if factor.meaning else ""}: median, '
        'middle half and 5–95 % of the rows, over whatever else varies; a time that does not exist '
        'counts as late, and what lies there is not drawn.'
    )
    if factor.binned:
        caption += f' Points: at most {SAMPLE} rows of each controller.'
    return figure, title, caption


def _array(rows: Sequence[Row], name: str) -> np.ndarray:
    return np.array([row[name] for row in rows], float)


def _bands(axes: Axes, rows: Sequence[Row], style: dict[str, Any]) -> None:
    x, colour = _array(rows, 'middle'), style['color']
    for low, high, alpha in (('low', 'high', 0.14), ('quarter', 'three_quarters', 0.24)):
        axes.fill_between(x, _array(rows, low), _array(rows, high), color=colour, alpha=alpha,
                          linewidth=0)  # fmt: skip
    axes.plot(x, _array(rows, 'median'), **style)


def _bars(axes: Axes, rows: Sequence[Row], style: dict[str, Any], offset: float) -> None:
    x = np.arange(len(rows)) + WIDTH * offset
    colour = style['color']
    axes.vlines(x, _array(rows, 'low'), _array(rows, 'high'), color=colour, linewidth=1.0)
    middle = _array(rows, 'quarter'), _array(rows, 'three_quarters')
    axes.vlines(x, *middle, color=colour, linewidth=4.0, alpha=0.5)
    axes.plot(x, _array(rows, 'median'), 'o', color=colour, markersize=4, label=style['label'])


def _finish(axes: Axes, factor: Factor, measure: Measure) -> None:
    _head(axes, measure)
    axes.set_ylabel(measure.unit, fontsize='medium')
    axes.margins(x=0.03, y=0.08)
    if factor.binned and factor.numbers is not None:
        _logarithmic(axes, 'x', factor.numbers)
    else:
        labels = _values_below(axes, factor.labels)
        axes.set_xlim(-0.6, len(labels) - 0.4)
        if sum(map(len, labels)) > 20:
            axes.tick_params(axis='x', labelrotation=60)
    _logarithmic(axes, 'y', np.array(axes.dataLim.intervaly))


def _head(axes: Axes, measure: Measure, *, unit: bool = False) -> None:
    label = f'{measure.label} ({measure.unit})' if unit else measure.label
    axes.set_title(label, loc='left', fontsize='medium')
    axes.tick_params(labelsize='small')


def _values_below(axes: Axes, labels: Sequence[str]) -> list[str]:
    texts = [typeset(cut(label)) for label in labels]
    axes.set_xticks(range(len(texts)), texts)
    return texts


def _logarithmic(axes: Axes, direction: str, values: np.ndarray) -> None:
    """Logarithmic axis where all values are positive and far apart."""
    known = values[np.isfinite(values)]
    if len(known) and known.min() > 0 and known.max() > WIDE * known.min():
        axes.set(**{f'{direction}scale': 'log'})


def _together(analysis: Analysis, measures: Sequence[Measure]) -> Drawn:
    """Medians over the two paths that matter most: a row of heat maps per measure."""
    rows = analysis.tables['together']
    controllers = list(dict.fromkeys(row['controller'] for row in rows))[:MOST_GRIDS]
    across = len(controllers)
    figure, panels = plots.small_multiples(len(measures) * across, across, height=2.6)
    first, second = analysis.pair
    names = short_names(analysis.factors)
    for i, measure in enumerate(measures):
        mine = [row for row in rows if row['figure'] == measure.name]
        scale = HeatMap(_array(mine, 'median'), (), '').norm()
        for controller, axes in zip(controllers, panels[i * across :], strict=False):
            cells = [cell for cell in mine if cell['controller'] == controller]
            _one_pair(axes, cells, measure.label, scale)
            axes.set_title(f'{controller}: {measure.label}', loc='left', pad=22, fontsize='medium')
            axes.set_ylabel(names[first.path])
            axes.set_xlabel(names[second.path])
            plots.scale_bar(figure, axes.images[0], measure.unit, ax=axes, fraction=0.05)
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
    values = _array(cells, 'median').reshape(len(down), len(across))
    heads = [typeset(cut(word)) for word in across]
    plots.draw_grid(axes, HeatMap(values, heads, label, scale=scale), fontsize=6.0)
    axes.set_yticks(range(len(down)), [typeset(cut(word)) for word in down])
    axes.tick_params(labelsize=7)
    if len(across) > 4:
        axes.tick_params(axis='x', labelrotation=60)


def _failures(analysis: Analysis) -> Drawn:
    """Shares of diverged and refused rows along each path, of all controllers together."""
    paths = list(dict.fromkeys(row['path'] for row in analysis.tables['failures']))
    names = short_names(analysis.factors)
    figure, panels = plots.small_multiples(len(paths), height=2.2)
    for axes, path in zip(panels, paths, strict=True):
        groups: dict[str, list[Row]] = {}
        for row in analysis.tables['failures']:
            if row['path'] == path:
                groups.setdefault(row['value'], []).append(row)
        counts = np.array([sum(r['rows'] for r in group) for group in groups.values()])
        bottom = np.zeros(len(groups))
        for word, colour in (('diverged', COLOURS[4]), ('refused', GREY)):
            failed = np.array([sum(r[word] for r in group) for group in groups.values()])
            share = 100 * failed / counts
            axes.bar(range(len(groups)), share, bottom=bottom, color=colour, label=word)
            bottom += share
        _values_below(axes, list(groups))
        axes.tick_params(axis='x', labelrotation=90, labelsize=7)
        axes.set_title(names[path], loc='left', fontsize='medium')
        axes.set_ylabel('rows (%)')
        axes.grid(axis='x', visible=False)
    plots.shared_legend(figure)
    title = 'Where it fails'
    caption = (
        f'{title}: share of the rows that diverged or were refused, over the values of each path, '
        'all controllers together; of each one in failures.parquet.'
    )
    return figure, title, caption


def _small_heads(figure: Figure, grids: Sequence[HeatMap]) -> None:
    """Heads that are paths: small, and upright where there are more than two."""
    for axes, grid in zip(figure.axes, grids, strict=False):
        angle = 90 if len(grid.columns) > 2 else 0
        axes.tick_params(axis='x', labelrotation=angle, labelsize='small')
