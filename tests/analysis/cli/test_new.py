"""`auv new`: files that work as they are, with every option, and that overwrite nothing."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from auv_analysis import load_scenario
from auv_analysis.cli import main
from auv_analysis.scenario.templates import STARTING, annotated
from auv_dynamics import load_vehicle
from auv_dynamics.files.yaml_files import schema
from auv_dynamics.plant.parameters import SCHEMA
from auv_dynamics.vehicle.vehicle_file import SCHEMA as VEHICLE_SCHEMA

OPTION = re.compile(r'^( *)#(?! \S|$)', re.M)
HINT = re.compile(r'\$schema=file://(\S+)')


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, 'path', [*sys.path])
    return tmp_path


def _new(*arguments: str) -> int:
    try:
        main.main(['new', *arguments])
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def _without_marks(path: Path) -> None:
    path.write_text(OPTION.sub(r'\1', path.read_text()))


def test_vehicle_loads_and_explains_every_key(folder, capsys):
    assert _new('vehicle', 'mine') == 0
    assert 'auv check-vehicle mine.yaml' in capsys.readouterr().out
    assert load_vehicle('mine.yaml').M.tolist() == load_vehicle(STARTING).M.tolist()
    main.main(['check-vehicle', 'mine.yaml', '--json'])
    assert json.loads(capsys.readouterr().out)
    text = Path('mine.yaml').read_text()
    assert Path(HINT.search(text)[1]) == VEHICLE_SCHEMA
    root = schema(VEHICLE_SCHEMA)
    keys = [*root['properties'], *root['properties']['rigid_body']['properties']]
    assert all(re.search(rf'^ *#?(?: |)(- )?{key}\b', text, re.M) for key in keys)
    for word in ('X_udot', 'Y_v,', 'N_|r|r', 'kg m2', 'r_G', 'SNAME'):
        assert word in text
    _without_marks(Path('mine.yaml'))
    assert yaml.safe_load(Path('mine.yaml').read_text())['sign'] == 'positive'
    assert load_vehicle('mine.yaml').name == 'mine'


def test_scenario_loads_also_with_every_option(folder):
    assert _new('vehicle', 'mine') == 0
    assert _new('scenario', 'trial', '--vehicle', 'mine.yaml') == 0
    scenario = load_scenario('trial.yaml')
    assert scenario.vehicle.name == 'mine'
    _without_marks(Path('trial.yaml'))
    full = load_scenario('trial.yaml')
    properties = schema(SCHEMA)['properties']
    of_open_loop = {'excitation'}  # which is refused where no law follows it
    assert set(yaml.safe_load(Path('trial.yaml').read_text())) == set(properties) - of_open_loop
    kinds = {branch['if']['properties']['kind']['const']
             for branch in schema(SCHEMA)['$defs']['disturbance']['allOf']}  # fmt: skip
    assert full.kinds == kinds
    assert full.sampled


def test_law_and_its_scenario_run_as_they_are(folder):
    assert _new('law', 'my_own_law') == 0
    scenario = load_scenario('my_own_law.yaml')
    assert scenario.controllers['mine']['law'] == 'my_own_law:MyOwnLaw'
    text = Path('my_own_law.yaml').read_text()
    Path('my_own_law.yaml').write_text(text.replace('duration: 10.0', 'duration: 0.05'))
    # as plain Python: what is asked is whether it runs, not how fast
    ended = subprocess.run(
        [sys.executable, '-m', 'auv_analysis.cli.main', 'simulate', 'my_own_law.yaml',
         '--no-report'],
        env={**os.environ, 'NUMBA_DISABLE_JIT': '1'}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    assert set(json.loads(Path('runs/my_own_law/summary.json').read_text())) == {'mine', 'gvc'}


def test_all_that_is_written(folder, approved):
    """Every key with what its schema says of it, and every option."""
    assert _new('vehicle', 'mine.yaml') == 0
    assert _new('scenario', 'trial', '--vehicle', 'rexrov') == 0
    assert _new('law', 'pull_2.py', '--vehicle', 'mine.yaml') == 0
    for name in ('mine.yaml', 'trial.yaml', 'pull_2.yaml'):
        approved.add(Path(name).read_text().splitlines())
    assert load_scenario('trial.yaml').vehicle.name == 'rexrov'
    compared = load_scenario('pull_2.yaml')
    assert (compared.name, compared.vehicle.name) == ('pull_2', 'mine')
    assert compared.controllers['mine']['law'] == 'pull_2:Pull2'


@pytest.mark.parametrize('kind', ['vehicle', 'scenario', 'law'])
def test_nothing_is_overwritten(kind, folder, capsys):
    Path('mine.yaml').write_text('mine\n')
    assert _new(kind, 'mine') == 2
    lines = capsys.readouterr().err.splitlines()
    assert lines == ['mine.yaml: expected a name that is free here, found an existing file']
    assert [path.name for path in folder.iterdir()] == ['mine.yaml']
    assert Path('mine.yaml').read_text() == 'mine\n'


def test_no_law_is_overwritten_either(folder, monkeypatch, capsys):
    monkeypatch.syspath_prepend(folder)
    Path('mine.py').write_text('mine = 1\n')
    assert _new('law', 'mine') == 2
    assert capsys.readouterr().err.startswith('mine.py: expected a name that is free here')
    assert [path.name for path in folder.iterdir()] == ['mine.py']


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (('vehicle', 'a/b'), 'NAME: expected a word'),
        (('law', 'my-law'), 'NAME: expected the name of a Python module'),
        (('law', 'class'), 'NAME: expected the name of a Python module'),
        (('law', 'json'), 'NAME: expected a name that no Python module has'),
        (('vehicle', 'a', '--vehicle', 'rexrov'), '--vehicle: expected'),
        (('scenario', 'a', '--vehicle', 'rexrof'), 'nearest: rexrov'),
        (('law', 'new_law', '--vehicle', 'rexrof'), 'nearest: rexrov'),
        (('vehicel', 'a'), 'nearest: vehicle'),
    ],
)
def test_what_cannot_be_made_is_refused_in_one_line(arguments, words, folder, capsys):
    assert _new(*arguments) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert words in lines[0]
    assert not list(folder.iterdir())


def test_text_holds_what_it_was_made_of():
    data = {'name': 'x', 'vehicle': 'y', 'duration': 1.0, 'step': 0.5, 'controllers': {},
            'setpoint': {'yaw': {'terms': []}}}  # fmt: skip
    assert yaml.safe_load(annotated(data, schema(SCHEMA))) == data


def test_made_files_are_said_as_one_document(folder, capsys):
    assert _new('scenario', 'trial.yaml', '--json') == 0
    document = json.loads(capsys.readouterr().out)
    assert document['files'] == ['trial.yaml']
    assert load_scenario('trial.yaml').vehicle.name == STARTING
    assert document['next'][0] == 'auv simulate trial.yaml'
