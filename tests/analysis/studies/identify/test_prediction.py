"""What a model is measured by: its rivals, the moments between steps, and errors by energy."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis.studies.identify import output_error
from auv_analysis.studies.identify.identify import HISTORY, as_filed
from auv_analysis.studies.identify.prediction import (
    BlackBox,
    _after,
    compare,
    held_of,
    persistence,
    predict,
    smoothed_command,
)
from auv_analysis.studies.identify.record import Record
from auv_dynamics.vehicle.vehicle_file import load_vehicle

STEP = 0.02


def driven(seed: int, duration: float = 40.0) -> Record:
    """Level, each velocity driven by three sines: nu_dot = tau - 0.7 nu."""
    rng, n = np.random.default_rng(seed), round(duration / STEP)
    omega, phase = rng.uniform(0.3, 3.0, (3, 6)), rng.uniform(0.0, 2.0 * np.pi, (3, 6))
    t = STEP * np.arange(n + 1)
    tau = np.sin(omega * t[:-1, None, None] + phase).sum(axis=1)
    left, nu = np.exp(-0.7 * STEP), np.zeros((n + 1, 6))
    for k in range(n):
        nu[k + 1] = left * nu[k] + (1.0 - left) / 0.7 * tau[k]
    return Record('x', t, np.tile([1.0, 0.0, 0.0, 0.0], (n + 1, 1)), t, nu, STEP, tau, 0.0)


def test_a_black_box_predicts_what_is_linear_and_persistence_does_not():
    held = held_of([driven(1)], HISTORY)
    box, still = BlackBox([driven(0)]).predict(held), persistence(held)
    assert box.shape == still.shape == (held.count, len(held.horizons), 6)
    starts = np.array([one.start[4:] for one in held.segments[0]])
    assert_allclose(still, starts[:, None] - held.measured)
    for h, horizon in enumerate(held.horizons):
        sizes = [np.sqrt((errors[:, h] ** 2).mean()) for errors in (box, still)]
        assert sizes[0] < 0.1 * sizes[1], horizon


def test_a_black_box_has_the_mean_of_the_command_over_its_step():
    """Commands held for 0.04 s: a hundredth second of one and four of the next, and so on."""
    middles, six = 0.02 + 0.04 * np.arange(10), np.arange(1.0, 7.0)
    found = smoothed_command(middles, np.outer(np.arange(10.0), six), np.array([0.07, 0.3]))
    first = (0.01 * 1 + 0.04 * 2 + 0.04 * 3 + 0.01 * 4) / 0.1
    last = (0.02 * 7 + 0.04 * 8 + 0.04 * 9) / 0.1
    assert_allclose(found, np.outer([first, last], six))


def test_between_steps_a_prediction_is_a_straight_line():
    rows = np.array([1.0, 4.0, 2.0, 8.0])[None, :, None] * np.ones((2, 1, 6))
    found = _after(rows, np.array([1.0, 1.25, 2.0 + 1e-9, 3.5, 4.0]))
    assert_array_equal(found, np.tile(np.array([1.0, 1.75, 4.0, 5.0, 8.0])[:, None], (2, 1, 6)))


def test_predictions_are_the_same_however_many_are_simulated_at_once(monkeypatch):
    vehicle = load_vehicle('bluerov2_heavy')
    held = held_of([driven(2, 4.0)], HISTORY)
    expected = predict(held, vehicle, *as_filed(vehicle))
    assert len(expected) > 2
    monkeypatch.setattr(output_error, 'BYTES', 1)
    found = predict(held, vehicle, *as_filed(vehicle))
    assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def test_an_error_is_a_root_mean_square_over_moments_and_a_ratio_one_over_blocks():
    """Two moments in a block and one in another, in which the first is three times as far off."""
    held = SimpleNamespace(blocks=np.array([4, 4, 7]), horizons=np.array([0.5]), count=3)
    first, other = np.zeros((2, 3, 1, 6))
    first[:, 0, 0], other[:, 0, 0] = (1.0, 1.0, 3.0), 1.0
    first[:, 0, 3] = 2.0
    other[:, 0, 1], other[:, 0, 3:] = np.nan, np.nan
    M = np.diag([4.0, 1.0, 1.0, 0.0, 1.0, 1.0])
    rows = compare({'new': first, 'prior': other}, held, M)
    assert [(row['predictor'], row['horizon']) for row in rows] == [('new', 0.5), ('prior', 0.5)]
    for key, numbers in {
        'error': (np.sqrt(11.0 / 3.0), 1.0), 'linear': (np.sqrt(11.0 / 3.0), np.sqrt(1.5)),
        'angular': (2.0, None), 'ratio': (None, np.sqrt(11.0 / 3.0)), 'ratio_low': (None, 1.0),
        'ratio_high': (None, 3.0),
    }.items():  # fmt: skip
        assert [row[key] for row in rows] == pytest.approx(numbers), key
