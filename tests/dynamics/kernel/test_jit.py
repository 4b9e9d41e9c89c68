"""The kernel gives the same numbers compiled, with numba switched off, and without numba."""

import os
import stat
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from helpers.needs import needing
from helpers.patience import patience
from numpy.testing import assert_allclose

from auv_analysis import load_scenario, simulate
from auv_dynamics.kernel import compile

SERIES = ('t', 'eta', 'nu', 'nu_d', 'nu_d_dot', 'tau', 'disturbance', 'disturbance_estimate')
CASES = [(law, hold) for law in ('gvc', 'cl') for hold in ('continuous', 'zoh')]
SCRIPT = """
import sys
import numpy as np
from dataclasses import replace
from auv_dynamics.kernel import compile as jit
from auv_analysis import load_scenario, simulate
assert not jit.JITTED
scenario = load_scenario('case1')
scenario = replace(scenario, data=scenario.data | {'duration': 0.4})
arrays = {}
for law in ('gvc', 'cl'):
    for hold in ('continuous', 'zoh'):
        run = simulate(scenario, law, hold)
        for key in sys.argv[2:]:
            arrays[f'{law} {hold} {key}'] = getattr(run, key)
assert not hasattr(sys.modules.get('numba'), 'njit') or sys.modules['numba'].config.DISABLE_JIT
np.savez(sys.argv[1], **arrays)
"""
# found before every other sitecustomize: numba then looks as if it were not installed
STUB = """
import sys


class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.partition('.')[0] in ('numba', 'llvmlite'):
            raise ModuleNotFoundError(f'No module named {name!r}', name=name)


sys.meta_path.insert(0, Blocked())
"""


def run_script(tmp_path, **environment):
    out = tmp_path / 'run.npz'
    script = tmp_path / 'script.py'
    script.write_text(SCRIPT, encoding='utf-8')
    done = subprocess.run(
        [sys.executable, str(script), str(out), *SERIES],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=patience(300),
    )
    assert done.returncode == 0, done.stderr
    return dict(np.load(out))


def check_same(arrays):
    scenario = load_scenario('case1')
    scenario = replace(scenario, data=scenario.data | {'duration': 0.4})
    for law, hold in CASES:
        run = simulate(scenario, law, hold)
        for key in SERIES:
            ours, other = getattr(run, key), arrays[f'{law} {hold} {key}']
            assert ours.shape == other.shape
            scale = np.abs(ours).max()
            assert scale > 0
            assert_allclose(other, ours, rtol=0, atol=1e-12 * scale, err_msg=f'{law} {hold} {key}')


@needing('numba', compile.JITTED)
def test_the_compiled_kernel_agrees_with_the_source(tmp_path):
    check_same(run_script(tmp_path, NUMBA_DISABLE_JIT='1'))


def test_everything_runs_without_numba(tmp_path):
    (tmp_path / 'sitecustomize.py').write_text(STUB, encoding='utf-8')
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get('PYTHONPATH')])])
    check_same(run_script(tmp_path, PYTHONPATH=path))


@pytest.fixture
def made_up(tmp_path, monkeypatch):
    """A package with a module `inner` and one that no kernel imports; the cache beside it."""
    package = tmp_path / 'auv_made_up'
    package.mkdir()
    for name, line in (('__init__', 'A = 1'), ('inner', 'B = 1'), ('other', 'C = 1')):
        (package / f'{name}.py').write_text(f'{line}\n', encoding='utf-8')
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(compile, 'PACKAGES', ('auv_made_up',))
    monkeypatch.delenv('AUV_GVC_CACHE_DIR', raising=False)
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'cache'))
    return package


@pytest.mark.parametrize(
    'statement',
    [
        'from auv_made_up import inner',
        'from auv_made_up.inner import B',
        'import auv_made_up.inner',
        'from auv_made_up import (\n    A,\n    inner,\n)',
        'def later():\n    from auv_made_up import inner',
    ],
)
def test_compiled_code_is_that_of_all_that_a_kernel_imports(made_up, statement):
    kernel = f'{statement}\n\n\n@compiled\ndef f():\n    return 1\n'
    (made_up / 'kernel.py').write_text(kernel, encoding='utf-8')
    before = compile.cache_folder()
    (made_up / 'other.py').write_text('C = 2\n', encoding='utf-8')
    assert compile.cache_folder() == before, 'no kernel depends on it'
    (made_up / 'inner.py').write_text('B = 2\n', encoding='utf-8')
    assert compile.cache_folder() != before


@pytest.mark.parametrize(
    'line',
    [
        *(f'@{word}' for word in ('compiled', 'helper', 'of_numbers', 'uncached')),
        "@specialised('record')",
        '    def wrench(t, nu):',
        '    def fill_rate(system):',
        'from numba import types',
    ],
)
def test_a_source_that_compiles_something_is_one_of_them(made_up, line):
    before = compile.cache_folder()
    (made_up / 'kernel.py').write_text(f'\n{line}\n', encoding='utf-8')
    assert compile.cache_folder() != before


@pytest.mark.usefixtures('made_up')
def test_compiled_code_is_kept_in_the_cache_of_the_user(tmp_path, monkeypatch):
    before = compile.cache_folder()
    assert before == compile.cache_folder()
    assert before.parent == tmp_path / 'cache' / 'auv_gvc'
    monkeypatch.setenv('AUV_GVC_CACHE_DIR', str(tmp_path / 'mine'))
    assert compile.cache_folder() == tmp_path / 'mine' / before.name


def test_plain_gives_the_python_function():
    def function():
        return 1

    assert compile.plain(function) is function
    assert compile.plain(compile.compiled(function)) is function
    assert compile.plain(compile.helper(function)) is function


def mode(folder):
    return stat.S_IMODE(folder.stat().st_mode)


def test_the_folder_of_compiled_code_is_its_users_alone(tmp_path):
    assert compile.is_private(tmp_path / 'new' / 'inner')
    assert mode(tmp_path / 'new' / 'inner') == 0o700
    (tmp_path / 'old').mkdir()
    (tmp_path / 'old').chmod(0o777)
    assert compile.is_private(tmp_path / 'old')
    assert mode(tmp_path / 'old') == 0o700


def test_a_folder_that_somebody_else_made_is_not_used(tmp_path, monkeypatch):
    (tmp_path / 'link').symlink_to(tmp_path)
    assert not compile.is_private(tmp_path / 'link')
    (tmp_path / 'file').touch()
    assert not compile.is_private(tmp_path / 'file')
    monkeypatch.setattr(os, 'getuid', lambda: 12345)  # the folders are then of another user
    (tmp_path / 'theirs').mkdir(mode=0o755)
    theirs = os.stat(tmp_path / 'theirs')
    assert compile.is_private(tmp_path / 'theirs') == (theirs.st_uid == 0), 'root may install it'
    (tmp_path / 'theirs').chmod(0o777)
    assert not compile.is_private(tmp_path / 'theirs')


@needing('numba', compile.JITTED)
def test_one_clone_loads_what_another_compiled_unless_the_source_differs(tmp_path):
    for clone, added in (('one', 1), ('other', 1), ('changed', 2)):
        module = tmp_path / clone / 'counting.py'
        module.parent.mkdir()
        module.write_text(
            'from auv_dynamics.kernel.compile import compiled\n'
            '@compiled\n'
            'def next_one(x):\n'
            f'    return x + {added}\n'
        )
    call = (
        'import sys\n'
        'for sys.path[0] in sys.argv[1:]:\n'
        '    sys.modules.pop("counting", None)\n'
        '    from counting import next_one\n'
        '    print(next_one(1), len(next_one.stats.cache_hits))\n'
    )
    done = subprocess.run(
        [sys.executable, '-c', call, *(str(tmp_path / c) for c in ('one', 'other', 'changed'))],
        env=os.environ | {'AUV_GVC_CACHE_DIR': str(tmp_path / 'cache')},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.splitlines() == ['2 0', '2 1', '3 0']
    assert list((tmp_path / 'cache').glob('**/*.nb?'))


@needing('numba', compile.JITTED)
def test_code_in_a_folder_of_somebody_else_is_neither_loaded_nor_kept(tmp_path):
    cache = tmp_path / 'cache' / compile.kernels_digest()
    cache.parent.mkdir()
    cache.symlink_to(tmp_path, target_is_directory=True)
    script = tmp_path / 'script.py'
    script.write_text(
        'from auv_dynamics.kernel.compile import compiled\n'
        '@compiled\n'
        'def next_one(x):\n'
        '    return x + 1\n'
        'print(next_one(1))\n'
    )
    done = subprocess.run(
        [sys.executable, str(script)],
        env=os.environ | {'AUV_GVC_CACHE_DIR': str(cache.parent)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == '2\n'
    assert not list(tmp_path.glob('**/*.nb?'))
    said = f'warning: {cache}: not yours alone: compiled code is neither kept nor loaded'
    assert done.stderr.splitlines() == [said]


@pytest.mark.parametrize(
    ('value', 'expected'), [('', False), ('0', False), ('1', True), ('true', False)]
)
def test_the_switch_is_read_as_numba_reads_it(value, expected, monkeypatch):
    monkeypatch.delitem(sys.modules, 'numba', raising=False)
    monkeypatch.setenv(compile.SWITCH, value)
    assert compile._switched_off() is expected
