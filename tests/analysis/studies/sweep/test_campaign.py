"""Campaign files: what is taken, how rollouts are numbered and seeded, what is refused."""

import itertools
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.strategies import QUICK
from hypothesis import example, given, settings
from hypothesis import strategies as st

from auv_analysis.studies.sweep.campaign import (
    Campaign,
    concerns,
    first_words,
    load_campaign,
    of_controller,
)
from auv_dynamics.files.errors import InputError

SOURCE = """
name: mixed
scenario: case1
seed: 5
vary:
  - grid:
      controllers.*.k_D: [6, 12.0]
      vehicle: [herman2018, rexrov]
  - zip:
      setpoint.surge.offset: [0.1, 0.2, 0.3]
      controllers.gvc.k_I: {from: 1, to: 100, count: 3, spacing: log}
  - random:
      vehicle.rigid_body.mass: {normal: {mean: 250, std: 2}}
    count: 4
  - sobol:
      vehicle.damping.linear[0]: {uniform: {from: 50, to: 90}}
      initial.nu[2]: {uniform: {from: -1, to: 1}}
    count: 8
"""


def written(folder: Path, text: str = SOURCE) -> Path:
    path = folder / 'campaign.yaml'
    path.write_text(text)
    return path


@pytest.fixture(scope='module')
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    return load_campaign(written(tmp_path_factory.mktemp('campaign')))


def same(a: dict, b: dict) -> bool:
    return list(a) == list(b) and all(list(a[path]) == list(b[path]) for path in a)


def test_every_combination_of_the_groups_is_a_rollout(mixed: Campaign) -> None:
    assert mixed.rollouts == 4 * 3 * 4 * 8
    values = mixed.values(0, mixed.rollouts)
    listed = list(zip(values['controllers.*.k_D'], values['vehicle'],
                      values['setpoint.surge.offset'], strict=True))  # fmt: skip
    grid = itertools.product([6, 12.0], ['herman2018', 'rexrov'], [0.1, 0.2, 0.3])
    assert listed[:: 4 * 8] == list(grid)
    np.testing.assert_allclose(values['controllers.gvc.k_I'][:96:32], [1, 10, 100])
    drawn = values['vehicle.rigid_body.mass'].reshape(12, 4, 8)
    assert (drawn == drawn[:1, :, :1]).all()  # all combinations of the others see the same draws
    assert len(np.unique(drawn)) == 4
    swept = values['vehicle.damping.linear[0]'].reshape(48, 8)
    assert (swept == swept[0]).all()
    assert len(np.unique(swept)) == 8


@settings(QUICK)
@given(st.lists(st.integers(0, 384), min_size=1, max_size=6))
def test_values_and_seeds_do_not_depend_on_the_blocks(mixed: Campaign, cuts: list[int]) -> None:
    values, seeds = mixed.values(0, 384), mixed.seeds(0, 384)
    for first, last in itertools.pairwise(sorted({0, *cuts, 384})):
        part = mixed.values(first, last)
        assert same(part, {path: column[first:last] for path, column in values.items()})
        assert (mixed.seeds(first, last) == seeds[first:last]).all()


def word_of(root: int, index: int) -> int:
    sequence = np.random.SeedSequence(root, spawn_key=(index,))
    return int(sequence.generate_state(1, np.uint64)[0])


@given(st.integers(0, 2**160), st.lists(st.integers(0, 2**53), min_size=1, max_size=5))
@example(0, [0, 2**32 - 1, 2**32])
def test_first_words_are_those_of_numpy(root: int, indices: list[int]) -> None:
    words = first_words(root, np.array(indices, np.uint64))
    assert words.tolist() == [word_of(root, i) for i in indices]


def test_seed_is_that_of_root_and_index(mixed: Campaign) -> None:
    for i in (0, 3, 10**9):
        assert mixed.seeds(i, i + 1)[0] == word_of(5, i) // 2
    seeds = mixed.seeds(0, 384)
    assert seeds.dtype == np.int64
    assert (seeds >= 0).all()
    assert len(np.unique(seeds)) == 384


def test_whole_numbers_may_be_written_as_floats(mixed: Campaign, tmp_path: Path) -> None:
    again = load_campaign(written(tmp_path, SOURCE.replace('seed: 5', 'seed: 5.0\nblock: 1e3')))
    assert (again.block, type(again.block)) == (1000, int)
    assert (again.data['seed'], type(again.data['seed'])) == (5, int)
    assert (again.seeds(0, 9) == mixed.seeds(0, 9)).all()


def test_defaults_are_filled_in(tmp_path: Path) -> None:
    text = 'name: x\nscenario: case1\nvary: [{grid: {duration: [1.0]}}]'
    campaign = load_campaign(written(tmp_path, text))
    data = {'format': 1, 'controllers': ['gvc', 'cl'], 'hold': 'continuous', 'seed': 0}
    assert campaign.data == {**data, **yaml.safe_load(text)}


def test_scenario_is_named_relative_to_the_campaign(tmp_path: Path, monkeypatch) -> None:
    text = (Path(__file__).parents[4] / 'config/scenarios/case2.yaml').read_text()
    (tmp_path / 'mine.yaml').write_text(text)
    path = written(tmp_path, 'name: x\nscenario: mine.yaml\nvary: [{grid: {duration: [1.0]}}]')
    monkeypatch.chdir('/')
    assert load_campaign(path).scenario.name == 'case2'
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'elsewhere').mkdir()
    moved = path.rename(tmp_path / 'elsewhere' / 'campaign.yaml')
    with pytest.raises(InputError, match=r'elsewhere/mine\.yaml: expected a scenario file'):
        load_campaign(moved)


def test_readme_counts_the_shipped_campaign() -> None:
    readme = (Path(__file__).parents[4] / 'README.md').read_text()
    campaign = load_campaign('case1_gains')
    assert f'{campaign.rollouts} rollouts of each controller' in readme


@pytest.mark.parametrize(
    ('duration', 'count', 'block'),
    [
        (10.0, 10_000, 1000),  # of 1000 steps each: a million
        (100.0, 10_000, 100),
        (10_000.0, 1000, 16),
        (10.0, 2_001, 251),  # an eighth
        (10.0, 20, 16),
        (1.0, 100_000, 1024),
        (10.0, 10**7, 39_063),  # of at most 256 files
    ],
)
def test_blocks_are_shorter_where_rollouts_are_longer(
    tmp_path: Path, monkeypatch, duration: float, count: int, block: int
) -> None:
    scenario = (Path(__file__).parents[4] / 'config/scenarios/case1.yaml').read_text()
    text = scenario.replace('duration: 30.0', f'duration: {duration}')
    (tmp_path / 'scenario.yaml').write_text(text)
    text = ('name: x\nscenario: scenario.yaml\nvary: [{random: {duration: {uniform: '
            f'{{from: 1, to: 2}}}}}}, count: {count}}}]')  # fmt: skip
    campaign = load_campaign(written(tmp_path, text))
    assert campaign.block == block
    monkeypatch.setattr(Campaign, 'own_laws', {'gvc': object})  # which run as plain Python
    assert campaign.block == max(8, -(-count // 256))


def test_there_are_not_more_rollouts_than_a_float_can_count(tmp_path: Path) -> None:
    drawn = "  - random: {{'{}': {{uniform: {{from: 1, to: 2}}}}}}\n    count: {}\n"
    text = 'name: x\nscenario: case1\nvary:\n' + drawn.format('duration', 2**30)
    most = load_campaign(written(tmp_path, text + drawn.format('initial.nu[0]', 2**23)))
    assert most.rollouts == 2**53
    expected = f'vary: expected at most {2**53} rollouts, found {2**53 + 2**30}'
    with pytest.raises(InputError, match=expected):
        load_campaign(written(tmp_path, text + drawn.format('initial.nu[0]', 2**23 + 1)))


def test_vehicles_may_be_drawn(tmp_path: Path) -> None:
    text = ('name: x\nscenario: case1\nvary: [{random: {vehicle: {choice: [herman2018, rexrov]}}, '
            'count: 4}]')  # fmt: skip
    scenarios = load_campaign(written(tmp_path, text)).scenarios
    assert {name: one.vehicle.name for name, one in scenarios.items()} == {
        'herman2018': 'herman2018', 'rexrov': 'rexrov',
    }  # fmt: skip
    expected = (
        r'vary.0..random.vehicle: expected a list of names or paths of vehicles, found .*from'
    )
    with pytest.raises(InputError, match=expected):
        load_campaign(written(tmp_path, text.replace('choice: [herman2018, rexrov]',
                                                     'integers: {from: 1, to: 2}')))  # fmt: skip


@pytest.mark.parametrize(
    ('path', 'controller', 'own'),
    [
        ('controllers.*.k_D', 'cl', 'controllers.cl.k_D'),
        ('controllers.*.k_D', 'cl.2', "controllers.'cl.2'.k_D"),
        ("controllers.'cl.2'.k_D", 'cl.2', "controllers.'cl.2'.k_D"),
        ('controllers.gvc.k_D', 'cl', None),
        ('duration', 'cl', 'duration'),
        ('vehicle.rigid_body.mass', 'cl', 'vehicle.rigid_body.mass'),
    ],
)
def test_what_a_path_means_for_a_controller(path: str, controller: str, own: str | None) -> None:
    assert concerns(path, controller) == (own is not None)
    assert of_controller(path, controller) == (own or path)


def test_files_that_a_campaign_was_read_from(mixed: Campaign) -> None:
    names = ['campaign.yaml', 'case1.yaml', 'herman2018.yaml', 'rexrov.yaml']
    assert sorted(path.name for path in mixed.inputs) == names


def test_ten_million_rollouts_take_no_memory_of_their_number(tmp_path: Path) -> None:
    text = SOURCE.replace('count: 8', 'count: 1048576').replace('case1\n', 'case1\nblock: 512\n')
    path = written(tmp_path, text)
    load_campaign(path).values(0, 512)  # what is imported then is not counted
    tracemalloc.start()
    campaign = load_campaign(path)
    assert campaign.rollouts > 5e7
    for first in range(0, campaign.rollouts, 10**7):
        assert len(campaign.values(first, first + 512)['initial.nu[2]']) == 512
        campaign.seeds(first, first + 512)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8e6


REPLACED = {  # old text, new text -> what the one line says
    ('name: mixed', 'name: a b'): 'campaign.yaml: name: expected a word without blanks',
    ('scenario: case1', 'scenario: case9'): 'campaign.yaml: scenario: .*case1, .*found case9',
    ('scenario: case1', 'scenario: gone/x.yaml'): 'gone/x.yaml: expected a scenario file',
    ('scenario: case1', 'scenarios: case1'): 'scenarios: expected one of .*unknown key',
    ('seed: 5', 'seed: -1'): 'seed: expected a whole number from 0 to 2.63 - 1, found -1',
    ('seed: 5', 'controllers: [pid]'): 'controllers.0.: expected one of gvc, cl, found pid',
    ('seed: 5', 'controllers: []'): 'controllers: expected a list of at least one',
    ('seed: 5', 'hold: foh'): 'hold: expected continuous or zoh .*found foh',
    ('seed: 5', 'controllers: [cl]'): 'expected a controller that is swept: cl, found gvc',
    ('controllers.*.k_D', 'controllers.*.kD'): 'grid.controllers...kD: .*nearest: k_D',
    ('controllers.*.k_D', 'controllers.pid.k_D'): 'expected one of gvc, cl',
    ('controllers.*.k_D', 'controllers.*'): 'grid.controllers..: expected',
    ('controllers.*.k_D', 'seed'): "grid.seed: expected nothing: a rollout's seed",
    ('controllers.*.k_D', 'name'): 'grid.name: expected nothing: a sweep has one name, found name',
    ('controllers.*.k_D', 'format'): 'grid.format: expected nothing: there is one format',
    ('controllers.*.k_D', 'setpoint.file'): 'grid.setpoint.file: expected nothing: one file',
    ('controllers.*.k_D', '"\'format\'"'): "grid.'format': expected nothing: there is one format",
    ('controllers.*.k_D', 'controllers'): 'grid.controllers: expected a path into one of them, or',
    ('controllers.*.k_D', 'a..b'): 'grid.a..b: expected keys and .indices',
    ('controllers.*.k_D', 'actuators.lag'): 'grid.actuators.lag: expected hold: zoh',
    ('initial.nu[2]', 'controllers.*.k_D'): 'each value varied once, found .* in vary.0. as well',
    ('initial.nu[2]', 'controllers.cl.k_D'): 'found controllers.cl.k_D in vary.0. as well',
    ('initial.nu[2]', 'initial.nu[6]'): 'sobol.initial.nu.6.: expected an index below 6',
    ('[herman2018, rexrov]', '[herman2018, nautilus]'): 'vehicle: expected .*, found nautilus',
    ('[herman2018, rexrov]', '[1, 2]'): 'grid.vehicle: expected a list of names or paths',
    ('vehicle.rigid_body.mass', 'vehicle.inertia_matrix[0][0]'): 'a list that has .0., found noth',
    ('[6, 12.0]', '[]'): 'k_D: expected a list of at least one value',
    ('[6, 12.0]', '[null]'): 'k_D.0.: expected a number, a word',
    ('[6, 12.0]', '{from: 1, to: 2}'): 'k_D.count: expected a whole number from 1 to',
    ('[6, 12.0]', '5'): 'k_D: expected a list of values, or a mapping with from',
    ('  - zip:', '  - zipped:'): 'vary.1..zipped: expected one of grid, zip, random',
    ('    count: 4', ''): 'vary.2..count: expected a whole number',
    ('    count: 4', '    count: 0'): 'vary.2..count: expected a whole number',
    ('    count: 4', '    count: 4\n    grid: {duration: [1]}'): 'vary.2..* expected grid alone',
    ('{normal: {mean: 250, std: 2}}', '{normal: {mean: 250}}'): 'std: expected a positive',
    ('{normal: {mean: 250, std: 2}}', '{gauss: {mean: 250}}'): 'mass.gauss: expected one of',
    ('{normal: {mean: 250, std: 2}}', '[250]'): 'mass: expected one of uniform',
    ('{from: 1, to: 100, count: 3, spacing: log}', '[1, 2]'): 'as many values of each path',
}  # fmt: skip


@pytest.mark.parametrize(('old', 'new'), REPLACED)
def test_wrong_campaign_is_refused_in_one_line(old: str, new: str, tmp_path: Path) -> None:
    assert old in SOURCE
    with pytest.raises(InputError, match=REPLACED[old, new]) as caught:
        load_campaign(written(tmp_path, SOURCE.replace(old, new)))
    assert len(str(caught.value).splitlines()) == 1


def test_samples_of_a_scenario_with_actuators_need_zero_order_hold(tmp_path: Path) -> None:
    text = (Path(__file__).parents[4] / 'config/scenarios/case1.yaml').read_text()
    (tmp_path / 'scenario.yaml').write_text(text + 'actuators: {lag: 0.1}\n')
    text = 'name: x\nscenario: scenario.yaml\nvary: [{grid: {actuators.lag: [0.1, 0.2]}}]\n'
    with pytest.raises(InputError, match='actuators: expected hold'):
        load_campaign(written(tmp_path, text))
    campaign = load_campaign(written(tmp_path, text + 'hold: zoh\n'))
    assert (campaign.hold, campaign.rollouts) == ('zoh', 2)
