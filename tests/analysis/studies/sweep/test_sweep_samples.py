"""What varies in a sweep: distributions, designs and grids, the same however they are asked for."""

import itertools

import numpy as np
import pytest
from helpers.strategies import QUICK
from hypothesis import given, settings
from hypothesis import strategies as st
from SALib.sample import sobol
from scipy import stats
from scipy.stats import qmc

from auv_analysis.studies.sweep import variation
from auv_analysis.studies.sweep.variation import (
    DESIGNS,
    MOST_AT_ONCE,
    axis_values,
    make_distribution,
    make_group,
)
from auv_dynamics.files.errors import InputError

SEED = 7
PATHS = ['a', 'b', 'c']
UNIFORM = {'uniform': {'from': 0.0, 'to': 1.0}}
INSIDE = np.concatenate([[1e-12, 1e-6], np.linspace(0.001, 0.999, 97), [1 - 1e-6]])
QUANTILES = [  # spec, what scipy.stats has for it
    ({'uniform': {'from': -2, 'to': 5}}, stats.uniform(-2, 7)),
    ({'loguniform': {'from': 0.1, 'to': 100}}, stats.loguniform(0.1, 100)),
    ({'normal': {'mean': 3, 'std': 2}}, stats.norm(3, 2)),
    ({'normal': {'mean': 3, 'std': 2, 'from': 2, 'to': 8}}, stats.truncnorm(-0.5, 2.5, 3, 2)),
    ({'normal': {'mean': 3, 'std': 2, 'to': 2}}, stats.truncnorm(-np.inf, -0.5, 3, 2)),
    # whose largest quantile would round to more than 0.7
    (
        {'normal': {'mean': 0.1, 'std': 2, 'from': -4.3, 'to': 0.7}},
        stats.truncnorm(-2.2, 0.3, 0.1, 2),
    ),
    ({'normal': {'mean': 0, 'std': 1, 'from': 9, 'to': 10}}, stats.truncnorm(9, 10)),
    ({'normal': {'mean': 0, 'std': 1, 'from': -10, 'to': -9}}, stats.truncnorm(-10, -9)),
    ({'lognormal': {'median': 4, 'sigma': 0.3}}, stats.lognorm(0.3, scale=4)),
    ({'triangular': {'from': 1, 'mode': 2, 'to': 5}}, stats.triang(0.25, 1, 4)),
    ({'triangular': {'from': 1, 'mode': 1, 'to': 5}}, stats.triang(0.0, 1, 4)),
    ({'triangular': {'from': 1, 'mode': 5, 'to': 5}}, stats.triang(1.0, 1, 4)),
]


def design(kind: str, count: int = 16, seed: int = SEED, number: int = 0, paths=PATHS, **more):
    stream = np.random.SeedSequence(seed, spawn_key=(0, number))
    return DESIGNS[kind](paths, {'count': count, **more}, stream)


def whole(kind: str, **options) -> np.ndarray:
    made = design(kind, **options)
    return made.at(np.arange(made.size))


def stream(number: int = 0) -> np.random.Generator:
    """Random numbers of a group, from the documented key."""
    return np.random.default_rng(np.random.SeedSequence(SEED, spawn_key=(0, number)))


def test_random_numbers_of_many_paths_are_numbers_of_their_own() -> None:
    made = design('random', paths=list('abcdef'))
    every = made.at(np.arange(16))
    assert len(np.unique(every)) == 96
    assert (made.at(np.array([9, 8])) == every[[9, 8]]).all()
    assert (made.at(np.arange(8, 16)) == every[8:]).all()


@pytest.mark.parametrize(('spec', 'reference'), QUANTILES, ids=[str(s) for s, _ in QUANTILES])
def test_quantiles_are_those_of_scipy_stats(spec, reference) -> None:
    quantile = make_distribution(spec).quantile
    np.testing.assert_allclose(quantile(INSIDE), reference.ppf(INSIDE), rtol=1e-9)


def test_lognormal_is_cut_at_its_values() -> None:
    spec = {'lognormal': {'median': 4, 'sigma': 0.5, 'from': 3, 'to': 7}}
    values = make_distribution(spec).quantile(INSIDE)
    low, high = stats.lognorm(0.5, scale=4).cdf([3, 7])
    expected = stats.lognorm(0.5, scale=4).ppf(low + INSIDE * (high - low))
    np.testing.assert_allclose(values, expected, rtol=1e-9)
    assert 3 <= values.min() < values.max() <= 7


@pytest.mark.parametrize('spec', [spec for spec, _ in QUANTILES], ids=str)
def test_quantiles_of_the_ends_are_finite_and_ordered(spec) -> None:
    values = make_distribution(spec).quantile(np.array([0.0, 0.5, 1.0]))
    assert np.isfinite(values).all()
    assert values[0] < values[1] < values[2]
    ((_, given),) = spec.items()
    assert given.get('from', -np.inf) <= values[0]
    assert values[2] <= given.get('to', np.inf)


@pytest.mark.parametrize('name', ['uniform', 'loguniform', 'triangular', 'integers'])
def test_from_a_value_to_itself_there_is_that_value_alone(name: str) -> None:
    mode = {'mode': 3.0} if name == 'triangular' else {}
    found = make_distribution({name: {'from': 3.0, 'to': 3.0, **mode}})
    assert (list(found.quantile(np.array([0.0, 0.4, 1.0]))), found.bounded) == ([3.0] * 3, True)


def test_integers_and_choices_are_equally_likely() -> None:
    u = (np.arange(7000) + 0.5) / 7000
    whole_numbers = make_distribution({'integers': {'from': -3, 'to': 3}}).quantile(u)
    assert whole_numbers.dtype == np.int64
    assert np.unique(whole_numbers, return_counts=True)[1].tolist() == [1000] * 7
    words = make_distribution({'choice': ['p', 'q', 'r', 's', 't', 'u', 'v']}).quantile(u)
    assert [words.count(word) for word in 'pqrstuv'] == [1000] * 7
    for spec in ({'integers': {'from': 1, 'to': 2}}, {'choice': [1, 2]}):
        assert list(make_distribution(spec).quantile(np.array([0.0, 1.0]))) == [1, 2]


@pytest.mark.parametrize('kind', ['random', 'sobol', 'latin_hypercube', 'saltelli', 'morris'])
@settings(QUICK)
@given(data=st.data())
def test_point_depends_on_its_position_alone(kind: str, data: st.DataObject) -> None:
    every = whole(kind)
    made = design(kind)
    for _ in range(3):
        asked = data.draw(st.lists(st.integers(0, made.size - 1), min_size=1, max_size=9))
        assert (made.at(np.array(asked)) == every[asked]).all()


@pytest.mark.parametrize('kind', ['random', 'sobol', 'latin_hypercube', 'saltelli'])
def test_points_follow_from_seed_and_group(kind: str) -> None:
    assert (whole(kind) == whole(kind)).all()
    assert not np.isclose(whole(kind), whole(kind, seed=SEED + 1)).any()
    assert not np.isclose(whole(kind), whole(kind, number=1)).any()


@pytest.mark.parametrize('kind', ['random', 'sobol', 'saltelli'])
def test_streamed_design_is_not_longer_because_more_is_asked_for(kind: str) -> None:
    short, long = whole(kind, count=8), whole(kind, count=32)
    assert (long[: len(short)] == short).all()


def test_random_points_are_uniform_and_independent() -> None:
    points = whole('random', count=20_000)
    for column in points.T:
        assert stats.kstest(column, 'uniform').pvalue > 1e-3
    correlation = np.corrcoef(np.hstack([points[:-1], points[1:]]).T)
    assert np.abs(correlation - np.eye(6)).max() < 0.03
    assert len(np.unique(points)) == points.size


def test_random_points_are_the_middles_of_the_floats_of_philox() -> None:
    key = np.random.SeedSequence(SEED, spawn_key=(0, 2)).generate_state(2, np.uint64)
    floats = np.random.Generator(np.random.Philox(key=key)).random((16, 4))
    assert (whole('random', number=2) == floats[:, :3] + 2.0**-54).all()


def test_sobol_is_the_sequence_of_scipy() -> None:
    expected = qmc.Sobol(3, rng=stream()).random(16)
    assert (whole('sobol') == expected).all()


@pytest.mark.parametrize('second_order', [False, True])
def test_saltelli_is_what_salib_samples(second_order: bool) -> None:
    sample = sobol.sample
    problem = {'num_vars': 3, 'names': PATHS, 'bounds': [[0, 1]] * 3}
    expected = sample(problem, 8, calc_second_order=second_order, seed=stream())
    assert (whole('saltelli', count=8, second_order=second_order) == expected).all()


def test_latin_hypercube_has_one_point_in_every_stratum() -> None:
    strata = np.sort(np.floor(whole('latin_hypercube', count=50) * 50).astype(int), axis=0)
    assert (strata == np.arange(50)[:, None]).all()


def test_morris_changes_one_value_at_a_time() -> None:
    points = whole('morris', count=5, levels=6).reshape(5, 4, 3)
    changed = np.diff(points, axis=1) != 0
    assert (changed.sum(axis=2) == 1).all()
    assert (changed.sum(axis=1) == 1).all()
    np.testing.assert_allclose(points * 5, np.round(points * 5), atol=1e-12)
    usual = whole('morris', count=50)
    np.testing.assert_allclose(np.unique(usual), np.arange(4) / 3)
    assert not np.array_equal(usual, whole('morris', count=50, seed=SEED + 1))


def test_ten_million_points_are_made_where_they_are_asked_for() -> None:
    last = np.arange(10**7 - 3, 10**7)
    random = design('random', count=10**7)
    assert (random.at(last) == random.at(last[::-1])[::-1]).all()
    sequence = qmc.Sobol(3, rng=stream()).fast_forward(10**7 - 3)
    assert (design('sobol', count=10**7).at(last) == sequence.random(3)).all()


def test_grid_and_zip_give_what_is_listed() -> None:
    axes = {'a': [1, 2.5], 'b': ['x', 'y', 'z'], 'c': [True, False]}
    grid = make_group({'grid': axes}, SEED, 0, 'file')
    found = grid.at(np.arange(grid.size))
    rows = list(zip(*(list(found[path]) for path in axes), strict=True))
    assert rows == list(itertools.product(*axes.values()))
    assert list(found) == list(axes), 'columns are in the order of the campaign'
    beside = make_group({'zip': {'a': [1, 2], 'b': [[3.0], [4.0]]}}, SEED, 0, 'file')
    assert beside.at(np.array([1, 0, 1]))['b'] == [[4.0], [3.0], [4.0]]


def test_numbers_are_whole_where_all_of_a_list_are_and_fit() -> None:
    for values, kind in (([3, 2], 'i'), ([3, 2.0], 'f'), ([2**63 - 1, 2], 'i'), ([2**63, 2], 'f'),
                         ([-(2**63), 2], 'f'), ([True, False], 'b')):  # fmt: skip
        found = axis_values(values)
        assert (found.dtype.kind, found.tolist()) == (kind, values)


def test_ranges_have_both_ends() -> None:
    np.testing.assert_allclose(axis_values({'from': 1, 'to': 2, 'count': 5}), 1 + np.arange(5) / 4)
    log = axis_values({'from': 1, 'to': 1000, 'count': 4, 'spacing': 'log'})
    np.testing.assert_allclose(log, [1, 10, 100, 1000])
    same = {'from': -4, 'to': -1, 'count': 3, 'spacing': 'linear'}
    np.testing.assert_allclose(axis_values(same), [-4.0, -2.5, -1.0])
    np.testing.assert_allclose(axis_values(same | {'spacing': 'log'}), [-4.0, -2.0, -1.0])


def test_a_whole_number_may_be_written_as_a_float() -> None:
    group = make_group({'latin_hypercube': {'a': UNIFORM}, 'count': 4.0}, SEED, 0, 'file')
    assert len(np.unique(group.at(np.arange(4))['a'])) == 4


def test_a_design_that_is_made_as_a_whole_is_as_large_as_is_allowed(monkeypatch) -> None:
    monkeypatch.setattr(variation, 'MOST_AT_ONCE', 16 * len(PATHS))
    assert design('latin_hypercube', count=16).size == 16
    with pytest.raises(ValueError, match='at most 16 points of 3 values'):
        design('latin_hypercube', count=17)


def drawn(kind: str = 'random', count: int = 2, **specs) -> dict:
    return {kind: specs, 'count': count}


REFUSED = [  # a group, what its one line says
    ({'zip': {'a': [1, 2], 'b': [1]}}, 'zip: expected as many values of each path, found 2 of a'),
    ({'grid': {'a': [1, 'x']}}, 'vary.2..grid.a: expected values of one kind, found 1 and x'),
    ({'grid': {'a': [[1], [[2]]]}}, 'values of one kind'),
    ({'grid': {'a': [[1, [2]]]}}, 'a list or matrix of numbers'),
    ({'grid': {'a': [[1, float('inf')]]}}, 'finite numbers'),
    ({'grid': {'a': {'from': -1, 'to': 1, 'count': 3, 'spacing': 'log'}}}, 'of one sign for'),
    ({'grid': {'a': {'from': 0, 'to': 1, 'count': 3, 'spacing': 'log'}}}, 'log, found 0 to 1'),
    (drawn(a={'uniform': {'from': 2, 'to': 1}}), 'random.a: expected a number from 2 up in to'),
    (drawn(a={'triangular': {'from': 0, 'mode': 3, 'to': 1}}), 'a mode from 0 to 1, found 3'),
    (drawn(a={'triangular': {'from': 1, 'mode': 0, 'to': 4}}), 'a mode from 1 to 4, found 0'),
    (drawn(a={'normal': {'mean': 5, 'std': 2, 'from': 9, 'to': 3}}), 'found 2 to -1 standard dev'),
    (drawn(a={'normal': {'mean': 0, 'std': 1, 'from': 40, 'to': 41}}), 'probability between'),
    (drawn('morris', a={'normal': {'mean': 0, 'std': 1, 'from': 4}}), 'a: expected from and to'),
    (drawn('morris', a={'normal': {'mean': 0, 'std': 1, 'to': 4}}), 'a: expected from and to'),
    (drawn('latin_hypercube', 6_000_000, a=UNIFORM, b=UNIFORM), 'at most 5000000 points of 2'),
    (drawn('morris', 6_000_000, a=UNIFORM), 'at most 10000000 points'),
    (
        drawn('saltelli', 1, **{f'p{i}': UNIFORM for i in range(10_601)}),
        'saltelli: expected at most 21201 coordinates, found 21202',
    ),
]


@pytest.mark.parametrize(('group', 'words'), REFUSED, ids=[words for _, words in REFUSED])
def test_group_that_makes_no_values_is_refused(group: dict, words: str) -> None:
    assert MOST_AT_ONCE == 10_000_000
    with pytest.raises(InputError, match=words):
        make_group(group, SEED, 2, 'campaign.yaml')
