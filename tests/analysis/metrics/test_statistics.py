"""Statistics of a run in parts are those of the whole."""

import numpy as np
from helpers.strategies import examples
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis.metrics.statistics import Statistics, followed, part_of


@given(seed=st.integers(0, 99), n=st.integers(2, 50), cut=st.integers(1, 49))
@examples(15)
def test_parts_follow_one_another(seed, n, cut) -> None:
    t, values = np.arange(n) / 10, np.random.default_rng(seed).normal(size=(n, 3)).round(1)
    cut = min(cut, n - 1)
    whole = part_of(t, values)
    found = followed(part_of(t[:cut], values[:cut]), part_of(t[cut:], values[cut:]))
    for name in ('count', 'first', 'last', 'low', 'high', 'peak', 'at'):
        assert_array_equal(getattr(found, name), getattr(whole, name))
    for name in ('sums', 'squares', 'path', 'mean', 'rms', 'span'):
        assert_allclose(getattr(found, name), getattr(whole, name), rtol=1e-12, atol=1e-12)
    assert whole.at.tolist() == [t[i] for i in np.abs(values).argmax(axis=0)]
    assert_allclose(whole.path, np.abs(np.diff(values, axis=0)).sum(axis=0))
    ends = values[0], values[-1], values.min(axis=0), values.max(axis=0)
    assert_array_equal([whole.first, whole.last, whole.low, whole.high], ends)
    means = values.mean(axis=0), np.sqrt((values**2).mean(axis=0)), np.ptp(values, axis=0)
    assert_allclose([whole.mean, whole.rms, whole.span], means, atol=1e-12)
    some = whole.of(slice(1, 3))
    assert (some.count, some.path.tolist()) == (n, whole.path[1:].tolist())


def test_statistics_between_cuts() -> None:
    t, values = np.arange(10.0), np.arange(10.0)[:, None]
    statistics = Statistics([2.5, 7.0])
    for i in range(0, 10, 4):
        statistics.add(t[i : i + 4], values[i : i + 4])
    assert statistics.between(2.5, 7.0).sums == 3 + 4 + 5 + 6
    assert statistics.between(7.0).count == 3
    assert statistics.between(None, 2.5).high == 2
    assert Statistics([1.0]).between() is None
