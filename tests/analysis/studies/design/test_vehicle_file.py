"""A changed vehicle file is the vehicle that the search had in mind, and a vehicle that loads."""

import numpy as np
import pytest
import yaml
from helpers.strategies import QUICK, vectors, vehicles
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from auv_analysis.studies.design.change import NAMES, ChangeSpace, _short, rounded, semi_axes
from auv_analysis.studies.design.setting import changed_data, changed_text
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import parse_yaml, read_yaml
from auv_dynamics.vehicle.vehicle_file import load_vehicle, vehicle_from_dict

FORMS = ('cg', 'co', 'M')
SHIPPED = sorted(path.stem for path in shipped('vehicles', 'rexrov').parent.glob('*.yaml'))


def in_form(data, form):
    """The same vehicle, its inertia given in another way."""
    body = dict(data['rigid_body'])
    r, vehicle = np.array(body['center_of_gravity']), vehicle_from_dict(data, 'x')
    if form == 'co':
        moved = body['mass'] * (r @ r * np.eye(3) - np.outer(r, r))
        body |= {'inertia': (np.array(body['inertia']) + moved).tolist(), 'inertia_reference': 'co'}
    if form == 'M':
        body = {key: body[key] for key in ('mass', 'center_of_gravity')}
        rest = {key: value for key, value in data.items() if key != 'added_mass'}
        return {**rest, 'rigid_body': body, 'inertia_matrix': vehicle.M.tolist()}
    return {**data, 'rigid_body': body}


def within(space, unit):
    """Change at a place (13,) in the unit cube, as a proposal would round it."""
    lower, upper = space.bounds
    return rounded(lower + unit * (upper - lower), space)


def change_at(space, **values):
    x = space.unchanged.copy()
    for name, value in values.items():
        x[NAMES.index(name.replace('_', '.'))] = value
    return x


@QUICK
@given(vehicles(), st.sampled_from(FORMS), vectors(13, 0.5))
def test_the_file_is_the_vehicle_of_the_search(data, form, unit):
    data = in_form(data, form)
    space = ChangeSpace.of(data, 'x')
    x = within(space, unit + 0.5)
    before, after = space.vehicle, vehicle_from_dict(changed_data(space, x), 'x')
    change = space.effect(x)
    assert_allclose(after.M, before.M + change.M, atol=1e-9 * np.abs(after.M).max())
    D = after.D_quadratic - before.D_quadratic
    assert_allclose(D, np.diag(change.drag), atol=1e-9 * np.abs(after.D_quadratic).max())
    assert_allclose(after.D_linear, before.D_linear)
    balance = 1e-9 * before.weight
    assert after.weight - after.buoyancy == pytest.approx(
        before.weight - before.buoyancy, abs=balance
    )
    couples = [v.weight * v.r_G - v.buoyancy * v.r_B for v in (before, after)]
    assert_allclose(couples[1] - couples[0], change.couple, atol=balance)


@QUICK
@given(vehicles(), vectors(3, 0.5), vectors())
def test_a_moved_centre_of_gravity_keeps_the_inertia_about_it(data, unit, nu):
    """Kinetic energy of the rigid body: that of its centre, and that of turning about it."""
    space = ChangeSpace.of(data, 'x')
    whole = np.full(13, 0.5)
    whole[:3] += unit
    x = np.where(np.arange(13) < 3, within(space, whole), 0.0)
    after = vehicle_from_dict(changed_data(space, x), 'x')
    v = nu[:3] + np.cross(nu[3:], space.vehicle.r_G + x[:3])
    turning = nu[3:] @ np.array(data['rigid_body']['inertia']) @ nu[3:]
    energy = space.mass * v @ v + turning
    assert nu @ after.M_RB @ nu == pytest.approx(energy, rel=1e-9, abs=1e-9 * space.mass)


@pytest.mark.parametrize('name', SHIPPED)
def test_shipped_vehicles_change_and_load_again(name, tmp_path):
    path = shipped('vehicles', name)
    space = ChangeSpace.of(read_yaml(path, 'vehicle'), path)
    x = within(space, np.full(13, 0.9))
    data = changed_data(space, x, 'words')
    text = changed_text(data, f'{name}\nin two lines')
    assert text.startswith(f'# {name}\n# in two lines\n')
    (tmp_path / 'v.yaml').write_text(text, encoding='utf-8')
    vehicle = load_vehicle(tmp_path / 'v.yaml')
    assert vehicle.name == f'design_{name}'
    assert vehicle.source.startswith(space.vehicle.source)
    assert vehicle.source.endswith('changed by auv design: words')
    assert np.array_equal(vehicle.M, vehicle_from_dict(data, 'x').M)
    assert parse_yaml(text, 'x', 'vehicle') == data


@pytest.mark.parametrize('form', FORMS)
def test_only_what_changes_is_written_anew(form):
    data = in_form(read_yaml(shipped('vehicles', 'rexrov'), 'vehicle'), form)
    space = ChangeSpace.of(data, 'x')
    assert changed_data(space, space.unchanged) == data
    assert changed_data(space, change_at(space, ballast_x=0.1, disc_azimuth=30.0)) == data
    shifted = changed_data(space, change_at(space, shift_x=0.1))
    assert shifted['rigid_body']['center_of_gravity'] == [0.1, 0.0, 0.0]
    for key in ('hydrostatics', 'damping', 'environment', 'added_mass'):
        assert shifted.get(key) == data.get(key)
    assert shifted['rigid_body'].get('inertia') == data['rigid_body'].get('inertia') or form == 'co'
    dense = changed_data(space, change_at(space, disc_radius=0.2, disc_x=-1.0))
    assert dense['rigid_body'] == data['rigid_body']
    assert np.shape(dense['damping']['quadratic']) == (6,)


def test_a_tensor_about_the_centre_of_gravity_moves_with_it_without_rounding():
    data = read_yaml(shipped('vehicles', 'rexrov'), 'vehicle')
    data['rigid_body']['inertia'] = np.diag([500.0, 600.0, 700.0]).tolist()
    space = ChangeSpace.of(data, 'x')
    x = change_at(space, shift_x=0.011, shift_y=0.022, shift_z=0.044)
    assert (space.mass * x[:3] / space.mass != x[:3]).sum() > 1, 'the centre itself is rounded'
    assert changed_data(space, x)['rigid_body']['inertia'] == data['rigid_body']['inertia']


def test_the_size_of_a_vehicle_is_that_of_its_ellipsoid_and_without_a_tensor_of_its_sphere():
    data = read_yaml(shipped('vehicles', 'rexrov'), 'vehicle')
    mass, axes = data['rigid_body']['mass'], np.array([1.2, 0.7, 0.5])
    tensor = mass / 5 * np.diag((axes**2).sum() - axes**2)
    data['rigid_body'] |= {'inertia': tensor.tolist(), 'center_of_gravity': [0.3, -0.1, 0.2]}
    found = {}
    for form in FORMS:
        one = in_form(data, form)
        found[form], _ = semi_axes(vehicle_from_dict(one, 'x'), one)
    assert_allclose(found['cg'], axes)
    assert_allclose(found['co'], axes)
    assert_allclose(4 / 3 * np.pi * found['M'] ** 3, data['hydrostatics']['volume'])


def test_a_body_without_a_height_has_a_twentieth_of_its_length():
    data = read_yaml(shipped('vehicles', 'rexrov'), 'vehicle')
    mass, axes = data['rigid_body']['mass'], np.array([1.2, 0.7, 0.001])
    tensor = mass / 5 * np.diag((axes**2).sum() - axes**2)
    data['rigid_body']['inertia'] = tensor.tolist()
    found, _ = semi_axes(vehicle_from_dict(data, 'x'), data)
    assert_allclose(found, [1.2, 0.7, 0.06])


def test_a_disc_is_no_larger_than_the_vehicle_and_what_turns_over_shall_not_rise():
    data = read_yaml(shipped('vehicles', 'rexrov'), 'vehicle')
    data['added_mass'] = [1e7, 1e7, 1e7, 1e3, 1e3, 1e3]
    data['rigid_body']['center_of_gravity'] = [0.0, 0.0, -1.0]
    space = ChangeSpace.of(data, 'x')
    found = {one.name: one for one in space.parameters}
    assert found['disc.radius'].upper == _short(semi_axes(space.vehicle, data)[0].mean())
    assert (found['shift.z'].lower, found['shift.z'].upper > 0.0) == (0.0, True)
    assert found['shift.z'].reason.endswith('upwards: no less stable')


@pytest.mark.parametrize(
    ('bound', 'short'),
    [(0.123456, 0.1234), (-0.123456, -0.1234), (1239.9, 1239.0), (0.0, 0.0), (2e-5, 2e-5),
     (-98765.0, -98760.0)],
)  # fmt: skip
def test_a_bound_is_cut_towards_zero_to_four_digits(bound, short):
    assert _short(bound) == pytest.approx(short, rel=1e-12)


def test_a_change_is_as_large_as_its_parts_are_near_their_bounds():
    space = ChangeSpace.of(read_yaml(shipped('vehicles', 'bluerov2'), 'vehicle'), 'x')
    lower, upper = space.bounds
    places = [i for i, name in enumerate(NAMES) if i > 2 and name[-2:] in ('.x', '.y', '.z')]
    middle = np.where(np.isin(np.arange(13), places), (lower + upper) / 2, 0.0)
    assert space.size(middle) == pytest.approx(0.0)
    for changes, size in (
        ({'ballast.mass': 1.0}, 1.0), ({'ballast.mass': 0.5}, 0.5), ({'disc.radius': 1.0}, 1.0),
        ({'disc.radius': 0.5}, 1 / 8), ({'shift.x': 1.0}, 1 / 3), ({'shift.y': 0.5}, 1 / 12),
        ({'disc.azimuth': 1.0}, 0.0), ({'ballast.mass': 0.5, 'shift.x': 1.0}, 0.5 + 1 / 3),
    ):  # fmt: skip
        x = middle.copy()
        for name, share in changes.items():
            x[NAMES.index(name)] = share * upper[NAMES.index(name)]
        assert space.size(x) == pytest.approx(size), changes
    aside = ChangeSpace.of(space.data, 'x', [('disc.y', -0.3, 0.1)])
    x = middle.copy()
    x[NAMES.index('disc.y')] = 0.1  # 0.2 m from the middle, of 0.3 m at most
    assert aside.size(x) == pytest.approx(0.2 * (2 / 3) ** 2 / 6)
    held = ChangeSpace.of(space.data, 'x', [('ballast.mass', 0.0, 0.0)])
    assert held.size(middle) == pytest.approx(0.0)


def test_where_hardly_anything_rights_a_vehicle_its_length_does():
    data = read_yaml(shipped('vehicles', 'bluerov2'), 'vehicle')
    data['rigid_body']['center_of_gravity'] = data['hydrostatics']['center_of_buoyancy'] = [0.0] * 3
    space = ChangeSpace.of(data, 'x')
    length = semi_axes(space.vehicle, data)[0].mean()
    found = space.hydrostatic_penalty(change_at(space, shift_x=0.01))
    assert found == pytest.approx((0.01 / (0.01 * length)) ** 2)


def test_the_stability_that_must_be_left_is_left():
    for name in SHIPPED:
        path = shipped('vehicles', name)
        space = ChangeSpace.of(read_yaml(path, 'vehicle'), path)
        x = change_at(space, shift_z=space.bounds[0][2])
        couples = [
            vehicle.weight * vehicle.r_G[2] - vehicle.buoyancy * vehicle.r_B[2]
            for vehicle in (space.vehicle, vehicle_from_dict(changed_data(space, x), 'x'))
        ]
        assert couples[1] >= 0.5 * couples[0] * (1 - 1e-9)


def test_foam_carries_the_ballast():
    data = yaml.safe_load(shipped('vehicles', 'bluerov2').read_text())
    space = ChangeSpace.of(data, 'x')
    after = changed_data(space, change_at(space, ballast_mass=0.5, ballast_x=0.1))
    foam = after['hydrostatics']['volume'] - data['hydrostatics']['volume']
    assert foam * space.density == pytest.approx(0.5)
    assert after['rigid_body']['mass'] == pytest.approx(data['rigid_body']['mass'] + 0.5)


def test_what_is_worse_at_rest():
    space = ChangeSpace.of(read_yaml(shipped('vehicles', 'bluerov2'), 'vehicle'), 'x')
    couple = space.vehicle.weight * space.vehicle.r_G - space.vehicle.buoyancy * space.vehicle.r_B
    rights = couple[2]
    assert rights > 0
    assert space.hydrostatic_penalty(space.unchanged) == 0.0
    for sign in (-1, 1):
        for name in ('shift_x', 'shift_y'):
            x = change_at(space, **{name: 0.01 * sign})
            turned = (space.vehicle.weight * 0.01 / rights) ** 2
            assert space.hydrostatic_penalty(x) == pytest.approx(turned, rel=1e-9)
    assert space.hydrostatic_penalty(change_at(space, shift_z=0.01)) == 0.0
    lost = space.hydrostatic_penalty(change_at(space, shift_z=-0.01))
    assert lost == pytest.approx((space.vehicle.weight * 0.01 / rights) ** 2)
    trimmed = change_at(space, ballast_mass=0.5, ballast_x=0.1, disc_radius=0.05)
    assert space.hydrostatic_penalty(trimmed) == 0.0


def test_a_vehicle_that_comes_nearer_to_level_is_better_at_rest():
    space = ChangeSpace.of(read_yaml(shipped('vehicles', 'herman2018'), 'vehicle'), 'x')
    aft, forward = (space.hydrostatic_penalty(change_at(space, shift_x=d)) for d in (-0.04, 0.04))
    assert aft < 0 < forward
