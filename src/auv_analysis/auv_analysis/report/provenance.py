"""What made a report: the command, the versions and the time."""

import platform
import shlex
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

from auv_dynamics.kernel.compile import sources_digest

PACKAGES = ('auv_analysis', 'auv_gvc_controller', 'auv_dynamics', 'numpy', 'numba', 'scipy')


@dataclass(frozen=True)
class Provenance:
    """Where a report comes from.

    Attributes
    ----------
    command : as it was typed, '' where it was no command
    versions : name -> version of Python and of the packages that the numbers depend on
    sources : digest of the workspace's own sources
    written : UTC

    """

    command: str
    versions: dict[str, str]
    sources: str
    written: str


def provenance() -> Provenance:
    """What made a report that is written now."""
    program = Path(sys.argv[0])
    ours = program.stem == 'auv' or program.match('auv_analysis/cli/main.py')
    versions = {'Python': platform.python_version()}
    for package in PACKAGES:
        try:
            versions[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return Provenance(
        command=shlex.join(['auv', *sys.argv[1:]]) if ours else '',
        versions=versions,
        sources=sources_digest(),
        written=f'{datetime.now(UTC):%Y-%m-%d %H:%M} UTC',
    )
