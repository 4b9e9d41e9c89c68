"""What tests of reports share: the report of case1's first seconds in a browser, quick figures."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from pathlib import Path

import pytest
from helpers import approved as approving
from helpers import artists
from helpers.artists import captured
from helpers.browser import Watched, chromium

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.output import parallel
from auv_analysis.report import panels, results
from auv_analysis.report.run_report import write_report
from auv_analysis.runs.run import Run


@pytest.fixture(scope='session', autouse=True)
def known_columns() -> Iterator[None]:
    """No table shows a column that none of its rows has, which would be empty: a wrong key."""
    arrow = results._arrow

    def checked(rows, order):
        if rows and not isinstance(rows, Mapping):
            assert not {*order} - {name for row in rows for name in row}
        return arrow(rows, order)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(results, '_arrow', checked)
        yield


@pytest.fixture(scope='session', autouse=True)
def no_copy() -> Iterator[None]:
    """Commands share no work with a copy of this process: other tests run on the other core."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(parallel, '_two_cores', lambda: False)
        yield


@pytest.fixture(scope='session')
def browser() -> Iterator:
    with chromium() as found:
        yield found


@pytest.fixture(scope='session')
def short_runs() -> dict[str, Run]:
    scenario = load_scenario('case1')
    found = {name: simulate(scenario, name) for name in scenario.controllers}
    return {name: run.part(run.t <= 5.0) for name, run in found.items()}


@pytest.fixture(scope='session')
def report_path(browser, short_runs, tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp('report')
    summaries = {name: summarize(run) for name, run in short_runs.items()}
    with captured(panels=True), pytest.MonkeyPatch.context() as patch:
        parts = 'errors', 'inputs', 'certificates', 'energy'  # panels of the others are like these
        patch.setattr(panels, 'SECTIONS', {part: panels.SECTIONS[part] for part in parts})
        return write_report(out, short_runs, summaries, 'a: 1', 'b: 2')


@pytest.fixture(scope='session')
def report(browser, report_path) -> Iterator[Watched]:
    """The page of all tests, each of which leaves it as it found it: opening takes seconds."""
    watched = Watched(browser, report_path)
    watched.page.wait_for_selector('.with-panels')
    yield watched
    watched.close()


@pytest.fixture
def unrendered() -> Iterator[None]:
    """Figures are composed but not rendered, which takes most of the time of a report."""
    with captured():
        yield


@pytest.fixture
def undrawn() -> Iterator[None]:
    """Not even composed, where nothing that they show is looked at."""
    with artists.undrawn():
        yield


@pytest.fixture(scope='session')
def composing() -> Callable[[], AbstractContextManager[None]]:
    """The same for a part of a test, or for a fixture that several tests share."""
    return captured


@pytest.fixture
def approved(request: pytest.FixtureRequest) -> Iterator[approving.Approved]:
    """Holds all that the test shows, which it makes or names, against the approved text."""
    shown = approving.Approved()
    with shown.watching():
        yield shown
    path = request.path.parent / 'approved' / f'{request.path.stem.removeprefix("test_")}.txt'
    approving.check(path, request.node.name, shown.lines(), shown.within)
