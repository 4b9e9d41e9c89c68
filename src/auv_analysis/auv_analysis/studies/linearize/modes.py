"""The poles of linear models: damping, frequency, where each one lives; results and tables."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy.linalg
from rich.console import Console

from auv_analysis.output.progress import TextConsole
from auv_analysis.output.text import number, plain
from auv_analysis.report.results import Results, Shown, described, make_table, terminal
from auv_analysis.studies.linearize.linearize import Linearization, pole_text

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
    tiny = np.finfo(float).tiny
    weights = np.abs(left * right)
    weights /= np.maximum(weights.sum(axis=0), tiny)
    smallest = NEGLIGIBLE * np.abs(values).max()
    near = np.round(values / max(smallest, tiny))  # of equal poles rounding has no say
    order = np.lexsort((weights.argmax(axis=0), -near.real, np.abs(near)))
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


OPEN = 'open loop'


def results_of(
    name: str,
    models: Mapping[str, Linearization],
    margins: Mapping[str, Mapping[str, Any]],
    left_out: Sequence[str],
) -> Results:
    """Matrices, names, point, modes and margins of each model, and what stands in none of them.

    Parameters
    ----------
    name : of the vehicle or scenario
    models : `OPEN`, the vehicle alone, and each controller -> its linear model
    margins : controller -> what `stability_margins` gives, of those that have feedback
    left_out : keys of the scenario

    """
    found = {
        key: _model(model) | ({'margins': margins[key]} if key in margins else {})
        for key, model in models.items()
    }
    results = Results('linearization', {'name': name, 'models': found, 'left_out': list(left_out)})
    if margins:
        rows = [{'controller': key, **row} for key, one in margins.items() for row in one['axes']]
        results.add('margins', 'Margins of each axis', rows, MARGINS)
    return results


def _model(model: Linearization) -> dict[str, Any]:
    found = modes(model)
    return {
        **{key: matrix.tolist() for key, matrix in zip('ABCD', model, strict=True)},
        **{key: list(getattr(model, key)) for key in ('states', 'inputs', 'outputs')},
        **{key: getattr(model, key).tolist() for key in ('x0', 'u0', 'y0', 'drift')},
        'error': model.error,
        'modes': found,
        'stable': stability(found) == STABLE,
        'stability': stability(found),
    }


FOUR: dict[str, Any] = {'digits': 4, 'look': 'plain'}
POLES: dict[str, Shown] = {
    'pole': described('pole', unit='1/s'),
    'damping_ratio': described('damping', **FOUR),
    'natural_frequency': described('frequency', unit='rad/s', **FOUR),
    'time_constant': described('time constant', unit='s', **FOUR),
    'mostly': 'mostly',
    'part': described('part', decimals=0, scale=100.0),
}

MARGINS: dict[str, Shown] = {
    'controller': 'controller',
    'axis': 'axis',
    'gain_margin_db': described('gain', unit='dB', decimals=1),
    'phase_margin': described('phase', unit='deg', decimals=1),
    'delay_margin': described('delay', unit='s', **FOUR),
    'crossover': described('crossover', unit='rad/s', **FOUR),
    'value': described('velocity gain', **FOUR),
    'largest': described('at most', **FOUR),
}


def print_margins(margins: Mapping[str, Mapping[str, Any]], out: Console | None = None) -> None:
    """Print the margins of every controller; default: on standard output."""
    out = out or TextConsole(highlight=False)
    shown = {name: column for name, column in MARGINS.items() if name != 'controller'}
    for name, found in margins.items():
        times = (f'{key} {plain(found[key])} s' for key in ('period', 'delay', 'lag'))
        state = 'stable' if found['stable'] else 'UNSTABLE'
        out.print(f'\n{name}: {state} when held with {", ".join(times)}; opened axis by axis')
        out.print(terminal(make_table(name, '', found['axes'], shown)))
        if found['disk_margin'] is not None:
            out.print(disk_sentence(found['disk_margin']))
        if found['together'] is not None:
            factor = number(found['together']) if found['together'] else 'no factor'
            out.print(f'all of {found["gain"]} times {factor} keeps 6 dB and 45 deg on every axis')


def disk_sentence(alpha: float) -> str:
    """Tolerance by a disk margin in all axes at once."""
    decibel = 20 * np.log10((2 + alpha) / (2 - alpha)) if alpha < 2 else np.inf
    degrees = 2 * np.degrees(np.arctan(alpha / 2))
    return (
        f'disk margin {alpha:.3g}: {decibel:.3g} dB either way, or {degrees:.3g} deg, '
        'in all axes at once'
    )


def print_poles(document: dict[str, Any], out: Console | None = None) -> None:
    """Print the poles of every model, the slowest first; default: on standard output."""
    out = out or TextConsole(highlight=False)
    for name, model in document['models'].items():
        out.print(f'\n{name}: {_verdict(model)}')
        out.print(terminal(make_table(name, '', pole_rows(model['modes']), POLES)))
    if document['left_out']:
        out.print(f'\nnot in these models: {", ".join(document["left_out"])}')


def pole_rows(found: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Modes with the text of each pole, a conjugate pair as one."""
    return [{**mode, 'pole': pole_text(*mode['pole'])} for mode in found]


def _verdict(model: dict[str, Any]) -> str:
    rates = [mode['pole'][0] for mode in model['modes']]
    text = f'{len(model["states"])} states, {model["stability"]}'
    for count, what in (
        (sum(rate > 0 for rate in rates), 'grow'),
        (sum(rate == 0 for rate in rates), 'neither grow nor decay'),
    ):
        text += f', {count} of its {len(rates)} modes {what}' if count else ''
    if any(abs(rate) > 1e-9 for rate in model['drift']):
        text += '; the point moves: it turns while it is inclined'
    return text
