"""The order of the tests: what waits for nodes first, so that parallel workers end together.

A test that waits for nodes is run again where the machine gave this process no turn for a while:
what it saw then says nothing of the nodes. The summary names it as a rerun.

Examples of property tests are the same in every run, and nobody judges how long one takes;
`make properties` asks for more of them, drawn by a seed.
"""

import gc
import os
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # before NumPy: the workers share the cores

import pytest
from hypothesis import settings

HERE = Path(__file__).parent
FIRST = ('system', 'ros')
TIMED = {*FIRST, 'examples'}  # folders of tests that wait for nodes
PAUSE = 0.25  # s: watchdogs of half a second have then been called by the machine

settings.register_profile(
    'tests', derandomize='AUV_GVC_EXAMPLES' not in os.environ, deadline=None, database=None
)
settings.load_profile('tests')

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # in the background of a shell
    signal.signal(signal.SIGINT, signal.default_int_handler)  # what tests interrupt inherits it
if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:  # by `nohup`
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


class Pauses(threading.Thread):
    """Measures for how long this process gets no turn."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.longest = 0.0  # s

    def run(self) -> None:
        """Sleep, and see how late it wakes."""
        now, sleep = time.monotonic, threading.Event().wait  # tests replace those of `time`
        while True:
            before = now()
            sleep(0.02)
            self.longest = max(self.longest, now() - before)


PAUSES = Pauses()
AGAIN = pytest.mark.flaky(reruns=2, condition=lambda: PAUSES.longest > PAUSE)


def pytest_sessionstart() -> None:
    """Begin to measure."""
    PAUSES.start()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup() -> None:
    """Forget the pauses before a test."""
    PAUSES.longest = 0.0


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
    for item in items:
        if TIMED.intersection(Path(item.path).parts[len(HERE.parts) :]):
            item.add_marker(AGAIN)
