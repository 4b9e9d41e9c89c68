"""Groups of the values that vary, and the names of both."""

from types import SimpleNamespace as Made

import numpy as np
import pyarrow as pa
import pytest

from auv_analysis.studies.sweep.dataset import (
    _categories,
    _groups,
    _labels,
    cut,
    short_names,
    with_unit,
)


def test_neighbours_have_names_of_their_own_however_near_they_are() -> None:
    edges = np.linspace(13.4, 13.6, 11)
    labels = _labels(np.stack([edges[:-1], edges[1:]], axis=1))
    assert len({*labels}) == 10
    assert labels[0] == '13.4–13.42'


def test_names_are_short_where_that_is_enough() -> None:
    assert _labels(np.array([[1.0, 1.0], [2.5, 2.5]])) == ['1', '2.5']
    assert _labels(np.array([[0.0, 1.0], [1.0, 2.0]])) == ['0–1', '1–2']
    assert _labels(np.array([[1.23456, 1.23456], [2.0, 3.0]])) == ['1.23456', '2–3']


def test_twelve_numbers_are_groups_and_more_are_bins_of_as_many_rows() -> None:
    numbers = np.tile(np.arange(12.0)[::-1], 100)
    codes, edges, binned = _groups(numbers)
    assert (codes.tolist(), binned) == (numbers.tolist(), False)
    assert edges.tolist() == [[k, k] for k in range(12)]
    for count, bins in ((13, [[0, 5], [6, 12]]), (41, [[0, 13], [14, 26], [27, 40]])):
        codes, edges, binned = _groups(np.arange(float(count))[::-1])
        assert (edges.tolist(), binned) == (bins, True)
        expected = [k for k, (low, high) in enumerate(bins) for _ in range(low, high + 1)]
        assert codes.tolist() == expected[::-1]
    assert len(_groups(np.arange(1e4))[1]) == 16


def test_numbers_that_differ_after_a_thousand_rows_are_bins_as_well() -> None:
    codes, edges, binned = _groups(np.append(np.zeros(1000), np.arange(1.0, 201.0)))
    assert (binned, edges[0].tolist()) == (True, [0.0, 50.0])  # of ties no bin is empty
    assert not codes[:1000].any()
    assert edges[-1, 1] == 200.0
    assert set(codes) == set(range(len(edges)))


def test_words_are_groups_in_the_order_of_their_appearance() -> None:
    words = ['b', '1' * 39, 'b', '1' * 70]
    codes, labels = _categories(pa.chunked_array([words[:3], words[3:]]))
    assert codes.tolist() == [0, 1, 0, 2]
    assert labels[:2] == ['b', '1' * 39]
    assert len(labels[2]) <= 60
    codes, labels = _categories(pa.chunked_array([[[2.0], [1.0, 3.0]], [[2.0]]]))
    assert (codes.tolist(), labels) == ([0, 1, 0], ['[2.0]', '[1.0, 3.0]'])
    matrices = [np.diag([12.0, 12.0, k, 12.0, 12.0, 12.0]).tolist() for k in (1.0, 2.0)]
    codes, labels = _categories(pa.chunked_array([[*matrices, [[3.0]]]]))
    assert [label[:4] for label in labels] == ["1: '", "2: '", '[[3.'], 'which differ in the middle'
    codes, labels = _categories(pa.chunked_array([[True, False, True]]))
    assert (codes.tolist(), labels) == ([0, 1, 0], ['True', 'False'])


def test_paths_are_named_without_where_they_are_from_as_long_as_they_differ() -> None:
    paths = ('controllers.*.k_D', 'controllers.gvc.k_I', 'vehicle.damping.linear[0]', 'duration',
             'setpoint.surge.offset', 'vehicle.name', 'setpoint.name')  # fmt: skip
    assert list(short_names([Made(path=path) for path in paths]).values()) == [
        'k_D', 'gvc.k_I', 'damping.linear[0]', 'duration', 'surge.offset', 'vehicle.name',
        'setpoint.name',
    ]  # fmt: skip


@pytest.mark.parametrize(
    ('unit', 'label'), [('', 'k'), ('kg', 'k (kg)'), (14 * 'm', f'k ({14 * "m"})'), (15 * 'm', 'k')]
)
def test_an_axis_has_room_for_a_short_unit(unit: str, label: str) -> None:
    assert with_unit('k', Made(unit=unit)) == label


def test_a_value_that_is_too_long_for_an_axis_is_cut() -> None:
    assert cut('x' * 18) == 'x' * 18
    assert cut('x' * 19) == 'x' * 16 + '…'
