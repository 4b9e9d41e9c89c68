"""Plots of a tuning: every dot, step and box against the loops that it stands for."""

from types import SimpleNamespace as Made

import numpy as np
import pytest
from helpers import artists
from helpers.artists import levels, named, points

from auv_analysis.metrics.quantities import COSTS
from auv_analysis.report import plots as plotting
from auv_analysis.studies.tune import plots as tune
from auv_analysis.studies.tune.cost import Measures
from auv_analysis.studies.tune.search import Optimum

pytestmark = pytest.mark.usefixtures('approved')

RNG = np.random.default_rng


class Tuned:
    """A tuning of one law beside the reference, of made numbers."""

    def __init__(self, equal: str = 'effort'):
        rng = RNG(1)
        names = {'gvc': 'gvc', 'cl_tuned': 'cl', 'mine': 'own:Law'}
        self.request = Made(reference='gvc')
        base = Measures(*rng.uniform(1.0, 3.0, (6, 1)))
        self.goal = Made(equal=equal, index='weighted_error', reference=base)
        self.scenario = Made(controllers=names, controller=lambda name: {'law': names[name]})
        self.searches = [self._search(rng, 40), self._search(rng, 30)]
        self.laws = {'cl_tuned': Made(law='cl', searches=self.searches)}
        self.draws = {
            name: Measures(*np.exp(rng.normal(k, 0.3, (6, 25)))) for k, name in enumerate(names)
        }
        self.draws['cl_tuned'].error[3] = np.nan

    def _search(self, rng, count):
        tried = Measures(*rng.uniform(0.5, 4.0, (6, count)))
        tried.error[4] = np.nan
        stages = np.where(np.arange(count) % 7 == 0, tune.GRADIENT, 'point')
        margins = rng.uniform(-0.2, 1.0, count)
        least = np.where(margins > 0, margins, 1.0).argsort()
        margins[least[:2]] = 0.0, -5e-14  # just enough, and but for rounding
        return Optimum(None, None, None, True, None, None, tried, margins, stages)

    def ratio(self, name: str, measure: str) -> float:
        return {'gvc': 1.0, 'cl_tuned': 0.8, 'mine': 1.3}[name] + 0.1 * (measure == 'effort') * (
            name != 'gvc'
        )


@pytest.mark.parametrize('equal', ['effort', 'error'])
def test_what_effort_buys(equal: str) -> None:
    tuning = Tuned(equal)
    figure, title, caption = tune.trade_off(tuning)
    (axes,) = figure.axes
    assert axes.get_xlabel() == 'effort / that of gvc'
    assert axes.get_ylabel() == 'time-weighted error / that of gvc'
    assert (axes.get_xscale(), axes.get_yscale()) == ('log', 'log')
    assert levels(axes, 'x') == ([1.0] if equal == 'effort' else [])
    assert levels(axes, 'y') == ([] if equal == 'effort' else [1.0])
    x, y = [], []
    for one in tuning.searches:
        for k, margin in enumerate(one.margins):
            tried = one.evaluations
            if margin >= -1e-12 and k % 7 and np.isfinite(tried.error[k]):
                x.append(tried.effort[k] / tuning.goal.reference.effort[0])
                y.append(tried.weighted_error[k] / tuning.goal.reference.weighted_error[0])
    cloud, front, *marks = artists.lines(axes)
    assert np.array(sorted(zip(*points(cloud), strict=True))) == pytest.approx(
        np.array(sorted(zip(x, y, strict=True)))
    )
    tried = list(zip(x, y, strict=True))
    best = [(a, b) for a, b in tried if not any(c < a and d <= b for c, d in tried)]
    assert pytest.approx(np.array(sorted(best))) == np.array(points(front)).T
    places = {line.get_marker(): tuple(v[0] for v in points(line)) for line in marks}
    assert places == {
        '*': (1.0, 1.0),
        'o': (pytest.approx(0.9), 0.8),
        'D': (pytest.approx(1.4), 1.3),
    }
    assert [t.get_text() for t in axes.get_legend().get_texts()] == ['cl', 'gvc, as given']
    assert front.get_color() == cloud.get_color() == plotting.COLOURS[1]
    assert axes.get_xlim() == pytest.approx((0.97 * min(1.0, *(a for a, _ in best)), 2.0))
    assert 'time-weighted error of all gains' in title
    assert f'dashed: equal {equal}' in caption


def test_the_reference_is_in_sight_where_all_others_cost_more() -> None:
    tuning = Tuned()
    for one in tuning.searches:
        one.evaluations.effort[:] += 2.0 * tuning.goal.reference.effort
    (axes,) = tune.trade_off(tuning)[0].axes
    assert axes.get_xlim() == pytest.approx((0.97, 2.0))


@pytest.mark.parametrize(('height', 'least'), [(199.5, 0.1), (200.5, 1.0)])
def test_what_lies_far_off_is_out_of_sight(height: float, least: float) -> None:
    tuning = Tuned()
    for one in tuning.searches:
        one.margins[:] = -1.0  # too fast
    (axes,) = tune.trade_off(tuning)[0].axes
    assert axes.get_xlim() == pytest.approx((0.97, 2.0)), 'nothing was found'
    one, reference = tuning.searches[0], tuning.goal.reference
    one.margins[1:3] = 1.0
    one.evaluations.effort[1:3] = np.array([0.1, 3.0]) * reference.effort
    one.evaluations.weighted_error[1:3] = np.array([height, 0.01]) * reference.weighted_error
    (axes,) = tune.trade_off(tuning)[0].axes
    assert axes.get_xlim() == pytest.approx((0.97 * least, 2.0))
    assert axes.get_ylim() == (0.05, 200.0)


@pytest.mark.parametrize(('largest', 'between'), [(90.0, True), (900.0, False)])
def test_an_axis_of_errors_has_as_many_plain_ticks_as_it_has_room_for(largest, between) -> None:
    axes = plotting.new_figure(2.0).subplots()
    axes.plot([1.0, largest], [0.0, 1.0])
    tune._scaled(axes, 'error')
    axes.figure.canvas.draw()
    ticks = [text.get_text() for text in axes.get_xticklabels()]
    assert '10' in ticks
    assert ('20' in ticks) == ('50' in ticks) == between


def test_distributions_over_draws() -> None:
    tuning = Tuned()
    figure, title, _ = tune.distributions(tuning)
    assert title == 'Distributions over 25 draws'
    for axes, measure in zip(figure.axes, ('weighted_error', 'effort', 'late_error'), strict=True):
        shown = named(axes, figure.legends[0])
        assert list(shown) == list(tuning.draws)
        for name, ((x, share),) in shown.items():
            values = getattr(tuning.draws[name], measure)
            assert x.tolist() == sorted(values)
            assert share == pytest.approx(np.arange(1, 26) / 25)
        assert axes.get_xlabel() == f'{COSTS[measure].label} ({COSTS[measure].unit})'
        assert axes.get_xscale() == ('linear' if measure == 'effort' else 'log')
    assert figure.axes[0].get_ylabel() == 'share of the draws'


def test_a_measure_is_drawn_where_any_controller_has_it() -> None:
    tuning = Tuned()
    tuning.draws['mine'].late_error[:] = np.nan
    assert len(tune.distributions(tuning)[0].axes) == 3
    for draws in tuning.draws.values():
        draws.late_error[:] = np.nan
    assert len(tune.distributions(tuning)[0].axes) == 2


def test_paired_ratios_are_of_the_same_draws() -> None:
    tuning = Tuned()
    tuning.draws['cl_tuned'].weighted_error[3] = tuning.draws['gvc'].effort[5] = np.nan
    figure, title, _ = tune.paired(tuning)
    assert title == 'Paired ratios to gvc'
    for k, (axes, measure) in enumerate(
        zip(figure.axes, ('weighted_error', 'effort'), strict=True)
    ):
        names = [label.get_text() for label in axes.get_yticklabels()]
        assert names == (['cl_tuned', 'mine'] if k == 0 else ['', ''])
        assert axes.get_xlabel() == f'{COSTS[measure].label} / that of gvc'
        assert levels(axes, 'x') == [1.0]
        upright = [line for line in axes.lines if len(set(line.get_xdata())) == 1]
        for place, name in enumerate(('cl_tuned', 'mine'), start=1):
            ratios = getattr(tuning.draws[name], measure) / getattr(tuning.draws['gvc'], measure)
            ratios = ratios[np.isfinite(ratios)]  # of the draws that neither left
            found = {
                x.get_xdata()[0] for x in upright if abs(np.mean(x.get_ydata()) - place) < 1e-9
            }
            low, high = np.quantile(ratios, [0.05, 0.95])
            ends = min(ratios[ratios >= low]), max(ratios[ratios <= high])
            assert sorted(found) == pytest.approx([ends[0], np.median(ratios), ends[1]])
            box = axes.patches[place - 1].get_path().vertices
            ends = box[:, 0].min(), box[:, 0].max()
            assert ends == pytest.approx(tuple(np.quantile(ratios, [0.25, 0.75])))
        assert axes.get_ylim()[0] > axes.get_ylim()[1], 'the first is at the top'
