"""Rates of sampled signals."""

import numpy as np

NODES = 9  # samples of a formula: its error is of order 8 in the step


def derivative(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Derivative at each sample of the polynomial through the nine samples about it.

    With a step h its error is h^8 / 630 times the ninth derivative, and up to h^8 / 9 times that
    at the four samples at either end, which have more of the nine on one side than on the other.
    A run of fewer has one polynomial through all its n samples, and an error of order n - 1.

    Parameters
    ----------
    t : (n,) s, increasing; steps may differ
    values : (n, ...)

    Returns
    -------
    rates : (n, ...) unit of the values per s; NaN where there is one sample only

    """
    values = np.asarray(values, float)
    n, here = len(t), np.arange(len(t))
    nodes = min(NODES, n)
    if nodes < 2:
        return np.full(values.shape, np.nan)
    first = np.clip(here - nodes // 2, 0, n - nodes)
    rates = np.zeros(values.shape)
    for node in (first + i for i in range(nodes)):
        # rate at `here` of the Lagrange polynomial that is 1 at `node` and 0 at the others; with
        # values taken relative to the one at `here`, that node itself contributes nothing
        rate = np.where(node == here, 0.0, 1.0)
        for other in (first + j for j in range(nodes)):
            ahead = np.where((other == here) | (other == node), 1.0, t - t[other])
            rate *= ahead / np.where(other == node, 1.0, t[node] - t[other])
        rates += (rate * (values[node] - values).T).T
    return rates
