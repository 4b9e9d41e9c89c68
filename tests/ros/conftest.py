"""What tests of nodes share: a process in which nodes are started to see what they refuse."""

import subprocess
from collections.abc import Callable, Iterator

import pytest
from harness import environment, fresh_domain
from starter import Starter


@pytest.fixture(scope='session')
def started() -> Iterator[Callable[..., subprocess.CompletedProcess]]:
    """Start a node by name and arguments, end it as soon as it stands."""
    starter = Starter(environment(fresh_domain()))

    def start(name: str, *arguments: str) -> subprocess.CompletedProcess:
        code, said = starter.start(name, *arguments)
        return subprocess.CompletedProcess([name, *arguments], code, said, '')

    yield start
    starter.close()
