"""Vehicles of other systems against the shipped files, and what is refused."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from helpers.foreign_vehicles import BLUEROV2, REMUS, REMUS_LIFT, REXROV, URDF, sdf
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis.cli.main import main
from auv_dynamics import load_vehicle
from auv_dynamics.vehicle.frames import swap_inertia
from auv_dynamics.vehicle.vehicle import skew

LIST = ['--inertia-reference', 'co', '--gravity', '9.81']
DIGITS = 1e-8  # of the volume that the shipped file rounds


@pytest.fixture
def imported(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def run(name, text, *options):
        (tmp_path / name).write_text(text, encoding='utf-8')
        main(['import-vehicle', name, *options, '--out', 'made.yaml', '--overwrite', '--json'])
        captured = capsys.readouterr()
        document = json.loads(captured.out)
        titles = ('traps', 'handled'), ('assumed',) * 2, ('left_out', 'left out')
        titles = *titles, ('warnings', 'warning')
        report = [f'{title}: {text}' for key, title in titles for text in document[key]]
        assert captured.err == ''.join(f'{line}\n' for line in report)
        return load_vehicle(tmp_path / 'made.yaml'), document

    return run


def assert_same(vehicle, other, rounding=1e-12):
    for key in ('M_RB', 'M_A', 'D_linear', 'D_quadratic', 'r_G', 'r_B', 'weight', 'buoyancy'):
        theirs = np.asarray(getattr(other, key))
        atol = rounding * np.abs(theirs).max()
        assert_allclose(getattr(vehicle, key), theirs, atol=atol, rtol=rounding)


@pytest.mark.parametrize('file', ['rexrov.yaml', 'rexrov.urdf'])
def test_rexrov_of_uuv_simulator_is_the_shipped_one(imported, file):
    vehicle, document = imported(file, REXROV if file.endswith('yaml') else URDF)
    assert document['format'] == 'uuv'
    assert document['vehicle']['source'] == f'imported from uuv_simulator, {file}'
    assert_same(vehicle, load_vehicle('rexrov'))
    traps = ' '.join(document['traps'])
    assert 'rigid_body.inertia: from forward-left-up to FSD, 4 entries turn sign' in traps
    assert 'not turned again' in traps


def test_bluerov2_of_a_list_is_the_shipped_one(imported):
    vehicle, document = imported('list.m', BLUEROV2, *LIST)
    assert document['format'] == 'mss'
    assert document['vehicle']['source'] == 'imported from a list of derivatives, list.m'
    assert_same(vehicle, load_vehicle('bluerov2'), DIGITS)
    assert document['vehicle']['environment'] == {'water_density': 1000, 'gravity': 9.81}
    assert any('Xuu' in text for text in document['assumed'])


def test_link_of_gazebo_is_turned_to_forward_starboard_down(imported):
    vehicle, document = imported('made.sdf', sdf())
    assert document['format'] == 'gazebo'
    assert document['vehicle']['source'] == 'imported from Gazebo, made.sdf'
    assert_allclose(vehicle.r_G, [0.01, -0.02, 0.03])
    assert_allclose(vehicle.r_B, [0, 0, -0.05])
    assert vehicle.buoyancy == pytest.approx(98.1)
    inertia = document['vehicle']['rigid_body']['inertia']
    assert_allclose(inertia, [[0.4, -0.01, -0.02], [-0.01, 0.5, 0.03], [-0.02, 0.03, 0.6]])
    M_A = vehicle.M_A
    assert_array_equal(np.diagonal(M_A), [5, 12, 14, 1, 2, 3])
    # one of the two changes sign between the axes: x stays, y and q turn
    assert (M_A[0, 4], M_A[0, 1]) == (-0.5, -0.25)
    assert (vehicle.D_linear[1, 5], vehicle.D_linear[0, 0]) == (1.0, 4.0)
    assert_array_equal(np.diagonal(vehicle.D_quadratic), [18, 0, 0, 0, 0, 2])


def test_a_tensor_in_axes_of_its_own_is_turned_into_those_of_the_link(imported):
    pose = '0.01 0.02 -0.03 0 0'
    text = sdf().replace(f'<pose>{pose} 0', f'<pose degrees="true">{pose} 90')
    fin = '<link name="fin"><inertial><mass>2.5</mass></inertial></link><link name="light"/>'
    text = text.replace('0 0 -9.81', '0 0 -3.71').replace('</model>', f'{fin}</model>')
    vehicle, document = imported('a.sdf', text)
    inertia = document['vehicle']['rigid_body']['inertia']
    assert_allclose(inertia, [[0.5, 0.01, 0.03], [0.01, 0.4, 0.02], [0.03, 0.02, 0.6]], atol=1e-12)
    assert vehicle.weight == pytest.approx(37.1)
    assert any('2 other links of the model' in t and '2.5 kg' in t for t in document['assumed'])


@pytest.mark.parametrize(
    ('file', 'text', 'options', 'name'),
    [
        ('a.sdf', sdf(), (), 'made'),
        ('a.sdf', sdf().replace(' name="made"', ''), (), 'a'),
        ('a.urdf', URDF, (), 'rexrov'),
        ('a.yaml', REXROV, (), 'a'),
        ('a.yaml', f'{REXROV}model: other\n', (), 'other'),
        ('a.m', BLUEROV2, LIST, 'a'),
    ],
)
def test_a_vehicle_has_the_name_that_it_had(tmp_path, capsys, file, text, options, name):
    (tmp_path / file).write_text(text, encoding='utf-8')
    main(['import-vehicle', str(tmp_path / file), *options, '--json'])
    assert json.loads(capsys.readouterr().out)['vehicle']['name'] == name


def test_what_a_model_of_gazebo_leaves_open(imported):
    named = 'filename="gz-sim-hydrodynamics-system" name="gz::sim::systems::Hydrodynamics"'
    by_tags = sdf().replace(named, 'name="mine"')
    spaced = sdf().replace('base_link<', ' base_link\n<')
    for text in (by_tags, spaced, spaced.replace(' base_link\n', 'made::base_link')):
        assert text != sdf()
        assert_same(imported('made.sdf', text)[0], imported('other.sdf', sdf())[0])
    fluid = '<fluid_added_mass><xx>5</xx></fluid_added_mass>'
    by_name = re.sub('(?s)base_link</link_name>.*</plugin></model>',
                     'base_link</link_name></plugin></model>', sdf(fluid=fluid))  # fmt: skip
    vehicle, document = imported('a.sdf', by_name.replace(named, named.partition(' ')[2]))
    assert_array_equal(vehicle.M_A, np.diag([5, 0, 0, 0, 0, 0]))
    assert 'damping.linear: zero, as there is none in the file' in document['assumed']
    plain = re.sub('<i(xy|xz|yz)>[^/]*</i..>', '', sdf())
    vehicle, document = imported('a.sdf', plain[plain.index('<world') : -len('</sdf>')])
    assert document['vehicle']['rigid_body']['inertia'] == np.diag([0.4, 0.5, 0.6]).tolist()
    assert not any('ixy' in text for text in document['traps'])
    mars = plain.replace('0 0 -9.81', '0 0 -3.71')
    assert imported('a.sdf', mars[mars.index('<world') : -len('</sdf>')])[0].weight == 37.1
    alone = re.sub('<gravity>.*</gravity>', '', mars)
    vehicle, document = imported('a.sdf', alone)
    assert vehicle.weight == 98.0
    assert any('gravity: 9.8 m/s2' in text for text in document['assumed'])
    for value in ('1', 'true', '0'):
        off = f'<disable_added_mass>{value}</disable_added_mass>'
        _, document = imported('a.sdf', sdf(more=off))
        said = any('disable_added_mass' in text for text in document['traps'])
        assert said == (value != '0')
    twice = '<xUU>-2</xUU><yUV>-1</yUV><yVabsU>-3</yVabsU><zVW>0</zVW><yUabsV>0</yUabsV>'
    vehicle, _ = imported('a.sdf', sdf(more=twice), '--quadratic-abs')
    assert (vehicle.D_quadratic[0, 0], vehicle.lift[1, 1]) == (20.0, 4.0)


@pytest.mark.parametrize(('shape', 'volume'), [
    ('<sphere><radius>0.1</radius></sphere>', np.pi * 0.004 / 3),
    ('<cylinder><radius>0.1</radius><length>0.3</length></cylinder>', np.pi * 0.003),
    ('<capsule><radius>0.1</radius><length>0.3</length></capsule>', np.pi * (0.003 + 0.004 / 3)),
    ('<ellipsoid><radii>0.1 0.2 0.3</radii></ellipsoid>', np.pi * 0.008),
])  # fmt: skip
def test_volume_of_a_shape(imported, shape, volume):
    vehicle, _ = imported('made.sdf', sdf().replace('<box><size>0.2 0.2 0.25</size></box>', shape))
    assert vehicle.buoyancy == pytest.approx(volume * 1000 * 9.81, rel=1e-3)


def test_shapes_of_a_link_float_together(imported):
    behind = (
        '<collision name="b"><pose>1 0 0.05 0 0 0</pose><geometry><box><size>0.2 0.2 0.25</size>'
    )
    text = sdf().replace('</link>', f'{behind}</box></geometry></collision></link>')
    vehicle, _ = imported('made.sdf', text)
    assert vehicle.buoyancy == pytest.approx(2 * 98.1)
    assert_allclose(vehicle.r_B, [0.5, 0, -0.05], atol=1e-12)


def test_water_of_the_world_comes_before_that_of_the_plugin(imported):
    text = sdf(more='<water_density>1025</water_density>')
    assert imported('both.sdf', text)[0].buoyancy == pytest.approx(98.1)
    alone = re.sub('<uniform.*density>', '', text)
    assert imported('one.sdf', alone)[0].buoyancy == pytest.approx(1.025 * 98.1)


def test_water_of_a_world_with_graded_buoyancy_is_its_default(imported):
    text = sdf(more='<water_density>1000</water_density>')
    graded = '<graded_buoyancy><default_density>1025</default_density></graded_buoyancy>'
    text = re.sub('<uniform.*density>', graded, text)
    assert imported('graded.sdf', text)[0].buoyancy == pytest.approx(1.025 * 98.1)


def test_prefixes_that_nobody_declares(imported):
    more = '<experimental:params><add name="a" gz:name="b"/></experimental:params>'
    text = sdf().replace('<model name="made">', f'<model name="made">{more}')
    assert_same(imported('made.sdf', text)[0], imported('other.sdf', sdf())[0])


def test_fluid_added_mass_is_positive_and_counted_once(imported):
    entries = {'xx': 5, 'yy': 12, 'zz': 14, 'pp': 1, 'qq': 2, 'rr': 3, 'xq': 0.5, 'xy': 0.25}
    tags = ''.join(f'<{tag}>{value}</{tag}>' for tag, value in entries.items())
    fluid = f'<fluid_added_mass>{tags}</fluid_added_mass>'
    vehicle, _ = imported('made.sdf', sdf(added='', fluid=fluid))
    assert_same(vehicle, imported('other.sdf', sdf())[0])
    off = '<disable_added_mass>true</disable_added_mass>'
    assert_same(vehicle, imported('off.sdf', sdf(fluid=fluid, more=off))[0])


def test_choices_of_the_user_take_the_place_of_what_is_missing(imported):
    text = re.sub('<collision.*</collision>', '', sdf(), flags=re.S)
    point = ['--center-of-buoyancy', '0', '0', '-0.05']
    vehicle, _ = imported('made.sdf', text, '--volume', '0.01', *point)
    assert_same(vehicle, imported('other.sdf', sdf())[0])
    swapped = BLUEROV2.replace('W = 112.8; B = 114.8', 'B = 112.8; W = 114.8')
    vehicle, _ = imported('list.m', swapped, *LIST, '--swap-weight-buoyancy')
    assert_same(vehicle, load_vehicle('bluerov2'), DIGITS)
    positive = re.sub(r'= -', '= ', BLUEROV2)
    assert_same(imported('list.m', positive, *LIST, '--sign', 'positive')[0], vehicle)


def test_xUU_is_taken_for_xUabsU_where_that_was_said(imported):
    vehicle, document = imported('made.sdf', sdf(more='<zWW>-3</zWW>'), '--quadratic-abs')
    assert vehicle.D_quadratic[2, 2] == 3.0
    assert any('zWW: taken for zWabsW' in text for text in document['traps'])


@pytest.mark.parametrize(
    ('file', 'text'),
    [
        ('a.yaml', REXROV.replace('cog: [0, 0, 0]', 'cog: [0.1, 0.2, 0.3]')),
        ('a.urdf', URDF.replace('xyz="0 0 0"', 'xyz="0.1 0.2 0.3"')),
    ],
)
def test_centre_of_gravity_of_uuv_simulator_is_turned(imported, file, text):
    assert_allclose(imported(file, text)[0].r_G, [0.1, -0.2, -0.3])


def test_what_uuv_simulator_does_by_itself(imported):
    floating, document = imported('a.yaml', f'{REXROV}neutrally_buoyant: true\n')
    assert floating.buoyancy == pytest.approx(floating.weight)
    assert any('neutrally_buoyant' in text for text in document['traps'])
    dense, _ = imported('a.urdf', URDF.replace('1028.0<', '1000.0<'))
    assert dense.buoyancy == pytest.approx(1000.0 * 9.81 * 1.83826)
    usual, document = imported('a.yaml', REXROV.replace('density: 1028.0', ''))
    assert usual.buoyancy == pytest.approx(load_vehicle('rexrov').buoyancy)
    assert any('1028 kg/m3, its default' in text for text in document['assumed'])
    more = 'gravity: 3.71\nscaling_volume: 1\noffset_volume: 0\nlength: 2.6\n'
    floating, document = imported('a.yaml', f'{REXROV}neutrally_buoyant: 1\n{more}')
    assert floating.buoyancy == floating.weight == pytest.approx(1862.87 * 3.71)
    assert not any('gravity:' in text for text in document['assumed'])
    assert document['left_out'] == []
    added = np.diag([7.0, 6.0, 5.0, 4.0, 3.0, 2.0])
    for given in (added.diagonal().tolist(), added.tolist()):
        vehicle, _ = imported('a.yaml', re.sub('added_mass: .*', f'added_mass: {given}', REXROV))
        assert_array_equal(vehicle.M_A, added)
    quadratic = -np.diag([5.0, 4.0, 3.0, 2.0, 1.0, 9.0])
    quadratic[0, 1] = 7.0
    told = ' '.join(map(str, quadratic.ravel()))
    text = re.sub('quadratic_damping: .*', f'quadratic_damping: {told}', REXROV)
    vehicle, document = imported('a.yaml', text)
    assert_array_equal(vehicle.D_quadratic, np.diag([5, 4, 3, 2, 1, 9]))
    assert any('quadratic_damping: what is off' in text for text in document['left_out'])


def test_products_of_inertia_by_either_convention(imported):
    text = BLUEROV2.replace('zG = 0.02', 'zG = 0; Ixy = 0.01; Ixz = 0.02; Iyz = 0.03')
    for products, sign in (('integral', -1), ('tensor', 1)):
        _, document = imported('list.m', text, '--products', products)
        inertia = np.array(document['vehicle']['rigid_body']['inertia'])
        found = inertia[[0, 0, 1, 1, 2, 2], [1, 2, 2, 0, 0, 1]]
        assert_array_equal(found, sign * np.tile([0.01, 0.02, 0.03], 2))


def test_a_list_may_say_where_buoyancy_acts_unless_the_user_does(imported):
    text = f'{BLUEROV2}xB = 0.01; yB = 0.02; zB = -0.03'
    vehicle, document = imported('list.m', text, *LIST)
    assert_array_equal(vehicle.r_B, [0.01, 0.02, -0.03])
    assert 'water_density' in ' '.join(document['assumed'])
    point = '--center-of-buoyancy', '0.1', '0.2', '0.3'
    vehicle, document = imported('list.m', text, *LIST, *point, '--water-density', '1025')
    assert_array_equal(vehicle.r_B, [0.1, 0.2, 0.3])
    assert 'water_density' not in ' '.join(document['assumed'])


def test_a_list_names_mass_and_water_as_papers_do(imported):
    text = BLUEROV2.replace('m = 11.5; W = 112.8; B = 114.8;', 'mass = 10; g = 3.71; nabla = 0.02;')
    text = re.sub('I([xyz]) =', r'I\1\1 =', text).replace('zG = 0.02', 'zg = 0.02')
    reference = '--inertia-reference', 'co'
    vehicle, _ = imported('list.m', f'{text}rho = 1030 // of the sea\n', *reference)
    assert vehicle.weight == pytest.approx(10 * 3.71)
    assert vehicle.buoyancy == pytest.approx(1030 * 3.71 * 0.02)
    assert vehicle.r_G[2] == 0.02
    twice = f'{BLUEROV2}Yr = -0.5; X_uu = -18.18'  # one value by two names
    turning, _ = imported('list.m', twice, *LIST)
    assert (turning.D_linear[1, 5], turning.D_linear[5, 1]) == (0.5, 0.0)
    assert_array_equal(np.diagonal(vehicle.M_RB)[3:], 0.16)
    text = BLUEROV2.replace('m = 11.5; W = 112.8', 'm = 10; W = 98.3')
    assert imported('list.m', text, *reference)[0].weight == pytest.approx(98.3)


def test_volume_and_buoyancy_of_a_list_tell_its_water(imported):
    vehicle, document = imported('list.m', BLUEROV2 + 'V = 0.0114', *LIST)
    assert vehicle.buoyancy == pytest.approx(114.8)
    water = document['vehicle']['environment']['water_density']
    assert water == pytest.approx(114.8 / (9.81 * 0.0114))
    assert 'water_density' not in ' '.join(document['assumed'])
    choice = '--water-density', '1025'  # then the volume is kept
    assert imported('list.m', BLUEROV2 + 'V = 0.0114', *LIST, *choice)[0].buoyancy == (
        pytest.approx(1025 * 9.81 * 0.0114)
    )


def test_what_the_user_says_is_taken_in_place_of_the_file(imported):
    options = '--water-density', '1025', '--gravity', '9.8', '--source', 'Doe 2020'
    vehicle, _ = imported('a.sdf', sdf(), *options)
    assert vehicle.buoyancy == pytest.approx(1025 * 9.8 * 0.01)
    assert vehicle.source == 'Doe 2020'


def test_what_a_file_cannot_hold_is_left_out_when_asked(imported):
    for name, text, word in (
        ('list.m', BLUEROV2.replace('zG = 0.02', 'Yvr = -3; L = 2'), 'Yvr'),
        ('made.sdf', sdf(more='<yVabsR>-3</yVabsR>'), 'yVabsR'),
        ('rexrov.yaml', f'{REXROV}colour: red\n"a\\nname: b": 1\n', 'colour'),
    ):
        _, document = imported(name, text, '--leave-out')
        assert any(word in text for text in document['left_out'])
        lines = Path('made.yaml').read_text(encoding='utf-8').splitlines()
        assert any(line.startswith('# left out: ') and word in line for line in lines)
        assert document['vehicle']['name'] == 'made'


def forces(vehicle, u):
    """Slopes of Y, Z, M, N by v, w, q, r in motion ahead."""
    h, columns = 1e-7, []
    for j in (1, 2, 4, 5):
        nu, other = (u * np.eye(6)[0] + sign * h * np.eye(6)[j] for sign in (1, -1))
        pull = [-(vehicle.C(x) + vehicle.D(x)) @ x for x in (nu, other)]
        columns.append((pull[0] - pull[1])[[1, 2, 4, 5]] / (2 * h))
    return np.transpose(columns)


FRAMES = """<frame name="aft" attached_to="mount"><pose>-1 0 0 0 0 0</pose></frame>
  <link name="fin"><pose relative_to="aft">0 0.5 0 0 0 0</pose></link>
  <joint name="hinge" type="fixed"><pose degrees="1">0 0 1 0 0 90</pose><child>fin</child>
    <parent>base_link</parent></joint>
  <frame name="mount"><pose relative_to="base_link">0 0 0 0 0 0</pose></frame>"""


@pytest.mark.parametrize(
    ('frame', 'pose', 'r_B'),
    [
        ('base_link', '1 2 3 0 0 0', (1, -2, -3)),
        ('__model__', '1 2 3 0 0 0', (-3, -3, 4)),  # the link is at (4, 5, 7), its x along y
        ('aft', '0 0 0 0 0 0', (-1, 0, 0)),
        ('fin', '1 2 3 0 0 0', (0, -2.5, -3)),
        ('hinge', '1 2 3 0 0 0', (-3, -1.5, -4)),
    ],
)
def test_poses_are_in_the_frame_that_they_name(imported, frame, pose, r_B):
    text = sdf().replace(
        '<pose>0 0 0.05 0 0 0</pose>', f'<pose relative_to="{frame}">{pose}</pose>'
    )
    text = text.replace(
        '<link name="base_link">',
        '<link name="base_link"><pose>4 5 7 0 0 1.5707963267948966</pose>',
    )
    vehicle, _ = imported('a.sdf', text.replace('</link>', f'</link>{FRAMES}', 1))
    assert_allclose(vehicle.r_B, r_B, atol=1e-12)


def test_the_link_is_that_of_the_model_with_the_plugin(imported):
    buoy = '<model name="buoy"><link name="base_link"><inertial><mass>500</mass></inertial></link>'
    alone = sdf()
    text = alone.replace('<model', f'{buoy}</model><model', 1)
    assert text != alone
    assert_same(imported('made.sdf', text)[0], imported('other.sdf', alone)[0])


def test_combined_derivatives_of_a_list_come_out_as_published(imported):
    options = [*LIST, '--lift', 'combined']
    vehicle, document = imported('remus.m', REMUS + REMUS_LIFT, *options)
    m, u = 299 / 9.81, 1.5
    published = [[-28.6, 0, 0, 5.22 - m], [0, -28.6, -5.22 + m, 0], [0, 24, -2, 0], [-24, 0, 0, -2]]
    assert_allclose(forces(vehicle, u), u * np.array(published), atol=1e-3)
    assert_allclose(vehicle.lift[5], [0, -10.57, 0, 0, 0, 3.93], atol=1e-9)
    assert ['Yuudr' in text for text in document['left_out']].count(True) == 1
    alone, _ = imported('remus.m', REMUS + REMUS_LIFT, *LIST, '--lift', 'alone')
    assert_array_equal(alone.lift[5], [0, 24, 0, 0, 0, 2])


def test_a_block_of_comments_and_dollars_of_a_list_are_no_numbers(imported):
    text = BLUEROV2 + '%{\nYp = 3\n%}\n$Y_{\\dot p}$ = -0.3; $K_{\\dot v}$ = -0.3\n'
    vehicle, _ = imported('a.m', text, *LIST)
    assert vehicle.D_linear[1, 3] == 0
    assert vehicle.M_A[1, 3] == vehicle.M_A[3, 1] == 0.3


def test_damping_by_forward_speed_of_uuv_simulator_is_lift(imported):
    row = ' '.join(str(-value) for value in (0, 0, 0, 0, 0, 9))
    matrix = f'{"0 0 0 0 0 0 " * 5}{row}'
    vehicle, document = imported('a.yaml', f'{REXROV}  linear_damping_forward_speed: {matrix}\n')
    assert_array_equal(vehicle.lift, np.diag([0, 0, 0, 0, 0, 9]))
    assert any('linear_damping_forward_speed' in text for text in document['traps'])


def test_products_with_u_of_gazebo_are_lift(imported):
    more = '<yVabsU>-3</yVabsU><nRU>-4</nRU><mUW>-2</mUW><zWabsU>-1</zWabsU><xWabsU>2</xWabsU>'
    vehicle, document = imported('a.sdf', sdf(more=more))
    found = {(i, j): vehicle.lift[i, j] for i, j in np.argwhere(vehicle.lift)}
    # x stays and z turns from FLU; y with y, and pitch with heave, turn both
    assert found == {(1, 1): 3.0, (5, 5): 4.0, (4, 2): 2.0, (2, 2): 1.0, (0, 2): 2.0}
    assert any('nRU, mUW' in text for text in document['traps'])
    feeds, _ = imported('a.sdf', sdf(more='<nRU>4</nRU>'))
    assert feeds.lift[5, 5] == -4.0


def test_settings_of_the_plugin_that_gazebo_follows_and_we_do_not_are_reported(imported):
    more = '<disable_coriolis>true</disable_coriolis><default_current>0 0.5 0</default_current>'
    vehicle, document = imported('a.sdf', sdf(more=more + '<lookup_current_x>u</lookup_current_x>'))
    assert_same(vehicle, imported('b.sdf', sdf())[0])
    assert any('disable_coriolis: Gazebo leaves C_A nu out' in text for text in document['traps'])
    found = [text.partition(':')[0] for text in document['left_out']]
    assert found == ['default_current', 'lookup_current_x']
    more = '<disable_coriolis>0</disable_coriolis><default_current>0 0.0 0</default_current>'
    _, document = imported('a.sdf', sdf(more=more))
    assert 'coriolis' not in ' '.join(document['traps'])
    assert document['left_out'] == []


@pytest.mark.parametrize(
    ('name', 'said'),
    [('made', False), (' made::base_link', False), ('b', True), ('b</enable><enable>made', False)],
)
def test_a_model_that_gazebo_does_not_let_float_is_reported(imported, name, said):
    density = '<uniform_fluid_density>'
    text = sdf().replace(density, f'<enable>{name}</enable>{density}')
    _, document = imported('a.sdf', text)
    assert any(text.startswith('enable: ') for text in document['traps']) == said
    _, document = imported('b.sdf', sdf())
    assert not any(text.startswith('enable: ') for text in document['traps']), 'whoever can, does'


def test_a_model_of_classic_gazebo_has_its_body_in_sdf(imported):
    text = re.sub('(?s)<link name="rexrov/base_link"><inertial>.*?</link>',
        '<link name="rexrov/base_link"><inertial><pose>0.1 0.2 0.3 0 0 0</pose>'
        '<mass>1862.87</mass><inertia><ixx>525.39</ixx><ixy>1.44</ixy><ixz>33.41</ixz>'
        '<iyy>794.20</iyy><iyz>2.6</iyz><izz>691.23</izz></inertia></inertial></link>',
        URDF, count=1)  # fmt: skip
    text = re.sub('</?gazebo>', '', text).replace('robot', 'model')
    vehicle, document = imported('model.sdf', f'<sdf version="1.6">{text}</sdf>')
    moved = URDF.replace('xyz="0 0 0"', 'xyz="0.1 0.2 0.3"')
    assert_same(vehicle, imported('a.urdf', moved)[0])
    assert document['vehicle']['name'] == 'made'
    assert not any('the tensor is turned' in text for text in document['traps'])
    hull = '<link name="hull"><inertial><mass>9</mass></inertial></link>'
    fleet = f'<sdf version="1.6">{text}<model name="boat">{hull}</model></sdf>'
    beside, document = imported('fleet.sdf', fleet)
    assert_same(beside, vehicle)
    assert not any('other links' in text for text in document['assumed'])
    turned = text.replace('0.1 0.2 0.3 0 0 0', f'0.1 0.2 0.3 0 0 {np.pi / 2}')
    found, document = imported('turned.sdf', f'<sdf version="1.6">{turned}</sdf>')
    given = np.array([[525.39, 1.44, 33.41], [1.44, 794.20, 2.6], [33.41, 2.6, 691.23]])
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    S = skew(found.r_G)
    about_cg = found.M_RB[3:, 3:] + found.M_RB[0, 0] * S @ S
    assert_allclose(about_cg, swap_inertia(quarter @ given @ quarter.T), atol=1e-9)
    for rpy in (f'0 0 {np.pi / 2}', '0.3 -0.2 0.5'):  # of URDF; the same angles turn both
        turned = text.replace('0.1 0.2 0.3 0 0 0', f'0.1 0.2 0.3 {rpy}')
        found, _ = imported('turned.sdf', f'<sdf version="1.6">{turned}</sdf>')
        of_urdf, document = imported('b.urdf', moved.replace('xyz', f'rpy="{rpy}" xyz', 1))
        assert_allclose(of_urdf.M, found.M, rtol=1e-12, atol=1e-9)
        assert any('the tensor is turned' in text for text in document['traps'])
    assert_allclose(found.r_G, vehicle.r_G)
    assert any('the tensor is turned' in text for text in document['traps'])


def test_bodies_that_a_urdf_fixes_to_that_of_the_vehicle_are_reported(imported):
    arm = '<link name="arm"><inertial><mass value="40"/></inertial></link><link name="light"/>'
    joint = (
        '<joint name="j" type="fixed"><parent link="rexrov/base_link"/><child link="arm"/></joint>'
    )
    vehicle, document = imported('a.urdf', URDF.replace('</robot>', f'{arm}{joint}</robot>'))
    assert_same(vehicle, load_vehicle('rexrov'))
    assert any('1 other links' in t and '40 kg' in t for t in document['assumed'])


BOMB = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]><sdf>&b;</sdf>'
REFUSED = {  # what is wrong -> file, text, options, what the line names
    'a bomb': ('a.sdf', BOMB, [], 'without document type'),
    'a file from elsewhere': (
        'a.sdf', '<!DOCTYPE x SYSTEM "file:///etc/passwd"><sdf/>', [], 'document type'),
    'no XML': ('a.sdf', '<sdf><', [], 'valid XML'),
    'nothing known': ('a.txt', 'hello', [], '--format uuv, gazebo, mss or mesh'),
    'no plugin': ('a.sdf', '<sdf><model name="m"/></sdf>', [], 'one plugin'),
    'no volume': ('a.sdf', sdf().replace('box', 'mesh'), [], '--volume'),
    'no density': (
        'a.sdf', re.sub('<uniform.*density>', '', sdf()), [], '--water-density'),
    'xUU': ('a.sdf', sdf(more='<zWW>-3</zWW>'), [], '--quadratic-abs'),
    'a coefficient twice': ('a.sdf', sdf(more='<xU>-3</xU>'), [], 'xU: expected each coefficient'),
    'two velocities': ('a.sdf', sdf(more='<yVabsR>-3</yVabsR>'), [], '--leave-out'),
    'u times another abs': ('a.sdf', sdf(more='<yUabsV>-3</yUabsV>'), [], '--leave-out'),
    'which lift': ('a.m', REMUS + REMUS_LIFT, LIST, '--lift alone'),
    'damping that feeds': ('a.sdf', sdf().replace('-18', '18'), [], '--sign positive'),
    'two plugins': ('a.sdf', sdf(more='</plugin><plugin><xU>-1</xU>'), [], '2 of them'),
    'no such link': ('a.sdf', sdf().replace('base_link<', 'base<'), [], 'a link of this file'),
    'URDF with the plugin of Gazebo': (
        'a.urdf', sdf().replace('model', 'robot'), [], 'gz sdf -p turns URDF into SDF'),
    'no mass of a link': ('a.sdf', sdf().replace('<mass>10</mass>', ''), [], 'link.inertial.mass'),
    'an acceleration times a speed': ('a.sdf', sdf(more='<xDotUU>-3</xDotUU>'), [], '--leave-out'),
    'half a product': ('a.sdf', sdf(more='<xUabs>-3</xUabs>'), [], '--leave-out'),
    'no entry of added mass': (
        'a.sdf', sdf(added='', fluid='<fluid_added_mass><xw>1</xw></fluid_added_mass>'), [],
        'fluid_added_mass.xw: expected xx, xy'),
    'no centre of buoyancy': (
        'a.yaml', REXROV.replace('cob: [0, 0, 0.3]', ''), [], '--center-of-buoyancy'),
    'two hydrodynamic links': ('a.urdf', URDF.replace('</plugin>',
        '<link name="b"><hydrodynamic_model/></link></plugin>'), [], 'found 2 of them'),
    'no inertial': ('a.urdf', re.sub('(?s)<inertial>.*</inertial>', '', URDF), [],
        '<inertial> of the link rexrov/base_link'),
    'another weight': ('a.m', BLUEROV2.replace('W = 112.8', 'W = 114'), LIST,
        'expected m g = 112.815 N, found 114'),
    'added mass twice': (
        'a.sdf', sdf(fluid='<fluid_added_mass><xx>1</xx></fluid_added_mass>'), [], 'it twice'),
    'a word for a number': ('a.sdf', sdf().replace('-18', 'much'), [], 'xUabsU: expected'),
    'not finite': ('a.sdf', sdf().replace('-18', 'nan'), [], 'xUabsU'),
    'xacro in an angle': (
        'a.urdf', URDF.replace('xyz="0 0 0"', 'rpy="0 0 ${pi}"'), [], 'expand xacro first'),
    'two angles': (
        'a.urdf', URDF.replace('xyz="0 0 0"', 'rpy="0 1"'), [],
        'a.urdf: inertial.origin.rpy: expected 3'),
    'a word for an inertia': (
        'a.urdf', URDF.replace('"525.39"', '"much"'), [], 'a.urdf: inertial.ixx: expected'),
    'a frame of another model': ('a.sdf', sdf().replace(
        '<pose>0 0 0.05', '<pose relative_to="other::mount">0 0 0.05'), [], 'other::mount'),
    'frames in a circle': ('a.sdf', sdf(more='</plugin><frame name="a" attached_to="b"/>'
        '<frame name="b" attached_to="a"/><plugin>').replace(
        '<pose>0 0 0.05', '<pose relative_to="a">0 0 0.05'), [], 'in a circle'),
    'a chain of frames': ('a.sdf', sdf(more='</plugin>' + ''.join(
        f'<frame name="f{i}" attached_to="f{i + 1}"/>' for i in range(999)) + '<plugin>').replace(
        '<pose>0 0 0.05', '<pose relative_to="f0">0 0 0.05'), [], 'or behind 100 others'),
    'xacro': ('a.urdf', URDF.replace('1.83826', '${volume}'), [], 'expand xacro first'),
    'positive damping': ('a.yaml', REXROV.replace('[-74.82', '[74.82'), [], 'damping.linear'),
    'damping that feeds by the sign that was told': (
        'a.yaml', REXROV, ['--sign', 'positive'], 'damping.linear: expected positive'),
    'unknown entry': ('a.yaml', f'{REXROV}colour: red\n', [], 'colour'),
    'scaled': ('a.yaml', f'{REXROV}scaling_damping: 2\n', [], 'scaling_damping'),
    'twice, by two names': (
        'a.yaml', f'{REXROV}center_of_gravity: [0, 0, 0]\n', [], 'each entry once'),
    'too long': ('a.sdf', f'<sdf>{" " * (4 << 20)}</sdf>', [], 'XML of at most'),
    'no mass': ('a.yaml', REXROV.replace('mass: 1862.87', ''), [], 'mass'),
    'W and B swapped': (
        'a.m', BLUEROV2.replace('W = 112.8; B = 114.8', 'W = 114.8; B = 112.8'), [],
        '--swap-weight-buoyancy'),
    'which point': ('a.m', BLUEROV2, [], '--inertia-reference'),
    'products': ('a.m', BLUEROV2 + 'Ixz = 0.01', ['--inertia-reference', 'co'], '--products'),
    'a name twice': ('a.m', BLUEROV2 + 'Mq = -0.08', LIST, 'Mq: expected each name once'),
    'two buoyancies': (
        'a.m', BLUEROV2 + 'V = 0.0114; rho = 1000', LIST, 'B: expected rho g V = 111.8'),
    'two values by two names': ('a.m', BLUEROV2 + 'mass = 12', LIST, 'mass: expected 11.5 as by'),
    'one place by two names': (
        'a.m', BLUEROV2 + 'X_uu = -99', LIST, 'X_uu: expected -18.18 as by another name'),
    'a minus before a name': ('a.m', BLUEROV2 + '-Yp = 0.3', LIST, 'Yp: expected a number'),
    'a row of words': ('a.m', BLUEROV2 + 'Yrdot  -1.93', LIST, 'Yrdot: expected Yrdot = a'),
    'a row of a table': ('a.m', BLUEROV2 + '| Yp | -1.93 |', LIST, 'Yp: expected Yp = a number'),
    'coefficients of a shape': ('a.yaml', f'{REXROV}type: box\n', [], 'type: expected fossen'),
    'of a round one': ('a.yaml', f'{REXROV}type: Spheroid\n', [], 'type: expected fossen'),
    'numbers that do not count': (
        'a.sdf', sdf().replace('<inertial>', '<inertial auto="true">'), [], 'link.inertial.auto'),
    'nondimensional': ('a.m', BLUEROV2 + "Xvv' = 0.01", [], 'a prime'),
    'a letter for a digit': ('a.m', BLUEROV2.replace('Mq = -0.07', 'Mq = -6O'), LIST, 'Mq'),
    'a product': ('a.m', BLUEROV2.replace('Mq = -0.07', 'Mq = -6*10'), LIST, 'Mq'),
    'a decimal comma': ('a.m', BLUEROV2.replace('Mq = -0.07', 'Mq = -60,5'), LIST, 'Mq'),
    'pounds': ('a.m', BLUEROV2.replace('m = 11.5', 'm = 25 lb'), LIST, 'm: expected a number'),
    'millimetres': ('a.m', BLUEROV2.replace('m = 11.5', 'm = 11.5 mm'), LIST, 'SI unit'),
    'centimetres': ('a.m', BLUEROV2.replace('m = 11.5', 'm = 11.5 [kg cm^2]'), LIST, 'SI unit'),
    'grams': ('a.m', BLUEROV2.replace('m = 11.5', 'm = 11.5 (g)'), LIST, 'SI unit'),
    'a formula': ('a.m', BLUEROV2 + 'V = m/rho', [], 'V: expected a number'),
    'no gravity': ('a.m', BLUEROV2, [*LIST, '--gravity', '0'], 'environment.gravity'),
    'no weight': ('a.m', BLUEROV2.replace('m = 11.5', 'm = 0'), LIST, 'm: expected a positive'),
    'against physics': (
        'a.m', BLUEROV2.replace('Iz = 0.16', 'Iz = 16'), ['--inertia-reference', 'co'], 'triangle'),
}  # fmt: skip


@pytest.mark.parametrize('what', REFUSED)
def test_refusals_are_one_line(what, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    name, text, options, word = REFUSED[what]
    (tmp_path / name).write_text(text, encoding='utf-8')
    with pytest.raises(SystemExit) as end:
        main(['import-vehicle', name, *options, '--out', 'made.yaml'])
    captured = capsys.readouterr()
    assert (end.value.code, len(captured.err.splitlines()), captured.out) == (2, 1, ''), (
        captured.err
    )
    assert word in captured.err
    assert 'expected' in captured.err
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_the_file_that_is_read_is_never_replaced(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path('list.m').write_text(BLUEROV2, encoding='utf-8')
    with pytest.raises(SystemExit) as end:
        main(['import-vehicle', 'list.m', *LIST, '--out', 'list.m', '--overwrite'])
    assert end.value.code == 2
    assert 'list.m: --out' in capsys.readouterr().err
    assert Path('list.m').read_text(encoding='utf-8') == BLUEROV2


@pytest.mark.parametrize('unit', ['N m s', '[N m s/rad]', 'kg m^2/s', '(Nms)', 'kg·m²/s'])
def test_a_number_may_have_its_unit(imported, unit):
    vehicle, _ = imported('list.m', BLUEROV2.replace('Mq = -0.07', f'Mq = -0.07 {unit}'), *LIST)
    assert vehicle.D_linear[4, 4] == 0.07
