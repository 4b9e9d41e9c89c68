"""`auv doctor`: looks at the set-up and says what is wrong with it, and what to do."""

import argparse
from collections import Counter
from typing import Any

from auv_analysis.doctor import graph_checks, machine_checks, python_checks, ros_checks
from auv_analysis.doctor.finding import Check, findings_of
from auv_dynamics.files.errors import FailedError, printable

CHECKS: tuple[Check, ...] = (
    python_checks.python, python_checks.packages, python_checks.compiler,
    python_checks.executables, ros_checks.distro, ros_checks.middleware, ros_checks.reach,
    ros_checks.domain, graph_checks.discovery, graph_checks.neighbours, machine_checks.disk,
    machine_checks.shared_memory, machine_checks.files, machine_checks.clock,
    machine_checks.cores, machine_checks.programs,
)  # fmt: skip


def doctor(options: argparse.Namespace) -> dict[str, Any]:
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
