"""Paired comparisons: ties, losers, and what Holm and Wilcoxon give by hand."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.tunings import GVC, SAME_CL, scenario
from scipy.stats import binomtest, rankdata

from auv_analysis.studies.pairs import MOST, NEVER, holm, log_ratios, paired
from auv_analysis.studies.tune.cost import Measures
from auv_analysis.studies.tune.perturbations import Spread, monte_carlo
from auv_analysis.studies.tune.results import COMPARED, _deviation, _distribution, compare


def measures(values: np.ndarray) -> Measures:
    return Measures(*([np.asarray(values, float)] * len(Measures._fields)))


def test_laws_that_are_one_on_a_diagonal_M_tie_in_every_draw(tmp_path) -> None:
    """GVC with k_D, Gamma is CL with k_D M, Gamma M: no draw may tell them apart."""
    same = scenario(tmp_path, {'gvc': GVC, 'cl': SAME_CL})
    found = monte_carlo(same, Spread(), 20, 0, 'continuous', 1)
    for row in compare(found, [('cl', 'gvc')]):
        assert (row.smaller, row.larger, row.p, row.p_holm, row.verdict) == (0, 0, 1, 1, 0)
        assert row.ratio == 1.0
    assert len(set(found['gvc'].error.tolist())) == 20


def test_laws_that_differ_do_not_tie(tmp_path) -> None:
    other = scenario(tmp_path, {'gvc': GVC, 'cl': SAME_CL | {'k_D': 300.0}})
    found = monte_carlo(other, Spread(), 20, 0, 'continuous', 1)
    rows = {row.measure: row for row in compare(found, [('cl', 'gvc')])}
    assert rows['error'].verdict != 0
    assert rows['error'].p_holm < 1e-3


def test_ratio_and_shares_turn_round_with_the_pair() -> None:
    rng = np.random.default_rng(0)
    a, b = measures(np.exp(rng.normal(0.1, 0.2, 80))), measures(np.exp(rng.normal(0.0, 0.2, 80)))
    there, back = compare({'a': a, 'b': b}, [('a', 'b'), ('b', 'a')])[:: len(COMPARED)]
    assert there.ratio == pytest.approx(1 / back.ratio)
    assert (there.smaller, there.larger) == (back.larger, back.smaller)
    assert there.p == back.p
    assert there.verdict == -back.verdict == 1
    assert there.interval[0] < there.ratio < there.interval[1]
    assert there.interval[0] == pytest.approx(1 / back.interval[1])


def test_the_loser_is_behind_though_it_is_smaller_in_most_draws() -> None:
    """Slightly smaller in 60 draws, much larger in 40: the signed-rank sum is for the other."""
    d = np.concatenate([np.linspace(-0.02, -0.01, 60), np.linspace(0.5, 0.6, 40)])
    a, b = measures(np.exp(d)), measures(np.ones(100))
    row = compare({'a': a, 'b': b}, [('a', 'b')])[0]
    assert row.smaller > row.larger
    assert row.p_holm < 0.05 or row.p < 0.05
    assert np.sign(row.effect) == 1
    assert 1 < row.interval[0] < row.ratio < row.interval[1]
    assert paired(d).p == row.p


@pytest.mark.parametrize('decimals', [1, 16])
@pytest.mark.parametrize('n', [1, 2, 4, 5, 9, 60])
def test_effect_and_ratio_by_their_definitions(n: int, decimals: int) -> None:
    d = np.random.default_rng(n).normal(0.1, 0.3, n).round(decimals)
    found, ranks, (i, j) = paired(d), rankdata(np.abs(d)), np.triu_indices(n)
    assert found.effect == pytest.approx((np.sign(d) * ranks).sum() / ranks.sum())
    assert np.log(found.ratio) == pytest.approx(np.median((d[i] + d[j]) / 2), abs=1e-12)
    assert (found.interval is None) == (n < 5), 'of so few no ratio is rejected'
    if n == 60:
        outside = [paired(d - np.log(end) * far) for end in found.interval for far in (0.9, 1.1)]
        assert sorted(other.p < 0.05 for other in outside) == [False, False, True, True]


def test_of_very_many_pairs_quantiles_stand_for_all() -> None:
    d = np.random.default_rng(0).normal(0.1, 0.3, 3 * MOST + 1)
    found = paired(d, test=False)
    assert np.log(found.ratio) == pytest.approx(np.median(d[1:] + d[:-1]) / 2, abs=0.005)
    # 1.96 of the standard deviation of the Hodges-Lehmann estimate, sigma sqrt(pi / 3 n)
    half = np.log(found.interval[1] / found.interval[0]) / 2
    assert half == pytest.approx(1.96 * 0.3 * np.sqrt(np.pi / 3 / len(d)), rel=0.05)


def test_wilcoxon_is_that_of_signs_where_all_differences_are_of_one_sign() -> None:
    b = measures(np.arange(1, 11))
    distinct = measures(np.arange(1, 11) * np.linspace(0.4, 0.6, 10))
    row = compare({'a': distinct, 'b': b}, [('a', 'b')])[0]
    assert (row.ratio, row.smaller) == (pytest.approx(0.5, rel=0.01), 1.0)
    assert row.p == pytest.approx(binomtest(0, 10).pvalue)  # 2 / 2^10


def test_what_diverged_is_larger_and_both_diverged_tie() -> None:
    a, b = (
        measures([np.nan, np.nan, 1.0, np.inf, 2.0]),
        measures([1.0, np.nan, np.nan, np.inf, 2.0]),
    )
    np.testing.assert_array_equal(log_ratios(a.error, b.error), [NEVER, 0, -NEVER, 0, 0])
    row = compare({'a': measures([np.nan] * 20), 'b': measures([1.0] * 20)}, [('a', 'b')])[0]
    assert (row.ratio, row.interval, row.larger, row.verdict) == (None, None, 1.0, 1)


def test_measure_that_no_loop_has_is_not_compared() -> None:
    short = measures([1.0, 2.0])._replace(late_error=np.full(2, np.nan))
    rows = compare({'a': short, 'b': short}, [('a', 'b')])
    assert [row.measure for row in rows] == [m for m in COMPARED if m != 'late_error']


def test_a_difference_is_called_one_below_five_percent() -> None:
    a, b = measures(np.linspace(2.0, 3.0, 20)), measures(np.ones(20))
    row = compare({'a': a, 'b': b}, [('a', 'b')])[0]
    for p, verdict in ((0.0499, 1), (0.05, 0)):
        assert replace(row, p_holm=p).verdict == verdict
        assert replace(row, p_holm=p, effect=-0.5).verdict == -verdict


def test_quantiles_of_draws_put_what_diverged_or_never_settles_last() -> None:
    values = [*np.arange(1.0, 18.0), np.nan, np.nan, np.nan]
    draws = measures(np.random.default_rng(0).permutation(values))
    settling = np.where(np.arange(20) < 5, np.inf, 2.0)
    found = _distribution(draws._replace(settling=settling))
    assert (found['diverged'], found['settled']) == (0.15, 0.75)
    # the smallest value at or above which that part of the 19 steps between 20 draws lies
    assert found['error'] == {'q05': 2.0, 'q25': 6.0, 'median': 11.0, 'q75': 16.0, 'q95': np.inf}
    assert (found['settling']['q75'], found['settling']['q95']) == (np.inf, np.inf)
    assert found['settling']['median'] == 2.0


@pytest.mark.parametrize(
    ('a', 'b', 'apart'),
    [(2.0, 2.0, 0.0), (-4.0, -5.0, 0.2), (5.0, 4.0, 0.2), (np.nan, np.nan, 0.0),
     (np.inf, np.inf, 0.0), (np.nan, 1.0, np.inf), (1.0, np.inf, np.inf), (0.0, 0.0, 0.0)],
)  # fmt: skip
def test_how_far_a_single_run_is_from_the_batch(a: float, b: float, apart: float) -> None:
    assert _deviation(a, b) == pytest.approx(apart)


def test_rounding_is_a_tie() -> None:
    a, b = measures([1.0 + 1e-12, 1.0 - 1e-12]), measures([1.0, 1.0])
    assert not np.any(log_ratios(a.error, b.error))


def test_holm_by_hand() -> None:
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm([0.5, 0.9]) == pytest.approx([1.0, 1.0])
    assert holm([]) == []
