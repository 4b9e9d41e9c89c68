"""Lanes: numbers of several vehicles in one value, compiled, and each vehicle alone."""

import os
import subprocess
import sys
from typing import NamedTuple

import numpy as np
import pytest
from helpers.needs import needing
from helpers.strategies import examples
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from auv_dynamics.kernel import LANES
from auv_dynamics.kernel.compile import JITTED, cache_folder, compiled
from auv_dynamics.kernel.lanes import (
    ALIGNMENT,
    anywhere,
    block_count,
    clip,
    empty,
    of_block,
    packed,
    select,
    sqrt,
    unpacked,
)
from auv_dynamics.kernel.six import matvec, vector

WIDE = LANES or 4
SIZES = st.integers(min_value=1, max_value=3 * WIDE + 1)
NUMBERS = np.array([-np.inf, -2.5, -1.0, -0.0, 0.0, 1e-300, 1.0, 2.5, np.inf, np.nan])


@given(SIZES, st.sampled_from([None, 1, 3, WIDE]), st.sampled_from([(), (3,), (2, 5), (0, 4)]))
def test_values_come_back_from_lanes(count, lanes, shape):
    values = np.arange(count * int(np.prod(shape)), dtype=float).reshape(count, *shape)
    blocks = packed(values, lanes)
    assert_array_equal(unpacked(blocks, count, lanes), values)
    assert not np.shares_memory(blocks, values)
    if lanes is None:
        assert blocks.shape == values.shape
        return
    assert blocks.shape == (block_count(count, lanes), *shape, lanes)
    assert blocks.size == 0 or blocks.ctypes.data % ALIGNMENT == 0
    filled = unpacked(blocks, len(blocks) * lanes, lanes)[count:]
    assert_array_equal(filled, np.broadcast_to(values[-1], filled.shape))


def test_memory_begins_at_a_cache_line():
    for shape in ((1,), (3, 5, 7), (0, 4)):
        array = empty(shape)
        assert array.shape == shape
        assert array.dtype == float
        assert array.size == 0 or array.ctypes.data % ALIGNMENT == 0
        assert array.flags.c_contiguous


class Both(NamedTuple):
    """Coefficients of each vehicle and a number that all have."""

    A: np.ndarray
    shared: float


class Table(NamedTuple):
    """What all vehicles have: a leading axis of 1."""

    t: np.ndarray


def chosen(both, table, b, x, out, lanes):
    """All that lanes offer, on x (n,): used compiled and as it is."""
    own = of_block(both, b, lanes)
    t = of_block(table, b, lanes).t
    product = matvec(own.A, vector(x, 0))
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


def fill_blocks(both, table, x, out, lanes):
    for b in range(x.shape[0]):
        chosen(both, table, b, of_block(x, b, lanes), of_block(out, b, lanes), lanes)


@needing('numba', LANES)
@examples(30)
@given(count=SIZES, seed=st.integers(0, 2**32 - 1))
def test_compiled_lanes_do_what_is_done_to_each_vehicle(count, seed):
    """In registers, and compiled for one vehicle after the other, as in plain Python."""
    generator = np.random.default_rng(seed)
    A = generator.normal(size=(count, 36))
    x = np.round(generator.normal(size=(count, 6)), 1)
    table = generator.normal(size=(1, 6))
    negative = np.repeat((packed(x, LANES)[:, 0] < 0).any(axis=1), LANES)[:count]
    for lanes in (LANES, None):
        out = packed(np.zeros((count, 12)), lanes)
        both = Both(packed(A, lanes), 0.25)
        _compiled_blocks()(both, Table(packed(table, lanes)), packed(x, lanes), out, lanes)
        found = unpacked(out, count, lanes)
        for i in range(count):
            expected = np.zeros((1, 12))
            fill_blocks(Both(A[i][None], 0.25), Table(table), x[i][None], expected, None)
            if lanes:
                expected[0, 9] = x[i, 0] != x[i, 1]
                expected[0, 9] += 10 if negative[i] else 0
                expected[0, 9] *= 2 if negative[i] else 1
            np.testing.assert_allclose(found[i], expected[0], rtol=1e-13, atol=1e-14)


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
    assert select(x > 0, 1.0, 2.0) == (1.0 if x > 0 else 2.0)
    assert anywhere(x > 0) == (x > 0)


@needing('numba', JITTED)
def test_compiled_functions_keep_nothing_alive():
    """No references are counted: arrays are freed when their owner lets them go."""

    @compiled
    def first(table):
        return table.t[0]

    table, counts = Table(np.ones(3)), []
    for _ in range(100):
        assert first(table) == 1.0
        counts.append(sys.getrefcount(table.t))
    assert len(set(counts)) == 1


def test_what_all_vehicles_have_is_given_to_every_block():
    shared, own = Table(np.arange(6.0)[None]), Table(np.arange(12.0).reshape(2, 6))
    assert_array_equal(of_block(shared, 1, None).t, np.arange(6.0))
    assert_array_equal(of_block(own, 1, None).t, np.arange(6.0, 12.0))


# found before every other sitecustomize: the module then looks as if it had been deleted
STUB = """
import sys


class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.startswith('auv_dynamics') and name.endswith('.simd'):
            raise ModuleNotFoundError(f'No module named {name!r}', name=name)


sys.meta_path.insert(0, Blocked())
"""
SCRIPT = """
import numpy as np
from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.simulation.rollouts import rollouts
from auv_dynamics.kernel import LANES

scenario = changed_scenario(load_scenario('case1'), {'duration': 0.3})
found = rollouts(scenario, 'gvc', {'controllers.gvc.k_D': [0.9, 1.0, 1.1]})
summary = summarize(simulate(scenario, 'gvc'))
numbers = {
    'rms': [found[f'velocity_error.rms.{dof}'] for dof in ('surge', 'roll', 'yaw')],
    'effort': summary['effort']['rms'], 'energy': summary['kinetic_energy']['mean'],
}
"""
KEPT = """
import sys
assert LANES is None
np.savez(sys.argv[1], **numbers)
"""


@needing('numba', LANES)
def test_everything_runs_without_vector_registers(tmp_path):
    """`simd` is optional: deleted, every vehicle is computed alone, with the same numbers."""
    (tmp_path / 'sitecustomize.py').write_text(STUB)
    here: dict = {}
    exec(SCRIPT, here)
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get('PYTHONPATH')])])
    own = str(cache_folder().parent / 'without_simd')  # its WIDTH is another
    subprocess.run(
        [sys.executable, '-c', SCRIPT + KEPT, str(tmp_path / 'without.npz')],
        env=os.environ | {'PYTHONPATH': path, 'AUV_GVC_CACHE_DIR': own},
        check=True,
    )
    without = np.load(tmp_path / 'without.npz')
    for name, expected in here['numbers'].items():
        np.testing.assert_allclose(without[name], expected, rtol=1e-12)
