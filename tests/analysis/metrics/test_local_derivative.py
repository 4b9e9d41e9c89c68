"""Which samples a derivative takes: the nine nearest, and none beyond the ends."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from auv_analysis.metrics.certificate import derivative


@pytest.mark.parametrize('n', [9, 10, 14, 21])
def test_a_rate_depends_on_the_nine_nearest_samples_only(n):
    t = 0.1 * np.arange(n)
    used = np.array([np.abs(derivative(t, spike)) > 1e-9 for spike in np.eye(n)]).T
    for here in range(n):
        first = min(max(here - 4, 0), n - 9)
        expected = np.zeros(n, bool)
        expected[first : first + 9] = True
        if first == here - 4:
            expected[here] = False  # a central formula does not take its own sample
        assert_array_equal(used[here], expected)
