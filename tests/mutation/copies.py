"""Copies of the checkout in which mutants are tried: the checkout itself is never touched."""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from cosmic_ray.mutating import mutate_and_test
from cosmic_ray.work_item import MutationSpec, TestOutcome, WorkerOutcome

COPIED = (
    'src', 'tests', 'config', 'docs', 'examples', 'benchmarks', 'pyproject.toml', 'README.md',
)  # fmt: skip
SKIPPED = shutil.ignore_patterns('__pycache__', 'node_modules', '*.egg-info')
PATIENCE = 240.0  # s, after which a mutant that does not end counts as killed
PYTEST = '-m pytest -x -q --assert=plain -p no:cacheprovider'
PLAIN = {  # one thread, and no plugin of pytest that these tests do not need
    'OMP_NUM_THREADS': '1',
    'OPENBLAS_NUM_THREADS': '1',
    'PYTEST_DISABLE_PLUGIN_AUTOLOAD': '1',
}
PACKAGES = ('auv_dynamics', 'auv_gvc_controller', 'auv_analysis')


class Verdict(NamedTuple):
    """What became of a mutant: 'killed', 'timeout' or 'survived'; its line before and after."""

    file: str
    line: int
    operator: str
    before: str
    after: str
    outcome: str


class Copy:
    """A copy of sources, tests and what they read.

    Parameters
    ----------
    root : the checkout
    folder : where the copy goes
    python : interpreter of the tests

    """

    def __init__(self, root: Path, folder: Path, python: Path):
        self._root, self._folder, self._python = root, folder, python
        for name in COPIED:
            if (root / name).is_dir():
                shutil.copytree(root / name, folder / name, symlinks=True, ignore=SKIPPED)
            else:
                shutil.copy2(root / name, folder / name)
        # checked by content: two mutants may be written within one tick of the file's time
        how = ['-m', 'compileall', '-q', '--invalidation-mode', 'checked-hash', 'src', 'tests']
        subprocess.run([python, *how], cwd=folder, check=True)

    def _command(self, stages: list[list[str]], compiled: bool) -> str:
        """Shell command that runs lists of tests in turn, until one fails."""
        path = ':'.join(f'{self._folder}/src/{package}' for package in PACKAGES)
        plain = '' if compiled else 'NUMBA_DISABLE_JIT=1'
        tests = (' '.join(f'tests/{one}' for one in stage) for stage in stages if stage)
        runs = ' && '.join(f'{plain} {self._python} {PYTEST} {names}' for names in tests) or 'true'
        return f'sh -c "cd {self._folder} && export PYTHONPATH={path} && {runs}"'

    def complaint(self, tests: list[tuple[bool, str]]) -> str:
        """Output of tests, compiled or not, that fail before anything is changed; '' of none."""
        found = ''
        for compiled in (False, True):
            names = [name for kind, name in tests if kind == compiled]
            command = self._command([names], compiled)
            ended = subprocess.run(command, shell=True, capture_output=True, text=True, check=False)
            found += ended.stdout + ended.stderr if ended.returncode else ''
        return found

    def verdict(self, mutant: MutationSpec, stages: list[list[str]], compiled: bool) -> Verdict:
        """Try a mutant of the checkout here."""
        file = mutant.module_path.relative_to(self._root)
        here = MutationSpec(
            module_path=self._folder / file,
            operator_name=mutant.operator_name,
            operator_args=mutant.operator_args,
            occurrence=mutant.occurrence,
            start_pos=mutant.start_pos,
            end_pos=mutant.end_pos,
        )
        result = mutate_and_test([here], self._command(stages, compiled), PATIENCE)
        if result.worker_outcome != WorkerOutcome.NORMAL:
            raise RuntimeError(f'{file}: {mutant}\n{result.output}')
        outcome = 'killed' if result.test_outcome == TestOutcome.KILLED else 'survived'
        if result.output == 'timeout':
            outcome = 'timeout'
        changed = [line for line in result.diff.splitlines()[3:] if line[:1] in '-+']
        before, after = (
            ' '.join(line[1:].strip() for line in changed if line[0] == sign) for sign in '-+'
        )
        operator = mutant.operator_name.removeprefix('core/')
        name = str(file.relative_to('src'))
        return Verdict(name, mutant.start_pos[0], operator, before, after, outcome)


@contextmanager
def copies(root: Path, count: int, python: Path) -> Iterator[list[Copy]]:
    """Some copies of the checkout, gone afterwards."""
    os.environ.update(PLAIN)
    with tempfile.TemporaryDirectory(prefix='mutation-') as top:
        yield [Copy(root, Path(top) / str(i), python) for i in range(count)]
