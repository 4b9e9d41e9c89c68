"""Residuals of a segment, by the compiler: measured less simulated, in deviations of the noise."""

import numpy as np

from auv_dynamics.kernel.compile import compiled, helper

ON_STEP = 1e-6  # steps, by which a measurement may miss one
FARTHEST = 1e3  # deviations of the noise: a residual beyond it has diverged


@helper
def after_steps(
    starts: np.ndarray, states: np.ndarray, v: int, s: int, steps: int, share: float, i: int
) -> float:
    """Entry i of attitude and velocity after a number of whole steps and a share of another."""
    before = starts[v, s, i] if steps == 0 else states[v, s, steps - 1, 3 + i]
    if share == 0.0:
        return before
    return before * (1.0 - share) + states[v, s, steps, 3 + i] * share


@helper
def bounded(value: float) -> float:
    """A residual that counts; what is left of a divergence, which may be no number, is farthest."""
    return min(value, FARTHEST) if value > -FARTHEST else -FARTHEST


@compiled
def fill_residuals(
    starts: np.ndarray, states: np.ndarray, s: int, at: np.ndarray, nu: np.ndarray, q: np.ndarray,
    scale: np.ndarray, e: np.ndarray,
) -> None:  # fmt: skip
    """Write the residuals (V, r, 9) of segment s: of nu, then of the attitude; 0: not measured.

    Between steps the states are straight lines.

    Parameters
    ----------
    starts, states : (V, S, 10) attitude and velocity, and (V, S, n, 13) after each step
    s : which segment
    at : (r,) times of the measurements in steps from the start
    nu, q : (r, 6) and (r, 4) measured; NaN: not measured then
    scale : (9,) deviations
    e : (V, r, 9) result

    """
    for k in range(at.shape[0]):
        steps = int(np.rint(at[k]))
        share = 0.0
        if abs(at[k] - steps) >= ON_STEP:
            steps = min(int(at[k]), states.shape[2] - 1)
            share = at[k] - steps
        a, b, c, d = q[k, 0], q[k, 1], q[k, 2], q[k, 3]
        for v in range(e.shape[0]):
            for i in range(6):
                e[v, k, i] = 0.0
                if not np.isnan(nu[k, i]):
                    simulated = after_steps(starts, states, v, s, steps, share, 4 + i)
                    e[v, k, i] = bounded((nu[k, i] - simulated) / scale[i])
            if np.isnan(a):
                for i in range(6, 9):
                    e[v, k, i] = 0.0
                continue
            w = after_steps(starts, states, v, s, steps, share, 0)
            x = after_steps(starts, states, v, s, steps, share, 1)
            y = after_steps(starts, states, v, s, steps, share, 2)
            z = after_steps(starts, states, v, s, steps, share, 3)
            sign = -2.0 if w * a + x * b + y * c + z * d < 0.0 else 2.0  # as `small_rotation`
            e[v, k, 6] = bounded(sign * (w * b - x * a - y * d + z * c) / scale[6])
            e[v, k, 7] = bounded(sign * (w * c - y * a - z * b + x * d) / scale[7])
            e[v, k, 8] = bounded(sign * (w * d - z * a - x * c + y * b) / scale[8])
