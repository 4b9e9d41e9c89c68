"""What the paper leaves open: vehicles that keep N, the same judges, and what decides."""

from dataclasses import replace
from functools import cache

import numpy as np
import pyarrow.parquet as parquet
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from strategies import QUICK

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.report import paper
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.studies.study.responses import ERROR, response
from auv_analysis.studies.study.sensitivity import sensitivity
from auv_analysis.study.attribution import best_split
from auv_analysis.study.paper_claims import case_of, paper_claims
from auv_analysis.study.robustness import crossings, energy_ranges, met, robustness
from auv_analysis.study.unknowns import (
    DAMPING,
    M46,
    MASS,
    Variant,
    changes_of,
    inertia,
    scenario_of,
    variants,
)
from auv_analysis.study.unknowns_file import write_unknowns
from auv_analysis.study.unknowns_report import energy_table, unknowns_sentences, unknowns_tables
from auv_analysis.study.unknowns_responses import responses_of
from auv_analysis.study.unknowns_run import unknowns
from auv_dynamics.files.errors import InputError
from auv_gvc_controller.laws.decomposition import decompose

OTHER = Variant('corner', 300.0, -32.0, 20.0, 0.0, 1)


@cache
def base():
    return load_scenario('case1')


@cache
def few():
    told = []
    first = variants(base())[0]
    found = unknowns(base(), chosen=[first, OTHER], threads=2, progress=lambda *at: told.append(at))
    return found, told


@given(st.floats(*MASS), st.sampled_from(M46).flatmap(lambda ends: st.floats(*ends)))
@QUICK
def test_every_vehicle_has_the_printed_N(mass, roll_yaw):
    M = inertia(mass, roll_yaw)
    N = decompose(M)[1]
    assert_allclose(N, paper.N, atol=1e-9)
    assert np.array_equal(M, M.T)
    assert M[3, 5] == roll_yaw
    assert M[0, 4] == -M[1, 3] == pytest.approx(mass * 0.03)
    assert M[1, 5] == -M[2, 4] == pytest.approx(mass * 0.15)
    wrong = M.copy()
    wrong[2, 4] = wrong[4, 2] = -M[2, 4]
    wrong[1, 5] = wrong[5, 1] = -M[1, 5]
    if abs(roll_yaw * mass) > 1:
        assert abs(decompose(wrong)[1] - paper.N).max() > 1e-3  # M46 then does not fit


def test_the_shipped_vehicle_is_one_of_them_but_for_rounding():
    assert_allclose(inertia(250.0, 20.0), base().vehicle.M, atol=0.02)


def test_variants_are_shipped_corners_and_points_inside():
    found = variants(base())
    kinds = [variant.kind for variant in found]
    assert (kinds.count('shipped'), kinds.count('corner'), kinds.count('inside')) == (1, 32, 64)
    assert len(set(found)) == len(found)
    assert changes_of(found[0], base()) == {}
    for variant in found:
        assert MASS[0] <= variant.mass <= MASS[1]
        assert any(low <= variant.M46 <= high for low, high in M46)
        assert all(DAMPING[0] <= x <= DAMPING[1] for x in (variant.linear, variant.quadratic))
    inside = [v for v in found if v.kind == 'inside']
    assert {v.exponent_sign for v in inside} == {-1, 1}
    assert 0.3 < np.mean([v.M46 > 0 for v in inside]) < 0.7
    assert variants(base()) == found
    assert variants(base(), seed=1) != found


def test_a_variant_is_what_it_says():
    scenario = scenario_of(OTHER, base())
    assert scenario.vehicle.weight == pytest.approx(300.0 * 9.81)
    at_rest, moving = scenario.vehicle.D(np.zeros(6)), scenario.vehicle.D(np.ones(6))
    assert_allclose(at_rest, 20.0 * base().vehicle.D(np.zeros(6)))
    assert_allclose(moving, at_rest)  # no quadratic part
    assert scenario.data['disturbance'][0]['exponent_sign'] == 1


def test_the_shipped_variant_is_judged_as_a_study_judges_it():
    found, _ = few()
    claims = paper_claims(base(), {}, threads=2).claims
    expected = [claim.verdict for claim in claims]
    assert list(found.verdicts[0, found.windows.index(30.0)]) == expected
    assert list(found.verdicts[1, 1]) != expected


def test_energies_are_those_of_the_summary():
    found, _ = few()
    run = simulate(base(), 'gvc')
    for end in (5.0, 10.0, 30.0):
        k = int(np.flatnonzero(np.isclose(found.ends, end))[0])
        summary = summarize(run, (0.0, end))['kinetic_energy']
        assert_allclose(found.energy[0, k], summary['mean_by_component'], rtol=1e-12)
    ten, whole = energy_ranges(found)
    assert ten.low <= ten.shipped <= ten.high
    assert (ten.window, whole.window) == (10.0, 30.0)
    assert ten.shipped == pytest.approx(528.18, abs=0.005)
    shipped, low, high = met(found)
    assert low <= shipped <= high
    total = np.interp(shipped, found.ends, found.energy[0].sum(axis=1))
    assert total == pytest.approx(paper.KINETIC_ENERGY)


def test_progress_goes_to_its_end():
    _, told = few()
    done = [at for at, _ in told]
    assert done == sorted(done)
    assert told[-1][0] == told[-1][1]


def test_responses_of_a_variant_are_those_of_its_scenario():
    case = case_of(changed_scenario(base(), {'duration': 3.0}), 'case1')
    found = responses_of(case, [OTHER], 3.0, 1)['cl'][0]
    alone = scenario_of(OTHER, case)
    expected = response(alone, 'cl', sensitivity(alone, 'cl', count=64, threads=2))
    assert_allclose(found.others, expected.others, rtol=1e-5)
    assert_allclose(found.gains, expected.gains, rtol=0.25)  # of 32 points, not of 128
    assert ERROR == 'velocity_error.rms'


@pytest.mark.parametrize(
    ('values', 'key'),
    [
        ({'name': 'mine'}, 'name'),
        ({'vehicle.rigid_body.mass': 200.0}, 'vehicle.rigid_body.mass'),
        ({'setpoint.surge.offset': 0.3}, 'setpoint.surge.offset'),
    ],
)
def test_only_the_papers_own_scenario_is_varied(values, key):
    with pytest.raises(InputError, match=key):
        unknowns(changed_scenario(base(), values), chosen=[OTHER])


def test_the_best_question_is_found():
    x = np.arange(10.0)
    unknowns_ = {'noise': np.cos(7.3 * x), 'cause': x}
    outcome = np.where(x < 6.5, 'no', 'yes')
    split = best_split(unknowns_, outcome, 'yes')
    assert (split.unknown, split.threshold, split.explained) == ('cause', 6.5, 1.0)
    assert (split.below, split.above) == (0.0, 100.0)
    turned = best_split(unknowns_, outcome, 'no')
    assert (turned.below, turned.above) == (100.0, 0.0)
    half = best_split({'cause': x}, np.where((x < 2) | (x > 7), 'yes', 'no'), 'yes')
    assert 0.0 < half.explained < 1.0
    assert best_split(unknowns_, np.full(10, 'yes'), 'yes') is None
    assert best_split({'constant': 0 * x}, outcome, 'yes') is None


def made(verdicts):
    """Two variants, as read and with the other sign, with these verdicts of claim 1."""
    found, _ = few()
    table = np.full((2, 2, 21), 'reproduced', object)
    table[:, :, 0] = verdicts
    return replace(found, verdicts=table)


@pytest.mark.parametrize(
    ('verdicts', 'every', 'as_read'),
    [
        ('reproduced', 'holds over all', 'holds over all'),
        ('not reproduced', 'fails over all', 'fails over all'),
        ('partly', 'partly in all', 'partly in all'),
        ([['reproduced'], ['partly']], 'varies', 'holds over all'),
        ([['reproduced', 'partly'], ['partly', 'partly']], 'varies', 'varies'),
        ('not evaluated', 'not evaluated', 'not evaluated'),
        (
            [['reproduced', 'not evaluated'], ['not evaluated', 'reproduced']],
            *2 * ['holds over all, of those evaluated'],
        ),
    ],
)
def test_outcomes_follow_the_verdicts(verdicts, every, as_read):
    found = made(verdicts)
    rows = robustness(found)
    assert (rows[0].every.outcome, rows[0].as_read.outcome) == (every, as_read)
    assert rows[1].every.outcome == 'holds over all'
    texts = ' '.join(sentence.text for sentence in unknowns_sentences(found, rows))
    assert f'{21 if every == "holds over all" else 20} claims' in texts
    cells = [row[6].text for table in unknowns_tables(found, rows) for row in table.rows]
    assert cells[0].startswith(every)


def test_the_window_can_be_what_decides():
    row = robustness(made([['reproduced', 'partly'], ['reproduced', 'partly']]))[0]
    assert (row.every.split.unknown, row.every.split.explained) == ('window', 1.0)


def test_files_hold_what_the_tables_show(tmp_path):
    found, _ = few()
    rows = robustness(found)
    verdicts, claims, energy = (
        parquet.read_table(path).to_pylist() for path in write_unknowns(tmp_path, found, rows)
    )
    assert len(verdicts) == 2 * 2 * 21
    assert {row['verdict'] for row in verdicts if row['number'] == 14} == {'not reproduced'}
    assert {row['mass'] for row in verdicts} == {250.0, 300.0}
    shares = {(row['number'], row['of']): row['reproduced'] for row in claims}
    for table, of in zip(unknowns_tables(found, rows), ('every', 'as_read'), strict=True):
        for cells in table.rows:
            assert cells[3].value == shares[cells[0].value, of]
    by_end = {round(row['end'], 1): row for row in energy}
    for cells in energy_table(found).rows:
        assert cells[1].value == by_end[cells[0].value]['energy']


def test_crossings_of_a_line():
    x = np.linspace(0.0, 10.0, 2001)
    assert_allclose(
        list(crossings(x, np.cos(x), 0.0)), np.pi * np.array([0.5, 1.5, 2.5]), atol=1e-4
    )
    assert list(crossings(x, x, 20.0)) == []
