"""The folder of a sweep: gone on with after a stop, refused where something has changed."""

import hashlib
import json
import platform
import shutil
from importlib import metadata
from pathlib import Path

import pyarrow as pa
import pytest
import yaml
from helpers.sweeps import (
    CAMPAIGN,
    ROLLOUTS,
    ROOT,
    SCENARIO,
    Counting,
    Interrupted,
    parts,
    run,
    write_files,
)

from auv_analysis.studies.sweep.campaign import load_campaign
from auv_analysis.studies.sweep.engine import SweepStoppedError
from auv_analysis.studies.sweep.folder import sweep_folder
from auv_dynamics.files.errors import InputError


@pytest.fixture
def files(tmp_path: Path) -> Path:
    return write_files(tmp_path)


def test_interrupted_sweep_keeps_what_is_finished_and_goes_on(files: Path) -> None:
    run(files, out='reference')
    with pytest.raises(SweepStoppedError, match='interrupted'):
        run(files, Interrupted(after=2), ahead=1)
    kept = parts(files / 'out')
    assert 1 <= len(kept) <= 2
    stamps = {path: path.stat().st_mtime_ns for path in (files / 'out/rollouts').iterdir()}
    executor = Counting()
    outcome = run(files, executor)
    assert (outcome.before, outcome.rollouts) == (5 * len(kept), ROLLOUTS)
    assert executor.submitted == 4 - len(kept)
    assert all(path.stat().st_mtime_ns == stamp for path, stamp in stamps.items())
    assert parts(files / 'out') == parts(files / 'reference')
    assert run(files, executor).counts == outcome.counts
    assert executor.submitted == 4 - len(kept)
    campaign = load_campaign(files / 'campaign.yaml')
    with sweep_folder(files / 'out', campaign, overwrite=False) as folder:
        assert folder.stored(ROLLOUTS) == ROLLOUTS, 'the last block is a shorter one'


def test_part_that_is_missing_or_broken_is_made_again(files: Path) -> None:
    run(files)
    before = parts(files / 'out')
    data = files / 'out/rollouts'
    (data / 'part-00000001.parquet').unlink()
    (data / 'part-00000002.parquet').write_bytes(before['part-00000002.parquet'][:-9])
    (data / '.part-00000003.parquet.unfinished').write_bytes(b'half')
    (files / 'out/.sweep.json.unfinished').write_bytes(b'{')
    assert run(files).before == ROLLOUTS - 10
    assert parts(files / 'out') == before
    assert not list((files / 'out').glob('.sweep*'))


def test_part_in_which_a_byte_has_changed_is_made_again(files: Path, capsys) -> None:
    with pytest.raises(SweepStoppedError):
        run(files, Interrupted(after=2), ahead=1)
    before = parts(files / 'out')
    changed = files / 'out/rollouts/part-00000000.parquet'
    contents = bytearray(changed.read_bytes())
    contents[len(contents) // 3] ^= 1  # in the columns that nothing of a sweep reads again
    changed.write_bytes(contents)
    text = (files / 'campaign.yaml').read_text()
    (files / 'campaign.yaml').write_text(text.replace('seed: 11', 'seed: 12'))
    with pytest.raises(InputError, match='seed'):
        run(files)  # and does not list it as it is now
    (files / 'campaign.yaml').write_text(text)
    assert run(files).before == 5 * (len(before) - 1)
    assert f'warning: {changed}: not as it was written' in capsys.readouterr().err
    assert before.items() <= parts(files / 'out').items()


def test_what_a_killed_sweep_has_finished_is_listed(files: Path) -> None:
    run(files)
    campaign = load_campaign(files / 'campaign.yaml')
    with sweep_folder(files / 'out', campaign, overwrite=True) as folder:
        folder.store(0, pa.table({'index': [0]}))
        shutil.copytree(folder.folder, files / 'killed')
    (files / 'killed/rollouts/.part-00000001.parquet.unfinished').write_bytes(b'half')
    run(files, out='other')
    shutil.copytree(files / 'killed', files / 'other/unfinished')
    run(files, out='other', overwrite=True)
    assert not (files / 'other/unfinished').exists()
    run(files, out='killed', overwrite=True)
    assert len(parts(files / 'killed')) == len(parts(files / 'other')) + 1  # and what is half


def test_what_is_killed_before_its_first_block_may_be_replaced(files: Path) -> None:
    campaign = load_campaign(files / 'campaign.yaml')
    with sweep_folder(files / 'out', campaign, overwrite=False) as folder:
        shutil.copytree(folder.folder, files / 'killed')
    assert run(files, out='killed', overwrite=True).rollouts == ROLLOUTS


def test_a_sweep_does_not_go_on_with_another_set_point(files: Path) -> None:
    way = 't,surge,sway,heave,roll,pitch,yaw\n0,0,0,0,0,0,0\n1,0.5,0,0.2,0,0,0\n'
    (files / 'way.csv').write_text(way)
    scenario = yaml.safe_load(SCENARIO) | {'setpoint': {'file': 'way.csv'}}
    (files / 'scenario.yaml').write_text(yaml.safe_dump(scenario))
    grid = 'vary: [{grid: {controllers.*.k_D: [6.0, 12.0]}}]'
    (files / 'campaign.yaml').write_text(f'name: x\nscenario: scenario.yaml\n{grid}\n')
    run(files)
    (files / 'way.csv').write_text(way.replace('0.5', '0.6'))
    with pytest.raises(InputError, match=r'setpoint\.csv'):
        run(files)
    (files / 'way.csv').rename(files / 'moved.csv').write_text(way)
    (files / 'scenario.yaml').write_text(
        yaml.safe_dump(scenario | {'setpoint': {'file': 'moved.csv'}})
    )
    assert run(files).before == 2, 'what the file is called is all the same'


CHANGED = {  # file, old, new -> key that the line names
    ('campaign.yaml', 'seed: 11', 'seed: 12'): 'campaign.seed: expected 11 as when it was begun',
    ('campaign.yaml', 'to: 90', 'to: 91'): r'uniform.to: expected 90 .*',
    ('campaign.yaml', 'count: 4', 'count: 5'): r'vary\[1\].count: expected 4',
    ('campaign.yaml', 'block: 5', 'block: 6'): 'campaign.block: expected 5',
    ('campaign.yaml', '[0.1, 0.2]', '[0.1, 0.2, 0.3]'): r'choice: expected \[0.1, 0.2\] as when',
    ('campaign.yaml', 'seed: 11', 'seed: 11\ncontrollers: [gvc]'): 'campaign.controllers: expected',
    ('scenario.yaml', 'k_I: 1.0', 'k_I: 2.0'): 'scenario.controllers.gvc.k_I: expected 1.0 as',
    ('scenario.yaml', 'duration: 0.3', 'duration: 0.4'): 'scenario.duration: expected 0.3',
}


@pytest.fixture(scope='module')
def begun(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign and its sweep after one block."""
    folder = write_files(tmp_path_factory.mktemp('begun'))
    with pytest.raises(SweepStoppedError):
        run(folder, Interrupted(after=1))
    return folder


@pytest.mark.parametrize(('file', 'old', 'new'), CHANGED)
def test_folder_of_another_campaign_is_refused(file, old, new, begun: Path, tmp_path: Path) -> None:
    files = shutil.copytree(begun, tmp_path / 'files')
    before = parts(files / 'out')
    text = (files / file).read_text()
    assert old in text
    (files / file).write_text(text.replace(old, new, 1))
    line = f'{CHANGED[file, old, new]}.*or --overwrite, found'
    with pytest.raises(InputError, match=line) as refused:
        run(files)
    assert len(str(refused.value).splitlines()) == 1
    assert parts(files / 'out') == before
    (files / file).write_text(text + '# a comment changes nothing\n')
    campaign = load_campaign(files / 'campaign.yaml')
    with sweep_folder(files / 'out', campaign, overwrite=False) as folder:
        assert not folder.new


def test_folder_is_refused_when_the_vehicle_has_changed(files: Path) -> None:
    vehicle = (ROOT / 'config/vehicles/herman2018.yaml').read_text()
    (files / 'mine.yaml').write_text(vehicle)
    (files / 'campaign.yaml').write_text(CAMPAIGN.replace('[herman2018,', '[mine.yaml,'))
    run(files)
    (files / 'mine.yaml').write_text(vehicle.replace('mass: 250.0', 'mass: 251.0'))
    with pytest.raises(InputError, match=r'vehicles.mine.yaml.rigid_body.mass: expected 250.0'):
        run(files)


def test_folder_is_refused_when_machine_or_versions_differ(files: Path, monkeypatch) -> None:
    vary = '{morris: {controllers.*.k_D: {uniform: {from: 6, to: 12}}}, count: 2}'
    (files / 'campaign.yaml').write_text(f'name: x\nscenario: scenario.yaml\nvary: [{vary}]\n')

    def begun() -> None:
        campaign = load_campaign(files / 'campaign.yaml')
        with sweep_folder(files / 'out', campaign, overwrite=False):
            pass

    begun()
    kept = json.loads((files / 'out/sweep.json').read_text())['versions']
    assert {'sources', 'python', 'numpy', 'scipy', 'SALib', 'machine'} <= set(kept)
    version = metadata.version
    for where, name, other, key in (
        (metadata, 'version', lambda of: '1.0' if of == 'SALib' else version(of), 'SALib'),
        (metadata, 'version', lambda of: '1.0' if of == 'scipy' else version(of), 'scipy'),
        (platform, 'machine', lambda: 'another', 'machine'),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(where, name, other)
            with pytest.raises(InputError, match=f'versions.{key}: '):
                begun()
    path = files / 'out/sweep.json'
    manifest = json.loads(path.read_text())
    manifest['versions']['numpy'] = '1.0'
    path.write_text(json.dumps(manifest))
    with pytest.raises(InputError, match=r'versions.numpy: expected "1.0" as when it was begun'):
        begun()


@pytest.mark.parametrize(
    ('vary', 'drawn_by'),
    [
        ('grid: {controllers.*.k_D: [6, 12]}', set()),
        ('zip: {controllers.*.k_D: [6, 12]}', set()),
        ('random: {controllers.*.k_D: {uniform: {from: 6, to: 12}}}, count: 2', {'scipy'}),
    ],
)
def test_only_what_drew_the_samples_must_stay_the_same(vary: str, drawn_by, files: Path) -> None:
    text = f'name: x\nscenario: scenario.yaml\nvary: [{{{vary}}}]\n'
    (files / 'campaign.yaml').write_text(text)
    with sweep_folder(files / 'out', load_campaign(files / 'campaign.yaml'), overwrite=False):
        kept = json.loads((files / 'out/sweep.json').read_text())['versions']
    assert kept.keys() & {'scipy', 'SALib'} == drawn_by


@pytest.mark.parametrize('text', ['{', '[]', '{"block": "5"}', '{"campaign": {}}'])
def test_a_manifest_that_is_none_of_a_sweep_is_refused(text: str, files: Path) -> None:
    (files / 'out').mkdir()
    (files / 'out/sweep.json').write_text(text)
    expected = r'--out: expected a folder of .auv sweep., or --overwrite, found a sweep.json that'
    with pytest.raises(InputError, match=expected):
        run(files)
    assert (files / 'out/sweep.json').read_text() == text


OWN_LAW = """
from typing import NamedTuple

class Nothing(NamedTuple):
    k: object
    STATES = 0

    @staticmethod
    def wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return (0.0,) * 6, (0.0,) * 6

    @staticmethod
    def state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return ()
"""


def test_folder_is_refused_when_a_law_of_ones_own_is_edited(files: Path, monkeypatch) -> None:
    monkeypatch.syspath_prepend(str(files))
    source = files / 'law_that_is_edited.py'
    source.write_text(OWN_LAW)
    mine = "  mine: {law: 'law_that_is_edited:Nothing', k: 100.0}\n"
    (files / 'scenario.yaml').write_text(SCENARIO.replace('  gvc:', f'{mine}  gvc:'))
    grid = "vary: [{grid: {'controllers.mine.k': [50, 100.0]}}]"
    for swept, laws in (('mine, gvc', {'mine'}), ('gvc, cl', set())):
        (files / 'campaign.yaml').write_text(
            f'name: x\nscenario: scenario.yaml\ncontrollers: [{swept}]\n'
            + (grid if laws else grid.replace('mine', 'gvc').replace('.k', '.k_D'))
            + '\n'
        )
        campaign, out = load_campaign(files / 'campaign.yaml'), files / swept[:3]
        assert set(campaign.own_laws) == laws
        with sweep_folder(out, campaign, overwrite=False):
            kept = json.loads((out / 'sweep.json').read_text())['laws']
        digest = hashlib.sha256(source.read_bytes()).hexdigest()
        assert kept == dict.fromkeys(laws, digest[:16])
        source.write_text(f'{OWN_LAW}# changed after {swept}\n')
        if laws:
            expected = 'laws.mine: expected the module of the law as when it was begun, .* edited'
            with (
                pytest.raises(InputError, match=expected),
                sweep_folder(out, campaign, overwrite=False),
            ):
                pass
        else:
            with sweep_folder(out, campaign, overwrite=False) as folder:
                assert not folder.new


def test_folder_that_another_process_sweeps_into_is_refused(files: Path) -> None:
    run(files)
    campaign = load_campaign(files / 'campaign.yaml')
    with sweep_folder(files / 'out', campaign, overwrite=False):
        for overwrite in (False, True):
            with pytest.raises(InputError, match='no other command is writing into'):
                run(files, overwrite=overwrite)


@pytest.mark.parametrize('name', ['notes.md', 'rollouts/part-00000000.parquet', 'rollouts/x'])
def test_folder_that_is_no_sweep_is_left_alone(name: str, files: Path) -> None:
    theirs = files / 'out' / name
    theirs.parent.mkdir(parents=True)
    theirs.write_text('mine')
    for overwrite, line in ((False, 'a new folder, or --overwrite'), (True, 'manifest.json')):
        with pytest.raises(InputError, match=line):
            run(files, overwrite=overwrite)
    assert theirs.read_text() == 'mine'


def test_sweep_is_replaced_by_a_whole_one_alone(files: Path) -> None:
    run(files)
    before = parts(files / 'out')
    (files / 'out/rollouts/mine.txt').write_text('mine')
    text = (files / 'campaign.yaml').read_text()
    (files / 'campaign.yaml').write_text(text.replace('seed: 11', 'seed: 12'))
    with pytest.raises(SweepStoppedError):
        run(files, Interrupted(after=3), overwrite=True, ahead=1)
    kept = parts(files / 'out/unfinished')
    assert kept
    assert parts(files / 'out') == {**before, 'mine.txt': b'mine'}
    assert run(files, out='out/unfinished').before == 5 * len(kept)  # it goes on by itself
    whole = parts(files / 'out/unfinished')
    run(files, overwrite=True)
    assert parts(files / 'out') == {**whole, 'mine.txt': b'mine'}
    assert not (files / 'out/unfinished').exists()
