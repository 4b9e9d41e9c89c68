"""What sources import. Looked for among statements: most of a syntax tree is expressions."""

import ast
from collections.abc import Iterator
from pathlib import Path


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    for one in ast.iter_child_nodes(node):
        if not isinstance(one, ast.expr):
            yield one
            yield from _statements(one)


def imports(path: Path) -> Iterator[tuple[str, list[str]]]:
    """Modules that a file imports, inside functions as well, and the names it takes from each."""
    for node in _statements(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, []) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module, [alias.name for alias in node.names]
