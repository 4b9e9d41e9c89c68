"""Names of the groups of a varied value."""

import numpy as np

from auv_analysis.studies.sweep.dataset import _labels


def test_neighbours_have_names_of_their_own_however_near_they_are() -> None:
    edges = np.linspace(13.4, 13.6, 11)
    labels = _labels(np.stack([edges[:-1], edges[1:]], axis=1))
    assert len({*labels}) == 10
    assert labels[0] == '13.4–13.42'


def test_names_are_short_where_that_is_enough() -> None:
    assert _labels(np.array([[1.0, 1.0], [2.5, 2.5]])) == ['1', '2.5']
    assert _labels(np.array([[0.0, 1.0], [1.0, 2.0]])) == ['0–1', '1–2']
