"""Progress with what is left: on a terminal, and nothing elsewhere."""

from io import StringIO
from types import SimpleNamespace

import pytest

from auv_analysis.output import progress
from auv_analysis.output import progress as counting
from auv_analysis.output.progress import TextConsole


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> StringIO:
    shown = StringIO()
    console = TextConsole(file=shown, force_terminal=True, width=100)
    monkeypatch.setattr(progress, 'console', console)
    return shown


def _totals(steps: int) -> list[float | None]:
    """Total of the line that is around, before, during and after `steps` entries."""
    with progress.waiting('works'):
        around = counting.counting.get()
        assert around is not None
        shown, task = around
        found = [shown.tasks[task].total]
        for _ in counting.each(range(steps), steps):
            found.append(shown.tasks[task].total)
            assert list(counting.each('ab', 99)) == ['a', 'b']  # is no part of what is counted
        found.append(shown.tasks[task].total)
    assert counting.counting.get() is None
    return found


def test_entries_are_counted_by_what_is_around(terminal):
    assert _totals(2) == [None, 2, 2, None]
    assert 'works' in terminal.getvalue()


def test_without_something_around_entries_just_pass(terminal):
    assert list(counting.each(iter('abc'), 3)) == ['a', 'b', 'c']
    assert terminal.getvalue() == ''


def test_what_fails_leaves_nothing_behind(terminal):
    def fails(_: int) -> None:
        raise ValueError('stop')

    with pytest.raises(ValueError, match='stop'), progress.waiting('works'):
        list(map(fails, counting.each(range(3), 3)))
    assert counting.counting.get() is None


def test_bar_says_what_is_done_how_far_and_how_fast(terminal):
    with progress.bar(progress.count('steps'), progress.Speed('steps'), keep=True) as shown:
        shown.update(shown.add_task('runs', total=4), completed=4)
    text = terminal.getvalue()
    assert '4/4 steps' in text
    assert 'runs' in text
    task = SimpleNamespace(finished_speed=None, speed=12.4)
    assert progress.Speed('steps').render(task).strip() == '12 steps/s'
    task.finished_speed = 7.6
    assert progress.Speed('steps').render(task).strip() == '8 steps/s'


def test_no_terminal_shows_nothing_but_the_line_that_is_kept(monkeypatch):
    written = StringIO()
    monkeypatch.setattr(progress, 'console', TextConsole(file=written, width=100))
    with progress.waiting('works'), progress.bar(progress.count()) as shown:
        shown.add_task('runs', total=4)
    assert written.getvalue() == ''
    with progress.bar(progress.count('steps'), keep=True) as shown:
        shown.update(shown.add_task('runs', total=4), completed=4)
    lines = written.getvalue().splitlines()
    assert len(lines) == 1
    assert '4/4 steps' in lines[0]
