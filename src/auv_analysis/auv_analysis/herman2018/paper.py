"""Herman 2018 as data: its gains, its numbers, and what each figure shows."""

from collections.abc import Mapping
from typing import TypeVar

import numpy as np

from auv_analysis.metrics import summary
from auv_analysis.runs.run import RunInfo
from auv_dynamics.files.yaml_files import matrix6

AnyFacts = TypeVar('AnyFacts', bound=RunInfo)
CASES = ('case1', 'case2')

GVC_GAINS = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}  # (36), (37)
CL_GAINS = {'case1': GVC_GAINS, 'case2': {**GVC_GAINS, 'k_D': 1000.0, 'Gamma': 6000.0}}  # (40)

N = (300.0, 500.0, 500.0, 40.0, 175.5, 141.1)  # kg, kg m2; (38)
KINETIC_ENERGY = 519.47  # J; section 5, step 4
SHARES = (23.34, 0.00, 76.57, 0.01, 0.00, 0.08)  # %; section 5, step 4
SWAY_DEFORMATION = 0.01  # m/s; section 5, step 5
ENERGY_WINDOW = summary.ENERGY_WINDOW  # s

_BOTH = {
    ('errors', 'gvc'): '1',
    ('lumped_error', 'gvc'): '3',
    ('delta_xi', 'gvc'): '4',
    ('delta_pi', 'gvc'): '5',
}
FIGURES: dict[str, dict[tuple[str, str], str]] = {
    'case1': _BOTH | {('errors', 'cl'): '2'},
    'case2': _BOTH
    | {
        ('errors', 'cl'): '6(a,b)',
        ('lumped_error', 'cl'): '6(c,d)',
        ('inputs', 'cl'): '6(e,f)',
        ('inputs', 'gvc'): '7',
    },
}


def has_gains(run: RunInfo, gains: Mapping[str, float]) -> bool:
    """Whether a run's gains are these multiples of the identity."""
    return set(run.gains) == set(gains) and all(
        np.allclose(matrix6(run.gains[k]), gains[k] * np.eye(6), rtol=1e-12, atol=0.0)
        for k in gains
    )


def is_plain(run: RunInfo) -> bool:
    """Whether a run has nothing that the paper's have not: devices, model error or current."""
    plain = not (run.acting or run.sensing)
    return plain and run.kinds in (None, frozenset({'herman2018'}))


def paper_run(runs: Mapping[str, AnyFacts], law: str) -> AnyFacts | None:
    """The first of runs of `case1` or `case2` with the paper's gains for a law; None without."""
    for run in runs.values():
        gains = GVC_GAINS if law == 'gvc' else CL_GAINS[run.scenario]
        if run.law == law and is_plain(run) and has_gains(run, gains):
            return run
    return None


def paper_figures(run: RunInfo) -> list[str]:
    """Figures of a run that correspond to a figure of the paper, in words."""
    numbers = FIGURES.get(run.scenario, {})
    if not numbers or paper_run({run.controller: run}, run.law) is None:
        return []
    kinds = ('errors', 'lumped_error', 'inputs', 'delta_xi', 'delta_pi')
    found = {kind: numbers.get((kind, run.law)) for kind in kinds}
    return [f'{kind} is the paper’s figure {number}' for kind, number in found.items() if number]
