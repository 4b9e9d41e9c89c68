"""The table of faults names tests that exist."""

import re
from pathlib import Path

TESTS = Path(__file__).parents[1]
TABLE = TESTS.parent / 'docs' / 'safety.md'
NAMED = re.compile(r'`([a-z_0-9/]+\.py)(?:::(test_\w+))?`')
ROWS = re.compile(r'^\|(?! *-|--)(.*)\|$', re.MULTILINE)


def test_every_row_names_tests_that_exist() -> None:
    rows = [row for row in ROWS.findall(TABLE.read_text()) if not row.rstrip().endswith('| test')]
    rows = [row for row in rows if row.strip() != 'theme | test']
    assert len(rows) > 50
    for row in rows:
        named = NAMED.findall(row)
        assert named, f'no test: {row}'
        for file, test in named:
            path = TESTS / file
            assert path.is_file(), file
            assert f'def {test}(' in path.read_text() or not test, f'{file}::{test}'
