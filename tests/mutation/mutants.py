"""Which mutants there are: cosmic-ray's of formulas, `wiring`'s beside some of them elsewhere.

Always in one order. Left out are annotations, decorators, what a `raise` or a log says, how long
somebody has patience, how a plot is laid out, and what fails in every test that reaches it or does
what another mutant does already: they would only flatter the ratio.
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
# a name of one is annotation
TYPES = {'Callable', 'Literal', 'Mapping', 'Sequence', 'dict', 'list', 'tuple'}
TOLD = {'begin', 'info', 'warning', 'error', 'print', 'get_logger', 'InputError'}  # to people
WAITED = {'wait_for_all_acked'}  # for how long
REPEATED = {'steady_timer'}  # the second argument: how often
JUDGED = re.compile(  # constants: how long, how large and in which colour is for people to judge
    r"^[A-Z_, ]+(: .*)? = .*  # (s|steps|in|px|opacity)\b|^[A-Z_, ]+ = \(?'#|^(STYLE|DASHES)\b"
)
LAYOUT = re.compile(  # keywords: how large, how faint, where the name of something stands
    r'(line|eline|edge|markeredge)widths?|lw|(font|label|marker|cap)size|s|fontweight'
    r'|\w*rotation|handlelength|loc|location|bbox_to_anchor|ncols|zorder|alpha|ha|va'
    r'|height|(width|height)_ratios|aspect|fraction|shrink|linscale|interpolation|textcoords|xytext'
    r'|\w+_alpha|rasterized|squeeze|no_wrap|overflow|justify|highlight|optimize|strict|digits|autohide'
    r'|level|\w*_font_\w+|minor_tick_line_color'
    r'|width|x_offset|pad|padding|spacing|(glyph|label)_height|glyph_width|min_border_left|toolbar_location|sizing_mode'
)
COLOUR = re.compile(r'\w*colou?rs?|hatch|fmt')  # keywords whose value, where it is a text, is taste
LAYS_OUT = {  # calls
    'new_figure', 'ConstrainedLayoutEngine', 'tick_params', 'margins', 'set_visible', 'grid',
    'set_minor_locator', 'LogLocator', 'minorticks_off', '_small_heads', 'set_axis_off',
    'set_edgecolor', 'set_alpha',
}  # fmt: skip
KEYWORDS_FOLLOW = re.compile(r'\*,')  # a star of a signature, which is no product
DASHED = re.compile(r'\(0, \([\d., ]+\)\)')  # lengths of the dashes of a line
ROUNDED = {'number', 'plain', 'fixed'}  # calls: a value, and its digits


def mutants(paths: list[Path], wiring: set[Path]) -> list[MutationSpec]:
    """Mutants of some files, by file, place and operator; `wiring`: those that are no formulas."""
    found = []
    for path in paths:
        source = path.read_text(encoding='utf-8')
        tree, lines = ast.parse(source), source.splitlines()
        parts = _no_code(tree) + (_judged(tree, source) if path in wiring else _texts(tree))
        spared = [_place(part, lines) for part in parts if part is not None]
        for item in _all_work_items([path], {}):
            (mutant,) = item.mutations
            name = mutant.operator_name
            row, column = mutant.start_pos
            inside = any(first <= mutant.start_pos < last for first, last in spared)
            inside |= bool(KEYWORDS_FOLLOW.match(lines[row - 1], column))
            foreign = SWAPPED.search(name) if path in wiring else name.startswith('wiring/')
            if not inside and not foreign and not SPARED.search(name):
                found.append(mutant)
    return sorted(found, key=lambda m: (m.module_path, m.start_pos, m.operator_name, m.occurrence))


def _place(part: ast.AST, lines: list[str]) -> Place:
    """(line, column) from and up to which nothing is mutated; `ast` counts columns in bytes."""
    ends = (part.lineno, part.col_offset), (part.end_lineno, part.end_col_offset)
    return tuple((n, len(lines[n - 1].encode()[:byte].decode())) for n, byte in ends)


def _no_code(tree: ast.Module) -> list[ast.AST | None]:
    """Decorators, annotations and names of types, errors."""
    parts: list[ast.AST | None] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            parts += node.decorator_list
        if isinstance(node, ast.FunctionDef):
            parts.append(node.returns)
        if isinstance(node, ast.arg | ast.AnnAssign):
            parts.append(node.annotation)
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Subscript):
            kind = getattr(node.value.value, 'id', '')
            parts.append(node.value if kind in TYPES else None)
        if isinstance(node, ast.Raise):
            parts.append(node)
        if isinstance(node, ast.ExceptHandler):
            parts.append(node.type)  # one of several is caught in any order
    return parts


def _texts(tree: ast.Module) -> list[ast.AST | None]:
    return [node for node in ast.walk(tree) if isinstance(node, ast.JoinedStr)]


def _judged(tree: ast.Module, source: str) -> list[ast.AST | None]:
    """What is said to people, how long and how often somebody waits, how a plot is laid out."""
    lines = source.splitlines()
    parts: list[ast.AST | None] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign | ast.AnnAssign) and JUDGED.search(lines[node.lineno - 1]):
            parts.append(node)
        if isinstance(node, ast.Assign) and LAYOUT.fullmatch(getattr(node.targets[0], 'attr', '')):
            parts.append(node)
        if isinstance(node, ast.Tuple) and DASHED.fullmatch(ast.unparse(node)):
            parts.append(node)
        if isinstance(node, ast.Dict):
            keys = [getattr(key, 'value', None) for key in node.keys]
            named = list(zip(keys, node.values, strict=True))
        elif isinstance(node, ast.Call):
            name = getattr(node.func, 'attr', getattr(node.func, 'id', ''))
            parts += [node] if name in TOLD | WAITED | LAYS_OUT else []
            parts += node.args[1:] if name in ROUNDED else []
            parts += node.args[1:2] if name in REPEATED else []
            named = [(keyword.arg, keyword.value) for keyword in node.keywords]
        elif isinstance(node, ast.arguments):
            args = [*node.args[len(node.args) - len(node.defaults) :], *node.kwonlyargs]
            values = [*node.defaults, *node.kw_defaults]
            named = [(a.arg, value) for a, value in zip(args, values, strict=True) if value]
        else:
            continue
        for key, value in named:
            words, literal = str(key), isinstance(value, ast.Constant)
            if LAYOUT.fullmatch(words) or (literal and COLOUR.fullmatch(words)):
                parts.append(value)
    return parts
