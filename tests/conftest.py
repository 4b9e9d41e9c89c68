"""The order of the tests: what waits for nodes first, so that parallel workers end together.

Examples of property tests are the same in every run, and nobody judges how long one takes;
`make properties` asks for more of them, drawn by a seed.
"""

import gc
import os
import signal
from collections.abc import Iterator
from pathlib import Path

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # before NumPy: the workers share the cores

import pytest
from hypothesis import settings

FIRST = ('system', 'ros')

settings.register_profile(
    'tests', derandomize='AUV_GVC_EXAMPLES' not in os.environ, deadline=None, database=None
)
settings.load_profile('tests')

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # in the background of a shell
    signal.signal(signal.SIGINT, signal.default_int_handler)  # what tests interrupt inherits it
if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:  # by `nohup`
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Collect without looking for garbage: what is imported and collected stays to the end."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    folders = [*FIRST, '']

    def place(item: pytest.Item) -> int:
        folder = Path(item.path).parent.name
        return folders.index(folder if folder in FIRST else '')

    items.sort(key=place)
