"""Numba's side of the kernel: inlining, the cache of compiled code, and blocks of a batch.

Imported by `compile.load` alone, when something is first compiled or loaded.
"""

import contextlib
import hashlib
import importlib.util
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba
from numba.core import cgutils
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering
from numba.extending import intrinsic, overload, register_jitable
from numba.np import linalg
from numba.np.arrayobj import make_array, populate_array
from numba.np.unsafe.ndarray import to_fixed_tuple

from auv_dynamics.kernel.compile import cache_folder, is_private
from auv_dynamics.kernel.lanes import align_stack, of_block


@contextlib.contextmanager
def _without_asking_for_blas() -> Iterator[None]:
    """Let numba take it that BLAS is there: it would load scipy's, which no kernel calls.

    Half of the time that the first kernel takes to load. A law that does call it loads it then.
    """
    if importlib.util.find_spec('scipy') is None:
        yield
        return
    asked, linalg.ensure_blas = linalg.ensure_blas, lambda: None
    try:
        yield
    finally:
        linalg.ensure_blas = asked


with _without_asking_for_blas():
    importlib.import_module('numba.np.arraymath')
types: Any = numba.types  # its own annotations know no named tuples
FOLDER = cache_folder()
KEPT = is_private(FOLDER)
if not KEPT:
    text = f'warning: {FOLDER}: not yours alone: compiled code is neither kept nor loaded'
    print(text, file=sys.stderr, flush=True)


@register_pass(mutates_CFG=True, analysis_only=False)
class _Inner(NativeLowering):
    """Ends at optimised LLVM code: what is inlined needs no machine code of its own."""

    _name = 'inner_lowering'

    def run_pass(self, state: Any) -> bool:
        state.flags.no_compile = True
        NativeLowering.run_pass(self, state)
        found = state['cr']
        key: Any = [].append  # numba wants a built-in function, and one for each
        state.library._finalize_specific = lambda: None  # noqa: SLF001  no machine code
        state.targetctx.insert_user_function(key, found.fndesc, [state.library])
        state['cr'] = found._replace(cfunc=key)
        return True


class _Inlined(Compiler):
    """Compiles what is inlined wherever it is called."""

    def define_pipelines(self) -> list[Any]:
        (usual,) = super().define_pipelines()  # type: ignore[no-untyped-call]
        passes: Any = PassManager('inlined')
        for which, why in usual.passes:
            passes.add_pass(_Inner if which is NativeLowering else which, why)
        passes.finalize()
        return [passes]


# without _nrt no references are counted: nothing is allocated, and callers hold their arrays
OPTIONS: Any = {'fastmath': {'contract'}, 'error_model': 'numpy', '_nrt': False}
INNER: Any = {
    'forceinline': True,
    'no_cfunc_wrapper': True,
    'pipeline_class': _Inlined,
    **OPTIONS,
}
NUMBERS = types.Number, types.Boolean
inlined: Any = register_jitable(**INNER)
allocating: Any = register_jitable(**INNER | {'_nrt': True})
uncached: Any = numba.njit(nogil=True, **OPTIONS)


def overloaded(function: Any, choose: Callable[..., Any], options: dict[str, Any]) -> None:
    """Compile in place of a function what is chosen for the types of its arguments."""
    # not strict: numba would take an argument with an annotation for another one
    overload(function, jit_options=INNER | options, strict=False)(
        lambda *types: choose(*types)  # noqa: PLW0108  numba looks at its code
    )


def in_numbers(count: int) -> Any:
    """What turns a tuple or a 1-D array of so many numbers into a tuple; ValueError for another."""

    def fixed(values: Any) -> Any: ...

    def of_array(values: Any) -> Any:
        if len(values) != count:
            raise ValueError('another number of values than expected')
        return to_fixed_tuple(values, count)  # type: ignore[call-arg]

    def choose(values: Any) -> Any:
        if isinstance(values, types.BaseTuple):
            return (lambda values: values) if len(values) == count else None
        return of_array if isinstance(values, types.Array) and values.ndim == 1 else None

    overloaded(fixed, choose, {'_nrt': True})
    return fixed


class _Place:
    """Where numba looks for the code of a function: by what it is, not by where it lies."""

    def __init__(self, function: Any, path: str):
        self._module, self._path = function.__module__, Path(path)

    @classmethod
    def from_function(cls, function: Any, path: str) -> '_Place':
        return cls(function, path)

    def ensure_cache_path(self) -> None:
        is_private(FOLDER)

    def get_cache_path(self) -> str:
        return str(FOLDER)

    def get_source_stamp(self) -> str:
        return hashlib.sha256(self._path.read_bytes()).hexdigest()

    def get_disambiguator(self) -> str:
        return str(self._module)


_FILES = type('_Files', (CompileResultCacheImpl,), {'_locator_classes': [_Place]})
_CACHE: Any = type('_Cache', (FunctionCache,), {'_impl_class': _FILES})


def kept(function: Any) -> Any:
    """Numba's form of a function, whose code is kept for other processes."""
    made: Any = numba.njit(nogil=True, forceinline=True, **OPTIONS)(function)
    if KEPT:
        made._cache = _CACHE(function)  # noqa: SLF001  as `cache=True` does, with another place
    return made


def viewed(value: Any, lost: int, dtype: Any) -> Any:
    """Numba's type of a tree of arrays that lose so many axes; dtype None: their own."""
    if isinstance(value, types.Array):
        return types.Array(
            dtype or value.dtype, value.ndim - lost, value.layout, aligned=dtype is None
        )
    if isinstance(value, types.BaseNamedTuple):
        parts = [viewed(part, lost, dtype) for part in value]
        return types.BaseTuple.from_types(parts, value.instance_class)
    return value


def view(context: Any, builder: Any, kinds: Any, value: Any, b: Any) -> Any:
    """LLVM value of a tree of type kinds[0] as kinds[1], one block b of it."""
    before, after = kinds
    if isinstance(before, types.BaseNamedTuple):
        parts = zip(zip(before, after, strict=True), range(len(before)), strict=True)
        inner = [
            view(context, builder, pair, builder.extract_value(value, i), b) for pair, i in parts
        ]
        return context.make_tuple(builder, after, inner)
    if not isinstance(before, types.Array):
        return value
    array, seen = (
        make_array(before)(context, builder, value),
        make_array(after)(context, builder),
    )
    shape = cgutils.unpack_tuple(builder, array.shape)
    strides = cgutils.unpack_tuple(builder, array.strides)
    single = builder.icmp_signed('<=', shape[0], shape[0].type(1))
    offset = builder.mul(builder.select(single, b.type(0), b), strides[0])
    data = cgutils.pointer_add(builder, array.data, offset, seen.data.type)
    last = 1 + after.ndim
    size = context.get_constant(
        types.intp, context.get_abi_sizeof(context.get_data_type(after.dtype))
    )
    populate_array(seen, data, shape[1:last], strides[1:last], size, meminfo=None)
    return seen._getvalue()  # noqa: SLF001  numba's own way


@intrinsic
def _of_block(typingctx: Any, value: Any, b: Any) -> Any:
    result = viewed(value, 1, None)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return view(context, builder, (value, result), *arguments)

    return result(value, types.intp), generate


def _alone(function: Any) -> Callable[..., Any]:
    return lambda *given: function if isinstance(given[-1], types.NoneType) else None


# an intrinsic is called without the typing context that its definition takes
overloaded(of_block, _alone(lambda value, b, lanes: _of_block(value, b)), {'_nrt': True})  # type: ignore[call-arg]
overloaded(align_stack, _alone(lambda lanes: None), {})
