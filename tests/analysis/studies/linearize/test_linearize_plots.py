"""Pole map and Bode plots against the eigenvalues and gains that they show."""

from types import SimpleNamespace as Made

import numpy as np
import pytest
from helpers import artists
from helpers.artists import levels, named, points, same
from helpers.made_runs import DOFS

from auv_analysis.studies.linearize import plots as linearize

pytestmark = pytest.mark.usefixtures('approved')

RNG = np.random.default_rng


def test_poles_and_loops(tmp_path) -> None:
    rng = RNG(6)
    models = {
        name: Made(A=rng.normal(size=(8, 8)) * (k + 1)) for k, name in enumerate(('open', 'cl'))
    }
    models['open'].A[:3] = 0.0  # poles that stay where they are are not counted as slow
    models['cl'].A[0] = 0.0
    omega = np.geomspace(0.01, 100.0, 300)
    gains = np.stack([(k + 1.0) / (1j * omega * (1 + 1j * omega * 0.1)) for k in range(6)], axis=1)
    gains[:, 2] = 1e-5  # too small to be drawn
    drawn = {dof: i for i, dof in enumerate(DOFS) if i != 2}
    S = np.zeros((300, 6, 6), complex)
    S[:, range(6), range(6)] = 1 / (1 + gains)
    loop = Made(loop=lambda: 'L', sensitivity=lambda found: (omega, S) if found == 'L' else None,
                plant=Made(period=0.01), delay=0.02, lag=0.03)  # fmt: skip
    with artists.captured() as figures:
        records = linearize.draw(models, {'cl': loop}, tmp_path)
    assert set(figures) == {'poles', 'bode_cl'}
    poles = {name: np.sort_complex(np.linalg.eigvals(model.A)) for name, model in models.items()}
    every = np.concatenate([*poles.values()])
    moving = np.abs(every)[np.abs(every) > 1e-9]
    reach = (np.abs(every).max(), 1.5 * np.median(moving))
    for axes, limit in zip(figures['poles'].axes, reach, strict=True):
        assert [dots.get_label() for dots in axes.collections] == list(poles)
        for dots, values in zip(axes.collections, poles.values(), strict=True):
            near = values[np.abs(values) <= limit * (1 + 1e-9)]
            assert np.asarray(dots.get_offsets()) == pytest.approx(np.c_[near.real, near.imag])
            low, high = axes.get_xlim()
            assert low < near.real.min(initial=0) <= near.real.max(initial=0) < high
            assert axes.get_ylim()[1] == -axes.get_ylim()[0] > np.abs(near.imag).max(initial=0)
        assert axes.get_xlabel() == 'real part (1/s)'
        assert levels(axes, 'x') == [0.0]
        for ratio, ray in zip((0.2, 0.4, 0.6, 0.8), artists.lines(axes), strict=True):
            x, y = points(ray)
            assert -x[0] / np.hypot(x[0], y[0]) == pytest.approx(ratio)
    assert figures['poles'].axes[0].get_ylabel() == 'imaginary part (rad/s)'
    assert [t.get_text() for t in figures['poles'].legends[0].get_texts()] == ['open', 'cl']
    upper, lower = figures['bode_cl'].axes
    assert (upper.get_ylabel(), lower.get_ylabel()) == ('loop gain', 'phase (deg)')
    assert lower.get_xlabel() == r'$\omega$ (rad/s)'
    assert levels(upper) == pytest.approx([1.0, 1 / 10 ** (6 / 20)], rel=0.01)
    assert levels(lower) == pytest.approx([-180.0, -135.0])
    for axes in (upper, lower):
        shown = named(axes, figures['bode_cl'].legends[0])
        assert list(shown) == list(drawn)
        for k, ((x, y),) in zip(drawn.values(), shown.values(), strict=True):
            size = np.abs(gains[:, k])
            seen = (size > 0.01) & (size < 100.0)
            phase = np.degrees(np.unwrap(np.angle(gains[:, k])))
            same((x, y), omega[seen], size[seen] if axes is upper else phase[seen])
    assert '0.01 s, 0.02 s late, actuator lag 0.03 s' in records['bode_cl'].caption
    assert (upper.get_xscale(), upper.get_yscale(), lower.get_yscale()) == ('log', 'log', 'linear')


def test_markers_are_told_apart() -> None:
    assert len(set(linearize.MARKS)) == len(linearize.MARKS)


def test_poles_that_are_all_zero_have_panels_alike(tmp_path) -> None:
    with artists.captured() as figures:
        linearize.draw({'still': Made(A=np.zeros((8, 8)))}, {}, tmp_path)
    every, slow = figures['poles'].axes
    assert (every.get_xlim(), every.get_ylim()) == (slow.get_xlim(), slow.get_ylim())
