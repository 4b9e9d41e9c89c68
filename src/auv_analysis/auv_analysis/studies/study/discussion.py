"""Step 6 of the paper's procedure: what the numbers say, each sentence with where they stand."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from auv_analysis.metrics.summary import TRANSIENT
from auv_analysis.output.text import Maths, fixed, join, number
from auv_analysis.report.document import Sentence
from auv_dynamics.vehicle import DOFS

Summary = Mapping[str, Any]
MUCH = 2.0  # times: from which ratio on a difference is worth a sentence
MOST = 95.0  # %: share that counts as nearly all
SMALL = 0.01  # of a coupling relative to what it deforms: below it nothing is deformed
UNITS = {'delta_xi': ('m/s', 'rad/s'), 'delta_pi': ('N', 'N m')}
OWN = {'delta_xi': 'velocity', 'delta_pi': 'effort'}
WORDS = {'delta_xi': ('velocity component', 'motion'), 'delta_pi': ('input', 'input')}


def discussion(summaries: Mapping[str, Summary], leading: str) -> list[Sentence]:
    """Sentences on convergence, energy, deformation and structure, in this order.

    Parameters
    ----------
    summaries : name -> `summarize(run)`, of one scenario
    leading : the run whose energy and couplings are discussed

    Returns
    -------
    sentences : only those that the numbers carry

    """
    mine = summaries[leading]
    found = [sentence for name, summary in summaries.items() for sentence in _pace(name, summary)]
    found += _pairs(summaries, leading)
    found += _energy(leading, mine)
    for kind in ('delta_xi', 'delta_pi'):
        found += _deformed(kind, leading, mine)
    return [*found, *_structure(mine)]


def _pace(name: str, summary: Summary) -> Iterator[Sentence]:
    """Which velocities converge slowly, or not at all."""
    times = summary['velocity_error']['settling_time']
    never = [dof for dof, time in zip(DOFS, times, strict=True) if time is None]
    rest = [(time, dof) for dof, time in zip(DOFS, times, strict=True) if time]
    text = ''
    if never:
        text = f'Under {name}, {join(never)} {"does" if len(never) == 1 else "do"} not settle '
        text += f'within {summary["duration"]:g} s'
        text += (
            f'; of the others {max(rest)[1]} is last, after {max(rest)[0]:.2f} s' if rest else ''
        )
    elif rest:
        text = f'Under {name}, {max(rest)[1]} settles last, after {max(rest)[0]:.2f} s'
    else:
        text = f'Under {name} no error ever leaves the band within which it counts as settled'
    yield Sentence(f'{text}.', 'table-key_figures')


def _pairs(summaries: Mapping[str, Summary], leading: str) -> Iterator[Sentence]:
    """How the late errors of the other runs compare with those of the leading one."""
    mine = summaries[leading]['velocity_error']['max_after_2s']
    for name, summary in summaries.items():
        theirs = summary['velocity_error']['max_after_2s']
        if name == leading or mine is None or theirs is None:
            continue
        ratios = [(a / b, dof) for a, b, dof in zip(theirs, mine, DOFS, strict=True) if b > 0]
        larger = [f'{number(r, 2)} times in {dof}' for r, dof in ratios if r >= MUCH]
        smaller = [f'{number(1 / r, 2)} times in {dof}' for r, dof in ratios if 0 < r <= 1 / MUCH]
        if larger:
            text = f'After {TRANSIENT:g} s the errors of {name} exceed those of {leading} '
            yield Sentence(f'{text}{join(larger)}.', 'table-key_figures')
        if smaller:
            text = f'After {TRANSIENT:g} s the errors of {leading} exceed those of {name} '
            yield Sentence(f'{text}{join(smaller)}.', 'table-key_figures')


def _energy(name: str, summary: Summary) -> Iterator[Sentence]:
    """Where the kinetic energy is."""
    shares = summary['kinetic_energy']['shares_percent']
    if shares is None or not any(shares):
        return
    order = np.argsort(shares)[::-1]
    count = 1 + int(np.argmax(np.cumsum(np.array(shares)[order]) >= MOST))
    parts = [f'ξ{i + 1} ({DOFS[i]}) has {fixed(shares[i], 2)} %' for i in order[:count]]
    text = f'Of the kinetic energy of {{}} over the whole run, {join(parts)}'
    rest = float(np.array(shares)[order[count:]].sum())
    text += f'; the other {len(order) - count} have {fixed(rest, 2)} % together' if rest else ''
    yield Sentence(Maths(f'{text}.', name), 'table-energy')


def _deformed(kind: str, name: str, summary: Summary) -> Iterator[Sentence]:
    """Which component is deformed most, by how much of itself, and by which other."""
    largest, own = summary['coupling'][f'{kind}_max'], summary[OWN[kind]]['max']
    terms = [term for term in summary['coupling_terms'][kind] if term['share_percent'] is not None]
    what, cause = WORDS[kind]
    ratios = [a / b if b > 0 else 0.0 for a, b in zip(largest, own, strict=True)]
    for i in sorted(range(6), key=lambda i: -ratios[i])[:1]:
        mine = [term for term in terms if term['to'] == DOFS[i]]
        if not mine or ratios[i] < SMALL:
            continue
        main = max(mine, key=lambda term: term['share_percent'])
        unit = UNITS[kind][i // 3]
        text = f'The {what} of {DOFS[i]} is deformed by up to {number(largest[i])} {unit}'
        text += f', where it reaches {number(own[i])} {unit} by itself'
        text += f'; the {cause} of {main["from"]} causes {fixed(main["share_percent"], 1)} % of it'
        yield Sentence(f'{text}.', 'table-terms')


def _structure(summary: Summary) -> Iterator[Sentence]:
    """What vanishes for every motion."""
    zeros = summary['coupling']['structural_zeros']
    if all(len(entries) == len(DOFS) for entries in zeros.values()):
        text = 'M is diagonal: Υ is the identity, and no degree of freedom deforms another.'
        yield Sentence(text, 'table-Upsilon')
        return
    parts = [
        f'{symbol} of {join(zeros[kind])}'
        for kind, symbol in (('delta_xi', 'Δξ'), ('delta_pi', 'Δπ'))
        if zeros[kind]
    ]
    text = f'Structurally zero, for every motion and input, are {join(parts)}.'
    yield Sentence(text, 'table-couplings')
