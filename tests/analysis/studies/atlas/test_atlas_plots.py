"""Plots of the atlas: every bar and cell against the couplings of its vehicle."""

from types import SimpleNamespace as Made

import numpy as np
import pytest
from helpers import artists
from helpers.artists import cells, points
from helpers.made_runs import DOFS

from auv_analysis.studies.atlas import plots as atlas

pytestmark = pytest.mark.usefixtures('approved')

RNG = np.random.default_rng


def _chart(name: str, seed: int, *, diagonal: bool = False) -> Made:
    rng = RNG(seed)
    return Made(
        name=name, is_diagonal=diagonal, correlation=rng.uniform(-0.5, 0.5, (6, 6)),
        velocity_shares=np.triu(rng.uniform(0.0, 0.2, (6, 6)), 1),
        input_shares=np.tril(rng.uniform(0.0, 0.2, (6, 6)), -1),
        largest=rng.uniform(0.5, 0.6), strength=rng.uniform(0.6, 0.9), pairs=[('sway', 'roll')],
    )  # fmt: skip


def test_an_atlas(tmp_path) -> None:
    charts = [_chart('a', 1), _chart('flat', 2, diagonal=True), _chart('b', 3), _chart('c', 4)]
    with artists.captured() as figures:
        atlas.draw(charts, tmp_path)
    assert set(figures) == {'strength', 'correlation', 'shares'}
    coupled = [chart for chart in charts if chart.name != 'flat']
    (axes,) = figures['strength'].axes
    assert artists.ticks(axes, 'y') == {0: 'a', 1: 'b', 2: 'c'}
    assert axes.get_xlabel().endswith('(%)')
    for k, chart in enumerate(coupled):
        bar, (x, y) = axes.patches[k], points(artists.lines(axes)[0])
        assert bar.get_x() + bar.get_width() == pytest.approx(100 * chart.strength)
        assert bar.get_y() + bar.get_height() / 2 == pytest.approx(k)
        assert (x[k], y[k]) == (pytest.approx(100 * chart.largest), k)
    assert [text.get_text() for text in axes.texts] == ['sway–roll'] * 3
    for name, label in (('correlation', 'inertial correlation'), ('shares', 'share of energy (%)')):
        panels = [axes for axes in figures[name].axes if axes.images]
        assert [axes.get_title(loc='left') for axes in panels] == ['a', 'b', 'c']
        assert panels[0].images[0].colorbar.ax.get_xlabel() == label
        for axes, chart in zip(panels, coupled, strict=True):
            found = chart
            values = (
                found.correlation
                if name == 'correlation'
                else 100 * (found.velocity_shares + found.input_shares)
            )
            for (row, column), value in cells(axes).items():
                i, j = DOFS.index(row), DOFS.index(column)
                assert value == pytest.approx(np.nan if i == j else values[i, j], nan_ok=True)


def test_shares_however_small_are_on_a_scale_of_a_decade() -> None:
    chart = _chart('weak', 1)
    chart.velocity_shares *= 1e-7
    chart.input_shares *= 1e-7
    figure, *_ = atlas._shares([chart])
    assert figure.axes[0].images[0].get_clim() == (0.001, 0.01)


def test_an_atlas_of_vehicles_that_nothing_couples(tmp_path) -> None:
    with artists.captured() as figures:
        atlas.draw([_chart('flat', 2, diagonal=True), _chart('round', 3, diagonal=True)], tmp_path)
    assert not figures
