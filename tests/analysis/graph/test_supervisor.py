"""Processes of a run: ended together, whatever comes in between."""

import os
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest
from helpers.patience import patience

from auv_analysis.graph import supervisor


def test_who_ends_is_named_with_its_last_words_and_what_the_others_complain_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    group = supervisor.Supervisor(tmp_path, os.environ)
    said = '; '.join(f'echo "[ERROR] [1.0] [other]: {word}" >&2' for word in ('first', 'second'))
    group.start('other', ['sh', '-c', f'{said}; echo well; exec sleep 600'])
    group.start('quiet', ['sleep', '600'])
    log, lines = tmp_path / 'other.log', '; '.join(f'echo line {k}' for k in range(10))
    waits = f'until grep -q well {log}; do sleep 0.05; done'
    group.start('node', ['sh', '-c', f'{waits}; {lines}; exit 3'])
    try:
        group._processes['node'].wait(patience(30.0))
        with pytest.raises(supervisor.NodeDiedError) as caught:
            group.check(may_end='node')
        assert group.complaints('other', 'other') == ['first', 'second']
        assert group.complaints('other', 'another') == []
        monkeypatch.setattr(os, 'statvfs', lambda _: SimpleNamespace(f_bavail=0))
        assert group.last_lines('node').endswith(f'{tmp_path}: no space left on the file system')
    finally:
        codes = group.stop()
    assert codes == {'other': -signal.SIGTERM, 'quiet': -signal.SIGTERM, 'node': 3}
    kept = [f'    line {k}' for k in range(2, 10)]
    told = [*kept, '    other: [ERROR] [1.0] [other]: second']
    assert str(caught.value).splitlines() == ['node ended with exit code 3', *told]


def test_who_only_observes_gives_way(tmp_path: Path, monkeypatch) -> None:
    given = []
    monkeypatch.setattr(supervisor, 'give_way', given.append)
    group = supervisor.Supervisor(tmp_path, os.environ, lambda *_, **__: SimpleNamespace(pid=7))
    group.start('plant', ['true'])
    assert given == []
    group.start('recorder', ['true'], observes=True)
    assert given == [7]


def test_a_node_that_begins_while_ctrl_c_comes_is_ended_as_well(tmp_path: Path) -> None:
    """It wrote into its log once the files of the results were listed: --overwrite refused them."""

    def begin(*given: object, **more: object) -> psutil.Popen:
        process = psutil.Popen(*given, **more)
        signal.raise_signal(signal.SIGINT)
        return process

    group = supervisor.Supervisor(tmp_path, os.environ, begin)
    try:
        with pytest.raises(KeyboardInterrupt):
            group.start('node', ['sleep', '600'])
    finally:
        codes = group.stop()
    assert codes == {'node': -signal.SIGTERM}


@pytest.mark.parametrize(
    ('writes', 'takes', 'code'), [('recorder', 0.5, 7), ('', 600, -signal.SIGKILL)]
)
def test_who_writes_has_more_time_to_end(
    tmp_path: Path, monkeypatch, capsys, writes: str, takes: float, code: int
) -> None:
    monkeypatch.setattr(supervisor, 'GRACE', 0.01)
    group = supervisor.Supervisor(tmp_path, os.environ)
    begin = f'import signal, sys, time; from pathlib import Path; ready = Path({str(tmp_path)!r})'
    ends = f'signal.signal(signal.SIGTERM, lambda *_: (time.sleep({takes}), sys.exit(7)))'
    ready = '(ready / "ready").touch(); time.sleep(600)'
    group.start('recorder', [sys.executable, '-c', f'{begin}; {ends}; {ready}'])
    group.start('node', ['sleep', '600'])
    limit = time.monotonic() + patience(30.0)
    while not (tmp_path / 'ready').exists():
        assert time.monotonic() < limit
        time.sleep(0.01)
    assert group.stop(writes)['recorder'] == code
    said = 'recorder still writes, for 30 s at most\n' if writes else ''
    assert capsys.readouterr().err == said


class Stuck(psutil.Popen):
    """A process that obeys no SIGTERM; whoever has sent it presses Ctrl-C once more."""

    def terminate(self) -> None:
        signal.raise_signal(signal.SIGINT)


def test_a_second_ctrl_c_leaves_no_stuck_node(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(supervisor, 'GRACE', 0.01)
    begun: list[Stuck] = []

    def begin(command: list[str], **options: object) -> Stuck:
        begun.append(Stuck(command, **options))
        return begun[0]

    group = supervisor.Supervisor(tmp_path, os.environ, begin)
    group.start('stuck', ['sleep', '600'])
    try:
        with pytest.raises(KeyboardInterrupt):
            group.stop()
        assert begun[0].wait(patience(5.0)) == -signal.SIGKILL
    finally:
        with suppress(psutil.NoSuchProcess):
            begun[0].kill()
