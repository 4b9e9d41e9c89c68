"""Processes of a run: ended together, whatever comes in between."""

import os
import signal
from contextlib import suppress
from pathlib import Path

import psutil
import pytest
from helpers.patience import patience

from auv_analysis.graph import supervisor


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
