"""Functions of time: set-points, the explicit part of F(t), the current."""

from __future__ import annotations

from math import cos, exp, pi, sin
from typing import Any

import numpy as np
from reference_vehicle import Array, square

DOFS = ('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')
NED = ('north', 'east', 'down')
PLANT_KINDS = ('model_error', 'current')  # they are not functions of time alone


def waves(spec: dict[str, Any], t: float, names: tuple[str, ...]) -> tuple[Array, Array]:
    """Value and derivative: per name, offset + sum of amplitude sin(omega t + phase)."""
    value, rate = np.zeros(len(names)), np.zeros(len(names))
    for name, entry in spec.items():
        i = names.index(name)
        value[i] = entry.get('offset', 0.0)
        for term in entry.get('terms', []):
            amplitude, omega = float(term['amplitude']), float(term['omega'])
            angle = omega * t + float(term.get('phase', 0.0))
            value[i] += amplitude * sin(angle)
            rate[i] += amplitude * omega * cos(angle)
    return value, rate


def setpoint(spec: dict[str, Any], t: float) -> tuple[Array, Array]:
    """nu_d and its derivative, of sinusoids or of {'table': rows of t and six velocities}.

    A table is linear between its rows; the derivative is the slope of the segment that begins at
    t, at the last row that of the last segment.  1e-9 s forgives k * step below a row's time.
    """
    if 'file' in spec:
        raise ValueError("a set-point from a file is passed as {'table': array}")
    if 'table' not in spec:
        return waves(spec, t, DOFS)
    table = np.asarray(spec['table'], dtype=float)
    i = int(np.searchsorted(table[:, 0], t + 1e-9, side='right')) - 1
    i = min(max(i, 0), len(table) - 2)
    slope = (table[i + 1, 1:] - table[i, 1:]) / (table[i + 1, 0] - table[i, 0])
    return table[i, 1:] + (t - table[i, 0]) * slope, slope


def entries(spec: list[dict[str, Any]] | dict[str, Any] | None) -> list[dict[str, Any]]:
    """The disturbance of a scenario as a list, of known kinds only."""
    found = [] if spec is None else [spec] if isinstance(spec, dict) else list(spec)
    for item in found:
        if item['kind'] not in ('herman2018', 'harmonic', *PLANT_KINDS):
            raise ValueError(f'disturbance kind {item["kind"]!r} is not covered')
    return found


def disturbance(spec: list[dict[str, Any]] | dict[str, Any] | None, t: float) -> Array:
    """The part of F of (1) that is given as a function of time: herman2018 (39) and harmonic.

    exponent_sign turns the exponents of (39) and the e^-1 inside f2, not e^cos(t - 0.7).
    model_error and current add nothing here: what they do depends on the motion.
    """
    total = np.zeros(6)
    for item in entries(spec):
        if item['kind'] == 'harmonic':
            total += waves({k: v for k, v in item.items() if k != 'kind'}, t, DOFS)[0]
        elif item['kind'] == 'herman2018':
            g = float(item.get('exponent_sign', -1))
            f1 = pi / 4 * cos(pi * t / 5) + pi / 10 * sin(pi * t / 3)
            f2 = 0.2 * sin(t) * exp(g) + 0.1 * exp(cos(t - 0.7))
            f3 = pi / 5 * sin(pi * t / 15) + pi / 4 * cos(pi * t / 5)
            equation_39 = [
                100 * f1 * exp(2.5 * g) + 20,
                20 * f1 * exp(2.5 * g) + 4,
                150 * f2 * exp(g) + 1,
                3 * f2 * exp(g) + 1,
                150 * f3 * exp(3 * g) + 12,
                50 * f3 * exp(3 * g) + 4,
            ]
            scale = item.get('scale')
            total += equation_39 if scale is None else square(scale) @ equation_39
    return total


def current(items: list[dict[str, Any]], t: float) -> tuple[Array, Array]:
    """v_c and its derivative in NED, m/s and m/s2, of the current entries, which add up."""
    value, rate = np.zeros(3), np.zeros(3)
    for item in items:
        own = waves({k: v for k, v in item.items() if k in NED}, t, NED)
        value += np.asarray(item.get('velocity', np.zeros(3)), dtype=float) + own[0]
        rate += own[1]
    return value, rate


def varies(items: list[dict[str, Any]]) -> bool:
    """Whether a current has any sinusoid; offsets alone are a constant one."""
    return any(item.get(name, {}).get('terms') for item in items for name in NED)
