"""The figure of a study of gains: spreads with their intervals beside the indices of the gains."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from auv_analysis.report import plotting
from auv_analysis.report.figure_files import FigureRecord
from auv_analysis.report.quantities import mathtext
from auv_analysis.report.text import plain
from auv_analysis.study.effects import Sensitivity, Variable

SHOWN = (  # what is drawn of step 3
    'velocity_error.rms', 'velocity_error.max_after_2s', 'lumped_error.rms', 'effort.rms',
    'effort.max',
)  # fmt: skip
ROW = 0.185  # in, height of a row


def sensitivity_figure(found: Sensitivity, folder: Path) -> FigureRecord:
    """Draw the errors, estimates and inputs of one controller; no files where nothing follows."""
    name, title = f'sensitivity_{found.controller}', f'Sensitivity to the gains, {found.controller}'
    shown = [variable for kind in SHOWN for variable in found.of(kind).values()]
    if not shown:
        return FigureRecord(name, title, f'{title}: nothing to draw.', None, None)
    sobol = found.method == 'sobol'
    with plotting.style():
        figure = plotting.new_figure(ROW * len(shown) + 0.9)
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.5, 1.0))
        _bars(left, shown)
        _map(right, shown, found)
        _part(left, right, shown)
        plotting.letter(left, 0, 'spread, 95 % interval')
        plotting.letter(right, 1, 'total index $S_T$' if sobol else r'$\mu^*$')
        files = plotting.save(figure, folder, name)
    what = (
        'share of its variance that each gain makes, alone and with the others (total index of '
        'Sobol’; the sum may exceed 1)'
        if sobol
        else 'mean change of its logarithm over the whole range of each gain (Morris)'
    )
    caption = (
        f'{title}: (a) standard deviation of the logarithm of a figure when every gain is '
        f'multiplied by a number of its own between 1/{plain(found.span)} and '
        f'{plain(found.span)}; (b) {what}.'
    )
    return FigureRecord(name, title, caption, *files)


def _bars(axes: Axes, shown: list[Variable]) -> None:
    rows = np.arange(len(shown))
    spread, low, high = (
        np.array([getattr(variable, name) for variable in shown])
        for name in ('spread', 'spread_low', 'spread_high')
    )
    colours = [plotting.COLOURS[SHOWN.index(variable.figure.name)] for variable in shown]
    axes.barh(rows, spread, color=colours, height=0.72)
    axes.errorbar(
        spread, rows, xerr=[np.maximum(spread - low, 0.0), np.maximum(high - spread, 0.0)],
        fmt='none', ecolor='#222222', elinewidth=0.9, capsize=1.6,
    )  # fmt: skip
    axes.set_yticks(rows, [variable.figure.short for variable in shown])
    axes.set_ylim(len(shown) - 0.4, -0.6)
    axes.set_xlim(0.0, 1.04 * float(high.max()))
    axes.grid(visible=False, axis='y')
    axes.tick_params(axis='y', length=0)
    axes.set_xlabel('standard deviation of ln(figure)')


def _map(axes: Axes, shown: list[Variable], found: Sensitivity) -> None:
    weights = np.array([[index.weight for index in variable.indices] for variable in shown])
    top = 1.0 if found.method == 'sobol' else float(weights.max()) or 1.0
    axes.imshow(weights, cmap='Blues', vmin=0.0, vmax=top, aspect='auto')
    for (row, column), value in np.ndenumerate(weights):
        colour = 'white' if value > 0.55 * top else '#222222'
        text = f'{value:.2f}'.replace('-0.00', '0.00')
        axes.text(column, row, text, ha='center', va='center', fontsize=7.5, color=colour)
    axes.set_xticks(range(len(found.gains)), [mathtext(gain) for gain in found.gains])
    axes.tick_params(axis='both', length=0, labelleft=False)
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _part(left: Axes, right: Axes, shown: list[Variable]) -> None:
    """Lines between the kinds of figures."""
    names = [variable.figure.name for variable in shown]
    for i in range(1, len(names)):
        if names[i] != names[i - 1]:
            left.axhline(i - 0.5, color=plotting.GREY, linewidth=0.6)
            right.axhline(i - 0.5, color='white', linewidth=2.5)
