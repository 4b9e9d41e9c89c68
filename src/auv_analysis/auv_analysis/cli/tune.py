"""`auv tune`: laws tuned to equal effort or equal error, then compared over random changes."""

import argparse
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.progress import Progress
from rich.table import Table

from auv_analysis.output.folder import results_folder
from auv_analysis.output.new_files import write_json
from auv_analysis.output.progress import (
    bar,
    console,
    count,
    say,
    waiting,
)
from auv_analysis.output.text import number
from auv_analysis.scenario.scenario import Scenario, load_scenario
from auv_analysis.simulation.simulate import check_hold
from auv_analysis.simulation.warm_up import announce
from auv_analysis.tuning.draws import spread_of
from auv_analysis.tuning.outcome import Outcome
from auv_analysis.tuning.records import MONTE_CARLO, SEARCH, write_draws, write_search
from auv_analysis.tuning.rivals import Request, is_shipped
from auv_analysis.tuning.search import INDICES
from auv_analysis.tuning.space import LAWS
from auv_analysis.tuning.verdict import paired_sentences, verdict
from auv_analysis.tuning.work import Draws, work
from auv_dynamics.files.errors import InputError

DOCUMENT = 'tune.json'
FEWEST, MOST = 10, 100_000  # draws: a test of fewer says nothing


def tune(options: argparse.Namespace) -> dict[str, Any]:
    """Tune, compare and report."""
    scenario = load_scenario(options.scenario)
    request = _request(options, scenario)
    draws = Draws(_samples(options.samples), spread_of(options.spread or ()), request.seed)
    out = options.out or Path('runs') / f'tune_{scenario.name}'
    with results_folder(out, overwrite=options.overwrite, inputs=scenario.inputs) as results:
        for warning in scenario.warnings:
            say(f'warning: {warning}')
        announce(scenario, [request.reference])
        with bar(count(), keep=True) as shown:
            outcome = work(request, draws, results.folder, _stages(shown))
        return _conclude(outcome, results.folder)


def _request(options: argparse.Namespace, scenario: Scenario) -> Request:
    check_hold(scenario, options.hold)
    reference = _reference(scenario, options.reference)
    own = scenario.controller(reference)['law']
    wanted = options.law or [law for law in LAWS if law != own]
    laws = [*([own] if is_shipped(scenario, reference) else []), *wanted]
    if not 0 < options.tolerance < 0.1:
        raise InputError('--tolerance', '', 'a number above 0, below 0.1', str(options.tolerance))
    if not 0 <= options.seed < 2**63:
        raise InputError('--seed', '', 'a whole number from 0 to 2^63 - 1', str(options.seed))
    index = {'time': INDICES[0], 'mean': INDICES[1]}[options.index]
    return Request(
        scenario, reference, tuple(dict.fromkeys(laws)), options.equal, index, options.tolerance,
        options.structure, options.hold, options.seed, len(os.sched_getaffinity(0)),
    )  # fmt: skip


def _reference(scenario: Scenario, name: str | None) -> str:
    """The controller named, else the first one under GVC."""
    if name is not None:
        scenario.controller(name)
        return name
    for candidate, entry in scenario.controllers.items():
        if entry['law'] == 'gvc':
            return candidate
    expected = 'a controller of law gvc, or --reference with another one'
    raise InputError(scenario.path, 'controllers', expected, ', '.join(scenario.controllers))


def _samples(samples: int) -> int:
    if samples != 0 and not FEWEST <= samples <= MOST:
        expected = f'0 for none, or a whole number from {FEWEST} to {MOST}'
        raise InputError('--samples', '', expected, str(samples))
    return samples


def _stages(shown: Progress) -> Callable[[str, int], Callable[[], None]]:
    def stage(text: str, parts: int) -> Callable[[], None]:
        task = shown.add_task(text, total=parts)
        return lambda: shown.advance(task)

    return stage


def _conclude(outcome: Outcome, out: Path) -> dict[str, Any]:
    """Write what there is, show the table and the sentences."""
    sentences = verdict(outcome)
    document = outcome.document()
    document['verdict'] = [{'text': s.text, 'source': s.source} for s in sentences]
    write_json(out / DOCUMENT, document)
    write_search(out / SEARCH, outcome.rivals)
    if outcome.draws:
        write_draws(out / MONTE_CARLO, outcome.draws)
    from auv_analysis.tuning.pictures import pictures  # with matplotlib, which loads slowly
    from auv_analysis.tuning.report import write_report

    with waiting('drawing figures, writing the report'):
        figures = pictures(outcome, out / 'figures')
        listing = (out / 'scenario.yaml').read_text(encoding='utf-8')
        listings = [('scenario.yaml', listing)]
        pairs = paired_sentences(outcome)
        write_report(out, document, sentences, pairs, figures, listings)
    _show(document)
    for sentence in sentences:
        say(sentence.text)
    return document


def _show(document: dict[str, Any]) -> None:
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
