"""What a change of the gains does, as tables and sentences."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from auv_analysis.metrics.quantities import gain_mathtext as mathtext
from auv_analysis.output.new_files import write_table
from auv_analysis.output.text import Maths, fixed, join, number, plain, symbol
from auv_analysis.report import plots
from auv_analysis.report.document import Cell, Column, Sentence, Table
from auv_analysis.report.plots import FigureRecord
from auv_analysis.studies.study.kpis import Excluded
from auv_analysis.studies.study.sensitivity import Index, Sensitivity, Variable

HEADLINES = ('velocity_error.rms', 'lumped_error.rms', 'effort.rms', 'effort.max')
NOTHING = 0.01  # of the variance: a gain that never makes more decides nothing
MEANINGS = {
    'ST': 'share of the variance that this gain makes, alone and with the others; ± half of the '
    '95 % interval',
    'mu_star': 'mean change of the logarithm over the whole range of this gain; ± half of the 95 % '
    'interval',
}

GROUPS = {'ST': 'total index', 'mu_star': 'effect μ*'}


def sensitivity_table(found: Sensitivity) -> Table:
    """Every figure of a controller by falling spread, with the gains that move it."""
    weight = 'ST' if found.method == 'sobol' else 'mu_star'
    columns = (
        Column('figure', numeric=False),
        Column('value', meaning='with the gains of the scenario'),
        Column(
            'spread',
            meaning='standard deviation of its logarithm: about its relative change; ± half of its '
            '95 % interval',
        ),
        Column('place', meaning='by spread among the degrees of freedom, its 95 % interval'),
        Column('main gain × 2', meaning='the gain that does most, and what twice of it does'),
        *(
            Column(symbol(gain), meaning=MEANINGS[weight], group=GROUPS[weight])
            for gain in found.gains
        ),
    )
    text = (
        f'How the figures of {found.controller} change when every gain is multiplied by a number '
        f'of its own between 1/{plain(found.span)} and {plain(found.span)} (log-uniform): '
        f'{found.rollouts} runs, indices after {_method(found)}.'
    )
    rows = [_row(variable, weight, found) for variable in found.variables]
    return Table(f'sensitivity_{found.controller}', text, columns, rows)


def _method(found: Sensitivity) -> str:
    return {'sobol': 'Sobol’', 'morris': 'Morris'}[found.method]


def _row(variable: Variable, weight: str, found: Sensitivity) -> list[Cell]:
    def of(name: str, text: str, **more: float) -> Cell:
        value = float(getattr(variable, name))
        figures = {key: float(extent) for key, extent in more.items()}
        return Cell(text.replace(' ', '\u00a0'), value, f'{FILE}:{name}', figures=figures)

    v, main, count = variable, variable.main, found.alike[variable.figure.name]
    low, high = v.rank_low, v.rank_high
    ends = str(low) if low == high else f'{low}–{high}'
    sign = '−' if main.doubled < 0 else '+'
    return [
        Cell(v.figure.short),
        of('value', f'{number(v.value)} {v.figure.unit}'),
        of(
            'spread',
            f'{number(v.spread, 2)} ± {number(v.spread_conf, 1)}',
            spread_conf=v.spread_conf,
        ),
        of('rank', f'{ends} of {count}', rank_low=low, rank_high=high, alike=count),
        Cell(
            Maths(f'{{}} {sign}{number(abs(main.doubled), 2)} %', symbol(main.gain)),
            main.doubled,
            f'{FILE}:doubled',
        ),
        *(_index(index, weight) for index in v.indices),
    ]


def _index(index: Index, weight: str) -> Cell:
    value, margin = (float(getattr(index, name)) for name in (weight, f'{weight}_conf'))
    text = f'{fixed(value, 2)} ± {fixed(margin, 2)}'
    return Cell(text, value, f'{FILE}:{weight}', figures={f'{weight}_conf': margin})


def left_out_table(found: Sequence[Sensitivity]) -> Table | None:
    """Figures and gains that have no indices, and why; None where there are none."""
    rows = [
        [Cell(of.controller), Cell(what), Cell(reason)]
        for of in found
        for what, reason in _left_out(of)
    ]
    if not rows:
        return None
    columns = [Column(name, numeric=False) for name in ('controller', 'what', 'why')]
    caption = 'What is left out of the study of gains: its logarithm does not exist or never moves.'
    return Table('sensitivity_left_out', caption, columns, rows, stub=2)


def _left_out(of: Sensitivity) -> Iterator[tuple[str, str]]:
    if of.refusal:
        yield 'all figures', of.refusal
    yield from ((f'gain {gain}', reason) for gain, reason in of.left_out.items())
    yield from ((entry.figure.label, entry.reason) for entry in of.excluded)


def sensitivity_sentences(found: Sequence[Sensitivity]) -> list[Sentence]:
    """What the study of gains found, a few sentences for each controller."""
    return [Sentence(text, source) for of in found for text, source in _sentences(of)]


def _sentences(of: Sensitivity) -> Iterator[tuple[str, str]]:
    table = f'table-sensitivity_{of.controller}'
    if of.refusal:
        yield (
            f'How {of.controller} follows its gains is not known: {of.refusal}.',
            'table-sensitivity_left_out',
        )
        return
    for span, failed in of.failed.items():
        yield (
            f'Under {of.controller}, {failed} rollouts failed with gains within a factor of '
            f'{plain(span)}; its study takes a factor of {plain(of.span)}.',
            table,
        )
    for name in HEADLINES:
        first = next(iter(of.of(name).values()), None)
        if first is not None:
            yield _headline(of, first), table
    idle = [gain for gain in of.gains if _share(of, gain) < NOTHING]
    if idle and of.variables and of.method == 'sobol':
        most = max(_share(of, gain) for gain in idle)
        yield (
            f'Under {of.controller}, {join(idle)} {"decides" if len(idle) == 1 else "decide"} '
            f'nothing: at most {number(100 * most, 2)} % of the variance of any figure.',
            table,
        )


def _headline(of: Sensitivity, first: Variable) -> str:
    """The figure of a kind that follows the gains most."""
    main, count = first.main, of.alike[first.figure.name]
    sure = (
        f'first of {count} in 95 % of the resamplings'
        if first.rank_high == 1
        else f'place {first.rank_low} to {first.rank_high} of {count}'
    )
    sign = '−' if main.doubled < 0 else '+'
    share = (
        ''
        if main.ST is None
        else f'{main.gain} makes {number(100 * main.ST, 2)} % of its variance, and '
    )
    return (
        f'Under {of.controller} the {first.figure.words} that follows the gains most is that of '
        f'{first.figure.dof} (spread {number(first.spread, 2)}, {sure}): {share}'
        f'doubling {main.gain} changes the figure by about {sign}{number(abs(main.doubled), 2)} %.'
    )


def _share(of: Sensitivity, gain: str) -> float:
    """Largest total index of a gain over all figures; 0 of another method."""
    found = (index.ST or 0.0 for v in of.variables for index in v.indices if index.gain == gain)
    return max(found, default=0.0)


FILE = 'sensitivity.parquet'
OF_VARIABLE = (
    'value', 'smallest', 'largest', 'spread', 'spread_conf', 'spread_low', 'spread_high', 'rank',
    'rank_low', 'rank_high',
)  # fmt: skip
OF_INDEX = (
    'elasticity', 'S1', 'S1_conf', 'ST', 'ST_conf', 'mu_star', 'mu_star_conf', 'sigma',
)  # fmt: skip


def write_sensitivities(folder: Path, found: Sequence[Sensitivity]) -> Path:
    """Write the sensitivities of all controllers.

    Columns: controller, law, figure, dof, unit, those of `Variable`, gain, those of `Index`,
    doubled (change in % when the gain is doubled), alike (how many degrees of freedom the rank is
    among), method, count, rollouts, span, span_asked,
    diverged (at all spans together), seed, and reason: why a figure, or all of them, has no
    indices.

    """
    rows = [row for sensitivity in found for row in _rows(sensitivity)]
    return write_table(folder / FILE, {name: [row[name] for row in rows] for name in rows[0]})


def _rows(of: Sensitivity) -> Iterator[dict[str, Any]]:
    for variable in of.variables:
        for index in variable.indices:
            yield _record(of, variable, index)
    for excluded in of.excluded:
        yield _record(of, excluded=excluded)
    if of.refusal:
        yield _record(of)


def _record(
    of: Sensitivity,
    variable: Variable | None = None,
    index: Index | None = None,
    excluded: Excluded | None = None,
) -> dict[str, Any]:
    figure = variable.figure if variable else excluded.figure if excluded else None
    numbers = {name: getattr(variable, name) if variable else None for name in OF_VARIABLE}
    parts = asdict(index) if index else {}
    return {
        'controller': of.controller,
        'law': of.law,
        'figure': figure.name if figure else '',
        'dof': figure.dof if figure else '',
        'unit': figure.unit if figure else '',
        **{name: None if value is None else float(value) for name, value in numbers.items()},
        'gain': parts.get('gain', ''),
        **{name: parts.get(name) for name in OF_INDEX},
        'doubled': index.doubled if index else None,
        'alike': of.alike[figure.name] if variable and figure else None,
        'method': of.method,
        'count': of.count,
        'rollouts': of.rollouts,
        'span': of.span,
        'span_asked': of.asked,
        'diverged': sum(of.failed.values()),
        'seed': of.seed,
        'reason': excluded.reason if excluded else of.refusal,
    }


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
    with plots.style():
        figure = plots.new_figure(ROW * len(shown) + 0.9)
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.5, 1.0))
        _bars(left, shown)
        _map(right, shown, found)
        _part(left, right, shown)
        plots.letter(left, 0, 'spread, 95 % interval')
        plots.letter(right, 1, 'total index $S_T$' if sobol else r'$\mu^*$')
        files = plots.save(figure, folder, name)
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
    colours = [plots.COLOURS[SHOWN.index(variable.figure.name)] for variable in shown]
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
            left.axhline(i - 0.5, color=plots.GREY, linewidth=0.6)
            right.axhline(i - 0.5, color='white', linewidth=2.5)
