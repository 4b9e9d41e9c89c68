"""The shipped vehicles beside the paper's: the numbers of their sources, signs and frames."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics import load_vehicle
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import matrix6

FOLDER = shipped('vehicles', 'herman2018').parent
OURS = ('herman2018', 'herman2018_neutral')
CITED = ('bluerov2', 'bluerov2_heavy', 'girona500', 'lauv', 'lrauv_tethys', 'rexrov')
LAUV_LINEAR = {(1, 5): 11.5, (2, 4): -11.5, (4, 2): 3.1, (5, 1): -3.1}  # SNAME: Y_r Z_q M_w N_v
LAUV_LIFT = {(1, 5): 3.84, (2, 4): -3.84, (4, 2): -6.0, (5, 1): 6.0}  # of dune
LAUV_QUADRATIC = {(1, 5): 0.3, (2, 4): -0.3, (4, 2): 1.5, (5, 1): -1.5}

# mass, weight and buoyancy in N, z_G - z_B, diagonals of M_A, D_linear, D_quadratic
FACTS = {
    'bluerov2': (
        11.5, 112.8, 114.8, 0.02, [5.5, 12.7, 14.57, 0.12, 0.12, 0.12],
        [4.03, 6.22, 5.18, 0.07, 0.07, 0.07], [18.18, 21.66, 36.99, 1.55, 1.55, 1.55]),
    'bluerov2_heavy': (
        13.5, 132.57, 131.588, 0.01, [6.36, 7.12, 18.68, 0.189, 0.135, 0.222],
        [13.7, 0, 33.0, 0, 0.8, 0], [141, 217, 190, 1.19, 0.47, 1.5]),
    'lauv': (
        18.0, 176.58, 177.0, 0.01, [1, 16, 16, 0.005, 1.3, 1.3], [2.4, 23, 23, 0.3, 9.7, 9.7],
        [2.4, 80, 80, 0.0006, 9.1, 9.1]),
    'lrauv_tethys': (
        146.5671, 1437.823, 1437.823, 0.007, [4.876161, 126.324739, 126.324739, 0, 33.46, 33.46],
        [0] * 6, [6.2282, 601.27, 601.27, 0.1916, 632.698957, 632.698957]),
    'girona500': (
        98.0, 961.38, 1000 * 9.81 * 4 / 3 * np.pi * 0.286**3, 0.05, [49, 49, 49, 0, 0, 0],
        [0, 0, 0, 130, 130, 130], [148, 148, 148, 180, 180, 180]),
}  # fmt: skip

WARNINGS = {
    'herman2018': ['weight 2452.5 N and buoyancy 3531.6 N are more than 2 % apart'],
    'rexrov': ['[2][5] = 10.774 and [5][2] = 10.775: symmetrised'],
    'bluerov2': ['T has rank 5 of 6: pitch cannot be actuated apart from surge and heave'],
}


def test_the_eight_vehicles_are_shipped():
    assert sorted(path.stem for path in FOLDER.glob('*.yaml')) == sorted(OURS + CITED)


@pytest.mark.parametrize('name', OURS + CITED)
def test_only_warnings_of_the_source_remain(name):
    texts = [line.split(': ', 2)[2] for line in load_vehicle(name).warnings]
    assert texts == WARNINGS.get(name, [])


@pytest.mark.parametrize('name', FACTS)
def test_numbers_of_the_source(name):
    mass, weight, buoyancy, height, M_A, D_linear, D_quadratic = FACTS[name]
    vehicle = load_vehicle(name)
    assert vehicle.M_RB[0, 0] == mass
    assert vehicle.weight == pytest.approx(weight, rel=2e-4)
    assert vehicle.buoyancy == pytest.approx(buoyancy, rel=1e-5)
    assert vehicle.r_G[2] - vehicle.r_B[2] == pytest.approx(height)
    assert_array_equal(vehicle.M_A, np.diag(M_A))
    assert_array_equal(np.diag(vehicle.D_linear), D_linear)
    assert_array_equal(np.diag(vehicle.D_quadratic), D_quadratic)


@pytest.mark.parametrize('name', CITED)
def test_every_number_has_its_source_in_a_comment(name):
    lines = (FOLDER / f'{name}.yaml').read_text(encoding='utf-8').splitlines()
    assert lines[0] == (
        '# yaml-language-server: '
        '$schema=../../src/auv_dynamics/auv_dynamics/vehicle/vehicle.schema.json'
    )
    keys = ('mass', 'center_of_gravity', 'inertia', 'volume', 'center_of_buoyancy', 'added_mass',
            'damping', 'environment', 'thrusters')  # fmt: skip
    for i, line in enumerate(lines):
        if line.strip().startswith(tuple(f'{key}:' for key in keys)):
            assert '#' in line or lines[i - 1].startswith('#'), line
    assert len(load_vehicle(name).source) > 40


@pytest.mark.parametrize('name', CITED)
def test_an_upright_vehicle_rights_itself(name):
    """The weight hangs below the buoyancy: g, on the left of (1), grows with the angle."""
    vehicle = load_vehicle(name)
    for axis in (3, 4):
        eta = np.zeros(6)
        eta[axis] = 0.1
        assert vehicle.g(eta)[axis] > 0


@pytest.mark.parametrize('name', CITED)
def test_damping_takes_energy(name):
    vehicle = load_vehicle(name)
    generator = np.random.default_rng(1)
    for nu in generator.normal(size=(200, 6)) * generator.choice([0.01, 1.0, 3.0], size=(200, 6)):
        assert nu @ vehicle.D(nu) @ nu > 0


def test_the_bluerov2_floats():
    """The swapped pair of a popular file would make it sink."""
    vehicle = load_vehicle('bluerov2')
    assert vehicle.buoyancy - vehicle.weight == pytest.approx(2.0, abs=0.02)
    tensor = vehicle.M_RB[3:, 3:]  # about the origin, as the source writes M_RB
    assert_allclose(tensor, 0.16 * np.eye(3), atol=1e-15)
    assert vehicle.M_RB[0, 4] == pytest.approx(11.5 * 0.02)


def test_the_tethys_is_neutral():
    vehicle = load_vehicle('lrauv_tethys')
    assert abs(vehicle.buoyancy - vehicle.weight) < 1e-3
    assert_array_equal(np.diag(vehicle.M_RB)[3:], [3.0, 41.980233, 41.980233])


def test_M_of_the_girona500_is_that_of_its_file():
    M = np.diag([147.0, 147.0, 147.0, 8.0, 8.0, 8.0])
    M[0, 4] = M[4, 0] = 4.9
    M[1, 3] = M[3, 1] = -4.9
    assert_allclose(load_vehicle('girona500').M, M, atol=1e-14)


# LAUV: signs of the off-diagonal damping


def test_damping_of_the_lauv_is_minus_the_sname_derivatives():
    vehicle = load_vehicle('lauv')
    for D, derivatives in (
        (vehicle.D_linear, LAUV_LINEAR),
        (vehicle.D_quadratic, LAUV_QUADRATIC),
        (vehicle.lift, LAUV_LIFT),
    ):
        coupled = D - np.diag(np.diag(D))
        assert {(i, j): -coupled[i, j] for i, j in zip(*np.nonzero(coupled), strict=True)} == (
            derivatives
        )


def test_the_same_lauv_written_with_sname_signs(tmp_path):
    data = yaml.safe_load((FOLDER / 'lauv.yaml').read_text(encoding='utf-8'))
    data['sign'] = 'sname'
    data['added_mass'] = [-value for value in data['added_mass']]
    for key, derivatives in (('linear', LAUV_LINEAR), ('quadratic', LAUV_QUADRATIC)):
        D = -np.diag(np.diag(matrix6(data['damping'][key])))
        for place, value in derivatives.items():
            D[place] = value
        data['damping'][key] = D.tolist()
    data['lift'] = (-np.array(data['lift'])).tolist()
    path = tmp_path / 'lauv.yaml'
    path.write_text(yaml.safe_dump(data), encoding='utf-8')
    one, other = load_vehicle('lauv'), load_vehicle(Path(path))
    for key in ('M', 'D_linear', 'D_quadratic', 'lift'):
        assert_array_equal(getattr(one, key), getattr(other, key))


def test_pitch_of_the_lauv_mirrors_its_yaw():
    """Turned by a quarter about its axis, a body of revolution is the same."""
    quarter = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    Q = np.kron(np.eye(2), quarter)
    vehicle = load_vehicle('lauv')
    assert_allclose(Q @ vehicle.D_linear @ Q.T, vehicle.D_linear, atol=1e-14)
    assert_allclose(Q @ vehicle.M @ Q.T, vehicle.M, atol=1e-14)
    nu = np.array([1.0, 0.3, -0.2, 0.1, 0.5, -0.4])
    assert_allclose(Q @ vehicle.D(nu) @ nu, vehicle.D(Q @ nu) @ (Q @ nu), atol=1e-13)


def test_the_sway_force_of_the_lauv_acts_behind_its_origin():
    """Turning about a point half a metre ahead, the tail sees no cross flow on the average."""
    vehicle = load_vehicle('lauv')
    force = -vehicle.D_linear @ np.array([0, 0.5, 0, 0, 0, 1.0])  # v = 0.5 r: still at x = -0.5
    assert force[1] == pytest.approx(0.0, abs=1e-12)
    force = -vehicle.D_linear @ np.array([0, 0, 0.5, 0, -1.0, 0])
    assert force[2] == pytest.approx(0.0, abs=1e-12)


def sway_yaw_poles(vehicle, u, sign=1.0, lift=0.0):
    """Poles of (v, r) about straight motion at u with linear damping; sign of its couplings."""
    D = np.diag(np.diag(vehicle.D_linear))
    D += sign * (vehicle.D_linear - D) + lift * u * vehicle.lift
    small = 1e-6

    def rate(v, r):
        nu = np.array([u, v, 0, 0, 0, r])
        return -np.linalg.solve(vehicle.M, vehicle.C(nu) @ nu + D @ nu)[[1, 5]] / small

    return np.linalg.eigvals(np.stack([rate(small, 0), rate(0, small)], axis=1))


def test_the_lauv_keeps_its_course_at_1_m_s_and_with_the_other_signs_would_not():
    vehicle = load_vehicle('lauv')
    assert sway_yaw_poles(vehicle, 1.0).real.max() < 0
    assert sway_yaw_poles(vehicle, 1.0, sign=-1.0).real.max() > 0


def test_lift_keeps_the_lauv_on_its_course_up_to_its_top_speed():
    vehicle = load_vehicle('lauv')
    assert sway_yaw_poles(vehicle, 2.0).real.max() > 1.0
    assert sway_yaw_poles(vehicle, 2.0, lift=1.0).real.max() < -0.5


def test_the_fins_of_the_lrauv_act_behind_its_origin():
    """A fin at x = -1.05 m sees v + x r and w - x q: no force where these vanish."""
    vehicle, k = load_vehicle('lrauv_tethys'), 1025 / 2 * 4.13 * 0.0244
    for sideways in ([0, 1.05, 0, 0, 0, 1.0], [0, 0, 1.05, 0, -1.0, 0]):
        assert_allclose(vehicle.lift @ sideways, 0.0, atol=0.01)
    assert_allclose(vehicle.lift[1, 1], k, rtol=1e-3)
    assert sway_yaw_poles(vehicle, 1.0, lift=1.0).real.max() < (
        0.2 * sway_yaw_poles(vehicle, 1.0).real.max()
    )
