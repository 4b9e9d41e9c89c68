"""Vehicle files: the shipped ones, the two references and signs, numbers as YAML writes them."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.strategies import QUICK, vehicles
from hypothesis import given
from jsonschema import Draft202012Validator
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics import InputError, load_vehicle
from auv_dynamics.files.shipped import shipped
from auv_dynamics.vehicle.vehicle_file import SCHEMA, vehicle_from_dict
from auv_gvc_controller import decompose

FOLDER = shipped('vehicles', 'herman2018').parent
NAMES = sorted(path.stem for path in FOLDER.glob('*.yaml'))
N_PRINTED = [300.0, 500.0, 500.0, 40.0, 175.5, 141.1]


def text_of(name: str) -> str:
    return shipped('vehicles', name).read_text(encoding='utf-8')


def comment(text: str, key: str) -> str:
    """Comment on the line of a key."""
    line = next(line for line in text.splitlines() if line.strip().startswith(f'{key}:'))
    return line.partition('#')[2].strip()


def test_the_papers_vehicles_and_rexrov_are_shipped():
    assert {'herman2018', 'herman2018_neutral', 'rexrov'} <= set(NAMES)


@pytest.mark.parametrize('name', NAMES)
def test_shipped_vehicles_load_by_bare_name_and_by_path(name):
    vehicle, by_path = load_vehicle(name), load_vehicle(FOLDER / f'{name}.yaml')
    assert vehicle.name == name
    assert vehicle.source
    assert_array_equal(vehicle.M, vehicle.M.T)
    assert np.linalg.eigvalsh(vehicle.M)[0] > 0
    assert_array_equal(vehicle.M, by_path.M)
    assert_array_equal(vehicle.model.hydrostatics, by_path.model.hydrostatics)


@pytest.mark.parametrize('name', NAMES)
def test_the_schema_accepts_what_is_shipped(name):
    schema = json.loads(SCHEMA.read_text(encoding='utf-8'))
    Draft202012Validator.check_schema(schema)
    Draft202012Validator(schema).validate(yaml.safe_load(text_of(name)))


def test_the_schema_refuses_something():
    schema = json.loads(SCHEMA.read_text(encoding='utf-8'))
    data = yaml.safe_load(text_of('rexrov'))
    assert not Draft202012Validator(schema).is_valid(data | {'color': 'yellow'})
    assert not Draft202012Validator(schema).is_valid({k: data[k] for k in data if k != 'damping'})


def test_herman2018_has_the_printed_N():
    vehicle = load_vehicle('herman2018')
    _, N = decompose(vehicle.M)
    assert_allclose(N, N_PRINTED, atol=0.05)
    assert_allclose(N, [300, 500, 500, 39.988, 175.5, 141.114], atol=5e-4)
    assert vehicle.weight == pytest.approx(250 * 9.81)
    assert vehicle.buoyancy - vehicle.weight == pytest.approx(1079.1, abs=0.05)


@pytest.mark.parametrize('name', ['herman2018', 'herman2018_neutral'])
def test_given_and_reconstructed_values_are_told_apart(name):
    text = text_of(name)
    volume = 'GIVEN' if name == 'herman2018' else 'RECONSTRUCTED'
    kinds = {'mass': 'RECONSTRUCTED', 'center_of_gravity': 'GIVEN', 'damping': 'RECONSTRUCTED',
             'inertia_matrix': 'RECONSTRUCTED', 'volume': volume, 'environment': 'GIVEN',
             'center_of_buoyancy': 'GIVEN'}  # fmt: skip
    for key, kind in kinds.items():
        assert comment(text, key).startswith(kind), key


def test_the_neutral_file_differs_in_volume_alone():
    one, other = (yaml.safe_load(text_of(n)) for n in ('herman2018', 'herman2018_neutral'))
    assert (one['hydrostatics'].pop('volume'), other['hydrostatics'].pop('volume')) == (0.36, 0.25)
    assert (one.pop('name'), other.pop('name')) == ('herman2018', 'herman2018_neutral')
    assert one == other


def test_rexrov_carries_what_its_source_prints():
    vehicle = load_vehicle('rexrov')
    assert vehicle.M_RB is not None
    assert_allclose(vehicle.M_RB[3:, 3:], [[525.39, -1.44, -33.41], [-1.44, 794.2, 2.6],
                                           [-33.41, 2.6, 691.23]])  # fmt: skip
    assert vehicle.M_A[1, 3] == 409.44
    assert vehicle.M_A[2, 5] == vehicle.M_A[5, 2] == pytest.approx(10.7745)
    assert any('added_mass' in line and 'symmetrised' in line for line in vehicle.warnings)


@QUICK
@given(vehicles())
def test_the_two_inertia_references_give_the_same_vehicle(data):
    r = np.array(data['rigid_body']['center_of_gravity'])
    mass, inertia = data['rigid_body']['mass'], np.array(data['rigid_body']['inertia'])
    about_origin = inertia + mass * (r @ r * np.eye(3) - np.outer(r, r))
    body = data['rigid_body'] | {'inertia': about_origin.tolist(), 'inertia_reference': 'co'}
    one, other = (vehicle_from_dict(d, 'f') for d in (data, data | {'rigid_body': body}))
    assert_allclose(other.M, one.M, rtol=0, atol=1e-13 * np.abs(one.M).max())
    wrong = vehicle_from_dict(
        data | {'rigid_body': body | {'inertia_reference': 'cg'}}, 'f'
    )  # fmt: skip
    assert np.abs(wrong.M - one.M).max() > 1e-6 * mass


@QUICK
@given(vehicles())
def test_sname_negates_added_mass_damping_and_lift_and_nothing_else(data):
    def negated(value):
        return (-np.array(value)).tolist()

    other = data | {
        'sign': 'positive' if data['sign'] == 'sname' else 'sname',
        'added_mass': negated(data['added_mass']),
        'damping': {key: negated(value) for key, value in data['damping'].items()},
        **({'lift': negated(data['lift'])} if 'lift' in data else {}),
    }
    one, two = vehicle_from_dict(data, 'f'), vehicle_from_dict(other, 'f')
    for key in ('M', 'M_RB', 'M_A', 'D_linear', 'D_quadratic', 'lift', 'r_G', 'r_B'):
        assert_array_equal(getattr(one, key), getattr(two, key))
    assert (one.weight, one.buoyancy) == (two.weight, two.buoyancy)


@pytest.mark.parametrize(
    ('written', 'value'),
    [('1e-3', 1e-3), ('2E3', 2000.0), ('+1e2', 100.0), ('.5e1', 5.0), ('1.e1', 10.0), ('7', 7.0),
     ('2.5e+1', 25.0)],
)  # fmt: skip
def test_numbers_as_people_write_them(tmp_path, written, value):
    text = text_of('herman2018')
    assert 'gravity: 9.81' in text
    path = tmp_path / 'vehicle.yaml'
    path.write_text(text.replace('gravity: 9.81', f'gravity: {written}'), encoding='utf-8')
    assert load_vehicle(path).weight == pytest.approx(250.0 * value, rel=1e-14)


def test_six_numbers_are_a_diagonal(tmp_path):
    data = yaml.safe_load(text_of('rexrov'))
    six = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    data['added_mass'], data['damping']['linear'] = six, np.diag(six).tolist()
    vehicle = vehicle_from_dict(data, 'f')
    assert_array_equal(vehicle.M_A, np.diag(six))
    assert_array_equal(vehicle.D_linear, np.diag(six))
    assert_array_equal(vehicle.M, vehicle.M_RB + vehicle.M_A)


def test_an_unknown_bare_name_lists_the_shipped_ones():
    with pytest.raises(
        InputError, match=r'herman2019: expected a file, or one of the shipped .*rexrov'
    ):
        load_vehicle('herman2019')


def test_a_bare_name_without_file_does_not_hide_a_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path('rexrov').write_text(text_of('herman2018'), encoding='utf-8')
    assert load_vehicle('rexrov').name == 'herman2018'
