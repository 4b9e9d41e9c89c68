"""Response by the model: noise at rest, a response that was made, and the dead band of a plan."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from auv_analysis.driver.plan import LEVEL, ZERO, _dead_band
from auv_analysis.driver.response import (
    FINE,
    Noise,
    fit_response,
    in_a_row,
    noise_at_rest,
    predicted,
)
from auv_dynamics import load_vehicle


@pytest.mark.parametrize('sign', [1, -1])
def test_a_made_response_is_found_again(sign: int) -> None:
    """One and a half times the model's, 0.2 s late, beside a drift; and in sway a part of it."""
    vehicle, tau = load_vehicle('bluerov2_heavy'), (5.0, *ZERO[1:])
    held = [(0.0, 0.5, ZERO), (0.5, 1.5, tau), (1.5, 2.5, (-5.0, *ZERO[1:])), (2.5, 3.0, ZERO)]
    model, t, nu = predicted(vehicle, LEVEL, held), np.arange(150) / 50.0, np.zeros((150, 6))
    form, peak = np.interp(t - 0.2, model.t, model.added[:, 0]), np.abs(model.added[:, 0]).max()
    nu[:, 0] = 1.5 * sign * form + 0.01 + 0.02 * t
    nu[:, 1] = -0.3 * form
    quiet = Noise(np.zeros(6), np.ones(6))
    found = fit_response(vehicle, LEVEL, held, t, nu, 0, quiet, 0.5, np.ones((1, 2)))
    assert (found.sign, found.delay) == (sign, pytest.approx(0.2))
    assert found.gain == pytest.approx(1.5 * sign, rel=1e-3)
    assert found.delay_error == pytest.approx(FINE / 2.0)
    assert found.residual < 1e-3 * peak
    assert_allclose(found.measured[:2], [1.5 * sign * peak, -0.3 * peak], rtol=1e-3)
    assert found.predicted[0] == pytest.approx(peak, rel=1e-3)


def test_noise_at_rest_is_what_a_line_leaves() -> None:
    t, sizes = np.arange(40) / 50.0, np.arange(1.0, 7.0)
    ripple = np.tile([1.0, -1.0, -1.0, 1.0], 10)  # to which no line is alike
    nu = 0.3 - 2.0 * t[:, None] + ripple[:, None] * sizes
    noise = noise_at_rest(t, nu)
    assert_allclose(noise.variance, sizes**2 * 40 / 38)
    assert_allclose(noise.alike, 1.0)
    assert noise_at_rest(t[:5], nu[:5]).variance.min() > 0.0
    few = noise_at_rest(t[:4], nu[:4])
    assert_allclose((few.variance, few.alike), (np.zeros(6), np.ones(6)))


def test_related_residuals_tell_less_than_as_many_that_are_not() -> None:
    n, draw = 50_000, np.random.default_rng(3).normal(size=50_000)
    related = np.zeros(n)
    for k in range(1, n):
        related[k] = 0.5 * related[k - 1] + draw[k]
    found = in_a_row(np.stack([draw, related, np.ones(n), np.tile([1.0, -1.0], n // 2)], axis=1))
    assert_allclose(found, [1.0, 3.0, n - 1.0, 1.0], rtol=0.05)
    assert in_a_row(np.zeros((9, 1))) == 1.0


def test_a_dead_band_is_that_of_the_last_thruster_that_matters() -> None:
    rotors = [SimpleNamespace(dead_band=pair) for pair in ((3.0, 2.0), (1.0, 4.0), (9.0, 9.0))]
    matrix, inverse = np.zeros((6, 3)), np.zeros((3, 6))
    matrix[0], inverse[:, 0] = [1.0, 1.0, 1.0], [0.5, 0.5, 0.04]  # the third gives little of it
    thrusters = SimpleNamespace(rotors=rotors, matrix=matrix, inverse=inverse)
    vehicle: Any = SimpleNamespace(thrusters=thrusters)
    assert _dead_band(vehicle, 0) == 8.0
    assert _dead_band(vehicle, 1) == 0.0
    inverse[2, 0] = -0.06
    matrix[0, 2] = -1.0
    assert _dead_band(vehicle, 0) == pytest.approx(9.0 / 0.06)
    thrusters.rotors = ()
    assert _dead_band(vehicle, 0) == _dead_band(SimpleNamespace(thrusters=None), 0) == 0.0
