"""Plots of a tuning: error against effort, and its spread over the draws."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from auv_analysis.metrics.quantities import COSTS
from auv_analysis.report.plots import (
    COLOURS,
    DASHES,
    GREY,
    Drawn,
    FigureRecord,
    distribution,
    new_figure,
    save_figures,
    shared_legend,
)
from auv_analysis.studies.optimise import GRADIENT
from auv_analysis.studies.pairs import KNOWN, log_ratios
from auv_analysis.studies.tune.results import Tuning
from auv_gvc_controller.laws import NAMES

WIDEST = 2.0  # of the reference's effort, where the cloud is shown
HEIGHTS = 0.05, 200.0  # of the reference's error
LAWS = {law: i for i, law in enumerate(NAMES)}  # colour of a law


def draw_tuning(tuning: Tuning, folder: Path) -> dict[str, FigureRecord]:
    """Draw the figures of a tuning as PNG and PDF into a folder, made when it is not there."""
    drawn = {'trade_off': trade_off}
    if tuning.draws:
        drawn |= {'draws': distributions, 'paired': paired}
    return save_figures(folder, {name: partial(draw, tuning) for name, draw in drawn.items()})


def trade_off(tuning: Tuning) -> Drawn:
    """Error and effort of every gain that was tried, and the line of equality."""
    figure = new_figure(4.2)
    axes = figure.add_subplot()
    least = min(1.0, *(_law(axes, tuning, name) for name in tuning.laws))
    _controllers(axes, tuning)
    line = axes.axvline if tuning.goal.equal == 'effort' else axes.axhline
    line(1.0, color=GREY, linestyle=DASHES[1], linewidth=1.0)
    axes.set(xscale='log', yscale='log')
    low, high = axes.dataLim.intervaly
    _plain_ticks(axes.xaxis, (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.5, 2.0))
    _plain_ticks(axes.yaxis, (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0))
    axes.set_xlim(0.97 * least, WIDEST)
    axes.set_ylim(max(HEIGHTS[0], 0.8 * low), min(HEIGHTS[1], 1.2 * high))
    name, label = tuning.request.reference, COSTS[tuning.goal.index].label
    axes.set(xlabel=f'effort / that of {name}', ylabel=f'{label} / that of {name}')
    axes.legend(loc='upper right')
    title = f'What effort buys: {label} of all gains that were tried'
    caption = (
        f'{title}, a dot each; lines: the least found at that effort or below, by law, searched '
        f'only where equality is. Star: {name}; dashed: equal {tuning.goal.equal}; circles: the '
        f'gains that the search chose; diamonds: other controllers as the scenario has them, where '
        f'they lie inside. Gains too fast for the control period are left out.'
    )
    return figure, title, caption


def _law(axes: Axes, tuning: Tuning, name: str) -> float:
    """Cloud and front of a law; least effort, to the reference's, of what is shown."""
    law = tuning.laws[name].law
    colour = COLOURS[LAWS[law]]
    x, y = _cloud(tuning, name)
    front = _front(x, y)
    axes.plot(x, y, '.', color=colour, alpha=0.18, markersize=3, markeredgewidth=0)
    axes.plot(x[front], y[front], color=colour, drawstyle='steps-post', label=law)
    return float(min(x[front][y[front] < HEIGHTS[1]], default=np.inf))


def _controllers(axes: Axes, tuning: Tuning) -> None:
    """A mark for each controller."""
    index, reference = tuning.goal.index, tuning.request.reference
    for name in tuning.scenario.controllers:
        place = tuning.ratio(name, 'effort'), tuning.ratio(name, index)
        if name == reference:
            label = f'{name}, as given'
            axes.plot(*place, '*', color='black', markersize=12, zorder=6, label=label)
        else:
            mark, colour = 'o' if name in tuning.laws else 'D', _look(tuning, name)['color']
            axes.plot(*place, mark, color=colour, markeredgecolor='black', markersize=7, zorder=5)


def _cloud(tuning: Tuning, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Effort and error of the gains tried for a law, to the reference's."""
    index, reference, parts = tuning.goal.index, tuning.goal.reference, []
    for one in tuning.laws[name].searches:
        measures = one.evaluations
        keep = one.allowed & (one.stages != GRADIENT) & np.isfinite(measures.error)
        error = getattr(measures, index)[keep] / getattr(reference, index)
        parts.append(np.stack([measures.effort[keep] / reference.effort, error]))
    x, y = np.concatenate(parts, axis=1)
    return x, y


def _front(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Indices of the points that none with less of x has less of y than, by x."""
    order = np.lexsort((y, x))
    least = np.minimum.accumulate(y[order])
    return order[np.concatenate([[True], least[1:] < least[:-1]])] if len(x) else order


def distributions(tuning: Tuning) -> Drawn:
    """Empirical distribution functions of error and effort over the draws."""
    figure = new_figure(3.2)
    every = tuning.draws.values()
    shown = [
        measure
        for measure in (tuning.goal.index, 'effort', 'late_error')
        if any(np.isfinite(getattr(draws, measure)).any() for draws in every)
    ]
    looks = {name: _look(tuning, name) for name in tuning.draws}
    for i, measure in enumerate(shown):
        axes = figure.add_subplot(1, len(shown), i + 1)
        samples = {name: getattr(draws, measure) for name, draws in tuning.draws.items()}
        distribution(axes, samples, looks)
        axes.set_xlabel(f'{COSTS[measure].label} ({COSTS[measure].unit})')
        _scaled(axes, measure)
    figure.axes[0].set_ylabel('share of the draws')
    shared_legend(figure, 'outside upper center')
    count = len(tuning.draws[tuning.request.reference].error)
    title = f'Distributions over {count} draws'
    return figure, title, f'{title} of model error and disturbance, the same for every controller.'


def paired(tuning: Tuning) -> Drawn:
    """Ratios to the reference, draw by draw."""
    reference = tuning.request.reference
    names = [name for name in tuning.draws if name != reference]
    figure = new_figure(0.9 + 0.42 * len(names))
    shown = tuning.goal.index, 'effort'
    for i, measure in enumerate(shown):
        axes = figure.add_subplot(1, len(shown), i + 1)
        ratios = [_ratios(tuning, name, measure) for name in names]
        boxes = axes.boxplot(
            ratios, orientation='horizontal', whis=(5, 95), widths=0.6, patch_artist=True,
            showfliers=False, medianprops={'color': 'black'},
        )  # fmt: skip
        for box, name in zip(boxes['boxes'], names, strict=True):
            box.set_facecolor(_look(tuning, name)['color'])
            box.set_alpha(0.75 if name in tuning.laws else 0.35)
        axes.axvline(1.0, color=GREY, linestyle=DASHES[1], linewidth=1.0)
        axes.set_yticks(range(1, len(names) + 1), names if i == 0 else [''] * len(names))
        axes.invert_yaxis()
        axes.set_xlabel(f'{COSTS[measure].label} / that of {reference}')
        _scaled(axes, measure)
    title = f'Paired ratios to {reference}'
    caption = (
        f'{title}, one for each draw in which neither diverged: box from quarter to quarter with '
        f'the median, whiskers from 5 to 95 %. Left of the dashed line the controller has less '
        f'than {reference} in the same draw.'
    )
    return figure, title, caption


def _ratios(tuning: Tuning, name: str, measure: str) -> np.ndarray:
    """Ratios to the reference of the draws in which neither loop diverged."""
    pair = (getattr(tuning.draws[n], measure) for n in (name, tuning.request.reference))
    d = log_ratios(*pair)
    return np.exp(d[np.abs(d) < KNOWN])


def _look(tuning: Tuning, name: str) -> dict[str, Any]:
    """Colour of the law; full line where its gains were searched, dashed as the scenario has it."""
    law = tuning.scenario.controller(name)['law']
    colour = COLOURS[LAWS[law]] if law in LAWS else GREY
    return {'color': colour, 'linestyle': DASHES[0 if name in tuning.laws else 1]}


def _scaled(axes: Axes, measure: str) -> None:
    """Logarithmic axis of an error with plain numbers; that of an effort is linear."""
    axes.margins(x=0.05)
    if measure == 'effort':
        axes.xaxis.set_major_locator(MaxNLocator(4))
        return
    axes.set_xscale('log')
    low, high = axes.get_xlim()
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0,) if high > 300 * low else (1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter('{x:g}')
    axes.xaxis.set_minor_locator(NullLocator())


def _plain_ticks(axis: Axis, ticks: Sequence[float]) -> None:
    axis.set_ticks(list(ticks), [f'{tick:g}' for tick in ticks])
    axis.set_ticks([], minor=True)
