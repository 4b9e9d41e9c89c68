"""Pauses of topics: marked, never interpolated across, and seen as such by all that follows."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from helpers.foreign_bags import UNNAMED, Maker, loaded, motion, simple, simulated, write
from helpers.foreign_logs import TABLES, tables
from numpy.testing import assert_allclose, assert_array_equal
from rich.console import Console
from scipy.integrate import trapezoid

from auv_analysis import summarize
from auv_analysis.bag.reading import usual_limit
from auv_analysis.bag.tracks import (
    Track,
    at_times,
    between_gaps,
    integral,
    means_over,
    sensible_step,
    time_base,
)
from auv_analysis.cli.scenario_runs import summary_tables
from auv_analysis.metrics.lyapunov import lyapunov
from auv_analysis.output.text import number
from auv_analysis.report import plots
from auv_analysis.report.digest import digest
from auv_analysis.report.run_plots import draw_figures
from auv_analysis.runs.run import Run
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.laws.model import control_model

KEYS = {'odometry': '/o', 'wrench': '/w', 'frames': 'enu_flu', 'step': 0.01}


@pytest.fixture(scope='module')
def run() -> Run:
    return simulated(duration=5.0)


def track(seconds, values=None, role: str = 'twist', gap: float = np.inf, *, held: bool = False):
    ns = np.round(np.array(seconds) * NANOSECONDS).astype(np.int64)
    rows = np.arange(len(ns), dtype=float) if values is None else np.array(values, float)
    return Track(role, f'/{role}', ns, rows[:, None], gap * NANOSECONDS, held)


def holed(
    run: Run, folder, odometry: tuple[float, float], wrench: tuple[float, float], **keys
) -> Run:
    """The run without the messages between two times, s, of odometry and of wrench."""
    states, forces = (
        motion(run, enu=False, keep=(run.t <= begin) | (run.t >= end))
        for begin, end in (odometry, wrench)
    )
    return loaded(tables(folder / 'other', states, forces), **{**TABLES, 'step': 0.01, **keys})


def test_samples_stop_and_begin_again_where_any_topic_does(run, tmp_path) -> None:
    found = holed(run, tmp_path, (1.0, 1.5), (3.0, 3.8))
    assert_allclose(found.gaps, [[1.0, 1.5], [3.0, 3.8]], atol=1e-9)
    early, late = found.gaps
    for keep, gaps in (
        (found.t < 3.1, (early,)), (found.t > 1.1, (late,)), (found.t < 3.9, (early, late)),
        (found.t < 0.0, ()),
    ):  # fmt: skip
        assert found.part(keep).gaps == gaps
    inside = ((run.t > 1.005) & (run.t < 1.495)) | ((run.t > 3.005) & (run.t < 3.795))
    assert_allclose(found.t, run.t[~inside], atol=1e-9)
    assert_allclose(found.nu, run.nu[~inside], atol=1e-9)
    assert_allclose(found.tau, run.tau[~inside], rtol=1e-9)
    assert found.valid_share == pytest.approx(np.count_nonzero(~inside) / run.samples)
    said = ' '.join(found.notes)
    assert 'motion: 1 pause longer than 0.05 s, 0.5 s together' in said
    assert 'force: 1 pause longer than 0.05 s, 0.8 s together' in said
    assert 'no samples in 2 gaps, 1.3 s together' in said


def test_a_pause_that_is_told_to_be_none_is_interpolated(run, tmp_path) -> None:
    found = holed(run, tmp_path, (1.0, 1.5), (1.0, 1.01), gap=0.6)
    assert found.gaps == ()
    assert found.samples == run.samples
    middle = np.argmin(np.abs(found.t - 1.25))
    assert_allclose(found.nu[middle], (run.nu[100] + run.nu[150]) / 2, atol=1e-9)


def test_a_set_point_holds_however_long_unless_told_otherwise(run, tmp_path) -> None:
    maker, m = Maker(), motion(run, enu=True)
    messages = simple(m, maker, '/o', '/w', UNNAMED)
    first, second = (messages[i][1] for i in (0, 250))
    for ns, i in ((first, 0), (second, 250)):
        twist = maker.six('Twist', m.nu_d[i])
        messages.append(('/s', ns, twist))
    bag = write(tmp_path / 'other', messages, maker)
    found = loaded(bag, **KEYS, setpoint='/s')
    assert found.gaps == ()
    assert np.unique(found.nu_d, axis=0).shape[0] == 2
    assert np.isfinite(summarize(found)['velocity_error']['rms']).all()


def test_figures_of_the_summary_are_those_of_the_samples_that_are_there(run, tmp_path) -> None:
    found = holed(run, tmp_path, (1.0, 1.5), (3.0, 3.8))
    summary = summarize(found)
    kept = np.isin(np.round(run.t, 6), np.round(found.t, 6))
    nu, M = run.nu[kept], run.vehicle.M
    expected = 0.5 * np.einsum('ni,ij,nj->n', nu, M, nu).mean()
    assert summary['kinetic_energy']['mean'] == pytest.approx(expected, rel=1e-9)
    assert_allclose(summary['effort']['rms'], np.sqrt((run.tau[kept] ** 2).mean(axis=0)), rtol=1e-9)
    assert summary['gaps'] == {
        'valid_share': pytest.approx(kept.mean()),
        'spans': [
            {'window': pytest.approx([1.0, 1.5])},
            {'window': pytest.approx([3.0, 3.8])},
        ],
    }
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary


def test_the_unexplained_wrench_takes_nothing_across_a_gap(run, tmp_path) -> None:
    """A velocity that jumps while nobody looks is no force."""
    moved = run.part(slice(None))
    moved.nu[run.t > 2.25] += [0.5, 0, 0, 0, 0, 0]
    free = holed(moved, tmp_path / 'a', (2.0, 2.5), (9.0, 9.0))
    seen = holed(moved, tmp_path / 'b', (9.0, 9.0), (9.0, 9.0))
    shift = 0.5 * run.vehicle.M[0, 0]  # N s that it would take
    assert np.abs(seen.unexplained[:, 0]).max() > shift
    assert np.abs(free.unexplained[:, 0]).max() < shift


def test_no_certificate_across_gaps(run, tmp_path) -> None:
    found = holed(run, tmp_path, (1.0, 1.5), (9.0, 9.0))
    model = control_model(run.vehicle)
    assert 'the run has gaps' in lyapunov(found, model)['reason']


def test_lines_break_and_the_gap_is_shaded(run, tmp_path, monkeypatch) -> None:
    found = holed(run, tmp_path, (1.0, 1.5), (9.0, 9.0))
    drawn = digest(found)
    t, y = drawn.drawn('tau', 0, 'late')
    assert not np.isnan(y).any(), 'the gap is before'
    t, y = drawn.drawn('delta_xi', 0)
    assert_allclose(t[np.isnan(y)], [1.01])
    figures: dict = {}

    def save(figure, folder, name):
        figures[name] = figure
        return folder / f'{name}.png', folder / f'{name}.pdf'

    monkeypatch.setattr(plots, 'save', save)
    records = {
        record.name: record for record in draw_figures({'dive': found}, tmp_path / 'figures')
    }
    for name in ('delta_xi', 'kinetic_energy', 'unexplained_dive'):
        assert 'Grey spans: no samples.' in records[name].caption
        for axes in figures[name].axes:
            spans = [patch.get_extents().transformed(axes.transData.inverted())
                     for patch in axes.patches]  # fmt: skip
            assert any(np.allclose([box.x0, box.x1], [1.0, 1.5]) for box in spans), name
    assert records['errors_dive'].png is None
    assert records['settling'].png is None
    lines = [line.get_ydata() for axes in figures['delta_xi'].axes for line in axes.lines]
    assert all(np.isnan(y).any() for y in lines if len(y))


def test_stretches_too_short_for_rates_are_left_out(run, tmp_path) -> None:
    seen = motion(
        run, enu=True, keep=(run.t <= 1.0) | ((run.t > 1.5) & (run.t < 1.55)) | (run.t > 2)
    )
    forces = motion(run, enu=True)
    listed = simple(seen, Maker(), '/o', '/w', UNNAMED, forces)
    found = loaded(write(tmp_path / 'other', listed, Maker()), **KEYS)
    assert_allclose(found.gaps, [[1.0, 2.01]], atol=1e-9)
    assert any('1 part between gaps too short' in note for note in found.notes)


def test_many_samples_in_a_step_are_averaged(run, tmp_path) -> None:
    found = holed(run, tmp_path, (9.0, 9.0), (9.0, 9.0), step=0.1)
    assert any('velocity' not in note and 'mean over each step' in note for note in found.notes)
    at = found.t + 0.05  # the first step is whole: its middle is the first sample
    for t, nu, tau in zip(at, found.nu, found.tau, strict=True):
        inside = (run.t > t - 0.0501) & (run.t < t + 0.0501)
        expected = trapezoid(run.nu[inside], run.t[inside], axis=0) / 0.1
        assert_allclose(nu, expected, atol=1e-9)
        assert_allclose(tau, run.tau[inside][:-1].mean(axis=0), rtol=1e-6, atol=1e-6)


def test_limits_know_bursts() -> None:
    even = (0.1 * np.arange(50) * NANOSECONDS).astype(np.int64)
    assert usual_limit(even) == pytest.approx(0.5 * NANOSECONDS)
    bursts = np.cumsum(np.tile([0.002, 0.004, 0.03], 60) * NANOSECONDS).astype(np.int64)
    assert usual_limit(bursts) > 0.08 * NANOSECONDS, 'a pause between bursts is none'
    pauses = np.cumsum([0.1] * 40 + [30.0] + [0.1] * 40) * NANOSECONDS
    assert usual_limit(pauses.astype(np.int64)) < 1.0 * NANOSECONDS
    assert usual_limit(even[:2]) == pytest.approx(0.5 * NANOSECONDS)
    assert usual_limit(even[:1]) == np.inf


def test_a_period_is_none_of_the_intervals_inside_of_bursts() -> None:
    """Three samples 10 ns apart every 30 ms, and a pause of an hour."""
    ns = np.cumsum([*np.tile([10, 10, 29_999_980], 60), 3600 * NANOSECONDS, 10, 10])
    track = Track('twist', '/o', ns, np.zeros((len(ns), 6)), usual_limit(ns), held=False)
    assert 0.9e7 < track.period < 1.1e7


def test_steps_are_rounded_to_two_digits() -> None:
    assert [sensible_step(p) for p in (33_333_333.0, 9_987_654.0, 20e6)] == [
        33000000,
        10000000,
        20000000,
    ]


def test_base_has_equal_steps_through_gaps() -> None:
    a = track(np.r_[np.arange(0, 30), np.arange(50.5, 80)] / 10.0, gap=0.5)
    b = track(np.arange(-3, 75) / 10.0, role='wrench', gap=0.5, held=True)
    base = time_base([a, b], a, NANOSECONDS // 5)
    assert base.ns[0] == NANOSECONDS // 10, 'several samples in a step: means about its middle'
    assert_allclose(np.diff(base.t) / 0.2, np.round(np.diff(base.t) / 0.2), atol=1e-9)
    assert base.spans() == ((pytest.approx(2.6), pytest.approx(5.2)),)
    assert base.t[-1] == pytest.approx(7.2)
    assert_array_equal(np.unique(base.owner), [0, 1])


def test_a_stretch_is_of_use_from_twelve_velocities_on() -> None:
    for count, left in ((12, 0), (11, 1)):
        one = track(np.arange(count) / 10.0)
        base = time_base([one, track([0.0, 1.1], gap=2.0)], one, NANOSECONDS // 10)
        assert (len(base.ns), base.left_out) == (count if not left else 0, left)


def test_a_pause_is_tolerated_where_nobody_told_its_limit() -> None:
    one = track([0.0, 1.0, 5.0], gap=2.0)
    both = replace(one, parts=(one, replace(one, told=True)))
    found = both.tolerant(4.0 * NANOSECONDS)
    assert [part.limit / NANOSECONDS for part in found.parts] == [4.0, 2.0]
    assert (len(both.gaps()), found.gaps().tolist()) == (2, [[NANOSECONDS, 5 * NANOSECONDS]])


def test_a_gap_within_another_one_ends_before_it() -> None:
    wide, inside = track([0, 1, 10, 11], gap=2.0), track([0, 1, 2, 6, 7, 8, 9, 10, 11], gap=2.0)
    found = between_gaps(0, 11 * NANOSECONDS, [inside, wide])
    assert (np.array(found) / NANOSECONDS).tolist() == [[0, 1], [10, 11]]


def test_integrals_and_means_of_what_is_held_and_of_lines() -> None:
    times, values = [0.0, 1.0, 3.0], [1.0, 3.0, -1.0]
    at = np.array([0.5, 2.0, 3.0]) * NANOSECONDS
    line, held = track(times, values), track(times, values, held=True)
    ns = at.astype(np.int64)
    assert_allclose(integral(line, ns)[:, 0], [0.75, 2.0 + 2.0, 2.0 + 2.0])
    assert_allclose(integral(held, ns)[:, 0], [0.5, 1.0 + 3.0, 1.0 + 6.0])
    assert_allclose(at_times(held, ns)[:, 0], [1.0, 3.0, -1.0])
    assert_allclose(means_over(held, ns[:1], ns[1:2])[:, 0], [(0.5 * 1.0 + 3.0) / 1.5])


def test_the_terminal_shows_the_unexplained_wrench(run, tmp_path) -> None:
    summary = summarize(holed(run, tmp_path, (1.0, 1.5), (9.0, 9.0)))
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(summary_tables({'dive': summary}))
    text = console.export_text()
    head = next(
        line for line in text.splitlines() if line.split() == ['mean', 'rms', 'max', 'error']
    )
    rows = text[text.index(head) :].splitlines()[2:8]
    assert [row.split()[0] for row in rows] == list(DOFS)
    assert rows[0].split()[1] == number(summary['unexplained']['mean'][0])
    assert 'not settled' not in text, 'without a set-point there is nothing to settle'
