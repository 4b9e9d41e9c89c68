"""The report of the atlas: a ranking, who is coupled to whom, and what case 1 makes of it."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from auv_analysis.output.text import Maths, join, number
from auv_analysis.report.document import (
    Cell,
    Column,
    Section,
    Sentence,
    Table,
    cell,
    write_document,
)
from auv_analysis.report.plots import ALWAYS, FigureRecord
from auv_analysis.report.tables.sources import VELOCITY, WRENCH, count, pointer
from auv_analysis.studies.atlas.atlas import DOCUMENT, TABLE, Chart
from auv_analysis.studies.atlas.plots import uncoupled
from auv_dynamics.vehicle import DOFS

PERCENT = 100.0
KINDS = {'delta_xi': ('Δξ', VELOCITY), 'delta_pi': ('Δπ', WRENCH)}
MEASURE = Maths(
    'With D = diag(M), the kinetic energy is 1/2 ν^T M ν = 1/2 y^T R y with y = D^1/2 ν and the '
    'inertial correlation R = D^-1/2 M D^-1/2. R is 1 on its diagonal; what is beside it are cross '
    'terms. R_ij is the largest part that the cross term of i and j can have of their energies '
    'without it, and the strength, the largest magnitude of an eigenvalue of R - 1, is that of all '
    'cross terms together. Units of length, mass or angle change neither. Both are those of the '
    'origin and the axes of the vehicle file: another origin couples otherwise.'
)
SHARES = Maths(
    'The decomposition M = Upsilon^-T N Upsilon^-1 spreads the energy 1/2 M_jj ν_j^2 of a motion '
    'in j alone over its components: 1/2 N_i ξ_i^2 is the share N_i (Upsilon^-1)_ij^2 / M_jj of '
    'it. An impulse in j alone leaves the share Upsilon_ji^2 / (N_i (M^-1)_jj) in component i. '
    'Each column sums to 100 %; what is not on the diagonal is deformation, (33) and (34).'
)


def write_report(out: Path, charts: Sequence[Chart], figures: Mapping[str, FigureRecord]) -> Path:
    """Write report.html of an atlas; returns its path.

    Parameters
    ----------
    out : folder, existing
    charts : of `charts`
    figures : of `draw`

    """
    sections = [
        Section('strength', 'Strength', [MEASURE, ranking(charts), figures['strength'],
                                         figures['correlation']]),
        Section('structure', 'Which deforms which', [SHARES, figures['shares'], pairs(charts)]),
        Section('case1', 'What case 1 reaches', [reached(charts, 'delta_xi'),
                figures['case1_delta_xi'], reached(charts, 'delta_pi'),
                figures['case1_delta_pi']]),
    ]  # fmt: skip
    title = 'Coupling atlas'
    names = join([chart.name for chart in charts])
    about = f'Couplings by inertia of {names}. All numbers: {TABLE} and {DOCUMENT}.'
    return write_document(out, title, about, findings(charts), sections)


def findings(charts: Sequence[Chart]) -> list[Sentence]:
    """Sentences of the summary: strongest, without coupling, largest deformations, failures."""
    first = charts[0].couplings
    found = []
    if not first.is_diagonal:
        i, j = first.pairs[0]
        found.append(
            f'Inertia couples {first.name} the most: cross terms reach '
            f'{number(PERCENT * first.strength)} % of the energy without them, of {i} and {j} '
            f'alone {number(PERCENT * first.largest)} %.'
        )
    sentences = [Sentence(text, 'table-ranking') for text in [*found, uncoupled(charts)] if text]
    ran = [chart for chart in charts if not chart.reached['failure']]
    for kind, (symbol, units) in KINDS.items():
        sentences += _largest(ran, kind, symbol, units)
    failed = [chart.name for chart in charts if chart.reached['failure']]
    if failed:
        text = f'Case 1 diverges on {join(failed)}, which therefore have no peaks.'
        sentences.append(Sentence(text, 'case1'))
    return sentences


def _largest(ran: Sequence[Chart], kind: str, symbol: str, units: Sequence[str]) -> list[Sentence]:
    parts = []
    for half, unit in zip((range(3), range(3, 6)), units, strict=True):
        peaks = [(chart.reached[f'{kind}_max'][i], chart.name, DOFS[i])
                 for chart in ran for i in half]  # fmt: skip
        value, name, dof = max(peaks, default=(0.0, '', ''))
        if value > 0:
            parts.append(f'{number(value)} {unit} ({name}, {dof})')
    if not parts:
        return []
    text = f'In case 1 scaled to each vehicle, {symbol} reaches at most {join(parts)}.'
    return [Sentence(text, f'table-case1_{kind}')]


def ranking(charts: Sequence[Chart]) -> Table:
    """Vehicles by the strength of their coupling."""
    columns = [
        Column('vehicle', numeric=False),
        Column('strength', '%', 'largest part of all cross terms, of the energy without them'),
        Column('largest pair', '%', 'largest inertial correlation of two degrees of freedom'),
        Column('between', '', 'the two that it couples', numeric=False),
        Column('pairs', '', 'pairs that inertia couples, of 15'),
        Column('Δξ always zero', '', 'velocities that no motion deforms', numeric=False),
        Column('Δπ always zero', '', 'inputs that nothing deforms', numeric=False),
        Column('damping couples', '', 'pairs that the damping of the file couples', numeric=False),
    ]
    rows = []
    for chart in charts:
        known, base = chart.couplings, pointer(DOCUMENT, 'vehicles', chart.name)
        rows.append((
            Cell(chart.name, remark='Upsilon = I' if known.is_diagonal else ''),
            cell(PERCENT * known.strength, f'{base}/strength_percent'),
            cell(PERCENT * known.largest, f'{base}/largest_correlation_percent'),
            Cell('–'.join(known.pairs[0]) if known.pairs else 'none'),
            count(len(known.pairs), f'{base}/pair_count'),
            *(Cell(_words(known.zeros[kind])) for kind in KINDS),
            Cell(', '.join('–'.join(pair) for pair in known.damped) or 'none'),
        ))  # fmt: skip
    return Table('ranking', 'Vehicles by the strength of inertial coupling.', columns, rows)


def _words(dofs: Sequence[str]) -> str:
    return 'all six' if len(dofs) == 6 else ', '.join(dofs)


def pairs(charts: Sequence[Chart]) -> Table:
    """Every pair that inertia couples, of every vehicle, the strongest first."""
    columns = [
        Column('vehicle', numeric=False),
        Column('deformed', '', 'the one whose velocity component is deformed', numeric=False),
        Column('by', '', 'the one that deforms it', numeric=False),
        Column('correlation', '', Maths('inertial correlation M_ij / sqrt(M_ii M_jj)')),
        Column(
            'Δξ per velocity',
            '',
            Maths('entry of Υ^-1: Δξ of the one per velocity of the other'),
        ),
        Column('its unit', '', numeric=False),
        Column('Δξ share', '%', 'of the energy of a motion of "by" alone, found in "deformed"'),
        Column(
            'Δπ share', '%', 'of the energy that an impulse in "deformed" alone leaves, in "by"'
        ),
    ]
    rows = []
    for chart in charts:
        known, base = chart.couplings, pointer(DOCUMENT, 'vehicles', chart.name)
        for first, second in known.pairs:
            i, j = DOFS.index(first), DOFS.index(second)
            rows.append((
                Cell(chart.name), Cell(first), Cell(second),
                cell(known.correlation[i, j], f'{base}/correlation/{i}/{j}'),
                cell(known.Upsilon_inv[i, j], f'{base}/Upsilon_inv/{i}/{j}'),
                Cell(f'{VELOCITY[i // 3]} per {VELOCITY[j // 3]}'),
                cell(PERCENT * known.velocity_shares[i, j],
                     f'{base}/velocity_shares_percent/{i}/{j}'),
                cell(PERCENT * known.input_shares[j, i], f'{base}/input_shares_percent/{j}/{i}'),
            ))  # fmt: skip
    caption = 'Pairs that inertia couples, the strongest of each vehicle first.'
    return Table('pairs', caption, columns, rows, stub=3)


def reached(charts: Sequence[Chart], kind: str) -> Table:
    """Peaks of a deformation in case 1 scaled to each vehicle."""
    symbol, units = KINDS[kind]
    columns = [Column('vehicle', numeric=False)]
    columns += [Column(dof, units[i // 3], group=symbol) for i, dof in enumerate(DOFS)]
    if kind == 'delta_xi':
        meaning = 'largest 1/2 N_i Δξ_i^2 of the six at its peak, of the mean kinetic energy'
        columns.append(Column('energy', '%', Maths(meaning)))
    rows = [_peaks(chart, kind) for chart in charts if not chart.reached['failure']]
    caption = f'Largest {symbol} in case 1 scaled to each vehicle, under GVC.'
    note = f'{ALWAYS}: zero for every motion, by the structure of M.'
    return Table(f'case1_{kind}', caption, columns, rows, note=note)


def _peaks(chart: Chart, kind: str) -> tuple[Cell, ...]:
    base, always = pointer(DOCUMENT, 'vehicles', chart.name, 'case1'), chart.couplings.zeros[kind]
    cells = [Cell(chart.name)]
    for i, dof in enumerate(DOFS):
        value, source = chart.reached[f'{kind}_max'][i], f'{base}/{kind}_max/{i}'
        cells.append(Cell(ALWAYS, 0.0, source, 'zero') if dof in always else cell(value, source))
    if kind == 'delta_xi':
        shares = chart.reached['delta_xi_energy_percent']
        i = max(range(6), key=shares.__getitem__)
        cells.append(cell(shares[i], f'{base}/delta_xi_energy_percent/{i}'))
    return tuple(cells)
