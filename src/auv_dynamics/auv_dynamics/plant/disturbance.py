"""External disturbances d(t) and set-points as functions of time: harmonics, equation (39)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from auv_dynamics.files.yaml_files import matrix6
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
        for i, rows in enumerate(self.terms):
            column = np.empty(out.shape[:-1])
            column[...] = offset[..., i][over_time]
            for j in range(rows.shape[-2]):
                amplitude, omega, phase = (rows[..., j, k][over_time] for k in range(3))
                column += term(amplitude, omega, omega * t + phase)
            out[..., i] = column
        return out

    def part(self, keep: Any) -> 'Harmonics':
        """Those that an index of the first axis keeps."""
        return Harmonics(self.offset[keep], tuple(terms[keep] for terms in self.terms))


Disturbance = Callable[[np.ndarray], np.ndarray]  # t (n,) in s -> F (n, 6) in N, N m, body frame


def herman2018(t: np.ndarray, exponent_sign: float = -1.0) -> np.ndarray:
    """F of equation (39).

    The print lost the signs of the exponents; `exponent_sign` is the reading taken, -1 or +1, and
    it holds for f2's first term as well. The other readings stand in docs/vehicles.md.

    Parameters
    ----------
    t : (n,) s
    exponent_sign : sign of every constant exponent

    Returns
    -------
    F : (n, 6) N, N m, body frame

    """
    t = np.asarray(t, float)

    def e(exponent: float) -> float:
        return float(np.exp(exponent_sign * exponent))

    f1 = np.pi / 4 * np.cos(np.pi / 5 * t) + np.pi / 10 * np.sin(np.pi / 3 * t)
    f2 = 0.2 * np.sin(t) * e(1) + 0.1 * np.exp(np.cos(t - 0.7))
    f3 = np.pi / 5 * np.sin(np.pi / 15 * t) + np.pi / 4 * np.cos(np.pi / 5 * t)
    return np.stack(
        [
            100 * f1 * e(2.5) + 20,
            20 * f1 * e(2.5) + 4,
            150 * f2 * e(1) + 1,
            3 * f2 * e(1) + 1,
            150 * f3 * e(3) + 12,
            50 * f3 * e(3) + 4,
        ],
        axis=-1,
    )


def _herman2018(spec: Mapping[str, Any]) -> Disturbance:
    sign = float(spec.get('exponent_sign', -1))
    if 'scale' not in spec:
        return lambda t: herman2018(t, sign)
    scale = matrix6(spec['scale'])
    return lambda t: herman2018(t, sign) @ scale.T


KINDS: dict[str, Callable[[Mapping[str, Any]], Disturbance]] = {
    'herman2018': _herman2018,
    'harmonic': lambda spec: Harmonics.from_spec(spec).value,
}


def make_disturbance(specs: Sequence[Mapping[str, Any]]) -> Disturbance:
    """Sum of the external disturbances of a checked scenario; zero where there is none.

    Parameters
    ----------
    specs : mappings with `kind` and what that kind takes; kinds that are no function of time
        alone (`model_error`, `current`) are left out, see `uncertainty`

    Returns
    -------
    F : function of t (n,) in s, gives (n, 6) in N, N m

    """
    parts = [KINDS[spec['kind']](spec) for spec in specs if spec['kind'] in KINDS]

    def total(t: np.ndarray) -> np.ndarray:
        t = np.asarray(t, float)
        F = np.zeros((*t.shape, 6))
        for part in parts:
            F += part(t)
        return F

    return total
