"""The tables of a design's report, every number with its place in design.json."""

from collections.abc import Mapping
from typing import Any

from auv_analysis.output.text import MISSING, Maths, plain
from auv_analysis.report.document import Cell, Column, Table, cell, percent
from auv_analysis.studies.design.change import part_words
from auv_analysis.studies.design.printed import change

FILE = 'design.json:'
Document = Mapping[str, Any]
PHASES = ('before', 'after')


def measures_table(document: Document) -> Table:
    """Couplings, energy, effort and errors before and after, of the controller that decides."""
    target = document['reduce'].replace('.', '_max.')
    worse = {row['name'] for row in document['side_effects']}
    rows = []
    for i, row in enumerate(document['measures']):
        cells = [cell(row[key], f'{FILE}/measures/{i}/{key}') for key in PHASES]
        kind = 'paper' if row['name'] == target else ''
        bad = 'bad' if row['name'] in worse else ''
        changed = Cell(change(row['before'], row['after']) or MISSING, kind=bad)
        rows.append([Cell(row['name'], kind=kind), *cells, changed, Cell(row['unit'])])
    caption = f'Figures of the run under {document["controller"]} before and after the change.'
    columns = (
        Column('', meaning='figure of summary.json', numeric=False),
        Column('before', meaning='with the vehicle as it is'),
        Column('after', meaning='with the changed vehicle'),
        Column('change', meaning='"=": none; "new": there was none before'),
        Column('unit', numeric=False),
    )
    return Table('measures', caption, columns, rows)


def ranking_table(document: Document) -> Table:
    """Couplings by their share in the motion."""
    rows = []
    for i, row in enumerate(document['ranking']):
        where = f'{FILE}/ranking/{i}'
        shares = [cell(row['share'][key], f'{where}/share/{key}') for key in PHASES]
        peaks = [cell(row['largest'][key], f'{where}/largest/{key}') for key in PHASES]
        rows.append([Cell(row['coupling']), *shares, *peaks, Cell(row['unit'])])
    meaning = Maths(
        'root of mean(N_i Δξ_i^2) / mean(ν^T M ν), or of mean(Δπ_i^2 / N_i) / mean(τ^T M^-1 τ)'
    )
    columns = (
        Column('', meaning='coupling', numeric=False),
        Column('before', meaning=meaning, group='share'),
        Column('after', group='share'),
        Column('before', meaning='largest magnitude over the run', group='largest'),
        Column('after', group='largest'),
        Column('unit', numeric=False),
    )
    caption = 'Couplings by their share in the motion: free of units, so that they can be compared.'
    return Table('ranking', caption, columns, rows)


def matrix_table(document: Document) -> Table:
    """What the best change of each part leaves of each coupling."""
    found: dict[str, dict[str, tuple[float, int]]] = {}
    for i, one in enumerate(document['alternatives']):
        row = found.setdefault(one['coupling'], {})
        if one['ratio'] is not None:
            row[one['part']] = min((one['ratio'], i), row.get(one['part'], (one['ratio'], i)))
    parts = list(dict.fromkeys(one['part'] for one in document['alternatives']))
    rows = []
    for coupling, row in found.items():
        cells = []
        for part in parts:
            ratio, i = row.get(part, (None, 0))
            where = f'{FILE}/alternatives/{i}/ratio'
            good = 'good' if ratio is not None and ratio <= 0.5 else ''
            shown = percent(ratio, where, kind=good)
            cells.append(Cell('cannot be run') if ratio is None else shown)
        rows.append([Cell(coupling), *cells])
    columns = [
        Column('', meaning='coupling that the change was made for', numeric=False),
        *(Column(part_words(part), '%', 'of it left, largest magnitude') for part in parts),
    ]
    caption = (
        'Which change removes which coupling: what the best change of each kind, made for that '
        'coupling alone, leaves of it. Every entry was simulated with its own vehicle.'
    )
    return Table('matrix', caption, columns, rows)


def alternatives_table(document: Document) -> Table:
    """The changes that were simulated for the coupling, beside their prediction."""
    rows = []
    for i, one in enumerate(document['alternatives']):
        if one['coupling'] != document['reduce']:
            continue
        where = f'{FILE}/alternatives/{i}'
        values = ', '.join(f'{name} {plain(value, 5)}' for name, value in one['values'].items())
        mark = 'proposed' if one['proposed'] else ''
        rows.append(
            [
                Cell(part_words(one['part']), kind='paper' if one['proposed'] else ''),
                cell(one['predicted'], f'{where}/predicted'),
                cell(one['ratio'], f'{where}/ratio'),
                cell(one['score'], f'{where}/score'),
                Cell(values or 'none', figures=one['values'], source=f'{where}/values'),
                Cell(one['failure'] or mark),
            ]
        )
    columns = (
        Column('', meaning='what may change', numeric=False),
        Column('predicted', '', 'largest magnitude after by before, in an earlier run’s motion'),
        Column('simulated', '', 'the same, by the changed vehicle’s own run'),
        Column('score', '', 'what the search makes small'),
        Column('values', meaning='m, kg and deg', numeric=False),
        Column('', numeric=False),
    )
    caption = f'Changes against {document["reduce"]} that were simulated.'
    return Table('alternatives', caption, columns, rows)


def parameters_table(document: Document) -> Table:
    """Parameters of the change, with their bounds."""
    rows = []
    for i, one in enumerate(document['parameters']):
        where = f'{FILE}/parameters/{i}'
        cells = [cell(one[key], f'{where}/{key}', digits=4) for key in ('value', 'lower', 'upper')]
        at = Cell(one['at_bound'] or '', kind='bad' if one['at_bound'] else '')
        rows.append([Cell(one['name']), *cells, Cell(one['unit']), at, Cell(one['reason'])])
    columns = (
        Column('', meaning='parameter', numeric=False),
        Column('value', meaning='– where that part of the vehicle is not changed'),
        Column('lower'),
        Column('upper'),
        Column('unit', numeric=False),
        Column('at bound', meaning='the bound that the value lies on', numeric=False),
        Column('bounds', meaning='where they come from', numeric=False),
    )
    return Table('parameters', 'The change and the bounds that it was kept within.', columns, rows)


REST = (
    ('weight', 'weight W', 'N'),
    ('buoyancy', 'buoyancy B', 'N'),
    ('weight_minus_buoyancy', 'W − B', 'N'),
    ('metacentric_height', Maths('z_G − z_B'), 'm'),
    ('stability', Maths('static stability W z_G − B z_B'), 'N m'),
    ('tilt_at_rest_deg', 'tilt at rest', 'deg'),
)


def rest_table(document: Document) -> Table:
    """The vehicle at rest before and after."""
    rest = document['at_rest']
    rows = [
        [
            Cell(name),
            *(cell(rest[phase][key], f'{FILE}/at_rest/{phase}/{key}') for phase in PHASES),
            Cell(unit),
        ]
        for key, name, unit in REST
    ]
    columns = (
        Column('', numeric=False), Column('before'), Column('after'),
        Column('unit', numeric=False),
    )  # fmt: skip
    return Table('at_rest', 'The vehicle at rest before and after the change.', columns, rows)


def controllers_table(document: Document) -> Table | None:
    """Largest couplings and energy under the other controllers; None where there is no other."""
    others = {n: one for n, one in document['controllers'].items() if n != document['controller']}
    rows = []
    for name, one in others.items():
        for i, row in enumerate(one['measures']):
            if not row['name'].startswith(('delta_', 'kinetic_energy.mean')):
                continue
            where = f'{FILE}/controllers/{name}/measures/{i}'
            cells = [cell(row[key], f'{where}/{key}') for key in PHASES]
            changed = Cell(change(row['before'], row['after']) or MISSING)
            rows.append([Cell(name), Cell(row['name']), *cells, changed, Cell(row['unit'])])
    if not rows:
        return None
    columns = (
        Column('controller', numeric=False), Column('', numeric=False), Column('before'),
        Column('after'), Column('change'), Column('unit', numeric=False),
    )  # fmt: skip
    caption = 'The same change under the other controllers of the scenario.'
    return Table('controllers', caption, columns, rows, stub=2)
