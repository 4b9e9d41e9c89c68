"""Findings for a terminal: what passed in a line, the rest with what was expected and advice."""

from collections.abc import Sequence
from itertools import groupby

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from auv_analysis.driver_check.catalogue import CHECKS, GROUPS
from auv_analysis.driver_check.finding import FAIL, NOT_CHECKED, PASS, Finding, counts

COLOURS = {PASS: 'green', FAIL: 'bold red', NOT_CHECKED: 'yellow'}


def findings_table(findings: Sequence[Finding]) -> RenderableType:
    """Findings by group, and at the end how many there are of each verdict."""
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column(overflow='fold')
    for group, members in groupby(findings, key=lambda finding: CHECKS[finding.id].group):
        table.add_row(Text(GROUPS[group], 'bold'))
        for _, alike in groupby(members, key=_reason):
            listed = list(alike)
            name = listed[0].id if len(listed) == 1 else f'{len(listed)} checks'
            verdict = Text(listed[0].verdict, COLOURS[listed[0].verdict])
            table.add_row(Text(f'  {name}'), verdict, _words(listed[0]))
    return Group(table, _sum(findings))


def _reason(finding: Finding) -> str:
    """What checks have in common that were not made and of which there is nothing else to say."""
    lonely = finding.verdict != NOT_CHECKED or finding.advice
    return finding.id if lonely else f' {finding.found}'


def _words(finding: Finding) -> Text:
    text = Text(finding.found)
    if finding.verdict == FAIL:
        text.append(f'\nexpected: {finding.expected}', 'dim')
    if finding.advice:
        text.append(f'\n{finding.advice}', 'italic')
    return text


def _sum(findings: Sequence[Finding]) -> Text:
    text = Text('\n')
    for verdict, count in counts(findings).items():
        text.append(f'{count} {verdict}', COLOURS[verdict] if count else 'dim').append('  ')
    return text
