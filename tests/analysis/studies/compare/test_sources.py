"""What the arguments of `auv analyze` stand for, and what runs are called."""

import shutil
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from auv_analysis import load_scenario, simulate
from auv_analysis.runs.samples import write_samples
from auv_analysis.scenario.scenario import write_inputs
from auv_analysis.studies.compare.sources import (
    RunSource,
    is_sweep,
    named,
    numbered,
    open_source,
    sources_of,
)
from auv_dynamics import InputError
from auv_dynamics.files.errors import MARK

ROOT = Path(__file__).parents[4]
SHORT = (ROOT / 'config/scenarios/case1.yaml').read_text().replace('30.0', '0.3')
NOISY = (
    SHORT
    + """
sensors: {velocity_noise: 0.01}
actuators: {lag: 0.02}
faults: [{kind: sensor_drop_out, from: 0.1, to: 0.2}]
"""
)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def results(folder: Path) -> Path:
    """What `auv simulate` leaves, as far as it is read."""
    (folder / 'short.yaml').write_text(SHORT)
    out, scenario = folder / 'runs/short', load_scenario(folder / 'short.yaml')
    out.mkdir(parents=True)
    write_inputs(scenario, out)
    for name in scenario.controllers:
        write_samples(simulate(scenario, name), out / f'{name}.npz')
    return out


def kinds(*arguments: object) -> list[tuple[str, str]]:
    return [(s.kind, s.controller) for s in sources_of([str(a) for a in arguments])]


@pytest.mark.parametrize(('text', 'hold'), [(SHORT, 'continuous'), (NOISY, 'zoh')])
def test_a_scenario_is_simulated_as_its_sensors_and_actuators_need(folder, text, hold) -> None:
    (folder / 'short.yaml').write_text(text)
    found = open_source(sources_of(['short.yaml'])[1])
    expected = simulate(load_scenario('short.yaml'), 'cl', hold)
    assert (found.run.hold, found.run.controller) == (hold, 'cl')
    assert np.array_equal(found.run.nu, expected.nu)


def test_every_kind_of_argument(folder: Path, results: Path) -> None:
    both = [('samples', 'gvc'), ('samples', 'cl')]
    assert kinds('runs/short') == both
    assert kinds('runs/short/cl.npz') == both[1:]
    assert kinds('short.yaml') == [('scenario', 'gvc'), ('scenario', 'cl')]
    assert kinds('case1') == kinds('short.yaml')
    shutil.copy('short.yaml', 'short.yml')
    assert kinds('short.yml') == kinds('short.yaml')
    (folder / 'theirs').mkdir()
    (folder / 'theirs/theirs_0.db3').write_bytes(b'')
    assert kinds('theirs') == kinds('theirs/theirs_0.db3') == [('bag', '')]
    for name, ending in (('one', 'mcap.zstd'), ('other', 'db3.zstd'), ('third', 'db3')):
        (folder / 'dives' / name).mkdir(parents=True)
        (folder / f'dives/{name}/{name}_0.{ending}').write_bytes(b'')
        assert kinds(f'dives/{name}') == [('bag', '')]
    assert kinds('dives') == 3 * [('bag', '')]
    (results / 'gvc.npz').unlink()
    assert kinds('runs/short', 'case2') == [*both[1:], ('scenario', 'gvc'), ('scenario', 'cl')]


def test_files_that_are_read_and_texts_of_what_was_simulated(folder: Path, results: Path) -> None:
    (samples, *_), (scenario, *_) = sources_of(['runs/short']), sources_of(['short.yaml'])
    assert [path.name for path in samples.files] == ['gvc.npz', 'scenario.yaml', 'vehicle.yaml']
    assert [path.name for path in scenario.files] == ['short.yaml', 'herman2018.yaml']
    found = open_source(samples)
    assert found.run.controller == 'gvc'
    for file in ('scenario.yaml', 'vehicle.yaml'):
        assert found.attachments[file] == (results / file).read_text()


LAW = "raise RuntimeError('it was imported')"


def test_a_law_that_somebody_elses_results_name_is_not_imported(results, monkeypatch) -> None:
    monkeypatch.syspath_prepend(str(results))
    (results / 'their_law.py').write_text(LAW)
    text = (results / 'scenario.yaml').read_text()
    assert text.count('law: cl') == 1
    (results / 'scenario.yaml').write_text(text.replace('law: cl', "law: 'their_law:Law'"))
    words = (
        r'scenario\.yaml: controllers\.cl\.law: expected a shipped law, or --law .*their_law:Law'
    )
    for argument in ('runs/short', 'runs/short/gvc.npz'):
        with pytest.raises(InputError, match=words):
            sources_of([argument])
    assert 'their_law' not in sys.modules


def test_bags_of_a_folder_in_the_order_of_its_scenario(folder: Path, results: Path) -> None:
    for name in ('cl', 'gvc', 'later'):
        (results / f'{name}.npz').unlink(missing_ok=True)
        (results / name).mkdir()
        (results / name / f'{name}_0.mcap').write_bytes(b'')
    found = sources_of(['runs/short'])
    assert [(s.kind, s.path.name) for s in found] == [
        ('bag', 'gvc'), ('bag', 'cl'), ('bag', 'later'),
    ]  # fmt: skip
    assert [s.path for s in sources_of(['runs/short/cl'])] == [Path('runs/short/cl')]


def test_a_sweep_is_known_by_its_manifest(folder: Path) -> None:
    (folder / 'sweep').mkdir()
    assert not is_sweep('sweep')
    (folder / 'sweep/sweep.json').write_text('{}')
    assert is_sweep('sweep')
    assert not is_sweep('case1')


def test_a_name_of_two_things_is_refused(folder: Path, results: Path) -> None:
    shutil.copytree(results, folder / 'case1')
    with pytest.raises(InputError, match=r'expected \./case1 for the folder, or .*case1\.yaml'):
        sources_of(['case1'])
    assert kinds('./case1') == kinds('case1/') == kinds('runs/short')
    shutil.rmtree(folder / 'case1')
    (folder / 'case1').write_bytes(b'')
    with pytest.raises(InputError, match=r'expected \./case1 for the file, or .*case1\.yaml'):
        sources_of(['case1'])


def test_bags_and_samples_in_one_folder_are_refused(folder: Path, results: Path) -> None:
    (results / 'gvc').mkdir()
    (results / 'gvc/gvc_0.mcap').write_bytes(b'')
    with pytest.raises(InputError, match=r'found both gvc/ and gvc\.npz'):
        sources_of(['runs/short'])


@pytest.mark.parametrize(
    ('argument', 'words'),
    [
        ('gone', 'shipped: case1, .*found no such file, folder or name'),
        ('gone/gvc', 'expected a bag, a folder of results or of a sweep, or a scenario'),
        ('empty', r'found a folder without \.mcap files or samples'),
        ('lonely.npz', 'the scenario.yaml that'),
        ('runs/short/pid.npz', 'controllers: expected one of gvc, cl'),
    ],
)
def test_what_is_nothing_is_refused(folder: Path, results: Path, argument, words) -> None:
    (folder / 'empty').mkdir()
    (folder / 'lonely.npz').write_bytes(b'')
    (results / 'pid.npz').write_bytes(b'')
    with pytest.raises(InputError, match=words):
        sources_of([argument])


# names


def _names(*runs: tuple[str, str, str], join: str = '/') -> list[str]:
    pairs = [
        (RunSource('bag', Path(path)), SimpleNamespace(scenario=scenario, controller=controller))
        for path, scenario, controller in runs
    ]
    return named(pairs, join)


def test_names_are_as_short_as_they_can_be() -> None:
    assert _names(('a/gvc', 'case1', 'gvc'), ('a/cl', 'case1', 'cl')) == ['gvc', 'cl']
    assert _names(('a/gvc', 'case1', 'gvc'), ('b/gvc', 'case2', 'gvc')) == [
        'case1/gvc', 'case2/gvc',
    ]  # fmt: skip
    assert _names(('a/gvc', 'x', 'gvc'), ('b/gvc', 'y', 'gvc'), join='_') == ['x_gvc', 'y_gvc']


def test_runs_of_one_name_are_told_apart_by_their_folders() -> None:
    found = _names(('/1/a/gvc', 'x', 'gvc'), ('/1/b/gvc', 'x', 'gvc'), ('/1/b/cl', 'x', 'cl'))
    assert found == ['a/gvc', 'b/gvc', 'x/cl']
    found = _names(('/1/a/gvc', 'x', 'gvc'), ('/2/a/gvc', 'x', 'gvc'))
    assert found == ['1/a/gvc', '2/a/gvc']
    hostile = _names(('/$\\frac$\udcff/gvc', 'x', 'gvc'), ('/b/gvc', 'x', 'gvc'))
    assert hostile == [f'_\\frac_{MARK}/gvc', 'b/gvc']
    deep = [('/1/b/c/d/gvc', 'x', 'gvc'), ('/2/b/c/d/gvc', 'x', 'gvc')]
    assert _names(*deep) == ['1/b/c/d/gvc', '2/b/c/d/gvc']
    assert _names(*((path.replace('b', 'a/b'), *rest) for path, *rest in deep)) == [
        'x/gvc', 'x/gvc_2',
    ]  # fmt: skip
    one = SimpleNamespace(scenario='x', controller='gvc')
    sources = RunSource('scenario', Path('/1/x.yaml')), RunSource('samples', Path('/1/a/gvc.npz'))
    assert named([(source, one) for source in sources]) == ['simulated/x/gvc', 'a/gvc']


def test_one_run_twice_is_numbered() -> None:
    assert _names(*3 * (('/1/a/gvc', 'x', 'gvc'),)) == ['x/gvc', 'x/gvc_2', 'x/gvc_3']
    twice = ('/1/a/gvc', 'x', 'gvc')
    assert _names(twice, twice, ('/1/b/gvc', 'x', 'gvc')) == ['a/gvc', 'a/gvc_2', 'b/gvc']
    assert numbered(['a', 'a', 'a_2', 'b']) == ['a', 'a_3', 'a_2', 'b'], 'each keeps its own'
