"""Our programs as processes of their own, forked from one that has imported them.

To import what a node needs takes longer than most tests of nodes. What the executables themselves
do before that is seen by the tests that start the installed ones.
"""

import contextlib
import gc
import inspect
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
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from runpy import run_path
from typing import IO, Any

from rcl_interfaces.msg import ParameterEvent
from rclpy.type_support import check_for_type_support
from setproctitle import setproctitle

from auv_analysis import load_scenario
from auv_analysis.graph import recorded_runs
from auv_analysis.graph.experiment import MODULES as OF_A_RUN
from auv_analysis.graph.fork_server import entitle
from auv_analysis.simulation.simulate import warm_up
from auv_dynamics.ros import node_interface
from auv_dynamics.ros.topics import TOPICS

NODES = {  # and the module of each
    **OF_A_RUN,
    'frame_converter_node': 'auv_dynamics.nodes.frame_converter_node',
    'replay_node': 'auv_analysis.nodes.replay_node',
}
STARTERS = {'auv': 'auv_analysis.cli.main', 'record': 'helpers.graph_runs'}  # of nodes
MODULES = {**NODES, **STARTERS}
PLAIN = 'setpoint_node', 'recorder_node', 'replay_node', 'frame_converter_node'  # without kernels
LOADED = (  # what `auv` imports once it knows what it has to do
    *('auv_analysis.cli.scenario_runs', 'auv_analysis.graph.recorded_runs'),
    *('auv_analysis.studies.compare.sources', 'auv_analysis.output.keyboard'),
)
PERIOD = 0.2  # s, of diagnostics: who waits for what a node says waits for a fifth
REPORT = ('auv_analysis.report.document', 'auv_analysis.report.plots')
CHECKS = ('auv_analysis.driver.checks', 'auv_analysis.nodes.driver_check_node')
OWNER = 'AUV_GVC_TESTS'  # in the environment: process id of the whole run, by tests/conftest.py
NAME = '\0auv_gvc forks for '  # of its socket, before the process id of the owner
SIZE = 1 << 20  # bytes of a request, at most
ROOM = 4096  # bytes of a command line in the list of processes, which lie in the environment


class Process:
    """A program that was forked: what `subprocess.Popen` tells and does of a process."""

    def __init__(self, args: Sequence[str], pid: int, outputs: Sequence[int], ended: int):
        self.args, self.pid = args, pid
        self.returncode: int | None = None
        self.streams: list[IO[str]] = [os.fdopen(output, errors='replace') for output in outputs]
        self._ended = ended
        self._said = [''] * len(outputs)
        self._readers: list[threading.Thread] = []

    @property
    def stdout(self) -> IO[str]:
        """Its output, with its errors where these have no pipe of their own."""
        return self.streams[0]

    @property
    def stderr(self) -> IO[str]:
        """Its errors."""
        return self.streams[1]

    def _read(self, i: int) -> None:
        self._said[i] = self.streams[i].read()

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
        """Output and errors that have not been read yet, once it has ended."""
        if not self._readers:
            count = range(len(self.streams))
            self._readers = [threading.Thread(target=self._read, args=[i]) for i in count]
            for reader in self._readers:
                reader.daemon = True
                reader.start()
        for reader in self._readers:
            reader.join(timeout)
            if reader.is_alive():
                raise subprocess.TimeoutExpired(list(self.args), timeout or 0.0)
        self.wait(timeout)
        for stream in self.streams:
            stream.close()
        output, errors = [*self._said, ''][:2]
        return output, errors

    def send_signal(self, number: int) -> None:
        """Send a signal, where it still runs."""
        if self.poll() is None:
            with contextlib.suppress(ProcessLookupError):  # the server waited for it just now
                os.kill(self.pid, number)

    def terminate(self) -> None:
        """Ask it to end."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """End it."""
        self.send_signal(signal.SIGKILL)


class ForkServer:
    """The process that forks for all workers of a test run, started where it is not there yet."""

    def __init__(self) -> None:
        mine, told = str(os.getpid()), os.environ.get(OWNER)
        self._end = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        if told and not self._end.connect_ex(f'{NAME}{told}'):
            return
        # one that a test's process starts holds its output open no longer than it lives
        owner = told if told in (mine, str(os.getppid())) else mine
        while self._end.connect_ex(f'{NAME}{owner}'):
            with (
                socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as entrance,
                contextlib.suppress(OSError),  # another worker has just taken the name
            ):
                entrance.bind(f'{NAME}{owner}')
                entrance.listen()
                self._start(entrance.fileno(), owner)

    def _start(self, entrance: int, owner: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, '-m', __name__, str(entrance), owner],
            env={**os.environ, 'AUV_GVC_ROOM': ' ' * ROOM},
            cwd=Path(__file__).parents[1],
            stdin=subprocess.DEVNULL,
            pass_fds=[entrance],
            start_new_session=True,  # what ends all tests at once must not end it: it cleans up
        )

    def start(
        self,
        arguments: Sequence[str],
        environ: Mapping[str, str],
        folder: str = '',
    ) -> Process:
        """Start a program, with a pipe of its output and errors, or one of each of a starter's.

        Parameters
        ----------
        arguments : command line; the first is the program, by its name or as an executable
        environ : of the process
        folder : that it works in, by default that of this process

        """
        name = Path(arguments[0]).name
        pipes = [os.pipe() for _ in range(1 + (name in STARTERS))]
        ended, code = os.pipe()
        ends = [end for _, end in pipes]
        request = [list(arguments), dict(environ), folder or os.getcwd()]
        handed = [ends[0], ends[-1], code]
        try:
            socket.send_fds(self._end, [json.dumps(request).encode()], handed)
        finally:
            for number in (*ends, code):
                os.close(number)
        return Process(arguments, int(self._end.recv(16)), [pipe for pipe, _ in pipes], ended)


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


def fork(
    main: Callable[[], Any], request: Any, said: Sequence[int], inherited: Sequence[int]
) -> int:
    """Process id of a new program."""
    arguments, environ, folder = request
    if pid := os.fork():
        return pid
    code = 1
    try:
        for number in inherited:
            os.close(number)
        os.environ.clear()
        os.environ.update(environ)
        os.chdir(folder)
        os.dup2(said[0], 1)
        os.dup2(said[1], 2)
        sys.stdout = os.fdopen(1, 'w', 1, closefd=False)
        sys.stderr = os.fdopen(2, 'w', 1, errors='backslashreplace', closefd=False)
        entitle([sys.executable, *arguments])
        if Path(arguments[0]).name not in STARTERS:
            os.setsid()
        code = grow(main, arguments)
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code)


@cache
def load_kernels() -> None:
    """Load what plants and controllers call most."""
    warm_up(load_scenario('case1'), ['gvc'])


def program(arguments: Sequence[str]) -> Callable[[], Any]:
    """What runs a program, which is imported before the first fork that needs it."""
    name = Path(arguments[0]).name
    if name not in PLAIN:
        load_kernels()
    known = len(sys.modules)
    if name not in MODULES:  # a script
        sys.path.append(str(Path(arguments[0]).parent))
        import_module(Path(name).stem)
        main = partial(run_path, arguments[0], run_name='__main__')
    else:
        if name == 'auv':
            reports = {'run', 'simulate', 'analyze'} & {*arguments[1:2]}
            more = REPORT if reports and '--no-report' not in arguments else ()
            for module in (*LOADED, *more, *(CHECKS if 'check-driver' in arguments else ())):
                import_module(module)
        main = import_module(MODULES[name]).main
    if len(sys.modules) > known:
        inspect.getmodule(inspect.currentframe())  # looks at all of them, as a first line of a log
        gc.freeze()  # no page of these is copied because a program looks for its garbage
    return main


def serve(entrance: socket.socket, owner: int) -> None:
    """Fork what is asked for and tell how it ended, for as long as the process `owner` runs.

    What has outlived it then is ended: nobody else knows of it.
    """
    selector, ends = selectors.DefaultSelector(), dict[int, tuple[int, int]]()
    lines = dict[int, socket.socket]()
    for waited in (entrance, owner):
        selector.register(waited, selectors.EVENT_READ)
    while True:
        for key, _ in selector.select():
            if key.fd == owner:
                for pid, _ in ends.values():
                    os.kill(pid, signal.SIGKILL)
                return
            if key.fd in ends:
                pid, code = ends.pop(key.fd)
                selector.unregister(key.fd)
                os.close(key.fd)
                how = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
                with contextlib.suppress(BrokenPipeError):
                    os.write(code, str(how).encode())
                os.close(code)
                continue
            if key.fd == entrance.fileno():
                more, _ = entrance.accept()
                lines[more.fileno()] = more
                selector.register(more, selectors.EVENT_READ)
                continue
            asking = lines[key.fd]
            data, handed, *_ = socket.recv_fds(asking, SIZE, 3)
            if not data:
                selector.unregister(asking)
                del lines[key.fd]
                asking.close()
                continue
            request, (*said, code) = json.loads(data), handed
            inherited = [entrance.fileno(), owner, *lines, code]
            inherited += [*ends, *(one[1] for one in ends.values())]
            pid = fork(program(request[0]), request, said, inherited)
            for number in said:
                os.close(number)
            watched = os.pidfd_open(pid)
            ends[watched] = pid, code
            selector.register(watched, selectors.EVENT_READ)
            asking.send(str(pid).encode())


def main() -> None:
    """Load what all programs call, then serve."""
    setproctitle('fork server')  # before the environment is changed, in which it finds its room
    node_interface.DIAGNOSTICS_PERIOD = PERIOD
    recorded_runs.ANNOUNCED = 0.0  # s: the domain of a test is its own, no stranger is looked for
    for kind in (ParameterEvent, *(topic.type for topic in TOPICS)):
        check_for_type_support(kind)
    entrance, owner = map(int, sys.argv[1:])
    with socket.socket(fileno=entrance) as listening, contextlib.suppress(ProcessLookupError):
        serve(listening, os.pidfd_open(owner))


if __name__ == '__main__':
    main()
