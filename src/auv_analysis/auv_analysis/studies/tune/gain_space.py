"""Search space of a law's gains: coordinates, structure and bounds.

A gain of a rate's or a squared rate's dimension is searched as such where the law multiplies it by
the inertia itself (GVC's k_D and Gamma), and as a multiple of a matrix of inertia where the law
does not (CL's k_D, in N s/m). Which matrix, the structure says.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from auv_analysis.scenario.scenario import Scenario
from auv_dynamics.files.yaml_files import matrix6
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.control.gains import body_gains, velocity_rates
from auv_gvc_controller.laws.law import SHIPPED, make_gains
from auv_gvc_controller.laws.model import ControlModel

STRUCTURES = {  # what a gain multiplies
    'scalar': 'times the smallest to the largest M_ii: one number',
    'mass': 'times M_ii of each axis',
    'diagonal': 'times M_ii of each axis, six numbers',
    'inertia': 'times M',
}
EDGE = 1e-3  # of the distance of two bounds: a value that is nearer to one lies on it
BEST = 'best'  # the better of `scalar` and `mass`


@dataclass(frozen=True, eq=False)
class GainSpace:
    """Gains of one law in one structure, as n logarithms.

    Attributes
    ----------
    law : key of `SHIPPED`
    structure : a key of `STRUCTURES`
    names : of the n coordinates: a gain, or a gain and its degree of freedom
    low, high : (n,) bounds of the logarithms
    basis : gain -> (k,), (k, 6) or (k, 6, 6): what its k coordinates multiply
    model : ControlModel of the vehicle
    fastest : rate that the velocity loop may have, 1/s

    """

    law: str
    structure: str
    names: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray
    basis: dict[str, np.ndarray]
    model: ControlModel
    fastest: float

    def gains(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Gain -> (B,), (B, 6) or (B, 6, 6) in the units of the law, of points (B, n)."""
        values, found, at = np.exp(x), {}, 0
        for gain, basis in self.basis.items():
            found[gain] = np.tensordot(values[:, at : at + len(basis)], basis, 1)
            at += len(basis)
        return found

    def rate_margin(self, x: np.ndarray) -> np.ndarray:
        """Logarithms (B,) of how far the velocity loops of points (B, n) are below `fastest`."""
        gains = self.gains(x)
        M = np.reshape(self.model.dynamics.M, (6, 6))
        rows = ({gain: values[i] for gain, values in gains.items()} for i in range(len(x)))
        K_D = [body_gains(make_gains(self.law, row), self.model)[0] for row in rows]
        return np.log(self.fastest / np.abs(velocity_rates(np.stack(K_D), M)).max(axis=1))

    def at_bound(self, x: np.ndarray) -> dict[str, str]:
        """Coordinates of a point (n,) that lie on a bound of the search: 'lower' or 'upper'."""
        near = EDGE * (self.high - self.low)
        sides = np.where(
            x <= self.low + near, 'lower', np.where(x >= self.high - near, 'upper', '')
        )
        return {name: str(side) for name, side in zip(self.names, sides, strict=True) if side}

    def entry(self, x: np.ndarray) -> dict[str, Any]:
        """Law and gains of one point (n,) as a scenario file gives them."""
        return {'law': self.law, **{k: v[0].tolist() for k, v in self.gains(x[None]).items()}}

    def nearest(self, gains: Mapping[str, Any]) -> np.ndarray:
        """(n,) point next to gains as a scenario file gives them.

        The diagonals are what is compared; a gain that is absent, or not positive, stands in the
        middle.
        """
        parts: list[float] = []
        for gain, basis in self.basis.items():
            at = slice(len(parts), len(parts) + len(basis))
            middle = (self.low[at] + self.high[at]) / 2
            diagonal = np.diagonal(matrix6(gains.get(gain, 0.0)))
            if not np.all(diagonal > 0):
                parts += middle.tolist()
                continue
            per_axis = np.log(diagonal / np.diagonal(matrix6(basis.sum(axis=0))))
            parts += per_axis.tolist() if len(basis) == 6 else [per_axis.mean()]
        return np.clip(parts, self.low, self.high)


def make_space(
    law: str, structure: str, model: ControlModel, step: float, fastest: float
) -> GainSpace:
    """Space of a law's gains.

    Parameters
    ----------
    law : key of `SHIPPED`
    structure : a key of `STRUCTURES`
    model : ControlModel of the vehicle
    step : s; no gain that is a rate is searched above 1/step
    fastest : rate that the velocity loop may have, 1/s

    Returns
    -------
    space : GainSpace

    """
    M = np.reshape(model.dynamics.M, (6, 6))
    names, low, high = [], [], []
    basis: dict[str, np.ndarray] = {}
    for gain, about in SHIPPED[law].search(step).items():
        basis[gain], smallest, largest = _scale(structure, M, inertial=about.inertial)
        names += [f'{gain}.{dof}' for dof in DOFS] if len(smallest) == 6 else [gain]
        low += np.log(about.low * smallest).tolist()
        high += np.log(about.high * largest).tolist()
    return GainSpace(
        law, structure, tuple(names), np.array(low), np.array(high), basis, model, fastest
    )


def _scale(structure: str, M: np.ndarray, *, inertial: bool) -> tuple[np.ndarray, ...]:
    """What k coordinates of a gain multiply, and the factors (k,) of their bounds."""
    inertia, one = np.diagonal(M), np.ones(1)
    if structure == 'diagonal':
        size = inertia if inertial else np.ones(6)
        return np.eye(6), size, size
    if inertial and structure == 'scalar':
        return one, inertia.min(keepdims=True), inertia.max(keepdims=True)
    multiplied = {'mass': inertia[None], 'inertia': M[None]} if inertial else {}
    return multiplied.get(structure, one), one, one


def starts_of(space: GainSpace, scenario: Scenario, reference: str) -> list[np.ndarray]:
    """Two points, whatever the law: next to the reference's gains, and the middle of the space."""
    gains = scenario.gain_values(reference)
    if scenario.controller(reference)['law'] != space.law:
        K_D, K_f = (np.diagonal(K) for K in body_gains(scenario.gains(reference), space.model))
        inertia = np.diagonal(np.reshape(space.model.dynamics.M, (6, 6)))
        unit = inertia if space.law == 'gvc' else 1.0  # GVC multiplies its gains by M itself
        shared = {k: v for k, v in gains.items() if k in ('k_I', 'Lambda')}
        fast = 'k_P' if space.law == 'pid' else 'k_D'
        gains = {fast: (K_D / unit).tolist(), 'Gamma': (K_f / unit).tolist(), **shared}
    return [space.nearest(gains), (space.low + space.high) / 2]
