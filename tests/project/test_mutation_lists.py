"""What `make mutation` reads names files, tests and lines that are there."""

import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MUTATION = ROOT / 'tests' / 'mutation'


def listed(name: str) -> dict:
    return tomllib.loads((MUTATION / name).read_text(encoding='utf-8'))


def test_files_and_tests_are_there() -> None:
    stages = listed('mutation.toml')
    folders = stages['others']
    assert all((ROOT / 'src' / folder).is_dir() for folder in folders)
    assert all((ROOT / 'tests' / test).is_dir() for own in folders.values() for test in own)
    named = stages['quick'].keys() - {'others'}
    files = {file: tests for kind in named for file, tests in stages[kind].items()}
    assert set(stages) == {'wiring', 'compiled', 'quick', *stages['quick']}
    assert {*stages['wiring'], *stages['compiled']} < {*stages['quick']}
    tests = [test for named in (*files.values(), *stages['quick'].values()) for test in named]
    assert not [file for file in files if not (ROOT / 'src' / file).is_file()]
    assert not [test for test in tests if not (ROOT / 'tests' / test.split('::')[0]).is_file()]


def test_lines_of_equivalent_mutants_are_there() -> None:
    for entry in listed('equivalent.toml')['equivalent']:
        text = (ROOT / 'src' / entry['file']).read_text(encoding='utf-8')
        for line, _ in entry['mutants']:
            assert line.splitlines()[0].strip() in text, entry['file']
