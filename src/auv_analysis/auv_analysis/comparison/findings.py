"""What a comparison found, in sentences computed from its table."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from auv_analysis.comparison.entries import Entry
from auv_analysis.comparison.ranking import ERRORS, Ranking
from auv_analysis.measures import BY_NAME
from auv_analysis.report.document import Sentence
from auv_analysis.report.findings import namesakes
from auv_analysis.report.text import join, number

SETTLED = 'overall.velocity_error.settling_time'
EXTREMES = (  # measures whose smallest and largest are said, and what they are called
    ('overall.velocity_error.rms.linear', 'rms linear velocity error'),
    ('overall.velocity_error.rms.angular', 'rms angular velocity error'),
    ('overall.effort.rms.linear', 'rms force'),
    ('overall.coupling.delta_xi_max.angular', 'deformation Δξ of an angular velocity'),
)
RUNS = 'table-runs'
MOST_NAMES = 6
Rows = Sequence[Mapping[str, Any]]


def findings(entries: Sequence[Entry], rows: Rows, ranking: Ranking) -> list[Sentence]:
    """Sentences of the summary: what differs, who settles, the extremes, what cannot be compared.

    Parameters
    ----------
    entries, rows, ranking : of the same runs

    """
    known = [row for row in rows if not row['failure']]
    found = [_settled(known), *(_extremes(known, *which) for which in EXTREMES)]
    found += [_uncoupled(entries), _differing(known), _diverged(rows)]
    found += namesakes([entry.sketch for entry in entries if entry.sketch])
    return [Sentence(text, RUNS) for text in found if text]


def _settled(rows: Rows) -> str:
    times = {row['run']: row[SETTLED] for row in rows if row[ERRORS] is not None}
    if not times:
        return ''
    settled = {name: time for name, time in times.items() if time is not None}
    if not settled:
        return f'In none of {len(times)} runs do all six velocity errors settle.'
    first, last = min(settled, key=settled.__getitem__), max(settled, key=settled.__getitem__)
    text = f'In {len(settled)} of {len(times)} runs all six velocity errors settle'
    if len(settled) == 1:
        return f'{text}: {first} after {number(settled[first])} s.'
    ends = f'{first} after {number(settled[first])} s, the last {last} after'
    return f'{text}, the first {ends} {number(settled[last])} s.'


def _extremes(rows: Rows, name: str, word: str) -> str:
    values = {row['run']: row[name] for row in rows if row[name] is not None}
    if len(set(values.values())) < 2:
        return ''
    least, most = min(values, key=values.__getitem__), max(values, key=values.__getitem__)
    unit = BY_NAME[name].unit
    return (
        f'The {word} goes from {number(values[least])} {unit} ({least}) to '
        f'{number(values[most])} {unit} ({most}).'
    )


def _uncoupled(entries: Sequence[Entry]) -> str:
    vehicles = dict.fromkeys(
        entry.vehicle
        for entry in entries
        if entry.summary
        and all(len(z) == 6 for z in entry.summary['coupling']['structural_zeros'].values())
    )
    if not vehicles:
        return ''
    verb = 'has' if len(vehicles) == 1 else 'have'
    names = join(list(vehicles))
    return f'{names} {verb} a diagonal M: Upsilon = I, nothing is coupled by inertia.'


def _differing(rows: Rows) -> str:
    """Durations and steps where they are not all the same, and what that means."""
    parts = []
    for name in ('duration', 'step'):
        counts = Counter(row[name] for row in rows)
        if len(counts) > 1:
            listed = [f'{value:g} s ({count} runs)' for value, count in counts.most_common(6)]
            parts.append(f'{name}s differ: {join(listed)}')
    if not parts:
        return ''
    text = '; '.join(parts)
    return f'{text[0].upper()}{text[1:]}; means and root mean squares are those of each whole run.'


def _diverged(rows: Rows) -> str:
    failed = [row['run'] for row in rows if row['failure']]
    if not failed:
        return ''
    shown = [*failed[:MOST_NAMES], *(['others'] if len(failed) > MOST_NAMES else [])]
    return f'{len(failed)} of {len(rows)} runs failed and have no figures: {join(shown)}.'
