"""What holds whatever the paper leaves open, as tables and sentences."""

from collections.abc import Iterator, Sequence

import numpy as np

from auv_analysis.metrics.energy import shares
from auv_analysis.output.text import fixed, join, number
from auv_analysis.report import paper
from auv_analysis.report.document import Cell, Column, Sentence, Table, cell
from auv_analysis.report.quantities import Maths
from auv_analysis.study.attribution import Split
from auv_analysis.study.robustness import FAILS, HOLDS, Held, Robustness, energy_ranges, met
from auv_analysis.study.unknowns import DAMPING, M46, MASS
from auv_analysis.study.unknowns_file import CLAIMS, ENERGY, to_paper
from auv_analysis.study.unknowns_run import Unknowns
from auv_dynamics.vehicle import DOFS

WORDS = {  # unknown -> how it is called, and its unit
    'mass': ('the mass', ' kg'),
    'M46': ('the roll-yaw term M46', ' kg m²'),
    'linear': ('the linear damping', ' times'),
    'quadratic': ('the quadratic damping', ' times'),
    'exponent_sign': ('the sign of the exponents of (39)', ''),
    'window': ('the window', ' s'),
}
LITTLE = 0.25  # of the impurity: a question that takes away less decides nothing
ENDS = (5.0, 10.0, 15.0, 20.0, 25.0, 30.0)  # s, of the rows on energy
KINDS = {HOLDS: 'good', FAILS: 'bad'}


def unknowns_tables(found: Unknowns, rows: Sequence[Robustness]) -> list[Table]:
    """Every claim over all variants and windows, and over those with the exponents read with −."""
    windows = join([f'0–{window:g} s' for window in found.windows])
    columns = (
        Column('no.', meaning='number of the claim'),
        Column('claim', numeric=False),
        Column('shipped', meaning=f'verdicts of the shipped vehicle over {windows}', numeric=False),
        Column('reproduced', '%', 'share of the variants and windows'),
        Column('partly', '%'),
        Column('not', '%'),
        Column(
            'outcome', numeric=False,
            meaning='where the verdict varies: the unknown that parts the verdicts best, and how '
            'often the best verdict that occurs is found on its two sides',
        ),
    )  # fmt: skip
    read = sum(variant.exponent_sign < 0 for variant in found.variants)
    captions = {
        'every': f'Claims over {len(found.variants)} variants of what the paper leaves open, '
        f'judged over {windows}: mass {MASS[0]:g}–{MASS[1]:g} kg and M46 {_interval(M46[0])} or '
        f'{_interval(M46[1])} kg m² with the printed N, linear and quadratic damping '
        f'{DAMPING[0]:g} to {DAMPING[1]:g} times the reconstruction, either sign of the exponents '
        'of (39). Corners and points inside count alike: shares are of this design, no '
        'probabilities.',
        'as_read': f'The same over those {read} variants whose exponents of (39) are read with −.',
    }
    names = {'every': 'unknowns', 'as_read': 'unknowns_as_read'}
    return [
        Table(names[of], caption, columns, [_row(row, of) for row in rows], stub=2)
        for of, caption in captions.items()
    ]


def _interval(ends: tuple[float, float]) -> str:
    return f'{fixed(ends[0], 0)} to {fixed(ends[1], 0)}'


def _row(row: Robustness, of: str) -> list[Cell]:
    shipped, held = list(dict.fromkeys(row.shipped)), getattr(row, of)
    shares = (
        Cell(fixed(part, 0), part, f'{CLAIMS}:{verdict.replace(" ", "_")}', '' if part else 'zero')
        for verdict, part in held.percent.items()
    )
    return [
        Cell(str(row.number), row.number, f'{CLAIMS}:number'),
        Cell(Maths(row.claim)),
        Cell(', then '.join(shipped), kind='badge' if len(shipped) == 1 else ''),
        *shares,
        _outcome(held),
    ]


def _outcome(held: Held) -> Cell:
    split, source = held.split, f'{CLAIMS}:outcome'
    if split is None:
        return Cell(held.outcome, source=source, kind=KINDS.get(held.outcome, ''))
    if split.explained < LITTLE:
        return Cell(f'{held.outcome}, parted by no single unknown', source=source)
    figures = {name: getattr(split, name) for name in ('threshold', 'below', 'above')}
    text = f'{held.outcome}, parted best by {WORDS[split.unknown][0]}'
    return Cell(text, source=f'{CLAIMS}:threshold', figures=figures, remark=_question(split))


def _question(split: Split) -> str:
    below, above = (f'{fixed(part, 0)} %' for part in (split.below, split.above))
    if split.unknown == 'exponent_sign':
        return f'{below} with −, {above} with +'
    level = f'{number(split.threshold)}{WORDS[split.unknown][1]}'
    return f'{below} below {level}, {above} above'


def energy_table(found: Unknowns) -> Table:
    """Mean kinetic energy over 0 to T for some T, and what the unknowns make of it."""
    total, parts = found.energy.sum(axis=2), shares(found.energy[0])
    columns = (
        Column('T', 's', 'end of the window, which begins at 0'),
        Column('shipped', 'J', 'mean kinetic energy of GVC with the shipped vehicle'),
        Column('from', 'J', 'smallest of all variants'),
        Column('to', 'J', 'largest of all variants'),
        Column('to the paper', '%', 'shipped relative to the paper’s 519.47 J'),
        *(Column(Maths(f'ξ{i + 1}'), '%', group='shares') for i in range(6)),
    )
    rows = []
    for end in ENDS:
        k = int(np.argmin(np.abs(found.ends - end)))
        line = total[:, k]
        rows.append([
            Cell(f'{end:g}', end, f'{ENERGY}:end'),
            _fixed(line[0], 2, 'energy'),
            _fixed(line.min(), 2, 'energy_low'),
            _fixed(line.max(), 2, 'energy_high'),
            _fixed(float(to_paper(line[0])), 1, 'to_paper_percent'),
            *(
                cell(float(part), f'{ENERGY}:share.{dof}')
                for dof, part in zip(DOFS, parts[k], strict=True)
            ),
        ])  # fmt: skip
    caption = (
        'Mean kinetic energy of GVC over 0 to T, over all variants; the paper prints '
        f'{fixed(paper.KINETIC_ENERGY, 2)} J and no window.'
    )
    return Table('energy_window', caption, columns, rows)


def _fixed(value: float, decimals: int, column: str) -> Cell:
    return Cell(fixed(float(value), decimals), float(value), f'{ENERGY}:{column}')


def unknowns_sentences(found: Unknowns, rows: Sequence[Robustness]) -> list[Sentence]:
    """What is sure and what is not."""
    return [Sentence(text, source) for text, source in _sentences(found, rows)]


def _sentences(found: Unknowns, rows: Sequence[Robustness]) -> Iterator[tuple[str, str]]:
    tables = {'every': 'table-unknowns', 'as_read': 'table-unknowns_as_read'}
    table, energy = tables['every'], 'table-energy_window'
    every, read = (
        [row.number for row in rows if getattr(row, of).outcome == HOLDS]
        for of in ('every', 'as_read')
    )
    yield (
        f'{_claims(every)} over all {len(found.variants)} variants of what the paper leaves open, '
        f'and {len(read)} (no. {join([str(n) for n in read])}) where the exponents of (39) are '
        'read with −.',
        table,
    )
    for of, where in (('every', ''), ('as_read', ' where the exponents are read with −')):
        for name, numbers in _deciding([(row.number, getattr(row, of)) for row in rows]):
            yield (
                f'{name[0].upper()}{name[1:]} parts the verdicts of no. {numbers} best{where}.',
                tables[of],
            )
    if found.failed:
        yield f'{len(found.failed)} variants diverge and are left out.', table
    for entry in energy_ranges(found):
        yield (
            f'Over 0–{entry.window:g} s the mean kinetic energy is {fixed(entry.low, 2)} to '
            f'{fixed(entry.high, 2)} J over all variants, at most {fixed(entry.away, 1)} % from '
            f'the paper’s {fixed(paper.KINETIC_ENERGY, 2)} J.',
            energy,
        )
    times = met(found)
    if times:
        yield (
            f'{fixed(paper.KINETIC_ENERGY, 2)} J would be met over 0–{fixed(times[0], 2)} s '
            f'({fixed(times[1], 2)} to {fixed(times[2], 2)} s over the variants): '
            'a fit, not a finding.',
            'energy_window',
        )


def _deciding(rows: Sequence[tuple[int, Held]]) -> list[tuple[str, str]]:
    """Unknowns that part verdicts best, the one with most claims first, and their numbers."""
    found: dict[str, list[str]] = {}
    for number_, held in rows:
        if held.split and held.split.explained >= LITTLE:
            found.setdefault(WORDS[held.split.unknown][0], []).append(str(number_))
    return [(name, join(found[name])) for name in sorted(found, key=lambda n: -len(found[n]))]


def _claims(numbers: list[int]) -> str:
    listed = join([str(number) for number in numbers])
    return {
        0: 'No claim holds',
        1: f'One claim (no. {listed}) holds',
    }.get(len(numbers), f'{len(numbers)} claims (no. {listed}) hold')
