"""Sensitivities to the gains, in a plot and in words."""

from types import SimpleNamespace as Made

import numpy as np
import pytest
from helpers import artists
from helpers.artists import cells

from auv_analysis.studies.study import procedure as study
from auv_analysis.studies.study.sensitivity import Kpi

pytestmark = pytest.mark.usefixtures('approved')

RNG = np.random.default_rng


def _sensitive(method: str) -> Made:
    rng = RNG(10)
    gains, weight = ('k_D', 'Gamma'), 'ST' if method == 'sobol' else 'mu_star'
    kpis = {}
    for name, dof in (('effort.max', 'yaw'), ('velocity_error.rms', 'sway'), ('other', 'surge'),
                      ('velocity_error.rms', 'roll')):  # fmt: skip
        spread = rng.uniform(0.3, 0.6)
        about = {'spread': spread, 'spread_low': spread - 0.1, 'spread_high': spread + 0.2}
        rows = [about | {'gain': gain, weight: rng.uniform()} for gain in reversed(gains)]
        kpis[Kpi(name, dof)] = rows
    return Made(controller='cl', method=method, weight=weight, gains=gains, span=2.0, kpis=kpis)


@pytest.mark.parametrize('method', ['sobol', 'morris'])
def test_sensitivities_stand_beside_their_measures(method: str, tmp_path) -> None:
    found = _sensitive(method)
    with artists.captured() as figures:
        (record,) = study.sensitivity_plots([found], tmp_path)
    left, right = figures['sensitivity_cl'].axes
    order = [Kpi('velocity_error.rms', 'sway'), Kpi('velocity_error.rms', 'roll'),
             Kpi('effort.max', 'yaw')]  # fmt: skip
    labels = ['RMS error, sway', 'RMS error, roll', 'peak input, yaw']
    assert artists.ticks(left, 'y') == dict(enumerate(labels))
    assert left.get_xlabel() == 'standard deviation of ln(KPI)'
    assert left.get_ylim()[0] > left.get_ylim()[1]
    (spans,) = [c for c in left.collections if len(c.get_segments()) == 3]
    lengths = spans.get_segments()
    for k, (kpi, bar, span) in enumerate(zip(order, left.patches, lengths, strict=True)):
        main = found.kpis[kpi][0]
        assert bar.get_width() == main['spread']
        assert bar.get_y() + bar.get_height() / 2 == pytest.approx(k)
        assert span[:, 0] == pytest.approx([main['spread_low'], main['spread_high']])
    expected = {
        (label, head): next(r for r in found.kpis[kpi] if r['gain'] == gain)[found.weight]
        for label, kpi in zip(labels, order, strict=True)
        for gain, head in (('k_D', '$k_{D}$'), ('Gamma', r'$\Gamma$'))
    }
    assert cells(right, left) == pytest.approx(expected)
    index = {'sobol': 'total index', 'morris': 'effect μ*'}[method]
    assert right.get_title(loc='left') == f'(b) {index}'
    assert f'(b) {index} after' in record.caption
    assert 'between 1/2 and 2' in record.caption
    assert ('Sobol' in record.caption) == (method == 'sobol')


def test_the_measure_that_follows_the_gains_most_in_words() -> None:
    main = {'alike': 6, 'rank_high': 1, 'rank_low': 1, 'doubled': -58.0, 'gain': 'k_D', 'ST': 0.7,
            'spread': 1.25}  # fmt: skip
    found = Made(controller='cl', method='sobol')
    assert study._headline(found, 'sway', main) == (
        'Under cl the RMS error that follows the gains most is that of sway (spread 1.2, first of '
        '6 in 95 % of the resamplings): k_D makes 70 % of its variance, and doubling k_D changes '
        'it by about −58 %.'
    )
    for doubled, words in ((0.5, '+0.50'), (0.0, '+0')):
        main |= {'doubled': doubled, 'ST': 1.04}  # estimated, as a share of the whole
        text = study._headline(found, 'sway', main)
        assert text.endswith(f'about {words} %.')
        assert ': k_D makes 100 % of its variance' in text
    main |= {'rank_high': 3, 'rank_low': 2, 'doubled': 12.0}
    found.method = 'morris'
    assert study._headline(found, 'sway', main).endswith(
        '(spread 1.2, place 2 to 3 of 6): doubling k_D changes it by about +12 %.'
    )


def test_sensitivities_of_nothing_that_is_drawn(tmp_path) -> None:
    found = _sensitive('sobol')
    found.kpis.clear()
    (record,) = study.sensitivity_plots([found], tmp_path)
    assert (record.png, record.pdf) == (None, None)


@pytest.mark.parametrize(
    ('shares', 'words'),
    [
        ([0.0, 95.0, 5.0, 0.0, 0.0, 0.0],
         'ξ2 (sway) has 95.00 %; the other 5 have 5.00 % together.'),
        ([94.0, 0.0, 0.0, 0.0, 0.0, 6.0], 'ξ1 (surge) has 94.00 % and ξ6 (yaw) has 6.00 %.'),
        ([30.0, 21.0, 19.0, 16.0, 10.0, 4.0],
         'ξ1 (surge) has 30.00 %, ξ2 (sway) has 21.00 %, ξ3 (heave) has 19.00 %, ξ4 (roll) has '
         '16.00 %, ξ5 (pitch) has 10.00 % and ξ6 (yaw) has 4.00 %.'),
    ],
    ids=['many left', 'none left', 'one left'],
)  # fmt: skip
def test_components_are_named_until_nearly_all_energy_is_told(shares, words: str) -> None:
    (sentence,) = study._energy('gvc', {'kinetic_energy': {'shares_percent': shares}})
    assert str(sentence.text) == f'Of the kinetic energy of gvc over the whole run, {words}'
    for none in ([0.0] * 6, None):
        assert [*study._energy('gvc', {'kinetic_energy': {'shares_percent': none}})] == []


def test_an_interval_beside_its_estimate_ends_there(tmp_path) -> None:
    found = _sensitive('sobol')
    for row, (low, high) in zip(
        (rows[0] for rows in found.kpis.values()),
        ((0.1, 0.2), (-0.2, -0.1), (-0.1, 0.1), (-0.1, 0.1)), strict=True,
    ):  # fmt: skip
        row |= {'spread_low': row['spread'] + low, 'spread_high': row['spread'] + high}
    with artists.captured() as figures:
        study.sensitivity_plots([found], tmp_path)
    left = figures['sensitivity_cl'].axes[0]
    (spans,) = [c for c in left.collections if len(c.get_segments()) == 3]
    ends = {}
    for span, bar in zip(spans.get_segments(), left.patches, strict=True):
        ends[round(bar.get_width(), 9)] = span[:, 0] - bar.get_width()
    (effort, sway, _, roll) = (rows[0]['spread'] for rows in found.kpis.values())
    assert ends[round(effort, 9)] == pytest.approx([0.0, 0.2])
    assert ends[round(sway, 9)] == pytest.approx([-0.2, 0.0])
    assert ends[round(roll, 9)] == pytest.approx([-0.1, 0.1])
