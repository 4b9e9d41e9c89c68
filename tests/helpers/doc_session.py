"""A page as a session: its blocks run one after the other in one folder."""

import io
import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any

import matplotlib as mpl
from helpers.doc_blocks import ROOT, Block, Page
from helpers.node_processes import environment, fork_server, fresh_domain
from helpers.patience import patience

# s, after which a block has failed: a busy machine is slow, a page is no benchmark
PATIENCE = patience(1800.0)
MADE = {'runs', 'build', 'install', 'log', '.git', '.venv', 'docs', '.pytest_cache'}
PLAIN = re.compile(r'auv( [\w.,/:=+-]+)+')  # a command that is the same to any shell
ENDED = (0, -signal.SIGTERM)  # of what runs in a terminal until the page ends


class Session:
    """A folder in which the repository lies, a terminal and a Python prompt."""

    def __init__(self, page: Page, folder: Path):
        self.page, self.folder = page, folder
        self.names: dict[str, Any] = {'__name__': '__main__'}
        self.output = ''
        binaries = Path(sys.executable).parent
        self.environment = environment(fresh_domain())
        self.environment['PATH'] = f'{binaries}{os.pathsep}{self.environment["PATH"]}'
        self.environment['MPLBACKEND'] = 'agg'
        self._started: list[subprocess.Popen] = []
        self._terminals: list[subprocess.Popen] = []
        for path in ROOT.iterdir():
            if path.name not in MADE:
                (folder / path.name).symlink_to(path)
        (folder / '.venv').symlink_to(sys.prefix)
        if subprocess.run(['make', '-q', 'setup'], cwd=folder, check=False).returncode:
            raise RuntimeError('run `make setup` first: a page would do it, for its own folder')

    def run(self, block: Block) -> None:
        """Do what a block says."""
        where = f'{self.page.name}:{block.line}'
        if 'file' in block.marks:
            (self.folder / block.marks['file']).write_text(block.text, encoding='utf-8')
        elif 'output' in block.marks:
            self._compare(block, where)
        elif 'terminals' in block.marks:
            self._terminals += [self._start(command, where)[0] for command in block.commands]
        elif 'interrupted after' in block.marks:
            for command in block.commands:
                self._interrupt(command, float(block.marks['interrupted after']), where)
        elif block.language == 'python':
            self._python(block, where)
        else:
            plain = not self.page.is_long and all(map(PLAIN.fullmatch, block.commands))
            code = self._fork(block.commands) if plain else self._wait(block.text, where)
            assert code == int(block.marks.get('exit', 0)), f'{where}: {code}\n{self.output}'

    def _wait(self, text: str, where: str) -> int:
        process, log = self._start(text, where)
        code = process.wait(PATIENCE)
        self.output = log.read_text(errors='replace')
        return code

    def _fork(self, commands: list[str]) -> int:
        """Exit code of `auv` from the process that has imported most of it for all tests."""
        code, self.output = 0, ''
        for command in commands:
            process = fork_server().start(shlex.split(command), self.environment, str(self.folder))
            self.output += ''.join(process.communicate(PATIENCE))
            if code := process.wait():
                break
        return code

    def _start(self, command: str, where: str) -> tuple[subprocess.Popen, Path]:
        log = self.folder / f'.log{len(self._started)}'
        with log.open('w') as stream:
            process = subprocess.Popen(
                ['bash', '-euo', 'pipefail', '-c', command],
                cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL,
                stdout=stream, stderr=subprocess.STDOUT, start_new_session=True,
            )  # fmt: skip
        self._started.append(process)
        return process, log

    def _interrupt(self, command: str, seconds: float, where: str) -> None:
        process, log = self._start(f'exec {command}', where)
        try:
            code = process.wait(seconds)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGINT)
            code = process.wait(PATIENCE)
        assert code == 0, f'{where}: {command}: {code}\n{log.read_text()}'

    def _python(self, block: Block, where: str) -> None:
        said = io.StringIO()
        with redirect_stdout(said):
            exec(compile('\n' * block.line + block.text, where, 'exec'), self.names)
        self.output = said.getvalue()

    def _compare(self, block: Block, where: str) -> None:
        said = {' '.join(line.split()) for line in self.output.splitlines()}
        for line in block.text.splitlines():
            wanted = ' '.join(line.split())
            assert wanted in ('', '...') or any(wanted in other for other in said), (
                f'{where}: not printed: {line}\n{self.output}'
            )

    def close(self) -> None:
        """End what still runs; what ran in terminals has ended well."""
        for process in self._started:
            try:
                os.killpg(process.pid, signal.SIGTERM)
            except ProcessLookupError:
                continue
        codes = [process.wait(patience(60)) for process in self._terminals]
        assert all(code in ENDED for code in codes), codes


@contextmanager
def session(page: Page, folder: Path) -> Iterator[Session]:
    """A session whose folder is the working directory, and on Python's path."""
    before, path, modules = Path.cwd(), list(sys.path), set(sys.modules)
    mpl.use('agg')
    opened = Session(page, folder)
    os.chdir(folder)
    sys.path.insert(0, str(folder))
    try:
        yield opened
    finally:
        os.chdir(before)
        sys.path[:] = path
        for name in set(sys.modules) - modules:
            if str(getattr(sys.modules[name], '__file__', '')).startswith(str(folder)):
                del sys.modules[name]
        opened.close()
