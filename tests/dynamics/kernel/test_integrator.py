"""Fixed-step integrators: what makes a tableau one of its order, and times on the grid."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics.kernel.integrator import TABLEAUS, stage_times

ORDERS = {'euler': 1, 'rk4': 4, 'ode5': 5}


# a rooted tree is the tuple of its subtrees; all of them by their number of nodes
TREES: dict[int, list[tuple]] = {
    1: [()],
    2: [((),)],
    3: [((), ()), (((),),)],
    4: [((), (), ()), ((), ((),)), (((), ()),), ((((),),),)],
    5: [
        ((), (), (), ()), ((), (), ((),)), (((),), ((),)), ((), ((), ())), (((), (), ()),),
        ((), (((),),)), (((), ((),)),), ((((), ()),),), (((((),),),),),
    ],
}  # fmt: skip


def nodes(tree: tuple) -> int:
    return 1 + sum(map(nodes, tree))


def density(tree: tuple) -> int:
    return nodes(tree) * int(np.prod([density(branch) for branch in tree]))


def weights(A: np.ndarray, tree: tuple) -> np.ndarray:
    """Elementary weights of the stages (s,): b times them is 1 / density for the order to hold."""
    product = np.ones(len(A))
    for branch in tree:
        product = product * (A @ weights(A, branch))
    return product


def holds(name: str, order: int) -> list[bool]:
    A, b, _ = TABLEAUS[name]
    return [abs(b @ weights(A, tree) * density(tree) - 1.0) < 1e-13 for tree in TREES[order]]


def test_the_trees_are_all_there_are():
    for order, trees in TREES.items():
        assert {nodes(tree) for tree in trees} == {order}
        assert len(set(trees)) == {1: 1, 2: 1, 3: 2, 4: 4, 5: 9}[order]


@pytest.mark.parametrize('name', ORDERS)
def test_tableau_conditions(name):
    A, _, c = TABLEAUS[name]
    assert_array_equal(A, np.tril(A, -1))  # explicit
    assert_allclose(A.sum(axis=1), c)
    for order in range(1, ORDERS[name] + 1):  # Butcher's condition of every tree
        assert all(holds(name, order)), order
    if ORDERS[name] < 5:
        assert not all(holds(name, ORDERS[name] + 1))


def test_ode5_is_dormand_and_prince_without_the_last_stage():
    tableau = TABLEAUS['ode5']
    assert_allclose(tableau.c, [0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1], atol=1e-14)
    assert tableau.b.shape == (6,)


def test_times_are_never_accumulated():
    step, last = 0.01, 1_000_000
    accumulated = np.cumsum(np.full(last, step))[-1]
    for name in ORDERS:
        times = stage_times(TABLEAUS[name], step, last, 2)
        assert times.shape == (2, len(TABLEAUS[name].b))
        assert times[0, 0] == last * step
        assert times[1, 0] == (last + 1) * step
        assert_allclose(times[0], (last + TABLEAUS[name].c) * step, rtol=1e-15)
    assert accumulated != last * step  # what the test would miss if times were summed


def test_stage_times_do_not_depend_on_where_a_block_begins():
    tableau = TABLEAUS['ode5']
    whole = stage_times(tableau, 0.01, 0, 600)
    assert_array_equal(stage_times(tableau, 0.01, 256, 40), whole[256:296])
