"""What `auv` says without a command, by what lies where one is."""

import os
import re
from pathlib import Path

import pytest

from auv_analysis.cli import main
from auv_analysis.cli.main import COMMANDS, GROUPS

SRC, FILES = Path(__file__).resolve().parents[3] / 'src', ('setup.py', 'package.xml')


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _said(capsys: pytest.CaptureFixture) -> str:
    main.main([])
    captured = capsys.readouterr()
    assert captured.err == ''
    return captured.out


def test_where_nothing_was_run_the_first_experiments_are_proposed(folder, capsys):
    text = _said(capsys)
    for line in ('auv simulate case1', 'auv run case1', 'auv new vehicle', 'auv doctor'):
        assert line in text
    assert text.startswith('Nothing has been run here yet.')
    assert not list(folder.iterdir())


def test_results_are_proposed_to_be_looked_at_the_newest_first(folder, capsys):
    for name in ('first', 'second'):
        bag = folder / 'runs' / name / 'gvc'
        bag.mkdir(parents=True)
        for file in (
            bag / 'metadata.yaml',
            bag.parent / 'report.html',
            bag.parent / 'summary.json',
        ):
            file.touch()
    (folder / 'runs' / 'analyze_first').mkdir()  # a summary of other runs, none of its own
    (folder / 'runs' / 'analyze_first' / 'summary.json').touch()
    for age, name in enumerate(('analyze_first', 'first'), start=1):
        os.utime(folder / 'runs' / name, (9 - age, 9 - age))
    text = _said(capsys)
    assert text.startswith('What could come next:')
    assert 'auv new vehicle NAME' in text, 'as there is no file'
    assert 'runs/second/report.html' in text
    assert 'auv replay runs/second/gvc' in text
    assert 'auv analyze runs/first runs/second' in text
    assert 'what the sweep says' not in text
    (folder / 'runs' / 'second' / 'sweep.json').touch()
    assert re.search('auv analyze runs/second +what the sweep says', _said(capsys))
    assert 'simulate case1' not in text


@pytest.mark.parametrize(
    ('text', 'line'),
    [
        ('controllers: {}\n', 'auv simulate mine.yaml'),
        ('name: x\nrigid_body: {}\n', 'auv check-vehicle mine.yaml'),
        ('controllers: [gvc]\nvary: []\n', 'auv sweep mine.yaml'),
        ('colour: red\n', 'auv simulate case1'),
        ('\x00\ufffe', 'auv simulate case1'),
    ],
)
def test_files_at_hand_are_proposed_by_what_they_are(text, line, folder, capsys):
    (folder / 'mine.yaml').write_text(text)
    (folder / 'notes.txt').write_text('controllers: {}')
    said = _said(capsys)
    assert line in said
    assert ('mine.yaml' in said) != ('auv new vehicle NAME' in said)
    assert 'notes.txt' not in said


def test_what_is_proposed_can_be_typed(folder, capsys):
    (folder / 'my dive.yaml').write_text('controllers: {}\n')
    assert "auv simulate 'my dive.yaml'" in _said(capsys)


def test_of_many_files_a_few_are_proposed(folder, capsys):
    for number in range(5):
        (folder / f'{number}.yaml').write_text('controllers: {}\n')
    assert _said(capsys).count('auv simulate') == 3


def test_help_lists_every_command_once_below_a_heading(capsys):
    with pytest.raises(SystemExit) as end:
        main.main(['--help'])
    lines = capsys.readouterr().out.splitlines()
    assert end.value.code == 0
    assert [line.rstrip(':') for line in lines if line.endswith(':')] == list(GROUPS)
    assert [line.split()[0] for line in lines if line.startswith('  ')] == list(COMMANDS)
    assert max(map(len, lines)) <= 80


def test_version_is_the_one_of_all_packages(capsys):
    texts = [path.read_text() for name in FILES for path in SRC.glob(f'*/{name}')]
    (version,) = {re.search(r"version(?:='|>)([\d.]+)", text)[1] for text in texts}
    main.main(['--version'])
    assert capsys.readouterr().out == f'auv_gvc {version}\n'
