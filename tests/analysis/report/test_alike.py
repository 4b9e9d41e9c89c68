"""What runs have in common is told from their samples, and never from names."""

import re
from dataclasses import replace
from types import SimpleNamespace as Made

import numpy as np
import pytest
from helpers import made_runs
from helpers.block_runs import in_blocks

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.output.text import fixed
from auv_analysis.report import digest as digesting
from auv_analysis.report.digest import alike, digests
from auv_analysis.report.results import Table
from auv_analysis.report.run_plots import common_bands
from auv_analysis.report.run_report import SectionInputs, findings
from auv_analysis.report.scenario_text import SetUp, set_up
from auv_analysis.runs.run import Run


@pytest.fixture(scope='module')
def run() -> Run:
    scenario = load_scenario('case1')
    return simulate(replace(scenario, data=scenario.data | {'duration': 4.0}), 'gvc')


@pytest.fixture
def other(run) -> Run:
    """The same scenario's name, another set-point and disturbance."""
    return replace(run, nu_d=1.5 * run.nu_d, disturbance=run.disturbance + 1.0)


def said(runs: dict[str, Run]) -> str:
    runs = {name: replace(one, controller=name) for name, one in runs.items()}
    drawn = digests(runs)
    summaries = {name: summarize(one) for name, one in runs.items()}
    scenes = {tuple(runs): set_up(drawn, summaries, '')}
    sections = SectionInputs(drawn, summaries, scenes, [], {}).sections()
    experiment = ' '.join(str(block) for block in sections[0].blocks)
    return ' '.join([experiment, *(s.text for s in findings(drawn, summaries))])


def test_runs_of_one_name_are_told_apart_by_their_samples(run, other) -> None:
    text = said({'a': run, 'b': other})
    assert 'with the same start, but not with the same set-point and disturbance' in text
    assert 'Not all 2 runs of case1 have the same set-point' in text
    assert 'm apart' not in text


def test_runs_of_other_names_may_have_the_same_set_point(run) -> None:
    text = said({'a': run, 'b': replace(run, scenario='renamed', eta=1.1 * run.eta)})
    assert 'with the same start, set-point and disturbance.' in text
    assert 'for the same set-point these places are up to' in text
    assert 'only the name' not in text
    assert 'not shown' not in text, 'none is'


def test_another_start_is_not_laid_to_the_laws(run) -> None:
    assert 'm apart' not in said({'a': run, 'b': replace(run, eta=run.eta + 1.0)})


@pytest.mark.parametrize('every', [1, 2, 7])
def test_set_points_are_held_against_each_other_over_the_time_that_runs_share(run, every) -> None:
    shorter = run.part(slice(0, 300, every))
    a, b = digests({'a': run, 'b': shorter}).values()
    assert alike([a, b], 'nu_d') is True
    late = replace(shorter, nu_d=shorter.nu_d + 0.1 * (shorter.t > 1.5)[:, None])
    assert alike([a, *digests({'b': late}).values()], 'nu_d') is False


def test_runs_that_begin_at_other_times_are_held_against_each_other_from_their_starts(run) -> None:
    short = run.part(slice(0, 150))  # few times have no rounding
    later = replace(short, t=short.t + 1234.567)
    assert alike([*digests({'a': short, 'b': later}).values()], 'F') is True


def test_what_is_not_known_is_neither_the_same_nor_another(run) -> None:
    blind = replace(run, disturbance=None)
    shifted = replace(run, t=run.t * 1.000123)
    a, b, c = digests({'a': run, 'b': blind, 'c': shifted}).values()
    assert alike([a, b], 'F') is None
    assert alike([a, c], 'nu_d') is None


def test_a_band_is_drawn_only_where_the_runs_share_it() -> None:
    run = made_runs.made('gvc', 'gvc', 1)
    one = replace(run, nu_d=run.nu_d * [1, 1, 1, 1, 1, np.nan])
    other = replace(run, nu_d=run.nu_d * [1.5, 1 + 5e-7, 1 + 2e-6, 1, 1, np.nan])
    bands = common_bands(digests({'a': one, 'b': other}))
    assert [band is None for band in bands] == [True, False, True, False, False, False]


@pytest.mark.parametrize('measured', [True, False])
def test_noise_above_the_band_is_called_so_where_the_velocity_was_measured(run, measured) -> None:
    noise = np.random.default_rng(1).normal(scale=0.05, size=run.nu.shape)
    noisy = replace(run, nu=run.nu_d + noise, measured=run.nu if measured else None)
    text = said({'a': noisy})
    assert ('within its noise floor of' in text) == measured
    assert ('do not settle within 4 s: in the last 0.2 s' in text) != measured


@pytest.mark.parametrize(('last', 'settled'), [(60, 3.0), (233, np.inf)])
def test_settled_is_the_last_time_of_a_large_error_unless_it_is_too_late(last, settled) -> None:
    run = made_runs.made('gvc', 'gvc', 1)
    error = np.zeros_like(run.nu)
    error[last, 4], error[last + 1 :, 1] = -0.0051, 0.0049
    run = replace(run, nu=run.nu_d - error, faults=())
    found = digests({'gvc': in_blocks(run, 37)})['gvc']
    assert found.settled == pytest.approx(settled)


def test_a_course_has_as_many_samples_as_it_may(run, monkeypatch) -> None:
    monkeypatch.setattr(digesting, 'COURSE', 100)
    for samples in (2, 200, 201, 399, 400):
        shown = digests({'a': run.part(slice(0, samples))})['a']
        assert min(samples, 50) <= len(shown.course['t']) <= 100, samples


@pytest.mark.parametrize('count', [1, 2, 3])
def test_each_scenario_has_a_table_of_its_own(run, count: int) -> None:
    runs = {f'c{i}': replace(run, controller=f'c{i}', scenario=f's{i}') for i in range(count)}
    summaries = {name: summarize(one) for name, one in runs.items()}
    scenes = {(n,): set_up(digests({n: one}), summaries, '') for n, one in runs.items()}
    blocks = SectionInputs(digests(runs), summaries, scenes, [], {}).sections()[0].blocks
    names = [one.name for one in blocks if isinstance(one, Table) and one.name.startswith('set_up')]
    assert names == (['set_up'] if count == 1 else [f'set_up_{i + 1}' for i in range(count)])


def test_errors_after_two_seconds_are_told_of_runs_that_are_longer(run) -> None:
    for seconds, told in ((1.5, False), (4.0, True)):
        part = run.part(run.t <= seconds)
        texts = [s.text for s in findings(digests({'gvc': part}), {'gvc': summarize(part)})]
        assert any(text.startswith('After 2 s') for text in texts) is told
        assert all(text.endswith('.') for text in texts if text), texts


def test_an_end_is_told_where_the_position_is_known(run) -> None:
    lost, deep = (np.where(np.arange(6) < n, np.nan, run.eta) for n in (3, 2))
    nowhere, turned, submerged, there = (
        re.sub(' at 0x[0-9a-f]+', '', said({'a': replace(run, eta=eta)}))
        for eta in (np.nan * lost, lost, deep, run.eta)
    )
    assert nowhere == turned != there
    assert f'(–, –, {fixed(run.eta[-1, 2], 2)}) m under a' in submerged


def test_a_start_that_is_not_known_is_neither_the_same_nor_another(run) -> None:
    lost = replace(run, eta=np.where(np.arange(6) < 2, np.nan, run.eta))
    assert 'with the same set-point and disturbance.' in said({'a': lost, 'b': lost})
    other = replace(lost, eta=lost.eta + 1.0)
    assert 'disturbance, but not with the same start.' in said({'a': lost, 'b': other})


def test_disturbances_are_shared_where_the_faults_are_too(run) -> None:
    drawn, same = digests({'a': run, 'b': replace(run, controller='b')}), []
    for faults in ({'thruster': 1}, {'thruster': 2}):
        scenes = {(name,): SetUp('', [], None, {'disturbance': [1], 'faults': told})
                  for name, told in (('a', {'thruster': 1}), ('b', faults))}  # fmt: skip
        report = SectionInputs(drawn, {}, scenes, [], {})
        same.append(report._share_disturbances([*drawn.values()]))
        heavier = replace(drawn['b'], vehicle=run.vehicle.changed(M=1.1 * run.vehicle.M))
        assert not report._share_disturbances([drawn['a'], heavier])
    assert same == [True, False]
    untold = {('a',): SetUp('', [], None, {'name': 'calm'}), ('b',): SetUp('', [], None)}
    assert not SectionInputs(drawn, {}, untold, [], {})._share_disturbances([*drawn.values()])


def test_ten_samples_at_equal_times_are_enough_to_compare() -> None:
    t, nu_d = np.arange(30.0), np.ones((30, 6))
    for shared, known in ((9, None), (10, True), (11, True)):
        later = t + 0.5 * (t >= shared)
        runs = [Made(course={'t': times, 'nu_d': nu_d}) for times in (t, later)]
        assert alike(runs, 'nu_d') is known


@pytest.mark.parametrize(
    ('apart', 'same'),
    [([9e-4, -9e-10], True), ([-1.1e-3, 0.0], False), ([0.0, -1.1e-9], False)],
)
def test_what_is_apart_by_rounding_is_alike(apart: list[float], same: bool) -> None:
    """A signal with a peak of 1000, and one that is zero; one run has three samples."""
    few, many = (np.outer(np.arange(n), [-500.0, 0.0]) for n in (3, 30))
    runs = [Made(course={'t': np.arange(len(F)), 'F': F}) for F in (few, many + apart)]
    assert alike(runs, 'F') is alike(runs[::-1], 'F') is same
