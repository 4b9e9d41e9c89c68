"""The poles of a linear model: damping, frequency, time constant, and where each one lives."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy.linalg

from auv_analysis.linearization.state_space import Linearization

STABLE, MARGINAL, UNSTABLE = 'asymptotically stable', 'marginal', 'unstable'
NEGLIGIBLE = 1e-8  # of the fastest pole, below which one is zero


def modes(model: Linearization) -> list[dict[str, Any]]:
    """Poles, the slowest first; a conjugate pair is one entry.

    Parameters
    ----------
    model : Linearization

    Returns
    -------
    modes : of each `pole` (real and imaginary part, 1/s, the latter not negative),
        `natural_frequency` abs(pole) in rad/s, `damping_ratio` -real/abs (None at zero),
        `time_constant` -1/real in s (None where it does not decay), `mostly` the degree of freedom
        or angle with the largest part of it and `part`, that part: participation factors, left
        times right eigenvector, without units (Perez-Arriaga et al. 1982)

    """
    values, left, right = scipy.linalg.eig(model.A, left=True, right=True)
    weights = np.abs(left.conj() * right)
    weights /= np.maximum(weights.sum(axis=0), np.finfo(float).tiny)
    smallest = NEGLIGIBLE * np.abs(values).max(initial=0.0)
    order = np.lexsort((values.imag, -values.real, np.abs(values)))
    kept = [i for i in order if values[i].imag >= 0]
    return [_mode(complex(values[i]), weights[:, i], model.states, smallest) for i in kept]


def stability(found: Sequence[Mapping[str, Any]]) -> str:
    """Stability of a linear model from its modes.

    Asymptotically stable where every pole lies in the open left half plane, unstable where one lies
    in the right one. Else poles on the imaginary axis, such as at zero, make it marginal: what they
    belong to neither decays nor grows exponentially, and the linear model does not decide.
    """
    largest = max(mode['pole'][0] for mode in found)
    return STABLE if largest < 0 else UNSTABLE if largest > 0 else MARGINAL


def _mode(
    value: complex, weights: np.ndarray, states: tuple[str, ...], smallest: float
) -> dict[str, Any]:
    real, imaginary = (part if abs(part) > smallest else 0.0 for part in (value.real, value.imag))
    size = abs(complex(real, imaginary))
    parts: dict[str, float] = {}
    for name, weight in zip(states, weights, strict=True):
        place = name.rstrip(']').rpartition('[')[2]  # states of a law are of a degree of freedom
        parts[place] = parts.get(place, 0.0) + float(weight)
    mostly = max(parts, key=lambda place: parts[place])
    return {
        'pole': [real, imaginary],
        'natural_frequency': size,
        'damping_ratio': 0.0 - real / size if size else None,
        'time_constant': -1 / real if real < 0 else None,
        'mostly': mostly,
        'part': parts[mostly],
    }
