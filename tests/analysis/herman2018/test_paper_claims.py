"""All 21 claims in a study of either case: verdicts, numbers as data, honest departures."""

import json
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pyarrow.parquet as parquet
import pytest

from auv_analysis import load_scenario, simulate
from auv_analysis.herman2018 import cases, paper
from auv_analysis.herman2018 import responses as responses_of
from auv_analysis.herman2018.cases import (
    case_evidence,
    case_of,
    claims_sentences,
    departures_of,
    paper_claims,
)
from auv_analysis.herman2018.claims import judged, write_claims
from auv_analysis.herman2018.evidence import ErrorSensitivity, Quotes, percent
from auv_analysis.herman2018.responses import (
    ERROR,
    STEP,
    followed,
    moved_setpoints,
    response,
    rms_errors,
    setpoint_changes,
)
from auv_analysis.output.text import MISSING
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.simulation.simulate import DivergedError
from auv_analysis.studies.study.sensitivity import sensitivity

NUMBER = re.compile(r'([+−]?)(\d[\d\u202f]*)(?:\.(\d+))?(?:·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?')
POWERS = str.maketrans('⁻⁰¹²³⁴⁵⁶⁷⁸⁹', '-0123456789')
PITCH = 4


MADE = {}


def few(case, law, hold='continuous', threads=2):
    """Sensitivity of few samples; that of the same loops is made once."""
    key = json.dumps([case.data, case.vehicle_data, law, hold], sort_keys=True)
    if key not in MADE:
        MADE[key] = sensitivity(case, law, count=16, hold=hold, threads=threads)
    return MADE[key]


@pytest.fixture(autouse=True)
def few_samples(monkeypatch):
    """As many as `sensitivities` has, where a test gives none."""
    monkeypatch.setattr(cases, 'sensitivity', few)


@cache
def sensitivities():
    case = case_of(load_scenario('case1'), 'case1')
    return {law: few(case, law) for law in ('gvc', 'cl')}


@cache
def evidence():
    return {case: case_evidence(case_of(load_scenario(case), case)) for case in paper.CASES}


@cache
def study(name='case1'):
    scenario = load_scenario(name)
    runs = {law: simulate(scenario, law) for law in scenario.controllers}
    known = sensitivities() if name == 'case1' else {}
    return paper_claims(scenario, runs, known, threads=2)


def numbers(text):
    """Each number of a text and half of its last digit."""
    for sign, whole, decimals, power in NUMBER.findall(text):
        scale = 10.0 ** int(power.translate(POWERS) if power else 0)
        digits = whole.replace('\u202f', '')
        value = float(f'{digits}.{decimals or 0}') * (-1 if sign == '−' else 1)
        yield value * scale, 0.5 * 10.0 ** -len(decimals) * scale


@pytest.mark.parametrize('name', ['case1', 'case2'])
def test_every_claim_is_judged_in_a_study_of_either_case(name, approved):
    claims = study(name).claims
    approved.add(f'{c.number} {value.name} ({value.unit})' for c in claims for value in c.values)
    expected = dict.fromkeys(range(1, 22), 'reproduced')
    expected |= {8: 'partly', 9: 'partly', 14: 'not reproduced', 15: 'partly'}
    assert {claim.number: claim.verdict for claim in claims} == expected
    of_case = {claim.number: claim.case for claim in claims}
    assert {n for n, case in of_case.items() if case == 'case2'} == {17, 18, 19, 20} | (
        {21} if name == 'case2' else set()
    )
    assert all(claim.ours != MISSING and claim.window != MISSING for claim in claims)
    assert not study(name).departures
    assert claims_sentences(study(name)) == []


def test_the_other_case_gives_the_same_numbers_from_either_side():
    ours = {name: {c.number: c.ours for c in study(name).claims} for name in paper.CASES}
    ours['case1'].pop(15), ours['case2'].pop(15)  # of another design of the gains
    assert ours['case1'] == ours['case2']


@pytest.mark.parametrize('name', paper.CASES)
def test_a_case_is_the_shipped_scenario(name):
    other = next(case for case in paper.CASES if case != name)
    assert case_of(load_scenario(other), name).data == load_scenario(name).data


@pytest.mark.parametrize('name', paper.CASES)
def test_every_number_of_the_texts_is_in_the_file(name, tmp_path):
    rows = parquet.read_table(write_claims(tmp_path, study(name).claims)).to_pylist()
    assert {row['number'] for row in rows} == set(range(1, 22))
    found = 0
    for claim in study(name).claims:
        order = [row['of'] for row in rows if row['number'] == claim.number]
        assert order == sorted(order)  # ours before the paper's
        for of in ('ours', 'paper'):
            text = getattr(claim, of)
            mine = [row for row in rows if (row['number'], row['of']) == (claim.number, of)]
            values = np.array([row['value'] for row in mine if row['value'] is not None])
            for number, half in numbers(re.sub(r'Δπ|Δξ', '', text)):
                found += 1
                near = np.abs(values - number) <= half * (1 + 1e-9)
                assert near.any(), f'{claim.number} {of}: {number} of {text!r} in {mine}'
            assert all(row[of] == text for row in mine)
    assert found > 120


def responses(gains, others):
    """Both laws alike: spread of every error by the gains, and what the other set-points do."""
    one = ErrorSensitivity(np.array(gains, float), np.array(others, float))
    return {'gvc': one, 'cl': one}


FIRST, SECOND = [0.1, 0.1, 0.1, 0.2, 0.3, 0.1], [0.1, 0.1, 0.1, 0.4, 0.3, 0.1]


@pytest.mark.parametrize(
    ('gains', 'others', 'verdict'),
    [
        (FIRST, FIRST, 'reproduced'),
        (SECOND, FIRST, 'partly'),
        (FIRST, SECOND, 'partly'),
        (SECOND, SECOND, 'partly'),  # the coupling alone
    ],
)
def test_claim_15_goes_by_its_criterion(gains, others, verdict):
    known = evidence()['case1']
    claim = judged({'case1': replace(known, responses=responses(gains, others))})[14]
    assert claim.verdict == verdict
    assert named(claim)['RMS error of pitch by the gains, cl'] == gains[PITCH]


def test_claim_15_is_not_reproduced_without_the_coupling():
    known = evidence()['case1']
    run = simulate(load_scenario('case1'), 'gvc')
    tau = run.tau.copy()
    tau[:, 1] = 1e5  # sway: its coupling deforms roll and yaw
    other = case_evidence(load_scenario('case1'), {'gvc': replace(run, tau=tau)})
    peak = other.gvc.part('delta_pi').peak
    assert peak[[3, 5]].max() > peak[PITCH]
    changed = replace(known, runs=other.runs, responses=responses(SECOND, SECOND))
    assert judged({'case1': changed})[14].verdict == 'not reproduced'
    assert judged({'case1': replace(changed, responses={})})[14].verdict == 'not evaluated'


def test_the_runs_at_hand_are_judged_not_others():
    scenario = load_scenario('case1')
    gvc = simulate(scenario, 'gvc')
    slow = {'gvc': replace(gvc, nu=gvc.nu_d + 0.01)}
    claims = paper_claims(scenario, slow, sensitivities()).claims
    assert claims[0].verdict == 'not reproduced'
    assert claims[16].verdict == 'reproduced'  # of case 2, which is simulated


def named(claim):
    return {value.name: value.value for value in claim.values}


def test_a_sensitivity_at_hand_is_taken_not_another():
    scenario = load_scenario('case1')
    runs = {law: simulate(scenario, law) for law in scenario.controllers}
    exchanged = dict(zip(('cl', 'gvc'), sensitivities().values(), strict=True))
    usual, found = named(study().claims[14]), paper_claims(scenario, runs, exchanged).claims[14]
    for one, other in (('gvc', 'cl'), ('cl', 'gvc')):
        name = 'RMS error of pitch by the gains'
        assert named(found)[f'{name}, {one}'] == usual[f'{name}, {other}']
    scenario = load_scenario('case2')  # whose gains the claim is not of
    runs = {law: simulate(scenario, law) for law in scenario.controllers}
    found = paper_claims(scenario, runs, exchanged, threads=2).claims[14]
    assert named(found) == named(study('case2').claims[14])


def test_what_is_simulated_beside_a_study_is_held_as_its_runs_are():
    scenario = changed_scenario(load_scenario('case1'), {'duration': 3.0})
    claims = paper_claims(scenario, {}, hold='zoh', threads=2).claims
    follow, start = named(claims[14]), named(claims[19])
    for law in ('gvc', 'cl'):
        tau = simulate(case_of(scenario, 'case2'), law, 'zoh').tau[:201]
        assert start[f'peak of τ_X, {law}'] == np.abs(tau[:, 0]).max()
        gains = few(scenario, law, 'zoh').six(ERROR)
        changed = (changed_scenario(scenario, values) for values in setpoint_changes(scenario))
        errors = np.stack([rms_errors(simulate(one, law, 'zoh')) for one in changed])
        others = followed(errors, moved_setpoints(scenario))
        assert follow[f'RMS error of pitch by the gains, {law}'] == gains[PITCH]
        assert follow[f'RMS error of pitch by the other set-points, {law}'] == others[PITCH]


@pytest.mark.usefixtures('approved')
def test_a_changed_case_says_what_was_changed():
    values = {'vehicle.rigid_body.mass': 200.0, 'duration': 6.0}
    found = paper_claims(changed_scenario(load_scenario('case1'), values), {}, sensitivities())
    assert {path for path, *_ in found.departures} == {'duration', 'vehicle.rigid_body.mass'}
    assert {claim.case for claim in found.claims} == {'case1, changed', 'case2, changed'}
    (sentence,) = claims_sentences(found)
    assert 'vehicle.rigid_body.mass = 200.0 (shipped: 250.0)' in sentence.text


def test_every_kind_of_departure_from_the_shipped_case_is_named():
    values = {
        'duration': 6.0, 'step': 0.02, 'integrator': 'rk4', 'initial.nu[0]': 0.1,
        'setpoint.surge.offset': 0.3, 'disturbance': [{'kind': 'herman2018', 'scale': 2.0}],
        'vehicle.damping.linear[0]': 71.0,
    }  # fmt: skip
    found = {path for path, *_ in departures_of(changed_scenario(load_scenario('case1'), values))}
    assert found == {path.partition('[')[0] for path in values}
    less = {'setpoint': {'surge': {'offset': 0.3}}, 'vehicle.name': 'mine', 'vehicle.source': 'me'}
    ours = changed_scenario(load_scenario('case1'), less)
    shipped = load_scenario('case1').data['setpoint']
    assert {path: theirs for path, _, theirs in departures_of(ours)} == {
        'setpoint.surge.offset': shipped['surge'].get('offset'),
        'setpoint.surge.terms': shipped['surge'].get('terms'),
        **{f'setpoint.{dof}': entry for dof, entry in shipped.items() if dof != 'surge'},
    }


@pytest.mark.parametrize(
    ('values', 'words'),
    [
        ({'actuators': {'limit': 100.0}}, 'actuators'),
        ({'disturbance': [{'kind': 'model_error', 'dD': 3.0}]}, 'model error'),
        ({'name': 'mine'}, 'no case of the paper'),
        ({'sensors': {'velocity_noise': 0.1}, 'actuators': {'lag': 0.1}}, 'sensors'),
    ],
)
@pytest.mark.usefixtures('approved')
def test_what_is_not_the_papers_is_not_judged(values, words):
    scenario = changed_scenario(load_scenario('case1'), values)
    found = paper_claims(scenario, {})
    assert found.claims == ()
    assert words in found.reason
    assert found.reason in claims_sentences(found)[0].text


def test_a_set_point_of_a_file_or_an_open_loop_is_not_the_papers():
    case = load_scenario('case1')
    told = replace(case, data=case.data | {'setpoint': {'file': 'way.csv'}})
    assert 'a set-point from a file' in paper_claims(told, {}).reason
    wave = {'controllers': {'still': {'law': 'multisine'}}, 'excitation': {'yaw': {'offset': 1.0}}}
    assert 'excitation, which' in paper_claims(changed_scenario(case, wave), {}).reason


def test_claims_are_not_judged_where_a_loop_with_the_papers_gains_diverges(monkeypatch):
    def diverges(case, law, hold):
        raise DivergedError(f'{case.name}, {law}: the closed loop diverges')

    monkeypatch.setattr(cases, 'simulate', diverges)
    found = paper_claims(load_scenario('case1'), {})
    said = 'not judged: with the paper’s gains, case1, gvc: the closed loop diverges.'
    assert (found.claims, claims_sentences(found)[0].text[-len(said) :]) == ((), said)


def test_a_name_has_one_value():
    quote = Quotes()
    assert quote('a', 1.0, 'm') == quote('a', 1.0, 'm') == '1.00'
    assert quote('b', np.inf) == 'unbounded'
    assert [percent(x) for x in (-0.04, -0.06, 12.34)] == ['+0.0', '−0.1', '+12.3']
    assert [entry.value for entry in quote.values] == [1.0, None]
    with pytest.raises(ValueError, match='one value of a'):
        quote('a', 2.0, 'm')


def test_what_errors_follow_is_the_root_of_the_sum_over_the_others():
    errors = np.array([[1.0, 2.0, 3.0, 4.0, 0.0, 6.0]] * 3)
    errors[1, [0, 1]] *= STEP**0.5, STEP**3.0
    errors[2, [0, 1]] *= STEP**2.0, STEP**4.0
    assert followed(errors, [0, 2]) == pytest.approx([2.0, 5.0, 0.0, 0.0, 0.0, 0.0])


def test_a_controller_whose_loops_do_not_all_run_follows_nothing_that_is_known(monkeypatch):
    scenario, found = load_scenario('case1'), sensitivities()['gvc']
    assert response(scenario, 'gvc', replace(found, refusal='none')) is None

    def diverges(*_):
        raise DivergedError

    monkeypatch.setattr(responses_of, 'simulate', diverges)
    assert response(scenario, 'gvc', found) is None
