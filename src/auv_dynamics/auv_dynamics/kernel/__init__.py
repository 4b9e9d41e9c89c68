"""The compiled kernel, and the rules for whoever writes in it.

The terms of the equation of motion, the laws, devices and metrics are written once, as plain Python
on numbers, tuples of six and arrays. Numba compiles that source twice: for one vehicle, whose
numbers are floats, and for several side by side, whose numbers are vector registers (`simd`, which
can be left out). Without numba the same source runs as it is. Therefore:

1. A choice that depends on a number of the vehicle is a `select`, and a bound a `clip`, not an
   `if`, `min` or `max`. An `if` may ask what all vehicles of a batch share: a flag, the shape of an
   array, whether a field is None; and `anywhere` tells whether it is worth looking at all.
2. Both sides of a `select` are computed: each must be harmless where the other one is chosen, such
   as a quotient whose divisor is itself selected.
3. An element of an array of lanes is a view of it, not a copy. What is read and then overwritten is
   copied by arithmetic first: `1.0 * x[i]`, or `copied` for six.
4. A function changes its arguments only where its name says so (`fill_*`, `add_*`, `keep_*`), and
   no two of its arguments may be the same memory unless it says that they can be.
5. Six numbers are a tuple, written out, which stays in registers; a 6x6 matrix is a flat row-major
   array (36,). Nothing is allocated: workspace is an argument.
6. Time is `k * step`, never a sum. What is known before the run is tabulated on the grid of steps
   and stages, a block of steps at a time.
7. `helper` before a function of the kernel, `compiled` only where Python calls it: each compiled
   function costs seconds at the first start, a large helper, which is compiled by itself as well,
   half of that.
   Numbers that are not finite are not errors here: who has the record looks for them.
8. The floating-point result may depend on nothing but the vehicle's own numbers: not on the other
   vehicles, on their order or on the threads. Products may be fused with sums, sums are not
   reordered.

`LANES` is how many vehicles run side by side, None where each runs alone.
"""

from typing import TYPE_CHECKING, Any

from auv_dynamics.kernel.compile import JITTED, load, loads_by

if TYPE_CHECKING:
    LANES: int | None


def _numba_side() -> Any:
    from auv_dynamics.kernel import jit

    try:
        from auv_dynamics.kernel import simd
    except ImportError:  # it is optional
        globals()['LANES'] = None
    else:
        globals()['LANES'] = simd.LANES
    return jit


loads_by(_numba_side)


def __getattr__(name: str) -> Any:
    """`LANES`, for which numba is loaded."""
    if name != 'LANES':
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    try:
        if JITTED:
            load()
    except ImportError:  # numba is not for this Python or this NumPy
        pass
    return globals().setdefault(name, None)
