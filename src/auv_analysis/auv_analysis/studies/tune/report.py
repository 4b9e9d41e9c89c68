"""Report of a tuning: findings, tables, page and terminal."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from auv_analysis.metrics.quantities import COSTS
from auv_analysis.output.progress import console, say
from auv_analysis.output.text import Maths, join, number, symbol
from auv_analysis.report.document import Block, Section, Sentence, write_document
from auv_analysis.report.results import (
    Column,
    Results,
    Shown,
    Table,
    described,
    document_table,
    terminal,
)
from auv_analysis.report.scenario_text import gain_text
from auv_analysis.studies.tune.gain_space import STRUCTURES
from auv_analysis.studies.tune.plots import draw_tuning
from auv_analysis.studies.tune.results import LEVEL, Comparison, Tuning
from auv_analysis.studies.tune.search import FINALISTS, LONG, POINTS, SHORT, STARTS

SMALLEST_SHARE = 1e-6  # of an equality: below it, it is met
MEASURES = (
    'Error and effort are weighted by the inertia, so that metres and radians, newtons and newton '
    'metres add up without chosen weights, and both are the same in every body frame. The '
    'time-weighted error is the objective unless --index says otherwise: the plain mean is decided '
    'by the first moments, in which a law has its gain and nothing else.'
)
FAIR = (
    'Every law was given the same search: the reference’s gains in the units of the law, the '
    f'middle of the bounds and {POINTS} Sobol points over all its gains (of six numbers per gain, '
    'the best multiple of the inertia instead), then sequential quadratic programming with the '
    f'equality as a constraint, {SHORT} gradients from each of the best {STARTS} points and {LONG} '
    f'from the best {FINALISTS} of these at most. The reference’s own law takes part, since its '
    'gains in the scenario were not searched: against it, what is left is the law’s.'
)
PERIOD = Maths(
    'No velocity loop may be faster than the control period carries: lambda_max(M^-1 K_D) times '
    'the step stays at or below 1, or at the reference’s own value where that is above.'
)
SAME_LAW = (
    'With gains that are multiples of the full M (--structure inertia), CL and GVC are one and the '
    'same law: what tells them apart is the off-diagonal part of their gains alone.'
)
CONTROLLER = described('controller', 'as in scenario.yaml of this folder')
SPREADS = {
    'mass': ('relative error of M_RB and of the weight', ''),
    'added_mass': ('relative error of M_A', ''),
    'damping': ('relative error of D; without M_RB and M_A apart, of its linear part', ''),
    'buoyancy': ('relative error of the buoyancy', ''),
    'inertia': ('relative error of M along each of its directions, drawn as well', ''),
    'disturbance': ('relative change of the scenario’s own disturbance', ''),
    'waves': ('amplitude of an added harmonic force on each axis, per M_ii', 'm/s², rad/s²'),
    'current': ('speed of an added constant horizontal current of any heading', 'm/s'),
}


def write_report(tuning: Tuning, out: Path) -> None:
    """Write tune.json, search.parquet, monte_carlo.parquet and report.html with its figures."""
    results = tuning.results
    sentences = [*findings(tuning)]
    results.facts['verdict'] = [{'text': s.text, 'source': s.source} for s in sentences]
    results.write(out)
    figures = draw_tuning(tuning, out / 'figures')
    facts = results.facts
    checked = (
        'Single runs of scenario.yaml by auv simulate’s kernel give the same numbers: the largest '
        f'relative deviation is {facts["validation"]["largest_relative_deviation"]:.1g}.'
    )
    tuned: list[Block] = [
        FAIR,
        controllers_table(results),
        figures['trade_off'],
        _gains(results),
        checked,
    ]
    draws: list[Block] = []
    if tuning.draws:
        draws = [
            _spread(results), figures['draws'], figures['paired'], _draws(results),
            _comparisons(results),
        ]  # fmt: skip
    basis: list[Block] = [MEASURES, PERIOD, SAME_LAW, _searched(results)]
    sections = [
        Section('tuned', 'Tuned alike', tuned),
        Section('random', 'The same random changes for all', draws),
        Section('basis', 'What this rests on', basis),
    ]
    about = (
        f'{facts["vehicle"]}, reference {facts["reference"]}, equal {facts["equal"]} '
        f'within {100 * facts["tolerance"]:g} %, hold {facts["hold"]}, seed {facts["seed"]}'
    )
    listing = (out / 'scenario.yaml').read_text(encoding='utf-8')
    title = f'Tuning of {facts["scenario"]}'
    write_document(out, title, about, sentences, sections, [('scenario.yaml', listing)])


def print_tuning(tuning: Tuning) -> None:
    """Print the controllers with their measures, and what the tuning found."""
    table = controllers_table(tuning.results)
    brief = {
        'controller': Column('controller'),
        'structure': Column('structure'),
        tuning.request.index: described('error', unit='J'),
        'effort': described('effort', unit='J/s²', digits=4),
        'equality': Column('equality', digits=2, scale=100.0),
        'settling': described('settled', unit='s'),
        'ratio': Column('draws'),
    }
    console.print(terminal(replace(table, shown=brief)))
    for sentence in tuning.results.facts['verdict']:
        say(sentence['text'])


def controllers_table(results: Results) -> Table:
    """Measures of every controller in the scenario itself."""
    facts = results.facts
    comparisons = (facts['monte_carlo'] or {}).get('comparisons', [])
    ratios = {
        c['controller']: ('monte_carlo', 'comparisons', i, 'ratio')
        for i, c in enumerate(comparisons)
        if c['measure'] == _objective(facts) and c['against'] == facts['reference']
    }
    rows = [
        {
            'controller': name,
            'law': entry['law'],
            'structure': entry.get('structure', 'as given'),
            **{cost: ('controllers', name, 'measures', cost) for cost in COSTS},
            'equality': ('controllers', name, 'equality'),
            'price': ('controllers', name, 'price'),
            'ratio': ratios.get(name),
        }
        for name, entry in facts['controllers'].items()
    ]
    label = COSTS[_objective(facts)].label
    distance = f'distance of the {facts["equal"]} from the reference’s'
    change = 'relative change of the one measure per relative change of the other'
    shown: dict[str, Shown] = {
        'controller': CONTROLLER,
        'law': 'law',
        'structure': described('structure', 'what its gains multiply'),
        **{name: Column(cost, digits=4) for name, cost in COSTS.items()},
        'equality': described('from equality', distance, digits=2, scale=100.0),
        'price': described('price', change),
        'ratio': described('over draws', f'ratio of the {label} to the reference’s'),
    }  # fmt: skip
    caption = 'The scenario itself: what each controller costs and what it achieves.'
    return document_table(results, 'tuned', caption, rows, shown)


def _objective(facts: Mapping[str, Any]) -> str:
    return facts['index'] if facts['equal'] == 'effort' else 'effort'


def _gains(results: Results) -> Table:
    entries = results.facts['controllers']
    gains = list(dict.fromkeys(gain for entry in entries.values() for gain in entry['gains']))
    rows = [
        {
            'controller': name,
            'law': entry['law'],
            **{gain: gain_text(value) for gain, value in entry['gains'].items()},
            'remarks': '; '.join(entry['remarks']) or None,
            'kind': 'bad' if entry['remarks'] else '',
        }
        for name, entry in entries.items()
    ]
    shown: dict[str, Shown] = {
        'controller': CONTROLLER,
        'law': 'law',
        **{gain: symbol(gain) for gain in gains},
        'remarks': Column('remarks', kind='kind'),
    }
    note = 'In full digits in scenario.yaml, on which auv run and auv simulate repeat them.'
    caption = 'Gains, as the laws take them.'
    return document_table(results, 'gains', caption, rows, shown, note=note)


def _searched(results: Results) -> Table:
    """The search and its extent."""
    rows = []
    for name, entry in results.facts['controllers'].items():
        for i, search in enumerate(entry.get('searches', [])):
            at = 'controllers', name, 'searches', i
            for gain, bounds in search['searched'].items():
                times = STRUCTURES[search['structure']] if bounds['times_inertia'] else 'itself'
                rows.append({
                    'controller': name,
                    'structure': search['structure'],
                    'gain': gain,
                    'low': (*at, 'searched', gain, 'low'),
                    'high': (*at, 'searched', gain, 'high'),
                    'times': times,
                    'evaluations': (*at, 'evaluations'),
                    'least': (*at, 'measures', _objective(results.facts))
                    if search['reached'] else None,
                })  # fmt: skip
    cost = COSTS[_objective(results.facts)]
    shown: dict[str, Shown] = {
        'controller': CONTROLLER,
        'structure': 'structure',
        'gain': Column('gain', look='maths'),
        'low': 'from',
        'high': 'to',
        'times': Column('stands for', look='maths'),
        'evaluations': described('loops', 'closed loops that this search ran'),
        'least': described('least found', 'of the objective', cost.unit, digits=4),
    }
    caption = 'What was searched: bounds of each gain, in units of 1/s to the power it has.'
    return document_table(results, 'allowed', caption, rows, shown, stub=3)


def _draws(results: Results) -> Table:
    """Quantiles of the measures over the draws."""
    quantiles = {'q05': '5 %', 'median': 'median', 'q95': '95 %'}
    pairs = [(cost, q) for cost in COSTS for q in quantiles]
    rows = [
        {
            'controller': name,
            **{f'{c} {q}': ('monte_carlo', 'controllers', name, c, q) for c, q in pairs},
            **{s: ('monte_carlo', 'controllers', name, s) for s in ('settled', 'diverged')},
        }
        for name in results.facts['monte_carlo']['controllers']
    ]
    inside = 'share of the draws in which all errors end inside their bands'
    shown: dict[str, Shown] = {
        'controller': CONTROLLER,
        **{
            f'{c} {q}': described(quantiles[q], unit=COSTS[c].unit, group=COSTS[c].label)
            for c, q in pairs
        },
        'settled': described('settled', inside, scale=100.0),
        'diverged': described('diverged', 'share of the draws', scale=100.0),
    }
    count = results.facts['monte_carlo']['samples']
    caption = f'Over {count} draws, the same for all.'
    return document_table(results, 'draws', caption, rows, shown)


def _comparisons(results: Results) -> Table:
    """Paired comparisons."""
    rows = []
    for i, c in enumerate(results.facts['monte_carlo']['comparisons']):
        at = 'monte_carlo', 'comparisons', i
        words = {'controller': c['controller'], 'against': c['against']}
        numbers = ('ratio', 'effect', 'smaller', 'larger', 'p_holm')
        rows.append({
            **words,
            'measure': COSTS[c['measure']].label,
            **{key: (*at, key) for key in numbers},
            'low': (*at, 'interval', 0),
            'high': (*at, 'interval', 1),
            'kind': {-1: 'good', 1: 'bad', 0: ''}[c['verdict']],
        })  # fmt: skip
    smaller = 'share of the draws in which the controller’s is smaller'
    test = 'Wilcoxon signed-rank test of the log ratios, two-sided, Holm’s correction'
    ratio = 'of controller to against over the draws, after Hodges and Lehmann'
    effect = 'rank-biserial correlation, −1 to 1; its sign says who is smaller'
    shown: dict[str, Shown] = {
        'controller': CONTROLLER,
        'against': 'against',
        'measure': 'measure',
        'ratio': described('ratio', ratio),
        'low': described('from', '95 % interval of that ratio, by the test'),
        'high': 'to',
        'effect': described('effect', effect),
        'smaller': described('smaller', smaller, scale=100.0),
        'larger': Column('larger', scale=100.0),
        'p_holm': described('p', test, digits=2, kind='kind'),
    }
    note = (
        f'The correction is for all {len(rows)} rows. Draws are made, not found: their number '
        'makes any p small in the end, so that the ratio and its interval are what counts.'
    )
    caption = 'Paired over the draws, in every measure that exists.'
    return document_table(results, 'paired', caption, rows, shown, stub=3, note=note)


def _spread(results: Results) -> Table:
    """The random draws and their extent."""
    rows = [
        {
            'name': name,
            'what': SPREADS[name][0],
            'value': ('monte_carlo', 'spread', name),
            'unit': SPREADS[name][1],
        }
        for name in results.facts['monte_carlo']['spread']
    ]
    what = Column('drawn uniformly', look='maths')
    shown: dict[str, Shown] = {'name': 'name', 'what': what, 'value': 'up to', 'unit': 'unit'}
    caption = 'What is drawn; relative errors and changes of either sign.'
    return document_table(results, 'spread', caption, rows, shown)


def findings(tuning: Tuning) -> Iterator[Sentence]:
    """Findings of a tuning, the most important first."""
    yield from _nominal(tuning)
    yield from _unreached(tuning)
    if tuning.draws:
        yield from _ranked(tuning)
    for name in tuning.scenario.controllers:
        for remark in tuning.remarks(name):
            yield Sentence(f'{name}: {remark}.', 'table-gains')


def _nominal(tuning: Tuning) -> Iterator[Sentence]:
    """Least of the objective, by law, and what the law has to do with it, the gains apart."""
    reference = tuning.request.reference
    reached = [name for name, tuned in tuning.laws.items() if tuned.best.reached]
    if not reached:
        return
    measure, equal = tuning.goal.names
    base, level = (getattr(tuning.goal.reference, n)[0] for n in (measure, equal))
    ratios = {name: tuning.ratio(name, measure) for name in reached}
    least = join([f'{number(r)} for {tuning.laws[n].law}' for n, r in ratios.items()])
    away = max(abs(tuning.ratio(name, equal) - 1.0) for name in reached)
    yield Sentence(
        f'At the {COSTS[equal].label} of {reference} ({number(level, 4)} {COSTS[equal].unit}, met '
        f'within {_percent(max(away, SMALLEST_SHARE))}), the least {COSTS[measure].label} that '
        f'the search found is {least}, as parts of {reference}’s {number(base)} '
        f'{COSTS[measure].unit}.',
        'table-tuned',
    )
    own = tuning.retuned
    others = {name: ratio for name, ratio in ratios.items() if name != own}
    if own in ratios and others:
        parts = [f'{number(r / ratios[own])} for {tuning.laws[n].law}' for n, r in others.items()]
        yield Sentence(
            f'{reference}’s own law, searched in the same way, comes to {number(ratios[own])}: '
            f'that is the gains’ part. What is left to the law is a factor of {join(parts)}.',
            'table-tuned',
        )


def _unreached(tuning: Tuning) -> Iterator[Sentence]:
    equal = tuning.goal.names[1]
    for name, tuned in tuning.laws.items():
        if not tuned.best.reached:
            yield Sentence(
                f'No gains of {tuned.law} that were tried have the {COSTS[equal].label} of '
                f'{tuning.request.reference} within {_percent(tuning.goal.tolerance)}; the nearest '
                f'are {_percent(tuning.ratio(name, equal) - 1.0)} away, and {name} is no fair '
                'comparison.',
                'table-tuned',
            )


def _ranked(tuning: Tuning) -> Iterator[Sentence]:
    """Who is ahead over the draws: of the reference, and of its own law with searched gains."""
    objective, reference = tuning.goal.names[0], tuning.request.reference
    reached = [name for name, tuned in tuning.laws.items() if tuned.best.reached]
    draws = len(tuning.draws[reference].error)
    for against in filter(None, (reference, tuning.retuned)):
        rows = [
            c
            for c in tuning.comparisons
            if (c.measure, c.against) == (objective, against) and c.controller in reached
        ]
        if rows:
            yield Sentence(
                f'Over {draws} draws of model error and disturbance, the same for all, in '
                f'{COSTS[objective].label}: {_places(rows, against)} (ratios after Hodges and '
                f'Lehmann; Wilcoxon signed-rank test, Holm’s correction, level {LEVEL:g}).',
                'table-paired',
            )


def _places(rows: list[Comparison], against: str) -> str:
    words = {-1: f'ahead of {against}', 1: f'behind {against}', 0: f'not told apart from {against}'}
    parts = []
    for sign, place in words.items():
        names = [
            f'{c.controller} ({"no ratio" if c.ratio is None else f"{number(c.ratio)} times"})'
            for c in rows
            if c.verdict == sign
        ]
        if names:
            parts.append(f'{join(names)} {"are" if len(names) > 1 else "is"} {place}')
    return '; '.join(parts)


def _percent(share: float) -> str:
    return f'{number(100 * share, 2)} %'
