"""Thinned lines of a run in blocks: nothing that a reader could see is lost."""

import tracemalloc
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.block_runs import in_blocks
from helpers.strategies import examples
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.metrics.energy import kinetic_energy
from auv_analysis.report import plots, run_plots
from auv_analysis.report.digest import digest, is_split
from auv_analysis.report.run_report import write_report
from auv_analysis.report.traces import COLUMNS, FEW, Trace, broken, thinned
from auv_analysis.runs.run import Run
from auv_gvc_controller.laws.model import control_model

quick = examples(15)


def signal(seed: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.uniform(0.001, 0.02, n)), rng.normal(size=n).round(1)


@given(
    seed=st.integers(0, 999),
    n=st.integers(1, 16_000),
    rows=st.integers(500, 20_000),
    logarithmic=st.booleans(),
)
@quick
def test_a_trace_in_blocks_is_the_line_of_the_whole(seed, n, rows, logarithmic) -> None:
    t, y = signal(seed, n)
    trace = Trace(t[0], t[-1], logarithmic=logarithmic)
    for i in range(0, n, rows):
        trace.add(t[i : i + rows], y[i : i + rows])
    whole = t, y
    if n > FEW:
        whole = thinned(t, y, logarithmic=logarithmic)
    for found, expected in zip(trace.line(), whole, strict=True):
        assert_array_equal(found, expected)


@pytest.mark.parametrize('more', [0, 1])
def test_as_many_samples_as_columns_have_points_are_all_drawn(more: int) -> None:
    t, y = signal(1, 2 * (COLUMNS - 1) + more)
    trace = Trace(t[0], t[-1])
    trace.add(t, y)
    assert (len(trace.line()[0]) == len(t)) is (more == 0)


@given(seed=st.integers(0, 999), n=st.integers(FEW + 1, 16_000))
@quick
def test_columns_keep_their_extremes_in_the_order_of_time(seed, n) -> None:
    t, y = signal(seed, n)
    few_t, few_y = thinned(t, y)
    assert len(few_t) <= 2 * COLUMNS
    assert np.all(np.diff(few_t) > 0)
    assert (few_t[0], few_t[-1], few_y[0], few_y[-1]) == (t[0], t[-1], y[0], y[-1])
    width = (t[-1] - t[0]) / (COLUMNS - 1)
    column, few_column = (((x - t[0]) / width).astype(int) for x in (t, few_t))
    for c in np.unique(column)[:: COLUMNS // 50]:
        assert y[column == c].max() == few_y[few_column == c].max()
        assert y[column == c].min() == few_y[few_column == c].min()


def repeated(run: Run, n: int) -> Run:
    """The samples of a run over and over, n of them."""
    k = np.arange(n)
    return replace(run.part(k % len(run.t)), t=k * run.step)


@pytest.fixture(scope='module')
def run() -> Run:
    scenario = load_scenario('case1')
    short = replace(scenario, data=scenario.data | {'duration': 8.0})
    return replace(simulate(short, 'gvc', 'zoh'), scenario='mine', law_state=None)


def test_a_spike_of_one_sample_is_seen_on_the_figure(run) -> None:
    """One sample in forty thousand, on the picture itself."""
    n, quiet = 40_000, replace(run, nu=0.0 * run.nu, nu_d=0.0 * run.nu_d, tau=0.0 * run.tau)
    pictures = []
    for spike in (0.0, 5.0):
        long = repeated(quiet, n)
        long.nu_d[:, 2] += 1e-3 * np.sin(long.t)
        long.nu_d[long.t == 256.8, 2] = spike
        drawn = digest(long)
        t, y = drawn.line('error', 2, 'late')
        assert (y == spike).sum() >= (spike > 0)
        assert len(t) <= 2 * COLUMNS
        with plots.style():
            figure = plots.new_figure(3.0)
            axes = figure.subplots()
            run_plots.draw_lines(axes, drawn, 'error', 'late', [2])
            axes.set_ylim(-1.0, 6.0)
            canvas = FigureCanvasAgg(figure)
            canvas.draw()
        pictures.append(np.asarray(canvas.buffer_rgba(), float)[..., :3].mean(axis=2))
    rows, columns = np.nonzero(pictures[0] - pictures[1] > 60.0)
    assert np.ptp(rows) > 0.6 * pictures[0].shape[0], 'a line over most of the height'
    assert np.ptp(columns) <= 6, 'and a few pixels wide'


def test_lines_of_a_long_run_have_columns_over_all_that_is_shown_of_it(run) -> None:
    noise = np.random.default_rng(0).normal(size=(60_000, 6))
    long = replace(repeated(run, len(noise)), t=50.0 + 1e-4 * np.arange(len(noise)), nu_d=noise)
    error, late = long.nu_d - long.nu, long.t > 52.0
    drawn, end = digest(long), long.t[-1]
    for part, seen, ends in (('early', ~late, (50.0, 52.0)), ('late', late, (52.0, end))):
        wanted = thinned(long.t[seen], error[seen, 2], ends)
        for found, expected in zip(drawn.line('error', 2, part), wanted, strict=True):
            assert_array_equal(found, expected)
    assert np.diff(drawn.line('energy')[0]).max() < 3 * (end - 50.0) / COLUMNS
    since, ends = long.t[1:] - 50.0, (run.step, end - 50.0)
    wanted = thinned(since, np.abs(error[1:, 2]), ends, logarithmic=True)
    assert len(wanted[0]) > COLUMNS
    for found, expected in zip(drawn.line('error', 2, 'log'), wanted, strict=True):
        assert_array_equal(found, expected)


def test_shares_are_those_of_the_mean_energy_of_each_column(run) -> None:
    long, model = repeated(run, 6000), control_model(run.vehicle)
    few_t, parts = digest(long).stack
    energy = kinetic_energy(model.Upsilon_inv.reshape(6, 6), model.N, long.nu)
    energy = energy.reshape(600, 10, 6).mean(axis=1)
    assert_allclose(few_t, long.t.reshape(600, 10).mean(axis=1), rtol=1e-12)
    assert_allclose(parts, 100 * energy / energy.sum(axis=1, keepdims=True), atol=1e-9)


@pytest.mark.long
def test_a_report_does_not_grow_with_the_run(run, tmp_path) -> None:
    """The page is flat; a PDF grows until its lines are full, 4000 points each."""
    sizes = []
    for n in (50_000, 400_000):
        long = repeated(run, n)
        out = tmp_path / str(n)
        out.mkdir()
        report = write_report(out, {'gvc': long}, {'gvc': summarize(long)}, '', '')
        names = {path.stem for path in (out / 'figures').glob('*.png')}
        assert {'errors_gvc', 'settling', 'inputs_gvc', 'certificate_gvc'} <= names
        pdfs = sum(path.stat().st_size for path in (out / 'figures').glob('*.pdf'))
        sizes.append((report.stat().st_size, pdfs))
    assert sizes[1][0] < 1.3 * sizes[0][0]
    assert sizes[1][1] < 1_500_000


def test_a_sketch_in_blocks_is_that_of_the_whole(run, monkeypatch) -> None:
    whole = digest(run)
    parts = digest(in_blocks(run, 37))
    assert whole.columns == parts.columns
    assert (whole.settled, whole.F_digest) == (parts.settled, parts.F_digest)
    for name in whole.columns:
        for window in ((0.0,), (2.0,), (0.0, 2.0), (2.0 / 3.0 * run.duration,)):
            one, other = whole.part(name, *window), parts.part(name, *window)
            assert_allclose(one.rms, other.rms, rtol=1e-12)
            assert_array_equal(one.at, other.at)
    assert whole.traces.keys() == parts.traces.keys()
    for key, traces in whole.traces.items():
        for one, other in zip(traces, parts.traces[key], strict=True):
            assert_allclose(one.line(), other.line(), rtol=1e-9, atol=1e-9)
    assert_allclose(whole.stack[1], parts.stack[1], rtol=1e-12, atol=1e-12)
    seconds = run.t >= 2.0 - 0.005
    error = run.nu_d - run.nu
    assert_allclose(whole.part('error', 2.0).peak, np.abs(error[seconds]).max(axis=0))
    assert_allclose(whole.part('error').path, np.abs(np.diff(error, axis=0)).sum(axis=0))
    monkeypatch.setattr('auv_analysis.report.digest.COURSE', 100)
    early = run.t[:, None] < 7.5  # but for half a second, the least that a run dwells
    changed = replace(
        run,
        nu=run.nu_d + 0.1 * early,
        disturbance_estimate=early * run.disturbance_estimate,
        applied=run.tau + early * (np.arange(6) == 2),
    )
    whole, parts = digest(changed), digest(in_blocks(changed, 37))
    assert whole.settled == parts.settled == pytest.approx(7.49)
    assert whole.estimates is parts.estimates is True
    assert whole.missed.tolist() == parts.missed.tolist() == (np.arange(6) == 2).tolist()
    assert whole.begin.tolist() == parts.begin.tolist() == [*run.eta[0], *changed.nu[0]]
    assert whole.end.tolist() == parts.end.tolist() == run.eta[-1].tolist()
    assert {*whole.course} == {'t', 'nu_d', 'F'}
    for name, values in whole.course.items():
        assert_array_equal(values, parts.course[name])


def test_memory_does_not_grow_with_the_run(run) -> None:
    peaks = []
    for n in (40_000, 100_000):
        long = repeated(run, n)
        tracemalloc.start()
        summarize(long)
        digest(long)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0], peaks


def test_a_gap_outside_a_line_does_not_break_it() -> None:
    t, y = np.arange(5.0, 9.0), np.arange(4.0)
    for outside in (1.1, 9.05):
        assert np.array_equal(broken((t, y), [outside]), (t, y))
    broken_t, broken_y = broken((t, y), [6.1])
    assert broken_t.tolist() == [5.0, 6.0, 6.1, 7.0, 8.0]
    assert np.isnan(broken_y).tolist() == [False, False, True, False, False]


def test_columns_at_the_ends_of_a_gap_are_kept(run) -> None:
    stack = np.array([0.5, 1.0, 1.5, 2.0, 2.5]), np.ones((5, 6))
    t, parts = replace(digest(run), stack=stack, gaps=((1.0, 2.0),), step=0.1).shares()
    assert t == pytest.approx([0.5, 1.0, 1.1, 1.9, 2.0, 2.5])
    assert parts[:, 0].tolist() == [1.0, 1.0, 0.0, 0.0, 1.0, 1.0]


def test_errors_that_are_never_far_from_zero_have_settled_at_once(run) -> None:
    for samples in (2, 801):
        near = replace(run, nu=run.nu_d + 1e-4).part(slice(0, samples))
        assert digest(near).settled == 0.0


@pytest.mark.parametrize(
    ('seconds', 'step', 'split'), [(4.0, 0.1, False), (4.1, 2.0, True), (4.1, 2.05, False)]
)
def test_the_first_phase_is_drawn_apart_where_more_than_it_follows(seconds, step, split) -> None:
    assert is_split(SimpleNamespace(duration=seconds, step=step)) is split, (
        'of two samples at least'
    )


def test_a_figure_is_laid_out_alike_in_both_files(tmp_path: Path) -> None:
    drawn, saved = (plots.new_figure(3.0) for _ in range(2))
    for figure in (drawn, saved):
        figure.subplots().legend(handles=[], title='x', bbox_to_anchor=(1.0, 1.02))
    drawn.draw_without_rendering()
    plots.save(saved, tmp_path, 'x')
    assert saved.axes[0].get_position().bounds == drawn.axes[0].get_position().bounds


def test_a_name_in_letters_that_the_font_has_not_is_drawn_without_a_warning(tmp_path: Path) -> None:
    figure = plots.new_figure(1.0)
    figure.text(0.5, 0.5, '推進器')
    record = plots.save_figures(tmp_path, {'x': lambda: (figure, 'x', '推進器')})['x']
    assert (record.png is not None and record.png.is_file(), record.caption) == (True, '推進器')
