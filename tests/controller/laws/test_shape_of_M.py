"""What may be decomposed: six by six and finite, nothing smaller or larger."""

import numpy as np
import pytest

from auv_gvc_controller.laws.model import decompose


@pytest.mark.parametrize('shape', [(5, 5), (7, 7), (6, 7), (7, 6), (5, 6), (6, 5), (6,), (2, 5, 6)])
def test_another_shape_is_refused(shape):
    M = np.eye(*shape) if len(shape) == 2 else np.ones(shape)
    with pytest.raises(ValueError, match='expected a finite'):
        decompose(M)


@pytest.mark.parametrize('bad', [np.nan, np.inf])
@pytest.mark.parametrize('i', range(6))
def test_one_entry_that_is_not_finite_is_refused(i, bad):
    M = np.eye(6)
    M[i, i] = bad
    with pytest.raises(ValueError, match='expected a finite'):
        decompose(M)
