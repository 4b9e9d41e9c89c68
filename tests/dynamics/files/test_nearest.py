"""The known name that a wrong one was meant for, and where it is said."""

from pathlib import Path

import pytest

from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import meant, nearest, one_of
from auv_dynamics.files.shipped import shipped, shipped_names
from auv_dynamics.files.yaml_files import read_text
from auv_gvc_controller.control.setpoint import load_table
from auv_gvc_controller.laws.law import law_class, make_gains

LAWS = ('gvc', 'cl', 'pid', 'smc')


@pytest.mark.parametrize(
    ('name', 'known', 'expected'),
    [
        ('gcv', LAWS, 'gvc'),
        ('KD', ('k_D', 'k_I', 'Gamma'), 'k_D'),
        ('GAMMA', ('k_D', 'Gamma'), 'Gamma'),
        ('simulte', ('simulate', 'study'), 'simulate'),
    ],
)
def test_nearest_is_what_was_meant(name, known, expected):
    assert nearest(name, known) == [expected]
    assert meant(name, known) == f' (nearest: {expected})'


@pytest.mark.parametrize('name', ['zzz', '', None, 3, ['gvc']])
def test_nothing_is_suggested_where_nothing_is_like_it(name):
    assert nearest(name, LAWS) == []
    assert one_of(name, LAWS) == 'one of gvc, cl, pid, smc'


def test_several_come_the_likest_first():
    assert nearest('odom', ('twist', 'odometry', 'odo', 'odom_old'), 3)[0] == 'odo'
    assert len(nearest('odom', ('odom1', 'odom2', 'odom3'), 2)) == 2


def test_shipped_names_and_files_beside_are_suggested(tmp_path: Path):
    assert 'rexrov' in shipped_names('vehicles')
    with pytest.raises(InputError, match=r'bluerov2_heavy.*\(nearest: rexrov\), found no such'):
        shipped('vehicles', 'rexrof')
    (tmp_path / 'mine.yaml').touch()
    with pytest.raises(InputError, match=r'a vehicle file \(nearest: mine.yaml\), found no such'):
        read_text(tmp_path / 'mien.yaml', 'vehicle')
    with pytest.raises(InputError, match='expected a vehicle file, found no such file'):
        read_text(tmp_path / 'gone' / 'x.yaml', 'vehicle')


@pytest.mark.parametrize(
    ('old', 'new', 'expected'),
    [
        ('mass:', 'masse:', r'rigid_body.masse: expected one of mass, .* \(nearest: mass\)'),
        ('inertia_reference: cg', 'inertia_reference: cgg', r'cg or co \(nearest: cg\), found cgg'),
    ],
)
def test_keys_and_words_of_a_file_are_suggested(old, new, expected, tmp_path: Path):
    text = shipped('vehicles', 'rexrov').read_text(encoding='utf-8')
    (tmp_path / 'mine.yaml').write_text(text.replace(old, new, 1), encoding='utf-8')
    with pytest.raises(InputError, match=expected):
        load_vehicle(tmp_path / 'mine.yaml')


def test_laws_gains_and_columns_are_suggested(tmp_path: Path, monkeypatch):
    with pytest.raises(ValueError, match=r"module:Class \(nearest: gvc\), found 'gvcc'"):
        law_class('gvcc')
    with pytest.raises(ValueError, match=r'^k_DD: expected one of .* \(nearest: k_D\), found an'):
        make_gains('cl', {'k_DD': 1.0})
    monkeypatch.chdir(tmp_path)
    Path('near_law.py').write_text('class MyLaw: pass\n')
    with pytest.raises(ValueError, match=r'\(nearest: MyLaw\), found no MyLav in near_law'):
        law_class('near_law:MyLav')
    Path('points.csv').write_text('t,surge,sway,heave,roll,pich,yaw\n')
    with pytest.raises(InputError, match=r'the columns .*yaw \(nearest: pitch\), found t,surge'):
        load_table(Path('points.csv'), 1.0)
