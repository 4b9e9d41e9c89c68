"""Plots of a check of a driver: arrivals, ages, rates and answers in their units."""

from types import SimpleNamespace as Made

import numpy as np
import pytest
from helpers import artists
from helpers.artists import points, same
from helpers.made_runs import DOFS

from auv_analysis.driver import report as driver
from auv_analysis.driver.evidence import Settings

pytestmark = pytest.mark.usefixtures('approved')

VELOCITY = ('m/s', 'rad/s')
RNG = np.random.default_rng


def test_timing_motion_and_answers_of_a_driver(tmp_path) -> None:
    rng = RNG(9)
    arrived = np.cumsum(rng.integers(5_000_000, 30_000_000, 60)) + 9_000_000_000
    stamps = arrived - rng.integers(1_000_000, 9_000_000, 60)
    order = [*range(57), 58, 57, 59]  # as they were taken, not as they arrived
    log = Made(arrived_ns=arrived[order], stamp_ns=stamps[order], began_ns=9_000_000_000)
    rates = {
        word: Made(
            t=np.arange(20) * 0.1, path=rng.normal(size=(20, 3)), velocity=rng.normal(size=(20, 3))
        )
        for word in ('linear', 'angular')
    }
    trials = [
        Made(trial=Made(axis=axis, dof=DOFS[axis], speed_unit=VELOCITY[axis // 3]),
             t=np.arange(30) * 0.2, nu=rng.normal(size=(30, 6)),
             response=Made(t=np.arange(10) * 0.5, delay=0.3, form=rng.normal(size=10)))
        for axis in (4, 1, 2)
    ]  # fmt: skip
    evidence = Made(log=log, settings=Settings(), has_motion=True, rates=rates, answered=trials)
    with artists.captured() as figures:
        driver.draw(evidence, tmp_path)
    assert set(figures) == {'timing', 'linear', 'angular', 'answers'}
    left, right = figures['timing'].axes
    assert left.get_xlabel() == 'between two messages (ms)'
    assert (left.get_ylabel(), left.get_yscale()) == ('messages', 'log')
    apart = np.diff(arrived) / 1e6
    edges = [bar.get_x() for bar in left.patches]
    for bar, begin, end in zip(left.patches, edges, [*edges[1:], np.inf], strict=True):
        assert bar.get_height() == np.sum((apart >= begin - 1e-9) & (apart < end - 1e-9))
    assert abs(edges[0]) < 1e-9
    assert (right.get_xlabel(), right.get_ylabel()) == ('$t$ (s)', 'older than the freshest (ms)')
    ages = (arrived - stamps) / 1e6
    (curve,) = map(points, artists.lines(right))
    same(curve, (arrived / 1e9 - 9.0)[order], (ages - ages.min())[order])
    for word, unit, half in (('linear', 'm/s', DOFS[:3]), ('angular', 'rad/s', DOFS[3:])):
        figure = figures[word]
        for i, (axes, dof) in enumerate(zip(figure.axes, half, strict=True)):
            assert axes.get_ylabel() == f'{dof} ({unit})'
            assert axes.get_xlabel() == ('$t$ (s)' if i == 2 else '')
            shown = {line.get_label(): points(line) for line in artists.lines(axes)}
            same(shown['by the pose'], rates[word].t, rates[word].path[:, i])
            same(shown['twist'], rates[word].t, rates[word].velocity[:, i])
        assert {t.get_text() for t in figure.legends[0].get_texts()} == {'by the pose', 'twist'}
    *panels, unused = figures['answers'].axes
    assert not unused.lines
    for axes, one in zip(panels, trials, strict=True):
        assert axes.get_ylabel() == f'{one.trial.dof} ({one.trial.speed_unit})'
        shown = {line.get_label(): points(line) for line in artists.lines(axes)}
        nu = one.nu[:, one.trial.axis]
        same(shown['measured'], one.t, nu - nu[0])
        same(shown['fit'], one.response.t + 0.3, one.response.form)


@pytest.mark.parametrize(('count', 'drawn'), [(3, {'timing'}), (2, set())])
def test_what_little_was_heard_is_drawn_or_left_out(tmp_path, count: int, drawn: set[str]) -> None:
    stamps = 9_000_000_000 + 50_000_000 * np.arange(count)
    log = Made(arrived_ns=stamps + 1_000_000, stamp_ns=stamps, began_ns=9_000_000_000)
    evidence = Made(log=log, settings=Settings(), has_motion=False, answered=[])
    with artists.captured():
        assert set(driver.draw(evidence, tmp_path)) == drawn


@pytest.mark.parametrize(('ticks', 'ages'), [(2, [np.nan, 3.0, 0.0]), (0, [0.0] * 3)])
def test_ages_by_a_simulated_clock_begin_with_it(tmp_path, ticks: int, ages: list[float]) -> None:
    """It is first heard after the first message; the next are 5 and 2 ms old."""
    began, clock = 9_000_000_000, np.array([105_000_000, 125_000_000])
    log = Made(
        arrived_ns=began + np.array([1_000_000, 3_000_000, 5_000_000]), began_ns=began,
        stamp_ns=np.array([80_000_000, 100_000_000, 123_000_000]),
        clock_ns=clock[:ticks], clock_arrived_ns=began + np.array([2_000_000, 4_000_000])[:ticks],
    )  # fmt: skip
    settings = Settings(sim_time=True)
    evidence = Made(log=log, settings=settings, has_motion=False, answered=[])
    with artists.captured() as figures:
        driver.draw(evidence, tmp_path)
    (line,) = artists.lines(figures['timing'].axes[1])
    np.testing.assert_allclose(line.get_ydata(), ages, atol=1e-9)
