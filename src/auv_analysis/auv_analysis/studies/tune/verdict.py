"""What a tuning says, in sentences made of its numbers."""

from collections.abc import Iterable, Iterator

import numpy as np

from auv_analysis.output.text import join, number
from auv_analysis.report.document import Sentence
from auv_analysis.studies.tune.cost import MEANINGS
from auv_analysis.studies.tune.results import LEVEL, Comparison, Tuning

TUNED, PAIRED, DRAWS = 'table-tuned', 'table-paired', 'table-draws'
GAINS = 'table-gains'
SMALLEST_P = 1e-6
SMALLEST_SHARE = 1e-6  # of an equality: below it, it is met


def verdict(outcome: Tuning) -> list[Sentence]:
    """Sentences of an outcome, the most important ones first."""
    drawn = [*_ranked(outcome), *_diverged(outcome)] if outcome.draws else []
    whole = [_nominal(outcome), _left(outcome), _unreached(outcome), drawn]
    last = _price(outcome), _remarks(outcome)
    return [sentence for part in (*whole, *last) for sentence in part]


def _comparisons(outcome: Tuning) -> list[Comparison]:
    """Those in what the gains were tuned for."""
    return [c for c in outcome.comparisons if c.measure == outcome.goal.names[0]]


def _reached(outcome: Tuning) -> list[str]:
    return [name for name, rival in outcome.laws.items() if rival.best.reached]


def _nominal(outcome: Tuning) -> Iterator[Sentence]:
    """Least of what is made small, by law."""
    reference, reached = outcome.request.reference, _reached(outcome)
    if not reached:
        return
    measure, equal = outcome.goal.names
    base, level = (getattr(outcome.goal.reference, n)[0] for n in (measure, equal))
    found = _each(f'{number(outcome.ratio(n, measure))} for {outcome.laws[n].law}' for n in reached)
    away = max(abs(outcome.ratio(name, equal) - 1.0) for name in reached)
    yield Sentence(
        f'At the {MEANINGS[equal].label} of {reference} ({number(level, 4)} '
        f'{MEANINGS[equal].unit}, met within {_percent(max(away, SMALLEST_SHARE))}), the least '
        f'{MEANINGS[measure].label} that the search found is {found}, as parts of {reference}’s '
        f'{number(base)} {MEANINGS[measure].unit}.',
        TUNED,
    )


def _left(outcome: Tuning) -> Iterator[Sentence]:
    """What the law has to do with it, the gains apart."""
    own, measure, reached = outcome.retuned, outcome.goal.names[0], _reached(outcome)
    others = [name for name in reached if name != own]
    if own is None or own not in reached or not others:
        return
    gained = outcome.ratio(own, measure)
    left = _each(
        f'{number(outcome.ratio(n, measure) / gained)} for {outcome.laws[n].law}' for n in others
    )
    yield Sentence(
        f'{outcome.request.reference}’s own law, searched in the same way, comes to '
        f'{number(gained)}: that is the gains’ part. What is left to the law is a factor of '
        f'{left}.',
        TUNED,
    )


def _unreached(outcome: Tuning) -> Iterator[Sentence]:
    label = MEANINGS[outcome.goal.names[1]].label
    for name, rival in outcome.laws.items():
        if not rival.best.reached:
            away = outcome.ratio(name, outcome.goal.names[1]) - 1.0
            yield Sentence(
                f'No gains of {rival.law} that were tried have the {label} of '
                f'{outcome.request.reference} within {_percent(outcome.goal.tolerance)}; the '
                f'nearest are {_percent(away)} away, and {name} is no fair comparison.',
                TUNED,
            )


def _ranked(outcome: Tuning) -> Iterator[Sentence]:
    """Who is ahead over the draws: of the reference, and of its own law with searched gains."""
    own, reference, reached = outcome.retuned, outcome.request.reference, _reached(outcome)
    label = MEANINGS[outcome.goal.names[0]].label
    draws = len(outcome.draws[reference].error)
    for against in filter(None, (reference, own)):
        rows = [
            c for c in _comparisons(outcome) if c.against == against and c.controller in reached
        ]
        if rows:
            yield Sentence(
                f'Over {draws} draws of model error and disturbance, the same for all, in '
                f'{label}: {_places(rows, against)} (ratios after Hodges and Lehmann; Wilcoxon '
                f'signed-rank test, Holm’s correction, level {LEVEL:g}).',
                PAIRED,
            )


def _places(rows: list[Comparison], against: str) -> str:
    words = {-1: f'ahead of {against}', 1: f'behind {against}', 0: f'not told apart from {against}'}
    parts = []
    for sign, place in words.items():
        names = [f'{c.controller} ({_ratio(c)})' for c in rows if c.verdict == sign]
        if names:
            parts.append(f'{join(names)} {"are" if len(names) > 1 else "is"} {place}')
    return '; '.join(parts)


def _ratio(c: Comparison) -> str:
    return 'no ratio, too many are missing' if c.ratio is None else f'{number(c.ratio)} times'


def p_text(p: float) -> str:
    """Text of a corrected p."""
    return f'p < {number(SMALLEST_P, 1)}' if p < SMALLEST_P else f'p = {number(p, 2)}'


def _diverged(outcome: Tuning) -> Iterator[Sentence]:
    counts = {name: int(np.isnan(m.error).sum()) for name, m in outcome.draws.items()}
    some = [f'{count} of {name}' for name, count in counts.items() if count]
    if some:
        draws = len(outcome.draws[outcome.request.reference].error)
        yield Sentence(f'Closed loops that diverged, of {draws} each: {join(some)}.', DRAWS)


def _remarks(outcome: Tuning) -> Iterator[Sentence]:
    """What is odd about the gains and the commands of each controller."""
    for name in outcome.scenario.controllers:
        for remark in outcome.remarks(name):
            yield Sentence(f'{name}: {remark}.', GAINS)


def _price(outcome: Tuning) -> Iterator[Sentence]:
    small, same = (MEANINGS[name].label for name in outcome.goal.names)
    prices = {n: r.best.price for n, r in outcome.laws.items() if r.best.price is not None}
    if prices:
        said = _each(f'{number(price, 2)} % for {name}' for name, price in prices.items())
        yield Sentence(
            f'What equality is worth: with 1 % more {same}, the {small} changes by {said}; a '
            f'difference between laws is to be read beside that.',
            TUNED,
        )


def _each(parts: Iterable[str]) -> str:
    return join(list(parts))


def _percent(share: float) -> str:
    return f'{number(100 * share, 2)} %'
