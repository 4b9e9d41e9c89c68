"""`auv excite` keeps its bounds, and the recording tells what it promised."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from helpers.report_pages import check_numbers
from helpers.sea_trials import recorded

from auv_analysis import load_scenario, simulate
from auv_analysis.cli import main
from auv_analysis.output.folder import listed_in, results_folder
from auv_analysis.report.results import Results
from auv_analysis.studies.excite import excite as searching
from auv_analysis.studies.excite.drive import (
    BEYOND,
    Bounds,
    Family,
    Motion,
    Request,
    bounds_of,
    motion_of,
    scenario_in_memory,
    scenario_of,
    spec_of,
)
from auv_analysis.studies.excite.drive import recorded as run_of
from auv_analysis.studies.excite.excite import _check, _fleet, excite, segments
from auv_analysis.studies.excite.report import (
    print_results,
    results_of,
    scenario_text,
    sentences,
    write_report,
)
from auv_analysis.studies.identify.identify import identify
from auv_analysis.studies.identify.unknowns import DEFAULT
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.files.shipped import shipped
from auv_dynamics.plant.disturbance import Harmonics
from auv_dynamics.vehicle.vehicle_file import load_vehicle

TANK = (12.0, 12.0, 6.0)
PHASE = np.random.default_rng(0).uniform(0.0, 2.0 * np.pi, (6, 6))
VEHICLE = 'bluerov2_heavy'


def request_of(vehicle: str = VEHICLE, room: tuple[float, ...] = TANK, **changes) -> Request:
    wrench = np.array([15.0, 15.0, 15.0, 2.0, 2.0, 2.0])
    bounds = Bounds(wrench, 0.5, 1.0, np.array(room))
    usual = DEFAULT, (), 0.1, 0.005, 0.003, 0.1, False, 0
    return replace(Request(vehicle, bounds, 40.0, 0.05, *usual), **changes)


@pytest.fixture(autouse=True, scope='module')
def brief():
    """A search of few gradients: what it finds keeps its promises all the same."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(searching, 'ROUNDS', {False: ((1, 2),), True: ((1, 1),)})
        yield


@pytest.fixture(scope='module')
def told():
    """What `excited` says of its progress."""
    return []


@pytest.fixture(scope='module')
def excited(brief, told):
    return excite(request_of(), lambda *of: told.append(of))


def halves(found) -> dict[str, float]:
    return {row['name']: (row['high'] - row['low']) / 2 for row in found.coefficients()
            if row['low'] is not None and row['name'] != 'delay'}  # fmt: skip


def test_the_recording_tells_what_was_promised(excited, tmp_path: Path) -> None:
    """Within a factor of three for nine of ten coefficients, in the median within two."""
    path = tmp_path / 'scenario.yaml'
    path.write_text(scenario_text(excited))
    scenario = load_scenario(path)
    run = simulate(scenario, 'open_loop', 'zoh')
    found = identify([recorded(run, 0.003, 1)], [], load_vehicle(VEHICLE))
    mine, promised = halves(found), halves(excited.predicted)
    at_zero = {entry.name for entry in found.zeros}  # damping that would feed energy
    ratios = np.array([mine[name] / promised[name] for name in mine if name not in at_zero])
    assert len(ratios) >= 30
    assert 0.5 < np.median(ratios) < 2.0
    assert np.mean((ratios > 1 / 3) & (ratios < 3.0)) >= 0.9, sorted(ratios)


def test_results_take_the_place_of_earlier_ones(excited, tmp_path: Path) -> None:
    for _ in range(2):
        with results_folder(tmp_path / 'plan', overwrite=True) as (folder, out):
            files = {path.name for path in results_of(excited).write(folder)}
    assert 'excite.json' in files
    assert files <= listed_in(out).keys()


def test_a_vehicle_without_thrusters_has_more_than_what_holds_it_still() -> None:
    vehicle = load_vehicle('herman2018')
    still = abs(vehicle.g(np.zeros(6)))
    assert still[2] > 0.0
    nu = np.array([0.5, 0.5, 0.5, 1.0, 1.0, 1.0])  # what it gains in a second, against its drag
    moving = np.diag(vehicle.M) * nu + np.diag(vehicle.D(nu)) * nu
    tilted = abs(vehicle.g(np.array([0.0, 0.0, 0.0, 0.4, 0.4, 0.0])) - vehicle.g(np.zeros(6)))
    bounds = bounds_of(vehicle, np.full(3, np.inf), None, None, None)
    np.testing.assert_allclose(bounds.wrench, moving + tilted + still)


def test_what_the_command_line_asks_for_is_what_is_searched(tmp_path, monkeypatch) -> None:
    asked: list[Request] = []

    def search(request: Request, *_: object) -> None:
        asked.append(request)
        raise InputError('enough', '', 'no more', 'another')

    monkeypatch.setattr(searching, 'excite', search)
    line = (
        'excite bluerov2 --duration 30.04 --step 0.1 --speed 0.4 --rate 0.7 --tank 3 4 5 --lag 0.3 '
        '--velocity-noise 0.01 --attitude-noise 0.02 --spread 0.2 --closed-loop --seed 7 '
        f'--free M --fixed lag --limit 6 5 4 3 2 1 --out {tmp_path / "out"}'
    )
    for arguments in (line, f'excite bluerov2 --speed 0.4 --depth 9 --out {tmp_path / "out"}',
                      f'excite bluerov2 --limit 6 --out {tmp_path / "out"}'):  # fmt: skip
        with pytest.raises(SystemExit):
            main.main(arguments.split())
    one, other, alike = asked
    assert (one.given, one.duration, one.step, one.lag) == ('bluerov2', 30.0, 0.1, 0.3)
    assert (one.velocity_noise, one.attitude_noise, one.spread) == (0.01, 0.02, 0.2)
    assert (one.closed, one.seed, one.free[-1], one.fixed) == (True, 7, 'M', ['lag'])
    assert (one.bounds.speed, one.bounds.rate, one.bounds.room.tolist()) == (0.4, 0.7, [3, 4, 5])
    assert one.bounds.wrench.tolist() == [6.0, 5.0, 4.0, 3.0, 2.0, 1.0]
    assert alike.bounds.wrench.tolist() == [6.0] * 6
    assert (other.bounds.rate, other.bounds.room.tolist()) == (0.8, [np.inf, np.inf, 9.0])
    thrusters = load_vehicle('bluerov2').thrusters
    assert np.flatnonzero(other.bounds.wrench == 0) == [4]  # surge and heave make pitch
    for wrench in (
        3 * np.diag(other.bounds.wrench)[[0, 1, 2, 3, 5]]
    ):  # given, but no more, both ways
        more = [
            np.abs(thrusters.allocate(way * wrench)[1]).max() / wrench.max() for way in (-1.1, 1.1)
        ]
        assert min(more) == pytest.approx(1.0)
    assert (other.closed, other.seed, other.velocity_noise) == (False, 0, 0.005)
    assert (other.duration, other.step, other.lag) == (60.0, 0.05, 0.1)
    assert (other.attitude_noise, other.spread, other.free) == (0.003, 0.1, DEFAULT)


@pytest.mark.usefixtures('unrendered')
def test_the_report_has_its_numbers_where_their_heads_say(
    excited, tmp_path: Path, capsys, approved
) -> None:
    results = results_of(excited)
    (tmp_path / 'scenario.yaml').write_text(scenario_text(excited))
    results.write(tmp_path)
    write_report(excited, results, tmp_path)
    assert check_numbers(tmp_path) > 100
    approved.within = 0.06  # a last digit of 0.18, where the search ends a little elsewhere
    approved.folder(tmp_path)
    print_results(results, Path('folder'))
    approved.add(capsys.readouterr().out.splitlines())
    tau, nu = excited.motion.commands[0, 0], excited.motion.states[0, 0, :, 7:]
    for i, row in enumerate(results.tables['motion'].records()):
        assert row['wrench'] == np.abs(tau[:, i]).max()
        assert row['velocity'] == np.abs(nu[:, i]).max()
        assert row['rms'] == pytest.approx(np.sqrt(np.mean(nu[:, i] ** 2)))
    bounds = results.tables['bounds'].records()
    assert [row['prior'] for row in bounds] == excited.used[0].tolist()
    assert [row['worst'] for row in bounds] == excited.used.max(axis=0).tolist()
    rows = {row['name']: row for row in results.tables['intervals'].records()}
    for found, key in ((excited.predicted, 'half'), (excited.case1, 'half_case1')):
        for name, half in halves(found).items():
            assert rows[name][key] == pytest.approx(half)
    first, second, third, *_ = sentences(results)
    told = sum(row['half'] is not None for row in rows.values())
    case1 = sum(row['half_case1'] is not None for row in rows.values())
    assert first.startswith(f'{told} of {len(rows)} coefficients would be identified by 40 s of it')
    assert f', {case1} by case 1 of the same length' in first
    mine, others = halves(excited.predicted), halves(excited.case1)
    ratio = 1 / np.median([others[name] / mine[name] for name in others if name in mine])
    assert f'its intervals are {ratio:.2f} times as wide as those of case 1' in second
    worst = excited.used.max(axis=0)
    share = f'{100 * worst.max():.0f} % of the {bounds[int(worst.argmax())]["bound"]}'
    assert third == (
        f'Of {len(excited.used)} vehicles around the prior the worst uses {share} that is allowed.'
    )


@pytest.mark.usefixtures('undrawn')
def test_the_command_writes_what_was_found(excited, tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.setattr(searching, 'excite', lambda *_: excited)
    monkeypatch.chdir(tmp_path)
    text = shipped('vehicles', VEHICLE).read_text().replace(f'name: {VEHICLE}', 'name: my rov')
    Path('mine.yaml').write_text(text)
    main.main(['excite', 'mine.yaml', '--no-report', '--json'])
    out = Path('runs/excite_my_rov')
    assert json.loads(capsys.readouterr().out) == json.loads((out / 'excite.json').read_text())
    assert yaml.safe_load((out / 'scenario.yaml').read_text()) == excited.scenario
    assert not (out / 'report.html').exists()
    main.main(['excite', 'mine.yaml', '--overwrite'])
    assert capsys.readouterr().out.endswith(f'scenario: {out / "scenario.yaml"}\n')
    assert (out / 'report.html').exists()


def test_amplitudes_are_made_less_by_seven_halves_until_the_worst_motion_fits(monkeypatch) -> None:
    share, size = np.linspace(0.1, 0.9, 10).reshape(2, 1, 5), np.array([0.5, 2.1, 1e9])
    share[1, 0, 3] = 1.0

    def used(_: object, x: np.ndarray, fleet: str) -> np.ndarray:
        assert fleet == 'fleet'
        return share * (size * np.exp(x[:, 0]))[:, None]

    monkeypatch.setattr(searching, 'motion_of', used)
    request = SimpleNamespace(bounds=SimpleNamespace(used=lambda motion: motion))
    family = SimpleNamespace(driven=[0, 4], waves=lambda x: x)
    x = np.tile([0.0, -1.0, 0.7, -0.3], (3, 1))
    found = searching.within(request, family, x, ('fleet',), 1.0)
    least, less = np.log(0.02), np.log(0.02) * 25 / 128  # the next of 128 parts below -log 2.1
    expected = [[0.0, -1.0], [less, less - 1.0], [least, least]]
    np.testing.assert_allclose(found, np.c_[expected, x[:, 2:]])


def test_what_is_done_and_how_much_of_it_is_told(excited, told) -> None:
    assert list(dict.fromkeys(text for text, _ in told)) == ['phases', 'amplitudes', 'checking']
    shares = {text: [share for word, share in told if word == text] for text, _ in told}
    assert shares['phases'] == [k / 8 for k in range(8)]
    assert shares['amplitudes'][0] == pytest.approx(8 / (8 + 2 * (2 * 12 + 1)))  # of two gradients
    assert shares['amplitudes'] == sorted(shares['amplitudes'])


def test_sentences_compare_what_both_tell_but_the_delay() -> None:
    facts = {'identified': ['a', 'b', 'c'], 'duration': 40.0, 'case1': ['a', 'd'], 'vehicles': 64,
             'not_identified': [], 'combinations': []}  # fmt: skip
    bounds = [{'bound': 'speed', 'prior': 0.9, 'worst': 0.4},
              {'bound': 'tilt', 'prior': 0.1, 'worst': 0.75}]  # fmt: skip

    def said(*halves: tuple[str, float | None, float | None]) -> list[str]:
        results = Results('excite', facts)
        rows = [{'name': name, 'half': half, 'half_case1': case1} for name, half, case1 in halves]
        results.add('intervals', 'Predicted intervals.', rows, {})
        results.add('bounds', 'Bounds.', bounds, {})
        return sentences(results)

    both = ('a', 1.0, 4.0), ('b', 2.0, 1.0), ('c', 3.0, 3.0), ('d', 1.0, 8.0)
    first, second, third = said(*both, ('e', None, 9.0), ('f', 1.0, None), ('delay', 1.0, 99.0))
    assert first == (
        '3 of 7 coefficients would be identified by 40 s of it, 2 by case 1 of the same length, '
        'which keeps no bounds.'
    )
    assert second == (
        'Where both tell, its intervals are 0.40 times as wide as those of case 1, in the median; '
        'case 1 tells more of b.'
    )
    assert third == (
        'Of 64 vehicles around the prior the worst uses 75 % of the tilt that is allowed.'
    )
    assert said(both[0], both[2])[1].endswith(', in the median.')
    assert said(*((name, 2.0, 1.0) for name in 'abcdefg'))[1].endswith('a, b, c, d, e and f.')
    assert len(said(('e', None, 9.0), ('f', 1.0, None))) == 2


def test_four_things_that_stay_open_are_said(excited) -> None:
    results = results_of(excited)
    results.facts['combinations'] = [{'words': f'w{k}'} for k in range(6)]
    results.facts['not_identified'] = ['a', 'b']
    assert 'Not told: a and b.' in sentences(results)
    said = [text for text in sentences(results) if text.startswith('Open: ')]
    assert said == [f'Open: w{k}.' for k in range(4)]


def test_it_tells_more_than_case_1(excited) -> None:
    mine, case1 = halves(excited.predicted), halves(excited.case1)
    assert len(mine) > len(case1)
    assert np.median([mine[name] / case1[name] for name in case1]) < 0.5
    rows = results_of(excited).tables['intervals'].records()
    assert {row['name'] for row in rows if row['half_case1'] is None} >= set(mine) - set(case1)
    alone = results_of(replace(excited, case1=None))
    assert alone.facts['case1'] == []
    assert not any('Where both tell' in text for text in sentences(alone))


def test_case_1_is_as_long_and_one_that_diverges_tells_nothing(monkeypatch) -> None:
    simulated = []

    def diverged(*of: object) -> tuple[np.ndarray, np.ndarray]:
        simulated.append(of)
        return np.zeros((4, 6)), np.full((5, 13), np.nan)

    monkeypatch.setattr(searching, 'recorded', diverged)
    assert searching.of_case1(request_of(step=0.1, lag=0.3)) is None
    ((scenario, controller),) = simulated
    data = scenario.data
    assert (data['duration'], data['step'], data['actuators']['lag']) == (40.0, 0.1, 0.3)
    assert (controller, data['controllers']) == ('gvc', {'gvc': request_of().loop})


def test_a_motion_that_is_not_finite_gains_nothing(excited) -> None:
    command, state = excited.motion.commands[0, 0, :400], excited.motion.states[0, 0, :401]
    commands, states = np.tile(command, (1, 3, 1, 1)), np.tile(state, (1, 3, 1, 1))
    states[0, 1, 30, 8], commands[0, 2, 40, 1] = np.nan, np.inf
    request = excited.request
    u = searching._unknowns(request, np.ones(6), request.bounds.wrench)
    found = searching._gained(request, u, Motion(commands, states))
    assert found[0] > 0.1
    assert found[1:].tolist() == [0.0, 0.0]


def test_shares_of_the_bounds_by_hand() -> None:
    bounds = Bounds(np.array([10.0, 20.0, 0.0, 4.0, 5.0, 8.0]), 0.5, 2.0,
                    np.array([4.0, 10.0, np.inf]))  # fmt: skip
    states = np.zeros((2, 1, 3, 13))
    states[..., 3] = 1.0
    states[0, 0, 1, :3] = (1.0, -4.0, 9.0)  # of 2 m, 5 m and no end
    half = 0.3  # rad, of a turn about an axis in the plane of surge and sway
    states[0, 0, 2, 3:7] = (np.cos(half), np.sin(half) * 0.6, np.sin(half) * 0.8, 0.0)
    states[0, 0, 1, 7:10], states[0, 0, 2, 10:] = (0.1, 0.2, -0.2), (1.0, 0.5, -1.0)
    commands = np.zeros((1, 1, 2, 6))
    commands[0, 0, 1] = (-7.0, 2.0, 3.0, 1.0, 1.0, -1.0)
    used = bounds.used(Motion(commands, states))
    np.testing.assert_allclose(used[0, 0], [0.7, 0.6, 0.75, 0.75, 0.8])
    np.testing.assert_allclose(used[1, 0], [0.7, 0.0, 0.0, 0.0, 0.0], atol=1e-7)
    states[1, 0, 2] = np.nan
    assert (bounds.used(Motion(commands, states))[1, 0, 1:] > 1.0).all(), 'not finite is far out'


@pytest.mark.parametrize('closed', [False, True])
def test_what_leaves_the_bounds_is_said(closed: bool) -> None:
    request = request_of(closed=closed)
    _check(request, np.array([[1.0, 0.5, 0.5, 0.5, 1.0], [0.2, 1.0, 0.5, 1.0, 0.1]]))
    loop = 'the closed loop' if closed else 'the open loop'
    near, any_ = 'a vehicle near the prior takes', 'the vehicle, or one near it, takes'
    both = '1.1 times the speed and 1.3 times the angular rate that is allowed'
    for used, said, ways in (
        ([[0.5, 0.5, 1.2, 0.5, 0.9], [0.5, 1.1, 1.3, 0.5, 0.5]],
         f'{any_} {both}', ['a larger --speed and --rate']),
        ([[0.5, 0.5, 1.0, 0.5, 1.0], [0.5, 1.1, 1.3, 0.5, 0.5]],
         f'{near} {both}', ['a larger --speed and --rate', 'a smaller --spread']),
        ([[0.5, 0.5, 0.5, 0.5, 0.5], [0.5, 0.5, 0.5, 1.5, 1.0]],
         f'{near} 1.5 times the tilt that is allowed', ['a smaller --spread']),
        ([[0.5, 0.5, 0.5, 3.93, 12.9]],
         f'{any_} 3.93 times the tilt and 12.9 times the room that is allowed', []),
        ([[2.5, 1.2, 0.5, 3.9, 0.5]],
         f'{any_} 2.5 times the wrench that is allowed', ['a larger --limit']),
    ):  # fmt: skip
        with pytest.raises(FailedError) as left:
            _check(request, np.array(used))
        every = [*ways, *['--closed-loop'] * (not closed)]
        every += ['a smaller --lag or --step'] * ('wrench' in said)
        way = f': {", ".join(every)}' if every else ''
        assert str(left.value) == f'{VEHICLE}: {loop} leaves its bounds: {said}{way}'
    heavy = request_of('herman2018', closed=closed)  # more than 15 N of it
    with pytest.raises(FailedError, match=r'allowed: a larger --limit(, --closed-loop)?$'):
        _check(heavy, np.array([[2.5, 1.2, 0.5, 3.9, 0.5]]))
    with pytest.raises(FailedError) as left:
        _check(request, np.array([[0.5] * 5, [BEYOND] * 5]))
    other = ' or --lag' if closed else ''
    assert str(left.value) == f'{VEHICLE}: {loop} diverges: a smaller --step{other}'


def test_a_vehicle_that_drifts_gets_a_shorter_recording_and_one_that_swings_a_higher_rate(
    tmp_path: Path, monkeypatch
) -> None:
    asked: list[Request] = []

    def search(request: Request, *_: object) -> None:
        asked.append(request)
        raise FailedError('it leaves its bounds')

    monkeypatch.setattr(searching, 'excite', search)
    data = yaml.safe_load(shipped('vehicles', 'girona500').read_text())
    data['hydrostatics']['center_of_buoyancy'][2] -= 1.0  # swings at 6 rad/s
    (tmp_path / 'stiff.yaml').write_text(yaml.safe_dump(data))
    line = f'excite {tmp_path / "stiff.yaml"} --out {tmp_path / "out"}'.split()
    for options in ([], ['--duration', '20', '--step', '0.05', '--speed', '0.6', '--rate', '0.7']):
        with pytest.raises(SystemExit) as ended:
            main.main([*line, *options])
        assert ended.value.code == 1
    *tried, told = asked
    assert [one.duration for one in tried] == [60.0, 45.0, 30.0, 20.0]
    assert [one.step for one in asked] == [0.02] * 4 + [0.05]
    last = tried[-1]
    phases, _, fleet = searching._drawn(last)
    still = Family.of(last, phases[0]).waves(np.full((1, 12), np.log(1e-9)))
    used = last.bounds.used(motion_of(last, still, *fleet)).max(axis=(0, 1))
    assert last.bounds.speed == 0.5
    assert last.bounds.rate > 1.0
    assert used[2] == pytest.approx(1 / 1.25, rel=0.01)
    assert used[4] < 1.0
    assert (told.duration, told.bounds.speed, told.bounds.rate) == (20.0, 0.6, 0.7)


def test_what_turns_over_by_itself_needs_no_higher_rate_but_a_controller() -> None:
    request = request_of('herman2018_neutral', duration=20.0)
    assert searching.unexcited(request, searching._drawn(request)) == (0.0, 0.0)


def test_a_multisine_as_a_scenario_has_it() -> None:
    terms = np.zeros((6, 3, 3))
    terms[1, :2] = [[1.23456789, 0.5, 0.25], [2.0, 0.75, 3.0]]  # the third has no amplitude
    terms[5, 0] = [0.5, 1.5, 0.0]
    wave = Harmonics(np.array([0.0, -2.0, 3.0, 0.0, 0.0, 0.0]), tuple(terms))
    first, second = ({'amplitude': 1.23457, 'omega': 0.5, 'phase': 0.25},
                     {'amplitude': 2.0, 'omega': 0.75, 'phase': 3.0})  # fmt: skip
    assert spec_of(wave) == {
        'sway': {'offset': -2.0, 'terms': [first, second]}, 'heave': {'offset': 3.0},
        'yaw': {'terms': [{'amplitude': 0.5, 'omega': 1.5, 'phase': 0.0}]},
    }  # fmt: skip


def test_what_a_request_assumes_stands_in_its_scenario() -> None:
    request = request_of(lag=0.25, velocity_noise=0.01, attitude_noise=0.02, seed=5)
    np.testing.assert_allclose(request.follow, np.full((1, 6), 1 - np.exp(-0.05 / 0.25)))
    assert request.noise.tolist() == [0.01] * 6 + [0.02] * 3
    assert request.steps == 800
    wave = Harmonics(np.zeros(6), tuple(np.ones((6, 1, 3))))
    data = scenario_of(request, wave)
    assert data['sensors'] == {'velocity_noise': 0.01, 'attitude_noise': 0.02}
    assert data['actuators'] == {'limit': request.bounds.wrench.tolist(), 'lag': 0.25}
    assert [data[key] for key in ('name', 'vehicle', 'duration', 'step', 'seed')] == [
        f'excite_{VEHICLE}', VEHICLE, 40.0, 0.05, 5
    ]  # fmt: skip
    quick = replace(request, lag=0.0)
    assert (quick.follow == 1.0).all()
    assert 'lag' not in scenario_of(quick, wave)['actuators']


def test_segments_follow_one_another_and_carry_what_was_commanded_before() -> None:
    request = request_of(step=0.5)
    commands, states = np.arange(22.0)[:, None] * np.ones(6), np.arange(23.0)[:, None] * np.ones(13)
    found = segments(request, commands, states, 2.0)
    starts, before = (2, 6, 10, 14, 18), 2  # 0.6 s of commands before each
    assert [one.begin for one in found] == [0.5 * k for k in starts]
    for one, k in zip(found, starts, strict=True):
        assert one.before[:, 0].tolist() == list(range(k - before, k))
        assert one.command[:, 0].tolist() == list(range(k, k + 4))
        assert one.at.tolist() == [1, 2, 3, 4]
        assert one.nu[:, 0].tolist() == one.q[:, 0].tolist() == list(range(k + 1, k + 5))
        assert one.start[0] == k
        assert [part.shape[-1] for part in (one.nu, one.q, one.start)] == [6, 4, 10]
    fewer = segments(request, commands, states[::2], 2.0)
    for one, other in zip(fewer, found, strict=True):
        assert one.at.tolist() == [2, 4]
        np.testing.assert_array_equal(one.nu, other.nu[1::2])
        for part in ('before', 'command', 'start', 'begin'):
            np.testing.assert_array_equal(getattr(one, part), getattr(other, part))


def test_a_run_that_diverges_is_recorded_as_not_finite() -> None:
    scenario = load_scenario('case1')
    gains = {'law': 'cl', 'k_D': 1e9, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
    wild = replace(scenario, data=scenario.data | {'duration': 0.5, 'controllers': {'cl': gains}})
    commands, states = run_of(wild, 'cl')
    assert (commands.shape, states.shape) == ((50, 6), (51, 13))
    assert np.isnan(commands).all()
    assert np.isnan(states).all()
    tame = replace(scenario, data=scenario.data | {'duration': 0.5})
    run, (commands, states) = simulate(tame, 'cl', 'zoh'), run_of(tame, 'cl')
    np.testing.assert_array_equal(commands, run.tau[:50])
    np.testing.assert_array_equal(states[:, :3], run.eta[:, :3])
    np.testing.assert_array_equal(states[:, 7:], run.nu)


def test_an_axis_that_hardly_holds_the_vehicle_has_no_peak() -> None:
    request = request_of('herman2018', duration=2.0)  # which is lighter by 1079 N
    family = Family.of(request, PHASE)
    assert (family.most[2], 2 in family.driven) == (0.0, False)


@pytest.mark.parametrize(('duration', 'length'), [(20.0, 19.4 / 4), (1e4, searching.LONG)])
def test_of_a_short_recording_there_are_four_segments(duration: float, length: float) -> None:
    assert searching._usual(request_of(duration=duration)) == pytest.approx(length)


def test_every_vehicle_around_the_prior_stays_inside(excited) -> None:
    """Also the simulation itself, whose integrator is another one."""
    assert excited.used.max() <= 1.0
    assert excited.used.max() > 0.8, 'what is allowed is used'
    run = simulate(scenario_in_memory(excited.request, excited.scenario), 'open_loop', 'zoh')
    assert np.all(2.0 * np.abs(run.eta[:, :3]).max(axis=0) < TANK)
    assert np.linalg.norm(run.nu[:, :3], axis=1).max() < 0.5
    assert np.all(np.abs(run.tau).max(axis=0) <= excited.request.bounds.wrench)
    np.testing.assert_allclose(run.nu, excited.motion.states[0, 0, :, 7:], atol=1e-4)


@pytest.mark.parametrize('vehicle', [VEHICLE, 'herman2018'])
def test_a_spread_of_a_tenth_is_ten_percent_of_inertia_and_damping(vehicle: str) -> None:
    request = request_of(vehicle, spread=0.1)
    model, _ = _fleet(request, np.random.default_rng(0), 2000)
    for A in (model.M, model.D_linear, model.D_quadratic):
        some = A.reshape(-1, 6, 6)[:, range(6), range(6)]
        off = np.log(some[1:, some[0] > 0] / some[0, some[0] > 0])
        np.testing.assert_allclose(off.std(axis=0), 0.1, rtol=0.1)
    prior, couple = request.vehicle.model.hydrostatics, request.vehicle.weight
    prior, light = request.vehicle.model.hydrostatics, model.hydrostatics.reshape(-1, 4)
    np.testing.assert_allclose(light[0], prior)
    couple = np.abs(prior[1:]).max()  # its largest moment, for each of the three
    expected = 0.1 * np.array([0.02 * request.vehicle.weight, couple, couple, couple])
    np.testing.assert_allclose(light[1:].std(axis=0), expected, rtol=0.1)


def test_no_two_sines_share_a_frequency_and_peaks_are_as_asked() -> None:
    request = request_of()
    family = Family.of(request, PHASE)
    assert len(set(family.omega.ravel())) == 36
    x = np.r_[np.log([1.0, 0.5, 0.1, 1.0, 1.0, 0.2]), -1.0, 0.0, 1.0, 0.5, 0.0, 0.0][None]
    tau = family.waves(x).value(family.t)[0] - family.offset
    peaks = np.abs(tau).max(axis=0)
    np.testing.assert_allclose(peaks, np.exp(x[0, :6]) * family.most, rtol=1e-9)
    np.testing.assert_allclose(family.offset, request.hold)
    omega, terms = family.omega, family.waves(x).terms
    for i, exponent in enumerate(x[0, 6:]):
        fall = terms[i][0, -1, 0] / terms[i][0, 0, 0]
        assert fall == pytest.approx((omega[i, -1] / omega[i, 0]) ** exponent)
    low, high = family.box
    np.testing.assert_allclose(low, [np.log(0.02)] * 6 + [-1.5] * 6)
    np.testing.assert_allclose(high, [0.0] * 6 + [1.5] * 6)
    assert (omega.min(), omega.max()) == pytest.approx((0.3, 3.0))
    longer = Family.of(request_of(duration=200.0), PHASE).omega
    assert longer.min() == pytest.approx(2.0 * np.pi * 3.0 / 200.0), 'three periods at least'


def test_vehicles_of_a_closed_loop_move_as_their_errors_make_them() -> None:
    request = request_of(closed=True, duration=2.0, seed=7)
    family = Family.of(request, PHASE)
    waves = family.waves(np.zeros((1, 2 * len(family.driven))))
    wrong = {'kind': 'model_error', 'dM': (0.2 * request.vehicle.M).tolist()}
    prior, other = motion_of(request, waves, request.vehicle.model, [{}, wrong]).states[:, 0]
    data = scenario_of(request, waves.part(0))
    assert data['seed'] == 7
    del data['sensors']
    run = simulate(scenario_in_memory(request, data | {'disturbance': [wrong]}), 'gvc', 'zoh')
    np.testing.assert_allclose(other[:, 7:], run.nu, atol=1e-12)
    assert np.abs(other - prior).max() > 1e-3


@pytest.mark.parametrize('closed', [False, True])
def test_a_fine_step_shows_the_search_every_twentieth_of_a_second(closed: bool) -> None:
    request = request_of(closed=closed, duration=1.0, step=0.01)
    waves = Family.of(request, PHASE).waves(np.zeros((1, 12)))
    every, fewer = (
        motion_of(request, waves, request.vehicle.model, [{}], every) for every in (1, 5)
    )
    np.testing.assert_array_equal(fewer.commands, every.commands)
    np.testing.assert_array_equal(fewer.states, every.states[:, :, ::5])
    _, few, many = searching._drawn(request)
    assert (few[-1], many[-1], request_of().every) == (5, 1, 1)


def test_the_closed_loop_of_a_small_vehicle_keeps_its_wrench(tmp_path: Path) -> None:
    data = {
        'name': 'tiny', 'source': 'made up',
        'rigid_body': {'mass': 0.3, 'center_of_gravity': [0.0, 0.0, 0.004],
                       'inertia': np.diag([4e-4, 7e-4, 8e-4]).tolist(), 'inertia_reference': 'cg'},
        'hydrostatics': {'volume': 0.0003, 'center_of_buoyancy': [0.0, 0.0, 0.0]},
        'added_mass': [0.15, 0.3, 0.4, 1e-4, 2e-4, 2e-4],
        'damping': {'linear': [0.1, 0.2, 0.25, 2e-4, 4e-4, 4e-4],
                    'quadratic': [0.8, 1.5, 2.0, 3e-4, 6e-4, 6e-4]},
        'environment': {'water_density': 1000.0, 'gravity': 9.81},
    }  # fmt: skip
    path = tmp_path / 'tiny.yaml'
    path.write_text(yaml.safe_dump(data))
    bounds = bounds_of(load_vehicle(path), np.array(TANK), None, None, None)
    request = request_of(str(path), bounds=bounds, closed=True, duration=20.0)
    waves = Family.of(request, PHASE).waves(np.repeat([[np.log(0.02), 0.0]], 6, axis=1))
    assert bounds.used(motion_of(request, waves, request.vehicle.model, [{}])).max() < 0.3


def test_a_vehicle_that_sinks_must_close_its_loop(monkeypatch) -> None:
    for name in ('PHASES', 'STARTS'):
        monkeypatch.setattr(searching, name, 2)
    bounds = Bounds(np.array([500.0, 500.0, 1500.0, 150.0, 600.0, 200.0]), 0.4, 0.8,
                    np.array([np.inf, np.inf, 10.0]))  # fmt: skip
    heavy = request_of('herman2018', duration=20.0, step=0.1, bounds=bounds)
    with pytest.raises(FailedError, match=r'the open loop leaves its bounds: .* --closed-loop'):
        excite(heavy)
    found = excite(replace(heavy, closed=True))
    assert results_of(found).facts['loop'] == 'closed'
    assert found.used.max() <= 1.0
    assert set(found.scenario['controllers']) == {'gvc'}
    assert len(found.used) == 9, 'of the closed loop fewer vehicles are drawn'
    text = scenario_text(replace(found, request=replace(found.request, seed=3)))
    assert text.startswith('# Set-points to identify herman2018 with: auv run, then auv identify.')
    assert 'by auv excite, seed 3.' in text
    assert yaml.safe_load(text) == found.scenario
    assert len(halves(found.predicted)) >= 30


@pytest.mark.parametrize(
    ('options', 'said'),
    [
        (['--limit', '1', '2'], '--limit: expected 1 or 6 numbers, found 2 numbers'),
        (['--limit', '0'], '--limit: expected more than what holds the vehicle still'),
        (['--free', 'wind'], 'expected one of M, D_linear'),
        (['--duration', '19.9'], 'argument --duration: expected'),
        (['--duration', '3601'], 'argument --duration: expected'),
        (['--step', '0.004'], 'argument --step: expected'),
        (['--step', '0.21'], 'argument --step: expected'),
        (['--spread', '0.51'], 'argument --spread: expected'),
        (['--lag', '2.1'], 'argument --lag: expected'),
        (['--attitude-noise', '0'], 'argument --attitude-noise: expected'),
        (['--velocity-noise', '1.1'], 'argument --velocity-noise: expected'),
        (['--tank', '3', '4', '5', '--depth', '9'], 'argument --depth: '),
    ],
)
def test_what_cannot_be_driven_is_refused(options, said, tmp_path, capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        main.main(['excite', VEHICLE, *options, '--out', str(tmp_path / 'out')])
    assert ended.value.code == 2
    assert said in capsys.readouterr().err


def test_nothing_that_is_free_is_refused() -> None:
    with pytest.raises(InputError, match='--free: expected a coefficient that is free, found none'):
        excite(request_of(free=()))


@pytest.mark.usefixtures('undrawn')
def test_what_cannot_be_told_apart_is_said_in_whole_sentences(excited, tmp_path: Path) -> None:
    results = results_of(excited)
    results.facts['combinations'] = [{'words': 'mass and M.surge.surge stand for one another'}]
    (tmp_path / 'scenario.yaml').write_text(scenario_text(excited))
    page = write_report(excited, results, tmp_path).read_text(encoding='utf-8')
    assert '>Mass and M.surge.surge stand for one another.<' in page
    assert 'Open: mass and M.surge.surge stand for one another.' in page


def test_a_vehicle_of_ones_own_is_named_where_it_lies(tmp_path: Path, monkeypatch) -> None:
    text = shipped('vehicles', VEHICLE).read_text()
    name = 'my rov ' + 'x' * 90
    (tmp_path / 'mine.yaml').write_text(text.replace(f'name: {VEHICLE}', f'name: {name}'))
    monkeypatch.chdir(tmp_path)
    request = request_of('mine.yaml', duration=2.0)
    family = Family.of(request, PHASE)
    wave = family.waves(np.zeros((1, 2 * len(family.driven)))).part(0)
    data = scenario_of(request, wave)
    assert data['vehicle'] == str(tmp_path / 'mine.yaml')
    assert data['name'] == f'excite_my_rov_{"x" * 73}', 'at most 80 characters of it'
    assert data['sensors'] == {'velocity_noise': 0.005, 'attitude_noise': 0.003}


def test_each_seed_draws_other_phases() -> None:
    one, other, again = (searching._drawn(request_of(seed=seed))[0] for seed in (0, 7, 7))
    assert one.shape == (8, 6, 6)
    assert (one != other).all()
    np.testing.assert_array_equal(other, again)


def test_vehicles_of_a_closed_loop_are_the_spread_away_from_the_prior() -> None:
    request = request_of(spread=0.2)
    _, errors = _fleet(request, np.random.default_rng(0), 4)
    assert (len(errors), errors[0]) == (5, {})
    drawn = [error['dM'][2][2] / request.vehicle.M[2, 2] for error in errors[3:]]
    assert max(map(abs, drawn)) < 0.2
    assert drawn[0] != drawn[1]
    lauv = request_of('lauv')
    lifts = _fleet(lauv, np.random.default_rng(0), 2)[0].lift.reshape(3, 6, 6)
    np.testing.assert_allclose(lifts, np.tile(lauv.vehicle.lift, (3, 1, 1)))
    for error, share in zip(errors[1:3], (0.2, -0.2), strict=True):
        np.testing.assert_allclose(error['dM'], share * request.vehicle.M)
        np.testing.assert_allclose(error['dD'], -share * np.diag(request.vehicle.D_linear))


@pytest.mark.parametrize('closed', [False, True])
def test_axes_that_may_not_be_driven_are_not(closed: bool) -> None:
    wrench = np.array([15.0, 15.0, 0.0, 0.0, 0.0, 2.0])
    request = request_of(bounds=replace(request_of().bounds, wrench=wrench), duration=2.0)
    request = replace(request, closed=closed)
    family = Family.of(request, PHASE)
    assert family.driven.tolist() == [0, 1, 5]
    assert not family.offset[2:5].any()
    waves = family.waves(np.zeros((1, 6)))
    limit = scenario_in_memory(request, scenario_of(request, waves.part(0))).data['actuators']
    assert limit['limit'][2] == 1e-6
    if closed:
        assert family.most.tolist() == [0.5, 0.5, 0.0, 0.0, 0.0, 1.0]
        np.testing.assert_allclose(waves.value(np.zeros(1)), 0.0, atol=1e-12)  # no jump from rest
        commands = motion_of(request, waves, request.vehicle.model, [{}]).commands
        assert not commands[..., 2:5].any(), 'the law would hold depth and level'
        assert commands[..., [0, 1, 5]].any()
    assert request.clipped == closed
    loop = 'closed loop, in which nothing drives heave, roll and pitch,' if closed else 'open loop'
    with pytest.raises(FailedError, match=f'the {loop} leaves its bounds'):
        _check(request, np.array([[0.5, 0.5, 0.5, 3.9, 0.5]]))
    names = searching._unknowns(request, np.ones(6), wrench).names
    assert ('lag' in names) != closed, 'what acts has none'
    found = SimpleNamespace(request=request, scenario={})
    assert ('then auv identify --applied.' in scenario_text(found)) == closed


@pytest.mark.parametrize(('asked', 'needed', 'expected'), [
    ((None, None), (0.0, 0.0), (0.5, 1.0)), ((None, None), (0.7, 0.2), (0.7, 1.4)),
    ((None, None), (0.2, 3.0), (0.5, 3.0)), ((0.3, None), (0.7, 0.2), (0.3, 0.6)),
    ((None, 0.4), (0.7, 3.0), (0.7, 0.4)),
])  # fmt: skip
def test_usual_speeds_are_what_vehicles_need_and_those_that_are_asked_for_stay(
    asked, needed, expected
) -> None:
    wrench, room = np.arange(6.0), np.full(3, np.inf)
    bounds = bounds_of(load_vehicle(VEHICLE), room, wrench, *asked, *needed)
    assert (bounds.speed, bounds.rate) == pytest.approx(expected)
    assert bounds.wrench is wrench


@pytest.mark.parametrize(
    ('fastest', 'step'), [(19.9, 0.05), (20.1, 0.02), (49.9, 0.02), (199.0, 0.005), (1e6, 0.005)]
)
def test_a_step_is_shorter_than_damping_at_the_largest_speed_takes(fastest, step) -> None:
    """Damping goes with the speed, 0.4 m/s, and with the rate, 0.8 rad/s; one axis is fastest."""
    M, damped = np.diag(np.arange(1.0, 7.0)), np.array([1.0, 1.0, 1.0, 1.0, fastest / 0.8, 1.0])
    vehicle = SimpleNamespace(M=M, D=lambda nu: M @ np.diag(damped * np.abs(nu)))
    bounds = Bounds(np.ones(6), 0.4, 0.8, np.full(3, np.inf))
    assert searching.usual_step(vehicle, bounds) == step
