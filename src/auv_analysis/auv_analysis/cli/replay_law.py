"""`auv replay --law`: what another law would have commanded on what was recorded."""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from auv_analysis.bag.attachments import UNKNOWN
from auv_analysis.output.folder import check_free, results_folder
from auv_analysis.output.new_files import write_json
from auv_analysis.output.progress import (
    bar,
    console,
    count,
    say,
    waiting,
)
from auv_analysis.output.text import number
from auv_analysis.replay.compared import (
    UNCHECKED,
    Compared,
    Reproduction,
    compared,
    figures_of,
    listed,
    reproduction,
)
from auv_analysis.replay.open_loop import OpenLoop, RecordedLoop, open_loop, recorded_loop
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.laws.law import is_unasked, law_class, refusal

DOCUMENT = 'open_loop.json'
UNITS = ('N', 'N m')
UNNAMED = f'{UNCHECKED}: the bag does not name its law, or it is not imported'


def answered(options: argparse.Namespace) -> dict[str, Any]:
    """What a law would have commanded; returns both wrenches in figures."""
    if options.out:
        check_free(options.out, overwrite=options.overwrite)
    _ask_for(options.law)
    with waiting(f'reading {options.bag}'):
        recorded = recorded_loop(options.bag, options.vehicle)
    own = recorded.controller
    gains = own.gains_of(options.law, _gains(options.gain))
    answers = _answers(recorded, options.law, gains)
    known = own.law != UNKNOWN
    same = options.law == own.law and not options.gain  # as recorded: asked once
    verdict = _verdict(recorded, known, answers if same else None)
    both = compared(recorded, answers)
    out = options.out or _folder(recorded, options.law)
    sentence = verdict.sentence() if verdict else UNNAMED
    document = {
        'reproduced': verdict.holds if verdict else None,
        'reproduction': sentence,
        'reproduced_relative': verdict.relative if verdict else None,
        'reproduced_within': verdict.within if verdict else None,
        'bag': str(options.bag),
        'scenario': recorded.scenario,
        'controller': recorded.name,
        'recorded': {'law': own.law if known else None, 'gains': listed(own.gains)},
        'answered': {'law': options.law, 'gains': listed(gains)},
        'samples': len(both.t),
        'wrench': figures_of(both),
        'not_used': answers.refused,
        'notes': [*recorded.notes, *answers.notes, *_remarks(answers)],
    }
    with results_folder(out, overwrite=options.overwrite, inputs=[options.bag]) as results:
        write_json(results.folder / DOCUMENT, document)
        figure = _draw(document, both, results.folder)
    _show(document)
    say(f'figure: {out / figure.relative_to(results.folder)}')
    if verdict and verdict.holds is False:
        raise FailedError(f'{options.bag}: {sentence}', document)
    return document


def _ask_for(law: str) -> None:
    """Import the law that the user has named; one that only the bag names is not."""
    try:
        law_class(law)
    except ValueError as error:
        raise InputError('--law', '', *refusal(error)[1:]) from None


def _answers(recorded: RecordedLoop, law: str, gains: dict[str, Any]) -> OpenLoop:
    with bar(count('samples')) as shown:
        task = shown.add_task(law, total=recorded.samples)
        return open_loop(recorded, law, gains, lambda done: shown.update(task, completed=done))


def _gains(listed_options: list[str]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for entry in listed_options:
        name, _, text = entry.partition('=')
        try:
            numbers = [float(part) for part in text.split(',')]
        except ValueError:
            numbers = []
        if not name or not numbers or not np.all(np.isfinite(numbers)):
            expected = 'NAME=VALUE of 1, 6 or 36 numbers with commas between them'
            raise InputError('--gain', '', expected, entry)
        found[name] = numbers[0] if len(numbers) == 1 else numbers
    return found


def _folder(recorded: RecordedLoop, law: str) -> Path:
    plain = law.replace(':', '_').replace('.', '_').replace('/', '_')
    return Path('runs') / f'replay_{recorded.scenario}_{recorded.name}_{plain}'


def _verdict(recorded: RecordedLoop, known: bool, again: OpenLoop | None) -> Reproduction | None:
    """Whether the recorded law gives the recorded wrench; None where it cannot be asked.

    `again` are its answers where there are some already.
    """
    own = recorded.controller
    if not known or is_unasked(own.law):
        return None
    return reproduction(recorded, again or _answers(recorded, own.law, own.gains))


def _remarks(answers: OpenLoop) -> list[str]:
    if not answers.refused:
        return []
    return [f'{answers.refused} messages without an answer of the law; first: {answers.trouble}']


def _draw(document: dict[str, Any], both: Compared, out: Path) -> Path:
    from auv_analysis.replay.pictures import draw  # with matplotlib, which loads slowly

    law = document['answered']['law']
    names = f'recorded ({document["recorded"]["law"] or "unknown law"})', f'{law}, open loop'
    with waiting('drawing the figure'):
        return draw(both, names, document['reproduction'], out / 'figures')


def _show(document: dict[str, Any]) -> None:
    """Say whether the recorded law is reproduced, and show the figures."""
    say(document['reproduction'])
    law, wrench = document['answered']['law'], document['wrench']
    table = Table(box=None, header_style='bold')
    table.add_column('')
    for head in ('recorded\nrms', 'max', f'{law}\nrms', 'max', 'difference\nrms', 'max'):
        table.add_column(head, justify='right')
    for i, dof in enumerate(DOFS):
        cells = [
            number(None if values is None else values[i])
            for part in wrench.values()
            for values in part.values()
        ]
        table.add_row(f'{dof}, {UNITS[i // 3]}', *cells)
    console.print(table)
    for note in document['notes']:
        say(f'note: {note}')
