"""Numbers of a scenario's entries as words: signals, errors, currents, bounds."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from auv_analysis.output.text import join, plain
from auv_dynamics.files.yaml_files import matrix6

AXES = ('north', 'east', 'down')
RELATIVE = {
    'mass': 'mass',
    'added_mass': 'added mass',
    'damping': 'damping',
    'buoyancy': 'buoyancy',
}


def gain_text(value: Any) -> str:
    """A gain as '12 I', 'diag(...)' or 'full matrix'."""
    matrix = np.asarray(matrix6(value))
    diagonal = np.diagonal(matrix)
    if np.any(matrix != np.diag(diagonal)):
        return 'full matrix, in the listing'
    if np.all(diagonal == diagonal[0]):
        return f'{plain(diagonal[0], 6)} I'
    return f'diag({", ".join(plain(x, 6) for x in diagonal)})'


def harmonics(spec: Mapping[str, Any], axes: Sequence[str], units: Sequence[str]) -> str:
    """Offsets and sinusoids per axis: 'surge 0.2 + 1 sin(0.157 t) m/s; heave 0.1 m/s'.

    Parameters
    ----------
    spec : axis -> offset and terms
    axes : names, in the order in which they are said
    units : of the first three and of the others

    """
    parts = []
    for i, axis in enumerate(axes):
        text = _signal(spec.get(axis, {}))
        parts += [f'{axis} {text} {units[i // 3]}'] if text else []
    return '; '.join(parts)


def herman2018(spec: Mapping[str, Any]) -> str:
    """F of (39) and what multiplies it."""
    sign = '−' if spec.get('exponent_sign', -1) < 0 else '+'
    scale = spec.get('scale', 1)
    text = f'equation (39), exponents read with {sign}'
    if isinstance(scale, int | float):
        return text if scale == 1 else f'{text}, times {plain(scale)}'
    words = gain_text(scale)
    return f'{text}, times {"a " if words.startswith("full") else ""}{words}'


def model_error(spec: Mapping[str, Any]) -> str:
    """How the plant differs from the vehicle file."""
    parts = [f'{word} {signed(100 * spec[key])} %' for key, word in RELATIVE.items() if key in spec]
    parts += [f'{key} = {gain_text(spec[key])}' for key in ('dM', 'dD') if key in spec]
    return f'model error of the plant: {", ".join(parts)}'


def current(spec: Mapping[str, Any]) -> str:
    """Velocity of the water in NED."""
    parts = []
    if 'velocity' in spec:
        parts.append(f'{", ".join(fixed_two(x) for x in spec["velocity"])} m/s NED, constant')
    waves = harmonics(spec, AXES, ('m/s', 'm/s'))
    return f'current {" and ".join(filter(None, [*parts, waves]))}'


def per_axis(value: Any, units: Sequence[str]) -> str:
    """One number or six with their units: '3000, 3000, 4000 N and 800, 800, 500 N m'."""
    six = np.broadcast_to(np.asarray(value, float), 6)
    if np.all(six == six[0]):
        return f'{plain(six[0], 6)} {units[0]} and {units[1]}'
    halves = zip((six[:3], six[3:]), units, strict=True)
    return join([f'{_three(half)} {unit}' for half, unit in halves])


def rotations(value: Any) -> str:
    """One number, or three about the body axes."""
    return _three(np.broadcast_to(np.asarray(value, float), 3))


def signed(value: float) -> str:
    """Text of a number with its sign."""
    return f'{"−" if value < 0 else "+"}{plain(abs(value))}'


def fixed_two(value: float) -> str:
    """At least two decimals, as many as the number needs."""
    text = plain(value)
    whole, _, decimals = text.partition('.')
    return text if '·' in text else f'{whole}.{decimals:0<2}'


def _three(values: np.ndarray) -> str:
    """Three numbers, or the one that all of them are."""
    texts = [plain(x, 6) for x in values]
    return texts[0] if len(set(texts)) == 1 else ', '.join(texts)


def _signal(entry: Mapping[str, Any]) -> str:
    offset = entry.get('offset', 0.0)
    text = plain(offset) if offset else ''
    for term in entry.get('terms', []):
        amplitude, phase = term['amplitude'], term.get('phase', 0.0)
        angle = f'{plain(term["omega"])} t'
        if phase:
            angle += f' {"−" if phase < 0 else "+"} {plain(abs(phase))}'
        wave = f'{plain(abs(amplitude))} sin({angle})'
        sign = '−' if amplitude < 0 else '+' if text else ''
        text = f'{text} {sign} {wave}' if text else f'{sign}{wave}'
    return text
