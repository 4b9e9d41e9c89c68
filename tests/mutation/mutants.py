"""Which mutants there are: cosmic-ray's of formulas, `wiring`'s beside some of them elsewhere.

Always in one order. Left out are annotations, decorators, what an f-string, a `raise` or a log
says, how long somebody has patience, and what fails in every test that reaches it or does what
another mutant does already: they would only flatter the ratio.
"""

import ast
import re
from pathlib import Path

from cosmic_ray.commands.init import _all_work_items
from cosmic_ray.plugins import OPERATOR_PROVIDERS
from cosmic_ray.work_item import MutationSpec
from wiring import OPERATORS

OPERATOR_PROVIDERS['wiring'] = OPERATORS

Place = tuple[tuple[int, int], tuple[int, int]]
SPARED = re.compile(
    r'_(RShift|LShift|BitXor|FloorDiv|Mod)$'  # floats know no bits; // and % are far from / and *
    r'|_(Add|Sub|Mul|Div|Pow|FloorDiv|Mod)_Bit(Or|And)$'
    r'|_BitOr_'  # between types and between dicts
    r'|_USub_(Invert|Not)$|_Delete_USub$'  # the last is _USub_UAdd again
    r'|_(Eq|NotEq|Lt|LtE|Gt|GtE)_Is(Not)?$'  # identity of numbers
    r'|/RemoveDecorator$'
)
SWAPPED = re.compile(  # of wiring: of many ways to break an operator, the next one
    r'BinaryOperator_(?!(Add_Sub|Sub_Add|Mul_Div|Div_Mul|Mod_FloorDiv|FloorDiv_Mod)$)'
    r'|ComparisonOperator_(?!(Lt_LtE|LtE_Lt|Gt_GtE|GtE_Gt|Lt_Gt|Gt_Lt|LtE_GtE|GtE_LtE|Eq_NotEq'
    r'|NotEq_Eq|Is_IsNot|IsNot_Is|In_NotIn|NotIn_In)$)'
)
TOLD = {'begin', 'info', 'warning', 'error', 'print', 'get_logger', 'InputError'}  # to people
PATIENCE = re.compile(r'^[A-Z_, ]+ = .*  # s\b')  # a constant: how long is for people to judge


def mutants(paths: list[Path], wiring: set[Path]) -> list[MutationSpec]:
    """Mutants of some files, by file, place and operator; `wiring`: those that are no formulas."""
    found = []
    for path in paths:
        source = path.read_text(encoding='utf-8')
        tree = ast.parse(source)
        spared = _spared_places(tree) + (_told_places(tree, source) if path in wiring else [])
        for item in _all_work_items([path], {}):
            (mutant,) = item.mutations
            name = mutant.operator_name
            inside = any(first <= mutant.start_pos < last for first, last in spared)
            foreign = SWAPPED.search(name) if path in wiring else name.startswith('wiring/')
            if not inside and not foreign and not SPARED.search(name):
                found.append(mutant)
    return sorted(found, key=lambda m: (m.module_path, m.start_pos, m.operator_name, m.occurrence))


def _told_places(tree: ast.Module, source: str) -> list[Place]:
    """Places of what is said to people, and of how long somebody has patience."""
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    said = [
        ((call.lineno, call.col_offset), (call.end_lineno or 0, call.end_col_offset or 0))
        for call in calls
        if getattr(call.func, 'attr', getattr(call.func, 'id', '')) in TOLD
    ]
    lines = enumerate(source.splitlines(), start=1)
    return said + [((k, 0), (k + 1, 0)) for k, line in lines if PATIENCE.match(line)]


def _spared_places(tree: ast.Module) -> list[Place]:
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
