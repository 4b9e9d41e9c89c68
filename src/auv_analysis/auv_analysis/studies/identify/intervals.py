"""Confidence intervals on request: block bootstrap and profile likelihood."""

from dataclasses import dataclass, replace

import numpy as np

from auv_analysis.studies.identify.output_error import Fit, OutputError

SEED = 0
REACH = (0.5, 1.0, 1.5, 2.0, 3.0)  # half intervals, at which a profile is taken on either side
TIGHT = 0.05  # white standard deviations: how far a profile may stay from where it is wanted
BENT = 0.2  # how much farther than a parabola says, or less far, for a profile to be worth it


def bootstrap(problem: OutputError, fit: Fit, count: int, beside: np.ndarray) -> np.ndarray:
    """Theta (count, n) of recordings whose blocks of time are drawn anew, with replacement.

    Each is refitted by two Gauss-Newton steps: one on the normal equations at the minimum, one on
    those that are simulated anew where the first has led. Starts follow theta. What the prior says
    is drawn from its own uncertainty.

    Parameters
    ----------
    problem, fit : segments, and the minimum
    count : of draws
    beside : (n, n) covariance of what no block of time tells, added to the draws: delay, bias

    """
    rng, u = np.random.default_rng(SEED), fit.unknowns
    P, p = u.precision(fit.theta)
    A, g = problem.blocks(fit)
    left = g.sum(axis=0) + p  # of the gradient at the minimum: starts are less free there
    weights = rng.multinomial(fit.blocks, np.full(fit.blocks, 1 / fit.blocks), size=count)
    said = rng.standard_normal((count, len(p))) @ np.linalg.cholesky(P).T - left
    back = problem.normal(u, fit.theta, fit.starts).eliminated()[2][..., :-1]
    found = np.empty((count, len(p)))
    for k, (w, own) in enumerate(zip(weights, said, strict=True)):
        move = -np.linalg.solve(np.tensordot(w, A, 1) + P, w @ g + p + own)
        at = replace(fit, theta=fit.theta + move, starts=fit.starts - back @ move)
        (A_at, g_at), (P_at, p_at) = problem.blocks(at), u.precision(at.theta)
        S = np.tensordot(w, A_at, 1) + P_at
        found[k] = at.theta - np.linalg.solve(S, w @ g_at + p_at + own)
    return found + rng.multivariate_normal(np.zeros(len(p)), beside, count, method='eigh')


@dataclass(frozen=True, eq=False)
class Profile:
    """Profile likelihood of a coefficient: the others are refitted wherever it is held.

    Attributes
    ----------
    name, unit : of the coefficient
    value, deviation : where the cost is least, and the standard deviation by the sandwich
    values : (k,) rising
    rise : (k,) of the cost, in the scale in which a parabola has ((values - value) / deviation)^2:
        chi-square of one degree of freedom, made wider as the sandwich is wider than white noise
    low, high : where the rise is that of a 95 % interval; None: it stays below it

    """

    name: str
    unit: str
    value: float
    deviation: float
    values: np.ndarray
    rise: np.ndarray
    low: float | None
    high: float | None


def profile(problem: OutputError, fit: Fit, covariance: np.ndarray, name: str) -> Profile:
    """Profile likelihood of a free coefficient.

    Parameters
    ----------
    problem, fit : segments, and the minimum
    covariance : (n, n) of theta, which gives the scale of the rise
    name : of the coefficient

    """
    u, k = fit.unknowns, fit.unknowns.names.index(name)
    value, deviation, white, way = _along(fit, covariance, k)
    points, ends = [(value, 0.0)], []
    for sign in (-1.0, 1.0):
        theta, starts, at = fit.theta, fit.starts, value
        side = [(value, 0.0)]
        for reach in REACH:
            wanted = value + sign * reach * fit.quantile * deviation
            if u.entries[k].group in ('lag', 'gain') and wanted <= 0.0:
                break
            held = replace(u, believed={**u.believed, name: (wanted, TIGHT * white)})
            tolerance = min(1e-6, 1e-2 / fit.cost)
            moved = problem.fit(held, theta + way * (wanted - at), starts, most=8,
                                tolerance=tolerance)  # fmt: skip
            theta, starts = moved.theta, moved.starts
            at = float(u.values(theta)[k])
            rise = (problem.cost(u, theta, starts) - fit.cost) * (white / deviation) ** 2
            side.append((at, max(rise, side[-1][1])))
            if rise > fit.quantile**2:
                break
        roots = np.sqrt([rise for _, rise in side])
        end = float(np.interp(fit.quantile, roots, [x for x, _ in side]))
        ends.append(end if roots[-1] >= fit.quantile else None)
        points += side[1:]
    values, rise = np.array(sorted(points)).T
    return Profile(name, u.entries[k].si, value, deviation, values, rise, *ends)


def far_from_quadratic(problem: OutputError, fit: Fit, covariance: np.ndarray) -> list[str]:
    """Coefficients along whose interval the cost is no parabola, the others following a line."""
    u = fit.unknowns
    back = problem.normal(u, fit.theta, fit.starts).eliminated()[2][..., :-1]
    found = []
    for k, name in enumerate(u.names):
        _, deviation, white, way = _along(fit, covariance, k)
        for move in (-fit.quantile * deviation * way, fit.quantile * deviation * way):
            rise = problem.cost(u, fit.theta + move, fit.starts - back @ move) - fit.cost
            reach = np.sqrt(max(rise, 0.0)) * white / (fit.quantile * deviation)
            if abs(reach - 1.0) > BENT and name not in found:
                found.append(name)
    return found


def _along(fit: Fit, covariance: np.ndarray, k: int) -> tuple[float, float, float, np.ndarray]:
    """A coefficient, its deviation by the sandwich and for white noise, and d theta (n,) by it."""
    u = fit.unknowns
    row = u.gradient(fit.theta)[k]
    P, _ = u.precision(fit.theta)
    back = np.linalg.solve(fit.information + P, row)
    variance = float(row @ back)
    deviation = float(np.sqrt(row @ covariance @ row))
    return float(u.values(fit.theta)[k]), deviation, variance**0.5, back / variance
