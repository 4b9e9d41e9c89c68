"""Runs whose every column is like no other's: whatever is exchanged shows."""

from dataclasses import replace
from typing import Any

import numpy as np

from auv_analysis.runs.run import Run
from auv_analysis.scenario.fault_words import Mark
from auv_dynamics import load_vehicle

DOFS = ('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')
HALVES = ((0, 1, 2), (3, 4, 5))
START, STEP, SAMPLES = 3.0, 0.05, 241  # 12 s
VELOCITY, WRENCH = ('m/s', 'rad/s'), ('N', 'N m')
GAINS = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
MARKS = (Mark(1, 'thruster', 'first', 5.0, 7.0), Mark(2, 'thruster', 'second', 6.0, float('inf')))
FRAME = np.random.default_rng(0).normal(size=(6, 6))
M = FRAME @ FRAME.T * np.outer(*[[20.0, 19.0, 18.0, 4.0, 3.0, 2.0]] * 2) + np.diag(
    range(90, 30, -10)
)
VEHICLE = replace(load_vehicle('rexrov'), M=M, M_RB=None, M_A=None)
L = np.linalg.cholesky(M)  # = Upsilon^-T N^1/2
UPSILON_INV = (L / np.diag(L)).T
UPSILON = np.linalg.inv(UPSILON_INV)
N = np.diag(L) ** 2


def made(name: str, law: str, seed: int, **about: Any) -> Run:
    """A run whose every column is like no other's."""
    rng = np.random.default_rng(seed)
    sizes = {'nu': 1.0, 'nu_d': 1.0, 'tau': 1e3, 'eta': 1.0}
    sizes |= {'disturbance': 80.0, 'disturbance_estimate': 80.0}
    signals = {
        signal: size * rng.normal(size=(SAMPLES, 6)) * np.linspace(0.5, 2.0, 6) + 0.3 * size
        for signal, size in sizes.items()
    }
    facts = {
        'gains': GAINS,
        'law_state': rng.normal(size=(SAMPLES, 12)),
        'nu_d_dot': rng.normal(size=(SAMPLES, 6)),
    }
    return Run(**{
        'vehicle': VEHICLE, 'scenario': 'made', 'controller': name, 'law': law, 'step': STEP,
        'source': 'simulate', 'faults': MARKS, 't': START + STEP * np.arange(SAMPLES),
        **facts, **signals, **about,
    })  # fmt: skip


def energies(nu: np.ndarray) -> np.ndarray:
    """(n, 6) energy of each component of xi."""
    return 0.5 * N * (nu @ UPSILON_INV.T) ** 2
