"""Nodes as processes of their own, forked from one that has imported them all.

To import what a node needs takes longer than most tests of nodes. What the executables themselves
do before that is seen by the tests of `auv run`, which start them.
"""

import contextlib
import json
import os
import selectors
import signal
import socket
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import IO, Any

from auv_analysis import load_scenario
from auv_analysis.experiment import COMPOSED, PACKAGES
from auv_analysis.warm_up import warm_up

NODES = {  # and the package of each
    **PACKAGES,
    'frame_converter_node': 'auv_dynamics',
    'replay_node': 'auv_analysis',
    COMPOSED: 'auv_analysis',
}
SIZE = 1 << 20  # bytes of a request, at most


class Node:
    """A node that was forked: what `subprocess.Popen` tells and does of a process."""

    def __init__(self, args: Sequence[str], pid: int, output: int, ended: int):
        self.args, self.pid = args, pid
        self.returncode: int | None = None
        self.stdout: IO[str] = os.fdopen(output, errors='replace')
        self._ended = ended
        self._said: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)

    def _read(self) -> None:
        self._said.append(self.stdout.read())

    def poll(self) -> int | None:
        """Exit code, negative for a signal; None while it runs."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.wait(0.0)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Exit code, once it has ended; TimeoutExpired after so many s."""
        if self.returncode is None:
            with selectors.DefaultSelector() as selector:
                selector.register(self._ended, selectors.EVENT_READ)
                if not selector.select(timeout):
                    raise subprocess.TimeoutExpired(list(self.args), timeout or 0.0)
            self.returncode = int(os.read(self._ended, 16))
            os.close(self._ended)
        return self.returncode

    def communicate(self, timeout: float | None = None) -> tuple[str, str]:
        """What it has said and not been read yet, once it has ended; nothing goes to stderr."""
        if not self._reader.ident:
            self._reader.start()
        self._reader.join(timeout)
        if self._reader.is_alive():
            raise subprocess.TimeoutExpired(list(self.args), timeout or 0.0)
        self.wait(timeout)
        self.stdout.close()
        return self._said[0], ''

    def send_signal(self, number: int) -> None:
        """Send a signal, where it still runs."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def terminate(self) -> None:
        """Ask it to end."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """End it."""
        self.send_signal(signal.SIGKILL)


class Nursery:
    """The process that forks them."""

    def __init__(self) -> None:
        self._line, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            command = [sys.executable, __file__, str(theirs.fileno())]
            self._process = subprocess.Popen(command, pass_fds=[theirs.fileno()])

    def start(self, name: str, arguments: Sequence[str], environ: Mapping[str, str]) -> Node:
        """Start a node; its output is captured."""
        output, said = os.pipe()
        ended, code = os.pipe()
        request = [name, *arguments], dict(environ), os.getcwd()
        try:
            socket.send_fds(self._line, [json.dumps(request).encode()], [said, code])
        finally:
            os.close(said)
            os.close(code)
        return Node(request[0], int(self._line.recv(16)), output, ended)


def grow(main: Callable[[], Any], arguments: list[str]) -> int:
    """What the interpreter does with a script; its exit code."""
    sys.argv = arguments
    try:
        main()
    except SystemExit as error:
        return int(error.code or 0)
    except BaseException:
        traceback.print_exc()
        return 1
    return 0


def fork(main: Callable[[], Any], request: Any, said: int, inherited: Sequence[int]) -> int:
    """Process id of a new node."""
    if pid := os.fork():
        return pid
    code = 1
    try:
        arguments, environ, folder = request
        for number in inherited:
            os.close(number)
        os.environ.clear()
        os.environ.update(environ)
        os.chdir(folder)
        os.dup2(said, 1)
        os.dup2(said, 2)
        code = grow(main, arguments)
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code)


def serve(line: socket.socket, mains: Mapping[str, Callable[[], Any]]) -> None:
    """Fork what is asked for and tell how it ended, until nobody asks any more."""
    selector, ends = selectors.DefaultSelector(), dict[int, tuple[int, int]]()
    selector.register(line, selectors.EVENT_READ)
    while True:
        for key, _ in selector.select():
            if key.fd in ends:
                pid, code = ends.pop(key.fd)
                selector.unregister(key.fd)
                os.close(key.fd)
                how = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
                with contextlib.suppress(BrokenPipeError):
                    os.write(code, str(how).encode())
                os.close(code)
                continue
            data, handed, *_ = socket.recv_fds(line, SIZE, 2)
            if not data:
                return
            request, (said, code) = json.loads(data), handed
            inherited = [line.fileno(), code, *ends, *(one[1] for one in ends.values())]
            pid = fork(mains[request[0][0]], request, said, inherited)
            os.close(said)
            watched = os.pidfd_open(pid)
            ends[watched] = pid, code
            selector.register(watched, selectors.EVENT_READ)
            line.send(str(pid).encode())


def main() -> None:
    """Import the nodes and load what they call most, then serve."""
    mains = {name: import_module(f'{package}.{name}').main for name, package in NODES.items()}
    warm_up(load_scenario('case1'), ['gvc'])
    sys.stdout, sys.stderr = (os.fdopen(number, 'w', 1, closefd=False) for number in (1, 2))
    with socket.socket(fileno=int(sys.argv[1])) as line:
        serve(line, mains)


if __name__ == '__main__':
    main()
