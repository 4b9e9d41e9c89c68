"""Plots of runs: every line against the arrays of its run, every label against its line."""

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from helpers import artists
from helpers.approved import Approved
from helpers.artists import bands, legend, levels, named, near, same, spans
from helpers.certificates import certificate_of
from helpers.made_runs import (
    DOFS,
    HALVES,
    MARKS,
    SAMPLES,
    START,
    STEP,
    UPSILON,
    UPSILON_INV,
    VEHICLE,
    VELOCITY,
    WRENCH,
    M,
    energies,
    made,
)
from helpers.report_pages import tokens
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.markers import MarkerStyle
from matplotlib.text import Text

from auv_analysis.metrics.quantities import SIGNALS
from auv_analysis.report import plots, run_plots
from auv_analysis.report.digest import digests
from auv_analysis.report.faults import fault_figure
from auv_analysis.report.panels import document, interactive, panel_sets
from auv_analysis.report.run_plots import (
    APART,
    _looks,
    _named_dashes,
    _symmetric,
    draw_figures,
    energy,
    energy_shares,
    fitting,
    inputs,
    settling,
    six_signals,
)
from auv_analysis.report.wrench_plots import (
    _applied_caption,
    _panel,
    applied_figure,
    estimate_figure,
)
from auv_analysis.runs.run import Run
from auv_gvc_controller.laws.model import control_model

pytestmark = pytest.mark.usefixtures('approved')


@pytest.fixture(scope='module')
def runs() -> dict[str, Run]:
    one, two = made('one', 'cl', 1), made('two', 'gvc', 2)
    three = made('three', 'pid', 3, applied=None)
    three = replace(three, applied=0.7 * three.tau[:, ::-1] + 3.0)
    two.nu_d[20] = np.linspace(5.0, 9.0, 6)  # the largest, not in the gap of the other
    gap = ~((one.t > 8.02) & (one.t < 9.52))
    return {
        'one': replace(one.part(gap), nu_d=two.nu_d[gap], gaps=((8.0, 9.55),)),
        'two': two,
        'three': three,
    }


@pytest.fixture(scope='module')
def foreign() -> dict[str, Run]:
    """Runs of another system: one whose wrench was recorded, and one without."""
    rng = np.random.default_rng(7)
    wrench, error = rng.normal(size=(SAMPLES, 6)) * 50.0, 1.0 + rng.random((SAMPLES, 6))
    about = {'disturbance': None, 'acceleration': {'filter': 'f', 'window': 1.0}}
    told = made('told', 'gvc', 8, unexplained=wrench, unexplained_error=error, **about)
    nothing = {'tau': np.full((SAMPLES, 6), np.nan), 'faults': ()}
    lost = made(
        'lost', 'gvc', 9, **about | nothing, required_wrench=2 * wrench, required_wrench_error=error
    )
    return {'told': told, 'lost': lost}


LYAPUNOV = {'lyapunov': {'share_of_time_increasing': 0.5, 'applicable': True, 'reason': None}}
NONE = {'lyapunov': {}}
LIMIT = np.array([900.0, 800.0, 700.0, 60.0, 50.0, 1e9])
Figures = dict[str, Figure]


def _drawn(runs, folder, **about) -> tuple[Figures, dict[str, str]]:
    with artists.captured() as found:
        records = draw_figures(runs, folder, **about)
    return found, {record.name: record.caption for record in records}


@pytest.fixture(scope='module')
def three(runs, tmp_path_factory) -> tuple[Figures, dict[str, str]]:
    summaries = {'one': LYAPUNOV, 'two': LYAPUNOV, 'three': NONE}
    return _drawn(
        runs, tmp_path_factory.mktemp('three'), summaries=summaries, limits={'three': LIMIT}
    )


@pytest.fixture(scope='module')
def pair(runs, tmp_path_factory) -> tuple[Figures, list[str]]:
    """Figures, and all that they show."""
    two, shown = {name: runs[name] for name in ('one', 'two')}, Approved()
    with shown.watching():
        figures, _ = _drawn(two, tmp_path_factory.mktemp('pair'))
    return figures, [*shown.lines()]


def test_all_that_two_runs_show(pair, approved) -> None:
    approved.add(pair[1])


SIX: dict[str, tuple[Callable[[Run], np.ndarray], tuple[str, str], Sequence[str]]] = {
    'errors': (lambda r: r.nu_d - r.nu, VELOCITY, [rf'$\Delta {x}$' for x in 'uvwpqr']),
    'lumped_error': (
        lambda r: r.disturbance_estimate - r.disturbance,
        WRENCH,
        [f'$w_{{{x}}}$' for x in 'XYZKMN'],
    ),
    'uncertainty': (lambda r: r.disturbance, WRENCH, [f'$F_{{{x}}}$' for x in 'XYZKMN']),
    'inputs': (lambda r: r.tau, WRENCH, [rf'$\tau_{{{x}}}$' for x in 'XYZKMN']),
    'delta_xi': (
        lambda r: r.nu @ UPSILON_INV.T - r.nu,
        VELOCITY,
        [rf'$\Delta \xi_{{{i}}}$' for i in '123456'],
    ),
    'delta_pi': (
        lambda r: r.tau @ UPSILON - r.tau,
        WRENCH,
        [rf'$\Delta \pi_{{{i}}}$' for i in '123456'],
    ),
}
LEADING = {'delta_xi': [5], 'delta_pi': [0]}  # of gvc alone; what is zero by structure
EACH = [
    (kind, name)
    for kind in SIX
    for name in ('one', 'two', 'three')
    if (kind, name) != ('inputs', 'three') and (kind not in LEADING or name == 'two')
]


@pytest.mark.parametrize(('kind', 'name'), EACH)
def test_six_signals_are_those_of_the_run(three, runs, kind: str, name: str) -> None:
    signal, units, symbols = SIX[kind]
    run, values = runs[name], signal(runs[name])
    figure = three[0][kind if kind in LEADING else f'{kind}_{name}']
    caption = three[1][kind if kind in LEADING else f'{kind}_{name}']
    split = kind in ('errors', 'lumped_error', 'inputs', 'delta_pi')
    early = run.t <= START + 2.0 + 1e-9
    parts = (early, ~early) if split else (np.ones(len(run.t), bool),)
    peaks = []
    assert len(figure.axes) == 2 * len(parts)
    for row, half in enumerate(HALVES):
        moved = [i for i in half if i not in LEADING.get(kind, ())]
        key = legend(figure.axes[(row + 1) * len(parts) - 1])
        for column, part in enumerate(parts):
            axes = figure.axes[row * len(parts) + column]
            shown = named(axes, key)
            assert list(shown) == [f'{symbols[i]} {DOFS[i]}' for i in moved]
            assert len(artists.lines(axes)) == len(moved)
            for i, curves in zip(moved, shown.values(), strict=True):
                (curve,) = curves
                same(curve, run.t[part], values[part, i])
            assert axes.get_xlabel() == ('$t$ (s)' if row else '')
            assert axes.get_xlim() == pytest.approx((run.t[part][0], run.t[part][-1]))
            assert axes.get_title(loc='left') == f'({"abcd"[row * len(parts) + column]})'
            label = f'{", ".join(symbols[i] for i in moved)} ({units[row]})'
            assert axes.get_ylabel() == ('' if column else label)
            _shaded(axes, run)
        most = max(moved, key=lambda i: np.abs(values[:, i]).max())
        at = np.abs(values[:, most]).argmax()
        peaks.append((abs(values[at, most]), f'{units[row]} in {DOFS[most]} at {run.t[at]:.2f} s'))
    told = re.search(r'Largest: ([^ ]+) (.*?) and ([^ ]+) (.*?)\.( |$)', caption)
    for (peak, words), (found, rest) in zip(
        peaks, (told.group(1, 2), told.group(3, 4)), strict=True
    ):
        ((value, half),) = tokens(found)
        assert abs(value - peak) <= half
        assert rest == words
    if kind in LEADING:
        (still,) = LEADING[kind]
        assert (
            f'Zero for every motion by the structure of M and not drawn: {DOFS[still]}.' in caption
        )
    assert ('Left the first 2 s, right the rest' in caption) == split
    assert ('Grey spans: no samples.' in caption) == bool(run.gaps)
    assert '1 first, 5–7 s; 2 second, from 6 s on.' in caption


def _shaded(axes, run: Run) -> None:
    """Faults and gaps, as far as the panel shows their time."""
    low, high = axes.get_xlim()
    wanted = [(to_hex(plots.NOTHING), a, b) for a, b in run.gaps]
    wanted += [
        (to_hex(plots.FAULT), max(mark.start, low), min(mark.end, high))
        for mark in run.faults
        if max(mark.start, low) < min(mark.end, high)
    ]
    found = spans(axes)
    assert [span[0] for span in found] == [span[0] for span in wanted]
    assert np.array([s[1:] for s in found]) == pytest.approx(np.array([s[1:] for s in wanted]))


def test_a_line_breaks_a_step_behind_the_begin_of_a_gap(three) -> None:
    t, y = artists.points(artists.lines(three[0]['uncertainty_one'].axes[0])[0])
    assert t[np.isnan(y)] == pytest.approx([8.0 + STEP])


def test_names_that_are_too_long_for_a_legend_are_cut_in_their_middle() -> None:
    assert fitting(['gvc', 'cl', 'pid'], 2) == (['gvc', 'cl', 'pid'], 2)
    assert fitting(['x' * 12, 'cl'], 3, room=40) == (['x' * 12, 'cl'], 2)
    assert fitting(['x' * 13, 'cl'], 3, room=40) == (['x' * 13, 'cl'], 1)
    assert fitting(['a' * 50 + 'z' * 50, 'cl'], 3, room=18) == (['aaaaa…zzzzz', 'cl'], 1)


@pytest.mark.parametrize('together', ['pair', 'three'])
def test_errors_still_to_come_are_those_of_their_runs(pair, three, runs, together: str) -> None:
    figure = (pair if together == 'pair' else three)[0]['settling']
    names = ['one', 'two'] if together == 'pair' else list(runs)
    for i, axes in enumerate(figure.axes):
        shown = named(axes, figure.legends[0])
        assert list(shown) == names
        for name, ((t, y),) in shown.items():
            run = runs[name]
            error = np.abs(run.nu_d - run.nu)[1:, i]
            rest = [error[k:].max() for k in range(len(error))]
            same((t, y), run.t[1:] - START, np.array(rest))
        band = max(0.02 * np.abs(runs['two'].nu_d[:, i]).max(), 0.005)
        assert levels(axes) == ([pytest.approx(band)] if together == 'pair' else [])
        colours = {line.get_color() for line in artists.lines(axes)}
        assert (colours == {plots.COLOURS[i]}) == (together == 'pair')
        assert len(colours) == {'pair': 1, 'three': 3}[together]
        assert axes.get_title(loc='left') == f'({"abcdef"[i]}) {DOFS[i]}'
        assert axes.get_xlabel() == ('$t$ (s)' if i > 2 else '')
        assert (axes.get_xscale(), axes.get_yscale()) == ('log', 'log')
        unit = {0: '(m/s)', 3: '(rad/s)'}.get(i, '')
        assert axes.get_ylabel().endswith(unit)
        assert bool(axes.get_ylabel()) == bool(unit)


@pytest.mark.parametrize('together', ['pair', 'three'])
def test_compared_inputs_are_those_of_their_runs(pair, three, runs, together: str) -> None:
    figure = (pair if together == 'pair' else three)[0]['compared_inputs']
    names = ['one', 'two'] if together == 'pair' else list(runs)
    for i, axes in enumerate(figure.axes):
        shown = named(axes, figure.legends[0])
        assert list(shown) == names
        for name, (curve,) in shown.items():
            run = runs[name]
            same(curve, np.maximum(run.t - START, STEP), run.tau[:, i])
        assert axes.get_title(loc='left') == f'({"abcdef"[i]}) {DOFS[i]}'
        assert axes.get_ylabel() == rf'$\tau_{{{"XYZKMN"[i]}}}$ ({WRENCH[i // 3]})'
        assert (axes.get_xscale(), axes.get_yscale()) == ('log', 'linear')


def test_no_name_of_a_controller_makes_its_figure_another_one(
    runs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_plots, 'save_figures', lambda _, made: made)
    one, two = runs['one'], runs['two']
    drawn = [len(draw_figures({name: one, 'two': two}, tmp_path)) for name in ('one', 'compared')]
    assert drawn[0] == drawn[1]


def test_captions_name_the_dashes_of_each_run(three, pair, runs) -> None:
    assert 'one solid, two dashed and three dotted' in three[1]['compared_inputs']
    assert 'not drawn where the set-points of the runs differ' in three[1]['settling']
    dashes = [artists._look(h)['dashes'][1] for h in three[0]['settling'].legends[0].legend_handles]
    assert [None if d is None else len(d) for d in dashes] == [None, 2, 2]
    assert dashes[1][0] > dashes[2][0], 'a dash is longer than a dot'
    assert _named_dashes(dict.fromkeys('abcdefg')).endswith('f dash-dot-dotted and g solid')
    looks = _looks(dict.fromkeys(range(24), runs['one']))
    assert len({(look['color'], str(look['linestyle'])) for look in looks}) == 24


@pytest.mark.parametrize('together', ['pair', 'three'])
def test_kinetic_energies_are_those_of_their_runs(pair, three, runs, together: str) -> None:
    figure = (pair if together == 'pair' else three)[0]['kinetic_energy']
    names = ['one', 'two'] if together == 'pair' else list(runs)
    left, right = figure.axes
    wanted = 'set-point' if together == 'pair' else 'set-point of two'
    shown = named(left)
    assert list(shown) == [wanted, *names]
    two = runs['two']
    for name, (curve,) in shown.items():
        run = runs.get(name, two)
        nu = run.nu if name in runs else run.nu_d
        same(curve, run.t, 0.5 * np.einsum('ni,ij,nj->n', nu, M, nu))
    assert left.get_ylabel() == 'kinetic energy (J)'
    assert right.get_ylabel() == 'share (%)'
    assert left.get_ylim()[0] == 0.0
    assert right.get_ylim() == (0.0, 100.0)
    for axes in (left, right):
        assert axes.get_xlabel() == '$t$ (s)'
        assert axes.get_xlim() == (START, START + 12.0)
        _shaded(axes, two)
    parts = 100.0 * energies(two.nu) / energies(two.nu).sum(axis=1, keepdims=True)
    colours = {
        text.get_text(): to_hex(handle.get_color())
        for text, handle in zip(
            legend(right).get_texts(), legend(right).legend_handles, strict=True
        )
    }
    stacked = bands(right)
    assert list(colours) == [rf'$\xi_{i + 1}$' for i in range(6) if parts[:, i].max() > 1.0]
    assert len(stacked) == 6
    for i, (colour, t, low, high) in enumerate(stacked):
        assert colours.get(rf'$\xi_{i + 1}$', colour) == colour
        near(t, two.t)
        near(low, parts[:, :i].sum(axis=1), 0.0, 1e-9)
        near(high, parts[:, : i + 1].sum(axis=1))


def test_shares_of_the_mean_energy_are_those_of_their_runs(three, runs) -> None:
    (axes,) = three[0]['energy_shares'].axes
    marks = dict(zip(runs, axes.get_legend().legend_handles, strict=True))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == list(runs)
    shapes = {}
    for name, handle in marks.items():
        style = MarkerStyle(handle.get_marker())
        shapes[name] = style.get_path().transformed(style.get_transform()).vertices
    found: dict[tuple, float] = {}
    for dots in axes.collections:
        (path,), edges = dots.get_paths(), [to_hex(one) for one in dots.get_edgecolor()]
        (name,) = [n for n, s in shapes.items() if np.array_equal(s, path.vertices)]
        inside = [to_hex(one) for one in dots.get_facecolor()]
        assert edges == [colour.lower() for colour in plots.COLOURS]
        whole = inside == ['#ffffff']
        assert whole or inside == edges
        found |= {(name, whole, round(y)): x for x, y in dots.get_offsets()}
    assert len(found) == 36
    for (name, whole, i), x in found.items():
        run = runs[name]
        keep = np.ones(len(run.t), bool) if whole else run.t <= START + 10.0 + 1e-9
        mean = energies(run.nu)[keep].mean(axis=0)
        assert x == pytest.approx(100.0 * mean[i] / mean.sum())
    assert artists.ticks(axes, 'y') == {i: rf'$\xi_{i + 1}$ {DOFS[i]}' for i in range(6)}
    assert axes.get_xlabel() == 'share of the mean kinetic energy (%)'
    assert axes.get_xscale() == 'log'
    low, high = axes.get_xlim()
    assert low < min(found.values()) < max(found.values()) < high
    assert axes.get_ylim() == (5.5, -0.5)
    assert '0 to 10 s (filled) and of the whole run (open)' in three[1]['energy_shares']


def test_energies_of_runs_of_unlike_length(runs) -> None:
    run = replace(runs['one'], faults=())
    parts = {name: run.part(slice(count)) for name, count in (('a', 61), ('b', 121), ('c', 181))}
    parts['a'] = replace(parts['a'], nu=np.where(np.arange(6) == 2, np.nan, parts['a'].nu))
    drawn = digests(parts)
    assert '0 to 3 s (filled)' in energy_shares(drawn)[2], 'of b and c, which know theirs'
    ends = [axes.get_xlim() for axes in energy(drawn, drawn['b'])[0].axes]
    assert ends == [(START, parts[name].t[-1]) for name in 'cb'], 'all runs, the leading one'


@pytest.mark.parametrize('name', ['one', 'two'])
def test_certificates_are_those_of_their_runs(three, runs, name: str) -> None:
    run = runs[name]
    wanted = certificate_of(run, control_model(run.vehicle))
    energy, *rates = three[0][f'certificate_{name}'].axes
    positive = wanted.L > 0
    same(artists.points(*artists.lines(energy)), wanted.t[positive], wanted.L[positive])
    assert energy.get_ylabel() == '$L$ (J)'
    assert energy.get_yscale() == 'log'
    assert energy.get_xlim() == (START, START + 12.0)
    low, high = energy.get_ylim()
    shown = wanted.L[positive]
    assert low <= shown.min() < shown.max() <= high
    assert np.log10([low, high]) == pytest.approx(np.round(np.log10([low, high])))
    assert low * 10 > shown.min()
    assert high < shown.max() * 10
    early = wanted.t <= START + 2.0 + 1e-9
    key = legend(rates[-1])
    for axes, part in zip(rates, (early, ~early), strict=True):
        curves = named(axes, key)
        assert list(curves) == ['measured', 'identity (26)', 'bound (28)']
        for (curve,), signal in zip(curves.values(), ('L_dot', 'identity', 'bound'), strict=True):
            same(curve, wanted.t[part], getattr(wanted, signal)[part])
        assert axes.get_xlim() == pytest.approx((wanted.t[part][0], wanted.t[part][-1]))
        assert axes.get_xlabel() == '$t$ (s)'
        _increasing(axes, wanted.t[part], wanted.identity[part] > 0)
    assert rates[0].get_ylabel() == r'$\dot{L}$ (W)'
    assert [axes.get_title(loc='left') for axes in (energy, *rates)] == ['(a)', '(b)', '(c)']
    assert 'the first 2 s; (c) the rest' in three[1][f'certificate_{name}']
    assert 'The wrench is held between samples' in three[1][f'certificate_{name}']
    assert (
        'against the identity (26) and the bound (28), the first 2 s; (c)'
        in (three[1][f'certificate_{name}'])
    )


def _increasing(axes, t: np.ndarray, grey: np.ndarray) -> None:
    """Samples at which a panel is grey, to half a step."""
    (band,) = axes.collections
    inside = np.zeros(len(t), bool)
    for path in band.get_paths():
        x = path.vertices[path.vertices[:, 1] > 0.5, 0]
        for a, b in pairwise(np.sort(x)):
            middle = (a + b) / 2
            inside |= (t >= a - 1e-9) & (t <= b + 1e-9) & _at(t, grey, middle)
    assert np.array_equal(inside, grey)


def _at(t: np.ndarray, values: np.ndarray, place: float) -> bool:
    return bool(values[np.abs(t - place).argmin()])


def test_applied_and_commanded_wrench_are_told_apart(three, runs) -> None:
    run, figure = runs['three'], three[0]['inputs_three']
    key = figure.legends[0]
    assert [text.get_text() for text in key.get_texts()] == ['commanded', 'applied', 'axis limit']
    commanded = to_hex(key.legend_handles[0].get_color())
    cut = []
    for place, axes in enumerate(figure.axes):
        i = place // 2 + 3 * (place % 2)  # forces left, moments right
        assert axes.get_title(loc='left') == f'({"abcdef"[i]}) {DOFS[i]}'
        assert axes.get_ylabel() == rf'$\tau_{{{"XYZKMN"[i]}}}$ ({WRENCH[i // 3]})'
        for line in artists.lines(axes):
            grey = to_hex(line.get_color()) == commanded
            same(artists.points(line), run.t, (run.tau if grey else run.applied)[:, i])
        assert len(artists.lines(axes)) == 2
        peaks = [np.abs(signal[:, i]).max() for signal in (run.applied, run.tau)]
        near = LIMIT[i] <= 3.0 * max(peaks)
        assert levels(axes) == ([-LIMIT[i], LIMIT[i]] if near else [])
        assert axes.get_xlabel() == ('$t$ (s)' if i % 3 == 2 else '')
        assert axes.get_xlim() == (START, START + 12.0)
        _shaded(axes, run)
        told = axes.get_title(loc='right')
        assert bool(told) == (peaks[1] > 3.0 * max(peaks[0], LIMIT[i] * near))
        cut += [DOFS[i]] if told else []
    force, moment = (np.abs(run.applied)[:, half].max() for half in HALVES)
    caption = three[1]['inputs_three']
    found = re.search(r'Largest applied: (.*) N and (.*) N m\.', caption)
    for text, value in zip(found.groups(), (force, moment), strict=True):
        ((shown, half),) = tokens(text)
        assert abs(shown - value) <= half
    assert ('leave the panel' in caption) == bool(cut)
    assert 'never differ' not in caption


@pytest.mark.parametrize('factor', [0.99 * APART, APART])
def test_inputs_that_are_far_apart_share_no_linear_scale(runs, factor) -> None:
    one = runs['three']
    many = {'one': one, 'two': replace(one, controller='two', tau=factor * one.tau)}
    figure, _, caption = inputs(digests(many))
    assert ('times another’s' in caption) == (factor == APART)
    assert {axes.get_yscale() == 'linear' for axes in figure.axes} == {factor < APART}


def test_a_caption_says_what_the_actuators_did(runs) -> None:
    run = digests(runs)['three']
    alike = _applied_caption('T', run, None, [], [])
    cut = _applied_caption('T', run, LIMIT, ['yaw'], ['yaw'])
    for text, there, not_there in (
        ('The two never differ in this run.', alike, cut),
        ('Dotted: axis limits', cut, alike),
        ('The commands in yaw leave the panel', cut, alike),
    ):
        assert text in there
        assert text not in not_there


def test_a_command_that_leaves_its_panel_is_told_with_its_sign_and_time(runs) -> None:
    run = runs['three']
    tau, applied = 0.0 * run.tau, 0.01 * run.tau
    tau[:, [0, 4]], tau[77, 4], applied[:, 0] = run.tau[:, [0, 4]], -50_000.0, 0.0
    three = digests({'': replace(run, tau=tau, applied=applied)})['']
    figure, _, caption = applied_figure(three, None)
    pitch = figure.axes[3]
    assert pitch.get_title(loc='right') == f'command to −50\u202f000 N m at {run.t[77]:.2f} s'
    most = np.abs(applied[:, 4]).max()
    assert pitch.get_ylim() == pytest.approx((-1.25 * most, 1.25 * most))
    assert 'The commands in pitch leave the panel' in caption
    axes = plots.new_figure(2.0).subplots()
    assert _panel(axes, three, 4, 1e3)
    assert levels(axes) == [-1e3, 1e3], 'far above what is applied, not what is commanded'
    assert axes.get_ylim() == (-1250.0, 1250.0)
    others = [a.get_title(loc='right') for k, a in enumerate(figure.axes) if k != 3]
    assert others == [''] * 5
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ['commanded', 'applied']


@pytest.mark.parametrize(('name', 'kind'), [('told', 'unexplained'), ('lost', 'required_wrench')])
def test_estimates_of_foreign_runs_with_their_standard_errors(
    foreign, name: str, kind: str
) -> None:
    run, drawn = foreign[name], digests(foreign)[name]
    values, error = getattr(run, kind), getattr(run, f'{kind}_error')
    figure, _, caption = estimate_figure(drawn, kind)
    symbol = 'F' if kind == 'unexplained' else r'\tau'
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    estimated = f'{"F" if kind == "unexplained" else "τ"}, estimated'
    assert words == [estimated, 'two standard errors', 'commanded τ'][: 2 + (name == 'told')]
    for place, axes in enumerate(figure.axes):
        i = place // 2 + 3 * (place % 2)
        assert axes.get_title(loc='left') == f'({"abcdef"[i]}) {DOFS[i]}'
        assert axes.get_ylabel() == rf'${symbol}_{{{"XYZKMN"[i]}}}$ ({WRENCH[i // 3]})'
        shown = [artists.points(line) for line in artists.lines(axes)]
        if name == 'told':
            same(shown.pop(0), run.t, run.tau[:, i])
            ends = (
                f'τ {_text(run.tau[:, i].min())} to {_text(run.tau[:, i].max())} {WRENCH[i // 3]}'
            )
            seen = (np.abs(values) + 2 * error)[:, i].max()
            cut = np.abs(run.tau[:, i]).max() > 3.0 * seen
            assert axes.get_title(loc='right') == (ends if cut else '')
            if cut:
                assert axes.get_ylim() == pytest.approx((-1.25 * seen, 1.25 * seen))
        (curve,) = shown
        same(curve, run.t, values[:, i])
        ((_, t, low, high),) = bands(axes)
        near(t, run.t)
        near(low, (values - 2 * error)[:, i])
        near(high, (values + 2 * error)[:, i])
        assert axes.get_xlabel() == ('$t$ (s)' if i % 3 == 2 else '')
        assert axes.get_xlim() == (START, START + 12.0)
    assert (six_signals('tau', drawn)[0] is not None) == (name == 'told')
    assert caption.startswith(f'{kind.replace("_", " ").capitalize()}')


def _text(value: float) -> str:
    """Three significant digits, whole ones kept."""
    decimals = max(2 - int(np.floor(np.log10(abs(value)))), 0)
    return f'{value:,.{decimals}f}'.replace(',', '\u202f').replace('-', '−')


def _faults(runs, folder):
    drawn = {'faults': lambda: fault_figure(digests(runs))}
    return plots.save_figures(folder, drawn)['faults']


def test_errors_under_faults_are_those_of_their_runs(runs, tmp_path) -> None:
    with artists.captured() as found:
        record = _faults(runs, tmp_path)
    figure = found['faults']
    for i, axes in enumerate(figure.axes):
        shown = named(axes, figure.legends[0])
        assert list(shown) == list(runs)
        for name, curves in shown.items():
            run = runs[name]
            t, y = (np.concatenate(part) for part in zip(*curves, strict=True))
            same((t, y), run.t, (run.nu_d - run.nu)[:, i])
        late = np.concatenate([(r.nu_d - r.nu)[r.t > START + 2.0 + 1e-9, i] for r in runs.values()])
        assert axes.get_ylim() == pytest.approx((1.1 * late.min(), 1.3 * late.max()))
        assert axes.get_ylabel() == rf'$\Delta {"uvwpqr"[i]}$ ({VELOCITY[i // 3]})'
        assert axes.get_title(loc='left') == f'({"abcdef"[i]}) {DOFS[i]}'
        assert axes.get_xlim() == (START, START + 12.0)
        assert levels(axes) == []
        _shaded(axes, runs['one'])
    assert figure.axes[-1].get_xlabel() == '$t$ (s)'
    words = [text.get_text() for text in figure.legends[1].get_texts()]
    assert words == ['1  first, 5–7 s', '2  second, from 6 s on']
    assert record.caption.startswith('Velocity errors under faults, of one, two and three.')


def test_errors_under_faults_are_seen_to_the_end_of_the_longest_run(runs, tmp_path) -> None:
    one, two = runs['one'], runs['two']
    with artists.captured() as found:
        _faults({'one': one, 'two': two.part(two.t < START + 6.0)}, tmp_path)
    assert {axes.get_xlim() for axes in found['faults'].axes} == {(START, START + 12.0)}


def test_settling_bands_stand_under_faults_where_the_runs_share_them(runs, tmp_path) -> None:
    two = {name: runs[name] for name in ('one', 'two')}
    with artists.captured() as found:
        _faults(two, tmp_path)
    for i, axes in enumerate(found['faults'].axes):
        band = max(0.02 * np.abs(runs['two'].nu_d[:, i]).max(), 0.005)
        assert levels(axes) == pytest.approx([-band, band])


def test_what_was_not_recorded_is_said_in_its_panel(runs, foreign) -> None:
    lost = {name: replace(run, nu=run.nu.copy(), tau=run.tau.copy()) for name, run in runs.items()}
    told = foreign['told']
    wrench = told.unexplained.copy()
    wrench[:, 1] = np.nan
    for run in lost.values():
        run.nu[:, 1] = run.tau[:, 1] = np.nan
    alone = digests({'': replace(told, unexplained=wrench, faults=())})['']
    acted = lost.pop('three')
    applied = np.where(np.isin(np.arange(6), (1, 2)), np.nan, acted.applied)
    panels = applied_figure(digests({'': replace(acted, applied=applied)})[''], None)[0].axes
    empty = [axes.get_title(loc='left') for axes in panels if not len(axes.get_yticks())]
    assert empty == ['(b) sway'], 'of heave there is the command'
    lost['one'].tau[:, 3] = 0.0
    lost['two'].nu[:, 2] = lost['two'].tau[:, 2] = np.nan  # heave is seen in the other run
    drawn = digests(lost)
    compared = inputs(drawn)[0]
    scales = [axes.get_yscale() for axes in compared.axes]
    assert scales[3] == 'linear', 'what does nothing is not far from what does'
    for figure in (settling(drawn)[0], compared, estimate_figure(alone, 'unexplained')[0]):
        for axes in figure.axes:
            gone = axes.get_title(loc='left').endswith('sway')
            assert [text.get_text() for text in axes.texts] == ['not recorded'] * gone
            assert bool(artists.lines(axes)) != gone
    assert energy(drawn, drawn['two'])[2].startswith('Kinetic energy: not all velocities were rec')
    assert energy_shares(drawn)[2].startswith('Shares of kinetic energy: not all velocities')
    lacking = 'Not recorded, or resting on what was not: sway.'
    assert lacking in six_signals('error', drawn['one'])[2]


def test_no_figure_is_without_an_oracle(three, pair, foreign) -> None:
    checked = {kind if kind in LEADING else f'{kind}_{name}' for kind, name in EACH}
    checked |= {'settling', 'compared_inputs', 'kinetic_energy', 'energy_shares'}
    checked |= {'certificate_one', 'certificate_two', 'inputs_three'}
    assert set(three[0]) == checked


PANELS = {  # name -> title, label, signal of a run
    'error': ('Velocity error', 'velocity error', VELOCITY, SIX['errors'][0]),
    'lumped_error': (
        'Lumped estimation error', 'lumped estimation error', WRENCH, SIX['lumped_error'][0]
    ),
    'F': ('Lumped uncertainty', 'lumped uncertainty', WRENCH, SIX['uncertainty'][0]),
    'tau': ('Input', 'input', WRENCH, SIX['inputs'][0]),
    'applied': ('Applied wrench', 'applied wrench', WRENCH, lambda run: run.applied),
    'energy': ('Energy of ξ', 'energy of ξ', ('J', 'J'), lambda run: energies(run.nu)),
    'delta_xi': ('Velocity deformation', 'velocity deformation', VELOCITY, SIX['delta_xi'][0]),
    'delta_pi': ('Input deformation', 'input deformation', WRENCH, SIX['delta_pi'][0]),
}  # fmt: skip


FAULTS = *MARKS, MARKS[1]._replace(number=3), MARKS[1]._replace(number=4, start=7.0)


@pytest.fixture(scope='module')
def page(runs):
    """Bokeh's figures of the page of all runs by name, and the panels that they are of."""
    from bokeh.document import Document
    from bokeh.models import BoxZoomTool, CrosshairTool, HoverTool

    made: list[Document] = []

    class Kept(Document):
        def to_json(self, **_):
            made.append(self)
            return {}

    sets = panel_sets(digests(runs))
    panels = {panel.name: panel for part in sets.values() for panel in part.panels}
    dashes = {'one': [], 'two': [7, 3], 'three': [2, 2]}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr('bokeh.document.Document', Kept)
        _, roots = document([*panels.values()], dashes, FAULTS, (START, START + 12.0))
    plots_of = {plot.name: plot for plot in made[0].roots}
    assert list(plots_of) == list(panels)
    assert roots == {name: plot.id for name, plot in plots_of.items()}
    for name, plot in plots_of.items():
        assert [legend.click_policy for legend in plot.legend] == ['hide'], name
        assert plot.x_range.bounds == (START, START + 12.0), name
        assert plot.toolbar.active_drag == plot.select_one(BoxZoomTool), name
        assert plot.toolbar.active_scroll is None, 'a page scrolls'
        assert plot.select_one(CrosshairTool).overlay.dimension == 'height'
        if panels[name].kind != 'stack':
            assert (plot.y_range.only_visible, plot.window_axis) == (True, 'x'), name
            hover = plot.select_one(HoverTool)
            assert (hover.mode, hover.line_policy) == ('vline', 'nearest')
            assert hover.formatters == {'$snap_y': 'printf'}
    return plots_of, panels


def _glyphs(plot):
    """Words of the legend -> its glyph, its times and its values."""
    for item in plot.legend[0].items:
        (renderer,) = item.renderers
        data, glyph = renderer.data_source.data, renderer.glyph
        assert renderer.name == item.label.value
        yield item.label.value, glyph, data[_read(glyph.x)], data


def _read(value):
    """Name of a column, or a value, of a property of a glyph."""
    return getattr(value, 'field', getattr(value, 'value', value))


@pytest.mark.parametrize('half', ['linear', 'angular'])
@pytest.mark.parametrize('signal', PANELS)
def test_interactive_panels_show_the_signals_of_their_runs(page, runs, signal, half) -> None:
    title, label, units, values = PANELS[signal]
    plot, panel = page[0][f'{signal}-{half}'], page[1][f'{signal}-{half}']
    angular = half == 'angular'
    assert plot.yaxis[0].axis_label == f'{label} ({units[angular]})'
    assert panel.title == f'{title}, {half}'
    assert (plot.x_range.start, plot.x_range.end) == (START, START + 12.0)
    wanted = [
        (name, i)
        for name in runs
        for i in HALVES[angular]
        if i not in LEADING.get(signal, ()) and (signal != 'applied' or name == 'three')
    ]
    shown = {words: rest for words, *rest in _glyphs(plot)}
    assert list(shown) == [f'{name} {DOFS[i]}' for name, i in wanted]
    for (name, i), (glyph, t, data) in zip(wanted, shown.values(), strict=True):
        run, y = runs[name], data[_read(glyph.y)]
        there = ~np.isnan(y)
        near(t[there], run.t)
        near(y[there], values(run)[:, i], 1e-5, 1e-4)
        assert np.count_nonzero(~there) == len(run.gaps)
        assert _read(glyph.line_color) == plots.COLOURS[i]
        assert _read(glyph.line_dash) == {'one': [], 'two': [7, 3], 'three': [2, 2]}[name]


def test_interactive_energies_shares_and_certificates(page, runs) -> None:
    kinetic = {words: rest for words, *rest in _glyphs(page[0]['kinetic'])}
    assert list(kinetic) == [f'{n} of the {what}' for n in runs for what in ('set-point', 'run')]
    for words, (glyph, _, data) in kinetic.items():
        name, what = words.split(' of the ')
        nu = runs[name].nu if what == 'run' else runs[name].nu_d
        y = data[_read(glyph.y)]
        assert y[~np.isnan(y)] == pytest.approx(energies(nu).sum(axis=1), rel=1e-5)
    assert page[0]['kinetic'].yaxis[0].axis_label == 'kinetic energy (J)'
    for name in ('two', 'three'):
        plot, parts = page[0][f'shares-{name}'], energies(runs[name].nu)
        assert plot.yaxis[0].axis_label == 'share (%)'
        parts = 100.0 * parts / parts.sum(axis=1, keepdims=True)
        assert len(plot.legend[0].items) == 6
        for i, (words, glyph, t, data) in enumerate(_glyphs(plot)):
            assert words == f'{name} {DOFS[i]}'
            assert t == pytest.approx(runs[name].t, rel=1e-6)
            assert data[_read(glyph.y1)] == pytest.approx(parts[:, :i].sum(axis=1), abs=1e-3)
            assert data[_read(glyph.y2)] == pytest.approx(parts[:, : i + 1].sum(axis=1), abs=1e-3)
            assert _read(glyph.fill_color) == plots.COLOURS[i]
    model = control_model(VEHICLE)
    assert [words for words, *_ in _glyphs(page[0]['L'])] == ['one L', 'two L']
    keys = {'bound (28)': 'bound', 'identity (26)': 'identity', 'measured': 'L_dot'}
    for name, (_, glyph, _, data) in zip(('one', 'two'), _glyphs(page[0]['L']), strict=True):
        found, y = certificate_of(runs[name], model), data[_read(glyph.y)]
        assert y[~np.isnan(y)] == pytest.approx(found.L[found.L > 0], rel=1e-5)
        rates = page[0][f'rates-{name}']
        assert rates.yaxis[0].axis_label == 'dL/dt (W)'
        curves = {words: found[_read(line.y)] for words, line, _, found in _glyphs(rates)}
        assert list(curves) == [f'{name} {key}' for key in keys]
        for curve, signal in zip(curves.values(), keys.values(), strict=True):
            assert curve[~np.isnan(curve)] == pytest.approx(getattr(found, signal), rel=1e-5)
    assert page[0]['L'].yaxis[0].axis_label == 'L (J)'
    names = {f'{signal}-{half}' for signal in PANELS for half in ('linear', 'angular')}
    others = {'kinetic', 'L', *(f'{k}-{n}' for k in ('shares', 'rates') for n in runs)}
    assert set(page[0]) == names | others - {'rates-three'}, 'a panel without an oracle'
    assert {panel.kind for name, panel in page[1].items() if name.startswith('shares')} == {'stack'}
    assert page[1]['L'].kind == 'log'


def test_faults_are_shaded_in_interactive_panels_where_they_are(page) -> None:
    from bokeh.models.annotations import BoxAnnotation, Label

    for plot in page[0].values():
        boxes = [one for one in plot.center if isinstance(one, BoxAnnotation)]
        labels = [one for one in plot.center if isinstance(one, Label)]
        assert [box.left for box in boxes] == [5.0, 6.0, 6.0, 7.0]
        assert boxes[0].right == 7.0
        assert not isinstance(boxes[1].right, float)
        labelled = [(label.text, label.x) for label in labels]
        assert labelled == [('1', 5.0), ('2', 6.0), ('3', 6.0), ('4', 7.0)]
        assert {label.y_units for label in labels} == {'screen'}
        first, second, third, fourth = (label.y for label in labels)
        assert first > second > third == fourth, 'those at one time stand below each other'


def test_a_page_spans_all_of_its_runs_and_names_their_dashes(runs) -> None:
    one, two = (runs[name].part(slice(0, 61)) for name in ('one', 'two'))
    later = replace(two, t=two.t + 5.0, faults=())
    with artists.captured():
        found = interactive(digests({'one': one, 'later': later}))
    assert (found.start, found.end) == (START, START + 8.0)
    assert found.runs == {'one': '', 'later': '7 3'}
    assert found.dofs == dict(zip(DOFS, plots.COLOURS, strict=True))
    assert found.faults == ''


def test_what_cannot_be_drawn_is_said_in_place_of_a_figure(tmp_path) -> None:
    unknown, zero = np.full((SAMPLES, 6), np.nan), np.zeros((SAMPLES, 6))
    about = {'disturbance': None, 'acceleration': {'filter': 'f', 'window': 1.0}, 'faults': ()}
    estimate = {'unexplained': unknown, 'unexplained_error': unknown}
    runs = {
        'aimless': made('aimless', 'gvc', 4, nu_d=unknown, **about),
        'lost': made('lost', 'gvc', 5, nu=unknown, **about, **estimate),
        'still': made(
            'still', 'pid', 6, nu=zero, nu_d=zero, tau=zero, disturbance_estimate=zero, applied=zero
        ),
    }
    for name, run in runs.items():
        _, captions = _drawn({name: run}, tmp_path / name)
        told = [text for text in captions.values() if 'Not recorded' not in text]
        assert any(text.endswith(END[name]) for text in told)
    sets = panel_sets(digests(runs))
    shown = {panel.name: panel for part in sets.values() for panel in part.panels}
    seen: dict[str, set[str]] = {}
    for name, panel in shown.items():
        of = {curve.run for curve in panel.curves}
        assert seen.setdefault(name.partition('-')[0], of) == of, 'in both halves'
    assert seen == {
        'F': {'still'}, 'tau': {*runs}, 'kinetic': {*runs}, 'shares': {'aimless'},
        'energy': {'aimless', 'still'}, 'delta_xi': {'aimless', 'still'}, 'delta_pi': {*runs},
    }  # fmt: skip
    assert [(curve.run, curve.key) for curve in shown['kinetic'].curves] == [
        ('aimless', 'of the run'), ('lost', 'of the set-point'),
        ('still', 'of the set-point'), ('still', 'of the run'),
    ]  # fmt: skip


END = {
    'aimless': ': without a set-point there is none.',
    'lost': ': every row of (1) needs what was not recorded.',
    'still': ': zero throughout.',
}


@pytest.mark.parametrize(
    ('peaks', 'apart'),
    [([0.001, 0.5], True), ([1.0, 20.0], True), ([1.0, 19.0], False), ([0.0, 5.0], False),
     ([0.0, 0.0], False)],
)  # fmt: skip
def test_peaks_far_apart_share_a_logarithmic_axis(peaks: list[float], apart: bool) -> None:
    axes = plots.new_figure(2.0).subplots()
    axes.plot([0.0, 1.0], [0.0, max(peaks)])
    assert _symmetric(axes, peaks) is apart
    assert axes.get_yscale() == ('symlog' if apart else 'linear')


def test_the_lines_of_a_panel_are_named_above_it_at_its_right() -> None:
    figure = Figure()
    axes = figure.subplots()
    plots.key(axes, SIGNALS['nu'], [0, 1])
    figure.draw_without_rendering()
    words, panel = axes.get_legend().get_window_extent(), axes.get_window_extent()
    assert words.y0 > panel.y1
    assert panel.x1 - 20 < words.x1 < panel.x1 + 1


def test_the_letter_of_a_panel_stands_beside_a_power_of_ten_and_above_numbers() -> None:
    with plots.style():
        figure = plots.new_figure(2.0)
        left, right = figure.subplots(1, 2)
        left.plot([0.0, 3e7])
        plots.draw_grid(right, plots.HeatMap(np.ones((1, 1)), ['column'], ''))
        for i, axes in enumerate((left, right)):
            plots.letter(axes, i)
        figure.draw_without_rendering()
    shown = {text.get_text(): text.get_window_extent() for text in figure.findobj(Text)}
    assert shown['1e7'].x1 < shown['(a)'].x0
    assert shown['column'].y1 < shown['(b)'].y0
