"""What somebody else's bag or results name is not imported: to import a module is to run it."""

import json
from pathlib import Path

import pytest
import yaml
from helpers.untrusted_bags import SCENARIO, write

from auv_analysis import load_run, summarize
from auv_analysis.cli import main
from auv_dynamics.files.errors import InputError
from auv_gvc_controller.laws.law import is_unasked

LAW = """
from pathlib import Path
from typing import NamedTuple

import numpy as np

Path({trace!r}).write_text('run')


class Theirs(NamedTuple):
    k_D: np.ndarray
    k_I: np.ndarray
    Lambda: np.ndarray
    Gamma: np.ndarray

    STATES = 0

    @staticmethod
    def wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return gains.k_D.reshape(6, 6) @ np.subtract(nu_d, nu), np.zeros(6)

    @staticmethod
    def state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return np.zeros(0)
"""


@pytest.fixture
def trace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request) -> Path:
    """A file that the stranger's module writes when it is imported; its folder is entered."""
    path = tmp_path / 'trace'
    (tmp_path / f'{module(request)}.py').write_text(LAW.format(trace=str(path)))
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    return path


def module(request: pytest.FixtureRequest) -> str:
    """Name of a module that no other test has imported."""
    return f'stranger_{abs(hash(request.node.nodeid))}'


def test_a_bag_imports_no_module(tmp_path, trace, request) -> None:
    law = f'{module(request)}:Theirs'
    run = load_run(write(tmp_path / 'bag.mcap', law=law))
    assert not trace.exists()
    assert is_unasked(law)
    assert (run.law, run.gains) == (law, {})
    assert any(f'--law {law} imports its module' in note for note in run.notes)
    summary = summarize(run)
    assert summary['law'] == law
    assert summary['gains'] == {'K_D': None, 'K_f': None}
    assert not trace.exists()


@pytest.mark.usefixtures('undrawn')
def test_analyze_imports_what_the_user_names_alone(tmp_path, trace, request, capsys) -> None:
    law = f'{module(request)}:Theirs'
    bag = str(write(tmp_path / 'bag.mcap', law=law))
    main.main(['analyze', bag, '--json', '--out', str(tmp_path / 'first')])
    assert not trace.exists()
    assert json.loads(capsys.readouterr().out)['gvc']['gains']['K_D'] is None
    main.main(['analyze', bag, '--json', '--law', law, '--out', str(tmp_path / 'second')])
    assert trace.read_text() == 'run'
    assert json.loads(capsys.readouterr().out)['gvc']['gains']['K_D'][0][0] == 1.0


def test_results_of_simulate_import_no_module(tmp_path, trace, request) -> None:
    law = f'{module(request)}:Theirs'
    data = {**SCENARIO.data, 'vehicle': 'herman2018', 'duration': 0.1}
    data['controllers'] = {'theirs': {**data['controllers']['gvc'], 'law': law}}
    (tmp_path / 'scenario.yaml').write_text(yaml.safe_dump(data))
    (tmp_path / 'theirs.npz').touch()
    for argument in (tmp_path, tmp_path / 'theirs.npz'):
        with pytest.raises(SystemExit) as ended:
            main.main(['analyze', str(argument), '--out', str(tmp_path / 'out')])
        assert ended.value.code == 2
    assert not trace.exists()


@pytest.mark.usefixtures('undrawn')
def test_another_law_on_a_replay_imports_that_one_alone(tmp_path, trace, request, capsys) -> None:
    law = f'{module(request)}:Theirs'
    bag = str(write(tmp_path / 'bag.mcap', law=law))
    gains = [f'--gain={name}=1' for name in ('k_D', 'k_I', 'Lambda', 'Gamma')]
    out = ('--json', '--out', str(tmp_path / 'out'))
    main.main(['replay', bag, '--law', 'gvc', *gains, *out])
    assert not trace.exists()
    assert json.loads(capsys.readouterr().out)['reproduced_within'] is None
    main.main(['replay', bag, '--law', law, *out, '--overwrite'])  # its gains are known now
    assert trace.read_text() == 'run'
    assert json.loads(capsys.readouterr().out)['answered']['gains']['k_D'] == 1.0


@pytest.mark.parametrize('law', ['os:system', 'antigravity:x', 'subprocess:Popen'])
def test_modules_of_python_are_not_touched_either(tmp_path, law) -> None:
    assert load_run(write(tmp_path / 'bag.mcap', law=law)).gains == {}


@pytest.mark.parametrize('law', ['a:b c', ':', '<b>:x', 'a:\x1b[2J', '../x:y', 7, ['gvc'], 'lqr'])
def test_what_is_no_law_at_all_is_refused(tmp_path, law) -> None:
    with pytest.raises(InputError, match='controller_node: expected'):
        load_run(write(tmp_path / 'bag.mcap', law=law))


def test_a_law_that_cannot_be_imported_is_refused_in_one_line(tmp_path, capsys) -> None:
    bag = str(write(tmp_path / 'bag.mcap'))
    with pytest.raises(SystemExit) as ended:
        main.main(['analyze', bag, '--law', 'no_such_module:Law'])
    assert ended.value.code == 2
    assert capsys.readouterr().err.startswith(
        '--law: expected gvc, cl, pid, smc, multisine or module:Class'
    )
