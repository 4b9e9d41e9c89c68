"""The report's tables as plain values: what is printed, not how."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from auv_analysis.coupling import input_deformation, velocity_deformation
from auv_analysis.energy import shares
from auv_analysis.report import paper
from auv_analysis.report.sketch import Sketch
from auv_analysis.report.text import number, plain
from auv_analysis.report.words import gain_text
from auv_analysis.run import Facts
from auv_dynamics.signals import DOFS
from auv_gvc_controller.decomposition import inverse_upper
from auv_gvc_controller.laws import SHIPPED

Summaries = Mapping[str, Mapping[str, Any]]
VELOCITIES, WRENCHES = 'uvwpqr', 'XYZKMN'
ZERO = 'zero (no adaptive term)'


def controller_row(run: Facts) -> dict[str, Any]:
    """Name, law, gains in words and origin of a run; a gain left to its default says so."""
    defaults = getattr(SHIPPED.get(run.law), '_field_defaults', {}) if run.gains else {}
    left = {name: value for name, value in defaults.items() if name not in run.gains}
    return {
        'name': run.controller,
        'law': run.law,
        'gains': {name: gain_text(value) for name, value in run.gains.items()}
        | {name: f'{gain_text(value)} (default)' for name, value in left.items()},
        'source': {'bag': 'recorded on the node graph', 'simulate': 'simulated in process'}.get(
            run.source, run.source
        ),
        'duration': run.duration,
        'step': run.step,
        'samples': run.samples,
    }


def decompositions(runs: Mapping[str, Facts], summaries: Summaries) -> list[dict[str, Any]]:
    """Upsilon and N, once for each vehicle that differs."""
    found: list[dict[str, Any]] = []
    for name, run in runs.items():
        parts = summaries[name]['decomposition']
        same = [entry for entry in found if entry['parts'] == parts]
        if same:
            same[0]['controllers'].append(name)
        else:
            entry = {'parts': parts, 'vehicle': run.vehicle.name, 'controllers': [name]}
            found.append(entry)
    return found


def body_gains(summaries: Summaries) -> list[dict[str, Any]]:
    """K_D and K_f, once for those that share them: the matrix, or text for a multiple of I."""
    rows: list[dict[str, Any]] = []
    for name, summary in summaries.items():
        for symbol in ('K_D', 'K_f'):
            gain = summary['gains'][symbol]
            same = [row for row in rows if (row['symbol'], row['gain']) == (symbol, gain)]
            if same:
                same[0]['controllers'].append(name)
            elif gain is not None:
                row = {'controllers': [name], 'symbol': symbol, 'gain': gain}
                rows.append(row | {'text': _multiple(np.array(gain))})
    return rows


def _multiple(matrix: np.ndarray) -> str | None:
    """A matrix as a multiple of I in words; None where it is none."""
    if not matrix.any():
        return ZERO
    scalar = np.array_equal(matrix, matrix[0, 0] * np.eye(6))
    return f'{plain(matrix[0, 0], 6)} I' if scalar else None


def energy_rows(runs: Mapping[str, Sketch], original: Sketch | None) -> list[dict[str, Any]]:
    """Mean kinetic energy and shares per run and window; the paper's first, where it applies."""
    rows = []
    if original is not None:
        rows.append({
            'name': 'paper', 'window': 'not printed', 'mean': paper.KINETIC_ENERGY,
            'shares': [f'{x:.2f}' for x in paper.SHARES],
        })  # fmt: skip
    for name, run in runs.items():
        for end in dict.fromkeys([min(paper.ENERGY_WINDOW, run.duration), run.duration]):
            mean = run.part('energy', 0.0, end).mean
            rows.append({
                'name': name, 'window': f'0–{end:g} s', 'mean': float(mean.sum()),
                'shares': [_share(x) for x in shares(mean)],
            })  # fmt: skip
    return rows


def couplings(runs: Mapping[str, Facts], summaries: Summaries) -> list[dict[str, Any]]:
    """Rows of delta_xi and delta_pi: the equation and each run's largest magnitude."""
    first = next(iter(runs))
    Upsilon = np.array(summaries[first]['decomposition']['Upsilon'])
    zeros = summaries[first]['coupling']['structural_zeros']
    rules = {
        'delta_xi': velocity_deformation(inverse_upper(Upsilon)),
        'delta_pi': input_deformation(Upsilon),
    }
    signals = {'delta_xi': list(VELOCITIES), 'delta_pi': [f'τ_{x}' for x in WRENCHES]}
    symbols = {'delta_xi': 'Δξ', 'delta_pi': 'Δπ'}
    units = {'delta_xi': ('m/s', 'rad/s'), 'delta_pi': ('N', 'N m')}
    return [
        {
            'symbol': f'{symbols[kind]}_{i + 1}',
            'dof': dof,
            'unit': units[kind][i // 3],
            'structural': dof in zeros[kind],
            'rule': _linear(rules[kind][i], signals[kind]),
            'values': [summary['coupling'][f'{kind}_max'][i] for summary in summaries.values()],
        }
        for kind in ('delta_xi', 'delta_pi')
        for i, dof in enumerate(DOFS)
    ]


def notes(runs: Mapping[str, Facts]) -> list[str]:
    """Notes of the runs, each once."""
    found = [f'{name}: {note}' for name, run in runs.items() for note in run.notes]
    return list(dict.fromkeys(found))


def _share(value: float) -> str:
    return (
        f'{value:.2f}' if value >= 0.095 else f'{value:.3f}' if value >= 5e-4 else number(value, 1)
    )


def _linear(row: np.ndarray, signals: list[str]) -> str:
    """A linear form such as '−0.015 p + 0.075 r'; entries that are rounding are left out."""
    scale = 1e-12 * max(1.0, np.abs(row).max())
    terms = [(value, name) for value, name in zip(row, signals, strict=True) if abs(value) > scale]
    text = ' '.join(f'{"+" if v > 0 else "−"} {plain(abs(v), 3)} {name}' for v, name in terms)
    return (text.removeprefix('+ ') if text[:1] == '+' else text.replace('− ', '−', 1)) or '0'
