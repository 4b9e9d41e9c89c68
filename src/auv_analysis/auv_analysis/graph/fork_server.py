"""Nodes as processes that are forked from one, which has imported what they need.

To import it takes five interpreters longer than a run of seconds. Each node is a process of its own
all the same, listed under its command line, watched and ended like one that was executed.
"""

import contextlib
import ctypes
import gc
import json
import os
import signal
import socket
import sys
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import IO, Any, NoReturn, Self

import psutil
from setproctitle import getproctitle, getthreadtitle, setproctitle, setthreadtitle

from auv_analysis.output.parallel import fork

_NAME = getthreadtitle()
getproctitle()  # finds its room in the environment, before that changes; changes the name
setthreadtitle(_NAME)
LENGTH = len(Path('/proc/self/cmdline').read_bytes())  # a title as long is read up to its end
SUBREAPER = 36  # of `prctl`: whose parent ends becomes a child of this process
SIZE = 1 << 20  # bytes of a request, at most
INTERPRETER = Path(sys.executable).name.encode()


class Forked(psutil.Process):  # type: ignore[misc]
    """A process that was forked: what `psutil.Popen` tells of one."""

    returncode: int | None = None

    def poll(self) -> int | None:
        """Exit code, negative for a signal; None while it runs."""
        with contextlib.suppress(psutil.TimeoutExpired):
            self.returncode = self.wait(0.0)
        return self.returncode


class ForkServer:
    """The process that forks; to be made before anything starts threads.

    Parameters
    ----------
    modules : name of an executable -> module whose `main` it calls, which ends the process

    """

    def __init__(self, modules: Mapping[str, str]):
        self._end, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        ctypes.CDLL(None).prctl(SUBREAPER, 1, 0, 0, 0)
        mains = {name: import_module(module).main for name, module in modules.items()}
        self._pid = fork()
        if not self._pid:
            try:
                _serve(theirs, mains)
            except BaseException:
                traceback.print_exc()
            finally:
                os._exit(1)
        theirs.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """End it; what it has forked goes on."""
        self._end.close()
        os.kill(self._pid, signal.SIGKILL)
        os.waitpid(self._pid, 0)

    def begin(
        self, command: Sequence[str], *, env: Mapping[str, str], stdout: IO[bytes], **more: Any
    ) -> Forked | psutil.Popen:
        """Start a program in a session of its own; it is executed where it cannot be forked.

        Parameters
        ----------
        command : executable and its arguments
        env : whole environment
        stdout : takes its output and its errors
        more : what `psutil.Popen` is told else

        """
        request = json.dumps([list(command), dict(env)]).encode()
        try:
            socket.send_fds(self._end, [request], [stdout.fileno()])
            return Forked(int(self._end.recv(16)))
        except (OSError, ValueError):  # it has ended, or the environment is too long
            return psutil.Popen(command, env=env, stdout=stdout, **more)


def _serve(asked: socket.socket, mains: Mapping[str, Callable[[], Any]]) -> NoReturn:
    """Fork what is asked for, until nobody can ask any more."""
    setproctitle('auv fork server')
    os.setsid()  # Ctrl-C is for who asks, who ends the nodes in order
    for end in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(end, signal.SIG_DFL)
    os.closerange(3, asked.fileno())
    os.closerange(asked.fileno() + 1, os.sysconf('SC_OPEN_MAX'))
    gc.freeze()  # no page of these is copied because a program looks for its garbage
    while True:
        data, files, *_ = socket.recv_fds(asked, SIZE, 1)
        if not data:
            os._exit(0)
        command, environ = json.loads(data)
        told, tells = os.pipe()
        if between := os.fork():
            os.waitpid(between, 0)
            asked.send(os.read(told, 16))
            for number in (told, tells, *files):
                os.close(number)
            continue
        # ends at once, which gives its child to the one who asks
        between = os.getpid()
        if pid := os.fork():
            os.write(tells, str(pid).encode())
            os._exit(0)
        while os.getppid() == between:
            time.sleep(0.001)
        _become(command, environ, files[0])
        mains[Path(command[0]).name]()


def _become(command: list[str], environ: Mapping[str, str], output: int) -> None:
    """Be the process of a program that is about to start."""
    os.setsid()
    for number, file in enumerate((os.open(os.devnull, os.O_RDONLY), output, output)):
        os.dup2(file, number)
    os.closerange(3, os.sysconf('SC_OPEN_MAX'))
    os.environ.clear()
    os.environ.update(environ)
    sys.stdout, sys.stderr = (
        os.fdopen(number, 'w', 1, errors='backslashreplace') for number in (1, 2)
    )
    sys.argv = command
    entitle([sys.executable, *command])


def entitle(command: Sequence[str]) -> None:
    """Be found by a command line in the list of processes, under the interpreter's name for ROS."""
    setproctitle(' '.join(command).ljust(LENGTH))
    setthreadtitle(Path(command[1]).name)
    libc = ctypes.CDLL(None)
    for name in ('program_invocation_name', 'program_invocation_short_name'):
        ctypes.c_char_p.in_dll(libc, name).value = INTERPRETER
