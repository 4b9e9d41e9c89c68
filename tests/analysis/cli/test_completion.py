"""What the TAB key offers, asked as the shell asks."""

import os
import shutil
import subprocess
import sys
from itertools import count, takewhile
from pathlib import Path

import argcomplete
import pytest
from argcomplete import CompletionFinder as Finder
from helpers.needs import need

from auv_analysis.cli import main
from auv_analysis.cli.completion import complete
from auv_analysis.cli.tune import LAWS
from auv_gvc_controller.laws import OPEN_LOOP
from auv_gvc_controller.laws.law import SHIPPED

AUV = Path(sys.executable).with_name('auv')
SCENARIO = 'controllers:\n  first: {law: gvc}\n  "second one": {law: cl}\n'


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """A folder with files of a user."""
    (tmp_path / 'mine.yaml').write_text(SCENARIO)
    for ending in ('yml', 'mcap'):
        (tmp_path / f'mine.{ending}').touch()
    return tmp_path


def _offered(line: str, folder: Path) -> list[str]:
    answer = folder / 'answer'
    asked = {
        '_ARGCOMPLETE': '1', '_ARGCOMPLETE_IFS': '\n', 'COMP_LINE': line,
        'COMP_POINT': str(len(line)), '_ARGCOMPLETE_STDOUT_FILENAME': str(answer),
    }  # fmt: skip
    subprocess.run([AUV], cwd=folder, env={**os.environ, **asked}, check=False)
    text = answer.read_text()
    answer.unlink()
    return [entry.strip() for entry in text.split('\n')]


@pytest.mark.parametrize(
    ('line', 'offered'),
    [
        ('auv simul', {'simulate'}),
        ('auv analyze mi', {'mine.mcap', 'mine.yaml', 'mine.yml'}),
        ('auv simulate mine.yaml --controller f', {'first'}),
    ],
)
def test_names_are_offered(line: str, offered: set[str], own: Path) -> None:
    assert set(_offered(line, own)) == offered


@pytest.mark.parametrize(
    ('line', 'offered'),
    [
        ('run case1_b', {'case1_bluerov2', 'case1_bluerov2_heavy'}),
        ('simulate mi', {'mine.yaml', 'mine.yml'}),
        ('atlas herman', {'herman2018', 'herman2018_neutral'}),
        ('linearize case1_b', {'case1_bluerov2', 'case1_bluerov2_heavy'}),
        ('check-vehicle herman', {'herman2018', 'herman2018_neutral'}),
        ('sweep case1', {'case1_gains'}),
        ('run case1 --controller ', {'gvc', 'cl'}),
        ('tune case1 --reference ', {'gvc', 'cl'}),
        ('tune case1 --law s', {'smc'}),
        ('design rexrov --red', {'--reduce'}),
    ],
)
def test_each_argument_offers_its_names(
    line: str, offered: set[str], own: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the library that answers the shell, in this process."""
    monkeypatch.chdir(own)
    finders = list[Finder]()
    monkeypatch.setattr(argcomplete, 'autocomplete', lambda it: finders.append(Finder(it)))
    complete(main.parser())
    found = takewhile(bool, (finders[0].rl_complete(line, state) for state in count()))
    before = line.rpartition(' ')[0]
    assert {match.removeprefix(before).strip() for match in found} == offered


def test_without_a_readable_scenario_no_controller_is_offered(tmp_path: Path) -> None:
    assert _offered('auv run gone.yaml --controller ', tmp_path) in ([], [''])


def test_laws_on_the_command_line_are_those_that_track() -> None:
    assert tuple(SHIPPED) == (*LAWS, OPEN_LOOP)


@pytest.mark.parametrize('shell', ['bash', 'zsh', 'fish'])
def test_code_is_valid_in_its_shell(shell: str, capsys: pytest.CaptureFixture) -> None:
    main.main(['completion', shell])
    code = capsys.readouterr().out
    assert 'auv' in code
    need(shell, shutil.which(shell))
    subprocess.run([shell, '-n'], input=code, text=True, check=True)


def test_light_commands_load_no_numpy() -> None:
    code = (
        'import sys; from auv_analysis.cli.main import parser; parser()\n'
        'import auv_analysis.cli.completion, auv_analysis.cli.guide, auv_analysis.cli.doctor\n'
        'assert not {"numpy", "rich", "jsonschema", "rclpy"} & set(sys.modules), sys.modules'
    )
    subprocess.run([sys.executable, '-c', code], check=True)
