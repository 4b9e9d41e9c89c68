"""What `auv check-vehicle` says, against identities, the paper's numbers and a free oscillation."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
import yaml
from helpers.foreign_vehicles import REMUS, REMUS_LIFT
from helpers.strategies import QUICK, vehicles
from hypothesis import given
from numpy.testing import assert_allclose
from rich.console import Console

from auv_analysis.cli.main import main
from auv_analysis.metrics.coupling import delta_pi, delta_xi
from auv_analysis.studies.check_vehicle import (
    _cruise_table,
    _hydrostatics_table,
    _munk,
    check_vehicle,
    print_check,
)
from auv_dynamics import load_vehicle
from auv_dynamics.files.shipped import shipped
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.kinematics import jacobian
from auv_dynamics.vehicle.vehicle import munk_terms
from auv_gvc_controller import decompose

NAMES = sorted(path.stem for path in shipped('vehicles', 'herman2018').parent.glob('*.yaml'))
KEYS = {'name', 'source', 'M', 'N', 'Upsilon', 'inertia', 'couplings', 'structural_zeros',
        'statement', 'hydrostatics', 'damping', 'cruise', 'thrusters', 'sampling',
        'warnings'}  # fmt: skip


@pytest.fixture
def written(tmp_path):
    def write(data):
        path = tmp_path / 'vehicle.yaml'
        path.write_text(yaml.safe_dump(data), encoding='utf-8')
        return path

    return write


def file_of(name):
    return yaml.safe_load(shipped('vehicles', name).read_text(encoding='utf-8'))


@pytest.mark.parametrize('name', NAMES)
def test_one_document_ready_for_json(name):
    document = check_vehicle(name)
    assert set(document) == KEYS
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    vehicle = load_vehicle(name)
    assert document['name'] == name
    assert document['warnings'] == list(vehicle.warnings)
    U = np.array(document['Upsilon'])
    assert_allclose(U.T @ vehicle.M @ U, np.diag(document['N']), atol=1e-9 * vehicle.M.max())
    moments = document['inertia']['eigenvalues']
    assert sum(moments) == pytest.approx(np.trace(vehicle.M))
    assert document['inertia']['condition_number'] == pytest.approx(np.linalg.cond(vehicle.M))


def coupled(document, key, vector):
    """delta of the listed entries for a velocity or wrench."""
    total = np.zeros(6)
    for entry in document['couplings']:
        if key in entry:
            total[DOFS.index(entry['to'])] += entry[key] * vector[DOFS.index(entry['from'])]
    return total


@QUICK
@given(vehicles())
def test_the_listed_couplings_are_all_there_are(tmp_path_factory, data):
    path = tmp_path_factory.mktemp('vehicle') / 'vehicle.yaml'
    path.write_text(yaml.safe_dump(data), encoding='utf-8')
    document, M = check_vehicle(path), load_vehicle(path).M
    U, _ = decompose(M)
    nu, tau = np.arange(1.0, 7.0), np.array([3.0, -1.0, 4.0, 1.0, -5.0, 9.0])
    assert_allclose(coupled(document, 'delta_xi', nu), delta_xi(np.linalg.inv(U), nu), atol=1e-9)
    assert_allclose(coupled(document, 'delta_pi', tau), delta_pi(U, tau), atol=1e-9)
    for key in ('delta_xi', 'delta_pi'):
        deformed = {entry['to'] for entry in document['couplings'] if key in entry}
        assert deformed.isdisjoint(document['structural_zeros'][key])
        assert len(deformed) + len(document['structural_zeros'][key]) == 6


def test_couplings_of_the_paper():
    document = check_vehicle('herman2018')
    found = {
        (entry['from'], entry['to']): (round(entry['delta_xi'], 3), entry['unit'])
        for entry in document['couplings']
        if 'delta_xi' in entry
    }
    assert found == {
        ('pitch', 'surge'): (0.025, 'm/s per rad/s'),
        ('roll', 'sway'): (-0.015, 'm/s per rad/s'),
        ('yaw', 'sway'): (0.075, 'm/s per rad/s'),
        ('pitch', 'heave'): (-0.075, 'm/s per rad/s'),
        ('yaw', 'roll'): (0.514, 'rad/s per rad/s'),
    }
    units = {(e['from'], e['to']): e['unit'] for e in document['couplings'] if 'delta_pi' in e}
    assert units['surge', 'pitch'] == 'N m per N'
    assert units['roll', 'yaw'] == 'N m per N m'
    assert document['structural_zeros'] == {
        'delta_xi': ['pitch', 'yaw'], 'delta_pi': ['surge', 'sway', 'heave']
    }  # fmt: skip
    assert_allclose(document['N'], [300, 500, 500, 39.988, 175.5, 141.114], atol=5e-4)
    assert document['statement'] == ('M is not diagonal: 5 couplings of velocities by its inertia')


@pytest.mark.parametrize('name', ['bluerov2_heavy', 'lauv', 'lrauv_tethys'])
def test_a_diagonal_M_is_said_to_have_no_coupling(name):
    document = check_vehicle(name)
    assert document['couplings'] == []
    assert 'no inertial coupling' in document['statement']
    assert document['structural_zeros'] == {'delta_xi': list(DOFS), 'delta_pi': list(DOFS)}


def test_one_coupling_is_one(written):
    data = file_of('bluerov2_heavy')
    data['added_mass'] = np.diag([6.0, 7.0, 18.0, 0.2, 0.2, 0.2]).tolist()
    data['added_mass'][1][5] = data['added_mass'][5][1] = 0.5
    found = check_vehicle(written(data))
    assert found['statement'] == 'M is not diagonal: 1 coupling of velocities by its inertia'


def test_hydrostatics():
    found = check_vehicle('herman2018')['hydrostatics']
    assert found['difference'] == pytest.approx(1079.1, abs=0.05)
    assert found['difference_percent'] == pytest.approx(44.0)
    assert found['metacentric_height'] == pytest.approx(0.03)
    assert found['moment_when_level'] == pytest.approx([0, -250 * 9.81 * 0.15])  # bow down
    assert check_vehicle('bluerov2')['hydrostatics']['moment_when_level'] == [0, 0]


def test_hydrostatics_of_a_vehicle_whose_centres_lie_apart_in_every_axis(written):
    data = file_of('herman2018')
    data['hydrostatics']['center_of_buoyancy'] = [0.02, -0.03, -0.05]
    found = check_vehicle(written(data))['hydrostatics']
    assert found['r_G'] == [0.15, 0.0, 0.03]
    assert found['r_B'] == [0.02, -0.03, -0.05]
    assert found['metacentric_height'] == pytest.approx(0.08)
    W, B = 250 * 9.81, 360 * 9.81  # N
    assert found['moment_when_level'] == pytest.approx([0.03 * B, -0.15 * W + 0.02 * B])


def period(vehicle, axis):
    """Of a small free oscillation without damping, by the equations of motion and RK4."""

    inverse = np.linalg.inv(vehicle.M)

    def rate(x):
        return np.concatenate([jacobian(x[:6]) @ x[6:], -inverse @ vehicle.g(x[:6])])

    x, h, k, times = np.zeros(12), 0.02, 0, []
    x[axis] = 1e-4
    while len(times) < 3 and k < 1000:
        a = rate(x)
        b = rate(x + h / 2 * a)
        c = rate(x + h / 2 * b)
        before, x = x[axis], x + h / 6 * (a + 2 * b + 2 * c + rate(x + h * c))
        if before < 0 <= x[axis]:
            times.append(h * (k + before / (before - x[axis])))
        k += 1
    return np.diff(times).mean()


@pytest.mark.parametrize('name', ['bluerov2', 'bluerov2_heavy', 'girona500'])
@pytest.mark.parametrize('dof', ['roll', 'pitch'])
def test_periods_are_those_of_a_free_oscillation(name, dof):
    mode = check_vehicle(name)['hydrostatics']['modes'][dof]
    assert mode['period'] == pytest.approx(period(load_vehicle(name), DOFS.index(dof)), rel=2e-3)
    assert mode['natural_frequency'] ** 2 == pytest.approx(mode['eigenvalue'])


def test_a_coupled_motion_is_named_by_the_angle_that_has_most_of_it(written):
    data = file_of('bluerov2_heavy')
    data['rigid_body']['inertia'][0][1] = data['rigid_body']['inertia'][1][0] = 0.02
    both = (
        check_vehicle(one)['hydrostatics']['modes'] for one in ('bluerov2_heavy', written(data))
    )
    alone, found = ([modes[dof]['eigenvalue'] for dof in ('roll', 'pitch')] for modes in both)
    assert found[0] < alone[0] < alone[1] < found[1], 'a coupling drives them apart'


@pytest.mark.parametrize('name', NAMES)
def test_frequencies_are_those_of_all_twelve_states(name):
    vehicle, small = load_vehicle(name), 1e-6

    def rate(x):
        nu_dot = np.linalg.solve(vehicle.M, -vehicle.g(x[:6]))
        return np.concatenate([jacobian(x[:6]) @ x[6:], nu_dot])

    steps = small * np.eye(12)
    A = np.stack([(rate(step) - rate(-step)) / (2 * small) for step in steps], axis=1)
    found = np.linalg.eigvals(A).imag
    for mode in check_vehicle(name)['hydrostatics']['modes'].values():
        assert np.abs(found - mode['natural_frequency']).min() < 1e-4


def test_a_vehicle_with_its_weight_above_turns_over(written):
    data = file_of('bluerov2')
    data['rigid_body']['center_of_gravity'] = [0.0, 0.0, -0.02]
    document = check_vehicle(written(data))
    assert document['hydrostatics']['metacentric_height'] == -0.02
    for mode in document['hydrostatics']['modes'].values():
        assert mode['eigenvalue'] < -8
        assert mode['natural_frequency'] is mode['period'] is None
    assert 'unstable in roll: the vehicle turns over' in printed(document)
    data['rigid_body']['center_of_gravity'] = [0.0, 0.0, 0.0]
    assert 'turns over' not in printed(check_vehicle(written(data)))


def test_a_complex_pair_of_roll_and_pitch_has_no_frequency(written):
    data = file_of('bluerov2')
    data['added_mass'] = np.diag(data['added_mass']).tolist()
    for i, j in ((0, 3), (1, 4)):  # a body that is no mirror image of itself, and floats up
        data['added_mass'][i][j] = data['added_mass'][j][i] = 0.4
    data['hydrostatics']['volume'] *= 1.3
    document = check_vehicle(written(data))
    for mode in document['hydrostatics']['modes'].values():
        assert mode['eigenvalue'] > 0
        assert mode['natural_frequency'] is mode['period'] is None
    text = printed(document)
    assert 'unstable: roll and pitch are a complex pair' in text
    assert 'turns over' not in text
    assert 'complex' not in printed(check_vehicle('bluerov2'))


def printed(document) -> str:
    out = io.StringIO()
    print_check(document, Console(file=out, width=120))
    return out.getvalue()


@pytest.mark.parametrize('name', NAMES)
def test_open_loop_rates(name):
    vehicle, found = load_vehicle(name), check_vehicle(name)['damping']
    rates = [entry['rate'] for entry in found['time_constants']]
    assert sum(rates) == pytest.approx(np.trace(np.linalg.solve(vehicle.M, vehicle.D_linear)))
    for entry in found['time_constants']:
        product = None if entry['time_constant'] is None else entry['rate'] * entry['time_constant']
        assert product == (pytest.approx(1.0) if entry['rate'] > 0 else None)
    assert sum(found['linear_symmetric_eigenvalues']) == pytest.approx(np.trace(vehicle.D_linear))
    assert min(found['linear_symmetric_eigenvalues']) >= -1e-12


def test_the_symmetric_part_of_a_damping_that_is_not_symmetric(written):
    D = np.diag([1.0, 5.0, 2.0, 9.0, 8.0, 5.0])
    D[1, 5] = 4.0  # half of it on either side: 5 - 2 and 5 + 2
    data = file_of('bluerov2_heavy')
    data['damping']['linear'] = D.tolist()
    found = check_vehicle(written(data))['damping']['linear_symmetric_eigenvalues']
    assert found == pytest.approx([1.0, 2.0, 3.0, 7.0, 8.0, 9.0])


def test_time_constants_that_can_be_read_off():
    by_name = {}
    for name in ('girona500', 'lauv', 'lrauv_tethys'):
        entries = check_vehicle(name)['damping']['time_constants']
        by_name[name] = {entry['mostly']: entry['time_constant'] for entry in entries}
    assert by_name['girona500']['yaw'] == pytest.approx(8 / 130)
    assert by_name['girona500']['surge'] is None
    assert by_name['lauv']['roll'] == pytest.approx(0.04 / 0.3)
    assert by_name['lauv']['surge'] == pytest.approx(19 / 2.4)
    assert set(by_name['lrauv_tethys'].values()) == {None}


def test_thrusters():
    assert check_vehicle('lauv')['thrusters'] is None
    heavy = check_vehicle('bluerov2_heavy')['thrusters']
    assert (heavy['rank'], heavy['unactuated']) == (6, {})
    assert heavy['largest']['surge'] == pytest.approx([4 * 40.2 / np.sqrt(2)] * 2)
    assert heavy['largest']['heave'] == pytest.approx([4 * 40.2, 4 * 51.5])  # up, down
    assert heavy['largest']['yaw'] == pytest.approx([4 * 40.2 * 0.267 / np.sqrt(2)] * 2)
    light = check_vehicle('bluerov2')['thrusters']
    assert (light['rank'], light['unactuated']) == (5, {'pitch': ['surge', 'heave']})
    assert light['largest']['pitch'] is None
    assert light['largest']['heave'] == pytest.approx([2 * 40.2, 2 * 51.5], rel=1e-3)


def test_limits_of_thrusters_stand_under_their_names():
    found = check_vehicle('bluerov2_heavy')['thrusters']
    thrusters = load_vehicle('bluerov2_heavy').thrusters
    assert found['forward'] == thrusters.forward.tolist()
    assert found['reverse'] == thrusters.reverse.tolist()
    assert found['matrix'] == thrusters.matrix.tolist()
    assert found['names'] == list(thrusters.names)


def test_rotors(capsys, approved):
    found = check_vehicle('bluerov2_heavy')['thrusters']['rotors']
    assert len(found) == 8
    assert found[0] == found[7]
    assert (found[0]['curve'], found[0]['voltage'], found[0]['lag']) == ('t200_16v', 16.0, 0.029)
    assert found[0]['dead_band'] == [0.35, 0.4]
    assert found[0]['command_without_thrust'] == [1472.0, 1528.0]
    assert 'Blue Robotics T200' in found[0]['source']
    assert 'September-2019' in found[0]['source']
    assert check_vehicle('girona500')['thrusters'] is None
    main(['check-vehicle', 'bluerov2_heavy'])
    text = capsys.readouterr().out
    approved.add(text.splitlines())
    named = 'rotor of T1, T2, T3, T4, T5, T6, T7, T8: t200_16v, -39.9 to 51.44 N'
    assert f'{named}, none from 1472 to 1528 pwm_us, 16 V, dead band 0.35 and 0.4 N, lag' in text
    assert text.count('source: Blue Robotics T200') == 1


def test_rotors_of_a_file_have_no_source(written, capsys):
    data = file_of('bluerov2_heavy')
    table = {'percent': [-90.0, -10.0, 15.0, 95.0], 'thrust_n': [-41.0, 0.0, 0.0, 52.5]}
    rotors = [{'curve': table, 'lag': 0.1, 'lag_at': 20.0},
              {'omega': 25.0, 'zeta': 0.7, 'dead_band': [0.2, 0.3]}]  # fmt: skip
    for one, thruster in enumerate(data['thrusters']):
        thruster['rotor'] = rotors[one % 2]
    path = written(data)
    one, other, *_ = check_vehicle(path)['thrusters']['rotors']
    assert one == {
        'curve': 'table of the file', 'source': None, 'thrust': [-41.0, 52.5], 'voltage': None,
        'command_without_thrust': [-10.0, 15.0], 'command_unit': 'percent',
        'dead_band': [0.0, 0.0], 'lag': 0.1, 'lag_at': 20.0, 'omega': None, 'zeta': None,
    }  # fmt: skip
    assert other == {
        'curve': 'square law', 'source': None, 'thrust': None, 'voltage': None,
        'command_without_thrust': None, 'command_unit': None, 'dead_band': [0.2, 0.3],
        'lag': None, 'lag_at': None, 'omega': 25.0, 'zeta': 0.7,
    }  # fmt: skip
    main(['check-vehicle', str(path)])
    text = capsys.readouterr().out
    assert 'source: Blue' not in text
    assert (
        'rotor of T1, T3, T5, T7: table of the file, -41 to 52.5 N, none from -10 to 15 percent, '
        'voltage unknown, dead band 0 and 0 N, lag 0.1 s at 20 N, by 1/sqrt(thrust)\n'
    ) in text
    assert (
        'rotor of T2, T4, T6, T8: square law, voltage unknown, dead band 0.2 and 0.3 N, '
        'second order, 25 rad/s, damping ratio 0.7\n'
    ) in text


def test_largest_steps():
    found = check_vehicle('lauv')['sampling']
    assert found['cl']['rate'] == pytest.approx(12 / 0.04)
    assert found['cl']['mostly'] == 'roll'
    assert found['cl']['rings_above'] == pytest.approx(0.04 / 12)
    assert found['cl']['unstable_above'] == pytest.approx(0.08 / 12)
    for name in NAMES:
        gvc = check_vehicle(name)['sampling']['gvc']
        assert (gvc['rate'], gvc['rings_above'], gvc['unstable_above']) == (12.0, 1 / 12, 1 / 6)


@pytest.mark.parametrize('name', NAMES)
def test_the_tables_carry_the_numbers(name, capsys):
    document = check_vehicle(name)
    text = printed(document)
    for entry in document['couplings']:
        value = entry.get('delta_xi', entry.get('delta_pi'))
        row = [entry['from'], entry['to'], f'{value:+.4g}', *entry['unit'].split()]
        assert row in [line.split() for line in text.splitlines()]
    for expected in (document['statement'], f'{document["hydrostatics"]["weight"]:.1f} N'):
        assert expected in text
    for warning in document['warnings']:
        assert f'warning: {warning}' in text
    assert ('thrusters, T has rank' in text) == (document['thrusters'] is not None)
    print_check(document | {'source': ''})
    text = capsys.readouterr().out
    assert document['statement'] in text
    assert text.startswith(f'{name}: no source is given\n')


def test_command_prints_tables_or_one_document(capsys, approved):
    main(['check-vehicle', 'bluerov2'])
    captured = capsys.readouterr()
    approved.add(captured.out.splitlines())
    assert 'pitch cannot be actuated apart from surge and heave' in captured.out
    assert captured.err == ''
    main(['check-vehicle', 'bluerov2', '--json'])
    captured = capsys.readouterr()
    assert json.loads(captured.out) == check_vehicle('bluerov2')
    assert captured.out.count('\n') == 1


@pytest.mark.parametrize('options', [[], ['--json']])
def test_command_refuses_a_bad_file_in_one_line(options, written, capsys):
    path = written(file_of('bluerov2') | {'added_mass': [1, 1, 1, 1, 1, -1]})
    with pytest.raises(SystemExit) as caught:
        main(['check-vehicle', str(path), *options])
    assert caught.value.code == 2
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err.startswith(f'{path}: added_mass: expected a positive semidefinite matrix')
    assert captured.err.count('\n') == 1


def cruise(vehicle_file, *options):
    return check_vehicle(vehicle_file, *options)['cruise']


def test_poles_of_a_torpedo_without_and_with_lift(tmp_path, monkeypatch, capsys):
    """REMUS of Prestero 2001: its published lift halves the growth, and leaves it unstable."""
    monkeypatch.chdir(tmp_path)
    growth = {}
    for name, text in (('bare', REMUS), ('with_lift', REMUS + REMUS_LIFT)):
        (tmp_path / f'{name}.m').write_text(text)
        options = ['--inertia-reference', 'co', '--lift', 'combined', '--json']
        main(['import-vehicle', f'{name}.m', *options, '--out', f'{name}.yaml'])
        capsys.readouterr()
        main(['check-vehicle', f'{name}.yaml', '--speed', '1.5', '--json'])
        found = json.loads(capsys.readouterr().out)['cruise']
        assert (found['verdict'], found['speed']) == ('unstable', 1.5)
        assert ('no lift' in found['hint']) == (name == 'bare')
        growth[name] = max(mode['pole'][0] for mode in found['modes'])
    assert 1.8 < growth['bare'] < 2.2
    assert 0.9 < growth['with_lift'] < 1.1


def test_poles_ahead_say_whether_a_vehicle_keeps_its_course(written):
    assert cruise('lauv')['verdict'] == 'stable'
    assert cruise('lauv')['speed'] == 2.0
    data = file_of('lauv')
    del data['lift']
    bare = cruise(written(data), 2.0)
    assert (bare['verdict'], bare['speed_source']) == ('unstable', 'given')
    assert 'key lift' in bare['hint']
    slow = cruise(written(data), 1.5)
    assert (slow['verdict'], slow['hint']) == ('unstable', bare['hint']), 'however slowly'
    other = cruise(written(data | {'name': 'other'}))
    assert (other['speed_source'], other['speed']) == ('assumed', 1.0)
    data['added_mass'] = [1.0, 16.0, 0.5, 0.01, 1.0, 1.0]
    M = load_vehicle(written(data)).M
    assert munk_terms(M)[5, 1] < 0, 'it is turned in yaw'
    assert munk_terms(M)[4, 2] <= 0, 'and not in pitch'
    only = cruise(written(data), 2.0)
    assert (only['verdict'], only['hint'][:15]) == ('unstable', 'the Munk moment')
    data['damping'] = {'linear': [0.0] * 6, 'quadratic': [0.0] * 6}
    at_rest = cruise(written(data), 0.0)
    assert (at_rest['speed'], at_rest['speed_source']) == (0.0, 'given')
    assert (at_rest['verdict'], at_rest['hint']) == ('marginal', None)
    heavy_above = file_of('bluerov2') | {'added_mass': [20.0, 5.0, 5.0, 0.1, 0.1, 0.1]}
    heavy_above['rigid_body']['center_of_gravity'] = [0.0, 0.0, -0.02]
    turns_over = cruise(written(heavy_above), 1.0)
    assert (turns_over['verdict'], turns_over['hint']) == ('unstable', None)
    heavy_above['added_mass'][1] = 25.0
    turned = cruise(written(heavy_above), 1.0)
    assert (turned['verdict'], turned['hint']) == ('unstable', None), 'as it does at rest'
    assert cruise(written(heavy_above), 0.0)['hint'] is None


@pytest.mark.parametrize(
    ('changes', 'title', 'said'),
    [
        ({'speed_source': 'assumed'}, '(assumed, see --speed)', 'stable at 2 m/s without control'),
        ({'speed_source': 'given', 'verdict': 'marginal'}, '(--speed)',
         'marginal at 2 m/s without control: no unstable pole, one does not decay, in yaw first'),
        ({'verdict': 'unstable', 'hint': 'more fins'}, '(its top speed)',
         'unstable at 2 m/s without control: it leaves straight motion, in yaw first'),
    ],
)  # fmt: skip
def test_what_is_said_of_straight_motion(changes, title, said):
    out = io.StringIO()
    _cruise_table(cruise('lauv') | {'mostly': 'yaw'} | changes, Console(file=out, width=120))
    lines = [line.strip() for line in out.getvalue().splitlines()]
    assert f'poles straight ahead at 2 m/s {title}' in lines
    assert said in lines
    assert ('hint: more fins' in lines) == ('hint' in changes)


@pytest.mark.parametrize(('eigenvalue', 'turns'), [(-1e-3, True), (0.0, False), (2.0, False)])
def test_what_turns_over_is_said(eigenvalue, turns):
    out, found = io.StringIO(), check_vehicle('herman2018')['hydrostatics']
    found['modes']['pitch']['eigenvalue'] = eigenvalue
    _hydrostatics_table(found, Console(file=out, width=120))
    assert ('unstable in pitch: the vehicle turns over' in out.getvalue()) is turns
    assert 'unstable in roll' not in out.getvalue()
    assert 'not level at rest: 0 N m in roll, −367.9 N m in pitch' in out.getvalue()


@pytest.mark.parametrize(
    ('sway', 'heave', 'turned'),
    [(0.0, 0.0, False), (0.5, 0.0, True), (0.0, 0.5, True), (-1.0, -1.0, False)],
)
def test_what_turns_a_vehicle_across_the_flow(sway, heave, turned):
    vehicle = load_vehicle('lauv')
    M = np.diag([30.0, 30.0 + sway, 30.0 + heave, 1.0, 2.0, 3.0])
    assert (_munk(replace(vehicle, M=M)) is not None) == turned


def test_with_lift_a_hint_lays_it_to_too_little():
    assert _munk(load_vehicle('lauv')) == (
        'the Munk moment of the added mass turns it across the flow; lift and damping are too '
        'small against it'
    )


def test_the_munk_moment_of_a_torpedo():
    X_udot, Y_vdot = -0.93, -35.5
    M_A = -np.diag([X_udot, Y_vdot, Y_vdot, -0.0704, -4.88, -4.88])
    assert munk_terms(M_A)[5, 1] == pytest.approx(Y_vdot - X_udot)


def test_munk_terms_are_the_slopes_of_the_coriolis_wrench():
    M = load_vehicle('rexrov').M
    vehicle, h = load_vehicle('rexrov'), 1e-6
    for j in range(1, 6):
        ahead, slip = np.eye(6)[0], h * np.eye(6)[j]
        slope = [-vehicle.C(ahead + s * slip) @ (ahead + s * slip) for s in (1, -1)]
        assert_allclose(munk_terms(M)[:, j], (slope[0] - slope[1]) / (2 * h), rtol=1e-7, atol=1e-4)
