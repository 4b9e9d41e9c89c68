"""Multi-start search: gradients, constraints, bounds, and a minimum that one start misses."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from auv_analysis.studies.optimise import GRADIENT, Search, sobol_points

LOW, HIGH = np.array([-3.0, -3.0]), np.array([3.0, 3.0])


def test_gradients_of_quadratic_functions_are_exact():
    A = np.array([[2.0, -0.5], [-0.5, 1.0]])

    def function(x):
        return np.stack([np.einsum('bi,ij,bj->b', x, A, x), x @ [1.0, -2.0]])

    values, slopes = Search(function, LOW, HIGH, ('eq',)).gradients(np.array([1.0, 2.0]))
    assert_allclose(values, [4.0, -3.0])
    assert_allclose(slopes, [[2.0, 3.0], [1.0, -2.0]], rtol=1e-9)


def test_constraints_and_bounds_hold():
    """Nearest point to (4, 1) with x + y = 2 and y >= 0.5, x at most 3."""

    def function(x):
        return np.stack([((x - [4, 1]) ** 2).sum(1), x.sum(1) - 2, x[:, 1] - 0.5])

    search = Search(function, LOW, HIGH, ('eq', 'ineq'), 1e-10)
    best = search.run(np.zeros((1, 2)), ((1, 40),))
    assert_allclose(best, [1.5, 0.5], atol=1e-6)
    x, values, stages = search.evaluations()
    steps = stages != GRADIENT
    assert (x[steps] >= LOW).all()
    assert (x[steps] <= HIGH).all()
    assert len(x) == len(stages) == values.shape[1]


def test_many_starts_find_the_lowest_of_several_minima():
    def function(x):
        return (np.cos(5 * x).sum(1) + 0.3 * x.sum(1))[None]

    starts = sobol_points(LOW, HIGH, 64, 0)
    search = Search(function, LOW, HIGH, apart=0.1)
    best = search.run(starts, ((8, 10), (2, 40)))
    axis = np.linspace(-3, 3, 100_001)
    lowest = axis[np.argmin(np.cos(5 * axis) + 0.3 * axis)]
    assert_allclose(best, [lowest, lowest], atol=1e-3)


@pytest.mark.parametrize('gradients', [1, 3])
def test_a_descent_ends_with_its_gradients(gradients):
    search = Search(lambda x: (x**4).sum(1)[None], LOW, HIGH, tolerance=1e-16)
    search.run(np.array([[2.0, -1.0]]), ((1, gradients),))
    assert (search.evaluations()[2] == GRADIENT).sum() == gradients * 4
