"""The report of the atlas: a ranking, the couplings of each vehicle, and their effect in case 1."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.metrics.quantities import VELOCITY, WRENCH
from auv_analysis.output.text import Maths, join, number
from auv_analysis.report.document import Section, Sentence, write_document
from auv_analysis.report.plots import FigureRecord
from auv_analysis.report.results import Results, Shown, Table, described, document_table
from auv_analysis.studies.atlas.atlas import Chart, results_of
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
    """Write report.html of an atlas into an existing folder; returns its path."""
    results = results_of(charts)
    sections = [
        Section('strength', 'Strength', [
            MEASURE, ranking(results, charts), figures['strength'], figures['correlation'],
        ]),
        Section('structure', 'Which deforms which', [
            SHARES, figures['shares'], pairs(results, charts),
        ]),
        Section('case1', 'What case 1 reaches', [reached(results, charts, kind) for kind in KINDS]),
    ]  # fmt: skip
    title = 'Coupling atlas'
    names = join([chart.name for chart in charts])
    about = f'Couplings by inertia of {names}. All numbers: atlas.parquet and atlas.json.'
    return write_document(out, title, about, findings(charts), sections)


def findings(charts: Sequence[Chart]) -> list[Sentence]:
    """Sentences of the summary: strongest, without coupling, failures."""
    first = charts[0]
    found = []
    if not first.is_diagonal:
        i, j = first.pairs[0]
        found.append(
            f'Inertia couples {first.name} the most: cross terms reach '
            f'{number(PERCENT * first.strength)} % of the energy without them, of {i} and {j} '
            f'alone {number(PERCENT * first.largest)} %.'
        )
    sentences = [
        Sentence(text, 'table-ranking') for text in [*found, uncoupled(charts).strip()] if text
    ]
    failed = [chart.name for chart in charts if chart.reached['failure']]
    if failed:
        text = f'Case 1 diverges on {join(failed)}, which therefore have no peaks.'
        sentences.append(Sentence(text, 'case1'))
    return sentences


def ranking(results: Results, charts: Sequence[Chart]) -> Table:
    """Vehicles by the strength of their coupling."""
    shown: dict[str, Shown] = {
        'vehicle': 'vehicle',
        'strength_percent': described(
            'strength', 'largest part of all cross terms, of the energy without them', '%'
        ),
        'largest_correlation_percent': described(
            'largest pair', 'largest inertial correlation of two degrees of freedom', '%'
        ),
        'between': described('between', 'the two that it couples'),
        'pair_count': described('pairs', 'pairs that inertia couples, of 15'),
        'delta_xi': described('Δξ always zero', 'velocities that no motion deforms'),
        'delta_pi': described('Δπ always zero', 'inputs that nothing deforms'),
        'damped': described('damping couples', 'pairs that the damping of the file couples'),
    }
    numbers = ('strength_percent', 'largest_correlation_percent', 'pair_count')
    rows = [
        {
            'vehicle': chart.name,
            **{key: ('vehicles', chart.name, key) for key in numbers},
            'between': '–'.join(chart.pairs[0]) if chart.pairs else 'none',
            **{kind: _words(chart.zeros[kind]) for kind in KINDS},
            'damped': ', '.join('–'.join(pair) for pair in chart.damped) or 'none',
        }
        for chart in charts
    ]
    caption = 'Vehicles by the strength of inertial coupling.'
    return document_table(results, 'ranking', caption, rows, shown)


def _words(dofs: Sequence[str]) -> str:
    return 'all six' if len(dofs) == 6 else ', '.join(dofs)


def pairs(results: Results, charts: Sequence[Chart]) -> Table:
    """Every pair that inertia couples, of every vehicle, the strongest first."""
    shown: dict[str, Shown] = {
        'vehicle': 'vehicle',
        'deformed': described('deformed', 'the one whose velocity component is deformed'),
        'by': described('by', 'the one that deforms it'),
        'correlation': described(
            'correlation', Maths('inertial correlation M_ij / sqrt(M_ii M_jj)')
        ),
        'entry': described(
            'Δξ per velocity', Maths('entry of Υ^-1: Δξ of the one per velocity of the other')
        ),
        'unit': 'its unit',
        'velocity': described(
            'Δξ share', 'of the energy of a motion of "by" alone, found in "deformed"', '%'
        ),
        'input': described(
            'Δπ share', 'of the energy that an impulse in "deformed" alone leaves, in "by"', '%'
        ),
    }
    rows = []
    for chart in charts:
        base = 'vehicles', chart.name
        for first, second in chart.pairs:
            i, j = DOFS.index(first), DOFS.index(second)
            rows.append({
                'vehicle': chart.name, 'deformed': first, 'by': second,
                'correlation': (*base, 'correlation', i, j),
                'entry': (*base, 'Upsilon_inv', i, j),
                'unit': f'{VELOCITY[i // 3]} per {VELOCITY[j // 3]}',
                'velocity': (*base, 'velocity_shares_percent', i, j),
                'input': (*base, 'input_shares_percent', j, i),
            })  # fmt: skip
    caption = 'Pairs that inertia couples, the strongest of each vehicle first.'
    return document_table(results, 'pairs', caption, rows, shown, stub=3)


def reached(results: Results, charts: Sequence[Chart], kind: str) -> Table:
    """Peaks of a deformation in case 1 scaled to each vehicle."""
    symbol, units = KINDS[kind]
    shown: dict[str, Shown] = {'vehicle': 'vehicle'}
    shown |= {dof: described(dof, '', units[i // 3], group=symbol) for i, dof in enumerate(DOFS)}
    if kind == 'delta_xi':
        meaning = 'largest 1/2 N_i Δξ_i^2 of the six at its peak, of the mean kinetic energy'
        shown['energy'] = described('energy', Maths(meaning), '%')
    rows: list[dict[str, Any]] = []
    for chart in charts:
        if chart.reached['failure']:
            continue
        base, always = ('vehicles', chart.name, 'case1'), chart.zeros[kind]
        peaks = {d: (*base, f'{kind}_max', i) for i, d in enumerate(DOFS) if d not in always}
        energy = int(np.argmax(chart.reached['delta_xi_energy_percent']))
        most = {'energy': (*base, 'delta_xi_energy_percent', energy)}
        rows.append({'vehicle': chart.name} | peaks | most)
    caption = f'Largest {symbol} in case 1 scaled to each vehicle, under GVC.'
    note = 'En dash: zero for every motion, by the structure of M.'
    return document_table(results, f'case1_{kind}', caption, rows, shown, note=note)
