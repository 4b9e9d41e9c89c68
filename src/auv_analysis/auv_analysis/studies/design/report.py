"""Report of a design: tables, page and terminal."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from auv_analysis.output.progress import TextConsole
from auv_analysis.output.text import Maths, capital, plain
from auv_analysis.report.document import Block, Section, Sentence, write_document
from auv_analysis.report.plots import FigureRecord
from auv_analysis.report.results import (
    Column,
    Results,
    Shown,
    Table,
    described,
    document_table,
    terminal,
)
from auv_analysis.studies.design.change import PART_WORDS
from auv_analysis.studies.design.plots import draw_design
from auv_analysis.studies.design.prediction import AT_REST, OTHERS, SIZE
from auv_analysis.studies.design.results import DesignStudy
from auv_analysis.studies.design.search import HALF, PART

NEAR = 1e-9  # relative: no change
PHASES = ('before', 'after')
REST = (
    ('weight', 'weight W', 'N'),
    ('buoyancy', 'buoyancy B', 'N'),
    ('weight_minus_buoyancy', 'W − B', 'N'),
    ('metacentric_height', 'z_G − z_B', 'm'),
    ('stability', 'static stability W z_G − B z_B', 'N m'),
    ('tilt_at_rest_deg', 'tilt at rest', 'deg'),
)
METHOD = tuple(
    map(
        Maths,
        (
            'Every coupling is judged by its share in the motion. A deformed velocity counts by '
            'the kinetic energy, Σ N_i ξ_i^2 = ν^T M ν, a deformed input by the dual of it, '
            'Σ π_i^2 / N_i = τ^T M^-1 τ; both are free of units. Unless a coupling is asked for, '
            'the one with the largest share is reduced.',
            'A change adds to M, to the restoring moment and to the damping; Υ follows from M. The '
            'search takes the motion of the simulated vehicle as it was and computes by (1) what '
            'input the changed vehicle would need for it. It makes small r² + '
            f'{OTHERS:g} (o² + e²) + {AT_REST:g} b + {SIZE:g} s, where r is the largest magnitude '
            'of the coupling (in place of it the mean of eighth powers, which is smooth), o the '
            'root sum square of the shares of the other couplings, e the root of the mean of '
            'τ^T M^-1 τ, each after by before, b what turns the vehicle from level at rest or '
            'rights it less, in proportion to what rights it, and s the size of the change. '
            'The search is SLSQP with central differences, within the bounds from several '
            'starts.',
            'Every change in the tables was then simulated with its own vehicle. Of those that '
            'halve the coupling the one with the lowest score is proposed, where every part that '
            f'is changed costs {PART:g}; where none does, the one that lowers it most.',
        ),
    )
)


def write_report(result: DesignStudy, out: Path) -> Path:
    """Write report.html with its figures and numbers.parquet; returns the path of the report."""
    document = result.document
    figures = draw_design(result, out / 'figures')
    listings = [
        (name, (out / name).read_text(encoding='utf-8'))
        for name in ('vehicle.yaml', 'vehicle_before.yaml', 'scenario.yaml')
    ]
    about = (
        f'{document["vehicle"]} in {document["scenario"]}, simulated with '
        f'{document["controller"]} ({document["hold"]})'
    )
    title = f'Design of {document["vehicle"]}'
    return write_document(
        out, title, about, [*_findings(result)], _sections(result, figures), listings
    )


def _findings(result: DesignStudy) -> Iterator[Sentence]:
    document = result.document
    source = 'table-measures' if document['measures'] else ''
    yield Sentence(document['statement'], source)
    for warning in document.get('warnings', ()):
        yield Sentence(f'{capital(warning)}.', 'proposal')


def _sections(result: DesignStudy, figures: Mapping[str, FigureRecord]) -> list[Section]:
    document = result.document
    if not document['measures']:
        return []
    results = Results('design', document)
    proposal: list[Block] = [
        *(f'{capital(words)}.' for words in document['proposal']['words']),
        parameters_table(results),
        figures['Upsilon'],
        rest_table(results),
    ]
    effect: list[Block] = [
        figures['couplings'],
        ranking_table(results),
        figures['reduced'],
        measures_table(results),
    ]
    others = controllers_table(results)
    effect += [] if others is None else [others]
    effect += [
        f'Under {name}: {one["failure"]}.'
        for name, one in document['controllers'].items()
        if one['failure']
    ]
    choice = [matrix_table(results), alternatives_table(results)]
    return [
        Section('proposal', 'The change', proposal),
        Section('effect', 'What it does', effect),
        Section('choice', 'Which change removes which coupling', choice),
        Section('method', 'How it was found', [*METHOD, *document['assumptions']]),
    ]


def print_design(document: Mapping[str, Any]) -> None:
    """Print what a design came to; `document` as in design.json."""
    out, results = TextConsole(highlight=False), Results('design', dict(document))
    if document['measures']:
        matrix = matrix_table(results)
        left = {part: replace(column, of=part) for part, column in matrix.shown.items()}
        for table in (measures_table(results), replace(matrix, shown=left)):
            out.print(terminal(table))
            out.print('')
    for text in (
        document['statement'],
        *(f'warning: {warning}' for warning in document.get('warnings', ())),
        f'folder: {document["folder"]}',
    ):
        out.print(text, markup=False, soft_wrap=True)


def measures_table(results: Results) -> Table:
    """Couplings, energy, effort and errors before and after, of the controller that decides."""
    document = results.facts
    target = document['reduce'].replace('.', '_max.')
    worse = {row['name'] for row in document['side_effects']}
    rows = _before_after(document['measures'], ('measures',))
    for row in rows:
        name = row['name']
        row['kind'] = 'bad' if name in worse else 'good' if name == target else ''
    shown: dict[str, Shown] = {
        'name': described('', 'metric of summary.json', kind='kind'),
        'before': described('before', 'with the vehicle as it is'),
        'after': described('after', 'with the changed vehicle'),
        'change': described('change', '"=": none; "new": there was none before', kind='kind'),
        'unit': 'unit',
    }
    caption = f'Metrics of the run under {document["controller"]} before and after the change.'
    return document_table(results, 'measures', caption, rows, shown)


def _before_after(
    measures: Sequence[Mapping[str, Any]], keys: tuple[str | int, ...]
) -> list[dict[str, Any]]:
    """Rows of metrics before and after, which stand at some keys of the document."""
    return [
        {
            'name': row['name'],
            **{phase: (*keys, i, phase) for phase in PHASES},
            'change': change(row['before'], row['after']) or None,
            'unit': row['unit'],
        }
        for i, row in enumerate(measures)
    ]


def ranking_table(results: Results) -> Table:
    """Couplings by their share in the motion."""
    rows = [
        {
            'coupling': row['coupling'],
            **{f'{k} {phase}': ('ranking', i, k, phase)
               for k in ('share', 'largest') for phase in PHASES},
            'unit': row['unit'],
        }
        for i, row in enumerate(results.facts['ranking'])
    ]  # fmt: skip
    share = Maths(
        'root of mean(N_i Δξ_i^2) / mean(ν^T M ν), or of mean(Δπ_i^2 / N_i) / mean(τ^T M^-1 τ)'
    )
    peak = 'largest magnitude over the run'
    shown: dict[str, Shown] = {
        'coupling': described('', 'coupling'),
        'share before': described('before', share, group='share'),
        'share after': Column('after', 'share'),
        'largest before': described('before', peak, group='largest'),
        'largest after': Column('after', 'largest'),
        'unit': 'unit',
    }
    caption = 'Couplings by their share in the motion: free of units, so that they can be compared.'
    return document_table(results, 'ranking', caption, rows, shown)


def matrix_table(results: Results) -> Table:
    """Remaining share of each coupling under the best change of each part."""
    alternatives = results.facts['alternatives']
    parts = list(dict.fromkeys(one['part'] for one in alternatives))
    rows: dict[str, dict[str, Any]] = {
        one['coupling']: {'coupling': one['coupling']} | {f'kind {part}': '' for part in parts}
        for one in alternatives
    }
    left = [(one['ratio'], i) for i, one in enumerate(alternatives) if one['ratio'] is not None]
    for ratio, i in sorted(left, reverse=True):  # the least one stays
        coupling, part = alternatives[i]['coupling'], alternatives[i]['part']
        rows[coupling][part] = 'alternatives', i, 'ratio'
        rows[coupling][f'kind {part}'] = 'good' if ratio <= HALF else ''
    shown: dict[str, Shown] = {
        'coupling': described('', 'coupling that the change was made for'),
        **{
            part: described(
                PART_WORDS[part], 'of it left, largest magnitude; –: cannot be run',
                decimals=1, scale=100.0, kind=f'kind {part}',
            )
            for part in parts
        },
    }  # fmt: skip
    caption = (
        'Which change removes which coupling: what the best change of each kind, made for that '
        'coupling alone, leaves of it. Every entry was simulated with its own vehicle.'
    )
    return document_table(results, 'matrix', caption, list(rows.values()), shown)


def alternatives_table(results: Results) -> Table:
    """The changes that were simulated for the coupling, beside their prediction."""
    reduced = results.facts['reduce']
    rows = [
        {
            'part': PART_WORDS[one['part']],
            **{key: ('alternatives', i, key) for key in ('predicted', 'ratio', 'score')},
            'values': ', '.join(f'{n} {plain(v, 5)}' for n, v in one['values'].items()) or 'none',
            'mark': one['failure'] or ('proposed' if one['proposed'] else ''),
        }
        for i, one in enumerate(results.facts['alternatives'])
        if one['coupling'] == reduced
    ]
    predicted = 'largest magnitude after by before, in an earlier run’s motion'
    shown: dict[str, Shown] = {
        'part': described('', 'what may change'),
        'predicted': described('predicted', predicted),
        'ratio': described('simulated', 'the same, by the changed vehicle’s own run'),
        'score': described('score', 'the objective function'),
        'values': described('values', 'm, kg and deg'),
        'mark': '',
    }
    caption = f'Changes against {reduced} that were simulated.'
    return document_table(results, 'alternatives', caption, rows, shown)


def parameters_table(results: Results) -> Table:
    """Parameters of the change, with their bounds."""
    rows = [
        {
            'name': one['name'],
            **{key: ('parameters', i, key) for key in ('value', 'lower', 'upper')},
            'unit': one['unit'],
            'at': one['at_bound'] or '',
            'reason': one['reason'],
            'kind': 'bad' if one['at_bound'] else '',
        }
        for i, one in enumerate(results.facts['parameters'])
    ]
    unchanged = '– where that part of the vehicle is not changed'
    shown: dict[str, Shown] = {
        'name': described('', 'parameter'),
        'value': described('value', unchanged, digits=4),
        'lower': Column('lower', digits=4),
        'upper': Column('upper', digits=4),
        'unit': 'unit',
        'at': described('at bound', 'the bound that the value lies on', kind='kind'),
        'reason': described('bounds', 'where they come from'),
    }
    caption = 'The change and the bounds that it was kept within.'
    return document_table(results, 'parameters', caption, rows, shown)


def rest_table(results: Results) -> Table:
    """The vehicle at rest before and after."""
    rows = [
        {'name': name, **{phase: ('at_rest', phase, key) for phase in PHASES}, 'unit': unit}
        for key, name, unit in REST
    ]
    shown: dict[str, Shown] = {
        'name': Column('', look='maths'), 'before': 'before', 'after': 'after', 'unit': 'unit'
    }  # fmt: skip
    caption = 'The vehicle at rest before and after the change.'
    return document_table(results, 'at_rest', caption, rows, shown)


def controllers_table(results: Results) -> Table | None:
    """Largest couplings and energy under the other controllers; None where there is no other."""
    rows = [
        {'controller': name, **row}
        for name, one in results.facts['controllers'].items()
        if name != results.facts['controller']
        for row in _before_after(one['measures'], ('controllers', name, 'measures'))
        if row['name'].startswith(('delta_', 'kinetic_energy.mean'))
    ]
    if not rows:
        return None
    shown: dict[str, Shown] = {
        'controller': 'controller', 'name': '', 'before': 'before', 'after': 'after',
        'change': 'change', 'unit': 'unit',
    }  # fmt: skip
    caption = 'The same change under the other controllers of the scenario.'
    return document_table(results, 'controllers', caption, rows, shown, stub=2)


def change(before: float | None, after: float | None) -> str:
    """Change in per cent as text; a dash where there is none to speak of."""
    if before is None or after is None:
        return ''
    if abs(after - before) <= NEAR * abs(before):
        return '='
    if before == 0:
        return 'new'
    text = f'{100 * (after / before - 1):+.1f} %'
    return '0.0 %' if text[1:] == '0.0 %' else text.replace('-', '−')
