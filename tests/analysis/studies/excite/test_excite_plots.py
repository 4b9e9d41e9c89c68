"""Plots of an excitation: intervals, wrench and velocity, paths in their planes."""

from types import SimpleNamespace as Made

import numpy as np
import pytest
from helpers import artists
from helpers.artists import levels, named, points, same
from helpers.made_runs import DOFS

from auv_analysis.studies.excite import plots as excite

pytestmark = pytest.mark.usefixtures('approved')

VELOCITY, WRENCH = ('m/s', 'rad/s'), ('N', 'N m')
RNG = np.random.default_rng


def test_an_excitation(tmp_path) -> None:
    rng = RNG(5)
    states = rng.normal(size=(26, 2, 51, 13)) + np.arange(13)
    commands = rng.normal(size=(26, 2, 50, 6)) * 9
    found = Made(
        request=Made(step=0.1, bounds=Made(room=np.array([8.0, 6.0, np.inf]))),
        motion=Made(states=states, commands=commands),
    )
    rows = [
        {'name': 'M.surge', 'left': 0.1, 'left_case1': 0.6},
        {'name': 'not asked', 'left': None, 'left_case1': 0.9},
        {'name': 'M.sway', 'left': 0.25, 'left_case1': None},
        {'name': 'M.yaw', 'left': 0.4, 'left_case1': 0.8},
    ]
    with artists.captured() as figures:
        excite.draw(found, rows, tmp_path)
    assert set(figures) == {'intervals', 'wrench', 'tank'}
    (axes,) = figures['intervals'].axes
    shown = named(axes)
    assert shown['this excitation'][0][0] == pytest.approx([10.0, 25.0, 40.0])
    assert shown['case 1'][0][0] == pytest.approx([60.0, np.nan, 80.0], nan_ok=True)
    assert artists.ticks(axes, 'y') == {0: 'M.surge', 1: 'M.sway', 2: 'M.yaw'}
    assert levels(axes, 'x') == [30.0]
    assert axes.get_xlabel().endswith('(%)')
    for k, axes in enumerate(figures['wrench'].axes):
        i, column = k // 2, k % 2
        assert axes.get_title(loc='left') == f'({"abcdefghijkl"[k]}) {DOFS[i]}'
        assert axes.get_ylabel() == (WRENCH, VELOCITY)[column][i // 3]
        (curve,) = map(points, artists.lines(axes))
        signal = states[0, 0, :, 7 + i] if column else commands[0, 0, :, i]
        same(curve, 0.1 * np.arange(len(signal)), signal)
    planes = ((1, 0, 'east (m)', 'north (m)'), (0, 2, 'north (m)', 'down (m)'))
    for axes, (across, up, x_label, y_label) in zip(figures['tank'].axes, planes, strict=True):
        assert (axes.get_xlabel(), axes.get_ylabel()) == (x_label, y_label)
        room = {0: [-4.0, 4.0], 1: [-3.0, 3.0], 2: []}
        assert levels(axes, 'x') == room[across]
        assert levels(axes) == room[up]
        curves = [points(line) for line in artists.lines(axes)]
        assert len(curves) == 21, 'twenty drawn ones at most'
        same(curves[-1], states[0, 0, :, across], states[0, 0, :, up])
        for curve, path in zip(curves, states[20:0:-1, 0], strict=False):
            same(curve, path[:, across], path[:, up])
    assert figures['tank'].axes[1].yaxis_inverted()
    handles = figures['tank'].legends[0]
    assert {t.get_text() for t in handles.get_texts()} == {'the prior', 'drawn around it'}
    (own,) = [h for h, t in zip(handles.legend_handles, handles.get_texts(), strict=True)
              if t.get_text() == 'the prior']  # fmt: skip
    assert own.get_color() == artists.lines(figures['tank'].axes[0])[-1].get_color()
