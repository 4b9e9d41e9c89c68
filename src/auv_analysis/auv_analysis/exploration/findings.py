"""What a sweep found, in sentences computed from its rows."""

from collections.abc import Iterator
from typing import Any

from auv_analysis.exploration.names import short_names
from auv_analysis.exploration.opening import STATUSES
from auv_analysis.exploration.results import Results
from auv_analysis.measures import BY_NAME
from auv_analysis.report.document import Sentence
from auv_analysis.report.text import join, number

SETTLED = 'overall.velocity_error.settling_time'
SAID = (SETTLED, 'overall.velocity_error.rms.linear', 'overall.effort.rms.linear')
MATTERS = 5.0  # %: less is not said


def findings(results: Results) -> list[Sentence]:
    """Sentences of the summary: how much is there, who wins, who settles, what matters, failures.

    Parameters
    ----------
    results : of `analysed`

    """
    found = [
        *_unfinished(results),
        *_settled(results),
        *_against(results),
        *_matters(results),
        *_failed(results),
    ]
    return [
        *found,
        *(Sentence(f'{note[0].upper()}{note[1:]}.', 'campaign') for note in results.notes),
    ]


def _unfinished(results: Results) -> Iterator[Sentence]:
    sweep = results.sweep
    if sweep.rows < sweep.planned:
        text = f'The sweep is not finished: {sweep.rows} of {sweep.planned} rows are there.'
        yield Sentence(text, 'table-counts')


def _settled(results: Results) -> Iterator[Sentence]:
    for row in results.tables['quantiles']:
        if row['figure'] == SETTLED and row['rows']:
            share = 100 * row['known'] / row['rows']
            text = f'Under {row["controller"]} all errors settle in {number(share)} % of the '
            text += f'{row["rows"]} rows that came to their end'
            if row['median'] is not None:
                text += f', in half of them within {number(row["median"])} s'
            yield Sentence(f'{text}.', 'table-quantiles')


def _against(results: Results) -> Iterator[Sentence]:
    for row in results.tables['paired']:
        if row['figure'] in SAID:
            label = BY_NAME[row['figure']].label
            what = 'time to settle' if row['figure'] == SETTLED else label
            text = (
                f'The {what} of {row["controller"]} is smaller than that of {row["other"]} in '
                f'{number(row["smaller_percent"])} % of {row["rollouts"]} rollouts'
            )
            if row['equal_percent']:
                text += f', and in {number(row["equal_percent"])} % there is no difference'
            yield Sentence(f'{text}.', 'table-paired')


def _matters(results: Results) -> Iterator[Sentence]:
    names = short_names(results.varied)
    for name in SAID:
        parts = []
        for controller in results.sweep.controllers:
            rows = [r for r in results.tables['influence']
                    if (r['figure'], r['controller']) == (name, controller)]  # fmt: skip
            if rows:
                row = max(rows, key=lambda r: r['explained_percent'])
                if row['explained_percent'] >= MATTERS:
                    share = number(row['explained_percent'])
                    parts.append(f'{names[row["path"]]} under {controller} ({share} %)')
        if parts:
            text = f'The largest part of the order of {BY_NAME[name].label} is explained by '
            text += f'{join(parts)}.'
            yield Sentence(text, 'table-influence')


def _failed(results: Results) -> Iterator[Sentence]:
    for row in results.counts():
        failed = [f'{row[word]} {word}' for word in STATUSES[1:] if row[word]]
        if failed:
            text = f'Of {row["rows"]} rows of {row["controller"]}, {join(failed)}.'
            worst = [r for r in results.tables['failures'] if r['controller'] == row['controller']]
            text += _worst(worst)
            yield Sentence(text, 'failures')


def _worst(rows: list[dict[str, Any]]) -> str:
    """Where the largest share fails, if it is more than everywhere."""
    rows = [row for row in rows if row['rows']]
    shares = [(row['diverged'] + row['refused']) / row['rows'] for row in rows]
    if not shares or max(shares) == min(shares):
        return ''
    row = rows[shares.index(max(shares))]
    return f' The largest share, {number(100 * max(shares))} %, at {row["path"]} = {row["value"]}.'
