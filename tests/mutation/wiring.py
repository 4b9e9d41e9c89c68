"""What goes wrong where code wires; cosmic-ray's own operators are about formulas.

Two arguments, keys or names are mistaken for each other, a statement is missing, `min` stands for
`max`. What no test could overlook, such as a name that is not there, is left out.
"""

import re
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

from cosmic_ray.operators.operator import Operator
from parso.python.tree import Name

LISTS = ('arglist', 'testlist_comp', 'testlist', 'testlist_star_expr')
LITERALS = ('string', 'strings', 'number', 'keyword', 'lambdef', 'operator')
OPPOSITE = {'min': 'max', 'max': 'min', 'any': 'all', 'all': 'any'}
OPPOSITE |= {'minimum': 'maximum', 'maximum': 'minimum', 'argmin': 'argmax', 'argmax': 'argmin'}
# calls whose arguments, or one list of them, have no order; grade counts the parts of a claim
ORDERLESS = {*OPPOSITE, 'grade', 'allclose', 'array_equal'}
PLAIN = re.compile(r'[\'"]')  # begins a string that is neither formatted nor raw
Place = tuple[tuple[int, int], tuple[int, int]]


def _bare(node: Any) -> str:
    return str(node.get_code(include_prefix=False))


def _is_symmetric(node: Any) -> bool:
    """Whether a list is a comprehension, or none looks at its order: `in`, `min`, `grade`."""
    if any(one.type.endswith('comp_for') for one in node.children):
        return True
    holder = node.parent
    looked_into = node.type == 'testlist_comp' and holder.get_previous_leaf() == 'in'
    if looked_into and holder.parent.type == 'comparison':
        return True
    if node.type == 'testlist_comp' and holder.type == 'atom':
        holder = holder.parent  # a list that is the one argument
    called = holder.get_previous_leaf() if holder is not None else None
    return (
        node.type in ('arglist', 'testlist_comp')
        and (node.type == 'arglist' or holder.type == 'trailer')
        and called is not None
        and called.value in ORDERLESS
    )


class Wiring(Operator):
    """Changes nodes one by one; a mutant of each for which there is a change."""

    def __init__(self) -> None:
        self._leaves: list[Any] = []  # of the module, in order

    @classmethod
    def examples(cls) -> tuple[()]:
        """Pieces of code by which cosmic-ray tests its own operators."""
        return ()

    def leaves(self, node: Any) -> list[Any]:
        """All leaves of the module that a node is of."""
        if not self._leaves:
            leaf = node.get_root_node().get_first_leaf()
            while leaf is not None:
                self._leaves.append(leaf)
                leaf = leaf.get_next_leaf()
        return self._leaves

    def after(self, node: Any, alike: list[Any]) -> str | None:
        """Value of the first leaf behind a node, or from the beginning on, that has another one."""
        place = next(i for i, leaf in enumerate(alike) if leaf is node)
        values = [leaf.value for leaf in alike[place:] + alike[:place]]
        return next((value for value in values if value != node.value), None)

    def other(self, node: Any) -> str | None:
        """What the value of a leaf becomes; None: it stays."""
        return None

    def mutation_positions(self, node: Any) -> Iterator[Place]:
        """Where a leaf changes."""
        if not hasattr(node, 'children') and self.other(node) is not None:
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Change a leaf."""
        node.value = self.other(node)
        return node


class Exchange(Wiring):
    """Two neighbours of a call, tuple, list or text change places; of keywords the values do."""

    def _pairs(self, node: Any) -> list[tuple[Any, int, Any, int]]:
        """Parents and places of what is exchanged."""
        children = getattr(node, 'children', [])
        found = []
        if node.type == 'fstring':
            shown = [one for one in children if one.type == 'fstring_expr']
            pairs = [(one, 1, other, 1) for one, other in pairwise(shown)]
            return [pair for pair in pairs if self._exchangeable(pair)]
        if node.type == 'dictorsetmaker' and all(colon == ':' for colon in children[1::4]):
            found = [(node, i, node, k) for i, k in pairwise(range(2, len(children), 4))]
        elif node.type not in LISTS or _is_symmetric(node):
            return []
        for i, k in pairwise(range(0, len(children), 2) if not found else ()):
            one, other = children[i], children[k]
            if one.type == other.type == 'argument' and one.children[1] == other.children[1] == '=':
                found.append((one, 2, other, 2))
            elif 'argument' not in (one.type, other.type):
                found.append((node, i, node, k))
        return [pair for pair in found if self._exchangeable(pair)]

    @staticmethod
    def _exchangeable(pair: tuple[Any, int, Any, int]) -> bool:
        """Whether both are literals of one kind, or both expressions, and not the same."""
        a, i, b, k = pair
        ends = a.children[i], b.children[k]
        one, other = (end.type if end.type in LITERALS else _bare(end) == 'self' for end in ends)
        return one == other and _bare(ends[0]) != _bare(ends[1])

    def mutation_positions(self, node: Any) -> Iterator[Place]:
        """Where two neighbours are exchanged."""
        for a, i, b, k in self._pairs(node):
            yield a.children[i].start_pos, b.children[k].end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Exchange two neighbours, their blanks apart."""
        a, i, b, k = self._pairs(node)[index]
        one, other = a.children[i], b.children[k]
        first, second = one.get_first_leaf(), other.get_first_leaf()
        first.prefix, second.prefix = second.prefix, first.prefix
        a.children[i], b.children[k] = other, one
        return node


class OtherKey(Wiring):
    """A string becomes the next other one of the module; not a docstring, not a text of parts."""

    @staticmethod
    def _is_key(leaf: Any) -> bool:
        is_text = leaf.type != 'string' or leaf.parent.type in ('simple_stmt', 'strings')
        return not is_text and PLAIN.match(leaf.value) is not None and ' ' not in leaf.value

    def other(self, node: Any) -> str | None:
        """The next key, in the quotes of this one: it may stand in a text."""
        if not self._is_key(node):
            return None
        mark, mine = node.value[0], node.value[1:-1]
        keys = [leaf for leaf in self.leaves(node) if self._is_key(leaf)]
        place = next(i for i, leaf in enumerate(keys) if leaf is node)
        others = (leaf.value[1:-1] for leaf in keys[place:] + keys[:place])
        found = next((key for key in others if key != mine and mark not in key), None)
        return None if found is None else f'{mark}{found}{mark}'


class OtherName(Wiring):
    """An attribute becomes the next one of its owner that is alike: of a common word, or an axis.

    Constants are all alike. What is called stays called, what is assigned to is left alone.
    """

    @staticmethod
    def _owner(leaf: Any) -> tuple[str, bool, bool] | None:
        """Whose attribute a name is, whether it is called, and whether it is a constant."""
        trailer = leaf.parent
        if leaf.type != 'name' or trailer.type != 'trailer' or trailer.children[0] != '.':
            return None
        chain = trailer.parent.children
        place = next(i for i, one in enumerate(chain) if one is trailer)
        behind = trailer.get_next_leaf()
        if behind is not None and behind == '=' and place == len(chain) - 1:
            return None
        called = behind is not None and behind == '('
        return ''.join(map(_bare, chain[:place])), called, leaf.value.isupper()

    def other(self, node: Any) -> str | None:
        """The next name that is alike."""
        owner = self._owner(node)
        if owner is None:
            return None

        def alike(name: str) -> bool:
            words = {*name.strip('_').split('_')} & {*node.value.strip('_').split('_')}
            return bool(words) or owner[2] or len(name) == len(node.value) == 1

        leaves = [leaf for leaf in self.leaves(node) if self._owner(leaf) == owner]
        return self.after(node, [leaf for leaf in leaves if alike(leaf.value)])


class Opposite(Wiring):
    """`min` for `max`, `any` for `all`, and the other way round."""

    def other(self, node: Any) -> str | None:
        """The opposite."""
        follows = node.get_next_leaf()
        return OPPOSITE.get(node.value) if follows is not None and follows == '(' else None


class Drop(Wiring):
    """A statement is missing: a call, or the assignment of an attribute or of an element."""

    @staticmethod
    def _is_dropped(node: Any) -> bool:
        if node.parent is None or node.parent.type != 'simple_stmt':
            return False
        if node.type == 'expr_stmt':
            augments = not hasattr(node.children[1], 'value') or node.children[1].value != '='
            return augments or node.children[0].type in ('atom_expr', 'power')
        called = node.type in ('atom_expr', 'power') and node.children[-1].children[0] == '('
        return called and not _bare(node).startswith('super().__init__')

    def mutation_positions(self, node: Any) -> Iterator[Place]:
        """Where a statement is."""
        if self._is_dropped(node):
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Nothing in place of the statement."""
        return Name('pass', node.start_pos, node.get_first_leaf().prefix)


OPERATORS = {one.__name__: one for one in (Exchange, OtherKey, OtherName, Opposite, Drop)}
