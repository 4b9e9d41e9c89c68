"""Paired comparisons: ties, losers, and what Holm and Wilcoxon give by hand."""

import numpy as np
import pytest
from scipy.stats import binomtest
from tunings import GVC, SAME_CL, scenario

from auv_analysis.tuning.comparison import COMPARED, DIVERGED, compare, holm, log_ratios
from auv_analysis.tuning.draws import Spread
from auv_analysis.tuning.measures import Measures
from auv_analysis.tuning.monte_carlo import monte_carlo


def measures(values: np.ndarray) -> Measures:
    return Measures(*([np.asarray(values, float)] * len(Measures._fields)))


def test_laws_that_are_one_on_a_diagonal_M_tie_in_every_draw(tmp_path) -> None:
    """GVC with k_D, Gamma is CL with k_D M, Gamma M: no draw may tell them apart."""
    same = scenario(tmp_path, {'gvc': GVC, 'cl': SAME_CL})
    found = monte_carlo(same, Spread(), 20, 0, 'continuous', 1)
    for row in compare(found, [('cl', 'gvc')], 0):
        assert (row.smaller, row.larger, row.p, row.p_holm, row.verdict) == (0, 0, 1, 1, 0)
        assert row.median == 1.0
    assert len(set(found['gvc'].error.tolist())) == 20


def test_laws_that_differ_do_not_tie(tmp_path) -> None:
    other = scenario(tmp_path, {'gvc': GVC, 'cl': SAME_CL | {'k_D': 300.0}})
    found = monte_carlo(other, Spread(), 20, 0, 'continuous', 1)
    rows = {row.measure: row for row in compare(found, [('cl', 'gvc')], 0)}
    assert rows['error'].verdict != 0
    assert rows['error'].p_holm < 1e-3


def test_ratio_and_shares_turn_round_with_the_pair() -> None:
    rng = np.random.default_rng(0)
    a, b = measures(np.exp(rng.normal(0.1, 0.2, 80))), measures(np.exp(rng.normal(0.0, 0.2, 80)))
    there, back = compare({'a': a, 'b': b}, [('a', 'b'), ('b', 'a')], 0)[:: len(COMPARED)]
    assert there.median == pytest.approx(1 / back.median)
    assert (there.smaller, there.larger) == (back.larger, back.smaller)
    assert there.p == back.p
    assert there.verdict == -back.verdict == 1
    assert there.interval[0] < there.median < there.interval[1]
    assert there.interval[0] == pytest.approx(1 / back.interval[1], rel=0.05)


def test_wilcoxon_is_that_of_signs_where_all_differences_are_of_one_sign() -> None:
    b = measures(np.arange(1, 11))
    distinct = measures(np.arange(1, 11) * np.linspace(0.4, 0.6, 10))
    row = compare({'a': distinct, 'b': b}, [('a', 'b')], 0)[0]
    assert (row.median, row.smaller) == (pytest.approx(0.5, rel=1e-3), 1.0)
    assert row.p == pytest.approx(binomtest(0, 10).pvalue)  # 2 / 2^10


def test_what_diverged_is_larger_and_both_diverged_tie() -> None:
    a, b = (
        measures([np.nan, np.nan, 1.0, np.inf, 2.0]),
        measures([1.0, np.nan, np.nan, np.inf, 2.0]),
    )
    np.testing.assert_array_equal(log_ratios(a, b, 'error'), [DIVERGED, 0, -DIVERGED, 0, 0])
    row = compare({'a': measures([np.nan] * 12), 'b': measures([1.0] * 12)}, [('a', 'b')], 0)[0]
    assert (row.median, row.interval, row.larger, row.verdict) == (None, None, 1.0, 1)


def test_measure_that_no_loop_has_is_not_compared() -> None:
    short = measures([1.0, 2.0])._replace(late_error=np.full(2, np.nan))
    rows = compare({'a': short, 'b': short}, [('a', 'b')], 0)
    assert [row.measure for row in rows] == [m for m in COMPARED if m != 'late_error']


def test_rounding_is_a_tie() -> None:
    a, b = measures([1.0 + 1e-12, 1.0 - 1e-12]), measures([1.0, 1.0])
    assert not np.any(log_ratios(a, b, 'error'))


def test_holm_by_hand() -> None:
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm([0.5, 0.9]) == pytest.approx([1.0, 1.0])
    assert holm([]) == []
