"""`auv identify` and `auv predict` on bags: our own and others', with their refusals."""

import json
import os
import re
import sys
from argparse import Namespace
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers import sea_trials
from helpers.foreign_bags import Maker, motion, simple, write
from helpers.report_pages import check_numbers
from pyarrow import parquet

from auv_analysis.cli import identify as identify_command
from auv_analysis.cli import predict as predict_command
from auv_analysis.cli.main import main, parser
from auv_analysis.output.folder import results_folder
from auv_analysis.report.results import Results
from auv_analysis.studies.identify import bags, identify, prediction
from auv_analysis.studies.identify.bags import _not_acting, read_records
from auv_analysis.studies.identify.vehicle_text import write_vehicle
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.files.shipped import shipped
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle_file import load_vehicle


def auv(capsys, *arguments: object) -> tuple[int, str]:
    """Exit code and standard error of a command."""
    code = 0
    try:
        main([str(argument) for argument in arguments])
    except SystemExit as ended:
        code = ended.code
    return code, capsys.readouterr().err


def recording(folder, duration, rates=1.0):
    """A trial as our nodes would record it: odometry with noise, commanded wrench."""
    record, run = sea_trials.trial(folder, 'herman2018', 5, duration=duration)
    part = motion(run, enu=False)
    twist = record.velocity * ([1.0] * 3 + [rates] * 3)
    noisy = part._replace(attitude=record.attitude[:, [1, 2, 3, 0]], twist=twist)
    frames = 'odom_ned', 'base_link_fsd'
    return write(folder / 'bag', simple(noisy, Maker(), '/odom', '/wrench', frames), Maker())


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return recording(tmp_path_factory.mktemp('trial'), 60.0)


@pytest.fixture(scope='module')
def short(tmp_path_factory):
    """What is refused before anything is identified, whatever its length."""
    return recording(tmp_path_factory.mktemp('short'), 6.0)


@pytest.fixture(scope='module')
def brief(tmp_path_factory):
    """Another one of three seconds."""
    return recording(tmp_path_factory.mktemp('brief'), 3.0)


@pytest.fixture(scope='module')
def identified(bag, tmp_path_factory, composing):
    out = tmp_path_factory.mktemp('found') / 'identified'
    with composing():
        main(['identify', str(bag), '--vehicle', 'herman2018', '--out', str(out)])
    return out


def test_all_that_the_report_shows(identified, approved):
    approved.folder(identified)


def test_a_bag_becomes_a_vehicle_file(identified):
    vehicle = load_vehicle(identified / 'vehicle.yaml')
    truth = load_vehicle('herman2018')
    assert np.diag(vehicle.M) == pytest.approx(np.diag(truth.M), rel=0.01)
    assert vehicle.M[4, 2] == pytest.approx(truth.M[4, 2], rel=0.05)
    text = (identified / 'vehicle.yaml').read_text(encoding='utf-8')
    assert 'M.surge.surge: identified' in text
    document = json.loads((identified / 'identify.json').read_text(encoding='utf-8'))
    assert document['file'] == 'vehicle.yaml'
    rows = parquet.read_table(identified / 'coefficients.parquet').to_pylist()
    surge = next(row for row in rows if row['name'] == 'M.surge.surge')
    assert surge['low'] < vehicle.M[0, 0] < surge['high']
    listed = {row['name']: row for row in document['parameters']}
    assert listed['M[0][0]'] == {
        'name': 'M[0][0]', 'unit': 'kg', 'identifiable': True,
        **{key: surge[key] for key in ('value', 'low', 'high', 'prior')},
        'std': surge['deviation'],
    }  # fmt: skip
    assert {'M[4][2]', 'D_linear[5][5]', 'D_quadratic[0][0]', 'lag', 'delay'} <= listed.keys()
    for row in document['prediction']:
        assert 0.0 < row['model'] < row['persistence']
        assert row.keys() == {'horizon', 'model', 'prior', 'persistence', 'black_box'}
    found = {row['name']: row for row in document['couplings']}
    pitch = found['delta_pi_max.pitch']
    assert pitch['low'] < pitch['value'] < pitch['high']
    assert {'delta_xi_max.sway', 'N.yaw', 'share.surge', 'Upsilon.pitch.heave'} <= found.keys()
    for name in ('predictions', 'inertia', 'deformation', 'shares', 'whiteness'):
        assert (identified / f'{name}.parquet').exists()
    assert check_numbers(identified) > 200
    page = (identified / 'report.html').read_text(encoding='utf-8')
    assert 'What was identified' in page
    assert 'residuals are white' in document['residuals']


def test_a_bag_of_its_own_is_held_out(short, brief):
    given = ['identify', str(short), str(short), '--vehicle', 'herman2018', '--holdout', str(brief)]
    with pytest.raises(InputError, match='--holdout: expected a bag that nothing is learned from'):
        identify_command.read(parser().parse_args([*given[:-1], str(short)]), 'identify')
    trial = identify_command.read(parser().parse_args(given), 'identify')
    assert [round(one.end) for one in (*trial.training, *trial.held)] == [6, 3]
    assert trial.inputs == [short, short, brief, shipped('vehicles', 'herman2018')]
    assert trial.out == Path('runs/identify_herman2018')


@pytest.mark.usefixtures('unrendered')
def test_intervals_on_request_stand_beside_the_others(bag, tmp_path, approved, capsys):
    out = tmp_path / 'asked'
    fewer = ('--part', '0:20', '--fixed', 'M', '--fixed', 'D_quadratic')
    asked = ('--bootstrap', 40, '--profile', 'lag')
    given = ('identify', bag, '--vehicle', 'herman2018', '--out', out)
    main([str(argument) for argument in (*given, *fewer, *asked)])
    printed = capsys.readouterr()
    assert '  profile likelihood 1 of 1: lag\n' in printed.err
    rows = parquet.read_table(out / 'coefficients.parquet').to_pylist()
    lag = next(row for row in rows if row['name'] == 'lag')
    assert lag['bootstrap_low'] < lag['value'] < lag['bootstrap_high']
    assert lag['profile_low'] < lag['value'] < lag['profile_high']
    assert parquet.read_table(out / 'profiles.parquet').num_rows >= 5
    assert (out / 'figures' / 'profiles.png').exists()
    approved.folder(out)
    approved.add(printed.out.splitlines())


@pytest.mark.usefixtures('undrawn')
def test_the_file_predicts_the_recording(bag, identified, tmp_path, monkeypatch, capsys):
    read = predict_command.read
    monkeypatch.setattr(predict_command, 'read', lambda *a: read(*a)._replace(notes=['odd']))
    vehicle = identified / 'vehicle.yaml'
    lag = ('--lag', sea_trials.LAG, '--delay', sea_trials.DELAY)
    main(['predict', *map(str, (bag, '--vehicle', vehicle, '--out', tmp_path / 'p', *lag))])
    printed = capsys.readouterr().out
    document = json.loads((tmp_path / 'p' / 'predict.json').read_text(encoding='utf-8'))
    assert 'better than persistence and better than black box' in document['verdict']
    assert document['notes'] == ['odd']
    assert (document['vehicle'], document['held_out'][0]['name']) == (
        'herman2018_identified', bag.name
    )  # fmt: skip
    assert document['verdict'] in ' '.join(printed.split())
    assert 'Open-loop prediction of what was held out' in printed
    assert (tmp_path / 'p' / 'figures' / 'prediction.png').exists()


@pytest.mark.usefixtures('undrawn')
def test_a_prediction_is_one_document_where_it_is_asked_for(short, tmp_path, monkeypatch, capsys):
    numbers = ('error', 'linear', 'angular', 'ratio', 'ratio_low', 'ratio_high')
    rows = [{'predictor': name, 'horizon': 0.5, **dict.fromkeys(numbers, 0.5)}
            for name in ('persistence', 'black box')]  # fmt: skip
    monkeypatch.setattr(identify, 'compared', lambda *_, **__: rows)
    given = ('predict', short, '--vehicle', 'herman2018', '--out', tmp_path / 'p', '--json')
    main([*map(str, given)])
    found = json.loads((tmp_path / 'p' / 'predict.json').read_text())
    assert json.loads(capsys.readouterr().out) == found


@pytest.mark.usefixtures('undrawn')
def test_a_recording_that_contradicts_the_prior_gives_no_file(tmp_path, monkeypatch, capsys):
    bag = recording(tmp_path, 10.0)
    out, found, prior = tmp_path / 'other', [], tmp_path / 'prior.yaml'
    prior.write_bytes(shipped('vehicles', 'rexrov').read_bytes())

    def once(*given, work=identify.identify):
        found.append(found[0] if found else work(*given))
        prior.write_text('edited meanwhile')
        return found[0]

    monkeypatch.setattr(identify, 'identify', once)
    fewer = ('--part', '0:5', '--part', '5:10', '--free', 'M.diagonal', '--free', 'D_linear')
    given = ('identify', bag, '--vehicle', prior, '--out', out, *fewer)
    with pytest.raises(SystemExit) as end:
        main([*map(str, given), '--json'])
    said = capsys.readouterr()
    assert end.value.code == 1
    assert 'another vehicle' in said.err
    assert '  least squares\n' in said.err, 'how far it is'
    assert json.loads(said.out) == json.loads((out / 'identify.json').read_text())
    assert not (out / 'vehicle.yaml').exists()
    page = (out / 'report.html').read_text(encoding='utf-8')
    assert 'No vehicle file: ' in page
    assert f'>from {bag.name}<' in page, 'once, whatever its stretches'
    prior.write_bytes(shipped('vehicles', 'rexrov').read_bytes())
    code, said = auv(capsys, *given, '--accept', '--overwrite', '--no-report')
    assert (code, len(found)) == (0, 2), said
    assert (out / 'vehicle.yaml').exists()
    assert not (out / 'report.html').exists()
    document = json.loads((out / 'identify.json').read_text())
    assert document['file'] == 'vehicle.yaml'
    assert document['verdict'].startswith('The new model ')
    vehicle = load_vehicle(out / 'vehicle.yaml')
    assert vehicle.name == 'rexrov_identified'
    assert vehicle.source.startswith(f'identified from {bag.name}; prior: V. Berg')
    listed = {row['name']: row['value'] for row in document['parameters']}
    diagonal = [listed[f'M[{i}][{i}]'] for i in range(6)]  # of which some lie below M_RB
    assert np.diag(vehicle.M) == pytest.approx(diagonal, rel=1e-5)


def test_what_acted_less_is_told_of_forces_and_moments_apart() -> None:
    command = np.tile([1000.0, 0.5, 900.0, 0.5, 0.2, 1e-4], (9, 1))
    acting = np.tile([500.0, 0.0, 900.0, 0.1, 0.2, 0.0], (9, 1))
    (note,) = _not_acting(command, acting)
    assert note.startswith('surge and roll: much less acted'), 'what is left is rounding'
    assert list(_not_acting(command, 0.7 * command)) == [], 'a lag may do it'


def test_the_wrench_that_acted_takes_the_place_of_the_command_and_the_truth_that_of_nothing(
    tmp_path, monkeypatch, capsys
):
    notes = []
    monkeypatch.setattr(bags, 'contradictions', lambda *_: ['odd'])
    _, run = sea_trials.trial(tmp_path, 'herman2018', 5, duration=3.0)
    seen, frames = motion(run, enu=False), ('odom_ned', 'base_link_fsd')
    truth = seen._replace(twist=seen.twist + 0.01)
    half = seen._replace(tau=0.5 * seen.tau)
    messages = simple(seen, Maker(), '/odom', '/wrench', frames)
    messages += simple(truth, Maker(), '/ground_truth/odom', '/wrench_applied', frames, tau=half)
    bag, vehicle = write(tmp_path / 'bag', messages, Maker()), load_vehicle('herman2018')
    (asked,), (acted,) = (
        read_records(bag, vehicle, None, applied=applied, notes=notes) for applied in (False, True)
    )
    assert notes.count('odd') == 2
    (note,) = (text for text in notes if 'much less acted than was commanded' in text)
    assert capsys.readouterr().err == f'warning: {bag}: {note}\n'
    np.testing.assert_allclose(acted.command, 0.5 * asked.command, atol=1e-9)
    assert np.abs(asked.command).max() > 1.0
    np.testing.assert_allclose(acted.velocity, run.nu, atol=1e-9)
    messages = simple(seen, Maker(), '/a/odom', '/wrench', frames)
    messages += simple(truth, Maker(), '/b/odom', '/thrust', frames)
    said = 'odometry: expected one topic odom, or .*, found /a/odom, /b/odom'
    with pytest.raises(InputError, match=said):
        read_records(
            write(tmp_path / 'two', messages, Maker()), vehicle, None, applied=False, notes=[]
        )


def test_a_reset_cuts_a_bag_and_is_told(tmp_path, monkeypatch, capsys):
    _, run = sea_trials.trial(tmp_path, 'herman2018', 5, duration=3.0)
    seen = motion(run, enu=False)
    late = seen._replace(twist=seen.twist + np.outer(run.t > 1.51, [0.3, 0, 0, 0, 0, 0]))
    messages = simple(late, Maker(), '/odom', '/wrench', ('odom_ned', 'base_link_fsd'))
    bag, notes = write(tmp_path / 'bag', messages, Maker()), []
    records = read_records(bag, load_vehicle('herman2018'), None, applied=False, notes=notes)
    assert [(one.start, one.end) for one in records] == [(0.0, 1.5), pytest.approx((1.52, 3.0))]
    assert notes[-1] == 'the velocity jumps at 1.52 s, as by a reset: cut there'
    assert capsys.readouterr().err == f'warning: {bag}: {notes[-1]}\n'
    monkeypatch.chdir(bag)
    here = read_records(Path(), load_vehicle('herman2018'), None, applied=False, notes=[])
    assert {one.name for one in (*records, *here)} == {'bag'}, 'also where it is `.`'


def test_a_vehicle_that_no_command_takes_gives_no_file(tmp_path):
    data = yaml.safe_load(shipped('vehicles', 'lauv').read_text(encoding='utf-8'))
    results = Results('identify', {'file': 'vehicle.yaml', 'contradictions': [], 'verdict': ''})
    write_vehicle(yaml.safe_dump(data), results, tmp_path)
    assert load_vehicle(tmp_path / 'vehicle.yaml').name == 'lauv'
    (tmp_path / 'vehicle.yaml').unlink()
    data['damping']['linear'][5][5] = 0.0
    write_vehicle(yaml.safe_dump(data), results, tmp_path)
    assert not (tmp_path / 'vehicle.yaml').exists()
    assert results.facts['file'] == ''
    assert 'No vehicle file: ' in results.facts['verdict']
    assert 'damping.linear: expected a positive semidefinite' in results.facts['verdict']


@pytest.mark.parametrize(
    ('extra', 'said'),
    [
        (('--free', 'D_lin'), 'nearest: D_linear'),
        (('--holdout', '0.91'), '--holdout: expected a number'),
        (('--part', '100:200'), '--part: expected a time up to'),
        (('--part', '5:2'), 'argument --part'),
        (('--part', '2:6', '--part', '0:3'), '--part: expected parts that do not overlap'),
        (('--observer', '1'), 'argument --observer: expected'),
        (('--bootstrap', '39'), 'argument --bootstrap: expected'),
        (('--segment', '0'), 'argument --segment: expected'),
        (('--profile', 'mass'), '--profile: expected one of'),
        (('--profile', 'delay'), 'restoring, lag or a part of it, found delay'),
        (
            [f'--fixed={name}' for name in ('M', 'D_linear', 'D_quadratic', 'restoring', 'lag')],
            '--free: expected a coefficient that is free, beside the delay, found none',
        ),
        (('--odom', '/odom', '--wrench', '/no'), '/no'),
        (('--odom', '/odom', '--wrench', '/wrench', '--applied'), 'options: wrench_applied'),
    ],
)
def test_refusals(short, extra, said, tmp_path, capsys):
    given = ('identify', short, '--vehicle', 'herman2018', '--out', tmp_path / 'x')
    code, error = auv(capsys, *given, *extra)
    assert code == 2
    assert said in error
    assert not (tmp_path / 'x').exists()


def test_a_bag_of_less_than_a_second_is_refused(tmp_path, capsys):
    given = recording(tmp_path, 0.6), '--vehicle', 'herman2018', '--out', tmp_path / 'x'
    code, error = auv(capsys, 'identify', *given)
    assert code == 2
    assert 'expected a second and more with attitude, velocity and wrench, found none' in error


def test_a_velocity_that_never_changes_is_refused(tmp_path, capsys):
    _, run = sea_trials.trial(tmp_path, 'herman2018', 5, duration=3.0)
    seen, frames = motion(run, enu=False), ('odom_ned', 'base_link_fsd')
    still = seen._replace(twist=np.zeros_like(seen.twist))
    bag = write(tmp_path / 'bag', simple(still, Maker(), '/odom', '/wrench', frames), Maker())
    code, error = auv(capsys, 'identify', bag, '--vehicle', 'rexrov', '--out', tmp_path / 'x')
    assert code == 2
    assert error.endswith('wrench, found a velocity that never changes\n')


def test_rates_that_are_not_those_of_the_attitude_are_refused(tmp_path, capsys):
    given = recording(tmp_path, 3.0, rates=-1.0), '--vehicle', 'herman2018'
    code, error = auv(capsys, 'identify', *given, '--out', tmp_path / 'x')
    assert code == 2
    assert 'expected an angular velocity that is the rate of the attitude' in error


def test_a_part_may_have_one_end():
    assert identify_command._span('20:') == (20.0, np.inf)
    assert identify_command._span(':30') == (0.0, 30.0)


def test_what_the_command_line_asks_for_is_what_is_done(
    short, brief, tmp_path, monkeypatch, capsys
):
    asked, kept, before = [], [], []

    def folder(*given, inputs, **options):
        kept.append(inputs)
        return results_folder(*given, inputs=inputs, **options)

    def work(*given, **options):
        asked.append((*given, *options.values()))
        raise FailedError('enough')

    monkeypatch.setattr('auv_analysis.output.folder.results_folder', folder)
    monkeypatch.setattr(identify, 'identify', work)
    monkeypatch.setattr(identify, 'compared', work)
    monkeypatch.setattr(prediction, 'held_of', lambda held, s: before.append(s) or held)
    applied = {'odometry': '/odom', 'wrench': '/wrench'}
    applied['wrench_applied'] = {'topic': '/wrench', 'between': 'hold'}
    (tmp_path / 'map.yaml').write_text(yaml.safe_dump(applied))
    given = (short, '--vehicle', 'herman2018', '--out', tmp_path / 'x', '--holdout', '0.5')
    lags = '--lag', '0.2', '--delay', '0.1'
    assert auv(capsys, 'predict', *given, *lags) == (1, 'enough\n')
    more = '--free', 'lag', '--fixed', 'delay', '--segment', '2', '--observer', '0.5'
    more = *more, '--bootstrap', '50', '--profile', 'lag, delay'
    assert auv(capsys, 'identify', *given, *more)[0] == 1
    onboard = '--map', tmp_path / 'map.yaml', '--applied', '--observer', 'auto'
    assert auv(capsys, 'identify', *given, *onboard)[0] == 1
    (learnt, held, _, *late), (*_, one, _), (*_, other, _) = asked
    assert late == [0.2, 0.1]
    assert before == [pytest.approx(0.1 + 5 * 0.2)], 'what still acts of commands of before'
    assert 0.0 < learnt[-1].end <= held[0].start
    assert (one.free[-1], one.fixed, one.profile) == ('lag', ['delay'], ['lag', 'delay'])
    assert (one.segment, one.observer, one.bootstrap) == (2.0, 0.5, 50)
    assert (other.fixed, other.observer) == (['lag', 'delay'], None)
    believed = tmp_path / 'prior.yaml'
    believed.write_text('M.surge.surge: {value: 280, deviation: 5}')
    given = (*given[:-1], brief, '--prior', believed)
    assert auv(capsys, 'identify', *given)[0] == 1
    learnt, held, _, known, _ = asked[-1]
    assert held[-1].end < 3.5 < learnt[-1].end
    assert known.believed == {'M.surge.surge': (280.0, 5.0)}
    assert believed in kept[-1]


@pytest.mark.parametrize(('entry', 'line'), [
    ('300', 'M.x: expected a mapping with value and a positive deviation, found 300'),
    ('{value: 3}', 'M.x.deviation: expected a positive number, found nothing'),
    ('{value: 3, deviation: 0}', 'M.x.deviation: expected a positive number, found 0'),
    ('{value: 3, deviation: .nan}', 'M.x.deviation: expected a finite number, found nan'),
    ('{value: 3, deviation: .inf}', 'M.x.deviation: expected a finite number, found inf'),
    ('{value: true, deviation: 1}', 'M.x.value: expected a number, found True'),
    ('{value: 1e300, deviation: 1}', 'M.x.value: expected a finite number, at most '),
    ('{value: 3, deviation: 1, mean: 2}', 'M.x.mean'),
    ('{value: 3, deviation: 1}', 'prior.yaml: expected '),
])  # fmt: skip
def test_a_prior_file_needs_values_and_deviations(entry, line, short, tmp_path, capsys):
    file = tmp_path / 'prior.yaml'
    file.write_text(f'M.x: {entry}\n', encoding='utf-8')
    code, said = auv(capsys, 'identify', short, '--vehicle', 'herman2018', '--prior', file,
                     '--out', tmp_path / 'x')  # fmt: skip
    assert code == 2
    assert line in said
    assert said.count('\n') == 1


@pytest.mark.usefixtures('undrawn')
def test_rotations_alone_tell_the_rotational_block(bag, tmp_path):
    """An Imu's log: what linear motion would tell stays open, or has an interval with the truth."""
    told = {'odometry': '/odom', 'wrench': '/wrench', 'unknown': ['x', 'y', 'z', 'u', 'v', 'w']}
    (tmp_path / 'map.yaml').write_text(yaml.safe_dump(told))
    main(['identify', str(bag), '--map', str(tmp_path / 'map.yaml'), '--vehicle', 'herman2018',
          '--out', str(tmp_path / 'out'), '--part', '0:45'])  # fmt: skip
    page = (tmp_path / 'out' / 'report.html').read_text(encoding='utf-8')
    open_ = json.loads((tmp_path / 'out' / 'identify.json').read_text())['combinations']
    told = [float(share) for share in re.findall(r'alone to (\d+)\s% of its', page)]
    assert told == pytest.approx([100 * one['left'] for one in open_], abs=0.5)
    assert max(told) > 50
    rows = parquet.read_table(tmp_path / 'out' / 'coefficients.parquet').to_pylist()
    found = {row['name']: row for row in rows if row['name'].startswith('M.')}
    truth = load_vehicle('herman2018')
    for i, dof in enumerate(DOFS):
        row = found[f'M.{dof}.{dof}']
        if i < 3:
            assert row['left'] > 0.2, 'little is known of it beyond the prior'
        else:
            assert row['value'] == pytest.approx(truth.M[i, i], rel=0.01)
            assert row['high'] - row['low'] < 0.05 * truth.M[i, i]
    for i, j in np.ndindex(6, 6):
        row = found.get(f'M.{DOFS[i]}.{DOFS[j]}')
        if row and row['low'] is not None:
            assert row['low'] <= truth.M[i, j] <= row['high'], row['name']
    assert {row['status'] for row in found.values()} == {'identified', 'prior'}


@pytest.mark.parametrize('command', ['identify', 'predict'])
@pytest.mark.parametrize(('told', 'line'), [
    ({}, 'wrench: expected wrench (--wrench) or thrusters: motion alone tells no M, D and g'),
    ({'wrench': '/wrench', 'unknown': ['psi']}, 'pose: expected phi, theta and psi'),
    ({'wrench': {'topic': '/wrench', 'fields': {'X': 'wrench.force.x'}}}, 'all six components'),
])  # fmt: skip
def test_without_wrench_or_attitude_nothing_is_identified(
    command, told, line, short, tmp_path, capsys
):
    (tmp_path / 'map.yaml').write_text(yaml.safe_dump({'odometry': '/odom', **told}))
    code, said = auv(capsys, command, short, '--map', tmp_path / 'map.yaml', '--vehicle',
                     'herman2018', '--out', tmp_path / 'out')  # fmt: skip
    assert code == 2
    assert line in said
    assert len(said.strip().splitlines()) == 1


@pytest.mark.parametrize('command', [identify_command, predict_command])
def test_linear_algebra_has_one_thread_before_numpy_is_loaded(command, monkeypatch):
    """NumPy reads it when it is imported, as it is by the first import that is refused here."""
    monkeypatch.delenv('OPENBLAS_NUM_THREADS', raising=False)
    monkeypatch.setitem(sys.modules, 'auv_analysis.output.folder', None)
    with pytest.raises(ImportError):
        command.run(Namespace())
    assert os.environ['OPENBLAS_NUM_THREADS'] == '1'
