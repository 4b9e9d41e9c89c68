"""The figures of a tuning: what effort buys, and what the draws do to it."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from auv_analysis.report import plots
from auv_analysis.report.plots import COLOURS, DASHES, GREY, FigureRecord, save_figures
from auv_analysis.studies.optimise import GRADIENT
from auv_analysis.studies.pairs import KNOWN, log_ratios
from auv_analysis.studies.tune.cost import MEANINGS, Measures
from auv_analysis.studies.tune.results import Tuning

WIDEST = 2.0  # of the reference's effort, where the cloud is shown
HEIGHTS = 0.05, 200.0  # of the reference's error
LAWS = {'gvc': 0, 'cl': 1, 'pid': 2, 'smc': 3}  # colour of a law
Drawn = tuple[Figure, str, str]


def pictures(outcome: Tuning, folder: Path) -> list[FigureRecord]:
    """Draw the figures of an outcome as PNG and PDF into a folder, made when it is not there."""
    drawn = {'trade_off': trade_off}
    if outcome.draws:
        drawn |= {'draws': distributions, 'paired': paired}
    made = {name: partial(draw, outcome) for name, draw in drawn.items()}
    return list(save_figures(folder, made).values())


def trade_off(outcome: Tuning) -> Drawn:
    """Error and effort of every gain that was tried, and the line of equality."""
    figure = plots.new_figure(4.2)
    axes = figure.add_subplot()
    least = min(1.0, *(_law(axes, outcome, name) for name in outcome.laws))
    _controllers(axes, outcome)
    line = axes.axvline if outcome.goal.equal == 'effort' else axes.axhline
    line(1.0, color=GREY, linestyle=DASHES[1], linewidth=1.0)
    axes.set(xscale='log', yscale='log')
    low, high = axes.dataLim.intervaly
    _plain_ticks(axes.xaxis, (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.5, 2.0))
    _plain_ticks(axes.yaxis, (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0))
    axes.set_xlim(0.97 * least, WIDEST)
    axes.set_ylim(max(HEIGHTS[0], 0.8 * low), min(HEIGHTS[1], 1.2 * high))
    name, label = outcome.request.reference, MEANINGS[outcome.goal.index].label
    axes.set(xlabel=f'effort / that of {name}', ylabel=f'{label} / that of {name}')
    axes.legend(loc='upper right')
    title = f'What effort buys: {label} of all gains that were tried'
    caption = (
        f'{title}, a dot each; lines: the least found at that effort or below, by law, searched '
        f'only where equality is. Star: {name}; dashed: equal {outcome.goal.equal}; circles: the '
        f'gains that the search chose; diamonds: other controllers as the scenario has them, where '
        f'they lie inside. Gains too fast for the control period are left out.'
    )
    return figure, title, caption


def _law(axes: Axes, outcome: Tuning, name: str) -> float:
    """Cloud and front of a law; least effort, to the reference's, of what is shown."""
    tuned = outcome.laws[name]
    colour = COLOURS[LAWS[tuned.law]]
    x, y = _cloud(outcome, name)
    front = _front(x, y)
    axes.plot(x, y, '.', color=colour, alpha=0.18, markersize=3, markeredgewidth=0)
    axes.plot(x[front], y[front], color=colour, drawstyle='steps-post', label=tuned.law)
    return float(min(x[front][y[front] < HEIGHTS[1]], default=1.0))


def _controllers(axes: Axes, outcome: Tuning) -> None:
    """A mark for each controller."""
    index, reference = outcome.goal.index, outcome.request.reference
    for name in outcome.scenario.controllers:
        place = outcome.ratio(name, 'effort'), outcome.ratio(name, index)
        if name == reference:
            label = f'{name}, as given'
            axes.plot(*place, '*', color='black', markersize=12, zorder=6, label=label)
        elif np.isfinite(place).all():
            mark, colour = 'o' if name in outcome.laws else 'D', _look(outcome, name)[0]
            axes.plot(*place, mark, color=colour, markeredgecolor='black', markersize=7, zorder=5)


def _cloud(outcome: Tuning, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Effort and error of the gains tried for a law, to the reference's."""
    index, reference, parts = outcome.goal.index, outcome.goal.reference, []
    for one in outcome.laws[name].searches:
        measures = one.evaluations
        keep = (one.margins >= 0) & (one.stages != GRADIENT) & np.isfinite(measures.error)
        error = getattr(measures, index)[keep] / getattr(reference, index)
        parts.append(np.stack([measures.effort[keep] / reference.effort, error]))
    x, y = np.concatenate(parts, axis=1)
    return x, y


def _front(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Indices of the points that none with less of x has less of y than, by x."""
    order = np.lexsort((y, x))
    least = np.minimum.accumulate(y[order])
    return order[np.concatenate([[True], least[1:] < least[:-1]])] if len(x) else order


def distributions(outcome: Tuning) -> Drawn:
    """Empirical distribution functions of error and effort over the draws."""
    figure = plots.new_figure(3.2)
    every = outcome.draws.values()
    shown = [
        measure
        for measure in (outcome.goal.index, 'effort', 'late_error')
        if any(np.isfinite(getattr(draws, measure)).any() for draws in every)
    ]
    for i, measure in enumerate(shown):
        axes = figure.add_subplot(1, len(shown), i + 1)
        for name, draws in outcome.draws.items():
            values = getattr(draws, measure)
            finite = np.sort(values[np.isfinite(values)])
            share = np.arange(1, len(finite) + 1) / len(values)
            colour, dash = _look(outcome, name)
            axes.plot(
                finite, share, drawstyle='steps-post', color=colour, linestyle=dash, label=name
            )
        axes.set_ylim(0, 1)
        axes.set_xlabel(f'{MEANINGS[measure].label} ({MEANINGS[measure].unit})')
        _scaled(axes, measure)
        if i == 0:
            axes.set_ylabel('share of the draws')
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc='outside upper center', ncols=min(len(labels), 6))
    count = len(outcome.draws[outcome.request.reference].error)
    title = f'Distributions over {count} draws'
    return figure, title, f'{title} of model error and disturbance, the same for every controller.'


def paired(outcome: Tuning) -> Drawn:
    """Ratios to the reference, draw by draw."""
    reference = outcome.request.reference
    names = [name for name in outcome.draws if name != reference]
    figure = plots.new_figure(0.9 + 0.42 * len(names))
    shown = outcome.goal.index, 'effort'
    for i, measure in enumerate(shown):
        axes = figure.add_subplot(1, len(shown), i + 1)
        ratios = [_ratios(outcome.draws, name, reference, measure) for name in names]
        boxes = axes.boxplot(
            ratios, orientation='horizontal', whis=(5, 95), widths=0.6, patch_artist=True,
            showfliers=False, medianprops={'color': 'black'},
        )  # fmt: skip
        for box, name in zip(boxes['boxes'], names, strict=True):
            box.set_facecolor(_look(outcome, name)[0])
            box.set_alpha(0.75 if name in outcome.laws else 0.35)
        axes.axvline(1.0, color=GREY, linestyle=DASHES[1], linewidth=1.0)
        axes.set_yticks(range(1, len(names) + 1), names if i == 0 else [''] * len(names))
        axes.invert_yaxis()
        axes.set_xlabel(f'{MEANINGS[measure].label} / that of {reference}')
        _scaled(axes, measure)
    title = f'Paired ratios to {reference}'
    caption = (
        f'{title}, one for each draw in which neither diverged: box from quarter to quarter with '
        f'the median, whiskers from 5 to 95 %. Left of the dashed line the controller has less '
        f'than {reference} in the same draw.'
    )
    return figure, title, caption


def _ratios(draws: Mapping[str, Measures], name: str, reference: str, measure: str) -> np.ndarray:
    """Ratios of the draws in which neither loop diverged."""
    d = log_ratios(getattr(draws[name], measure), getattr(draws[reference], measure))
    return np.exp(d[np.abs(d) < KNOWN])


def _look(outcome: Tuning, name: str) -> tuple[str, object]:
    """Colour of the law; full line where its gains were searched, dashed as the scenario has it."""
    law = outcome.scenario.controller(name)['law']
    colour = COLOURS[LAWS[law]] if law in LAWS else GREY
    return colour, DASHES[0 if name in outcome.laws else 1]


def _scaled(axes: Axes, measure: str) -> None:
    """Logarithmic axis of an error with plain numbers; that of an effort is linear."""
    axes.margins(x=0.05)
    if measure == 'effort':
        axes.xaxis.set_major_locator(MaxNLocator(4))
        return
    axes.set_xscale('log')
    low, high = axes.get_xlim()
    wide = low > 0 and high / low > 300
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0,) if wide else (1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter('{x:g}')
    axes.xaxis.set_minor_locator(NullLocator())


def _plain_ticks(axis: Axis, ticks: Sequence[float]) -> None:
    axis.set_ticks(list(ticks), [f'{tick:g}' for tick in ticks])
    axis.set_ticks([], minor=True)
