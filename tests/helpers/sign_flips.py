"""Source with one sign turned: what a slip of the pen would leave, to see whether tests notice.

A sign is a binary + or -, a unary minus, += or -=, and a call of `add` or `sub`, which is how the
kernel writes + and - between 6-vectors. The source runs as plain Python, without numba.
"""

import ast
import importlib.util
from collections.abc import Collection, Iterator
from pathlib import Path
from types import SimpleNamespace

from auv_dynamics.kernel import six

JIT = ('helper', 'compiled', 'specialised')
OPPOSITE = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.USub: ast.UAdd, ast.UAdd: ast.USub}
SWAPPED = {'add': 'sub', 'sub': 'add'}


def is_sign(node: ast.AST) -> bool:
    """Whether a node is a sign of a formula."""
    if isinstance(node, ast.BinOp | ast.AugAssign):
        return type(node.op) in OPPOSITE
    if isinstance(node, ast.UnaryOp):
        return isinstance(node.op, ast.USub)
    return isinstance(node, ast.Call) and getattr(node.func, 'id', '') in SWAPPED


def flip(node: ast.AST) -> None:
    """Turn the sign, in place; a second time, back."""
    if isinstance(node, ast.BinOp | ast.AugAssign | ast.UnaryOp):
        node.op = OPPOSITE[type(node.op)]()
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        node.func.id = SWAPPED[node.func.id]


def source_of(module: str) -> Path:
    """Path of a module's source."""
    spec = importlib.util.find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin)


def definitions(tree: ast.Module, names: Collection[str]) -> list[ast.AST]:
    """Functions, methods (`Class.method`) and constants of a module by their names."""
    found: dict[str, ast.AST] = {}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            found[node.name] = node
        elif isinstance(node, ast.ClassDef):
            methods = (part for part in node.body if isinstance(part, ast.FunctionDef))
            found |= {f'{node.name}.{method.name}': method for method in methods}
        elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            found[node.targets[0].id] = node
    missing = [name for name in names if name not in found]
    assert not missing, missing
    return [found[name] for name in names]


def signs(tree: ast.Module, names: Collection[str]) -> list[ast.AST]:
    """Signs of some definitions, always in the same order."""
    return [node for part in definitions(tree, names) for node in ast.walk(part) if is_sign(node)]


def name_of(decorator: ast.expr) -> str:
    """Name of a decorator, with or without arguments."""
    return getattr(getattr(decorator, 'func', decorator), 'id', '')


def parsed(module: str) -> ast.Module:
    """Syntax tree of a module without numba's decorators."""
    tree = ast.parse(source_of(module).read_text(encoding='utf-8'))
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            node.decorator_list = [d for d in node.decorator_list if name_of(d) not in JIT]
    return tree


def run(tree: ast.Module, module: str) -> SimpleNamespace:
    """What a module defines, run from its syntax tree."""
    scope = {'__name__': module, 'add': six.add, 'sub': six.sub}  # one may not be imported there
    exec(compile(tree, str(source_of(module)), 'exec'), scope)
    return SimpleNamespace(**scope)


def as_written(module: str) -> SimpleNamespace:
    """The module without numba and with every sign as it is."""
    return run(parsed(module), module)


def with_one_flipped(module: str, names: Collection[str]) -> Iterator[tuple[str, SimpleNamespace]]:
    """The module with one sign turned, for every sign of some of its definitions.

    Yields
    ------
    place : file, line, column and text of the sign
    variant : what the module then defines

    """
    tree = parsed(module)
    for node in signs(tree, names):
        place = f'{module}:{node.lineno}:{node.col_offset}: {ast.unparse(node)[:60]}'
        flip(node)
        yield place, run(tree, module)
        flip(node)
