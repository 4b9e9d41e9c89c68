"""Lanes: numbers of several vehicles in one value, compiled and as NumPy arrays."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from auv_dynamics.kernel.compile import JITTED, compiled, plain
from auv_dynamics.kernel.lanes import (
    ALIGNMENT,
    LANES,
    anywhere,
    clip,
    empty,
    of_block,
    packed,
    select,
    sqrt,
    uncounted,
    unpacked,
    width,
)
from auv_dynamics.kernel.six import (
    mul,
    upper,
    upper_T,
    vector,
)

SIZES = st.integers(min_value=1, max_value=3 * LANES + 1)
NUMBERS = np.array([-np.inf, -2.5, -1.0, -0.0, 0.0, 1e-300, 1.0, 2.5, np.inf, np.nan])


@given(SIZES, st.sampled_from([1, 3, LANES]), st.sampled_from([(), (3,), (2, 5), (0, 4)]))
def test_values_come_back_from_lanes(count, lanes, shape):
    values = np.arange(count * int(np.prod(shape)), dtype=float).reshape(count, *shape)
    blocks = packed(values, lanes)
    assert blocks.shape == (-(-count // lanes), *shape, lanes)
    assert blocks.size == 0 or blocks.ctypes.data % ALIGNMENT == 0
    assert_array_equal(unpacked(blocks, count), values)
    filled = unpacked(blocks, len(blocks) * lanes)[count:]
    assert_array_equal(filled, np.broadcast_to(values[-1], filled.shape))


def test_memory_begins_at_a_cache_line():
    for shape in ((1,), (3, 5, 7), (0, 4)):
        array = empty(shape)
        assert array.shape == shape
        assert array.dtype == float
        assert array.size == 0 or array.ctypes.data % ALIGNMENT == 0
        assert array.flags.c_contiguous


def test_width_of_the_lanes():
    assert width(100) == (LANES if JITTED else 100)


class Both(NamedTuple):
    """Coefficients of each vehicle and a number that all have."""

    A: np.ndarray
    shared: float


class Table(NamedTuple):
    """What all vehicles have."""

    t: np.ndarray


class SharedTable(Table):
    """The same, and says so."""

    SHARED = True


def chosen(both, table, b, x, out):
    """All that lanes offer, on x (n,): used compiled and as it is."""
    own = of_block(both, b)
    t = uncounted(of_block(table, b)).t
    product = mul(own.A, vector(x, 0))
    for i in range(6):
        out[i] = select(x[i] > t[i], product[i], -x[i]) / 2.0 + abs(x[i]) * own.shared
    out[6] = clip(x[0], -1.0, 1.0)
    out[7] = select(x[0] >= x[1], sqrt(abs(x[2])), 3)
    out[8] = select(x[0] <= x[1], 1.0, 0.0) + select(x[0] == x[1], 2.0, 0.0)
    out[9] = select(x[0] != x[1], 1.0, 0.0)
    if anywhere(x[0] < 0.0):
        out[9] += 10.0
        out[9] *= 2
    rest = x[2:]
    out[10] = rest[0] - rest[1]
    total = 0.0
    for i in range(6):
        total += x[i]
    out[11] = total


def fill_blocks(both, table, x, out):
    for b in range(x.shape[0]):
        chosen(both, table, b, of_block(x, b), of_block(out, b))


@pytest.mark.skipif(not JITTED, reason='needs numba')
@given(count=SIZES, seed=st.integers(0, 2**32 - 1))
def test_compiled_lanes_do_what_numpy_does_for_each_vehicle(count, seed):
    generator = np.random.default_rng(seed)
    A = generator.normal(size=(count, 36))
    x = np.round(generator.normal(size=(count, 6)), 1)
    table = SharedTable(generator.normal(size=6))
    out = packed(np.zeros((count, 12)), LANES)
    _compiled_blocks()(Both(packed(A, LANES), 0.25), table, packed(x, LANES), out)
    found = unpacked(out, count)
    negative = np.repeat((packed(x, LANES)[:, 0] < 0).any(axis=1), LANES)[:count]
    for i in range(count):
        expected = np.zeros(12)
        chosen(Both(A[i][None], 0.25), table, 0, x[i], expected)
        expected[9] = x[i, 0] != x[i, 1]
        expected[9] = (expected[9] + 10) * 2 if negative[i] else expected[9]
        np.testing.assert_allclose(found[i], expected, rtol=1e-13, atol=1e-14)


def _compiled_blocks(known=[]):  # noqa: B006  compiled once
    if not known:
        import numba

        numba.extending.register_jitable(chosen)
        known.append(numba.njit(fill_blocks))
    return known[0]


@pytest.mark.parametrize('x', NUMBERS)
def test_choices_of_single_numbers(x):
    for low, high in ((-1.0, 1.0), (0.0, 2.5)):
        expected = x if np.isnan(x) else min(max(x, low), high)
        np.testing.assert_equal(clip(x, low, high), expected)
        assert_array_equal(plain(clip)(np.array([x, 0.5]), low, high), [expected, 0.5])
    assert select(x > 0, 1.0, 2.0) == (1.0 if x > 0 else 2.0)
    assert_array_equal(select(np.array([x > 0, True]), 1.0, 2.0), [1.0 if x > 0 else 2.0, 1.0])
    assert anywhere(np.array([x > 0, False])) == (x > 0)


@given(seed=st.integers(0, 2**32 - 1))
def test_lanes_of_the_decomposition(seed):
    """U x and U^T x of lanes are those of each vehicle."""
    generator = np.random.default_rng(seed)
    U = np.triu(generator.normal(size=(5, 6, 6)), 1) + np.eye(6)
    x = generator.normal(size=(5, 6))
    lanes = packed(U.reshape(5, 36), 5)[0]
    for product, matrices in ((upper, U), (upper_T, np.swapaxes(U, 1, 2))):
        found = np.array(plain(product)(lanes, tuple(x.T))).T
        np.testing.assert_allclose(found, np.einsum('bij,bj->bi', matrices, x), rtol=0, atol=1e-12)


@pytest.mark.skipif(not JITTED, reason='needs numba')
def test_compiled_functions_keep_nothing_alive():
    """Arrays that are seen uncounted are freed when their owner lets them go."""
    import sys

    @compiled
    def first(table):
        return uncounted(table).t[0]

    table, counts = Table(np.ones(3)), []
    for _ in range(100):
        assert first(table) == 1.0
        counts.append(sys.getrefcount(table.t))
    assert len(set(counts)) == 1


def test_what_is_shared_is_given_to_every_block_as_it_is():
    shared, own = SharedTable(np.arange(12.0)), Table(np.arange(12.0).reshape(2, 6))
    assert of_block(shared, 1) is shared
    assert_array_equal(of_block(own, 1).t, np.arange(6.0, 12.0))
