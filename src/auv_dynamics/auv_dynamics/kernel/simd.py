"""Lanes as numba compiles them: a number of several vehicles is one value in a vector register.

`Lane` is that value, `Choice` a comparison of two. An array of lanes is a numba array with `Lane`
as its element, so that indexing, slicing and assignment are numba's own. What numba does not offer
in its public interface stands here. The module is optional: without it, as without numba, every
vehicle is computed alone.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from llvmlite.binding import get_host_cpu_features
from numba import types
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model

from auv_dynamics.kernel import jit, lanes
from auv_dynamics.kernel.compile import overloaded

LANES = 8 if get_host_cpu_features().get('avx512f') else 4  # float64 in a vector register
CONTRACT = ('contract',)  # as in compile.OPTIONS: a product may be fused with the sum that follows
REGISTER = ir.VectorType(ir.DoubleType(), LANES)
CHOICES = ir.VectorType(ir.IntType(1), LANES)
INDEX = ir.IntType(32)


class LaneType(types.Type):
    """`LANES` float64 in one register; a float counts as the same number in all lanes."""

    def __init__(self) -> None:
        super().__init__(name=f'float64x{LANES}')

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """Let floats and whole numbers stand where lanes are expected."""
        return Conversion.safe if isinstance(other, types.Float | types.Integer) else None


class ChoiceType(types.Type):
    """`LANES` truth values."""

    def __init__(self) -> None:
        super().__init__(name=f'boolx{LANES}')


Lane, Choice = LaneType(), ChoiceType()


@register_model(LaneType)
class _LaneModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Any):
        super().__init__(dmm, fe_type, REGISTER)


@register_model(ChoiceType)
class _ChoiceModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Any):
        super().__init__(dmm, fe_type, CHOICES)


@lower_cast(types.Float, LaneType)
@lower_cast(types.Integer, LaneType)
def _cast(context: Any, builder: Any, fromty: Any, toty: Any, value: Any) -> Any:
    number = context.cast(builder, value, fromty, types.float64)
    one = builder.insert_element(ir.Constant(REGISTER, ir.Undefined), number, INDEX(0))
    every = ir.Constant(ir.VectorType(INDEX, LANES), [0] * LANES)
    return builder.shuffle_vector(one, ir.Constant(REGISTER, ir.Undefined), every)


def _lower(function: Any, result: Any, expected: tuple[Any, ...], emit: Callable[..., Any]) -> None:
    """Let a function of these arguments, numbers among them cast to lanes, be an instruction."""

    def fits(kind: Any, wanted: Any) -> bool:
        return kind == wanted or (wanted == Lane and isinstance(kind, types.Float | types.Integer))

    @infer_global(function)
    class _Template(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            has_lanes = Lane in args or Choice in args
            if has_lanes and len(args) == len(expected) and all(map(fits, args, expected)):
                return signature(result, *expected)
            return None

    @lower_builtin(function, *expected)
    def _generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return emit(builder, *args)


def _intrinsic(name: str) -> Callable[..., Any]:
    """The LLVM intrinsic function of this name, of lanes."""

    def emit(builder: Any, value: Any) -> Any:
        full = f'llvm.{name}.v{LANES}f64'
        kind = ir.FunctionType(REGISTER, [REGISTER])
        known = builder.module.globals.get(full)
        return builder.call(known or ir.Function(builder.module, kind, full), [value])

    return emit


def _any(builder: Any, value: Any) -> Any:
    bits = ir.IntType(LANES)
    return builder.icmp_unsigned('!=', builder.bitcast(value, bits), bits(0))


for _name, _operations in {
    'fadd': (operator.add, operator.iadd),
    'fsub': (operator.sub, operator.isub),
    'fmul': (operator.mul, operator.imul),
    'fdiv': (operator.truediv, operator.itruediv),
}.items():
    for _operation in _operations:
        _lower(
            _operation, Lane, (Lane, Lane),
            lambda builder, a, b, name=_name: getattr(builder, name)(a, b, flags=CONTRACT),
        )  # fmt: skip
for _operation, _sign in (
    (operator.lt, '<'),
    (operator.le, '<='),
    (operator.gt, '>'),
    (operator.ge, '>='),
    (operator.eq, '=='),
):
    _lower(
        _operation, Choice, (Lane, Lane),
        lambda builder, a, b, sign=_sign: builder.fcmp_ordered(sign, a, b),
    )  # fmt: skip
_lower(operator.ne, Choice, (Lane, Lane), lambda builder, a, b: builder.fcmp_unordered('!=', a, b))
_lower(operator.neg, Lane, (Lane,), lambda builder, a: builder.fneg(a))
_lower(abs, Lane, (Lane,), _intrinsic('fabs'))
_lower(lanes.sqrt, Lane, (Lane,), _intrinsic('sqrt'))
_lower(lanes.sin, Lane, (Lane,), _intrinsic('sin'))
_lower(lanes.anywhere, types.boolean, (Choice,), _any)
_lower(lanes.select, Lane, (Choice, Lane, Lane), lambda builder, c, a, b: builder.select(c, a, b))


@intrinsic
def _lanes_of(typingctx, value, b):
    """Lanes (...,) of one block of arrays (blocks, ..., LANES)."""
    result = jit.viewed(value, 2, Lane)

    def generate(context, builder, signature, arguments):
        return jit.view(context, builder, (value, result), *arguments)

    return result(value, types.intp), generate


@intrinsic
def _align_stack(typingctx):
    """A place on the stack that must be aligned: LLVM then also aligns what it spills."""

    def generate(context, builder, signature, arguments):
        with builder.goto_entry_block():
            place = builder.alloca(REGISTER)
            place.align = lanes.ALIGNMENT
            kind = ir.FunctionType(ir.VoidType(), [place.type])
            builder.asm(kind, '', 'r', [place], side_effect=True)  # no code, but it is used
        return context.get_dummy_value()

    return types.none(), generate


def _together(function: Any) -> Callable[..., Any]:
    return lambda *given: function if isinstance(given[-1], types.Integer) else None


overloaded(lanes.of_block, _together(lambda value, b, lanes: _lanes_of(value, b)), _nrt=True)
overloaded(lanes.align_stack, _together(lambda lanes: _align_stack()))
