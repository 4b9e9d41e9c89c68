"""The report of a tuning."""

from pathlib import Path

from rich.table import Table

from auv_analysis.output.new_files import write_json
from auv_analysis.output.progress import console, say
from auv_analysis.output.text import Maths, number
from auv_analysis.report.document import Block, Section, write_document
from auv_analysis.studies.tune import tables
from auv_analysis.studies.tune.plots import pictures
from auv_analysis.studies.tune.results import (
    MONTE_CARLO,
    SEARCH,
    Tuning,
    write_draws,
    write_search,
)
from auv_analysis.studies.tune.search import FINALISTS, LONG, POINTS, SHORT, STARTS
from auv_analysis.studies.tune.verdict import verdict

MEASURES = (
    'Error and effort are weighted by the inertia, so that metres and radians, newtons and newton '
    'metres add up without chosen weights, and both are the same in every body frame. The '
    'time-weighted error is what the search makes small unless --index says otherwise: the plain '
    'mean is decided by the first moments, in which a law has its gain and nothing else.'
)
FAIR = (
    'Every law was given the same search: the reference’s gains in the units of the law, the '
    f'middle of the bounds and {POINTS} Sobol points over all its gains (of six numbers per gain, '
    'the best multiple of the inertia instead), then sequential quadratic programming with the '
    'equality as a constraint, '
    f'{SHORT} gradients from each of the best {STARTS} points and {LONG} from the best {FINALISTS} '
    'of these at most; a gradient of a law with more gains takes more loops. '
    'The reference’s own law takes part, '
    'since its gains in the scenario were not searched: against it, what is left is the law’s.'
)
PERIOD = Maths(
    'No velocity loop may be faster than the control period carries: lambda_max(M^-1 K_D) times '
    'the step stays at or below 1, or at the reference’s own value where that is above.'
)
SAME_LAW = (
    'With gains that are multiples of the full M (--structure inertia), CL and GVC are one and the '
    'same law: what tells them apart is the off-diagonal part of their gains alone.'
)


DOCUMENT = 'tune.json'


def write_report(tuning: Tuning, out: Path) -> Path:
    """Write tune.json, search.parquet, monte_carlo.parquet and report.html with its figures.

    Parameters
    ----------
    tuning : of `tune`
    out : its folder, with scenario.yaml

    Returns
    -------
    path : of report.html

    """
    findings = verdict(tuning)
    document = tuning.document
    document['verdict'] = [{'text': s.text, 'source': s.source} for s in findings]
    write_json(out / DOCUMENT, document)
    write_search(out / SEARCH, tuning.laws)
    if tuning.draws:
        write_draws(out / MONTE_CARLO, tuning.draws)
    figures = pictures(tuning, out / 'figures')
    listings = [('scenario.yaml', (out / 'scenario.yaml').read_text(encoding='utf-8'))]
    drawn = {figure.name: figure for figure in figures}
    deviation = document['validation']['largest_relative_deviation']
    checked = (
        'Single runs of scenario.yaml by auv simulate’s kernel give the same numbers: the largest '
        f'relative deviation is {deviation:.1g}.'
    )
    tuned: list[Block] = [
        FAIR,
        tables.tuned_table(document),
        drawn['trade_off'],
        tables.gains_table(document),
        checked,
    ]
    draws: list[Block] = []
    if document['monte_carlo']:
        draws = [
            tables.spread_table(document),
            drawn['draws'],
            drawn['paired'],
            tables.draws_table(document),
            tables.paired_table(document),
        ]
    sections = [
        Section('tuned', 'Tuned alike', tuned),
        Section('random', 'The same random changes for all', draws),
        Section('basis', 'What this rests on', [
            MEASURES, PERIOD, SAME_LAW, tables.allowed_table(document),
        ]),
    ]  # fmt: skip
    about = (
        f'{document["vehicle"]}, reference {document["reference"]}, equal {document["equal"]} '
        f'within {100 * document["tolerance"]:g} %, hold {document["hold"]}, '
        f'seed {document["seed"]}'
    )
    title = f'Tuning of {document["scenario"]}'
    return write_document(out, title, about, findings, sections, listings)


def print_tuning(tuning: Tuning) -> None:
    """Print the controllers with their measures, and what the tuning found."""
    document = tuning.document
    table = Table(box=None, header_style='bold')
    index = document['index']
    heads = ('controller', 'structure', 'error, J', 'effort, J/s²', 'from equality', 'settled')
    for head in heads:
        table.add_column(head)
    table.add_column('ratio over draws')
    medians = {
        c['controller']: c
        for c in (document['monte_carlo'] or {}).get('comparisons', [])
        if c['measure'] == index and c['against'] == document['reference']
    }
    for name, entry in document['controllers'].items():
        measures, compared = entry['measures'], medians.get(name)
        settled, equality = measures['settling'], entry['equality']
        table.add_row(
            name,
            entry.get('structure', 'as given'),
            number(measures[index]),
            number(measures['effort'], 4),
            '–' if equality is None else f'{100 * equality:+.3f} %',
            'not all' if settled is None else f'{settled:.2f} s',
            '' if compared is None else number(compared['ratio']),
        )
    console.print(table)
    for sentence in document['verdict']:
        say(sentence['text'])
