"""Plots of an identification: every line, interval and spectrum against its numbers."""

from types import SimpleNamespace as Made

import numpy as np
import pytest
from helpers import artists
from helpers.artists import levels, named, points, same
from helpers.made_runs import DOFS
from scipy.signal import welch

from auv_analysis.studies.identify import plots as identify

pytestmark = pytest.mark.usefixtures('approved')

VELOCITY = ('m/s', 'rad/s')
RNG = np.random.default_rng


def _identified():
    rng = RNG(4)
    pairs = []
    for k in range(9):
        at = np.arange(40.0)
        nu = rng.normal(size=(40, 6)) + 10 * k
        nu[5:8, 2] = np.nan
        pairs.append((Made(begin=2.0 * k, at=at, nu=nu), rng.normal(size=(40, 6))))
    noise = np.linspace(0.1, 0.6, 6)
    problem = Made(misfit=lambda fit: pairs, step=0.05, noise=noise)
    profile = [
        Made(name=name, unit=unit, value=2.0 + k, deviation=0.5 + k,
             values=np.linspace(1.0, 4.0, 5) + k, rise=rng.uniform(0, 5, 5))
        for k, (name, unit) in enumerate((('M.surge', 'kg'), ('lag', '')))
    ]  # fmt: skip
    predictions = [
        {'predictor': name, 'horizon': h, 'error': (k + 1) * h + 0.1}
        for k, name in enumerate(('new', 'prior', 'persistence', 'black box'))
        for h in (0.1, 1.0, 10.0)
    ]
    found = Made(
        problem=problem, fit=Made(quantile=1.96), predictions=predictions, profiles=profile
    )
    rows = [
        {'unit': unit, 'pair': f'{unit} {k}', 'M': 3.0 * k + j, 'M_low': 3.0 * k - 1 - j,
         'M_high': 3.0 * k + 4 + j - 9 * (k == 2), 'M_prior': 7.0 - k,
         'verdict': 'not known' if k == 1 else 'real'}
        for j, unit in enumerate(('kg', 'kg m', 'kg m²')) for k in range(3)
    ]  # fmt: skip
    return found, pairs, rows


def test_an_identification(tmp_path) -> None:
    found, pairs, rows = _identified()
    with artists.captured() as figures:
        identify.draw(found, {'inertia': rows}, tmp_path)
    assert set(figures) == {'prediction', 'trace', 'inertia', 'residuals', 'profiles'}
    (axes,) = figures['prediction'].axes
    shown = named(axes)
    assert list(shown) == ['new', 'prior', 'persistence', 'black box']
    for k, ((x, y),) in enumerate(shown.values()):
        assert x.tolist() == [0.1, 1.0, 10.0]
        assert y == pytest.approx([(k + 1) * h + 0.1 for h in (0.1, 1.0, 10.0)])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ('horizon (s)', 'velocity error (m/s)')
    assert (axes.get_xscale(), axes.get_yscale()) == ('log', 'log')
    _traced(figures['trace'], pairs, found.problem.noise)
    for axes, unit in zip(figures['inertia'].axes, ('kg', 'kg m', 'kg m²'), strict=True):
        some = [row for row in rows if row['unit'] == unit]
        assert axes.get_xlabel() == unit
        assert artists.ticks(axes, 'y') == dict(enumerate(row['pair'] for row in some))
        lines = {line.get_marker(): points(line) for line in artists.lines(axes)}
        assert lines['D'][0].tolist() == [row['M'] for row in some]
        assert lines['o'][0].tolist() == [row['M_prior'] for row in some]
        (bars,) = axes.collections
        for k, (row, segment) in enumerate(zip(some, bars.get_segments(), strict=True)):
            ends = (row['M'], row['M']) if k == 1 else (row['M_low'], max(row['M'], row['M_high']))
            assert segment[:, 0] == pytest.approx(ends)
            assert segment[:, 1].tolist() == [k, k]
        assert levels(axes, 'x') == [0.0]
    words = [t.get_text() for t in figures['inertia'].legends[0].get_texts()]
    assert set(words) == {'prior', 'identified'}
    for axes, one in zip(figures['profiles'].axes, found.profiles, strict=False):
        curves = named(axes, figures['profiles'].legends[0])
        ((x, y),) = curves['profile']
        assert (x.tolist(), y.tolist()) == (one.values.tolist(), one.rise.tolist())
        ((x, y),) = curves['parabola']
        assert y == pytest.approx(((x - one.value) / one.deviation) ** 2)
        assert (x[0], x[-1]) == (one.values[0], one.values[-1])
        assert levels(axes) == [pytest.approx(1.96**2)]
        assert axes.get_xlabel() == ('M.surge (kg)' if one.unit else 'lag')
    assert identify.prediction([])[0] is None, 'nothing was held out'
    found.profiles *= 2
    grid = identify._profiles(found)[0].axes[0].get_subplotspec().get_gridspec()
    assert grid.get_geometry() == (2, 3)


def _traced(figure, pairs, noise) -> None:
    for i, axes in enumerate(figure.axes):
        assert axes.get_title(loc='left') == f'({"abcdef"[i]}) {DOFS[i]}'
        assert axes.get_ylabel() == VELOCITY[i // 3]
        assert axes.get_xlabel() == ('$t$ (s)' if i > 3 else '')
        curves = named(axes, figure.legends[0])
        assert list(curves) == ['measured', 'simulated']
        for k, (segment, e) in enumerate(pairs[1:7]):  # three on either side of the middle
            t = segment.begin + 0.05 * segment.at
            there = np.isfinite(segment.nu[:, i])
            same(curves['measured'][k], t[there], segment.nu[there, i])
            simulated = segment.nu[:, i] - e[:, i] * noise[i]
            same(curves['simulated'][k], t[there], simulated[there])
        assert len(curves['measured']) == 6


def test_spectra_of_residuals_are_one_where_they_are_white(tmp_path) -> None:
    found, pairs, _ = _identified()
    figure, *_ = identify._residuals(found, pairs)
    for i, axes in enumerate(figure.axes):
        assert axes.get_title(loc='left') == f'({"abcdef"[i]}) {DOFS[i]}'
        assert axes.get_xlabel() == ('frequency (Hz)' if i > 2 else '')
        if i == 2:  # its samples have gaps
            assert not artists.lines(axes)
            continue
        ((f, p),) = map(points, artists.lines(axes))
        spectra = [welch(e[:, i], 20.0, nperseg=40) for _, e in pairs]
        assert f == pytest.approx(spectra[0][0][1:])
        assert p == pytest.approx(10.0 * np.mean([x[1] for x in spectra], axis=0)[1:])
        assert levels(axes) == [1.0]
        assert np.mean(p) == pytest.approx(1.0, abs=0.25)
    for count, drawn in ((16, 0), (17, 1)):
        few = [(Made(at=at[:count], nu=np.zeros((count, 6))), e[:count])
               for e in [pairs[0][1]] for at in [pairs[0][0].at]]  # fmt: skip
        assert len(artists.lines(identify._residuals(found, few)[0].axes[0])) == drawn
    pairs[0][0].nu[38:, 0] = np.nan  # 38 samples have 20 lines, 40 one more
    for segment, _ in pairs:
        segment.at = 2.0 * segment.at
    ((f, p),) = map(points, artists.lines(identify._residuals(found, pairs)[0].axes[0]))
    assert f == pytest.approx(10.0 / 40.0 * np.arange(1, 21)), 'measured at half the rate'
    assert np.mean(p) == pytest.approx(1.0, abs=0.25)


def test_spectra_of_unlike_recordings_are_averaged_by_frequency() -> None:
    """Residuals of 2 Hz, measured at 20 and at 5 Hz."""
    found, _, _ = _identified()
    pairs = []
    for apart, count in ((1.0, 80), (4.0, 100)):
        at = apart * np.arange(count)
        waves = np.sin(4.0 * np.pi * 0.05 * at)
        pairs.append((Made(begin=0.0, at=at, nu=np.zeros((count, 6))), np.tile(waves[:, None], 6)))
    ((f, p),) = map(points, artists.lines(identify._residuals(found, pairs)[0].axes[0]))
    assert f[-1] == pytest.approx(2.5), 'the highest that both have'
    assert f[np.argmax(p)] == pytest.approx(2.0)
    assert np.all(p[np.abs(f - 2.0) > 0.5] < 1e-3 * p.max())
