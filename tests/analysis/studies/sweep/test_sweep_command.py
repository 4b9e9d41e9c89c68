"""`auv sweep`: one document, one line that says where, refused and diverged rollouts, own laws."""

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path

import pyarrow.parquet
import pytest
from helpers.sweeps import CAMPAIGN, ROLLOUTS, SCENARIO, parts, rows, write_files

from auv_analysis.cli.main import main
from auv_analysis.simulation import simulate
from auv_analysis.studies.sweep import engine
from auv_analysis.studies.sweep.campaign import Campaign
from auv_analysis.studies.sweep.engine import SweepStoppedError
from auv_gvc_controller.laws.law import SHIPPED


@pytest.fixture
def files(tmp_path: Path) -> Path:
    return write_files(tmp_path)


@pytest.fixture
def command(files: Path, monkeypatch, capsys) -> Callable:
    """`auv sweep` in this process: exit code, stdout, lines of stderr."""
    monkeypatch.chdir(files)

    def call(*arguments: str) -> tuple[object, str, list[str]]:
        code: object = 0
        try:
            main(['sweep', 'campaign.yaml', *arguments])
        except SystemExit as end:
            code = end.code
        captured = capsys.readouterr()
        return code, captured.out, captured.err.splitlines()

    return call


def test_command_prints_one_document_and_says_where(command: Callable, files: Path) -> None:
    code, out, lines = command('--json', '--workers', '2')
    document = json.loads(out)
    assert (code, document['rows'], document['dataset']) == (0, 32, 'runs/small/rollouts')
    assert [document[key] for key in ('campaign', 'folder', 'rollouts', 'rollouts_before')] == [
        'small', 'runs/small', ROLLOUTS, 0,
    ]  # fmt: skip
    assert document['controllers']['cl'] == {'ok': ROLLOUTS, 'diverged': 0, 'refused': 0}
    assert sorted(document['paths']) == [
        'controllers.*.k_D', 'setpoint.surge.offset', 'vehicle', 'vehicle.damping.linear[0]'
    ]  # fmt: skip
    assert ['cl', str(ROLLOUTS), '0', '0'] in [line.split() for line in lines]
    assert lines[-1] == "rollouts: 32 rows, pandas.read_parquet('runs/small/rollouts')"
    assert len(pyarrow.parquet.read_table(files / document['dataset'])) == 32
    assert json.loads(command('--json')[1])['rollouts_before'] == ROLLOUTS


def test_overwrite_replaces_a_sweep_and_leaves_the_rest(command: Callable, files: Path) -> None:
    command()
    first = parts(files / 'runs/small')
    (files / 'runs/small/notes.md').write_text('mine')
    text = CAMPAIGN.replace('count: 4', 'count: 1').replace('seed: 11', 'seed: 12')
    (files / 'campaign.yaml').write_text(text)
    assert command()[0] == 2
    assert parts(files / 'runs/small') == first
    code, _, lines = command('--overwrite')
    assert code == 0
    table = ['controller ok diverged refused', 'gvc 4 0 0', 'cl 4 0 0']
    assert [line.split() for line in lines[-4:-1]] == [line.split() for line in table]
    assert len(parts(files / 'runs/small')) == 1
    assert rows(files / 'runs/small')['index'].to_pylist() == [*range(4)] * 2
    assert (files / 'runs/small/notes.md').read_text() == 'mine'


def test_campaign_of_the_folder_makes_the_same_rows(command: Callable, files: Path) -> None:
    command()
    main(['sweep', 'runs/small/campaign.yaml', '--out', 'again'])
    assert rows(files / 'again').equals(rows(files / 'runs/small'))


def test_a_sweep_that_is_stopped_says_how_it_goes_on(command, monkeypatch) -> None:
    told: list[list[str]] = []
    asked: list[tuple] = []
    opened = engine.opened

    def stopped(*_: object) -> None:
        raise SweepStoppedError('interrupted')

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(engine, 'sweep', stopped)
    monkeypatch.setattr(engine, 'opened', lambda *of: asked.append(of) or opened(*of))
    monkeypatch.setattr(simulate, 'announce', lambda _, names: told.append(names))
    monkeypatch.setattr(Campaign, 'own_laws', {'gvc': SHIPPED['gvc']})  # is not announced
    again = 'the same command goes on from there'
    for _ in range(2):
        code, _, lines = command()
        done = '0 of 16 rollouts are finished'
        assert (code, lines[-1]) == (1, f'runs/small: interrupted; {done}, {again}')
    assert told == [['cl']], 'one that goes on says nothing'
    out = 'runs/small/unfinished'
    again = f'the same command with --out {out}, without --overwrite, goes on from there'
    assert command('--overwrite')[2][-1] == f'{out}: interrupted; {done}, {again}'
    monkeypatch.setattr(engine, 'sweep', interrupted)  # for the second time
    monkeypatch.setattr(os, '_exit', sys.exit)
    code, _, lines = command('--overwrite', '--executor', 'threads', '--workers', '3')
    assert (code, lines[-1]) == (1, f'{out}: interrupted; {again}')
    assert asked == [(None, None, None)] * 3 + [('threads', None, 3)]


@pytest.mark.parametrize('all_of_them', [False, True])
def test_values_that_make_no_scenario_are_counted(command, all_of_them: bool, files: Path) -> None:
    masses = '[-1.0, 0.0]' if all_of_them else '[250.0, -1.0]'
    varied = f"[{{grid: {{'vehicle.rigid_body.mass': {masses}}}}}]"
    text = f'name: small\nscenario: scenario.yaml\nvary: {varied}'
    (files / 'campaign.yaml').write_text(text)
    code, out, lines = command('--json')
    table = rows(files / 'runs/small')
    refused = [i for i, status in enumerate(table['status'].to_pylist()) if status == 'refused']
    assert len(refused) == (4 if all_of_them else 2)
    assert all('rigid_body.mass' in table['reason'][i].as_py() for i in refused)
    assert all(table['kinetic_energy.mean'][i].as_py() is None for i in refused)
    told = f'warning: {len(refused)} of 4 rows refused, the first: {table["reason"][refused[0]]}'
    assert told in lines
    assert code == (1 if all_of_them else 0)
    assert json.loads(out)['rows'] == 4
    assert ('every rollout was refused' in lines[-1]) is all_of_them


def test_diverging_rollout_is_a_result(command: Callable, files: Path) -> None:
    text = "name: small\nscenario: scenario.yaml\nvary: [{grid: {'controllers.*.k_D': [12, 1e9]}}]"
    (files / 'campaign.yaml').write_text(text)
    code, out, _ = command('--json')
    assert (code, json.loads(out)['controllers']['gvc']) == (
        0,
        {'ok': 1, 'diverged': 1, 'refused': 0},
    )
    table = rows(files / 'runs/small')
    assert [t is None for t in table['diverged_at'].to_pylist()] == [True, False] * 2


OWN_LAW = """
from typing import NamedTuple
import numpy as np

class Proportional(NamedTuple):
    k_P: np.ndarray
    STATES = 6

    @staticmethod
    def wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        tau = gains.k_P.reshape(6, 6) @ np.subtract(nu_d, nu)
        return tau, np.zeros(6)

    @staticmethod
    def state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return np.zeros(6)
"""


@pytest.mark.long
def test_own_law_is_swept_and_an_edited_one_is_refused_in_words(
    command, files: Path, monkeypatch
) -> None:
    (files / 'my_sweep_law.py').write_text(OWN_LAW)
    monkeypatch.syspath_prepend(str(files))
    text = SCENARIO.replace('0.3', '0.02')
    mine = "  mine: {law: 'my_sweep_law:Proportional', k_P: 100.0}\n"
    (files / 'scenario.yaml').write_text(text.replace('  gvc:', f'{mine}  gvc:'))
    text = ('name: small\nscenario: scenario.yaml\ncontrollers: [mine]\n'
            "vary: [{grid: {'controllers.mine.k_P': [50, 100.0]}}]")  # fmt: skip
    (files / 'campaign.yaml').write_text(text)
    code, out, _ = command('--json')
    assert (code, json.loads(out)['controllers']['mine']['ok']) == (0, 2)
    errors = rows(files / 'runs/small')['velocity_error.rms.surge'].to_pylist()
    assert errors[0] > errors[1]
    (files / 'my_sweep_law.py').write_text(OWN_LAW + '# changed\n')
    code, _, lines = command()
    assert (code, len(lines)) == (2, 1)
    assert 'laws.mine: expected the module of the law as when it was begun' in lines[0]
    assert lines[0].endswith('found an edited one')
