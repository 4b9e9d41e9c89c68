"""A fleet is the vehicles of as many files, and knows which of them would be refused."""

import copy

import numpy as np
import pytest
from helpers.closed_loops import file_of
from helpers.strategies import examples
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from auv_analysis.simulation.variants import fleet, matrices, numbers
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict
from auv_gvc_controller.laws.model import control_model, decompose


def in_sname(file):
    """The same vehicle with the derivatives of SNAME, which have the other sign."""
    data = copy.deepcopy(file) | {'sign': 'sname'}
    for inner, key in (
        (data, 'added_mass'),
        (data, 'lift'),
        *((data['damping'], k) for k in KINDS),
    ):
        inner[key] = (-np.array(inner[key])).tolist()
    return data


KINDS = ('linear', 'quadratic')
FILES = {name: file_of(name) for name in ('rexrov', 'herman2018', 'lauv', 'lrauv_tethys')}
FILES['sname'] = in_sname(FILES['lauv'])
PLACES = {
    'rexrov': [
        ('rigid_body', 'mass'), ('rigid_body', 'center_of_gravity', 1),
        ('rigid_body', 'inertia', 0, 0), ('rigid_body', 'inertia', 2, 2),
        ('added_mass', 0, 0), ('added_mass', 3, 3), ('damping', 'linear', 2),
        ('damping', 'quadratic', 5), ('hydrostatics', 'volume'),
        ('hydrostatics', 'center_of_buoyancy', 2), ('environment', 'gravity'),
        ('environment', 'water_density'),
    ],
    'herman2018': [('rigid_body', 'mass'), ('inertia_matrix', 0, 0), ('inertia_matrix', 5, 5)],
    'lauv': [('rigid_body', 'mass'), ('added_mass', 1, 1), ('damping', 'linear', 1, 1),
             ('lift', 1, 5)],
    'sname': [('added_mass', 1, 1), ('damping', 'linear', 1, 1), ('damping', 'quadratic', 1, 1),
              ('lift', 1, 5)],
    'lrauv_tethys': [('added_mass', 2), ('damping', 'quadratic', 4), ('rigid_body', 'mass')],
}  # fmt: skip


def changed(data, columns, i):
    data = copy.deepcopy(data)
    for keys, values in columns.items():
        *way, last = keys
        inner = data
        for key in way:
            inner = inner[key]
        inner[last] = values[i].tolist()
    return data


def at(data, keys):
    for key in keys:
        data = data[key]
    return data


def there(name):
    """Places of this file that hold numbers: its matrices may be written in either form."""
    found = []
    for keys in PLACES[name]:
        try:
            value = at(FILES[name], keys)
        except (TypeError, IndexError, KeyError):
            continue
        if np.ndim(value) == 0:
            found.append(keys)
    return found


@pytest.mark.parametrize('name', FILES)
@examples(10)
@given(data=st.data())
def test_a_fleet_is_the_vehicles_of_as_many_files(name, data):
    """Bit for bit, and refused where a file is."""
    file, count = FILES[name], data.draw(st.integers(1, 4))
    places = data.draw(st.lists(st.sampled_from(there(name)), unique=True, min_size=1))
    factor = st.sampled_from([1.0, 0.5, 1.1, 3.0, -1.0, 0.0, 40.0, 1e3, 1e-3])
    columns = {
        keys: np.array([at(file, keys) * data.draw(factor) for _ in range(count)])
        for keys in places
    }
    vehicle = vehicle_from_dict(file, 'file')
    found, good = fleet(file, columns, vehicle, count)
    for i in range(count):
        expected, refusal = vehicle_or_refusal(changed(file, columns, i))
        if expected is None:
            # what the schema alone refuses is not the fleet's business
            assert not good[i] or 'a positive number' in refusal
            continue
        assert good[i]
        parts = ('M', 'D_linear', 'D_quadratic', 'weight', 'buoyancy', 'r_G', 'r_B')
        for part in (*parts, 'lift') if 'lift' in file else parts:
            assert_array_equal(getattr(found, part)[i], getattr(expected, part), err_msg=part)
        model, alone = control_model(found.changed(M=found.M[i : i + 1])), control_model(expected)
        for part in ('Upsilon', 'Upsilon_inv', 'N'):
            assert_array_equal(getattr(model, part)[0], getattr(alone, part))
        assert_array_equal(model.dynamics.M_inv[0], alone.dynamics.M_inv)
        forces = found.changed(M=np.eye(6)).model.hydrostatics[i]
        assert_array_equal(forces, alone.dynamics.hydrostatics)


def vehicle_or_refusal(data):
    try:
        return vehicle_from_dict(data, 'file'), ''
    except InputError as error:
        return None, str(error)


def test_there_are_places_in_every_form():
    assert len(there('rexrov')) >= 10
    assert all(there(name) for name in FILES)


@pytest.mark.parametrize('key', [('hydrostatics', 'volume'), ('rigid_body', 'mass')])
def test_units_are_judged_as_in_a_file(key):
    file = FILES['rexrov']
    values = at(file, key) * np.array([1.0, 1e3, 1e-3])
    _, good = fleet(file, {key: values}, vehicle_from_dict(file, 'file'), 3)
    files = [vehicle_or_refusal(changed(file, {key: values}, i))[0] for i in range(3)]
    assert good.tolist() == [one is not None for one in files] == [True, False, False]


def lopsided(*diagonal, above, below=0.0):
    A = np.diag(diagonal).astype(float)
    A[0, 1], A[1, 0] = above, below
    return A


TURNING = lopsided(*[100.0] * 6, above=300.0, below=-300.0)  # it dissipates what it does alone


@pytest.mark.parametrize(
    ('name', 'keys', 'good', 'bad'),
    [
        (
            'rexrov',
            ('rigid_body', 'inertia'),
            lopsided(400, 500, 600, above=0.1),
            lopsided(400, 500, 600, above=50.0),
        ),
        ('rexrov', ('rigid_body', 'inertia'), np.diag([400, 500, 600]), np.diag([0, 500, 500])),
        (
            'rexrov',
            ('added_mass',),
            lopsided(*[800] * 6, above=0.1),
            lopsided(*[800] * 6, above=50.0),
        ),
        ('herman2018', ('inertia_matrix', 0, 1), 0.1, 50.0),
        ('rexrov', ('damping', 'linear'), TURNING, -TURNING),
    ],
)
def test_matrices_are_judged_and_made_symmetric_as_in_a_file(name, keys, good, bad):
    file, columns = FILES[name], {keys: np.array([good, bad])}
    found, accepted = fleet(file, columns, vehicle_from_dict(file, 'file'), 2)
    expected = [vehicle_or_refusal(changed(file, columns, i))[0] for i in range(2)]
    assert accepted.tolist() == [one is not None for one in expected] == [True, False]
    assert_array_equal(found.M[0], expected[0].M)
    assert_array_equal(found.D_linear[0], expected[0].D_linear)


def test_whole_entries():
    file = FILES['rexrov']
    generator = np.random.default_rng(0)
    linear = generator.uniform(10, 20, (3, 6))
    added = np.abs(generator.normal(size=(3, 6, 6)))
    added = added @ np.swapaxes(added, 1, 2)
    columns = {('damping', 'linear'): linear, ('added_mass',): added}
    found, good = fleet(file, columns, vehicle_from_dict(file, 'file'), 3)
    assert good.all()
    for i in range(3):
        expected = vehicle_from_dict(changed(file, columns, i), 'file')
        assert_array_equal(found.D_linear[i], expected.D_linear)
        assert_array_equal(found.M[i], expected.M)


def test_a_single_change_is_made_after_that_of_the_whole():
    columns = {('k', 1): np.array([7.0, 8.0]), ('k',): np.array([[1.0, 2.0], [3.0, 4.0]])}
    assert_array_equal(numbers([0.0, 0.0], columns, ('k',), 2), [[1, 7], [3, 8]])
    assert_array_equal(numbers([5.0, 6.0], {}, ('k',), 2), [[5, 6]])
    assert_array_equal(columns['k',], [[1, 2], [3, 4]])


def test_matrices_of_numbers_diagonals_and_matrices():
    full = np.arange(72.0).reshape(2, 6, 6)
    assert matrices(full) is full
    assert_array_equal(matrices(np.array([2.0, 3.0])), [2 * np.eye(6), 3 * np.eye(6)])
    assert_array_equal(matrices(full[:, 0]), [np.diag(full[0, 0]), np.diag(full[1, 0])])


@examples(15)
@given(seed=st.integers(0, 2**32 - 1), shape=st.sampled_from([(1,), (5,), (2, 3)]))
def test_stacked_matrices_decompose_like_single_ones(seed, shape):
    A = np.random.default_rng(seed).normal(size=(*shape, 6, 6))
    M = A @ np.swapaxes(A, -2, -1) + np.eye(6)
    M = (M + np.swapaxes(M, -2, -1)) / 2
    Upsilon, N = decompose(M)
    for index in np.ndindex(*shape):
        alone = decompose(M[index])
        assert_array_equal(Upsilon[index], alone[0])
        assert_array_equal(N[index], alone[1])
