"""The results' folder: made, refused, and with --overwrite cleared of what is ours and only that.

Whatever a user keeps in or beside it, the recordings and files that a command was given included,
outlives the command.
"""

import shutil
from pathlib import Path

import pytest

from auv_analysis import cli
from auv_analysis.commands import run, simulate
from auv_analysis.folder import prepare, write_text
from auv_analysis.new_files import replacing, unfinished_name
from auv_dynamics.config import shipped
from auv_dynamics.files import InputError

OURS = [
    'summary.json', 'report.html', 'figures/nu.png', 'scenario.yaml', 'vehicle.yaml', 'gvc.npz',
    'logs/gvc/plant_node.log', 'gvc/params.yaml', 'gvc/metadata.yaml', 'gvc/gvc_0.mcap',
    'cl/params.yaml', 'design.json', 'summary_before.json', 'vehicle_before.yaml',
]  # fmt: skip
THEIRS = [
    'notes.md', 'thesis/chapter.npz', 'thesis/chapter2.npz', 'sea_trial/sea_trial_0.mcap',
    'sea_trial/metadata.yaml', 'sea_trial.mcap', 'measured.npz', 'params.yaml', '.hidden',
    '.writable', 'my_vehicle.yaml', 'cl.txt',
]  # fmt: skip
TEXTS = {  # by which our own samples are known
    'summary.json': '{"gvc": {}, "cl": {}}\n',
    'scenario.yaml': 'name: case1\ncontrollers: {gvc: {law: gvc}, cl: {law: cl}}\n',
}


def fill(folder: Path, names: list[str]) -> None:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(TEXTS.get(name, 'x'))


def tree(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob('*') if not path.is_dir()}


def refused(out: Path, *, overwrite: bool) -> str:
    with pytest.raises(InputError) as caught:
        prepare(out, overwrite=overwrite)
    line = str(caught.value)
    assert line.startswith(f'{out}: --out: expected ')
    assert ', found ' in line
    assert len(line.splitlines()) == 1
    return line


@pytest.mark.parametrize('overwrite', [False, True])
@pytest.mark.parametrize('there', [False, True])
def test_new_or_empty_folder_is_made_and_left_empty(overwrite, there, tmp_path) -> None:
    out = tmp_path / 'runs' / 'case1'
    if there:
        out.mkdir(parents=True)
    assert prepare(out, overwrite=overwrite) == out
    assert list(out.iterdir()) == []


@pytest.mark.parametrize('name', ['summary.json', 'notes.md', '.hidden'])
def test_folder_with_anything_in_it_is_refused(name: str, tmp_path: Path) -> None:
    fill(tmp_path, [name])
    assert '--overwrite' in refused(tmp_path, overwrite=False)
    assert tree(tmp_path) == {name}


def test_overwrite_clears_our_results(tmp_path: Path) -> None:
    fill(tmp_path, OURS)
    prepare(tmp_path, overwrite=True)
    assert tree(tmp_path) == set()


@pytest.mark.parametrize('name', THEIRS)
def test_overwrite_keeps_what_is_not_ours(name: str, tmp_path: Path) -> None:
    fill(tmp_path, [*OURS, name])
    prepare(tmp_path, overwrite=True)
    assert name in tree(tmp_path)


def test_overwrite_follows_no_link_out_of_the_folder(tmp_path: Path) -> None:
    fill(tmp_path / 'elsewhere', ['params.yaml', 'x_0.mcap', 'nu.png'])
    (tmp_path / 'out').mkdir()
    for name in ('figures', 'gvc'):
        (tmp_path / 'out' / name).symlink_to(tmp_path / 'elsewhere')
    prepare(tmp_path / 'out', overwrite=True)
    assert tree(tmp_path / 'elsewhere') == {'params.yaml', 'x_0.mcap', 'nu.png'}


def test_no_file_is_written_through_a_link(tmp_path: Path) -> None:
    target, victim = tmp_path / 'sweep.json', tmp_path / 'elsewhere'
    target.symlink_to(victim)
    with pytest.raises(InputError, match='an existing file'):
        write_text(target, 'new', overwrite=False)
    assert not victim.exists()
    unfinished_name(target).symlink_to(victim)
    with replacing(target) as file:
        file.write(b'new')
    assert not victim.exists()
    assert {path.name for path in tmp_path.iterdir()} == {target.name}
    assert target.read_text() == 'new'


@pytest.mark.parametrize('overwrite', [False, True])
@pytest.mark.parametrize('kind', ['file', 'below a file', 'broken link', 'link to itself', 'long'])
def test_path_that_can_be_no_folder_is_refused(kind, overwrite, tmp_path) -> None:
    out = tmp_path / 'out'
    if kind in ('file', 'below a file'):
        out.write_text('mine')
    elif kind == 'broken link':
        out.symlink_to('gone/away')
    elif kind == 'link to itself':
        out.symlink_to('out')
    before = tree(tmp_path)
    asked = {'below a file': out / 'x', 'long': tmp_path / ('n' * 300)}.get(kind, out)
    refused(asked, overwrite=overwrite)
    assert tree(tmp_path) == before
    assert not out.is_file() or out.read_text() == 'mine'


def test_folder_that_cannot_be_written_is_refused() -> None:
    refused(Path('/proc/auv'), overwrite=False)  # not even root makes a folder there


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in which a user keeps scenario and vehicle under the names that we use as well."""
    for module, work in ((run, 'warm_up'), (simulate, 'write_inputs')):
        monkeypatch.setattr(module, work, lambda *_: pytest.fail('work has begun'))
    shutil.copy(shipped('scenarios', 'case1'), tmp_path / 'scenario.yaml')
    shutil.copy(shipped('vehicles', 'herman2018'), tmp_path / 'vehicle.yaml')
    text = (tmp_path / 'scenario.yaml').read_text()
    table = 't,surge,sway,heave,roll,pitch,yaw\n0,0,0,0,0,0,0\n30,0,0,0,0,0,0\n'
    (tmp_path / 'setpoint.csv').write_text(table)
    text = text.replace('vehicle: herman2018', 'vehicle: vehicle.yaml')
    (tmp_path / 'scenario.yaml').write_text(text)
    return tmp_path


@pytest.mark.parametrize('command', ['simulate', 'run'])
def test_folder_that_holds_the_inputs_is_refused(command, project, capsys) -> None:
    before = {path: path.read_text() for path in project.iterdir()}
    arguments = [command, str(project / 'scenario.yaml'), '--out', str(project), '--overwrite']
    with pytest.raises(SystemExit) as end:
        cli.main(arguments)
    lines = capsys.readouterr().err.splitlines()
    assert {path: path.read_text() for path in project.iterdir()} == before
    assert (end.value.code, len(lines)) == (2, 1)
    assert '--out: expected ' in lines[0]


@pytest.mark.parametrize('left', ['gvc/notes.md', 'gvc'])
def test_run_refuses_a_folder_in_which_its_bag_has_no_place(left, project, capsys) -> None:
    # what is not ours stays, so a controller's folder may still be there: said before any work
    out = project / 'out'
    fill(out, [left])
    with pytest.raises(SystemExit) as end:
        cli.main(['run', str(project / 'scenario.yaml'), '--out', str(out), '--overwrite'])
    lines = capsys.readouterr().err.splitlines()
    assert (end.value.code, len(lines)) == (2, 1)
    assert str(out / 'gvc') in lines[0]
    assert tree(out) == {left}


@pytest.mark.parametrize('name', ['figures', 'logs', 'summary.json', 'report.html', 'vehicle.yaml'])
def test_controller_may_not_be_named_like_our_files(name, project, capsys) -> None:
    path = project / 'scenario.yaml'
    path.write_text(path.read_text().replace('  gvc: {', f'  {name}: {{'))
    with pytest.raises(SystemExit) as end:
        cli.main(['simulate', str(path), '--out', str(project / 'out')])
    lines = capsys.readouterr().err.splitlines()
    assert (end.value.code, len(lines)) == (2, 1)
    assert f'{path}: controllers' in lines[0]
    assert name in lines[0]
    assert not (project / 'out').exists()


@pytest.mark.parametrize('key', ['name', 'controller'])
def test_name_too_long_for_a_file_is_refused(key, project, capsys) -> None:
    path, name = project / 'scenario.yaml', 'n' * 300
    old, new = {'name': ('name: case1', f'name: {name}'), 'controller': ('  gvc:', f'  {name}:')}[
        key
    ]
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(SystemExit) as end:
        cli.main(['simulate', str(path), '--out', str(project / 'out')])
    lines = capsys.readouterr().err.splitlines()
    assert (end.value.code, len(lines)) == (2, 1)
    assert str(path) in lines[0]
    assert not (project / 'out').exists()
