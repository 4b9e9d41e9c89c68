"""The order of the tests: what waits for nodes first, so that parallel workers end together."""

import signal
from pathlib import Path

import pytest

FIRST = ('system', 'ros')

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # in the background of a shell
    signal.signal(signal.SIGINT, signal.default_int_handler)  # what tests interrupt inherits it


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    folders = [*FIRST, '']

    def place(item: pytest.Item) -> int:
        folder = Path(item.path).parent.name
        return folders.index(folder if folder in FIRST else '')

    items.sort(key=place)
