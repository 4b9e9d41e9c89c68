"""Where lanes lie: views of a batch as arrays of lanes, without counts and on aligned stack.

What the compiled form of `lanes` does with memory stands here, what it does with numbers in `simd`;
neither touches the other but for the register that both speak of.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload
from numba.np.arrayobj import make_array, populate_array

from auv_dynamics.kernel import lanes
from auv_dynamics.kernel.lanes import ALIGNMENT, LANES
from auv_dynamics.kernel.simd import REGISTER, Lane


@intrinsic
def _lanes_of(typingctx, array, block):
    """Array of lanes (...,) of one block of a float64 array (blocks, ..., LANES)."""
    inner = types.Array(Lane, array.ndim - 2, 'C', aligned=False)

    def generate(context, builder, signature, arguments):
        outer = make_array(array)(context, builder, arguments[0])
        shape = cgutils.unpack_tuple(builder, outer.shape)
        strides = cgutils.unpack_tuple(builder, outer.strides)
        offset = builder.mul(arguments[1], strides[0])
        data = cgutils.pointer_add(builder, outer.data, offset, REGISTER.as_pointer())
        view = make_array(inner)(context, builder)
        size = context.get_constant(types.intp, LANES * 8)
        populate_array(view, data, shape[1:-1], strides[1:-1], size, meminfo=None)
        return view._getvalue()  # noqa: SLF001  numba's own way

    return inner(array, types.intp), generate


@intrinsic
def _uncounted(typingctx, array):
    def generate(context, builder, signature, arguments):
        given = make_array(array)(context, builder, arguments[0])
        shape = cgutils.unpack_tuple(builder, given.shape)
        strides = cgutils.unpack_tuple(builder, given.strides)
        view = make_array(array)(context, builder)
        populate_array(view, given.data, shape, strides, given.itemsize, meminfo=None)
        return view._getvalue()  # noqa: SLF001  numba's own way

    return array(array), generate


def _each_field(value: Any, call: str, function: Any) -> Any:
    """Implementation that rebuilds a named tuple of what `call` gives for each of its fields."""
    parts = ', '.join(call.format(f'value.{name}') for name in value.fields)
    scope = {'function': function, 'kind': value.instance_class}
    arguments = 'value, b' if 'b)' in call else 'value'
    exec(f'def rebuilt({arguments}): return kind({parts})', scope)
    return scope['rebuilt']


@overload(lanes.uncounted)
def _uncounted_of(value):
    if isinstance(value, types.Array):
        return lambda value: _uncounted(value)
    if isinstance(value, types.BaseNamedTuple):
        return _each_field(value, 'function({})', lanes.uncounted)
    return lambda value: value


@overload(lanes.of_block)
def _of_block(value, b):
    if getattr(getattr(value, 'instance_class', None), 'SHARED', False):
        return lambda value, b: lanes.uncounted(value)
    if isinstance(value, types.Array):
        return lambda value, b: _lanes_of(value, b if value.shape[0] > 1 else 0)
    if isinstance(value, types.BaseNamedTuple):
        return _each_field(value, 'function({}, b)', lanes.of_block)
    return lambda value, b: value


@intrinsic
def _align_stack(typingctx):
    """A place on the stack that must be aligned: LLVM then also aligns what it spills."""

    def generate(context, builder, signature, arguments):
        with builder.goto_entry_block():
            place = builder.alloca(REGISTER)
            place.align = ALIGNMENT
            kind = ir.FunctionType(ir.VoidType(), [place.type])
            builder.asm(kind, '', 'r', [place], side_effect=True)  # no code, but it is used
        return context.get_dummy_value()

    return types.none(), generate


@overload(lanes.align_stack, inline='always')
def _align_stack_of():
    return lambda: _align_stack()
