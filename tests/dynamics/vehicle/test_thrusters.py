"""Thrusters: the matrix T, allocation within limits, what a vehicle file may not say of them."""

import copy
import itertools
import re

import numpy as np
import pytest
import yaml
from helpers.strategies import QUICK, vectors
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics import InputError, load_vehicle
from auv_dynamics.files.shipped import shipped
from auv_dynamics.vehicle.thrusters import Thrusters, thrusters_of
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict

HEAVY = yaml.safe_load(shipped('vehicles', 'bluerov2_heavy').read_text(encoding='utf-8'))
COMPASS = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
CORNERS = [[0, 1, 0], [0, 0, 1], [1, 0, 0], [0, -1, 0], [0, 0, -1], [-1, 0, 0]]


def entry(name='T', position=(0, 0, 0), direction=(1, 0, 0), limit=10.0):
    return {
        'name': name, 'position': list(position), 'direction': list(direction), 'limit': limit
    }  # fmt: skip


def built(*entries):
    return thrusters_of(entries, 'f')[0]


@st.composite
def sets(draw, least=6):
    """Thrusters of any place and direction; six of them span all wrenches."""
    spots = [*zip(CORNERS, COMPASS, strict=True)][:least]
    entries = []
    for i in range(draw(st.integers(least, 10))):
        r, e = spots[i] if i < len(spots) else (draw(vectors(3)), draw(vectors(3, 1.0)))
        e = np.asarray(e, float) + (0.2 * draw(vectors(3, 1.0)))
        assume(np.linalg.norm(e) > 0.1)
        limit = [draw(st.floats(1.0, 100.0)), draw(st.floats(1.0, 100.0))]
        entries.append(entry(f'T{i}', np.asarray(r, float), e / np.linalg.norm(e), limit))
    thrusters = built(*entries)
    if least == 6:
        assume(np.linalg.cond(thrusters.matrix) < 1e3)
    return thrusters


@QUICK
@given(sets(least=1))
def test_the_largest_wrench_of_an_axis_is_that_of_all_thrusters_at_their_limits(thrusters):
    limits = zip(-thrusters.reverse, thrusters.forward, strict=True)
    wrenches = np.array(list(itertools.product(*limits))) @ thrusters.matrix.T
    assert_allclose(thrusters.largest(), np.abs(wrenches).max(axis=0), rtol=1e-9, atol=1e-9)


@QUICK
@given(vectors(3), vectors(3, 1.0), vectors(6), st.floats(-50, 50))
def test_a_column_does_the_work_that_its_thruster_does(r, e, nu, u):
    assume(np.linalg.norm(e) > 0.1)
    e = e / np.linalg.norm(e)
    tau = built(entry(position=r, direction=e)).matrix[:, 0] * u
    velocity = nu[:3] + np.cross(nu[3:], r)  # of the water past the thruster
    assert nu @ tau == pytest.approx(u * (e @ velocity), abs=1e-9)


@QUICK
@given(sets(), vectors(6, 1e-3))
def test_a_wrench_within_the_limits_is_delivered(thrusters, tau):
    assert thrusters.rank == 6
    assert thrusters.unactuated() == {}
    assert_allclose(thrusters.matrix @ thrusters.inverse @ tau, tau, rtol=0, atol=1e-12)
    u, delivered = thrusters.allocate(tau)
    if np.all(np.abs(u) < 1.0):  # the smallest limit drawn
        assert_allclose(delivered, tau, rtol=0, atol=1e-12)


@QUICK
@given(sets(), vectors(6, 1e4))
def test_limits_hold_and_the_direction_stays(thrusters, tau):
    u, delivered = thrusters.allocate(tau)
    assert (u <= thrusters.forward * (1 + 1e-12)).all()
    assert (u >= -thrusters.reverse * (1 + 1e-12)).all()
    assert_allclose(delivered, thrusters.matrix @ u, rtol=0, atol=0)
    size = np.linalg.norm(tau)
    factor = delivered @ tau / max(size**2, 1e-300)
    assert 0 <= factor <= 1 + 1e-9
    assert_allclose(delivered, factor * tau, rtol=0, atol=1e-9 * max(size, 1.0))
    if factor < 1 - 1e-9 and size > 0:  # scaled no more than needed: one thruster is at its limit
        limit = np.where(u < 0, thrusters.reverse, thrusters.forward)
        assert np.max(np.abs(u) / limit) == pytest.approx(1.0, rel=1e-12)


@QUICK
@given(sets(least=1), vectors(6))
def test_too_few_thrusters_deliver_the_nearest_wrench(thrusters, tau):
    wide = Thrusters(thrusters.names, thrusters.matrix, *(np.full(len(thrusters.names), 1e9),) * 2)
    assume(np.linalg.cond(wide.matrix[:, :1]) < 1e3 and np.abs(wide.inverse).max() < 1e3)
    _, delivered = wide.allocate(tau)
    assert_allclose(
        wide.matrix.T @ (tau - delivered), 0, atol=1e-6
    )  # what is missing is out of reach
    assert wide.rank + len(wide.unactuated()) == 6


def test_reverse_and_forward_are_two_limits():
    one = built(entry(limit=[2.0, 5.0]))
    assert [one.allocate([way * 100.0, 0, 0, 0, 0, 0])[0][0] for way in (1, -1)] == [5.0, -2.0]
    both = built(entry(limit=3.0))
    assert [both.allocate([way * 100.0, 0, 0, 0, 0, 0])[0][0] for way in (1, -1)] == [3.0, -3.0]


def test_all_are_scaled_by_one_factor():
    pair = built(
        entry('port', (0, -0.5, 0), limit=10.0), entry('starboard', (0, 0.5, 0), limit=[10.0, 4.0])
    )
    u, delivered = pair.allocate([12.0, 0, 0, 0, 0, 3.0])  # asks for 9 N and 3 N
    assert_allclose(u, [9.0, 3.0], atol=1e-12)
    u, delivered = pair.allocate([12.0, 0, 0, 0, 0, -3.0])  # 3 N and 9 N of 4 N
    assert_allclose(u, [3.0 * 4 / 9, 4.0], atol=1e-12)
    assert_allclose(delivered, np.array([12.0, 0, 0, 0, 0, -3.0]) * 4 / 9, atol=1e-12)


def test_the_argument_is_not_changed():
    tau = np.array([1e6, 0, 0, 0, 0, 0])
    load_vehicle('bluerov2_heavy').thrusters.allocate(tau)
    assert_array_equal(tau, [1e6, 0, 0, 0, 0, 0])


# the shipped ones, by what anybody can see at the vehicle


def pushed(name, *thrusters):
    found = load_vehicle(name).thrusters
    return found.matrix @ np.isin(found.names, thrusters).astype(float)


@pytest.mark.parametrize(
    ('thrusters', 'axis', 'sign'),
    [
        (('T1', 'T2'), 0, -1),  # the front pair pushes aft
        (('T3', 'T4'), 0, 1),
        (('T1', 'T3'), 1, 1),  # those on starboard push to starboard
        (('T2', 'T4'), 1, -1),
        (('T1', 'T4'), 5, 1),  # a diagonal turns the bow to starboard
        (('T2', 'T3'), 5, -1),
    ],
)
@pytest.mark.parametrize('name', ['bluerov2', 'bluerov2_heavy'])
def test_horizontal_thrusters_of_the_bluerov2(name, thrusters, axis, sign):
    tau = pushed(name, *thrusters)
    assert sign * tau[axis] > 0.1
    others = [i for i in (0, 1, 5) if i != axis]
    assert_allclose(tau[others], 0, atol=0.02)  # the front arm of bluerov2 is a little shorter


def test_vertical_thrusters_of_the_bluerov2_heavy():
    assert pushed('bluerov2_heavy', 'T5', 'T6', 'T7', 'T8').round(12).tolist() == [0, 0, 4, 0, 0, 0]
    assert pushed('bluerov2_heavy', 'T5', 'T7')[3] == pytest.approx(2 * 0.218)  # starboard down
    assert pushed('bluerov2_heavy', 'T5', 'T6')[4] == pytest.approx(-2 * 0.12)  # bow down
    assert pushed('bluerov2', 'T5')[3] > 0.1
    assert pushed('bluerov2', 'T6')[3] < -0.1


def test_arms_of_the_bluerov2_heavy_are_those_of_its_allocation_matrix():
    T = np.abs(load_vehicle('bluerov2_heavy').thrusters.matrix)
    assert_allclose(T[5, :4], 0.1888, atol=5e-5)
    assert_allclose(T[:2, :4], 0.7071, atol=5e-5)
    assert_allclose(T[3, 4:], 0.218)
    assert_allclose(T[4, 4:], 0.12)


def test_the_bluerov2_heavy_has_six_degrees_of_freedom_and_the_bluerov2_five():
    heavy, light = load_vehicle('bluerov2_heavy'), load_vehicle('bluerov2')
    assert (len(heavy.thrusters.names), heavy.thrusters.rank) == (8, 6)
    assert heavy.warnings == ()
    assert (len(light.thrusters.names), light.thrusters.rank) == (6, 5)
    assert list(light.thrusters.unactuated()) == ['pitch']
    assert np.abs(light.thrusters.inverse).max() < 10  # rounding does not count as a sixth axis


# files


def changed(i=0, **entries):
    data = copy.deepcopy(HEAVY)
    data['thrusters'][i] |= entries
    return data


ERRORS = {
    'twice': (changed(3, name='T2'), 'thrusters[3].name', 'each name once', 'T2 again'),
    'no direction': (
        changed(2, direction=[0, 0, 0]), 'thrusters[2].direction', 'a direction that is not zero',
        '[0.0, 0.0, 0.0]'),
    'no limit': (
        changed(1, limit=0), 'thrusters[1].limit', 'a positive number or [reverse, forward] (N)',
        '0'),
    'negative reverse': (
        changed(1, limit=[-40.2, 51.5]), 'thrusters[1].limit',
        'a positive number or [reverse, forward] (N)', '2 numbers [-40.2, 51.5]'),
    'three limits': (
        changed(1, limit=[1, 2, 3]), 'thrusters[1].limit',
        'a positive number or [reverse, forward] (N)', '3 numbers [1, 2, 3]'),
    'a word': (
        changed(0, limit=['strong', 1]), 'thrusters[0].limit[0]', 'a positive number (N)',
        'strong'),
    'two coordinates': (
        changed(0, position=[0, 1]), 'thrusters[0].position', '3 numbers (m)', '2 numbers [0, 1]'),
    'not finite': (
        changed(0, direction=[float('nan'), 0, 1]), 'thrusters[0].direction[0]',
        'a finite number', 'nan'),
    'unknown key': (
        changed(4, gain=1.0), 'thrusters[4].gain', 'one of name, position, direction, limit',
        'an unknown key'),
    'none': (HEAVY | {'thrusters': []}, 'thrusters', 'a list of at least one thruster', '[]'),
    'a mapping': (
        HEAVY | {'thrusters': {'T1': 1}}, 'thrusters', 'a list of at least one thruster', 'T1'),
}  # fmt: skip


@pytest.mark.parametrize('case', ERRORS)
def test_one_line_names_file_key_expected_and_found(case):
    data, key, expected, found = ERRORS[case]
    line = f'{re.escape(f"odd.yaml: {key}: expected {expected}")}.*{re.escape(found)}'
    with pytest.raises(InputError, match=f'^{line}') as caught:
        vehicle_from_dict(data, 'odd.yaml')
    assert '\n' not in str(caught.value)
    assert caught.value.key == key


@pytest.mark.parametrize('key', ['name', 'position', 'direction', 'limit'])
def test_each_key_is_needed(key):
    data = copy.deepcopy(HEAVY)
    del data['thrusters'][5][key]
    with pytest.raises(InputError, match=rf'thrusters\[5\]\.{key}: expected .*, found nothing'):
        vehicle_from_dict(data, 'odd.yaml')


@pytest.mark.parametrize(('length', 'warned'), [(0.5, True), (0.985, True), (0.995, False)])
def test_a_direction_is_normalised_and_a_wrong_length_is_a_warning(length, warned):
    vehicle = vehicle_from_dict(changed(4, direction=[0, 0, length]), 'odd.yaml')
    assert_array_equal(vehicle.thrusters.matrix, load_vehicle('bluerov2_heavy').thrusters.matrix)
    lines = [w for w in vehicle.warnings if 'thrusters[4].direction' in w]
    assert len(lines) == len(vehicle.warnings) == warned


def test_axes_that_cannot_be_actuated_are_a_warning():
    level = copy.deepcopy(HEAVY)
    level['thrusters'] = level['thrusters'][:4]
    for thruster in level['thrusters']:
        thruster['position'][2] = 0.0
    (line,) = vehicle_from_dict(level, 'odd.yaml').warnings
    assert line.startswith('odd.yaml: thrusters: T has rank 3 of 6: ')
    for dof in ('heave', 'roll', 'pitch'):
        assert f'{dof} cannot be actuated' in line
    assert 'apart' not in line
    (line,) = load_vehicle('bluerov2').warnings
    assert line.endswith('T has rank 5 of 6: pitch cannot be actuated apart from surge and heave')


def test_thrusters_are_optional():
    data = copy.deepcopy(HEAVY)
    del data['thrusters']
    assert vehicle_from_dict(data, 'f').thrusters is None
