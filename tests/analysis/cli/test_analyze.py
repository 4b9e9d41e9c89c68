"""`auv analyze` of bags that were written without a node graph."""

from argparse import Namespace
from html import unescape
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.damaged_bags import STEP, UPRIGHT
from helpers.made_messages import Bag, odometry, serialized, stamped
from made_bags import make_bag

from auv_analysis.bag import reading
from auv_analysis.bag.step_topics import ODOMETRY, TWIST, WRENCH
from auv_analysis.cli import analyze, main
from auv_analysis.cli.arguments import topic_map
from auv_analysis.output.folder import sha256_of, write_manifest
from auv_analysis.studies.compare import sources
from auv_analysis.studies.sweep import report
from auv_dynamics.files.errors import InputError


@pytest.mark.usefixtures('undrawn')
def test_every_bag_is_read_once_and_shows_its_own_files(tmp_path, monkeypatch) -> None:
    bags = [make_bag(tmp_path / name, 300, name) for name in ('case1', 'case2', 'case1_rexrov')]
    read: list[str] = []
    original = reading.McapFile
    monkeypatch.setattr(
        reading, 'McapFile', lambda path, notes: read.append(path.name) or original(path, notes)
    )
    main.main(['analyze', *map(str, bags), '--out', str(tmp_path / 'out')])
    assert read == ['case1_0.mcap', 'case2_0.mcap', 'case1_rexrov_0.mcap']
    page = unescape((tmp_path / 'out' / 'report.html').read_text(encoding='utf-8'))
    for bag in bags:
        assert f'name: {bag.name}\n' in page
        assert f'Set-up of {bag.name}: ' in page
    assert 'The other scenarios’ files are not shown' not in page
    assert page.count('<summary>Vehicle file of ') == 2, 'case1 and case2 share theirs'


@pytest.mark.usefixtures('undrawn')
def test_equal_files_are_shown_once(tmp_path) -> None:
    bag = make_bag(tmp_path / 'case1', 300)
    main.main(['analyze', str(bag), str(bag), '--out', str(tmp_path / 'out')])
    page = (tmp_path / 'out' / 'report.html').read_text(encoding='utf-8')
    assert page.count('<summary>Scenario file</summary>') == 1
    assert page.count('<summary>Vehicle file</summary>') == 1


@pytest.mark.parametrize(
    ('scenarios', 'folder'),
    [
        (['one'], 'one'),
        (['one', 'other', 'one'], 'one_other'),
        (['one', 'two', 'three'], 'one_two_three'),
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


def test_three_runs_are_shown_one_by_one_and_more_side_by_side(tmp_path, monkeypatch) -> None:
    read = SimpleNamespace(files=[tmp_path / 'read.bin'], kind='bag')
    monkeypatch.setattr(sources, 'sources_of', lambda results, *_: [read] * len(results))
    for name in ('_few', '_many'):
        monkeypatch.setattr(analyze, name, lambda *_, name=name: name)
    grammar = main.parser()
    found = [analyze.run(grammar.parse_args(['analyze', *'abcd'[:count]])) for count in (3, 4)]
    assert found == ['_few', '_many']
    with pytest.raises(InputError, match=r'^--law: expected .*nearest: gvc'):
        analyze.run(grammar.parse_args(['analyze', 'a', '--law', 'gvcc']))
    told = ['--odom', '/o', '--frames', 'ned_fsd']
    with pytest.raises(InputError, match=r'^--namespace: expected a bag of our nodes, found a map'):
        analyze.run(grammar.parse_args(['analyze', 'a', *told, '--namespace', '/auv1']))
    read.kind = 'samples'
    for option in (['--vehicle', 'rexrov'], ['--namespace', '/auv1'], told):
        with pytest.raises(InputError, match=f'^{option[0]}: expected a bag, found a$'):
            analyze.run(grammar.parse_args(['analyze', 'a', *option]))
    read.files[0].touch()  # a folder that is in use is refused before anything is read
    with pytest.raises(InputError, match='--overwrite'):
        analyze.run(grammar.parse_args(['analyze', 'a', '--out', str(tmp_path)]))
    write_manifest(tmp_path, {'read.bin': sha256_of(read.files[0])})
    with pytest.raises(InputError, match=r'read\.bin'):
        analyze.run(grammar.parse_args(['analyze', 'a', '--out', str(tmp_path), '--overwrite']))


def test_a_sweep_is_explored_as_it_was_asked_for(monkeypatch) -> None:
    monkeypatch.setattr(sources, 'is_sweep', lambda _: True)
    monkeypatch.setattr(report, 'explore', lambda folder, **chosen: (folder, chosen))
    told = 'analyze', 'swept', '--by', 'energy', '--out', 'out', '--overwrite'
    found = analyze.run(main.parser().parse_args(told))
    assert found == (Path('swept'), {'out': Path('out'), 'by': 'energy', 'overwrite': True})


def test_the_mapping_file_that_is_read_is_never_replaced(tmp_path) -> None:
    told = tmp_path / 'report.html'
    told.touch()
    write_manifest(tmp_path, {told.name: sha256_of(told)})
    options = Namespace(out=tmp_path, map=str(told), overwrite=True)
    with pytest.raises(InputError, match=str(told)), analyze._folder(['x'], [], options):
        pass


def test_of_many_bags_the_vehicle_is_heard_and_that_no_report_is_wanted(tmp_path) -> None:
    bag = Bag(tmp_path / 'bag.mcap')
    for k in range(20):
        for topic, kind, message in (
            ('/odom', ODOMETRY, odometry(k * STEP, UPRIGHT)),
            ('/cmd_vel', TWIST, stamped('Twist', k * STEP, np.zeros(6))),
            ('/wrench', WRENCH, stamped('Wrench', k * STEP, np.zeros(6))),
        ):
            bag.add(topic, kind, k * STEP, serialized(message))
    many = [str(bag.close())] * 4
    for bags in (many, many[:1]):
        out = tmp_path / f'{len(bags)}'
        main.main(['analyze', *bags, '--vehicle', 'rexrov', '--no-report', '--out', str(out)])
        assert (out / 'summary.json').exists()
        assert not (out / 'report.html').exists()


def test_what_is_told_of_a_bag_of_another_system_makes_its_mapping() -> None:
    told = ['--odom', '/o', '--wrench', '/w', '--frames', 'enu_flu', '--twist-frame', 'world']
    found = topic_map(main.parser().parse_args(['analyze', 'bag', *told]))
    assert found is not None
    both = found.sources['odometry'], found.sources['wrench']
    assert [one.topic for one in both] == ['/o', '/w']
    assert [one.frames for one in both] == ['enu_flu', 'enu_flu']
    assert both[0].twist_frame == 'world'
