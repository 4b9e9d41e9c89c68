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


def test_what_violates_a_constraint_is_added_to_the_objective():
    search = Search(lambda x: x.T, LOW, HIGH, ('eq', 'ineq'))
    values = np.array([[1.0, 1.0, 1.0, 1.0], [0.0, -2.0, 0.5, 0.0], [0.0, 3.0, -1.0, -0.5]])
    assert_allclose(search.merit(values, 10.0), [1.0, 21.0, 16.0, 6.0])
    assert_allclose(Search(lambda x: x.T, LOW, HIGH).merit(values[:1], 10.0), 1.0)


def test_of_starts_next_to_each_other_the_best_is_taken():
    search = Search(lambda x: x.T, LOW, HIGH, apart=0.1)  # 0.6 in each coordinate
    x = np.array([[2.0, 2.0], [0.5, 0.7], [0.5, 0.5], [0.0, 0.0]])
    assert search._chosen(x, np.array([4.0, 3.0, 2.0, 1.0]), 3) == [3, 1, 0]
    assert search._chosen(x, np.array([4.0, 3.0, 2.0, 1.0]), 2) == [3, 1]
    assert search._chosen(x, np.array([1.0, 2.0, 2.0, 2.0]), 9) == [0, 1, 3], 'the first of equals'


def test_a_point_of_a_gradient_is_not_taken_for_the_best():
    search = Search(lambda x: x.T, np.zeros(1), np.ones(1))
    search.evaluate(np.array([[0.5], [0.1], [0.7]]), ['refine', GRADIENT, 'global'])
    assert search._best_since(0).tolist() == [0.5]
    search.evaluate(np.array([[0.9]]), ['refine'])
    assert search._best_since(1).tolist() == [0.9]
