"""`auv analyze` of bags that were written without a node graph."""

from argparse import Namespace
from html import unescape
from pathlib import Path

import pytest
from made_bags import make_bag

from auv_analysis.bag import reading
from auv_analysis.cli import analyze, main


@pytest.mark.usefixtures('unrendered')
def test_every_bag_is_read_once_and_shows_its_own_files(tmp_path, monkeypatch) -> None:
    bags = [make_bag(tmp_path / name, 300, name) for name in ('case1', 'case2', 'case1_rexrov')]
    read: list[str] = []
    original = reading.McapFile
    monkeypatch.setattr(
        reading, 'McapFile', lambda path, notes: read.append(path.name) or original(path, notes)
    )
    main.main(['analyze', *map(str, bags), '--out', str(tmp_path / 'out')])
    assert read == ['case1_0.mcap', 'case2_0.mcap', 'case1_rexrov_0.mcap']
    report = unescape((tmp_path / 'out' / 'report.html').read_text(encoding='utf-8'))
    for bag in bags:
        assert f'name: {bag.name}\n' in report
        assert f'Set-up of {bag.name}: ' in report
    assert 'The other scenarios’ files are not shown' not in report
    assert report.count('<summary>Vehicle file of ') == 2, 'case1 and case2 share theirs'


@pytest.mark.usefixtures('unrendered')
def test_equal_files_are_shown_once(tmp_path) -> None:
    bag = make_bag(tmp_path / 'case1', 300)
    main.main(['analyze', str(bag), str(bag), '--out', str(tmp_path / 'out')])
    report = (tmp_path / 'out' / 'report.html').read_text(encoding='utf-8')
    assert report.count('<summary>Scenario file</summary>') == 1
    assert report.count('<summary>Vehicle file</summary>') == 1


@pytest.mark.parametrize(
    ('scenarios', 'folder'),
    [
        (['one'], 'one'),
        (['one', 'other', 'one'], 'one_other'),
        (['one', 'two', 'three', 'four'], 'one_and_3_more'),
        (['x' * 60, 'y' * 60], f'{"x" * 60}_and_1_more'),
        (['x' * 90], 'x' * 90),
    ],
)
def test_results_are_named_after_the_scenarios(scenarios, folder, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with analyze._folder(scenarios, [], Namespace(out=None, map=None, overwrite=False)):
        pass
    assert [path.name for path in Path('runs').iterdir()] == [f'analyze_{folder}']
