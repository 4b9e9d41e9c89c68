"""Processes of a run: started together, watched, ended together. psutil does the waiting."""

import contextlib
import os
import shutil
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, TYPE_CHECKING

import psutil

from auv_analysis.output.progress import say
from auv_dynamics.files.errors import FailedError, undisturbed
from auv_dynamics.ros.interface import PARENT

if TYPE_CHECKING:
    from auv_analysis.graph.fork_server import Forked

GRACE, WRITING = 5.0, 30.0  # s between SIGTERM and SIGKILL, and for who writes or was killed
Begin = Callable[..., 'psutil.Popen | Forked']


class NodeDiedError(FailedError):
    """A node ended before its time; the text names it and shows its last lines."""


class TroubleError(FailedError):
    """A run came to its end, but one of its nodes had something to complain about on the way."""


def executable(package: str, name: str) -> Path:
    """Executable of a node: of the colcon install tree or of the environment.

    Raises
    ------
    NodeDiedError : it is not installed

    """
    for root in Path(__file__).resolve().parents:
        for candidate in (root / 'lib' / package / name, root / package / 'lib' / package / name):
            if candidate.is_file():
                return candidate
    beside = Path(sys.executable).with_name(name)
    found = str(beside) if beside.is_file() else shutil.which(name)
    if found is None:
        raise NodeDiedError(f'{name}: not installed beside {sys.executable}; run make setup')
    return Path(found)


def give_way(process: int = 0) -> None:
    """Let a process, by default this one, interrupt no other: it is scheduled as a batch job."""
    with contextlib.suppress(OSError, AttributeError):  # not every system has it
        os.sched_setscheduler(process, os.SCHED_BATCH, os.sched_param(0))


class Supervisor:
    """A group of processes that lives and dies together.

    Parameters
    ----------
    logs : folder of the nodes' output, one file each
    environment : of all of them
    begin : what starts a process, as `psutil.Popen` does

    """

    def __init__(self, logs: Path, environment: Mapping[str, str], begin: Begin = psutil.Popen):
        self._logs, self._begin = logs, begin
        self._environment = {**environment, PARENT: str(os.getpid())}
        self._processes: dict[str, psutil.Popen | Forked] = {}
        self._outputs: dict[str, IO[bytes]] = {}  # open: the folder may be removed under us

    def start(self, name: str, command: list[str], *, observes: bool = False) -> None:
        """Start one process; its output goes to <logs>/<name>.log.

        One that only observes must not interrupt those whose answers are waited for.
        """
        self._logs.mkdir(parents=True, exist_ok=True)
        log = (self._logs / f'{name}.log').open('w+b')
        self._outputs[name] = log
        # a session of its own: Ctrl-C reaches `auv`, which ends the nodes that it knows in order
        with undisturbed():
            self._processes[name] = self._begin(
                command,
                env=self._environment,
                stdin=-3,  # subprocess.DEVNULL
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        if observes:
            give_way(self._processes[name].pid)

    def ended(self) -> dict[str, int]:
        """Name -> exit code of the processes that have ended."""
        codes = {name: process.poll() for name, process in self._processes.items()}
        return {name: code for name, code in codes.items() if code is not None}

    def check(self, may_end: str) -> bool:
        """Whether the process `may_end` has ended well; NodeDiedError when another has ended."""
        ended = self.ended()
        for name, code in ended.items():
            if name != may_end or code != 0:
                text = f'{name} ended with exit code {code}{self.last_lines(name)}'
                raise NodeDiedError(text + self._complaints(besides=name))
        return may_end in ended

    def last_lines(self, name: str, count: int = 8) -> str:
        """End of a process' output, indented, for a message; on a full disk it has none."""
        lines = self._lines(name)[-count:]
        free = os.statvfs(self._logs).f_bavail if self._logs.is_dir() else None
        if free == 0:
            lines.append(f'{self._logs}: no space left on the file system')
        return ''.join(f'\n    {line}' for line in lines)

    def _lines(self, name: str) -> list[str]:
        log = self._outputs[name]
        size = os.fstat(log.fileno()).st_size
        return os.pread(log.fileno(), size, 0).decode(errors='replace').splitlines()

    def complaints(self, process: str, node: str) -> list[str]:
        """Errors that a node in a process has logged, each without time and name."""
        mark = f'[{node}]: '
        lines = [line for line in self._lines(process) if '[ERROR]' in line and mark in line]
        return [line.split(mark, 1)[1] for line in lines]

    def _complaints(self, besides: str) -> str:
        """Last error of each other process: often the cause."""
        text = ''
        for name in sorted(self._outputs):
            errors = [line for line in self._lines(name) if '[ERROR]' in line]
            if errors and name != besides:
                text += f'\n    {name}: {errors[-1]}'
        return text

    def stop(self, writes: str = '') -> dict[str, int]:
        """End all that still run: SIGTERM, then SIGKILL; exit codes of all.

        A second Ctrl-C waits until they have ended: nobody would end them else. The process
        `writes` has more time than the others: it may have to bring what it knows to a slow disk.
        """
        with undisturbed():
            running = {name: p for name, p in self._processes.items() if p.poll() is None}
            for process in running.values():
                process.terminate()
            for names, grace in ((running.keys() - {writes}, GRACE), ({writes}, WRITING)):
                group = [running[name] for name in names & running.keys()]
                if names == {writes} and any(process.poll() is None for process in group):
                    say(f'{writes} still writes, for {WRITING:g} s at most')
                _, alive = psutil.wait_procs(group, timeout=grace)
                for process in alive:
                    process.kill()
                psutil.wait_procs(alive, timeout=WRITING)
        for log in self._outputs.values():
            log.close()
        return self.ended()
