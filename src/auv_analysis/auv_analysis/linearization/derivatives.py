"""Derivatives of functions that are only known by their values, with an estimate of their error."""

from collections.abc import Callable

import numpy as np

STEP = 1e-5  # of m/s, rad/s, rad: rounding leaves ten digits of a law's gains


def jacobian(
    function: Callable[[np.ndarray], np.ndarray], at: np.ndarray, step: float = STEP
) -> tuple[np.ndarray, np.ndarray]:
    """Central differences over step, step/2 and step/4, extrapolated linearly to no step at all.

    Exact but for rounding where the function is quadratic on both sides of `at`, and so for every
    shipped law: central differences of abs(x) x are off by a multiple of the step at x = 0, which
    the extrapolation removes (Richardson; for a smooth function it leaves an error in step^2).

    Parameters
    ----------
    function : (n,) to (m,)
    at : (n,) where
    step : the largest one

    Returns
    -------
    J : (m, n) derivatives
    error : (m, n) by how much the last two extrapolations differ

    """
    columns, errors = [], []
    for unit in np.eye(len(at)):
        wide, half, quarter = (
            (function(at + h * unit) - function(at - h * unit)) / (2 * h)
            for h in (step, step / 2, step / 4)
        )
        first, second = 2 * half - wide, 2 * quarter - half
        columns.append(second)
        errors.append(np.abs(second - first))
    return np.stack(columns, axis=1), np.stack(errors, axis=1)
