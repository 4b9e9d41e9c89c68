"""What a fault does to a run, measured on runs whose errors are known."""

import re
from dataclasses import replace

import numpy as np
import pytest

from auv_analysis import simulate
from auv_analysis.metrics.fault_response import (
    FILE,
    fault_rows,
    responses,
    windows_of,
)
from auv_analysis.output.new_files import write_table
from auv_analysis.report.document import write_numbers
from auv_analysis.report.faults import fault_overview, fault_tables
from auv_analysis.runs.run import Run
from auv_analysis.scenario.fault_words import Mark, label, marks_of
from auv_analysis.scenario.scenario import load_scenario
from auv_dynamics import load_vehicle
from auv_dynamics.vehicle import DOFS

H = 0.01
LOST = Mark(1, 'thruster', 'thruster T3 lost', 10.0, 14.0)
LATE = Mark(2, 'sensor_delay', 'measurements 0.1 s late', 20.0, float('inf'))


@pytest.fixture(scope='module')
def made() -> Run:
    """30 s with nu_d of 1 m/s: errors 0.01, then 0.1 in sway for 4 s, then a decay, then 0.3."""
    base = simulate(load_scenario('case1'), 'gvc', 'zoh')
    t = np.arange(3001) * H
    error = np.full((len(t), 6), 0.001)
    error[:, 1] = np.select([t < 10 - H / 2, t < 14 - H / 2, t < 20 - H / 2],
                            [0.01, 0.1, 0.1 * np.exp(-(t - 14.0))], 0.3)  # fmt: skip
    nu_d = np.ones((len(t), 6))
    tau = np.tile(np.where(t < 10 - H / 2, 5.0, 7.0)[:, None], 6)
    return replace(
        base.part(slice(0, len(t))), t=t, nu_d=nu_d, nu=nu_d - error, tau=tau, faults=(LOST, LATE)
    )


def test_times_before_during_and_after(made):
    assert windows_of(LOST, made) == ((6.0, 10.0), (10.0, 14.0), (14.0, 18.0))
    before, during, after = windows_of(LATE, made)
    assert before == (14.0, 20.0)
    assert during == (20.0, 30.005)
    assert after[1] <= after[0]
    early = LOST._replace(start=2.5)
    assert windows_of(early, replace(made, faults=(early,)))[0] == (2.0, 2.5)
    at_once = LOST._replace(start=2.0)  # not later than the first 2 s, which then are before it
    assert windows_of(at_once, replace(made, faults=(at_once,)))[0] == (0.0, 2.0)
    first = LOST._replace(start=0.0, end=0.5)
    assert windows_of(first, replace(made, faults=(first, LATE))) == ((0, 0), (0, 0.5), (0.5, 1.5))


def test_a_fault_that_follows_at_once_is_not_looked_at(made):
    """Its interval is neither after the one nor before the other."""
    next_one = LOST._replace(number=2, start=LOST.end, end=18.0)
    both = replace(made, faults=(LOST, next_one))
    assert windows_of(LOST, both)[2] == (14.0, 14.0)
    assert windows_of(next_one, both) == ((14.0, 14.0), (14.0, 18.0), (18.0, 22.0))
    found = {(one.mark.number, one.dof): one for one in responses(both)}
    first, second = found[1, 'sway'], found[2, 'sway']
    assert (first.rms[2], first.recovery, first.until) == (None, None, 14.0)
    assert (second.rms[0], second.until) == (None, 30.0)
    together = LOST._replace(number=3)
    found = windows_of(LOST, replace(made, faults=(LOST, together)))
    assert found == ((6.0, 10.0), (10.0, 14.0), (14.0, 18.0))


def test_a_run_that_begins_later_has_later_windows(made):
    faults = [one._replace(start=one.start + 100.0, end=one.end + 100.0) for one in (LOST, LATE)]
    later = replace(made, t=made.t + 100.0, faults=tuple(faults))
    for one, other in zip((LOST, LATE), faults, strict=True):
        shifted = np.array(windows_of(one, made)) + 100.0
        np.testing.assert_allclose(windows_of(other, later), shifted, rtol=1e-12)
    pairs = zip(responses(made), responses(later), strict=True)
    for one, other in pairs:
        assert (other.rms, other.recovery) == (pytest.approx(one.rms), one.recovery)
        assert other.until == (None if one.until is None else one.until + 100.0)
    begun = faults[0]._replace(start=97.0)  # before what was recorded
    assert windows_of(begun, replace(later, faults=(begun,)))[:2] == ((100, 100), (100, 114))


def test_of_a_fault_that_was_over_before_the_first_sample_nothing_is_known(made):
    late = made.part(made.t > 16.995)
    assert windows_of(LOST, late) == ((17.0, 17.0), (17.0, 17.0), (14.0, 15.0))
    of_lost = [one for one in responses(late) if one.mark == LOST]
    assert {(one.rms, one.recovery) for one in of_lost} == {((None, None, None), None)}


def test_of_a_fault_that_ended_at_the_first_sample_the_recovery_is_known(made):
    sway = responses(made.part(made.t > 13.995))[1]
    assert (sway.rms[:2], sway.until) == ((None, None), 20.0)
    assert sway.recovery == pytest.approx(1.61)


def test_errors_recovery_and_effort(made):
    found = {(one.mark.number, one.dof): one for one in responses(made)}
    sway = found[1, 'sway']
    assert sway.rms[:2] == pytest.approx((0.01, 0.1), rel=1e-12)
    assert sway.peak[1] == pytest.approx(0.1)
    assert sway.band == pytest.approx(0.02)
    assert sway.recovery == pytest.approx(1.61)  # ln 5 s, in whole steps
    assert sway.until == 20.0
    assert sway.effort == pytest.approx((5.0, 7.0, 7.0))
    assert found[1, 'surge'].recovery == 0.0
    stays = found[2, 'sway']
    assert (stays.rms[2], stays.recovery, stays.until) == (None, None, None)
    assert stays.rms[1] == pytest.approx(0.3)


def test_every_number_is_that_of_its_axis_and_its_time(made):
    error, tau = np.random.default_rng(3).normal(size=(2, len(made.t), 6)) * np.arange(1.0, 7.0)
    peaks = np.arange(1.0, 7.0)
    nu_d = np.where(made.t < 25.0, -1.0, 0.5)[:, None] * peaks
    for one in responses(replace(made, nu_d=nu_d, nu=nu_d - error, tau=tau)):
        i = DOFS.index(one.dof)
        assert one.band == pytest.approx(0.02 * peaks[i])
        for k, (begin, end) in enumerate(one.windows):
            inside = (made.t >= begin - 1e-6) & (made.t < end - 1e-6)
            found = one.rms[k], one.peak[k], one.effort[k]
            if not inside.any():
                assert (one.mark, k, found) == (LATE, 2, (None, None, None))
                continue
            e, u = error[inside, i], tau[inside, i]
            expected = np.sqrt(np.mean(e**2)), np.abs(e).max(), np.sqrt(np.mean(u**2))
            assert found == pytest.approx(expected, rel=1e-9)


def test_recovery_counts_from_the_end_of_the_fault_not_from_the_next_sample(made):
    nu = made.nu_d - 0.001
    nu[:1451, 1] -= 0.1  # up to 14.5 s
    ended = LOST._replace(end=14.003)
    found = {one.dof: one for one in responses(replace(made, nu=nu, faults=(ended,)))}
    assert found['sway'].recovery == 0.507
    assert found['heave'].recovery == 0.0


def test_an_error_that_is_outside_at_the_end_is_not_recovered(made):
    slow = replace(made, nu=made.nu_d - 0.05)
    found = {(one.mark.number, one.dof): one for one in responses(slow)}
    assert found[1, 'sway'].recovery is None
    assert found[1, 'sway'].until == 20.0


def test_what_follows_a_fault_begins_with_the_sample_at_its_end(made):
    nu = made.nu_d - 0.001
    nu[1400, 1] -= 0.1
    ends = [LOST, LOST._replace(number=2, start=28.0, end=30.0)]
    found = responses(replace(made, nu=nu, faults=(*ends, ends[1]._replace(number=3, end=30.02))))
    first, second, third = (found[6 * i + 1] for i in range(3))
    assert (first.recovery, first.until) == (H, 28.0)
    assert (second.recovery, second.until) == (0.0, 30.0), 'with the run'
    assert (third.recovery, third.until) == (None, None)


@pytest.mark.parametrize('error', [None, 0.05])
def test_blocks_of_a_run_give_the_same(made, error):
    whole = made if error is None else replace(made, nu=made.nu_d - error)

    class InBlocks:
        def __getattr__(self, name):
            return getattr(whole, name)

        def blocks(self, rows=0):
            return whole.blocks(137)

    for one, other in zip(responses(InBlocks()), responses(whole), strict=True):
        pairs = zip(one.rms, other.rms, strict=True)
        assert all(a == b or a == pytest.approx(b, rel=1e-12) for a, b in pairs)
        assert (one.recovery, one.peak, one.until) == (other.recovery, other.peak, other.until)


def test_without_faults_or_set_point_there_is_nothing(made):
    assert responses(replace(made, faults=())) == []
    assert responses(replace(made, nu_d=np.full_like(made.nu_d, np.nan))) == []


def test_the_worst_fault_is_named(made):
    found = {'gvc': responses(made), 'cl': responses(replace(made, nu=made.nu_d - 0.03))}
    overview = [sentence.text for sentence in fault_overview(found)]
    assert 'disturbs gvc most is number 2' in overview[0]
    assert 'after 1 of the 1 that end' in overview[0]
    assert 'after none of the 1 that end' in overview[1]


def test_a_row_says_its_fault_its_axis_its_numbers_and_their_times(made):
    rows = fault_rows({'mine': responses(made)})
    about = {
        'fault': 1, 'kind': 'thruster', 'label': 'thruster T3 lost', 'start': 10.0, 'end': 14.0,
        'dof': 'sway', 'unit': 'm/s', 'effort_unit': 'N', 'until': 20.0, 'before_from': 6.0,
        'before_to': 10.0, 'during_from': 10.0, 'during_to': 14.0, 'after_from': 14.0,
        'after_to': 18.0, 'band': pytest.approx(0.02), 'recovery': pytest.approx(1.61),
        'rms_before': pytest.approx(0.01), 'rms_during': pytest.approx(0.1),
        'max_during': pytest.approx(0.1), 'effort_before': pytest.approx(5.0),
    }  # fmt: skip
    assert {name: rows[1][name] for name in about} == about
    last = {
        'fault': 2, 'start': 20.0, 'end': None, 'dof': 'yaw', 'unit': 'rad/s',
        'effort_unit': 'N m', 'until': None, 'recovery': None,
    }  # fmt: skip
    assert {name: rows[-1][name] for name in last} == last


def test_every_number_of_the_tables_is_in_the_file(made, tmp_path):
    import pyarrow.parquet as parquet

    found = {'gvc': responses(made)}
    write_table(tmp_path / FILE, fault_rows(found))
    tables = list(fault_tables(found))
    write_numbers(tmp_path / 'numbers.parquet', tables)
    held = parquet.read_table(tmp_path / FILE)
    numbers = parquet.read_table(tmp_path / 'numbers.parquet').to_pylist()
    assert len(numbers) == 90
    named = fault_rows({'mine': found['gvc']})
    assert {(row['controller'], row['law']) for row in named} == {('mine', 'gvc')}
    first = next(iter(found['gvc']))
    (begin, end), _, (_, last) = first.windows
    assert f'. Before is {begin:g}–{end:.6g} s, after is ' in tables[0].caption
    assert f'–{last:.6g} s (' in tables[0].caption
    for row in numbers:
        file, column, place = re.fullmatch(r'(.+):(.+)\[(\d+)\]', row['source']).groups()
        assert file == FILE
        assert row['value'] == held.column(column)[int(place)].as_py()


@pytest.mark.parametrize(
    ('spec', 'words'),
    [
        ({'kind': 'sensor_drop_out'}, 'measurements lost'),
        ({'kind': 'wrench_loss', 'probability': 0.25}, '25 % of the wrenches lost'),
        ({'kind': 'sensor_delay', 'delay': 0.2}, 'measurements 0.2 s late'),
        ({'kind': 'thruster', 'thruster': 'T1', 'efficiency': 0}, 'thruster T1 lost'),
        ({'kind': 'thruster', 'thruster': 'T1', 'stuck': -3.5}, 'thruster T1 stuck at -3.5 N'),
        ({'kind': 'actuator', 'axis': 'yaw', 'stuck': 2}, 'yaw actuator stuck at 2 N m'),
        ({'kind': 'actuator', 'axis': 'sway', 'efficiency': 0.4}, 'sway actuator at 40 %'),
        (
            {'kind': 'sensor_bias', 'velocity': [0.1, 0, 0, 4, 0, -0.2], 'attitude': [0, 0.3, 0]},
            'biased surge +0.1 m/s, roll +4 rad/s, yaw -0.2 rad/s, pitch angle +0.3 rad',
        ),
        ({'kind': 'sensor_bias', 'velocity': [0.0] * 6}, 'biased by zero'),
    ],
)
def test_faults_in_words(spec, words):
    assert label(spec) == words


def test_marks_name_thrusters_and_times():
    specs = [{'kind': 'thruster', 'thruster': 2.0, 'efficiency': 0.0, 'to': 3.0},
             {'kind': 'wrench_loss', 'from': 1.5}, {'kind': 'sensor_drop_out'}]  # fmt: skip
    marks = marks_of(specs, load_vehicle('bluerov2_heavy'))
    assert [mark.label for mark in marks] == [
        'thruster T3 lost',
        'wrenches lost',
        'measurements lost',
    ]
    assert [mark.times for mark in marks] == ['0–3 s', 'from 1.5 s on', 'throughout']
