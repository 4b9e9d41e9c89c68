"""What stands beside the code: steps for contributors, hooks, help, citation, container."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from helpers.needs import need

ROOT = Path(__file__).resolve().parents[2]
CONTRIBUTING = (ROOT / 'CONTRIBUTING.md').read_text()
BIN = Path(sys.executable).parent


def recipes() -> dict[str, tuple[int, str]]:
    """Heading -> number of steps that it promises, and its text."""
    found = re.findall(r'^## Add ([^\n]+), in (\d) steps\n(.*?)(?=^## )', CONTRIBUTING, re.M | re.S)
    return {name: (int(count), text) for name, count, text in found}


def test_there_are_steps_for_what_people_add() -> None:
    assert list(recipes()) == ['a vehicle', 'a law', 'a disturbance', 'a node']


@pytest.mark.parametrize('name', recipes())
def test_steps_are_counted(name: str) -> None:
    count, text = recipes()[name]
    assert [int(n) for n in re.findall(r'^(\d)\. ', text, re.M)] == list(range(1, count + 1))


def test_files_that_are_named_exist() -> None:
    named = set(
        re.findall(r'`((?:src|tests|config|docs|examples|\.)[\w./-]*/[\w.-]+)`', CONTRIBUTING)
    )
    assert len(named) > 20
    assert not [path for path in named if not (ROOT / path).exists()]


def test_names_in_files_exist() -> None:
    """`NAME` of or in `path`: the file has it."""
    listed = re.findall(r'((?:`\w+`(?:, | and )?)+)\s+(?:of|in)\s+`([\w./-]+\.py)`', CONTRIBUTING)
    assert len(listed) > 3
    for names, path in listed:
        text = (ROOT / path).read_text()
        assert not [n for n in re.findall(r'`(\w+)`', names) if not re.search(rf'\b{n}\b', text)]


def test_help_explains_every_target() -> None:
    makefile = (ROOT / 'Makefile').read_text()
    targets = ' '.join(re.findall(r'^\.PHONY: (.*)$', makefile, re.M)).split()
    lines = subprocess.run(
        ['make', '--no-print-directory', 'help'], cwd=ROOT, capture_output=True, text=True,
        check=True,
    ).stdout.splitlines()  # fmt: skip
    explained = [re.match(r'([\w -]+?) {2,}\S', line) for line in lines]
    assert sorted(targets) == sorted(' '.join(m[1] for m in explained if m).split())


def test_hooks_run_what_lint_runs_from_the_environment() -> None:
    hooks = yaml.safe_load((ROOT / '.pre-commit-config.yaml').read_text())['repos']
    assert [entry['repo'] for entry in hooks] == ['local']  # so no version stands there
    entries = [hook['entry'] for hook in hooks[0]['hooks']]
    assert all(entry.startswith('.venv/bin/') for entry in entries)
    lint = re.search(r'^lint:.*\n((?:\t.*\n)+)', (ROOT / 'Makefile').read_text(), re.M)[1]
    wanted = re.findall(r'\$\(BIN\)/(\S+(?: \w+)?)', lint)
    assert wanted
    assert not [w for w in wanted if f'.venv/bin/{w}' not in entries]


def test_citation_names_the_paper_of_the_readme() -> None:
    cited = yaml.safe_load((ROOT / 'CITATION.cff').read_text())
    assert {'cff-version', 'message', 'title', 'authors'} <= cited.keys()  # what CFF 1.2 requires
    assert cited['license'] == 'Apache-2.0'
    paper = cited['preferred-citation']
    assert {'type', 'title', 'authors'} <= paper.keys()
    readme = ' '.join((ROOT / 'README.md').read_text().split())
    author = paper['authors'][0]
    given = f'{author["given-names"]} {author["family-names"]}'
    assert f'{given}, *{paper["title"]}*, {paper["journal"]}, {paper["year"]}' in readme


def test_container_is_linted() -> None:
    linter = BIN / 'hadolint'
    need('hadolint', linter.exists())
    done = subprocess.run(
        [linter, ROOT / 'Dockerfile'], capture_output=True, text=True, check=False
    )
    assert done.stdout + done.stderr == ''


def test_container_takes_nothing_that_is_made_here() -> None:
    text = (ROOT / 'Dockerfile').read_text()
    assert re.search(r'^FROM ros:jazzy', text, re.M)
    ignored = (ROOT / '.dockerignore').read_text().split()
    made = [line.strip('/') for line in (ROOT / '.gitignore').read_text().split()]
    folders = [
        name for name in made if name in ('.venv', 'build', 'dist', 'install', 'log', 'runs')
    ]
    assert len(folders) == 6
    assert set(folders) < set(ignored)


def test_every_approved_text_belongs_to_a_test() -> None:
    for path in (ROOT / 'tests').rglob('approved/*.txt'):
        tests = (path.parents[1] / f'test_{path.stem}.py').read_text(encoding='utf-8')
        names = re.findall(r'^=== (\w+)', path.read_text(encoding='utf-8'), re.M)
        assert names, path
        assert not [name for name in names if f'def {name}(' not in tests], path
