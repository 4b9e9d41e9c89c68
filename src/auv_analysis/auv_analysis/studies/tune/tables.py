"""The tables of a tuning's report; their numbers stand in `tune.json`."""

from collections.abc import Mapping
from typing import Any

from auv_analysis.output.text import MISSING, Maths, symbol
from auv_analysis.report.document import Cell, Column, Table, cell, percent
from auv_analysis.report.scenario_text import gain_text
from auv_analysis.studies.tune.cost import MEANINGS, Measures
from auv_analysis.studies.tune.verdict import p_text

SPREADS = {
    'mass': (Maths('relative error of M_RB and of the weight'), ''),
    'added_mass': (Maths('relative error of M_A'), ''),
    'damping': (Maths('relative error of D; without M_RB and M_A apart, of its linear part'), ''),
    'buoyancy': ('relative error of the buoyancy', ''),
    'inertia': ('relative error of M along each of its directions, drawn as well', ''),
    'disturbance': ('relative change of the scenario’s own disturbance', ''),
    'waves': (Maths('amplitude of an added harmonic force on each axis, per M_ii'), 'm/s², rad/s²'),
    'current': ('speed of an added constant horizontal current of any heading', 'm/s'),
}  # fmt: skip
CONTROLLER = Column('controller', meaning='as in scenario.yaml of this folder', numeric=False)


def source(*keys: object) -> str:
    """Where a number stands in tune.json."""
    parts = (str(key).replace('~', '~0').replace('/', '~1') for key in keys)
    return f'tune.json:/{"/".join(parts)}'


def tuned_table(document: Mapping[str, Any]) -> Table:
    """Measures of every controller in the scenario itself."""
    columns = [
        CONTROLLER,
        Column('law', numeric=False),
        Column('structure', meaning='what its gains multiply', numeric=False),
        *(Column(m.label, m.unit, m.text) for m in MEANINGS.values()),
        Column('from equality', '%', f'distance of the {document["equal"]} from the reference’s'),
        Column('price', '', 'relative change of the one measure per relative change of the other'),
    ]
    rows = []
    for name, entry in document['controllers'].items():
        at = 'controllers', name
        measures = [
            cell(entry['measures'][m], source(*at, 'measures', m), digits=4)
            for m in Measures._fields
        ]
        ordered = dict(zip(Measures._fields, measures, strict=True))
        rows.append([
            Cell(name),
            Cell(entry['law']),
            Cell(entry.get('structure', 'as given')),
            *(ordered[m] for m in MEANINGS),
            percent(entry['equality'], source(*at, 'equality'), digits=2),
            cell(entry.get('price'), source(*at, 'price')),
        ])  # fmt: skip
    caption = 'The scenario itself: what each controller costs and what it achieves.'
    return Table('tuned', caption, columns, rows)


def gains_table(document: Mapping[str, Any]) -> Table:
    """Gains of every controller."""
    entries = document['controllers']
    gains = list(dict.fromkeys(gain for entry in entries.values() for gain in entry['gains']))
    columns = [
        CONTROLLER,
        Column('law', numeric=False),
        *(Column(symbol(g), numeric=False) for g in gains),
        Column('remarks', meaning='bounds, adaptation, commands', numeric=False),
    ]
    rows = [
        [
            Cell(name),
            Cell(entry['law']),
            *(
                Cell(
                    gain_text(entry['gains'][gain]),
                    source=source('controllers', name, 'gains', gain),
                )
                if gain in entry['gains']
                else Cell(MISSING)
                for gain in gains
            ),
            Cell('; '.join(entry['remarks']), kind='bad' if entry['remarks'] else ''),
        ]
        for name, entry in entries.items()
    ]
    note = 'In full digits in scenario.yaml, on which auv run and auv simulate repeat them.'
    return Table('gains', 'Gains, as the laws take them.', columns, rows, note=note)


def allowed_table(document: Mapping[str, Any]) -> Table:
    """What was searched."""
    columns = [
        CONTROLLER,
        Column('structure', numeric=False),
        Column('gain', numeric=False),
        Column('from'),
        Column('to'),
        Column('stands for', numeric=False),
        Column('loops', meaning='closed loops that this search ran'),
        Column('least found', MEANINGS[_small(document)].unit, 'of what is made small'),
    ]
    rows = []
    for name, entry in document['controllers'].items():
        for i, search in enumerate(entry.get('searches', [])):
            at = 'controllers', name, 'searches', i
            least = search['measures'][_small(document)] if search['reached'] else None
            for gain, about in search['searched'].items():
                here = *at, 'searched', gain
                times = _times(search['structure']) if about['times_inertia'] else 'itself'
                rows.append([
                    Cell(name), Cell(search['structure']), Cell(symbol(gain)),
                    cell(about['low'], source(*here, 'low')),
                    cell(about['high'], source(*here, 'high')),
                    Cell(times),
                    cell(search['evaluations'], source(*at, 'evaluations'), digits=4),
                    cell(least, source(*at, 'measures', _small(document)), digits=4),
                ])  # fmt: skip
    caption = (
        'What the search was allowed: bounds of each gain, in units of 1/s to the power it has.'
    )
    return Table('allowed', caption, columns, rows, stub=3)


def _small(document: Mapping[str, Any]) -> str:
    return document['index'] if document['equal'] == 'effort' else 'effort'


def _times(structure: str) -> str:
    words = {
        'scalar': 'times the smallest to the largest M_ii: one number',
        'mass': 'times M_ii of each axis',
        'diagonal': 'times M_ii of each axis, six numbers',
        'inertia': 'times M',
    }
    return Maths(words[structure])


def draws_table(document: Mapping[str, Any]) -> Table:
    """Quantiles of the measures over the draws."""
    shown = {'q05': '5 %', 'median': 'median', 'q95': '95 %'}
    columns = [
        CONTROLLER,
        *(
            Column(label, m.unit, group=m.label)
            for m in MEANINGS.values()
            for label in shown.values()
        ),
        Column('settled', '%', 'share of the draws in which all errors end inside their bands'),
        Column('diverged', '%', 'share of the draws'),
    ]
    rows = []
    for name, entry in document['monte_carlo']['controllers'].items():
        at = 'monte_carlo', 'controllers', name
        quantiles = [cell(entry[m][q], source(*at, m, q)) for m in MEANINGS for q in shown]
        shares = [percent(entry[key], source(*at, key)) for key in ('settled', 'diverged')]
        rows.append([Cell(name), *quantiles, *shares])
    count = document['monte_carlo']['samples']
    return Table('draws', f'Over {count} draws, the same for all.', columns, rows)


def paired_table(document: Mapping[str, Any]) -> Table:
    """Paired comparisons."""
    columns = [
        CONTROLLER,
        Column('against', numeric=False),
        Column('measure', numeric=False),
        Column('ratio', '', 'of controller to against over the draws, after Hodges and Lehmann'),
        Column('from', '', '95 % interval of that ratio, by the test'),
        Column('to'),
        Column('effect', '', 'rank-biserial correlation, −1 to 1; its sign says who is smaller'),
        Column('smaller', '%', 'share of the draws in which the controller’s is smaller'),
        Column('larger', '%'),
        Column(
            'p', '', 'Wilcoxon signed-rank test of the log ratios, two-sided, Holm’s correction'
        ),
    ]
    rows = []
    for i, c in enumerate(document['monte_carlo']['comparisons']):
        at = 'monte_carlo', 'comparisons', i
        low, high = c['interval'] or (None, None)
        rows.append([
            Cell(c['controller']), Cell(c['against']), Cell(MEANINGS[c['measure']].label),
            cell(c['ratio'], source(*at, 'ratio')),
            cell(low, source(*at, 'interval', 0)),
            cell(high, source(*at, 'interval', 1)),
            cell(c['effect'], source(*at, 'effect')),
            *(percent(c[k], source(*at, k)) for k in ('smaller', 'larger')),
            Cell(p_text(c['p_holm']), c['p_holm'], source(*at, 'p_holm'),
                 kind={-1: 'good', 1: 'bad', 0: ''}[c['verdict']]),
        ])  # fmt: skip
    note = (
        f'The correction is for all {len(rows)} rows. Draws are made, not found: their number '
        'makes any p small in the end, so that the ratio and its interval are what counts.'
    )
    caption = 'Paired over the draws, in every measure that exists.'
    return Table('paired', caption, columns, rows, stub=3, note=note)


def spread_table(document: Mapping[str, Any]) -> Table:
    """What is drawn, and how far."""
    columns = [Column('name', numeric=False), Column('drawn uniformly', numeric=False),
               Column('up to'), Column('unit', numeric=False)]  # fmt: skip
    rows = [
        [Cell(name), Cell(SPREADS[name][0]), cell(value, source('monte_carlo', 'spread', name)),
         Cell(SPREADS[name][1])]
        for name, value in document['monte_carlo']['spread'].items()
    ]  # fmt: skip
    return Table(
        'spread', 'What is drawn; relative errors and changes of either sign.', columns, rows
    )
