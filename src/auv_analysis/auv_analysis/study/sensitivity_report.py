"""What a change of the gains does, as tables and sentences."""

from collections.abc import Iterator, Sequence

from auv_analysis.report.document import Cell, Column, Sentence, Table, cell
from auv_analysis.report.text import fixed, join, number
from auv_analysis.study.effects import Sensitivity, Variable
from auv_analysis.study.sensitivity_file import FILE

HEADLINES = ('velocity_error.rms', 'lumped_error.rms', 'effort.rms', 'effort.max')
NOTHING = 0.01  # of the variance: a gain that never makes more decides nothing
MEANINGS = {
    'ST': 'share of the variance that this gain makes, alone and with the others; ± half of the '
    '95 % interval',
    'mu_star': 'mean change of the logarithm over the whole range of this gain; ± half of the 95 % '
    'interval',
}


def sensitivity_table(found: Sensitivity) -> Table:
    """Every figure of a controller by falling spread, with the gains that move it."""
    weight = 'ST' if found.method == 'sobol' else 'mu_star'
    columns = (
        Column('figure', numeric=False),
        Column('with these gains', meaning='its value with the gains of the scenario'),
        Column('unit', numeric=False),
        Column('spread', meaning='standard deviation of its logarithm: about its relative change'),
        Column('from', meaning='lower end of the 95 % interval of the spread'),
        Column('to', meaning='upper end of that interval'),
        Column('place', meaning='by spread among the degrees of freedom of this figure'),
        Column('places', meaning='95 % interval of the place', numeric=False),
        Column('range', meaning='largest over smallest value of all rollouts'),
        Column('main gain', meaning='the gain that does most of it', numeric=False),
        Column('twice of it', '%', 'change of the figure when the main gain is doubled, by a fit'),
        *(Column(gain, meaning=MEANINGS[weight], group=weight) for gain in found.gains),
    )
    text = (
        f'How the figures of {found.controller} change when every gain is multiplied by a number '
        f'of its own between 1/{number(found.span)} and {number(found.span)} (log-uniform): '
        f'{found.rollouts} runs, indices after {_method(found)}.'
    )
    rows = [_row(variable, weight, found) for variable in found.variables]
    return Table(f'sensitivity_{found.controller}', text, columns, rows)


def _method(found: Sensitivity) -> str:
    return {'sobol': 'Sobol’', 'morris': 'Morris'}[found.method]


def _row(variable: Variable, weight: str, found: Sensitivity) -> list[Cell]:
    def of(column: str, value: float, digits: int = 3) -> Cell:
        return cell(value, f'{FILE}:{column}', digits=digits)

    low, high, count = variable.rank_low, variable.rank_high, found.alike[variable.figure.name]
    ratio = variable.largest / variable.smallest
    indices = []
    for index in variable.indices:
        value, margin = (float(getattr(index, name)) for name in (weight, f'{weight}_conf'))
        text = f'{fixed(value, 2)} ± {fixed(margin, 2)}'
        figures = {weight: value, f'{weight}_conf': margin}
        indices.append(Cell(text, source=f'{FILE}:{weight}', figures=figures))
    return [
        Cell(variable.figure.label),
        of('value', variable.value),
        Cell(variable.figure.unit),
        of('spread', variable.spread),
        of('spread_low', variable.spread_low),
        of('spread_high', variable.spread_high),
        Cell(str(variable.rank), variable.rank, f'{FILE}:rank'),
        Cell(
            f'{low} of {count}' if low == high else f'{low}–{high} of {count}',
            source=f'{FILE}:rank_low',
            figures={'rank_low': low, 'rank_high': high},
        ),
        Cell(number(ratio), ratio, f'{FILE}:largest'),
        Cell(variable.main.gain),
        of('elasticity', variable.main.doubled, 2),
        *indices,
    ]


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
            f'{number(span)}; its study takes a factor of {number(of.span)}.',
            table,
        )
    for name in HEADLINES:
        first = next(iter(of.of(name).values()), None)
        if first is not None:
            yield _headline(of, first), table
    idle = [gain for gain in of.gains if _share(of, gain) < NOTHING]
    if idle and of.method == 'sobol':
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
    share = '' if main.ST is None else f'makes {number(100 * main.ST, 2)} % of its variance, and '
    return (
        f'Under {of.controller} the {first.figure.words} that follows the gains most is that of '
        f'{first.figure.dof} (spread {number(first.spread, 2)}, {sure}): {main.gain} {share}'
        f'doubling it changes the figure by about {sign}{number(abs(main.doubled), 2)} %.'
    )


def _share(of: Sensitivity, gain: str) -> float:
    """Largest total index of a gain over all figures; 0 of another method."""
    found = (index.ST or 0.0 for v in of.variables for index in v.indices if index.gain == gain)
    return max(found, default=0.0)
