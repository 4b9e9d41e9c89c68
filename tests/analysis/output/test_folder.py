"""The results' folder: made, refused, and with --overwrite replaced, as a whole and nothing else.

Whatever a user keeps in or beside it, the recordings and files that a command was given included,
outlives the command.
"""

import math
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from auv_analysis.cli import main, scenario_runs
from auv_analysis.graph import recorded_runs
from auv_analysis.output.folder import (
    check_free,
    discard,
    has_links,
    listed_in,
    results_folder,
    sha256_of,
    write_manifest,
)
from auv_analysis.output.new_files import (
    arrow_table,
    replacing,
    unfinished_name,
    write_text,
)
from auv_dynamics.files.errors import FailedError, InputError, printable
from auv_dynamics.files.shipped import shipped

EARLIER = {
    'summary.json': 'old', 'report.html': 'old', 'figures/nu.png': 'old', 'scenario.yaml': 'old',
    'logs/gvc/plant_node.log': 'old', 'gvc/params.yaml': 'old', 'gvc/gvc_0.mcap': 'old',
}  # fmt: skip
LATER = {'summary.json': 'new', 'figures/tau.png': 'new', 'gvc/gvc_0.mcap': 'new'}
THEIRS = [
    'notes.md', 'thesis/chapter.npz', 'figures/my_photo.png', 'logs/my.log', 'rawdata/field_0.mcap',
    'metadata.yaml', 'measured.npz', 'params.yaml', '.hidden', 'my_vehicle.yaml', 'cl.txt',
    'rollouts/mine.txt', 'unfinished_ideas.txt',
]  # fmt: skip
OWN = ['gvc/*', 'cl.npz']


def fill(folder: Path, texts: Mapping[str, str]) -> None:
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def write(
    out: Path,
    texts: Mapping[str, str],
    *,
    overwrite: bool = False,
    end: BaseException | None = None,
) -> None:
    """What a command does, which may not come to its end."""
    with results_folder(out, overwrite=overwrite, own=OWN) as results:
        fill(results.folder, texts)
        if end is not None:
            raise end


def tree(folder: Path) -> dict[str, str]:
    """Text of every file; of the manifest, and of a link, none."""
    files = {str(path.relative_to(folder)): path for path in folder.rglob('*')}
    return {
        name: '' if path.is_symlink() or name == 'manifest.json' else path.read_text()
        for name, path in files.items()
        if path.is_symlink() or not path.is_dir()
    }


def refused(out: Path, *, overwrite: bool, **options: Any) -> str:
    with (
        pytest.raises(InputError) as caught,
        results_folder(out, overwrite=overwrite, own=OWN, **options),
    ):
        pytest.fail('work has begun')
    line = str(caught.value)
    assert line.startswith(printable(str(out)))
    assert ', found ' in line
    assert len(line.splitlines()) == 1
    return line


@pytest.mark.parametrize('overwrite', [False, True])
@pytest.mark.parametrize('there', [False, True])
def test_results_of_a_new_or_empty_folder_are_written_in_place(overwrite, there, tmp_path) -> None:
    out = tmp_path / 'runs' / 'case1'
    if there:
        out.mkdir(parents=True)
    with results_folder(out, overwrite=overwrite, own=OWN) as results:
        assert results == (out, out)
        fill(out, EARLIER)
    assert tree(out) == {**EARLIER, 'manifest.json': ''}


@pytest.mark.parametrize('name', ['summary.json', 'notes.md', '.hidden'])
@pytest.mark.parametrize('overwrite', [False, True])
def test_folder_that_no_manifest_lists_is_refused(name, overwrite, tmp_path: Path) -> None:
    fill(tmp_path, {name: 'mine'})
    assert ('manifest.json' if overwrite else '--overwrite') in refused(
        tmp_path, overwrite=overwrite
    )
    assert tree(tmp_path) == {name: 'mine'}


FOREIGN = [
    '{}',
    '[]',
    '{"name": "My app"}',
    'x',
    '{"files": {"../x": "DIGEST"}}',
    '{"files": {"/x": "DIGEST"}}',
    '{"files": {"gvc//x": "DIGEST"}}',
]


@pytest.mark.parametrize('text', FOREIGN)
def test_manifest_of_somebody_else_lists_nothing(text: str, tmp_path: Path) -> None:
    fill(tmp_path, {'x': 'mine'})
    listed = text.replace('DIGEST', sha256_of(tmp_path / 'x'))  # as it is: it has not changed
    fill(tmp_path, {'out/manifest.json': listed})
    refused(tmp_path / 'out', overwrite=True)
    assert listed_in(tmp_path / 'out') is None
    assert (tmp_path / 'x').read_text() == 'mine'


def test_overwrite_replaces_what_the_manifest_lists(tmp_path: Path) -> None:
    write(tmp_path, EARLIER)
    write(tmp_path, LATER, overwrite=True)
    assert tree(tmp_path) == {**LATER, 'manifest.json': ''}
    assert not (tmp_path / 'logs').exists()  # nothing of ours is left in it
    write(tmp_path, EARLIER, overwrite=True)
    assert tree(tmp_path) == {**EARLIER, 'manifest.json': ''}


def test_overwrite_keeps_what_is_not_ours(tmp_path: Path) -> None:
    theirs = dict.fromkeys(THEIRS, 'mine')
    write(tmp_path, EARLIER)
    fill(tmp_path, theirs)
    write(tmp_path, LATER, overwrite=True)
    assert tree(tmp_path) == {**LATER, **theirs, 'manifest.json': ''}


def test_file_that_comes_while_a_command_writes_is_not_ours(tmp_path: Path) -> None:
    write(tmp_path, {**EARLIER, 'notes.md': 'mine'})  # in place: the user writes there as well
    write(tmp_path, LATER, overwrite=True)
    assert tree(tmp_path) == {**LATER, 'notes.md': 'mine', 'manifest.json': ''}


@pytest.mark.parametrize('name', ['summary.json', 'figures/nu.png', 'gvc/gvc_0.mcap'])
def test_result_that_has_been_edited_is_kept(name: str, tmp_path: Path) -> None:
    write(tmp_path, EARLIER)
    fill(tmp_path, {name: 'edited'})
    assert name in refused(tmp_path, overwrite=True)
    assert tree(tmp_path) == {**EARLIER, name: 'edited', 'manifest.json': ''}


@pytest.mark.parametrize(
    'name', ['gvc/notes.md', 'cl.npz', 'tune.json', 'tune.json/x', 'setpoint.csv']
)
def test_what_stands_where_a_result_must_go_is_refused(name: str, tmp_path: Path) -> None:
    write(tmp_path, EARLIER)
    fill(tmp_path, {name: 'mine'})
    assert name in refused(tmp_path, overwrite=True)
    assert tree(tmp_path) == {**EARLIER, name: 'mine', 'manifest.json': ''}


def test_figure_of_the_users_in_the_way_of_a_new_one_is_kept_beside_it(tmp_path, capsys) -> None:
    write(tmp_path, EARLIER)
    fill(tmp_path, {'figures/tau.png': 'mine'})  # only drawing shows that it is in the way
    with pytest.raises(FailedError, match=r'tau\.png: expected no such file'):
        write(tmp_path, LATER, overwrite=True)
    assert EARLIER.items() <= tree(tmp_path).items()
    assert (tmp_path / 'figures/tau.png').read_text() == 'mine'
    left = tmp_path / 'unfinished'
    assert tree(left) == {**LATER, 'manifest.json': ''}
    assert str(left) in capsys.readouterr().err


def test_folder_with_what_is_read_is_refused(tmp_path: Path) -> None:
    write(tmp_path, EARLIER)
    for given in ('gvc', 'gvc/gvc_0.mcap', 'scenario.yaml'):
        assert given in refused(tmp_path, overwrite=True, inputs=[tmp_path / given])
    assert tree(tmp_path) == {**EARLIER, 'manifest.json': ''}


def test_overwrite_follows_no_link_out_of_the_folder(tmp_path: Path) -> None:
    elsewhere, out = tmp_path / 'elsewhere', tmp_path / 'out'
    write(out, EARLIER)
    (out / 'figures').rename(elsewhere)
    (out / 'figures').symlink_to(elsewhere)
    refused(out, overwrite=True)
    (out / 'figures').unlink()
    (out / 'summary.json').rename(elsewhere / 'summary.json')
    (out / 'summary.json').symlink_to(elsewhere / 'summary.json')
    refused(out, overwrite=True)
    assert tree(elsewhere) == {'nu.png': 'old', 'summary.json': 'old'}


def test_what_cannot_be_written_is_refused_by_what_the_system_says(tmp_path, monkeypatch) -> None:
    (tmp_path / 'file').write_text('')
    folder = '--out: expected a folder that can be written, found'
    beside = tmp_path / 'file/made/out'
    assert refused(beside, overwrite=False) == f'{beside}: {folder} not a directory'
    with pytest.raises(InputError) as caught:
        write_text(beside, 'text', overwrite=False)
    expected = '--out: expected a file that can be written, found not a directory'
    assert str(caught.value) == f'{beside}: {expected}'

    def fail(*, dir: Path) -> None:
        raise PermissionError(13, 'Permission denied', str(dir))

    monkeypatch.setattr(tempfile, 'TemporaryFile', fail)
    out = tmp_path / 'out'
    assert refused(out, overwrite=False) == f'{out}: {folder} permission denied'


ENDS = [KeyboardInterrupt(), OSError(28, 'No space left'), InputError('x', '', 'y', 'z')]


@pytest.mark.parametrize('end', ENDS)
def test_command_that_does_not_come_to_its_end_leaves_the_results(end, tmp_path: Path) -> None:
    write(tmp_path, EARLIER)
    before = tree(tmp_path)
    with pytest.raises(type(end)):
        write(tmp_path, {'summary.json': 'half'}, overwrite=True, end=end)
    assert tree(tmp_path) == before
    write(tmp_path, LATER, overwrite=True)


def test_of_what_replaces_results_a_failure_leaves_rollouts_and_summaries_alone(tmp_path) -> None:
    failed, stopped = FailedError('no'), KeyboardInterrupt()
    rollouts, summary, figure = 'rollouts/part-00000000.parquet', 'summary.json', 'figures/nu.png'
    write(tmp_path, EARLIER)
    for end, name, kept in (
        (stopped, rollouts, True), (failed, rollouts, True),
        (stopped, summary, False), (failed, summary, True), (failed, figure, False),
    ):  # fmt: skip
        with pytest.raises(type(end)):
            write(tmp_path, {name: 'new'}, overwrite=True, end=end)
        assert (tmp_path / 'unfinished' / name).is_file() == kept
        assert EARLIER.items() <= tree(tmp_path).items()
        shutil.rmtree(tmp_path / 'unfinished', ignore_errors=True)


def test_half_a_file_is_discarded_with_the_results_that_it_lies_beside(tmp_path) -> None:
    left = tmp_path / 'left'
    fill(left, {'.b.json.unfinished': '{'})
    discard(left)
    assert tree(left) == {'.b.json.unfinished': '{'}, 'it may be of somebody'
    fill(left, {'a.json': 'x'})
    write_manifest(left, {'a.json': sha256_of(left / 'a.json'), 'gone.json': 'never written'})
    discard(left)
    assert not left.exists()


def test_a_file_where_a_folder_must_go_stops_the_exchange_before_it_begins(tmp_path) -> None:
    def work() -> None:
        with results_folder(tmp_path, overwrite=True, own=OWN) as results:
            fill(results.folder, LATER)
            (tmp_path / 'gvc').write_text('mine')

    write(tmp_path, {'summary.json': 'old'})
    with pytest.raises(FailedError, match='expected no such file'):
        work()
    assert (tmp_path / 'summary.json').read_text() == 'old'
    assert (tmp_path / 'gvc').read_text() == 'mine'


def test_a_link_among_the_results_is_none_of_them(tmp_path: Path) -> None:
    (tmp_path / 'mine').write_text('mine')
    with results_folder(tmp_path / 'out', overwrite=False) as results:
        fill(results.folder, {'summary.json': 'new', 'figures/nu.png': 'new'})
        (results.folder / 'figures' / 'tau.png').symlink_to(tmp_path / 'mine')
    listed = listed_in(tmp_path / 'out')
    assert sorted(listed or ()) == ['figures/nu.png', 'manifest.json', 'summary.json']


KILLED = """
import os, signal, sys
from pathlib import Path
from auv_analysis.output.folder import results_folder

with results_folder(Path(sys.argv[1]), overwrite=True) as results:
    (results.folder / 'summary.json').write_text('half')
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_command_that_is_killed_leaves_the_results(tmp_path: Path) -> None:
    write(tmp_path, EARLIER)
    before = tree(tmp_path)
    subprocess.run([sys.executable, '-c', KILLED, str(tmp_path)], check=False)
    left = {'unfinished/summary.json': 'half'}
    assert tree(tmp_path) == {**before, **left}
    write(tmp_path, LATER, overwrite=True)
    assert tree(tmp_path) == {**LATER, **left, 'manifest.json': ''}  # no manifest lists it


def test_what_a_command_killed_at_its_first_file_has_left_is_in_no_way(tmp_path: Path) -> None:
    out = tmp_path / 'out'
    out.mkdir()
    (out / '.sweep.json.unfinished').write_text('{')
    with results_folder(out, overwrite=False) as results:
        assert results.folder == out
    (out / 'unfinished').write_text('of somebody')
    with (
        pytest.raises(InputError, match='found an existing folder'),
        results_folder(out, overwrite=False),
    ):
        pass


@pytest.mark.parametrize('end', [FailedError('a node ended'), KeyboardInterrupt()])
def test_recording_is_kept_until_the_next_command_succeeds(end, tmp_path: Path, capsys) -> None:
    write(tmp_path, EARLIER)
    for name in ('unfinished', 'unfinished_1'):
        with pytest.raises(type(end)):
            write(tmp_path, {'gvc/gvc_0.mcap': 'half'}, overwrite=True, end=end)
        assert str(tmp_path / name) in capsys.readouterr().err
        assert tree(tmp_path / name) == {'gvc/gvc_0.mcap': 'half', 'manifest.json': ''}
        assert EARLIER.items() <= tree(tmp_path).items()
    fill(tmp_path / 'unfinished_1', {'gvc/gvc_0.mcap': 'recovered'})
    write(tmp_path, LATER, overwrite=True)
    assert not (tmp_path / 'unfinished').exists()
    assert (tmp_path / 'unfinished_1/gvc/gvc_0.mcap').read_text() == 'recovered'


def test_of_what_is_left_the_report_is_named_or_else_the_summary(tmp_path: Path, capsys) -> None:
    for folder, names, said in (
        ('a', ('report.html', 'summary.json'), 'report: {}/report.html'),
        ('b', ('summary.json',), 'summary: {}/summary.json'),
    ):
        with pytest.raises(FailedError):
            write(tmp_path / folder, dict.fromkeys(names, ''), end=FailedError('no'))
        assert capsys.readouterr().err.splitlines() == [said.format(tmp_path / folder)]


def test_new_results_that_are_not_whole_can_be_overwritten(tmp_path: Path) -> None:
    half = {'gvc/gvc_0.mcap': 'half', 'notes.md': 'mine'}
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path, half, end=KeyboardInterrupt())
    write(tmp_path, LATER, overwrite=True)
    assert tree(tmp_path) == {**LATER, 'notes.md': 'mine', 'manifest.json': ''}


def test_folder_that_nothing_was_written_into_is_not_left(tmp_path: Path) -> None:
    with pytest.raises(FailedError), results_folder(tmp_path / 'runs/x', overwrite=False):
        raise FailedError('no')
    assert tree(tmp_path) == {}
    assert not (tmp_path / 'runs').exists()


def test_interrupt_of_the_exchange_waits_for_its_end(tmp_path: Path, monkeypatch) -> None:
    write(tmp_path, EARLIER)
    replace, calls = Path.replace, []

    def interrupted(path: Path, target: Path) -> Path:
        calls.append(path)
        signal.raise_signal(signal.SIGINT)
        return replace(path, target)

    monkeypatch.setattr(Path, 'replace', interrupted)
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path, LATER, overwrite=True)
    assert len(calls) == len(LATER)
    assert tree(tmp_path) == {**LATER, 'manifest.json': ''}


@pytest.mark.parametrize('overwrite', [False, True])
def test_folder_that_another_command_writes_into_is_refused(overwrite: bool, tmp_path) -> None:
    out = tmp_path / 'out'
    with results_folder(out, overwrite=False, own=OWN):
        assert 'no other command' in refused(out, overwrite=overwrite)
        fill(out, EARLIER)
        assert 'no other command' in refused(out, overwrite=overwrite)
    write(out, LATER, overwrite=True)


def test_before_any_work_all_is_refused_that_would_be_after_it(tmp_path: Path, monkeypatch) -> None:
    file, held, used, new = (tmp_path / name for name in ('file', 'held', 'used', 'new/folder'))
    vehicle = held / 'vehicle.yaml'
    fill(tmp_path, {'file': 'mine'})
    write(held, {'vehicle.yaml': shipped('vehicles', 'bluerov2').read_text()})
    monkeypatch.setattr('auv_analysis.graph.domain.join_domain', lambda _: pytest.fail('it works'))
    check = ['check-driver', '--overwrite', '--vehicle', str(vehicle), '--out']
    with results_folder(used, overwrite=False):
        for out in (file, file / 'below', Path('/proc/nope'), used, held):
            before = tree(tmp_path)
            with pytest.raises(SystemExit, match='2'):
                main.main([*check, str(out)])
            assert tree(tmp_path) == before
    check_free(new, overwrite=False, inputs=[])
    assert not new.parent.exists()


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


def test_of_a_link_to_a_folder_the_link_alone_is_replaced(tmp_path: Path) -> None:
    target, folder, source = (tmp_path / name for name in ('out.yaml', 'folder', 'mine.yaml'))
    fill(tmp_path, {'folder/file': 'mine', 'mine.yaml': 'mine'})
    with pytest.raises(InputError, match='found what is no file'):
        write_text(folder, 'new', overwrite=True)
    target.symlink_to(folder)
    write_text(target, 'new', overwrite=True)
    assert tree(tmp_path) == {'folder/file': 'mine', 'mine.yaml': 'mine', 'out.yaml': 'new'}
    with pytest.raises(InputError, match='another file than the one that is read'):
        write_text(folder / '..' / 'mine.yaml', 'new', overwrite=True, inputs=[source])


def test_columns_are_of_numbers_where_all_of_them_are() -> None:
    columns = {
        'whole': [1, 2], 'numbers': [1, 2.5], 'some': [1, None], 'none': [None, None],
        'gap': [math.nan, 1.0], 'words': ['a', None], 'truths': [True, False],
    }  # fmt: skip
    table = arrow_table(columns)
    kinds = [str(kind) for kind in table.schema.types]
    assert kinds == ['int64', 'double', 'double', 'double', 'double', 'string', 'bool']
    assert [table[name].null_count for name in columns] == [0, 0, 1, 2, 1, 1, 0]


@pytest.mark.parametrize('overwrite', [False, True])
@pytest.mark.parametrize(
    'kind', ['file', 'below a file', 'broken link', 'link to itself', 'long', 'no text']
)
def test_path_that_can_be_no_folder_is_refused(kind, overwrite, tmp_path) -> None:
    out = tmp_path / 'out'
    if kind in ('file', 'below a file'):
        out.write_text('mine')
    elif kind == 'broken link':
        out.symlink_to('gone/away')
    elif kind == 'link to itself':
        out.symlink_to('out')
    before = tree(tmp_path)
    names = {'long': 'n' * 300, 'no text': '\udcff'}  # the byte ff is no UTF-8
    asked = out / 'x' if kind == 'below a file' else tmp_path / names.get(kind, 'out')
    refused(asked, overwrite=overwrite)
    assert tree(tmp_path) == before
    assert not out.is_file() or out.read_text() == 'mine'


def test_folder_that_cannot_be_written_is_refused() -> None:
    refused(Path('/proc/auv'), overwrite=False)  # not even root makes a folder there


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in which a user keeps scenario and vehicle under the names that we use as well."""
    for module, work in ((recorded_runs, 'warm_up'), (scenario_runs, 'write_inputs')):
        monkeypatch.setattr(module, work, lambda *_: pytest.fail('work has begun'))
    shutil.copy(shipped('scenarios', 'case1'), tmp_path / 'scenario.yaml')
    shutil.copy(shipped('vehicles', 'herman2018'), tmp_path / 'vehicle.yaml')
    text = (tmp_path / 'scenario.yaml').read_text()
    table = 't,surge,sway,heave,roll,pitch,yaw\n0,0,0,0,0,0,0\n30,0,0,0,0,0,0\n'
    (tmp_path / 'setpoint.csv').write_text(table)
    text = text.replace('vehicle: herman2018', 'vehicle: vehicle.yaml')
    (tmp_path / 'scenario.yaml').write_text(text)
    return tmp_path


@pytest.mark.parametrize('listed', [False, True])
@pytest.mark.parametrize('command', ['simulate', 'run', 'linearize', 'atlas --only'])
def test_folder_that_holds_the_inputs_is_refused(command, listed, project, capsys) -> None:
    command, *options = command.split()
    if listed:  # as files of ours are, which may be replaced
        write_manifest(project, {path.name: sha256_of(path) for path in project.iterdir()})
    before = {path: path.read_text() for path in project.iterdir()}
    given = project / ('scenario.yaml' if command in ('simulate', 'run') else 'vehicle.yaml')
    arguments = [command, *options, str(given), '--out', str(project), '--overwrite']
    with pytest.raises(SystemExit) as end:
        main.main(arguments)
    lines = capsys.readouterr().err.splitlines()
    assert {path: path.read_text() for path in project.iterdir()} == before
    assert (end.value.code, len(lines)) == (2, 1)
    assert '--out: expected ' in lines[0]


@pytest.mark.parametrize('name', ['figures', 'summary.json', 'manifest.json', 'unfinished'])
def test_controller_may_not_be_named_like_our_files(name, project, capsys) -> None:
    path = project / 'scenario.yaml'
    path.write_text(path.read_text().replace('  gvc: {', f'  {name}: {{'))
    with pytest.raises(SystemExit) as end:
        main.main(['simulate', str(path), '--out', str(project / 'out')])
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
        main.main(['simulate', str(path), '--out', str(project / 'out')])
    lines = capsys.readouterr().err.splitlines()
    assert (end.value.code, len(lines)) == (2, 1)
    assert str(path) in lines[0]
    assert not (project / 'out').exists()


def test_a_link_anywhere_on_the_way_is_one(tmp_path: Path) -> None:
    (tmp_path / 'real/deep').mkdir(parents=True)
    for name in ('real/deep/file', 'link'):
        (tmp_path / name).symlink_to(tmp_path / 'real')
    assert [has_links(tmp_path, f'{name}/x/y') for name in ('real/deep', 'link')] == [False, True]
    assert [has_links(tmp_path, name) for name in ('real/deep', 'real/deep/file', 'link')] == [
        False, True, True,
    ]  # fmt: skip
