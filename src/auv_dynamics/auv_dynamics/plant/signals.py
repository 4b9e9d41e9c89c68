"""Offsets plus sinusoids per degree of freedom: set-points and harmonic disturbances."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from auv_dynamics.vehicle import DOFS


@dataclass(frozen=True)
class Harmonics:
    """offset + sum of amplitude * sin(omega t + phase), per degree of freedom.

    Attributes
    ----------
    offset : (..., 6)
    terms : for each degree of freedom (..., m, 3) amplitude, omega in rad/s, phase in rad

    """

    offset: np.ndarray
    terms: tuple[np.ndarray, ...]

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> 'Harmonics':
        """Harmonics of a mapping DOF word -> {offset, terms}; absent degrees of freedom are 0."""
        offset = np.zeros(6)
        terms: list[np.ndarray] = []
        for i, dof in enumerate(DOFS):
            entry = spec.get(dof, {})
            offset[i] = entry.get('offset', 0.0)
            rows = [
                (t['amplitude'], t['omega'], t.get('phase', 0.0)) for t in entry.get('terms', [])
            ]
            terms.append(np.array(rows, float).reshape(-1, 3))
        return cls(offset, tuple(terms))

    def value(self, t: np.ndarray | float) -> np.ndarray:
        """Values at times t in s: the leading axes, those of t, then (6,)."""
        return self._sum(t, self.offset, lambda a, w, angle: a * np.sin(angle))

    def derivative(self, t: np.ndarray | float) -> np.ndarray:
        """Time derivatives at times t in s, of the same shape."""
        return self._sum(t, np.zeros_like(self.offset), lambda a, w, angle: a * w * np.cos(angle))

    def _sum(self, t: np.ndarray | float, offset: np.ndarray, term: Any) -> np.ndarray:
        t = np.asarray(t, float)
        over_time = (..., *(None,) * t.ndim)
        out = np.empty((*offset.shape[:-1], *t.shape, 6))
        for i in range(6):
            out[..., i] = offset[..., i][over_time]
            for j in range(self.terms[i].shape[-2]):
                amplitude, omega, phase = np.moveaxis(
                    self.terms[i][..., j, :][over_time], -1 - t.ndim, 0
                )
                out[..., i] += term(amplitude, omega, omega * t + phase)
        return out

    def part(self, keep: Any) -> 'Harmonics':
        """Those that an index of the first axis keeps."""
        return Harmonics(self.offset[keep], tuple(terms[keep] for terms in self.terms))
