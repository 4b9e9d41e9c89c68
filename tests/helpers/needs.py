"""What tests need of a machine, and what stays unproven without it.

A test asks by `need(name, there)`. Its skip is listed at the end of a run. With `AUV_GVC_STRICT=1`
it is a failure instead, and so is every other skip, unless a reason stands here why CI may lack
what is needed, or `AUV_GVC_ABSENT` names it: what `.ci/run` could not install.
"""

import os
import platform
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import pytest

Report = pytest.TestReport | pytest.CollectReport

STRICT = os.environ.get('AUV_GVC_STRICT', '0') != '0'
ABSENT = os.environ.get('AUV_GVC_ABSENT', '').split()
MARK = 'without '


@dataclass(frozen=True)
class Need:
    """What a test cannot do without."""

    unproven: str  # where it is absent
    excuse: str = ''  # why it may be absent on CI; empty: it has to be there


CAPYTAINE_HAS_WHEELS = (platform.system(), platform.machine()) == ('Linux', 'x86_64')
NEEDS = {
    'chromium': Need('that reports and the site work in a browser'),
    'gcc': Need('that the scalar C reference computes what the kernel computes'),
    'npm': Need('that @mcap/core reads our bags, beside rosbags and mcap-ros2-support'),
    'bash': Need('that the completion is valid bash'),
    'zsh': Need('that the completion is valid zsh'),
    'fish': Need('that the completion is valid fish'),
    'hadolint': Need('that the Dockerfile is free of what its linter finds'),
    'npm registry': Need(
        'that @mcap/core reads our bags, beside rosbags and mcap-ros2-support',
        'a machine may have no way to the registry',
    ),
    'capytaine': Need(
        'that the added mass of meshes is right',
        '' if CAPYTAINE_HAS_WHEELS else 'it has wheels for Linux on x86_64 alone',
    ),
    'ros2': Need(
        'that ROS 2 itself finds our executables and takes our security policy',
        'its command line tools and sros2 have no wheels',
    ),
    'launch': Need(
        'that `ros2 launch` itself takes our launch file', 'it comes with ROS 2, and has no wheels'
    ),
    'rerun-sdk': Need('that rerun reads what is exported to it', '170 MB: nightly installs it'),
    'pip-audit': Need(
        'that pip-audit itself finds, fails and passes', 'a machine may have no way to a registry'
    ),
    'sphinx': Need('that the site and its notebooks are sound', 'nightly installs it'),
    'numba': Need(
        'what the compiled kernel computes', 'tests run their own file again without numba'
    ),
    'namespaces': Need(
        'that nothing leaves the machine and nobody outside gets in', 'containers may forbid them'
    ),
    'mounting': Need('what happens on a full disk', 'containers may forbid it'),
    'read-only folders': Need(
        'what happens where a folder becomes read-only', 'some file systems let root write anyway'
    ),
    'plain middleware': Need(
        'that security is refused where the middleware has none', 'ROS from apt has it'
    ),
}


def need(name: str, there: object) -> None:
    """Go on with a test only where the need is there."""
    __tracebackhide__ = True
    assert name in NEEDS
    if not there:
        pytest.skip(MARK + name)


def needing(name: str, there: object) -> pytest.MarkDecorator:
    """Mark of tests that run only where the need is there."""
    assert name in NEEDS
    return pytest.mark.skipif(not there, reason=MARK + name)


def judged(report: Report) -> Report:
    """The same report, or that of a failure where a skip is none that may be."""
    if STRICT and report.skipped and not hasattr(report, 'wasxfail'):
        reason = _reason(report)
        name = reason.removeprefix(MARK)
        if name not in NEEDS:
            report.longrepr = f'skipped for a reason that {__name__} does not know: {reason}'
        elif name in ABSENT or NEEDS[name].excuse:
            return report
        else:
            report.longrepr = f'{reason}, which stays unproven: {NEEDS[name].unproven}'
        report.outcome = 'failed'
    return report


def unproven(reports: Iterable[Report]) -> list[str]:
    """A line for each need that was absent."""
    skipped = Counter(map(_reason, reports))
    lines = []
    for reason, count in sorted(skipped.items()):
        need = NEEDS.get(reason.removeprefix(MARK))
        told = need.unproven if need else f'{__name__} has no word of it'
        excuse = f' (allowed: {need.excuse})' if need and need.excuse else ''
        lines.append(f'{reason}, {count} skipped: {told}{excuse}')
    return lines


def _reason(report: Report) -> str:
    told = report.longrepr
    return str(told[2] if isinstance(told, tuple) else told).removeprefix('Skipped: ')
