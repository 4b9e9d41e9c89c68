"""The verdict on a driver: in one line, as a document, and as a table for a terminal."""

from collections.abc import Sequence
from dataclasses import asdict
from itertools import groupby
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from auv_analysis.driver.checks import CHECKS, GROUPS
from auv_analysis.driver.evidence import FAIL, NOT_CHECKED, PASS, Evidence, Finding, counts
from auv_analysis.output.text import join
from auv_dynamics.ros.interface import ODOM, WRENCH

STYLES = {PASS: 'green', FAIL: 'bold red', NOT_CHECKED: 'yellow'}
NEEDED = (  # to pass before a wrench may be sent
    *('odom_publisher', 'wrench_subscriber', 'wrench_publishers', 'qos_wrench', 'frames'),
    *('finite', 'quaternion_norm', 'rate', 'gaps', 'stamps'),
)


def failure_of(findings: Sequence[Finding]) -> str:
    """One line that names the checks that failed; empty where none did."""
    failed = [finding for finding in findings if finding.verdict == FAIL]
    if not failed:
        return ''
    first = failed[0]
    if first.id == 'odom_publisher' and not first.numbers['publishers']:
        return first.found
    names = join([finding.id for finding in failed])
    return f'{len(failed)} of {len(findings)} checks failed: {names}'


def refusal(findings: Sequence[Finding]) -> str:
    """Why no wrench may be sent after the passive checks, or an empty text."""
    against = [one.id for one in findings if one.id in NEEDED and one.verdict != PASS]
    return f'nothing was sent, since {join(against)} did not pass' if against else ''


def document_of(evidence: Evidence, findings: Sequence[Finding]) -> dict[str, Any]:
    """All that was found, ready for JSON."""
    graph, log = evidence.graph, evidence.log
    return {
        'place': graph.place,
        'topics': {ODOM: graph.odom, WRENCH: graph.wrench},
        'messages': len(log.arrived_ns),
        'seconds': log.seconds,
        'settings': asdict(evidence.settings),
        'counts': counts(findings),
        'checks': [finding.document() for finding in findings],
        'trials': [trial.document() for trial in evidence.answered],
    }


def findings_table(findings: Sequence[Finding]) -> RenderableType:
    """Findings by group, and at the end how many there are of each verdict.

    What passed is a line; the rest comes with what was expected and with advice.
    """
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column(overflow='fold')
    for group, members in groupby(findings, key=lambda finding: CHECKS[finding.id].group):
        table.add_row(Text(GROUPS[group], 'bold'))
        for _, alike in groupby(members, key=_reason):
            first, *others = alike
            name = f'{1 + len(others)} checks' if others else first.id
            text = Text(first.found)
            if first.verdict == FAIL:
                text.append(f'\nexpected: {first.expected}', 'dim')
            if first.advice:
                text.append(f'\n{first.advice}', 'italic')
            table.add_row(Text(f'  {name}'), Text(first.verdict, STYLES[first.verdict]), text)
    total = Text('\n')
    for verdict, count in counts(findings).items():
        total.append(f'{count} {verdict}', STYLES[verdict] if count else 'dim').append('  ')
    return Group(table, total)


def _reason(finding: Finding) -> str:
    """What checks have in common that were not made and of which there is nothing else to say."""
    alone = finding.verdict != NOT_CHECKED or finding.advice
    return finding.id if alone else f' {finding.found}'
