"""The search against optima that are known on paper."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.tunings import DIAGONAL, GVC, scenario

from auv_analysis import simulate
from auv_analysis.simulation.simulate import DivergedError
from auv_analysis.studies.optimise import Search
from auv_analysis.studies.tune import results as tuning
from auv_analysis.studies.tune import search as searching
from auv_analysis.studies.tune.cost import Measures, measures_of_run, of_each
from auv_analysis.studies.tune.gain_space import make_space
from auv_analysis.studies.tune.perturbations import Spread, perturbed
from auv_analysis.studies.tune.report import FAIR
from auv_analysis.studies.tune.results import _checked, _evaluations, tune
from auv_analysis.studies.tune.search import Goal, Request, TunedLaw, search, tuned
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.vehicle.vehicle_file import load_vehicle
from auv_gvc_controller.control.gains import sampled_rate
from auv_gvc_controller.laws.model import control_model

VEHICLE = load_vehicle('girona500')
SPACE = make_space('gvc', 'scalar', control_model(VEHICLE), 0.01, 100.0)


def measures(error: np.ndarray, effort: np.ndarray) -> Measures:
    none = np.zeros_like(error)
    return Measures(error, error, effort, none, none, none)


def bowl(gains: dict[str, np.ndarray]) -> Measures:
    """Effort a + b, error 1/(a b^2): at effort 3 the least error is 1/4, at a = 1, b = 2."""
    a, b = gains['k_D'], gains['Lambda']
    rest = np.log(gains['Gamma']) ** 2 + np.log(gains['k_I']) ** 2
    return measures((1 + rest) / (a * b**2), a + b)


def goal(equal: str, error: float, effort: float, tolerance: float = 1e-3) -> Goal:
    return Goal(equal, 'error', measures(np.array([error]), np.array([effort])), tolerance)


def test_what_diverges_is_far_from_equal_and_from_good() -> None:
    found = measures(*np.array([[np.nan, np.inf, 0.0, 8.0], [np.nan, np.inf, 0.0, 1.5]]))
    logs = np.array([[50.0, 50.0, -50.0, np.log(2.0)], [50.0, 50.0, -50.0, -np.log(2.0)]])
    np.testing.assert_allclose(goal('effort', 4.0, 3.0).logs(found), logs)
    np.testing.assert_allclose(goal('error', 4.0, 3.0).logs(found), logs[::-1])


JUDGED = [  # objective, equality, margin of the rate, stage
    (2.0, 0.0, 1.0, 'global'), (0.5, 0.0, -0.01, 'refine'), (0.4, 0.0, 1.0, 'gradient'),
    (0.9, 0.00995, 1.0, 'refine'), (0.1, 0.00996, 1.0, 'refine'), (0.95, -0.01003, 0.0, 'refine'),
    (0.2, -0.0102, 1.0, 'global'), (9.0, 0.02, -0.01, 'refine'), (9.0, -0.0201, 1.0, 'gradient'),
]  # fmt: skip


@pytest.mark.parametrize(
    ('shift', 'best', 'reached'), [(0.0, 3, True), (-0.03, 4, False), (0.03, 6, False)]
)
def test_the_best_is_equal_slow_enough_and_evaluated_as_a_point(shift, best, reached) -> None:
    """With e^0.00995 - 1 and 1 - e^-0.01003 within 0.01, and e^0.00996 - 1 beyond."""
    *columns, stages = zip(*JUDGED, strict=True)
    logs, batches = np.array(columns), []
    logs[1] += shift

    def values(x: np.ndarray) -> np.ndarray:
        batches.append(measures(x[:, 0], 10.0 + x[:, 0]))
        return logs if len(x) == len(JUDGED) else x[:, 0] * [[3.0], [2.0], [1.0]]

    solver = Search(values, np.array([-1.0]), np.array([9.0]), ('eq', 'ineq'))
    solver.evaluate(np.arange(len(JUDGED), dtype=float)[:, None], stages)
    found = searching._best(SPACE, goal('effort', 1.0, 1.0, tolerance=0.01), solver, batches)
    assert (found.x.tolist(), found.reached) == ([best], reached)
    assert found.measures.effort.tolist() == [10.0 + best]
    assert found.price == (pytest.approx(1.5) if reached else None)
    count = len(JUDGED) + 3 * reached  # a point of its own, and one on either side
    sizes = (found.points, found.evaluations.error, found.margins, found.stages)
    assert [len(values) for values in sizes] == [count] * 4


def test_a_price_is_that_of_the_gains_that_are_free() -> None:
    slopes = np.array([[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0], [0.0] * 4])
    solver = Search(lambda x: slopes @ x.T, np.zeros(4), np.ones(4), ('eq', 'ineq'))
    x = np.array([0.0, 0.5, 1.0, 0.25])
    assert searching._price(solver, x) == pytest.approx((2 * 6 + 4 * 8) / (6**2 + 8**2))
    slopes[1] = 0.0
    assert searching._price(solver, x) is None


def test_a_search_is_as_wide_as_the_report_says(monkeypatch) -> None:
    begun: list = []

    def run(solver: Search, points: np.ndarray, rounds) -> np.ndarray:
        begun.append((points, rounds))
        solver.evaluate(points, ['global'] * len(points))
        return points[0]

    monkeypatch.setattr(Search, 'run', run)
    starts = [(SPACE.low + 2 * SPACE.high) / 3, (2 * SPACE.low + SPACE.high) / 3]
    search(SPACE, bowl, goal('effort', 0.25, 3.0), points=4, seed=0, starts=starts)
    ((points, ((first, few), (last, many))),) = begun
    np.testing.assert_array_equal(points[:2], starts)
    assert len(points) == 2 + 4
    assert f'{few} gradients from each of the best {first} points and {many} from' in FAIR
    assert f'from the best {last} of these' in FAIR


@pytest.mark.parametrize('seed', [0, 1])
@pytest.mark.parametrize('equal', ['effort', 'error'])
def test_known_optimum_is_found_with_its_price(equal: str, seed: int) -> None:
    found = search(SPACE, bowl, goal(equal, 0.25, 3.0), points=256, seed=seed)
    best = {name: g[0] for name, g in SPACE.gains(found.x[None]).items()}
    assert found.reached
    assert best == pytest.approx({'k_D': 1.0, 'Lambda': 2.0, 'k_I': 1.0, 'Gamma': 1.0}, rel=1e-2)
    assert found.measures.error[0] == pytest.approx(0.25, rel=1e-5)
    assert found.measures.effort[0] == pytest.approx(3.0, rel=1e-5)
    # error goes with the inverse cube of the effort
    assert found.price == pytest.approx(-3.0 if equal == 'effort' else -1 / 3, rel=1e-2)


def test_same_seed_same_points_another_seed_others() -> None:
    runs = [search(SPACE, bowl, goal('effort', 0.25, 3.0), points=64, seed=s) for s in (3, 3, 4)]
    points = [run.points for run in runs]
    np.testing.assert_array_equal(points[0], points[1])
    assert not np.array_equal(points[0][:64], points[2][:64])


def test_effort_that_no_gains_have_is_said_to_be_unreached() -> None:
    found = search(SPACE, bowl, goal('effort', 1.0, 1e4), points=64, seed=0)
    assert not found.reached
    assert found.price is None
    assert found.measures.effort[0] == pytest.approx(200.0, rel=1e-3)  # both at 1/step


def test_diverging_gains_do_not_stop_a_search() -> None:
    def partly(gains: dict[str, np.ndarray]) -> Measures:
        found = bowl(gains)
        diverged = gains['k_D'] > 5.0
        return Measures(*(np.where(diverged, np.nan, values) for values in found))

    found = search(SPACE, partly, goal('effort', 0.25, 3.0), points=256, seed=0)
    assert found.measures.error[0] == pytest.approx(0.25, rel=1e-4)


def test_loop_stays_slower_than_the_samples() -> None:
    slow = make_space('cl', 'inertia', control_model(VEHICLE), 0.01, 7.0)

    def fast(gains: dict[str, np.ndarray]) -> Measures:
        rate, stiffness = (gains[g][:, 0, 0] / VEHICLE.M[0, 0] for g in ('k_D', 'Gamma'))
        return measures(1 / rate, stiffness)

    found = search(slow, fast, goal('effort', 1.0, 1.0), points=256, seed=0)
    rate, _ = sampled_rate(np.array(slow.entry(found.x)['k_D']), VEHICLE.M)
    assert rate == pytest.approx(7.0, rel=1e-6)
    for beyond, allowed in ((1e-12, True), (1e-6, False)):  # rounding is no excess
        one = replace(found, margins=np.full(len(found.margins), -beyond))
        rows = _evaluations({'cl_tuned': TunedLaw('cl', one, (one,))})
        assert set(rows['allowed'].to_pylist()) == {allowed}


INTEGRATORS = {
    **DIAGONAL, 'added_mass': [0.0] * 6, 'damping': {'linear': [0.0] * 6, 'quadratic': [0.0] * 6}
}  # fmt: skip
STEPPED = {'surge': {'offset': 1.0}}


@pytest.mark.parametrize('law', ['gvc', 'cl', pytest.param('pid', marks=pytest.mark.long)])
def test_of_an_integrator_no_law_beats_proportional_feedback(tmp_path, monkeypatch, law) -> None:
    """LQR: m u_dot = tau with cost e^2 + r tau^2 has tau = k e, so that nothing beats k = 6 m."""
    monkeypatch.setattr(searching, 'POINTS', 128)
    monkeypatch.setattr(searching, 'STARTS', 4)
    alone = {'law': 'gvc', 'k_D': 6.0, 'k_I': 1e-9, 'Lambda': 1e-9, 'Gamma': 1e-9}
    base = scenario(
        tmp_path,
        {'gvc': alone},
        vehicle=INTEGRATORS,
        setpoint=STEPPED,
        disturbance=[],
        duration=3.0,
    )
    request = Request(base, 'gvc', (law,), 'effort', 'error', 1e-3, 'mass', 'continuous', 0, 1)
    goal = Goal.of(request)
    # e = exp(-6 t) at 301 samples: a geometric series; 1/2 tau^2 / m is 36 times 1/2 m e^2
    mean = 0.5 * 100 / (1 - np.exp(-2 * 6 * 0.01)) / 301
    assert goal.reference.error[0] == pytest.approx(mean, rel=1e-6)
    assert goal.reference.effort[0] == pytest.approx(36 * goal.reference.error[0], rel=1e-6)
    found = tuned(request, law, goal).best
    assert found.reached
    assert found.measures.effort[0] == pytest.approx(goal.reference.effort[0], rel=1e-6)
    assert found.measures.error[0] == pytest.approx(goal.reference.error[0], rel=2e-3)
    gains = found.space.entry(found.x)
    if law != 'gvc':
        assert gains['k_P' if law == 'pid' else 'k_D'][0] / 100 < 6.1


def test_on_multiples_of_M_gvc_and_cl_are_one_law(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(searching, 'POINTS', 64)
    monkeypatch.setattr(searching, 'STARTS', 4)
    base = scenario(tmp_path, {'gvc': GVC}, vehicle='rexrov', duration=0.5)
    request = Request(
        base, 'gvc', ('gvc', 'cl'), 'effort', 'weighted_error', 1e-3, 'inertia', 'continuous', 0, 1
    )
    goal = Goal.of(request)
    errors = [tuned(request, law, goal).best.measures.weighted_error[0] for law in request.laws]
    assert errors[0] == pytest.approx(errors[1], rel=1e-3)
    assert errors[0] <= goal.reference.weighted_error[0] * (1 + 1e-3)


@pytest.fixture
def brief(monkeypatch) -> None:
    for name in ('POINTS', 'STARTS', 'SHORT', 'FINALISTS', 'LONG'):
        monkeypatch.setattr(searching, name, 1)


@pytest.mark.usefixtures('brief')
def test_a_sampled_scenario_is_tuned_with_its_noise_and_in_its_hold(tmp_path) -> None:
    """Each number is that of `simulate`; the set-point is a file, the name as long as may be."""
    way = 't,surge,sway,heave,roll,pitch,yaw\n0,0,0,0,0,0,0\n1,2,0,1,0,0,0.5\n'
    (tmp_path / 'way.csv').write_text(way)
    base = scenario(
        tmp_path, {'gvc': GVC}, name='n' * 100, setpoint={'file': 'way.csv'}, seed=9, duration=0.1,
        sensors={'velocity_noise': 0.1}, actuators={'lag': 0.05},
    )  # fmt: skip
    request = Request(base, 'gvc', ('gvc',), 'effort', 'error', 1e-3, 'scalar', 'zoh', 3, 1, 2)
    out = tmp_path / 'out'
    out.mkdir()
    found = tune(request, out, lambda *_: lambda: None)
    draw = perturbed(found.scenario, Spread(), 3, 1)
    for measures, one, name in (
        (found.goal.reference, base, 'gvc'),
        (found.laws['gvc_tuned'].best.measures, found.scenario, 'gvc_tuned'),
        (found.draws['gvc'].part(slice(1, 2)), draw, 'gvc'),
    ):
        expected = measures_of_run(simulate(one, name, 'zoh'))
        assert measures.effort == pytest.approx(expected.effort, rel=1e-9), name
        assert measures.error == pytest.approx(expected.error, rel=1e-9), name
    assert (out / 'setpoint.csv').read_text() == way
    loud = replace(found, commands={'gvc': np.array([1e6, 0.0, 0.0, 0.0, 0.0, 0.0])})
    assert 'times the weight of the vehicle' in ' '.join(loud.remarks('gvc'))


@pytest.mark.usefixtures('brief')
def test_each_seed_searches_other_points(tmp_path) -> None:
    base = scenario(tmp_path, {'gvc': GVC}, duration=0.05)
    how = 'gvc', ('gvc',), 'effort', 'error', 1e-3, 'mass', 'continuous'
    requests = [Request(base, *how, seed, 1) for seed in (0, 1)]
    points = [tuned(request, 'gvc', Goal.of(request)).best.points for request in requests]
    assert not np.array_equal(*points)


@pytest.mark.usefixtures('brief')
def test_six_numbers_begin_at_the_best_multiple_of_the_diagonal(tmp_path) -> None:
    base = scenario(tmp_path, {'gvc': GVC}, vehicle='rexrov', duration=0.1)
    how = 'effort', 'error', 1e-3, 'diagonal', 'continuous'
    request = Request(base, 'gvc', ('gvc',), *how, 0, 1)
    advanced: list[int] = []
    found = tuned(request, 'gvc', Goal.of(request), lambda: advanced.append(1))
    mass, diagonal = found.searches
    assert advanced == [1, 1]
    assert (mass.space.structure, diagonal.space.structure) == ('mass', 'diagonal')
    begun = diagonal.space.nearest(mass.space.entry(mass.x))
    assert np.abs(diagonal.points[:3] - begun).max(axis=1).min() < 1e-12
    assert sum(diagonal.stages == 'global') == 3, 'and at no point of a sequence'


@pytest.mark.usefixtures('brief')
def test_the_reference_may_be_faster_than_the_samples_and_so_may_what_is_tuned(tmp_path) -> None:
    base = scenario(tmp_path, {'gvc': GVC | {'k_D': 150.0}}, duration=0.05)
    request = Request(base, 'gvc', ('gvc',), 'effort', 'error', 1e-3, 'mass', 'continuous', 0, 1)
    space = tuned(request, 'gvc', Goal.of(request)).best.space
    assert space.fastest == pytest.approx(150.0)  # 1/s, of samples 0.01 s apart


def test_the_best_structure_is_equal_and_where_none_is_the_nearest_to_it() -> None:
    made = [(True, 5.0, 3.001), (True, 6.0, 3.0), (False, 1.0, 3.3), (False, 0.1, 2.0)]
    ranks = [
        searching._rank(
            SimpleNamespace(reached=reached, measures=measures(*np.array([[error], [effort]]))),
            goal('effort', 4.0, 3.0),
        )
        for reached, error, effort in made
    ]
    assert ranks == sorted(ranks)


@pytest.mark.usefixtures('brief')
def test_an_open_loop_beside_the_reference_keeps_its_excitation(tmp_path) -> None:
    wave = {'surge': {'terms': [{'amplitude': 5.0, 'omega': 1.0}]}}
    controllers = {'gvc': GVC, 'wave': {'law': 'multisine'}}
    base = scenario(tmp_path, controllers, duration=0.05, excitation=wave)
    request = Request(base, 'gvc', ('gvc',), 'effort', 'error', 1e-3, 'scalar', 'continuous', 0, 1)
    goal = Goal.of(request)
    effort = tuned(request, 'gvc', goal).best.measures.effort[0]
    assert effort == pytest.approx(goal.reference.effort[0], rel=1e-3), 'it starts at its gains'


def test_single_runs_that_are_not_what_the_search_saw_end_a_tuning(tmp_path, monkeypatch) -> None:
    wild = {'law': 'cl', 'k_D': 1e9, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
    back = {'surge': {'offset': -0.5}}  # whose largest command is a negative one
    base = scenario(tmp_path, {'gvc': GVC, 'wild': wild}, duration=0.2, setpoint=back)
    request = Request(base, 'gvc', ('gvc',), 'effort', 'error', 1e-3, 'scalar', 'continuous', 0, 1)
    nominal = of_each(base, 'continuous')
    assert np.isnan(nominal['wild'].error[0])
    told: list[object] = []

    def progress(*about):
        told.append(about)
        return lambda: told.append('done')

    largest, commands = _checked(base, request, nominal, progress)
    assert largest < 1e-6
    assert list(commands) == ['gvc'], 'what diverged has no largest command'
    np.testing.assert_array_equal(commands['gvc'], np.abs(simulate(base, 'gvc').tau).max(axis=0))
    assert told == [('checking against single runs', 2), 'done', 'done']

    def off(run):
        found = measures_of_run(run)
        return found._replace(effort=found.effort * (1 + 2e-6), error=found.error * (1 + 1e-7))

    monkeypatch.setattr(tuning, 'measures_of_run', off)
    line = r'small, gvc: expected what the batch gave, found effort apart by 2e-06 \(relative\)'
    with pytest.raises(FailedError, match=line):
        _checked(base, request, nominal, progress)


def test_a_name_that_is_taken_is_made_longer_until_it_is_free() -> None:
    taken = SimpleNamespace(controllers=['cl', 'cl_tuned', 'cl_tuned_again'])
    assert tuning._free('cl_tuned', taken) == 'cl_tuned_again_again'
    assert tuning._free('gvc_tuned', taken) == 'gvc_tuned'


def test_a_reference_that_diverges_is_nothing_to_equal(tmp_path) -> None:
    base = scenario(tmp_path, {'gvc': GVC | {'k_D': 1e9}}, duration=0.2)
    request = Request(base, 'gvc', ('gvc',), 'effort', 'error', 1e-3, 'scalar', 'continuous', 0, 1)
    with pytest.raises(DivergedError, match='small, gvc: the reference diverges'):
        Goal.of(request)


def test_a_reference_that_has_nothing_to_do_is_refused(tmp_path, monkeypatch) -> None:
    base = scenario(tmp_path, {'gvc': GVC}, setpoint={}, disturbance=[], duration=0.05)
    request = Request(base, 'gvc', ('gvc',), 'effort', 'error', 1e-3, 'scalar', 'continuous', 0, 1)
    expected = 'controllers.gvc: expected a reference with effort and error, found effort 0, error'
    with pytest.raises(InputError, match=expected):
        Goal.of(request)
    for error, effort in ((0.0, 2.0), (3.0, 0.0)):
        made = measures(np.array([error]), np.array([effort]))
        monkeypatch.setattr(searching, 'measured', lambda *_, made=made: made)
        with pytest.raises(InputError, match=f'found effort {effort:g}, error {error:g}'):
            Goal.of(request)
