"""Which mutants there are: cosmic-ray's, where they are mathematics, always in one order.

Not mathematics: annotations, decorators, what an f-string or a `raise` says. Left out as well is
what fails in every test that reaches it, or what another mutant does already: they would only
flatter the ratio.
"""

import ast
import re
from pathlib import Path

from cosmic_ray.commands.init import _all_work_items
from cosmic_ray.work_item import MutationSpec

SPARED = re.compile(
    r'_(RShift|LShift|BitXor|FloorDiv|Mod)$'  # floats know no bits; // and % are far from / and *
    r'|_(Add|Sub|Mul|Div|Pow|FloorDiv|Mod)_Bit(Or|And)$'
    r'|_BitOr_'  # between types and between dicts
    r'|_USub_(Invert|Not)$|_Delete_USub$'  # the last is _USub_UAdd again
    r'|_(Eq|NotEq|Lt|LtE|Gt|GtE)_Is(Not)?$'  # identity of numbers
    r'|/RemoveDecorator$'
)


def mutants(paths: list[Path]) -> list[MutationSpec]:
    """Mutants of some files, by file, place and operator."""
    found = []
    for path in paths:
        spared = _spared_places(ast.parse(path.read_text(encoding='utf-8')))
        for item in _all_work_items([path], {}):
            (mutant,) = item.mutations
            inside = any(first <= mutant.start_pos < last for first, last in spared)
            if not inside and not SPARED.search(mutant.operator_name):
                found.append(mutant)
    return sorted(found, key=lambda m: (m.module_path, m.start_pos, m.operator_name, m.occurrence))


def _spared_places(tree: ast.Module) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """(line, column) from and up to which nothing is mutated."""
    parts: list[ast.AST | None] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            parts += node.decorator_list
        if isinstance(node, ast.FunctionDef):
            parts.append(node.returns)
        if isinstance(node, ast.arg | ast.AnnAssign):
            parts.append(node.annotation)
        if isinstance(node, ast.JoinedStr | ast.Raise):
            parts.append(node)
    return [
        ((part.lineno, part.col_offset), (part.end_lineno, part.end_col_offset))
        for part in parts
        if part is not None
    ]
