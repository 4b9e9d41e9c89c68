"""Hulls of meshes: added mass against exact values, frames and units, and what is refused."""

import json
import re
from contextlib import nullcontext
from importlib.util import find_spec

import numpy as np
import pytest
import trimesh
from helpers.needs import needing
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad

from auv_analysis.cli.main import main
from auv_analysis.formats import mesh_import
from auv_dynamics import load_vehicle
from auv_dynamics.vehicle.vehicle import skew

pytestmark = needing('capytaine', find_spec('capytaine'))

RHO = 1000.0
ERROR = 0.02  # of the inertia of hull and water, which the refinement ends at


@pytest.fixture
def imported(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def run(mesh, *options, name='hull.stl', mass=None, units='m', axes='fsd'):
        mesh.export(name)
        mass = RHO * abs(mesh.volume) if mass is None else mass
        said = ['--mass', str(mass), '--water-density', str(RHO), '--units', units, '--axes', axes]
        main(['import-vehicle', name, *said, *options, '--out', 'a.yaml', '--overwrite', '--json'])
        return load_vehicle(tmp_path / 'a.yaml'), json.loads(capsys.readouterr().out)

    return run


@pytest.fixture
def refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def run(mesh, *options):
        mesh.export('hull.stl')
        with pytest.raises(SystemExit) as raised:
            main(['import-vehicle', 'hull.stl', *options])
        assert raised.value.code == 2
        line = capsys.readouterr().err.strip()
        assert line.startswith('hull.stl: ')
        assert '\n' not in line
        return line

    return run


@pytest.fixture
def dry(monkeypatch):
    """Hulls without added mass, which takes the time."""
    nothing = np.zeros((6, 6))
    monkeypatch.setattr(mesh_import, 'converged', lambda *_: (nothing, nothing, 0))


@pytest.fixture
def rough(monkeypatch):
    """Options for a base and a tolerance that take little time, the formulas the same."""
    monkeypatch.setattr(mesh_import, 'SMALLEST_BASE', 20)
    return '--tolerance', '0.2'


def sphere(subdivisions=3, radius=1.0, at=(0.0, 0.0, 0.0)):
    """A mesh of the sphere's volume."""
    mesh = trimesh.creation.icosphere(subdivisions)
    mesh.apply_scale(radius * (4 / 3 * np.pi / mesh.volume) ** (1 / 3))
    return mesh.apply_translation(at)


def assert_within(M_A, exact, hull, error):
    """Entries agree but for a share of the inertia that a floating hull has with its water."""
    own = RHO * np.concatenate([[hull.volume] * 3, np.diagonal(hull.moment_inertia)])
    size = np.sqrt(np.diagonal(exact) + own)
    assert np.max(np.abs(M_A - exact) / np.outer(size, size)) < error


def test_sphere_has_half_of_the_displaced_mass(imported, rough):
    hull = sphere()
    vehicle, document = imported(hull, *rough)
    assert document['format'] == 'mesh'
    assert_within(vehicle.M_A, RHO * hull.volume / 2 * np.diag([1, 1, 1, 0, 0, 0]), hull, ERROR)
    assert vehicle.buoyancy == pytest.approx(RHO * 9.81 * 4 / 3 * np.pi)
    assert_allclose(
        document['vehicle']['rigid_body']['inertia'],
        np.diag(RHO * np.diagonal(hull.moment_inertia)),
        rtol=1e-6,
        atol=1e-3,
    )
    assert any('± ' in text for text in document['traps'])
    assert any('damping: zero' in text for text in document['assumed'])


def ellipsoid_added_mass(axes):
    """Lamb 1932, sections 114 and 115: diagonal M_A of an ellipsoid of these semi-axes."""
    squares, volume = np.square(axes), 4 / 3 * np.pi * np.prod(axes)

    def integrand(x, square):
        return np.prod(axes) / ((square + x) * np.sqrt(np.prod(squares + x)))

    alpha = np.array([quad(integrand, 0, np.inf, args=(square,))[0] for square in squares])
    turning = []
    for i, j in ((1, 2), (2, 0), (0, 1)):
        apart, both, step = squares[i] - squares[j], squares[i] + squares[j], alpha[j] - alpha[i]
        turning.append(volume / 5 * apart**2 * step / (2 * apart - both * step))
    return RHO * np.concatenate([volume * alpha / (2 - alpha), turning])


def test_ellipsoid_agrees_with_lamb(imported):
    axes = (3.0, 1.0, 0.5)
    exact = ellipsoid_added_mass(axes)
    hull = sphere().apply_transform(np.diag([*axes, 1.0]))
    vehicle, document = imported(hull)
    assert_within(vehicle.M_A, np.diag(exact), hull, ERROR)
    assert_allclose(np.diagonal(vehicle.M_A), exact, rtol=0.05)
    [said] = [text for text in document['traps'] if text.startswith('added_mass')]
    stated = np.array([float(bound) for bound in re.findall(r'[XYZKMN] \S+ ± ([^ ,;]+)', said)])
    assert np.all(np.abs(np.diagonal(vehicle.M_A) - exact) <= stated)
    assert np.all(stated < 0.05 * exact)


def sources_added_mass(centres, radius):
    """Second implementation: M_A of spheres by point sources inside them, least squares.

    Quadrature and collocation points are Gauss-Legendre by trapezium.
    """
    x, weight = np.polynomial.legendre.leggauss(14)
    angle = 2 * np.pi * (np.arange(28) + 0.5) / 28
    ring = np.sqrt(1 - x**2)[:, None]
    parts = ring * np.cos(angle), ring * np.sin(angle), np.broadcast_to(x[:, None], (14, 28))
    unit = np.stack(parts, -1).reshape(-1, 3)
    area = np.repeat(weight, 28) * 2 * np.pi / 28 * radius**2
    points = np.concatenate([centre + radius * unit for centre in centres])
    normals = np.concatenate([unit for _ in centres])
    inner = sphere(2).vertices
    sources = np.concatenate([centre + 0.4 * radius * inner for centre in centres])
    apart = points[:, None] - sources[None]
    distance = np.linalg.norm(apart, axis=2)
    slope = -np.einsum('ijk,ik->ij', apart, normals) / distance**3
    flux = np.hstack([normals, np.cross(points, normals)])
    strength = np.linalg.lstsq(slope, flux, rcond=1e-12)[0]
    assert np.abs(slope @ strength - flux).max() < 1e-4
    return (
        -RHO * (flux * np.tile(area, len(centres))[:, None]).T @ (strength.T @ (1 / distance).T).T
    )


def test_two_spheres_move_the_water_together(imported, rough):
    centres, radius = np.array([[0.0, -1.5, 0.4], [0.0, 1.5, 0.4]]), 1.0
    exact = sources_added_mass(centres, radius)
    hull = trimesh.util.concatenate([sphere(3, radius, at) for at in centres])
    vehicle, document = imported(hull, *rough, '--panels', '2000')
    centred = np.eye(6)
    centred[:3, 3:] = skew(vehicle.r_B)
    assert_within(centred.T @ vehicle.M_A @ centred, centred.T @ exact @ centred, hull, ERROR)
    alone = RHO * 2 / 3 * np.pi * radius**3
    assert vehicle.M_A[0, 0] / (2 * alone) > 1.02  # abreast they hinder each other
    assert vehicle.M_A[1, 1] / (2 * alone) < 0.95  # one behind the other they help
    assert any('bodies: 2' in text for text in document['traps'])


def wedge():
    """A closed hull without any symmetry."""
    corners = [[0, 0, 0], [2, 0, 0], [0, 1, 0], [0.3, 0.2, 0.8]]
    return trimesh.Trimesh(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def test_axes_units_and_origin_turn_and_shift_the_same_hull(imported, rough):
    hull = wedge()  # both are in error by the same
    vehicle, _ = imported(hull, *rough)
    origin = np.array([0.5, -0.25, 1.0])
    moved, _ = imported(
        hull.copy().apply_scale(1000), *rough, '--origin', '500', '-250', '1000', units='mm',
        axes='flu', mass=RHO * hull.volume,
    )  # fmt: skip
    T = np.diag([1.0, -1, -1, 1, -1, -1])
    assert_allclose(moved.r_B, T[:3, :3] @ (vehicle.r_B - origin), atol=1e-6)
    # nu of the first origin from that of the second: v1 = v2 + omega x (o1 - o2)
    shift = np.eye(6)
    shift[:3, 3:] = -skew(-origin)
    # capytaine's integrals jump: corners that differ by 5e-16 m move M_A by 1e-5, its error is 1e-2
    exact = T @ shift.T @ vehicle.M_A @ shift @ T
    assert_allclose(moved.M_A, exact, atol=1e-4 * np.abs(exact).max())
    assert np.abs(vehicle.M_A[:3, 3:]).max() > 1.0


def test_a_box_keeps_its_symmetry_and_comes_out_of_a_mesh_with_faults(imported, rough):
    hull = trimesh.creation.box((2, 1, 0.5))
    vehicle, _ = imported(hull, *rough)
    assert_array_equal(vehicle.M_A, np.diag(np.diagonal(vehicle.M_A)))
    inner = trimesh.creation.box((1, 0.5, 0.25))
    broken = trimesh.util.concatenate([hull, inner])
    keep = np.arange(len(broken.faces)) != 3
    broken.update_faces(keep)
    broken.invert()
    again, document = imported(broken, *rough, name='hull.obj', mass=RHO)
    assert_allclose(again.M_A, vehicle.M_A, rtol=0.02, atol=2.0)
    said = ' '.join(document['traps'])
    for words in ('1 triangles added', 'normals turned outwards in 2 of 2', 'is not wetted'):
        assert words in said
    assert again.buoyancy == pytest.approx(RHO * 9.81)


def test_what_the_user_gives_is_taken_and_the_vehicle_by_other_commands(
    imported, rough, tmp_path, capsys
):
    hull = trimesh.creation.box((2, 1, 0.5))
    inertia = ['--inertia', '110', '300', '400', '1', '5', '2', '--products', 'integral']
    vehicle, document = imported(hull, '--cog', '0', '0', '0.05', *rough, *inertia)
    assert_array_equal(vehicle.r_G, [0, 0, 0.05])
    body = document['vehicle']['rigid_body']
    assert body['inertia'] == [[110, -1, -5], [-1, 300, -2], [-5, -2, 400]]
    assert not any('uniform' in text for text in document['assumed'])
    main(['check-vehicle', 'a.yaml', '--json'])
    json.loads(capsys.readouterr().out)
    main(['new', 'scenario', 'mine', '--vehicle', 'a.yaml'])
    main(['simulate', 'mine.yaml', '--controller', 'gvc', '--out', 'runs', '--no-report'])
    assert (tmp_path / 'runs' / 'summary.json').is_file()


@pytest.mark.usefixtures('dry')
def test_a_hull_about_its_origin_is_level(imported):
    hull = trimesh.creation.cylinder(radius=0.2, height=1.0, sections=17)
    vehicle, _ = imported(hull, mass=125.0)
    assert vehicle.r_B.tolist() == vehicle.r_G.tolist() == [0.0, 0.0, 0.0]


@pytest.mark.usefixtures('dry')
def test_the_inertia_is_as_it_was_given_or_else_that_of_the_hull(imported):
    given = '--inertia', '110', '300', '400', '1', '5', '2', '--products', 'tensor'
    options = *given, '--inertia-reference', 'co', '--gravity', '3.71', '--cog', '0', '0', '0.1'
    vehicle, document = imported(wedge(), *options, mass=200.0)
    body = document['vehicle']['rigid_body']
    assert body['inertia'] == [[110, 1, 5], [1, 300, 2], [5, 2, 400]]
    assert body['inertia_reference'] == 'co'
    assert vehicle.weight == pytest.approx(742.0)
    assert not any('gravity:' in text for text in document['assumed'])
    _, document = imported(wedge(), *given[:4], mass=200.0)
    assert document['vehicle']['rigid_body']['inertia'] == np.diag([110, 300, 400]).tolist()
    vehicle, document = imported(wedge(), mass=200.0)
    corners = np.array(wedge().vertices)
    centre = corners.mean(axis=0)
    about = 200.0 / 20 * (corners - centre).T @ (corners - centre)  # of x y dm in a tetrahedron
    exact = np.trace(about) * np.eye(3) - about
    assert_allclose(document['vehicle']['rigid_body']['inertia'], exact, rtol=1e-6)
    assert_allclose(vehicle.r_B, centre, rtol=1e-6)
    assert_array_equal(vehicle.r_G, vehicle.r_B)
    assert 'environment.gravity: 9.81 m/s2' in document['assumed']


@pytest.mark.parametrize(('units', 'length'), [('mm', 0.001), ('cm', 0.01), ('in', 0.0254)])
@pytest.mark.usefixtures('dry')
def test_units_of_a_mesh(imported, units, length):
    hull = trimesh.creation.box(np.array([2.0, 1.0, 0.5]) / length)
    vehicle, _ = imported(hull, units=units, mass=RHO)
    assert vehicle.buoyancy == pytest.approx(RHO * 9.81, rel=1e-6)


SAID = ('--mass', '1000', '--water-density', '1000')


def test_what_a_mesh_does_not_say_is_asked_for(refused):
    hull = trimesh.creation.box((2000, 1000, 500))
    assert '--mass' in refused(hull)
    assert '--water-density' in refused(hull, *SAID[:2])
    assert 'mm, which fits the mass' in refused(hull, *SAID)
    wrong = refused(hull, *SAID, '--units', 'm', '--axes', 'flu')
    assert 'mm, which fits the mass' in wrong
    assert '1e+09 times the mass' in wrong
    assert 'flu if it is longest ahead, along x' in refused(hull, *SAID, '--units', 'mm')
    assert 'found fru' in refused(hull, *SAID, '--units', 'mm', '--axes', 'fru')
    said = refused(hull, *SAID, '--volume', '1')
    assert 'hydrostatics.volume: expected that of the mesh' in said
    said = refused(hull, *SAID, '--center-of-buoyancy', '0', '0', '1')
    assert 'hydrostatics.center_of_buoyancy: expected that of the mesh' in said
    assert 'none of mm, cm, m, in fits the mass' in refused(hull, '--mass', '90', *SAID[2:])
    for axes in ('fl', 'flux', 'ffu'):
        assert f'found {axes}' in refused(hull, *SAID, '--units', 'mm', '--axes', axes)
    there = *SAID, '--units', 'mm', '--axes', 'flu', '--inertia', '110', '300', '400', '1'
    assert 'expected 3 or 6 numbers' in refused(hull, *there)
    assert '--products integral' in refused(hull, *there, '5', '2')


@pytest.mark.parametrize(('mass', 'fits'), [(499, False), (501, True), (1999, True), (2001, False)])
@pytest.mark.usefixtures('dry')
def test_a_hull_that_displaces_half_or_twice_its_mass_is_of_other_units(imported, mass, fits):
    hull = trimesh.creation.box((2, 1, 0.5))
    with nullcontext() if fits else pytest.raises(SystemExit):
        imported(hull, mass=mass)


def test_open_surfaces_and_other_files_are_refused(refused, tmp_path, monkeypatch, capsys):
    hull = trimesh.creation.icosphere(2)
    hull.update_faces(np.linalg.norm(hull.triangles_center - [1, 0, 0], axis=1) > 0.6)
    line = refused(trimesh.util.concatenate([sphere(1, at=(3, 0, 0)), hull]), *SAID)
    assert 'open edges in part 2 of 2, at (' in line
    flat = trimesh.Trimesh([[4, 0, 0], [5, 0, 0], [5, 1, 0], [4, 1, 0]],
                           [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])  # fmt: skip
    line = refused(trimesh.util.concatenate([sphere(1), flat]), *SAID)
    assert 'expected parts with a volume, found part 2 without any' in line
    (tmp_path / 'list.m').write_text('Xudot = -5')
    with pytest.raises(SystemExit):
        main(['import-vehicle', str(tmp_path / 'list.m'), '--units', 'mm'])
    assert '--units: expected a mesh' in capsys.readouterr().err
    line = refused(trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]] * 3), *SAID)
    assert 'expected 4 to 1000000 triangles of finite numbers, found 3 triangles' in line
    monkeypatch.setattr(mesh_import, 'LARGEST_FILE', 1 << 20)
    (tmp_path / 'large.ply').write_bytes(bytes((1 << 20) + 1))
    for name, said in (('large.ply', 'at most 1 MB, found 1048577 bytes'),
                       ('gone.ply', 'a mesh, found no such file')):  # fmt: skip
        with pytest.raises(SystemExit):
            main(['import-vehicle', name, *SAID])
        assert said in capsys.readouterr().err
    (tmp_path / 'bad.ply').write_text('ply\nnonsense')
    with pytest.raises(SystemExit):
        main(['import-vehicle', str(tmp_path / 'bad.ply'), *SAID])
    assert 'a mesh that trimesh reads' in capsys.readouterr().err
