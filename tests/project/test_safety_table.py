"""The table of faults names tests that exist, and that `make test` runs unless it says who does."""

import ast
import re
from functools import cache
from pathlib import Path

TESTS = Path(__file__).parents[1]
TABLE = TESTS.parent / 'docs' / 'safety.md'
NAMED = re.compile(r'`([a-z_0-9/]+\.py)(?:::(test_\w+))?`(?: \(`make (\w+)`\))?')
ROWS = re.compile(r'^\|(?! *-|--)(.*)\|$', re.MULTILINE)
LONG = {'soak', 'nightly'}  # targets that run what is marked `long`


@cache
def left_out(path: Path) -> dict[str, bool]:
    """Tests of a file -> whether it, or some of its cases alone, are left out of `make test`."""
    tree = ast.parse(path.read_text(encoding='utf-8'))
    whole = any(
        'mark.long' in ast.unparse(node) and ast.unparse(node).startswith('pytestmark')
        for node in tree.body
    )
    return {
        node.name: whole or any(ast.unparse(d) == 'pytest.mark.long' for d in node.decorator_list)
        for node in tree.body
        if isinstance(node, ast.FunctionDef)
    }


def test_every_row_names_tests_that_exist_and_are_run() -> None:
    rows = [row for row in ROWS.findall(TABLE.read_text()) if not row.rstrip().endswith('| test')]
    rows = [row for row in rows if row.strip() != 'theme | test']
    assert len(rows) > 50
    for row in rows:
        named = NAMED.findall(row)
        assert named, f'no test: {row}'
        for file, test, target in named:
            path = TESTS / file
            assert path.is_file(), file
            known = left_out(path)
            assert test in known or not test, f'{file}::{test}'
            long = known[test] if test else all(known.values())
            assert (target in LONG) == long, f'{file}::{test} is run by `make {target or "test"}`'
