"""Commands as people type them: what starting `auv` costs."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from measure import Measured, cost, interleaved


def command_line() -> dict[str, Measured]:
    """`auv --help` against an interpreter that does nothing."""
    auv = str(Path(sys.executable).with_name('auv'))
    runs = 21  # each takes some 50 ms, most of it the operating system's
    return interleaved(
        {'help_vs_python': cost(lambda: run([auv, '--help']))},
        cost(lambda: run([sys.executable, '-c', 'pass'])),
        's',
        runs,
    )


def run(command: Sequence[str]) -> None:
    """Run a command to its end; RuntimeError with its last line when it fails."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        last = (done.stderr.splitlines() or ['no message'])[-1]
        raise RuntimeError(f'{" ".join(command)}: exit code {done.returncode}: {last}')
