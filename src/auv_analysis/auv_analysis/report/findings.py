"""What a study found, in sentences computed from its runs."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from auv_analysis.metrics.authority import beyond_authority
from auv_analysis.metrics.summary import band_of
from auv_analysis.output.text import fixed, join, number, plain, residuals
from auv_analysis.report import paper
from auv_analysis.report.claim import Claim
from auv_analysis.report.document import Sentence
from auv_analysis.report.figures import reference
from auv_analysis.report.sketch import Sketch, alike, last_third
from auv_analysis.report.unexplained import unexplained_finding
from auv_analysis.report.verdict import verdict
from auv_dynamics.vehicle import DOFS

Summaries = Mapping[str, Mapping[str, Any]]
DECIDED = ('reproduced', 'partly', 'not reproduced')
RESTLESS = 10.0  # times that an error of noise crosses its own range in the last third of a run
_SEVERAL = 'do', 'their errors reach'


def findings(
    runs: Mapping[str, Sketch], summaries: Summaries, claims: Sequence[Claim]
) -> list[Sentence]:
    """Sentences of the summary.

    Parameters
    ----------
    runs, summaries : by name
    claims : of `claims_table`

    Returns
    -------
    sentences : verdict, settling, errors, inputs, energy, couplings, claims; what is not known is
        left out

    """
    leading = reference(runs)
    mine = summaries[leading.controller]
    figures = 'table-key_figures'
    found = [Sentence(text, figures) for text in verdict(runs, summaries)]
    found += [Sentence(_settling(n, run, summaries[n]), figures) for n, run in runs.items()]
    found += [Sentence(text, 'experiment') for text in namesakes([*runs.values()])]
    found += [Sentence(_late_errors(summaries), figures), Sentence(_inputs(summaries), figures)]
    found += [
        Sentence(f'Under {name} {"; ".join(remarks)}.', figures)
        for name, run in runs.items()
        if (remarks := beyond_authority(run.vehicle, summaries[name]['effort']['max']))
    ]
    found += [Sentence(_applied(runs), 'inputs_compared')]
    found += [
        Sentence(unexplained_finding(n, s), f'table-unexplained_{n}') for n, s in summaries.items()
    ]
    found += [Sentence(_energy(runs, leading, mine), 'table-energy')]
    found += [Sentence(_couplings(mine, leading), 'table-couplings')]
    found += [Sentence(_claims(claims), 'table-claims')]
    return [sentence for sentence in found if sentence.text]


def namesakes(runs: Sequence[Sketch]) -> list[str]:
    """What has to be said of runs whose scenarios have one name and other set-points."""
    groups: dict[str, list[Sketch]] = {}
    for run in runs:
        groups.setdefault(run.scenario, []).append(run)
    return [
        f'Not all {len(group)} runs of {name} have the same set-point: only the name is the same.'
        for name, group in groups.items()
        if alike(group, 'nu_d') is False
    ]


def _settling(name: str, run: Sketch, summary: Mapping[str, Any]) -> str:
    times = summary['velocity_error']['settling_time']
    if times is None:
        return f'Of {name} no set-point is known, and so no error.'
    missing = [i for i, time in enumerate(times) if time is None]
    if not missing:
        return f'Under {name} every velocity error has settled after {max(times):.2f} s.'
    noisy = [i for i in missing if _is_noise(run, i)]
    reached = residuals(summary)
    parts = []
    if still := [i for i in missing if i not in noisy]:
        verb, whose = ('does', 'its error reaches') if len(still) == 1 else _SEVERAL
        last = plain(summary['settling']['dwell'])
        parts.append(
            f'{join([DOFS[i] for i in still])} {verb} not settle within {run.duration:g} s: '
            f'in the last {last} s {whose} {join([reached[i] for i in still])}'
        )
    if noisy:
        floors = join([f'{reached[i]} in {DOFS[i]}' for i in noisy])
        parts.append(
            f'the error is within its noise floor of {floors}, wider than the settling band'
        )
    return f'Under {name}, {"; ".join(parts)}.'


def _is_noise(run: Sketch, i: int) -> bool:
    """Whether a measured error fluctuates about a mean that lies in the band."""
    late, band = run.part('error', last_third(run)), band_of(run.part('nu_d').peak)
    measured = run.sensing or run.acceleration is not None
    return measured and abs(late.mean[i]) <= band[i] and late.path[i] >= RESTLESS * late.span[i]


def _late_errors(summaries: Summaries) -> str:
    parts = []
    for name, summary in summaries.items():
        late = summary['velocity_error']['max_after_2s']
        if late is not None:
            linear, angular = int(np.argmax(late[:3])), 3 + int(np.argmax(late[3:]))
            parts.append(
                f'{number(late[linear], 2)} m/s ({DOFS[linear]}) and '
                f'{number(late[angular], 2)} rad/s ({DOFS[angular]}) under {name}'
            )
    return f'After 2 s the errors reach at most {"; ".join(parts)}.' if parts else ''


def _inputs(summaries: Summaries) -> str:
    parts = []
    for name, summary in summaries.items():
        largest = summary['effort']['max']
        force, moment = int(np.argmax(largest[:3])), 3 + int(np.argmax(largest[3:]))
        parts.append(
            f'{number(largest[force])} N ({DOFS[force]}) and '
            f'{number(largest[moment])} N m ({DOFS[moment]}) under {name}'
        )
    return f'The largest commands are {"; ".join(parts)}.'


def _applied(runs: Mapping[str, Sketch]) -> str:
    """What the actuators left of the commands, of the runs that have any."""
    parts = []
    for name, run in runs.items():
        if run.acting:
            peak = run.part('applied').peak
            force, moment = peak[:3].max(), peak[3:].max()
            parts.append(f'{number(force)} N and {number(moment)} N m under {name}')
    return f'The actuators deliver at most {"; ".join(parts)}.' if parts else ''


def _energy(runs: Mapping[str, Sketch], leading: Sketch, summary: Mapping[str, Any]) -> str:
    entries = summary['kinetic_energy_windows'][:2]
    means = [
        f'{fixed(entry["mean"], 2)} J over {entry["window"][0]:g}–{entry["window"][1]:g} s'
        for entry in entries
        if entry['mean'] is not None and entry['window'][0] == entries[0]['window'][0]
    ]
    if not means:
        return ''
    text = f'The mean kinetic energy of {leading.controller} is {join(means)}'
    if paper.paper_run(runs, 'gvc') is leading:
        printed = fixed(paper.KINETIC_ENERGY, 2)
        text += f'; the paper prints {printed} J and no window'
    return f'{text}.'


def _couplings(summary: Mapping[str, Any], leading: Sketch) -> str:
    coupling = summary['coupling']
    if all(len(zeros) == 6 for zeros in coupling['structural_zeros'].values()):
        return 'M is diagonal: no degree of freedom is coupled to another by inertia.'
    xi, pi = coupling['delta_xi_max'], coupling['delta_pi_max']
    parts = [
        f'{symbol} of {DOFS[i]} by up to {number(values[i], 2)} {unit}'
        for symbol, values, unit, members in (
            ('the velocity component', xi, 'm/s', range(3)),
            ('the velocity component', xi, 'rad/s', range(3, 6)),
            ('the input', pi, 'N', range(3)),
            ('the input', pi, 'N m', range(3, 6)),
        )
        for i in [max(members, key=values.__getitem__)]
        if values[i] > 0
    ]
    return f'Inertial coupling deforms, under {leading.controller}, {join(parts)}.' if parts else ''


def _claims(claims: Sequence[Claim]) -> str:
    if not claims:
        return ''
    counts = {word: [c for c in claims if c.verdict == word] for word in DECIDED}
    counts = {word: rows for word, rows in counts.items() if rows}
    decided = sum(len(rows) for rows in counts.values())
    parts = []
    for word, rows in counts.items():
        numbers = f' (no. {join([str(row.number) for row in rows])})'
        parts.append(f'{len(rows)} {word}{"" if word == "reproduced" else numbers}')
    outcome = f': {join(parts)}' if parts else ''
    return f'Of the paper’s {len(claims)} claims these runs decide {decided}{outcome}.'
