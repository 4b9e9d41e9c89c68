"""What a vehicle file may not say: each error names file, key, expected and found."""

import copy
import re

import numpy as np
import pytest
import yaml

from auv_dynamics import InputError, load_vehicle
from auv_dynamics.files.shipped import shipped

BASE = yaml.safe_load(shipped('vehicles', 'rexrov').read_text(encoding='utf-8'))
TENSOR = 'a 3x3 tensor (kg m2), or inertia_matrix in its place'
SIX = '6 numbers or a 6x6 matrix'


def changed(path: str, value):
    """Rexrov's file with one entry replaced; '' removes it."""
    data = copy.deepcopy(BASE)
    *parents, last = path.split('.')
    node = data
    for key in parents:
        node = node[key]
    if value == '':
        del node[last]
    else:
        node[last] = value
    return data


def matrix(i=0, j=0, value=0.0, diagonal=100.0):
    A = diagonal * np.eye(6)
    A[i, j] = value
    return A.tolist()


def without_inertia(M, **body):
    data = changed('added_mass', '')
    data['rigid_body'] = {'mass': 10.0, 'center_of_gravity': [0.0, 0.0, 0.0]} | body
    return data | {'inertia_matrix': M}


def written(tmp_path, content):
    path = tmp_path / 'odd.yaml'
    text = content if isinstance(content, str) else yaml.safe_dump(content)
    path.write_text(text, encoding='utf-8')
    return path


OFF_CENTRE = {
    'center_of_gravity': [0.0, 0.0, 1.0], 'inertia_reference': 'co',
    'inertia': np.diag([1000.0, 2500.0, 100.0]).tolist(),
}  # fmt: skip

ERRORS = {
    'M not positive definite': (
        without_inertia(matrix(5, 5, -2.0)), 'inertia_matrix',
        'a positive definite inertia M', 'smallest eigenvalue -2'),
    'M singular': (
        without_inertia(matrix(5, 5, 0.0)), 'inertia_matrix',
        'a positive definite inertia M', 'smallest eigenvalue 0'),
    'M_A indefinite': (
        changed('added_mass', [1, 1, 1, 1, 1, -0.5]), 'added_mass',
        'a positive semidefinite matrix', 'smallest eigenvalue -0.5'),
    'M_A with the sign of SNAME': (
        changed('added_mass', [1, 1, 1, 1, 1, 2]) | {'sign': 'sname'}, 'added_mass',
        'a positive semidefinite matrix', 'smallest eigenvalue -2 after sign: sname'),
    'D indefinite': (
        changed('damping.linear', matrix(0, 1, 300.0)), 'damping.linear',
        'a positive semidefinite matrix', 'smallest eigenvalue -50'),
    'volume in litres': (
        changed('hydrostatics.volume', 1838.26), 'hydrostatics.volume',
        'm3 that displace about the mass, 1862.87 kg', '1838.26: litres, or the mass in t?'),
    'mass in g': (
        changed('rigid_body.mass', 1862870.0), 'rigid_body.mass',
        'kg, about the 1889.73 kg of water displaced', '1.86287e+06: g?'),
    'density in g/cm3': (
        changed('environment.water_density', 1.025), 'environment.water_density',
        'kg/m3, such as 1025', '1.025: g/cm3?'),
    'triangle inequality': (
        changed('rigid_body.inertia', np.diag([1.0, 2.0, 3.5]).tolist()), 'rigid_body.inertia',
        'principal moments that satisfy the triangle inequality', 'principal moments 1, 2, 3.5'),
    'inertia indefinite': (
        changed('rigid_body.inertia', np.diag([-1.0, 2.0, 2.0]).tolist()), 'rigid_body.inertia',
        'a positive definite tensor', 'principal moments -1, 2, 2 about the centre of gravity'),
    'inertia about the origin, less than that of its mass there': (
        changed('rigid_body', BASE['rigid_body'] | OFF_CENTRE), 'rigid_body.inertia',
        'a positive definite tensor', 'principal moments -862.9, 100, 637.1 about'),
    'inertia asymmetric': (
        changed('rigid_body.inertia', [[5, 0.1, 0], [0, 5, 0], [0, 0, 5]]), 'rigid_body.inertia',
        'a symmetric matrix', '[0][1] = 0.1 against [1][0] = 0'),
    'added_mass asymmetric': (
        changed('added_mass', matrix(2, 5, 0.11)), 'added_mass',
        'a symmetric matrix', '[2][5] = 0.11 against [5][2] = 0'),
    'inertia_matrix asymmetric': (
        without_inertia(matrix(1, 3, -3.0)), 'inertia_matrix',
        'a symmetric matrix', '[1][3] = -3 against [3][1] = 0'),
    'lift of five': (BASE | {'lift': [1.0] * 5}, 'lift', '6 numbers or a 6x6 matrix', '5 numbers'),
    'unknown key': (
        BASE | {'drag': 1}, 'drag', 'one of format, name, source,', 'an unknown key'),
    'unknown nested key': (
        changed('damping', BASE['damping'] | {'cubic': [0] * 6}), 'damping.cubic',
        'one of linear, quadratic', 'an unknown key'),
    'missing key': (
        changed('damping.quadratic', ''), 'damping.quadratic', SIX, 'nothing'),
    'missing section': (
        changed('hydrostatics', ''), 'hydrostatics',
        'a mapping with volume, center_of_buoyancy', 'nothing'),
    'missing added mass': (changed('added_mass', ''), 'added_mass', SIX, 'nothing'),
    'missing inertia': (changed('rigid_body.inertia', ''), 'rigid_body.inertia', TENSOR, 'nothing'),
    'missing reference': (
        changed('rigid_body.inertia_reference', ''), 'rigid_body.inertia_reference',
        'cg or co', 'nothing'),
    'not a number': (
        changed('rigid_body.mass', float('nan')), 'rigid_body.mass', 'a finite number', 'nan'),
    'infinite': (
        changed('damping.linear', [1, 1, float('inf'), 1, 1, 1]), 'damping.linear[2]',
        'a finite number', 'inf'),
    'five numbers': (
        changed('added_mass', [1, 2, 3, 4, 5]), 'added_mass', SIX, '5 numbers [1, 2, 3, 4, 5]'),
    'word in place of a number': (
        changed('hydrostatics.volume', 'big'), 'hydrostatics.volume',
        'a positive number (m3)', 'big'),
    'truth in place of a number': (
        changed('rigid_body.mass', True), 'rigid_body.mass', 'a positive number (kg)', 'True'),
    'mass of zero': (
        changed('rigid_body.mass', 0), 'rigid_body.mass', 'a positive number (kg)', '0'),
    'both forms of inertia': (
        without_inertia(matrix(0, 0, 100.0)) | {'added_mass': [1] * 6}, 'added_mass',
        'nothing beside inertia_matrix', 'both'),
    'both tensors': (
        without_inertia(matrix(0, 0, 100.0), inertia=np.eye(3).tolist()), 'rigid_body.inertia',
        'nothing beside inertia_matrix', 'both of them'),
    'a reference of no tensor': (
        without_inertia(matrix(0, 0, 100.0), inertia_reference='cg'),
        'rigid_body.inertia_reference', 'nothing beside inertia_matrix', 'both of them'),
    'a misspelt key, which leaves another one missing': (
        BASE | {'environment': {'gravity': 9.81, 'water_densty': 1025.0}},
        'environment.water_densty', 'one of water_density', 'an unknown key'),
    'a word for sign': (BASE | {'sign': 'minus'}, 'sign', 'positive or sname', 'minus'),
    'another format': (BASE | {'format': 2}, 'format', '1', '2'),
    'reference by another name': (
        changed('rigid_body.inertia_reference', 'origin'), 'rigid_body.inertia_reference',
        'cg or co', 'origin'),
}  # fmt: skip


@pytest.mark.parametrize('case', ERRORS)
def test_one_line_names_file_key_expected_and_found(tmp_path, case):
    data, key, expected, found = ERRORS[case]
    path = written(tmp_path, data)
    line = f'{re.escape(f"{path}: {key}: expected {expected}")}.*{re.escape(f", found {found}")}'
    with pytest.raises(InputError, match=f'^{line}') as caught:
        load_vehicle(path)
    assert '\n' not in str(caught.value)
    assert (caught.value.file, caught.value.key) == (str(path), key)


@pytest.mark.parametrize(
    ('text', 'line'),
    [
        ('a: [1', 'line 1, column .*: expected valid YAML'),
        ('name: a\nname: b', 'name: expected each key once, found again in line 2'),
        ('1: a', 'line 1: expected a word as key, found 1'),
        ('- 1', r'expected a mapping with the keys of a vehicle file, found \[1\]'),
        ('', 'expected a mapping with the keys of a vehicle file, found nothing'),
        ('name: 1e400', 'name: expected a finite number, found inf'),
    ],
)
def test_text_that_is_no_vehicle(tmp_path, text, line):
    with pytest.raises(InputError, match=rf'odd\.yaml: {line}'):
        load_vehicle(written(tmp_path, text))


def test_a_file_that_cannot_be_read(tmp_path):
    with pytest.raises(
        InputError, match=r'none\.yaml: expected a vehicle file, found no such file'
    ):
        load_vehicle(tmp_path / 'none.yaml')
    path = tmp_path / 'latin.yaml'
    path.write_bytes(b'name: \xe9')
    with pytest.raises(
        InputError, match=r'latin\.yaml: expected .*, found bytes that are not UTF-8'
    ):
        load_vehicle(path)


@pytest.mark.parametrize(
    'data',
    [
        changed('added_mass', matrix(2, 5, 0.09)),
        changed('rigid_body.inertia', [[5, 0.0049, 0], [0, 5, 0], [0, 0, 5]]),
        without_inertia(matrix(2, 5, 0.09)),
    ],
)
def test_a_small_asymmetry_is_symmetrised_with_a_warning(tmp_path, data):
    vehicle = load_vehicle(written(tmp_path, data))
    assert np.array_equal(vehicle.M, vehicle.M.T)
    assert [line for line in vehicle.warnings if 'odd.yaml' in line and 'symmetrised' in line]


def test_damping_may_be_asymmetric_and_is_kept(tmp_path):
    linear = matrix(0, 5, 30.0)
    vehicle = load_vehicle(written(tmp_path, changed('damping.linear', linear)))
    assert vehicle.D_linear.tolist() == linear


@pytest.mark.parametrize(
    ('data', 'key', 'text'),
    [
        (changed('hydrostatics.volume', 1.75), 'hydrostatics.volume', 'more than 2 % apart'),
        (changed('hydrostatics.volume', 1.95), 'hydrostatics.volume', 'more than 2 % apart'),
        (changed('damping.quadratic', matrix(0, 1, 900.0)), 'damping.quadratic', 'gains energy'),
        (BASE | {'lift': matrix(1, 5, -3.0, -1.0)}, 'lift', '[5][5] = -1: feeds'),
        (changed('source', ''), 'source', 'no source is given'),
        (
            changed('rigid_body.inertia', np.diag([525390.0, 794200.0, 691230.0]).tolist()),
            'rigid_body.inertia',
            'g m2 or kg mm2?',
        ),
        (
            changed('hydrostatics.center_of_buoyancy', [0.0, 0.0, -506.0]),
            'hydrostatics.center_of_buoyancy',
            'mm?',
        ),
        (
            changed('rigid_body.center_of_gravity', [0.0, 0.0, 506.0]),
            'rigid_body.center_of_gravity',
            'mm?',
        ),
    ],
)
def test_what_is_odd_but_usable_is_a_warning(tmp_path, data, key, text):
    data = copy.deepcopy(data)
    data['added_mass'] = [1.0] * 6
    found = load_vehicle(written(tmp_path, data)).warnings
    assert [line for line in found if f'odd.yaml: {key}: ' in line and text in line]
    assert len(found) == 1


def test_nothing_odd_no_warning(tmp_path):
    assert load_vehicle(written(tmp_path, changed('added_mass', [1.0] * 6))).warnings == ()


def test_rounding_makes_no_plate_and_no_thin_body_impossible(tmp_path):
    data = changed('added_mass', [100.0, 1.0, 1.0, 1.0, 1.0, -1e-8])
    data['rigid_body']['inertia'] = np.diag([100.0, 200.0, 300.0 + 1e-7]).tolist()
    assert load_vehicle(written(tmp_path, data)).M_A[5, 5] == -1e-8
