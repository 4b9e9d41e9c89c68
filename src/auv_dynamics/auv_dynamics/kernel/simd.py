"""Lanes as numba compiles them: a number of four vehicles is one value in a vector register.

`Lane` is that value, `Choice` a comparison of two. An array of lanes is a numba array with `Lane`
as its element, so that indexing, slicing and assignment are numba's own. What numba does not
offer in its public interface stands here and, as far as memory is concerned, in `simd_memory`.
"""

import math
import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.typeconv.castgraph import Conversion
from numba.extending import (
    intrinsic,
    lower_cast,
    models,
    overload,
    register_model,
)

from auv_dynamics.kernel import lanes
from auv_dynamics.kernel.lanes import LANES

CONTRACT = ('contract',)  # as in jit.OPTIONS: a product may be fused with the sum that follows
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


def _lifted(context: Any, builder: Any, value: Any, kind: Any) -> Any:
    """The LLVM value of an operand in all lanes."""
    if kind == Lane:
        return value
    number = context.cast(builder, value, kind, types.float64)
    one = builder.insert_element(ir.Constant(REGISTER, ir.Undefined), number, INDEX(0))
    every = ir.Constant(ir.VectorType(INDEX, LANES), [0] * LANES)
    return builder.shuffle_vector(one, ir.Constant(REGISTER, ir.Undefined), every)


@lower_cast(types.Float, LaneType)
@lower_cast(types.Integer, LaneType)
def _cast(context: Any, builder: Any, fromty: Any, toty: Any, value: Any) -> Any:
    return _lifted(context, builder, value, fromty)


def _are_numbers(*kinds: Any) -> bool:
    numbers = (LaneType, types.Float, types.Integer)
    return Lane in kinds and all(isinstance(kind, numbers) for kind in kinds)


def _binary(operation: Any, result: Any, emit: Any) -> None:
    @intrinsic
    def of_lanes(typingctx, a, b):
        def generate(context, builder, signature, arguments):
            pairs = zip(arguments, signature.args, strict=True)
            return emit(builder, *(_lifted(context, builder, *pair) for pair in pairs))

        return result(a, b), generate

    @overload(operation)
    def implementation(a, b):
        if _are_numbers(a, b):
            return lambda a, b: of_lanes(a, b)
        return None


for _name, _operations in {
    'fadd': (operator.add, operator.iadd),
    'fsub': (operator.sub, operator.isub),
    'fmul': (operator.mul, operator.imul),
    'fdiv': (operator.truediv, operator.itruediv),
}.items():
    for _operation in _operations:
        _binary(
            _operation,
            Lane,
            lambda builder, a, b, name=_name: getattr(builder, name)(a, b, flags=CONTRACT),
        )
for _operation, _sign in (
    (operator.lt, '<'),
    (operator.le, '<='),
    (operator.gt, '>'),
    (operator.ge, '>='),
    (operator.eq, '=='),
):
    _binary(_operation, Choice, lambda builder, a, b, sign=_sign: builder.fcmp_ordered(sign, a, b))
_binary(operator.ne, Choice, lambda builder, a, b: builder.fcmp_unordered('!=', a, b))


def _unary(function: Any, kind: Any, result: Any, emit: Any) -> None:
    @intrinsic
    def of_lanes(typingctx, a):
        def generate(context, builder, signature, arguments):
            return emit(builder, arguments[0])

        return result(a), generate

    @overload(function)
    def implementation(a):
        if a == kind:
            return lambda a: of_lanes(a)
        return None


def _call(name: str) -> Any:
    def emit(builder: Any, value: Any) -> Any:
        full = f'llvm.{name}.v{LANES}f64'
        kind = ir.FunctionType(REGISTER, [REGISTER])
        known = builder.module.globals.get(full)
        return builder.call(known or ir.Function(builder.module, kind, full), [value])

    return emit


def _any(builder: Any, value: Any) -> Any:
    bits = ir.IntType(LANES)
    return builder.icmp_unsigned('!=', builder.bitcast(value, bits), bits(0))


_unary(operator.neg, Lane, Lane, lambda builder, a: builder.fneg(a))
_unary(abs, Lane, Lane, _call('fabs'))
_unary(lanes.sqrt, Lane, Lane, _call('sqrt'))
_unary(lanes.anywhere, Choice, types.boolean, _any)


@overload(lanes.sqrt)
def _sqrt(x):
    return (lambda x: math.sqrt(x)) if isinstance(x, types.Float) else None


@overload(lanes.anywhere)
def _anywhere(condition):
    return (lambda condition: condition) if isinstance(condition, types.Boolean) else None


@intrinsic
def _select(typingctx, condition, a, b):
    def generate(context, builder, signature, arguments):
        pairs = zip(arguments[1:], signature.args[1:], strict=True)
        return builder.select(arguments[0], *(_lifted(context, builder, *pair) for pair in pairs))

    return Lane(condition, a, b), generate


@overload(lanes.select)
def _select_of(condition, a, b):
    if condition == Choice:
        return lambda condition, a, b: _select(condition, a, b)
    return lambda condition, a, b: a if condition else b
