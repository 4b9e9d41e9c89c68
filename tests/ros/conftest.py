"""What tests of nodes share: a process in which nodes are started to see what they refuse."""

import json
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from harness import PATIENCE, environment, fresh_domain

STARTER = Path(__file__).resolve().parents[1] / 'starter.py'


@pytest.fixture(scope='session')
def started() -> Iterator[Callable[..., subprocess.CompletedProcess]]:
    """Start a node by name and arguments, end it as soon as it stands."""
    process = subprocess.Popen(
        [sys.executable, str(STARTER)],
        env=environment(fresh_domain()), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip

    def start(name: str, *arguments: str) -> subprocess.CompletedProcess:
        given = [name, *arguments]
        hangs = threading.Timer(PATIENCE, process.kill)
        hangs.start()
        try:
            print(json.dumps(given), file=process.stdin, flush=True)
            answer = process.stdout.readline()
        finally:
            hangs.cancel()
        assert answer, f'{given} does not end'
        code, said = json.loads(answer)
        return subprocess.CompletedProcess(given, code, said, '')

    yield start
    process.communicate()
