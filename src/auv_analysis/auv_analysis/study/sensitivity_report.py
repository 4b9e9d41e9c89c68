"""What a change of the gains does, as tables and sentences."""

from collections.abc import Iterator, Sequence

from auv_analysis.report.document import Cell, Column, Sentence, Table
from auv_analysis.report.quantities import Maths, symbol
from auv_analysis.report.text import fixed, join, number, plain
from auv_analysis.study.effects import Index, Sensitivity, Variable
from auv_analysis.study.sensitivity_file import FILE

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
