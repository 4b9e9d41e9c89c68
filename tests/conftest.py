"""The order of the tests: those that wait for nodes between those that compute.

So workers that mostly wait share the cores with others all the time. A test that waits for nodes
is run again where the machine gave this process no turn for a while: what it saw then says nothing
of the nodes. The summary names it as a rerun.

Examples of property tests are the same in every run, and nobody judges how long one takes;
`make properties` asks for more of them, drawn by a seed. `AUV_GVC_ORDER=seed` draws the order of
files, and of the tests in each.
"""

import gc
import os
import random
import signal
from collections.abc import Iterator
from pathlib import Path

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # before NumPy: the workers share the cores

import pytest
from helpers.needs import judged, unproven
from helpers.patience import FACTOR, patience
from helpers.stalls import PAUSE, PAUSES
from hypothesis import settings

HERE = Path(__file__).parent
TIMED = {'system', 'ros', 'examples'}  # folders of tests that wait for nodes
ENDS = 0.8  # part of the order in which they stand: at the end no worker is to wait alone
LIMIT, LONG_LIMIT = 600.0, 7200.0  # s, after which a test hangs, with its fixtures and reruns
ORDER = os.environ.get('AUV_GVC_ORDER')  # seed

os.fsync = os.fdatasync = lambda _: None  # nobody cuts the power: no test waits for the disk

settings.register_profile(
    'tests', derandomize='AUV_GVC_EXAMPLES' not in os.environ, deadline=None, database=None
)
settings.load_profile('tests')

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # in the background of a shell
    signal.signal(signal.SIGINT, signal.default_int_handler)  # what tests interrupt inherits it
for number in (signal.SIGQUIT, signal.SIGHUP):  # the latter by `nohup`
    if signal.getsignal(number) == signal.SIG_IGN:
        signal.signal(number, signal.SIG_DFL)


if os.environ.get('AUV_GVC_TESTS') != str(os.getppid()):  # no worker of xdist
    os.environ['AUV_GVC_TESTS'] = str(os.getpid())  # whose programs are forked by one process

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
    """Collect without looking for garbage, and look for it seldom: that saves a twentieth.

    What is imported and collected stays to the end, most of what comes then is gone soon.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
        gc.set_threshold(200_000, 20, 1000)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    files, above = {item.path for item in items}, len(HERE.parts)
    rooms = {path: path.parts[above] if len(path.parts) > above else '' for path in files}
    if ORDER is None:
        places = spread(list(dict.fromkeys(item.path for item in items)), rooms)
        items.sort(key=lambda item: places[item.path])
    else:
        items[:] = drawn(items, random.Random(ORDER))
    for item in items:
        limit = LONG_LIMIT if item.get_closest_marker('long') else LIMIT
        item.add_marker(pytest.mark.timeout(patience(limit)))
        if rooms[item.path] in TIMED:
            item.add_marker(AGAIN)


def spread(files: list[Path], rooms: dict[Path, str]) -> dict[Path, float]:
    """Where each file comes: both kinds evenly, those that wait all before the last fifth."""
    waiting = [path for path in files if rooms[path] in TIMED]
    computing = [path for path in files if rooms[path] not in TIMED]
    places = {path: ENDS * i / len(waiting) for i, path in enumerate(waiting)}
    return places | {path: i / len(computing) for i, path in enumerate(computing)}


def drawn(items: list[pytest.Item], rng: random.Random) -> list[pytest.Item]:
    """Files in random order, each with its tests in random order."""
    files = dict[Path, list[pytest.Item]]()
    for item in items:
        files.setdefault(item.path, []).append(item)
    shuffled = [rng.sample(tests, len(tests)) for tests in files.values()]
    rng.shuffle(shuffled)
    return [item for tests in shuffled for item in tests]


def pytest_report_header() -> str:
    """Say what is not as usual."""
    order = 'spread' if ORDER is None else f'AUV_GVC_ORDER={ORDER}'
    return f'patience: {FACTOR:g} times, order: {order}'


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Iterator[None]:
    """Let no skip pass that CI must not have."""
    return judged((yield))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Iterator[None]:
    """The same of a whole file."""
    return judged((yield))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """List what was skipped, and what that leaves unproven."""
    if lines := unproven(terminalreporter.stats.get('skipped', ())):
        terminalreporter.section('not proven here')
        terminalreporter.write('\n'.join([*lines, '']))
