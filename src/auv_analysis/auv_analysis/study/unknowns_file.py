"""Files of the study of what is unknown: verdicts, claims, and energy over the window."""

from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.metrics.energy import shares
from auv_analysis.output.new_files import write_table
from auv_analysis.report.claims_rows import ROWS
from auv_analysis.report.evidence import DECIDED
from auv_analysis.report.paper import KINETIC_ENERGY
from auv_analysis.study.robustness import Held, Robustness
from auv_analysis.study.unknowns import NAMES
from auv_analysis.study.unknowns_run import Unknowns
from auv_dynamics.vehicle import DOFS

VERDICTS, CLAIMS, ENERGY = 'unknowns.parquet', 'unknowns_claims.parquet', 'energy_window.parquet'
SPLIT = ('threshold', 'below', 'above', 'explained')


def write_unknowns(folder: Path, found: Unknowns, rows: list[Robustness]) -> list[Path]:
    """Write the three files of the study."""
    return [_verdicts(folder, found), _claims(folder, rows), _energy(folder, found)]


def _verdicts(folder: Path, found: Unknowns) -> Path:
    """A row per variant, window and claim, with the values of the variant."""
    places = [
        (v, w, c)
        for v in range(len(found.variants))
        for w in range(len(found.windows))
        for c in range(len(ROWS))
    ]
    variants = [found.variants[v] for v, _, _ in places]
    columns: dict[str, list[Any]] = {
        'variant': [v for v, _, _ in places],
        'kind': [variant.kind for variant in variants],
        **{name: [getattr(variant, name) for variant in variants] for name in NAMES},
        'window': [found.windows[w] for _, w, _ in places],
        'number': [c + 1 for _, _, c in places],
        'claim': [ROWS[c].claim for _, _, c in places],
        'verdict': [str(found.verdicts[place]) for place in places],
    }
    return write_table(folder / VERDICTS, columns)


def _claims(folder: Path, rows: list[Robustness]) -> Path:
    """Two rows per claim: over all variants, and over those with the exponents' sign as read."""
    pairs = [(row, of, getattr(row, of)) for row in rows for of in ('every', 'as_read')]
    columns: dict[str, list[Any]] = {
        'number': [row.number for row, _, _ in pairs],
        'claim': [row.claim for row, _, _ in pairs],
        'of': [of for _, of, _ in pairs],
        **{
            verdict.replace(' ', '_'): [held.percent[verdict] for _, _, held in pairs]
            for verdict in DECIDED
        },
        'outcome': [held.outcome for _, _, held in pairs],
        'decided_by': [held.split.unknown if held.split else '' for _, _, held in pairs],
        **{name: [_of_split(held, name) for _, _, held in pairs] for name in SPLIT},
    }
    return write_table(folder / CLAIMS, columns)


def _of_split(held: Held, name: str) -> float | None:
    return float(getattr(held.split, name)) if held.split else None


def to_paper(energy: np.ndarray) -> np.ndarray:
    """Difference of energies, J, to the paper's, in % of that."""
    return 100.0 * (energy / KINETIC_ENERGY - 1.0)


def _energy(folder: Path, found: Unknowns) -> Path:
    """Mean kinetic energy over 0 to T: first variant, smallest and largest of all, its shares."""
    total = found.energy.sum(axis=2)
    parts = shares(found.energy[0])
    columns = {
        'end': found.ends.tolist(),
        'energy': total[0].tolist(),
        'energy_low': total.min(axis=0).tolist(),
        'energy_high': total.max(axis=0).tolist(),
        'to_paper_percent': to_paper(total[0]).tolist(),
        **{f'share.{dof}': parts[:, i].tolist() for i, dof in enumerate(DOFS)},
    }
    return write_table(folder / ENERGY, columns)
