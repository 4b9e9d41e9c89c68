"""`auv doctor`: problems of the set-up, and their remedies."""

import argparse
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from auv_analysis.doctor import checks, discovery
from auv_analysis.doctor.checks import Finding
from auv_dynamics.files.errors import FailedError, named_line, printable

Check = Callable[[], Iterable[Finding]]
CHECKS: tuple[Check, ...] = (
    checks.python,
    checks.packages,
    checks.compiler,
    checks.executables,
    checks.distro,
    checks.middleware,
    checks.discovery_range,
    checks.domain,
    discovery.discovery,
    discovery.peers,
    checks.disk,
    checks.shared_memory,
    checks.files,
    checks.clock,
    checks.cores,
    checks.programs,
)


def findings_of(checks: Iterable[Check]) -> Iterator[Finding]:
    """Findings of checks, one after the other; a check that fails is a finding itself."""
    for check in checks:
        try:
            yield from check()
        except Exception as error:  # whatever a broken set-up does: the other checks go on
            name = getattr(check, '__name__', 'check').replace('_', ' ')
            found = f'could not be looked at: {named_line(error)}'
            yield Finding(name, 'broken', found, 'make clean, then make setup')


def add_arguments(_: argparse.ArgumentParser) -> None:
    """No option of its own."""


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Print each finding as it comes; FailedError where something is broken."""
    findings = []
    for finding in findings_of(CHECKS):
        findings.append(finding)
        if not options.json:
            print(printable(finding.line()), flush=True)
    counts = Counter(finding.verdict for finding in findings)
    document = {
        'findings': [finding._asdict() for finding in findings],
        'broken': counts['broken'],
        'warnings': counts['warning'],
    }
    if counts['broken']:
        raise FailedError(f'{counts["broken"]} of the findings are broken', document)
    if not options.json:
        print(f'nothing is broken, {counts["warning"]} warnings')
    return document
