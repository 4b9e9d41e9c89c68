"""A vehicle through Gazebo's format and back, and what Gazebo would make of it."""

import json
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose

from auv_analysis.cli.main import main
from auv_dynamics import load_vehicle
from auv_dynamics.files.shipped import shipped
from auv_dynamics.vehicle.frames import swap_body

NAMES = ('rexrov', 'bluerov2', 'bluerov2_heavy', 'lauv', 'lrauv_tethys', 'girona500')


@pytest.mark.parametrize('place', ['plugin', 'link'])
@pytest.mark.parametrize('name', NAMES)
def test_there_and_back(name, place, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    vehicle = load_vehicle(name)
    main(['export-vehicle', name, '--added-mass', place, '--out', 'there.sdf', '--json'])
    gravity = str(vehicle.weight / vehicle.M_RB[0, 0])
    main(['import-vehicle', 'there.sdf', '--gravity', gravity, '--out', 'back.yaml', '--json'])
    capsys.readouterr()
    back = load_vehicle(tmp_path / 'back.yaml')
    for key in ('M_RB', 'M_A', 'D_linear', 'D_quadratic', 'r_G', 'r_B', 'weight', 'buoyancy'):
        there = np.asarray(getattr(vehicle, key))
        assert_allclose(getattr(back, key), there, atol=1e-12 * np.abs(there).max(), rtol=1e-9)
    nu = np.array([-0.7, -0.2, 0.3, 0.1, -0.3, 0.2])
    assert_allclose(back.D(nu), vehicle.D(nu), rtol=1e-12)


@pytest.mark.parametrize('place', ['plugin', 'link'])
def test_lift_that_feeds_its_own_motion_comes_back(place, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    data = yaml.safe_load(shipped('vehicles', 'lauv').read_text())
    data['lift'][5][5] = -2.0
    (tmp_path / 'fed.yaml').write_text(yaml.safe_dump(data))
    main(['export-vehicle', 'fed.yaml', '--added-mass', place, '--out', 'there.sdf'])
    main(['import-vehicle', 'there.sdf', '--out', 'back.yaml', '--json'])
    assert 'feeds its own motion' in str(json.loads(capsys.readouterr().out)['warnings'])
    assert_allclose(load_vehicle(tmp_path / 'back.yaml').lift, data['lift'])


@pytest.mark.parametrize('place', ['plugin', 'link'])
def test_quadratic_damping_that_feeds_its_motion_comes_back(place, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = shipped('vehicles', 'bluerov2_heavy').read_text()
    Path('mine.yaml').write_text(text.replace('0.47, 1.5]', '0.47, -0.3]'))
    line = 'export-vehicle mine.yaml --format gazebo --out m.sdf --added-mass'
    main([*line.split(), place])
    with pytest.raises(SystemExit):
        main(['import-vehicle', 'm.sdf', '--out', 'again.yaml'])
    assert 'or --sign sname if this one feeds its motion' in capsys.readouterr().err
    main(['import-vehicle', 'm.sdf', '--sign', 'sname', '--out', 'again.yaml'])
    known, again = load_vehicle('mine.yaml'), load_vehicle('again.yaml')
    assert known.D_quadratic[5, 5] < 0
    assert_allclose(again.D_quadratic, known.D_quadratic)
    assert_allclose(again.M_A, known.M_A)


def test_damping_acts_in_gazebo_as_here(tmp_path, capsys):
    """The plugin's own sum, its force turned to FSD, is -D(nu) nu; of lift by surge itself too."""
    data = yaml.safe_load(shipped('vehicles', 'lauv').read_text())
    data['lift'][0][0] = 3.0
    (tmp_path / 'lauv.yaml').write_text(yaml.safe_dump(data))
    vehicle = load_vehicle(tmp_path / 'lauv.yaml')
    main(['export-vehicle', str(tmp_path / 'lauv.yaml')])
    text = capsys.readouterr().out
    plugin = ElementTree.fromstring(text).find('.//plugin')
    nu = np.array([0.7, -0.2, 0.3, 0.1, -0.3, 0.2])
    state, force = swap_body(nu), np.zeros(6)
    for entry in plugin:
        rows, columns = 'xyzkmn', 'UVWPQR'
        if len(entry.tag) == 2:
            force[rows.index(entry.tag[0])] += (
                float(entry.text) * state[columns.index(entry.tag[1])]
            )
        elif 'abs' in entry.tag:
            one, other = (state[columns.index(entry.tag[k])] for k in (1, 5))
            force[rows.index(entry.tag[0])] += float(entry.text) * abs(other) * one
    assert_allclose(swap_body(force), -vehicle.D(nu) @ nu, atol=1e-12)


def test_document_says_what_gazebo_cannot_hold(capsys):
    main(['export-vehicle', 'rexrov', '--json'])
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert captured.err.splitlines() == document['notes']
    said = ' '.join(document['notes'])
    assert 'Unstable' in said
    assert 'off the diagonal' in said
    assert 'gz-sim-hydrodynamics-system' in document['sdf']
    main(['export-vehicle', 'rexrov', '--added-mass', 'link', '--json'])
    assert 'Unstable' not in capsys.readouterr().out


def test_vehicle_of_which_only_M_is_known_is_refused(capsys):
    with pytest.raises(SystemExit) as end:
        main(['export-vehicle', 'herman2018'])
    captured = capsys.readouterr()
    assert (end.value.code, len(captured.err.splitlines()), captured.out) == (2, 1, '')
    assert 'inertia_matrix: expected inertia and added_mass apart' in captured.err


def test_the_vehicle_that_is_read_is_never_replaced(tmp_path, capsys):
    path, text = tmp_path / 'mine.yaml', shipped('vehicles', 'lauv').read_text()
    path.write_text(text)
    with pytest.raises(SystemExit, match='2'):
        main(['export-vehicle', str(path), '--out', str(path), '--overwrite'])
    assert f'{path}: --out' in capsys.readouterr().err
    assert path.read_text() == text
