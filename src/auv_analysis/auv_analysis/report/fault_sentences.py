"""What the faults do, in a sentence each."""

from collections.abc import Iterator, Mapping, Sequence

from auv_analysis.metrics.fault_response import Response
from auv_analysis.output.text import fixed, number, plain
from auv_analysis.report.document import Sentence
from auv_dynamics.vehicle import DOFS

Found = Mapping[str, Sequence[Response]]
SAME = 0.1  # of the error before: a smaller change is none


def fault_sentences(found: Found) -> list[Sentence]:
    """A sentence per fault on the degree of freedom that it disturbs most.

    Parameters
    ----------
    found : controller -> `responses(run)`, of one scenario

    """
    numbers = dict.fromkeys(one.mark.number for several in found.values() for one in several)
    return [
        Sentence(text, f'table-faults_{number}')
        for number in numbers
        for text in _of_fault(
            [(n, r) for n, s in found.items() for r in s if r.mark.number == number]
        )
    ]


def fault_overview(found: Found) -> Iterator[Sentence]:
    """A sentence per controller on all faults together."""
    for name, several in found.items():
        there = [response for response in several if response.rms[1] is not None]
        if not there:
            continue
        worst = max(there, key=_rise)
        ended = {one.mark.number for one in several if one.until is not None}
        open_ones = {n.mark.number for n in several if n.until is not None and n.recovery is None}
        text = f'The fault that disturbs {name} most is number {worst.mark.number} '
        text += f'({worst.mark.label}, {worst.mark.times}): up to {number(worst.peak[1], 2)} '
        text += f'{_unit(worst)} in {worst.dof}'
        if ended:
            back = len(ended) - len(open_ones)
            text += f'; after {back} of the {len(ended)} that end every error comes back into its '
            text += 'settling band before anything else changes'
        yield Sentence(f'{text}.', 'faults')


def _unit(response: Response) -> str:
    return 'rad/s' if response.dof in DOFS[3:] else 'm/s'


def _of_fault(members: Sequence[tuple[str, Response]]) -> Iterator[str]:
    seen = [response for _, response in members if response.rms[1] is not None]
    if not seen:
        return
    worst = max(seen, key=_rise)
    mark = worst.mark
    head = f'Fault {mark.number} ({mark.label}, {mark.times})'
    if not any(_leaves(response) for response in seen):
        yield f'{head}: no velocity error leaves its settling band.'
        return
    parts = [_of_run(name, one) for name, one in members if one.dof == worst.dof]
    yield f'{head} shows most in {worst.dof}: {"; ".join(parts)}.'


def _rise(response: Response) -> float:
    """How much the error grows, in settling bands."""
    before, during, _ = response.rms
    return ((during or 0.0) - (before or 0.0)) / response.band


def _leaves(response: Response) -> bool:
    return (response.peak[1] or 0.0) > response.band


def _of_run(name: str, response: Response) -> str:
    unit = _unit(response)
    before, during, _ = response.rms
    if during is None:
        return f'under {name} it is not reached'
    if before is None:
        text = f'under {name} its RMS error is {number(during, 2)} {unit}'
    elif abs(during - before) <= SAME * before:
        text = f'under {name} its RMS error stays at {number(during, 2)} {unit}'
    else:
        verb = 'rises' if during > before else 'falls'
        change = f'from {number(before, 2)} to {number(during, 2)} {unit}'
        text = f'under {name} its RMS error {verb} {change}'
    return f'{text} (at most {number(response.peak[1], 2)}), {_recovery(response)}'


def _recovery(response: Response) -> str:
    if response.until is None:
        return 'and the fault stays'
    if response.recovery is None:
        before = response.peak[0]
        always = before is not None and before > response.band
        text = f'not back within ± {plain(response.band)} by {response.until:g} s'
        return f'{text}, nor was it always before the fault' if always else text
    if response.recovery == 0.0:
        return 'within the settling band from its end on'
    return f'back within ± {plain(response.band)} after {fixed(response.recovery, 2)} s'
