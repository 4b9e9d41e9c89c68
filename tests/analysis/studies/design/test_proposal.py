"""What `auv design` proposes, says and writes, and that a fresh run gives just these numbers."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from helpers.report_pages import check_numbers

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.output.folder import ResultsFolder
from auv_analysis.studies.design import results, search
from auv_analysis.studies.design import setting as setting_of
from auv_analysis.studies.design.change import ALL, NAMES, Parameter, semi_axes
from auv_analysis.studies.design.prediction import COUPLINGS, Objective, coupling_named
from auv_analysis.studies.design.report import (
    _findings,
    _sections,
    change,
    print_design,
    write_report,
)
from auv_analysis.studies.design.results import (
    bound_warnings,
    place_warnings,
    side_effect_warnings,
    side_effects,
    warnings_of,
    write_results,
)
from auv_analysis.studies.design.search import Candidate, propose
from auv_analysis.studies.design.setting import change_words, open_setting, write_inputs
from auv_dynamics import InputError, load_vehicle
from auv_dynamics.files.shipped import shipped

SHORT = """
name: short
vehicle: herman2018
duration: 1.5
step: 0.01
controllers:
  soft: {law: cl, k_D: 12, k_I: 1, Lambda: 0.8, Gamma: 60}
  firm: {law: gvc, k_D: 12, k_I: 1, Lambda: 0.8, Gamma: 60}
setpoint:
  surge: {offset: 0.3}
  heave: {offset: 0.2}
  yaw: {offset: 0.1}
disturbance: {kind: herman2018}
"""


@pytest.fixture(autouse=True)
def only_the_target(monkeypatch):
    """The remedies against the other couplings, and many starts, take most of the time."""
    monkeypatch.setattr(search, 'MOST', 1)
    monkeypatch.setattr(search, 'STARTS', 1)


@pytest.fixture
def short(tmp_path):
    path = tmp_path / 'short.yaml'
    path.write_text(SHORT)
    return str(path)


def designed(vehicle, tmp_path, scenario=None, reduce=None, own=()):
    out = tmp_path / 'out'
    out.mkdir()
    found = propose(open_setting(vehicle, scenario, own), reduce)
    return write_results(found, ResultsFolder(out, out)), out


def by_name(document):
    return {row['name']: row for row in document['measures']}


@pytest.mark.parametrize('name', ['rexrov', 'herman2018', 'bluerov2'])
def test_the_largest_coupling_is_halved_and_a_fresh_run_says_so(name, tmp_path):
    result, out = designed(name, tmp_path)
    document = result.document
    first = document['ranking'][0]
    assert document['reduce'] == first['coupling'] == 'delta_pi.pitch'
    assert first['share']['before'] == max(row['share']['before'] for row in document['ranking'])
    row = by_name(document)['delta_pi_max.pitch']
    assert row['after'] <= 0.5 * row['before']
    assert first['largest'] == pytest.approx({key: row[key] for key in ('before', 'after')})
    assert first['share']['after'] < first['share']['before']
    ranked = {one['coupling'].replace('.', '_max.') for one in document['ranking']}
    assert ranked == {name for name in by_name(document) if name.startswith('delta_')}
    assert document['halved'] is True

    scenario = load_scenario(out / 'scenario.yaml')
    for controller in scenario.controllers:
        summary = summarize(simulate(scenario, controller))
        before = summarize(simulate(result.proposal.setting.scenario, controller))
        rows = document['controllers'][controller]['measures']
        assert rows
        for row in rows:
            assert row['after'] == figure(summary, row['name']), row['name']
            assert row['before'] == figure(before, row['name']), row['name']
        kept = json.loads((out / 'summary_before.json').read_text())[controller]
        assert kept == json.loads(json.dumps(before))
    assert document['measures'] == document['controllers']['gvc']['measures']

    proposed = [one for one in document['alternatives'] if one['proposed']]
    assert len(proposed) == 1
    assert proposed[0]['predicted'] == pytest.approx(proposed[0]['ratio'], abs=0.02)
    for one, parameter in zip(document['parameters'], NAMES, strict=True):
        assert one['name'] == parameter
        if one['value'] is not None:
            assert one['lower'] <= one['value'] <= one['upper']
    assert json.loads((out / 'design.json').read_text()) == json.loads(json.dumps(document))


def figure(summary, name):
    """A measure in a summary, looked up by its name."""
    *group, dof = name.split('.')
    if name == 'kinetic_energy.mean':
        return summary['kinetic_energy']['mean']
    i = ['surge', 'sway', 'heave', 'roll', 'pitch', 'yaw'].index(dof)
    keys = ['coupling', *group] if name.startswith('delta') else group
    value = summary
    for key in keys:
        value = value[key]
    return value[i]


def test_case1_of_the_paper_is_the_setting_of_its_vehicle(tmp_path):
    setting = open_setting('herman2018', None)
    assert setting.scenario.name == 'case1'
    assert setting.scenario.data['setpoint'] == load_scenario('case1').data['setpoint']
    other = open_setting('rexrov', None).scenario
    shipped_one = load_scenario('case1_rexrov')
    assert {**other.data, 'vehicle': 0} == {**shipped_one.data, 'vehicle': 0}


@pytest.mark.parametrize('name', ['lauv', 'bluerov2_heavy', 'lrauv_tethys'])
@pytest.mark.parametrize('reduce', [None, 'delta_xi.sway'])
def test_a_diagonal_M_has_nothing_to_remove(name, reduce, tmp_path):
    result, out = designed(name, tmp_path, reduce=reduce)
    assert result.document['measures'] == []
    assert 'M is diagonal' in result.document['statement']
    assert (out / 'vehicle.yaml').read_text() == shipped('vehicles', name).read_text()
    assert write_report(result, out).is_file()
    assert [one.source for one in _findings(result)] == [''], 'it leads to no table'


def test_a_structural_zero_is_told(short, tmp_path):
    result, _ = designed('herman2018', tmp_path, short, 'delta_pi.heave')
    assert result.document['measures'] == []
    statement = result.document['statement']
    assert 'delta_pi.heave is zero in every motion by the structure of M' in statement
    assert 'delta_pi.pitch' in statement


def test_a_coupling_that_the_scenario_does_not_move_is_told(tmp_path):
    path = tmp_path / 'rest.yaml'
    path.write_text(
        'name: rest\nvehicle: girona500\nduration: 0.5\nstep: 0.01\nsetpoint: {}\n'
        'controllers: {gvc: {law: gvc, k_D: 12, k_I: 1, Lambda: 0.8, Gamma: 60}}\n'
    )
    data = yaml.safe_load(shipped('vehicles', 'girona500').read_text())
    data['hydrostatics']['volume'] = data['rigid_body']['mass'] / 1000.0
    (tmp_path / 'v.yaml').write_text(yaml.safe_dump(data))
    result, _ = designed(str(tmp_path / 'v.yaml'), tmp_path, str(path))
    assert result.document['measures'] == []
    assert 'zero throughout this scenario' in result.document['statement']


def test_the_scenario_keeps_its_own_controllers(short, tmp_path, monkeypatch):
    monkeypatch.setattr(
        results, 'beyond_authority', lambda v, largest: [f'{v.name} {len(largest)}']
    )
    result, out = designed('rexrov', tmp_path, short, 'delta_xi.surge')
    document = result.document
    assert (document['scenario'], document['controller']) == ('short', 'firm')
    assert set(document['controllers']) == {'soft', 'firm'}
    assert document['warnings'][-1] == 'design_rexrov 6'
    assert document['reduce'] == 'delta_xi.surge'
    row = by_name(document)['delta_xi_max.surge']
    assert row['after'] < row['before']
    assert row['unit'] == 'm/s'
    data = yaml.safe_load((out / 'scenario.yaml').read_text())
    assert (data['name'], data['vehicle']) == ('short_changed', 'vehicle.yaml')
    assert load_scenario(out / 'scenario.yaml').vehicle.name == 'design_rexrov'


LAWS = {
    'firm': {'law': 'gvc', 'k_D': 12, 'k_I': 1, 'Lambda': 0.8, 'Gamma': 60},
    'push': {'law': 'pid', 'k_P': 1.0, 'k_I': 1.0, 'k_D': 1.0},
    'wild': {'law': 'cl', 'k_D': 1e9, 'k_I': 1, 'Lambda': 0.8, 'Gamma': 60},
}


def written(tmp_path, laws=(), **changes):
    data = yaml.safe_load(SHORT) | changes
    if laws:
        data['controllers'] = {name: LAWS[name] for name in laws}
    path = tmp_path / 'mine.yaml'
    path.write_text(yaml.safe_dump(data, sort_keys=False))
    return str(path)


@pytest.mark.parametrize(
    ('laws', 'judged'), [(('push', 'wild', 'firm'), 'firm'), (('push', 'wild'), 'push')]
)
def test_a_design_is_judged_by_the_first_gvc_or_the_first_there_is(laws, judged, tmp_path):
    assert open_setting('rexrov', written(tmp_path, laws)).controller == judged


def test_a_scenario_without_a_set_point_is_refused_by_name(tmp_path):
    with pytest.raises(InputError, match=r'mine\.yaml: setpoint: expected'):
        open_setting('rexrov', written(tmp_path, setpoint=5))


@pytest.mark.parametrize(('name', 'changed'), [('n' * 92, 'n' * 92), ('n' * 100, 'n' * 92)])
def test_a_long_name_has_room_for_what_says_that_it_is_changed(name, changed, tmp_path):
    setting = open_setting('rexrov', written(tmp_path, name=name))
    assert write_inputs(setting, None, '', tmp_path).name == f'{changed}_changed'


@pytest.mark.parametrize(('duration', 'is_quick'), [(300.0, True), (300.01, False)])
def test_many_steps_and_a_law_in_python_are_slow(duration, is_quick, tmp_path, monkeypatch):
    setting = open_setting('rexrov', written(tmp_path, duration=duration))
    assert setting.is_quick is is_quick
    monkeypatch.setattr(setting_of, 'is_compiled', lambda _: False)
    assert setting.is_quick is False


def test_a_controller_that_diverges_says_so_beside_the_others(tmp_path):
    setting = open_setting('rexrov', written(tmp_path, ('firm', 'wild'), duration=0.5))
    found = results.Simulated.of(setting.scenario, 'continuous')
    assert (list(found.runs), list(found.summaries)) == (['firm'], ['firm'])
    assert 'diverges' in found.failures['wild']
    coupled = results.coupled_in(setting.space.vehicle)
    told = results._controllers(found, found, coupled)
    assert (told['wild']['failure'], told['wild']['measures']) == (found.failures['wild'], [])
    assert told['firm']['failure'] is None
    assert len(told['firm']['measures']) > 20
    whole = replace(found, summaries={**found.summaries, 'wild': {}}, failures={})
    for before, after in ((whole, found), (found, whole)):
        told = results._controllers(before, after, coupled)
        assert told['wild']['failure'] == found.failures['wild']


def test_a_sampled_scenario_with_a_set_point_of_its_own(tmp_path):
    rows = ''.join(f'{t},{0.3},0,{0.1 * t},0,0,0.05\n' for t in (0.0, 1.0, 2.0))
    (tmp_path / 'way.csv').write_text(f't,surge,sway,heave,roll,pitch,yaw\n{rows}')
    data = yaml.safe_load(SHORT)
    data |= {'setpoint': {'file': 'way.csv'}, 'duration': 2.0, 'sensors': {'velocity_noise': 1e-4}}
    del data['controllers']['soft']
    (tmp_path / 's.yaml').write_text(yaml.safe_dump(data))
    result, out = designed('rexrov', tmp_path, str(tmp_path / 's.yaml'))
    assert result.document['hold'] == 'zoh'
    assert (out / 'setpoint.csv').read_text() == (tmp_path / 'way.csv').read_text()
    written = yaml.safe_load((out / 'scenario.yaml').read_text())
    assert written['setpoint'] == {'file': 'setpoint.csv'}, 'the folder needs no other one'
    summary = summarize(simulate(load_scenario(out / 'scenario.yaml'), 'firm', 'zoh'))
    for row in result.document['measures']:
        assert row['after'] == figure(summary, row['name'])


@pytest.mark.parametrize(
    ('share', 'words'), [(0.02, 'The bounds do not allow half'), (0.0, 'No change within')]
)
def test_bounds_that_do_not_allow_half_are_told(share, words, short, tmp_path, monkeypatch):
    asked, at_any_cost = [], search.Remedies.at_any_cost

    def at_cost(self, target, *given):
        asked.append(target)
        return at_any_cost(self, target, *given)

    monkeypatch.setattr(search.Remedies, 'at_any_cost', at_cost)
    setting = open_setting('rexrov', short)
    own = []
    for one in setting.space.parameters:
        if one.name.startswith('shift') or one.name in ('ballast.mass', 'disc.radius'):
            own.append((one.name, share * one.lower, share * one.upper))
    result, _ = designed('rexrov', tmp_path, short, 'delta_pi.pitch', own)
    document = result.document
    assert words in document['statement']
    assert document['halved'] is False
    assert len(asked) == 1
    row = by_name(document)['delta_pi_max.pitch']
    assert (row['after'] < row['before']) == (share > 0)
    assert f'{100 * (1 - row["after"] / row["before"]):.1f} %' in document['statement'] or not share


def test_the_same_input_gives_the_same_proposal(short):
    moved = [('ballast.mass', 0.0, 0.0), ('disc.radius', 0.0, 0.0)]  # nothing else
    first, second = (propose(open_setting('herman2018', short, moved), None) for _ in range(2))
    assert first.best.x.tolist() == second.best.x.tolist()
    assert first.best.ratio == second.best.ratio


@pytest.fixture
def remedies(short):
    setting = open_setting('rexrov', short)
    return search.Remedies(setting, *setting.simulated(setting.space.unchanged))


PITCH = COUPLINGS.index('delta_pi.pitch')


def test_a_change_that_was_not_as_predicted_is_searched_for_from_its_own_run(remedies, monkeypatch):
    space, objective = remedies.setting.space, Objective(remedies.prediction, PITCH)
    same = remedies._simulated(objective, ALL, space.unchanged)
    assert same.ratio == pytest.approx(1.0)
    assert remedies.refined(same) is same, 'it was as predicted'
    better = remedies.refined(replace(same, predicted=0.5))
    assert better.ratio < 0.5
    wrong = replace(better, predicted=9.0)
    monkeypatch.setattr(search, 'search', lambda *_: space.unchanged)
    assert remedies.refined(wrong) is wrong, 'none that is worse takes its place'


def test_at_any_cost_a_coupling_becomes_less_than_with_an_eye_on_the_others(remedies):
    *_, careful = remedies.candidates(PITCH, 1)
    assert remedies.at_any_cost(PITCH, 1).ratio < 0.5 * careful.ratio


class OfRatios:
    """Remedies that reach what is told, and note what they are asked for."""

    def __init__(self, *_):
        self.asked = []

    def targets(self):
        return [PITCH, 3, 7]

    def candidates(self, target, starts):
        self.asked.append((target, starts))
        for x, ratio in self.reached:
            change = np.zeros(len(NAMES))
            change[0] = x
            yield Candidate(target, 'shift', change, 0.5, ratio, 1.0)

    def at_any_cost(self, target, starts):
        self.asked.append(('at any cost', target, starts))
        return Candidate(target, ALL, np.full(len(NAMES), 0.1), 0.5, 0.6, 9.0)

    def refined(self, best):
        return best


@pytest.mark.parametrize(
    ('reached', 'quick', 'helps', 'costs'),
    [
        ([(0.1, 0.8), (0.2, 0.4)], True, 0.4, False),
        ([(0.1, 0.5)], False, 0.5, False),
        ([(0.1, 0.51), (0.1, None)], False, 0.51, True),
        ([(0.1, None)], False, 0.6, True),
        ([(0.0, 0.3)], False, None, False),  # nothing is changed
    ],
)
def test_remedies_against_the_others_follow_where_runs_are_quick(
    reached, quick, helps, costs, short, monkeypatch
):
    made = type('Told', (OfRatios,), {'reached': reached})()
    monkeypatch.setattr(search, 'Remedies', lambda *_: made)
    monkeypatch.setattr(search, 'STARTS', 4)
    monkeypatch.setattr(setting_of, 'MANY_STEPS', 150 if quick else 149)
    told = []
    found = propose(open_setting('rexrov', short), 'delta_pi.pitch', lambda *of: told.append(of))
    others = [(3, 1), (7, 1)] if quick else []
    assert made.asked == [
        (PITCH, 4), *([('at any cost', PITCH, 4)] if costs else []), *others
    ]  # fmt: skip
    parts = 1 + len(others)
    assert told == [*((done, parts) for done in range(parts)), (parts, parts)]
    assert (found.best and found.best.ratio) == helps
    assert [one.target for one in found.candidates] == [
        *[PITCH] * (len(reached) + costs), *np.repeat([3, 7], len(reached) * quick),
    ]  # fmt: skip


def test_changes_that_make_it_worse_are_no_proposal(short, monkeypatch):
    made = type('Told', (OfRatios,), {'reached': [(0.1, 1.0)]})()
    made.at_any_cost = lambda *_: Candidate(PITCH, ALL, np.full(len(NAMES), 0.1), 0.5, 1.0, 1.0)
    monkeypatch.setattr(search, 'Remedies', lambda *_: made)
    assert propose(open_setting('rexrov', short), 'delta_pi.pitch').best is None


def test_changes_that_halve_are_ranked_by_score_and_the_others_by_what_they_leave():
    def one(ratio, score):
        return Candidate(PITCH, ALL, np.zeros(len(NAMES)), 0.5, ratio, score)

    ordered = [one(0.1, 2.0), one(0.5, 2.5), one(0.3, 3.0), one(0.51, 9.0), one(0.8, 0.5),
               one(None, np.inf)]  # fmt: skip
    ranks = [found.rank for found in ordered]
    assert ranks == sorted(set(ranks))
    failed = results._candidate(replace(ordered[-1], failure='it diverges'), False)
    assert (failed['ratio'], failed['score'], failed['failure']) == (None, None, 'it diverges')
    found = results._candidate(ordered[0], True)
    assert (found['predicted'], found['ratio'], found['score']) == (0.5, 0.1, 2.0)
    assert (found['failure'], found['proposed']) == (None, True)


def test_a_change_that_cannot_be_run_says_why(remedies, monkeypatch):
    for error in (ZeroDivisionError('it diverges'), InputError('v', 'M', 'a mass', 'none')):

        def fail(*_, error=error):
            raise error

        monkeypatch.setattr(type(remedies.setting), 'simulated', fail)
        objective = Objective(remedies.prediction, PITCH)
        found = remedies._simulated(objective, ALL, remedies.setting.space.unchanged)
        assert (found.failure, found.ratio, found.run) == (str(error), None, None)
        assert remedies.refined(found) is found


def test_a_part_that_is_held_is_not_changed(short, tmp_path):
    own = [('ballast.mass', 0.0, 0.0), ('disc.radius', 0.0, 0.0), ('shift.x', 0.0, 0.05)]
    result, _ = designed('rexrov', tmp_path, short, None, own)
    assert set(result.document['proposal']['parts']) <= {'shift'}
    assert result.proposal.best.x[0] >= 0


@pytest.mark.parametrize(
    ('own', 'match'),
    [
        (('shift.q', 0, 1), 'shift.q'),
        (('shift.x', 0.1, 0.2), 'bounds with 0 between them'),
        (('shift.x', 1.0, -1.0), 'ascending'),
        (('ballast.x', float('nan'), 1.0), 'two numbers'),
        (('ballast.mass', 1.0, 2.0), 'expected 0:UPPER'),
    ],
)
def test_wrong_bounds_are_refused(own, match):
    with pytest.raises(InputError, match=match):
        open_setting('rexrov', None, [own])


def test_bounds_of_ones_own():
    space = open_setting('rexrov', None, [('ballast.mass', 0.0, 12.5)]).space
    lower, upper = space.bounds
    assert (lower[3], upper[3]) == (0.0, 12.5)
    assert 'as asked for' in {one.reason for one in space.parameters}


def test_an_unknown_coupling_is_refused_with_those_that_exist():
    with pytest.raises(InputError, match=r'one of delta_xi\.surge .*, found delta_xi\.sideways'):
        coupling_named('delta_xi.sideways', ['delta_xi.surge'])
    assert coupling_named('delta_pi_max.pitch', []) == 'delta_pi.pitch'


@pytest.mark.usefixtures('unrendered')
def test_the_report_and_its_numbers(short, tmp_path, capsys, approved):
    result, out = designed('rexrov', tmp_path, short)
    page = write_report(result, out).read_text(encoding='utf-8')
    approved.within = 0.05
    approved.folder(out)
    for word in ('delta_pi.pitch', 'Which change removes which coupling', 'vehicle_before.yaml'):
        assert word in page
    for name in ('couplings', 'reduced', 'Upsilon'):
        for ending in ('png', 'pdf'):
            assert (out / 'figures' / f'{name}.{ending}').is_file()
    assert check_numbers(out) > 100
    document = json.loads((out / 'design.json').read_text())
    print_design(document)
    printed = capsys.readouterr().out
    assert document['statement'] in printed
    approved.add(printed.splitlines())
    firm = document['controllers']['firm']
    result.document['controllers'] = {
        'firm': firm, 'soft': {'measures': [], 'failure': 'it diverges'}
    }  # fmt: skip
    _, effect, *_ = _sections(result, dict.fromkeys(('Upsilon', 'couplings', 'reduced')))
    *shown, failure = effect.blocks
    assert ([one and one.name for one in shown], failure) == (
        [None, 'ranking', None, 'measures'], 'Under soft: it diverges.'
    )  # fmt: skip


def test_a_vehicle_that_rights_itself_less_is_warned_of(approved):
    vehicle = load_vehicle('rexrov')
    places = (vehicle.r_G, [0.05, 0.0, -0.1], [0.0, 0.0, -0.5])
    own, worse, upside = (results.rest_of(replace(vehicle, r_G=np.array(r))) for r in places)
    assert warnings_of(own, own) == []
    falls, tilts = warnings_of(own, worse)
    assert 'falls from 5561 to 3734 N m' in falls.replace('\u202f', '')
    assert 'tilts by' in tilts
    approved.add([falls, tilts])
    assert warnings_of(own, upside) == ['the changed vehicle is statically unstable']
    apart = replace(vehicle, r_G=np.array([0.1, -0.2, 0.3]), r_B=np.array([0.0, 0.1, -0.4]))
    W, B = vehicle.weight, vehicle.buoyancy
    rights = 0.3 * W + 0.4 * B
    assert results.rest_of(apart) == {
        'weight': W, 'buoyancy': B, 'weight_minus_buoyancy': W - B, 'r_G': [0.1, -0.2, 0.3],
        'r_B': [0.0, 0.1, -0.4], 'metacentric_height': pytest.approx(0.7),
        'stability': pytest.approx(rights), 'tilt_at_rest_deg': pytest.approx(
            np.degrees(np.arctan(np.hypot(0.1 * W, -0.2 * W - 0.1 * B) / rights))),
    }  # fmt: skip
    assert upside['tilt_at_rest_deg'] is None


@pytest.mark.parametrize(('stable', 'tilted', 'said'), [
    (5.0, 2.99, ''), (5.0, 3.01, 'tilts by 3.0 deg, before 2.0'), (5.0, None, ''), (5.1, 2.0, ''),
    (4.99, 2.0, 'falls from 5.00 to 4.99 N m'), (0.0, None, 'statically unstable'),
])  # fmt: skip
def test_a_degree_more_of_tilt_and_less_of_stability_are_warned_of(stable, tilted, said):
    before, after = ({'stability': z, 'tilt_at_rest_deg': angle}
                     for z, angle in ((5.0, 2.0), (stable, tilted)))  # fmt: skip
    found = warnings_of(before, after)
    assert (len(found), said in ''.join(found)) == (bool(said), True)
    assert warnings_of({**before, 'tilt_at_rest_deg': None}, before) == []


def test_what_lies_on_a_bound_or_outside_the_hull_is_warned_of():
    space = open_setting('rexrov', None).space
    axes, _ = semi_axes(space.vehicle, space.data)
    inside = space.unchanged.copy()
    inside[7:11] = (0.2, *space.vehicle.r_B)
    corner = inside.copy()
    corner[8:11] += 0.9 * axes
    assert place_warnings(space, inside) == []
    for share, warnings in ((0.99, 0), (1.01, 1)):
        for ahead in np.diag(axes):
            on_axis = inside.copy()
            on_axis[8:11] += share * ahead
            assert len(place_warnings(space, on_axis)) == warnings
    (text,) = place_warnings(space, corner)
    assert text.startswith('the disc is placed outside the hull')
    rows = [{'name': 'disc.x', 'value': -1.135, 'unit': 'm', 'at_bound': 'lower'},
            {'name': 'disc.y', 'value': 0.1, 'unit': 'm', 'at_bound': None}]  # fmt: skip
    assert 'disc.x = −1.135 m (lower)' in bound_warnings(rows)[0]
    assert bound_warnings(rows[1:]) == []
    one = Parameter('shift.x', 'm', -1.0, 3.0, '')  # within 0.008 of an end
    for value, side in ((2.993, 'upper'), (2.991, None), (-0.993, 'lower'), (-0.991, None)):
        assert results._at_bound(one, value) == side
    assert results._at_bound(replace(one, unit='deg'), 3.0) is None
    assert results._at_bound(replace(one, upper=-1.0), -1.0) is None


def test_what_grows_beside_the_target_is_named_however_small_its_share():
    def row(name, before, after, unit='N m'):
        return {'name': name, 'unit': unit, 'before': before, 'after': after}

    rows = [
        row('delta_pi_max.pitch', 4000.0, 4800.0),
        row('delta_pi_max.yaw', 10.0, 38.4),
        row('delta_pi_max.roll', 50.0, 54.0),
        row('delta_pi_max.sway', 1e-12, 1e-9, 'N'),
        row('delta_pi_max.heave', 0.0, 3.0, 'N'),
        row('kinetic_energy.shares_percent.roll', 1.0, 5.0, '%'),
        row('velocity_error.max_after_2s.roll', None, None, 'rad/s'),
    ]
    found = {one['name']: one['percent'] for one in side_effects(rows, 'delta_pi.pitch')}
    assert found == {'delta_pi_max.heave': None, 'delta_pi_max.yaw': pytest.approx(284.0)}
    (text,) = side_effect_warnings(side_effects(rows, 'delta_pi.pitch'))
    assert '10.0 to 38.4 N m (+284 %)' in text
    assert text.startswith('side effects above 10 %: delta_pi_max.heave from 0 to 3.00 N (new)')
    many = [row(f'effort.max.{k}', 1.0, 2.0 + k) for k in range(8)]
    found = side_effects(many, 'delta_pi.pitch')
    assert [one['percent'] for one in found] == pytest.approx([100.0 * k for k in range(8, 0, -1)])
    for count, end in ((6, 'effort.max.2 from 1.00 to 4.00 N m (+300 %)'), (7, ' and 1 other'),
                       (8, ' and 2 others')):  # fmt: skip
        (text,) = side_effect_warnings(found[:count])
        assert text.endswith(end)
        assert text.count('N m') == 6
    assert side_effect_warnings([]) == []


def test_a_change_in_words():
    space = open_setting('rexrov', None).space
    x = space.unchanged.copy()
    x[:3] = (0.1, -0.02, 0.03)
    assert change_words(space, x) == [
        'move the centre of gravity 0.1 m forward, 0.02 m to port and 0.03 m down'
    ]
    x[3], x[7], x[12] = 10.0, 0.2, -90.0
    _, ballast, disc = change_words(space, x)
    assert (
        ballast
        == 'add 10.0 kg of ballast at the reference point, trimmed by foam at the same place'
    )
    assert disc == (
        'fit a thin circular plate of 0.400 m diameter, at the reference point, facing down '
        '(21.9 kg of added mass)'
    )
    x[8:13] = (-1.135, 0.2, -0.1, 0.0, 69.0)
    plate = change_words(space, x)[2]
    assert (
        ' 1.135 m aft, 0.2 m to starboard and 0.1 m above, seen from the reference point' in plate
    )
    assert 'facing down, turned 21.0° forward, its normal (0.358, 0, 0.934)' in plate


@pytest.mark.parametrize(
    ('before', 'after', 'text'),
    [
        (2.0, 1.0, '−50.0 %'),
        (1.0, 2.5, '+150.0 %'),
        (1.0, 1.0001, '0.0 %'),
        (0.0, 1.0, 'new'),
        (1.0, 1.0, '='),
        (0.0, 0.0, '='),
        (None, 1.0, ''),
    ],
)
def test_a_change_in_per_cent(before, after, text):
    assert change(before, after) == text


def test_the_couplings_are_named_like_the_summary():
    assert COUPLINGS[1] == 'delta_xi.sway'
    assert len(COUPLINGS) == 12


def test_the_largest_couplings_are_looked_at_first(monkeypatch):
    monkeypatch.setattr(search, 'MOST', 6)
    shares = np.array([0.2, 0.004, 0.9, 0.2, 0.05, 0.3, 0.1, 0.6])  # one is below a hundredth
    found = search.Remedies.targets(SimpleNamespace(before=SimpleNamespace(shares=shares)))
    assert found == [2, 7, 5, 0, 3, 6]
