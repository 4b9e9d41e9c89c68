"""Derivatives of sampled signals."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from auv_analysis.metrics.certificate import derivative


@pytest.mark.parametrize('n', [2, 3, 5, 9, 10, 40])
def test_derivative_of_a_polynomial_is_exact(n):
    t = np.sort(np.random.default_rng(n).uniform(0, 1, n)) + 2 * np.arange(n)
    t = t / t[-1] + 5.0  # uneven, and late
    degree = min(n - 1, 8)
    p = np.polynomial.Polynomial(np.arange(1.0, degree + 2.0), domain=[5, 6])
    values = np.stack([p(t), -2 * p(t)], axis=1)
    expected = np.stack([p.deriv()(t), -2 * p.deriv()(t)], axis=1)
    assert_allclose(derivative(t, values), expected, rtol=0, atol=1e-6 * np.abs(expected).max())
    assert_allclose(derivative(t, p(t)), expected[:, 0], rtol=0, atol=1e-6 * expected.max())


def test_derivative_by_the_weights_of_the_central_formula():
    values = np.zeros(21)
    values[10] = 1.0
    # weights of the sample 4, 3, ... ahead to 4 behind, over h
    expected = [-1 / 280, 4 / 105, -1 / 5, 4 / 5, 0, -4 / 5, 1 / 5, -4 / 105, 1 / 280]
    found = derivative(0.5 * np.arange(21), values)[6:15]
    assert_allclose(found, 2 * np.array(expected), rtol=0, atol=1e-15)


def test_a_single_sample_has_no_derivative():
    assert np.isnan(derivative(np.zeros(1), np.ones((1, 6)))).all()
