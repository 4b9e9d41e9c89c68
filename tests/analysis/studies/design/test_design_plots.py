"""Plots of a design: before and after, of the right run and the right entry."""

from types import SimpleNamespace as Made

import numpy as np
import pytest
from helpers import artists
from helpers.artists import named, same
from helpers.made_runs import DOFS, UPSILON, UPSILON_INV, VEHICLE, made

from auv_analysis.studies.design import plots as design

pytestmark = pytest.mark.usefixtures('approved')

RNG = np.random.default_rng


def _designed():
    before, after = made('gvc', 'gvc', 1), made('gvc', 'gvc', 2)
    names = ('delta_xi.surge', 'delta_pi.pitch', 'delta_xi.sway', 'delta_pi.yaw')
    shares = {'before': (0.9, 0.5, 0.2, 1e-6), 'after': (0.05, 0.45, 0.6, 1e-7)}
    rng = RNG(3)
    upper = {key: np.eye(6) + np.triu(rng.normal(size=(6, 6)), 1) for key in shares}
    document = {
        'ranking': [
            {'coupling': name, 'share': {key: shares[key][k] for key in shares}}
            for k, name in enumerate(names)
        ],
        'reduce': 'delta_xi.surge', 'controller': 'gvc',
        'measures': [{'name': 'delta_pi_max.surge', 'unit': 'N'},
                     {'name': 'delta_xi_max.surge', 'unit': 'm/s'}],
        'proposal': {f'Upsilon_{key}': U.tolist() for key, U in upper.items()},
    }  # fmt: skip
    vehicle = Made(setting=Made(space=Made(vehicle=VEHICLE)))
    runs = {'before': before, 'after': after}
    phases = {
        name: Made(runs={'gvc': run, 'cl': made('cl', 'cl', 9)}) for name, run in runs.items()
    }
    return Made(document=document, proposal=vehicle, simulated=phases), runs, upper


def test_what_begins_with_a_peak_is_drawn_in_two_phases(tmp_path) -> None:
    result, runs, _ = _designed()
    result.document['reduce'] = 'delta_pi.surge'
    with artists.captured() as figures:
        design.draw_design(result, tmp_path)
    left, right = figures['reduced'].axes
    assert left.get_ylabel() == r'$\Delta\pi_1$ (N)'
    for axes, late in ((left, False), (right, True)):
        for name, (curve,) in named(axes, right.get_legend()).items():
            run = runs[name]
            seen = (run.t > run.start + 2.0) == late
            same(curve, run.t[seen], (run.tau @ UPSILON - run.tau)[seen, 0])


def test_a_design_before_and_after(tmp_path) -> None:
    result, runs, upper = _designed()
    with artists.captured() as figures:
        records = design.draw_design(result, tmp_path)
    assert set(figures) == {'couplings', 'reduced', 'Upsilon'}
    (axes,) = figures['couplings'].axes
    symbols = [r'$\Delta\xi_1$ surge', r'$\Delta\pi_5$ pitch', r'$\Delta\xi_2$ sway']
    assert artists.ticks(axes, 'y') == dict(enumerate(symbols))
    shown = named(axes)
    assert {name: curves[0][0].tolist() for name, curves in shown.items()} == {
        'before': [0.9, 0.5, 0.2], 'after': [0.05, 0.45, 0.6],
    }  # fmt: skip
    assert [curves[0][1].tolist() for curves in shown.values()] == [[0, 1, 2]] * 2
    assert [t.get_fontweight() for t in axes.get_yticklabels()] == ['bold', 'normal', 'normal']
    assert axes.get_ylim()[0] > axes.get_ylim()[1]
    assert axes.get_xscale() == 'log'
    (axes,) = figures['reduced'].axes
    assert axes.get_ylabel() == r'$\Delta\xi_1$ (m/s)'
    assert axes.get_xlabel() == '$t$ (s)'
    for name, (curve,) in named(axes).items():
        run = runs[name]
        same(curve, run.t, (run.nu @ UPSILON_INV.T - run.nu)[:, 0])
    assert records['reduced'].caption.startswith('delta_xi.surge of the vehicle before and after')
    M = VEHICLE.M
    panels = figures['Upsilon'].axes[:2]
    assert panels[0].get_gridspec().get_geometry() == (1, 2), 'the left one names the rows of both'
    for axes, (key, U) in zip(panels, upper.items(), strict=True):
        assert axes.get_title(loc='left').endswith(key)
        weight = np.sqrt(np.diag(M)[:, None] / np.diag(M)[None, :])
        assert np.asarray(axes.images[0].get_array()) == pytest.approx(
            np.abs(weight * U - np.eye(6))
        )
        assert list(artists.ticks(axes).values()) == list(DOFS)
        for text in axes.texts:
            column, row = map(round, text.get_position())
            assert float(text.get_text().replace('−', '-')) == pytest.approx(
                U[row, column], rel=0.06
            )
        assert len(axes.texts) == 15
    assert list(artists.ticks(panels[0], 'y').values()) == list(DOFS)


def test_a_coupling_that_vanishes_stands_at_the_left_and_a_faint_one_nowhere() -> None:
    document = {
        'reduce': 'delta_xi.sway', 'controller': 'gvc',
        'ranking': [
            {'coupling': name, 'share': {'before': before, 'after': 0.0}}
            for name, before in (('delta_xi.sway', 0.5), ('delta_pi.yaw', 0.5 * 1e-4))
        ],
    }  # fmt: skip
    figure, _, _ = design._couplings(document)
    (axes,) = figure.axes
    drawn = np.concatenate([line.get_xdata() for line in artists.lines(axes)])
    assert drawn.min() == pytest.approx(1e-3 * 1e-4 * 0.5)
    assert len(axes.get_yticklabels()) == 1
