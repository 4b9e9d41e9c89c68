"""The report of an excitation: expected intervals as tables, sentences, page and files."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.output.progress import TextConsole
from auv_analysis.output.text import capital, join, number
from auv_analysis.report.document import Block, Section, Sentence, write_document
from auv_analysis.report.results import Column, Results, Shown, described, terminal
from auv_analysis.studies.excite.drive import WORDS
from auv_analysis.studies.excite.excite import Excited
from auv_dynamics.files.yaml_files import yaml_text
from auv_dynamics.vehicle import DOFS

SCENARIO, NAME = 'scenario.yaml', 'excite'
METHOD = (
    'Predicted intervals are those of the Fisher information: of the normal equations that `auv '
    'identify` builds of segments with starts of their own, if the prior were the vehicle and '
    'white noise of the sensors all that disturbs. Waves, a tether and what the model does not '
    'know make them wider; that only the recording tells.',
    'The search makes log det(1 + A) large, A the information in the prior’s standard '
    'deviations (D-optimality): phases are drawn, the peaks of the degrees of freedom and the way '
    'their amplitudes go with frequency are searched. No two sines have the same frequency.',
    'The motion is simulated for the prior and for vehicles drawn around it; all amplitudes are '
    'made less until all of them stay within the bounds. Position is not fed back: a current '
    'carries the vehicle with it.',
)


def results_of(found: Excited) -> Results:
    """All numbers of an excitation."""
    rows = found.predicted.coefficients()
    case1 = {row['name']: row for row in found.case1.coefficients()} if found.case1 else {}
    table = [_row(row, case1.get(row['name'])) for row in rows]
    known = [row['name'] for row in table if row['half'] is not None]
    request = found.request
    results = Results(
        NAME,
        {
            'vehicle': request.vehicle.name,
            'loop': 'closed' if request.closed else 'open',
            'duration': request.duration,
            'step': request.step,
            'noise': {'velocity': request.velocity_noise, 'attitude': request.attitude_noise},
            'vehicles': len(found.used),
            'evaluations': found.count,
            'parameters': table,
            'identified': known,
            'not_identified': [row['name'] for row in table if row['half'] is None],
            'case1': [row['name'] for row in table if row['half_case1'] is not None],
            'combinations': found.predicted.combinations(),
            'file': SCENARIO,
        },
    )
    shown: Mapping[str, Shown] = {
        'name': described('', 'coefficient'),
        'prior': Column('prior', digits=4),
        'half': described('±', 'half of the predicted 95 % interval', digits=2),
        'half_case1': described('± of case 1', 'the same of a run of case 1 as long', digits=2),
        'unit': 'unit',
        'left': described('left', 'of the prior’s uncertainty', decimals=2, scale=100.0),
    }
    results.add('intervals', 'Predicted intervals.', table, shown)
    bounds = [
        {'bound': word, 'prior': float(found.used[0, k]), 'worst': float(found.used[:, k].max())}
        for k, word in enumerate(WORDS)
    ]
    of_bounds: Mapping[str, Shown] = {
        'bound': 'bound',
        'prior': described('used', 'by the vehicle of the file', decimals=0, scale=100.0),
        'worst': described('at worst', 'by a vehicle drawn around it', decimals=0, scale=100.0),
    }
    results.add('bounds', 'Shares of the bounds that the motion uses.', bounds, of_bounds)
    motion: Mapping[str, Shown] = {
        'dof': described('', 'degree of freedom'),
        'wrench': described('wrench', 'largest, N and N m'),
        'velocity': described('velocity', 'largest, m/s and rad/s'),
        'rms': described('rms', 'root mean square of the velocity'),
    }
    tau, nu = np.abs(found.motion.commands[0, 0]), np.abs(found.motion.states[0, 0, :, 7:])
    moved = [
        {'dof': dof, 'wrench': float(tau[:, i].max()), 'velocity': float(nu[:, i].max()),
         'rms': float(np.sqrt((nu[:, i] ** 2).mean()))}
        for i, dof in enumerate(DOFS)
    ]  # fmt: skip
    results.add('motion', 'What is driven, and how the vehicle of the file moves.', moved, motion)
    return results


def _row(row: Mapping[str, Any], case1: Mapping[str, Any] | None) -> dict[str, Any]:
    return {
        'name': row['name'], 'unit': row['unit'], 'prior': row['prior'], 'half': _half(row),
        'half_case1': _half(case1) if case1 else None, 'left': row['left'],
        'left_case1': case1['left'] if case1 else None,
    }  # fmt: skip


def _half(row: Mapping[str, Any]) -> float | None:
    return None if row['low'] is None else (row['high'] - row['low']) / 2


def sentences(results: Results) -> list[str]:
    """The result in sentences, the most important first."""
    facts, rows = results.facts, results.tables['intervals'].records()
    known, every = len(facts['identified']), len(rows)
    said = [f'{known} of {every} coefficients would be identified by {facts["duration"]:g} s of '
            f'it, {len(facts["case1"])} by case 1 of the same length, which keeps no '
            'bounds.']  # fmt: skip
    both = [(r['half_case1'] / r['half'], r['name']) for r in rows
            if r['half'] and r['half_case1'] and r['name'] != 'delay']  # fmt: skip
    if both:
        middle = float(np.median([ratio for ratio, _ in both]))
        wider = [name for ratio, name in both if ratio < 1.0]
        said.append(f'Where both tell, its intervals are {number(1 / middle, 2)} times as wide as '
                    'those of case 1, in the median'
                    + (f'; case 1 tells more of {join(wider[:6])}.' if wider else '.'))  # fmt: skip
    tight = max(results.tables['bounds'].records(), key=lambda row: row['worst'])
    share = f'{100 * tight["worst"]:.0f} % of the {tight["bound"]}'
    said.append(f'Of {facts["vehicles"]} vehicles around the prior the worst uses {share} that '
                'is allowed.')  # fmt: skip
    if facts['not_identified']:
        said.append(f'Not told: {join(facts["not_identified"])}.')
    return said + [f'Open: {one["words"]}.' for one in facts['combinations'][:4]]


def scenario_text(found: Excited) -> str:
    """Text of the scenario's file."""
    request, data = found.request, found.scenario
    what = 'Set-points' if request.closed else 'An open-loop wrench'
    applied = ' --applied' * request.clipped
    head = (
        f'# {what} to identify {request.vehicle.name} with: auv run, then auv identify{applied}.\n'
        f'# Written by auv excite, seed {request.seed}. Sensors and lag are those that the\n'
        '# prediction assumes; beside a vehicle they are its own.\n'
    )
    return head + yaml_text(data)


def print_results(results: Results, folder: Path) -> None:
    """Print tables and sentences."""
    out = TextConsole(highlight=False)
    for name in ('intervals', 'motion', 'bounds'):
        out.print(terminal(results.tables[name], title=True))
        out.print('')
    for text in [*sentences(results), f'scenario: {folder / SCENARIO}']:
        out.print(text, markup=False, soft_wrap=True)


def write_report(found: Excited, results: Results, out: Path) -> Path:
    """Write report.html with its figures; returns its path."""
    from auv_analysis.studies.excite.plots import draw

    figures = draw(found, results.tables['intervals'].records(), out / 'figures')
    t, facts = results.tables, results.facts
    told = [Sentence(text, 'intervals' if i == 0 else '')
            for i, text in enumerate(sentences(results))]  # fmt: skip
    open_: list[Block] = [f'{capital(one["words"])}.'
                          for one in facts['combinations']]  # fmt: skip
    sections = [
        Section('intervals', 'What the recording would tell',
                [figures['intervals'], t['intervals'], *open_]),
        Section('drive', 'What is driven', [figures['wrench'], t['motion']]),
        Section('motion', 'How the vehicle moves', [figures['tank'], t['bounds']]),
        Section('method', 'How it was found', list(METHOD)),
    ]  # fmt: skip
    listings = [(SCENARIO, (out / SCENARIO).read_text('utf-8'))]
    title = f'Excitation of {facts["vehicle"]}'
    about = f'{facts["loop"]} loop, {facts["duration"]:g} s'
    return write_document(out, title, about, told, sections, listings)
