"""Figures of a sweep: distributions, what matters, combinations of two paths, failures, indices."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from auv_analysis.comparison.lines import look
from auv_analysis.exploration.figures_dependence import MOST_PATHS, dependence
from auv_analysis.exploration.figures_indices import effects, total_indices
from auv_analysis.exploration.figures_values import MOST_GRIDS, failures, together
from auv_analysis.exploration.names import short_names
from auv_analysis.exploration.results import Results
from auv_analysis.measures import Measure
from auv_analysis.report import plotting
from auv_analysis.report.figure_files import FigureRecord, save_figures
from auv_analysis.report.grids import Grid, grid_figure, small_heads
from auv_analysis.report.text import join

ACROSS = 4
WIDE = 30.0  # ratio from which an axis is logarithmic
PREFERRED = (
    'overall.velocity_error.settling_time',
    'overall.velocity_error.rms.linear',
    'overall.velocity_error.rms.angular',
    'kinetic_energy.mean',
    'overall.effort.rms.linear',
    'overall.coupling.delta_xi_max.angular',
)
Drawn = tuple[Figure, str, str]


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
    down = -(-len(results.measures) // ACROSS)
    figure = plotting.new_figure(0.4 + 1.75 * down)
    panels = figure.subplots(down, ACROSS, squeeze=False, sharey=True).ravel()
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
    for axes in panels[::ACROSS]:
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
    from auv_analysis.measures import BY_NAME

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
    figure = grid_figure([m.label for m in results.measures], grids)
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
