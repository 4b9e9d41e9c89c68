"""`reference.c`, compiled when it is needed and called with NumPy arrays."""

import ctypes
import math
import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.metrics.settling import BAND, SMALLEST_BAND, TRANSIENT
from auv_analysis.scenario.scenario import Scenario
from auv_dynamics.kernel.integrator import TABLEAUS, stage_times
from auv_dynamics.plant.plant import initial_state
from auv_dynamics.vehicle.model import Model
from auv_gvc_controller.laws.model import control_model

SOURCE = Path(__file__).with_name('reference.c')
# no fast-math: every result is one that C defines, but for the fused multiply-add that gcc takes
# by itself where the processor has it, as numba does in the kernel
PLAIN = ('-O3',)
NATIVE = ('-O3', '-march=native')
STATES = 25
FIGURES = (  # named as in summary.json
    'kinetic_energy.mean_by_component',
    'velocity_error.rms', 'velocity_error.max_after_2s', 'velocity_error.settling_time',
    'lumped_error.rms', 'lumped_error.max_after_2s',
    'coupling.delta_xi_max', 'coupling.delta_pi_max', 'effort.rms', 'effort.max',
)  # fmt: skip


class NoCompilerError(RuntimeError):
    """There is no C compiler; the text is one line."""


@dataclass(frozen=True, eq=False)
class Loops:
    """Closed loops as `reference.c` takes them.

    Attributes
    ----------
    parameters : (B, 510) plant, what the law knows, decomposition and gains of each
    start : (25,) position, quaternion, nu, z, integral of s_xi
    grid : (n + 1, 6, 18) nu_d, nu_d_dot, F at the stages
    band : (6,) within which an error counts as settled
    step : s

    """

    parameters: np.ndarray
    start: np.ndarray
    grid: np.ndarray
    band: np.ndarray
    step: float


def loops(scenarios: Sequence[Scenario], controller: str) -> Loops:
    """Closed loops of scenarios that differ in vehicle and gains only; the law is 'gvc'."""
    first = scenarios[0]
    t = stage_times(TABLEAUS['ode5'], first.step, 0, first.steps + 1)
    nu_d = first.setpoint.value(t)
    F, _ = first.uncertainty.tables(t)
    return Loops(
        parameters=np.array([_parameters(scenario, controller) for scenario in scenarios]),
        start=np.concatenate([initial_state(*first.initial), np.zeros(12)]),
        grid=np.concatenate([nu_d, first.setpoint.derivative(t), F], axis=-1),
        band=np.maximum(BAND * np.abs(nu_d[:, 0]).max(axis=0), SMALLEST_BAND),
        step=first.step,
    )


def _parameters(scenario: Scenario, controller: str) -> np.ndarray:
    known = control_model(scenario.vehicle)
    models, gains = (scenario.uncertainty.truth.model, known.dynamics), scenario.gains(controller)
    if any(model.lift is not None for model in models):
        raise ValueError(f'{scenario.vehicle.name}: reference.c knows no lift')
    dynamics = [part for model in models for part in model if part is not None]
    return np.concatenate([*dynamics, known.Upsilon, known.Upsilon_inv, known.N, *gains])


def rollouts(library: Any, loops: Loops) -> tuple[np.ndarray, np.ndarray]:
    """Run loops one after the other.

    Returns
    -------
    figures : (B, 10, 6) in the order of FIGURES
    diverged : (B,) s of the first sample that is not finite, inf where all are

    """
    found = np.empty((len(loops.parameters), 6 * len(FIGURES) + 1))
    _call(library, loops, found, None)
    return found[:, :-1].reshape(-1, len(FIGURES), 6), found[:, -1]


def log(library: Any, loops: Loops) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """State (n + 1, 25), tau and f (n + 1, 6) of the last of the loops."""
    rows = np.empty((len(loops.grid), STATES + 12))
    _call(library, loops, np.empty((len(loops.parameters), 6 * len(FIGURES) + 1)), rows)
    return rows[:, :STATES], rows[:, STATES:-6], rows[:, -6:]


def open_loop(
    library: Any, plants: np.ndarray, start: np.ndarray, commands: np.ndarray, step: float
) -> np.ndarray:
    """States (V, S, n, 13) of plants after each step by rk4, one plant after the other.

    Parameters
    ----------
    library : of `library`
    plants : (V, 160) of `plants`
    start : (13,) position, quaternion, nu, of every segment
    commands : (S, n, 6) held over each step; the applied wrench begins at the first one
    step : s

    """
    states = np.empty((len(plants), *commands.shape[:2], len(start)))
    library.open_loops(
        *(plants.ctypes, len(plants), start.ctypes, commands.ctypes),
        *(*commands.shape[:2], step, states.ctypes),
    )
    return states


def plants(model: Model, follow: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """Plants as `open_loop` takes them: of a `Model` with arrays (V, ...), and (V, 6) each."""
    if model.lift is not None:
        raise ValueError('reference.c knows no lift')
    return np.concatenate([*model[:-1], follow, bias], axis=1)


def _call(library: Any, loops: Loops, figures: np.ndarray, rows: np.ndarray | None) -> None:
    library.rollouts(
        *(loops.parameters.ctypes, len(loops.parameters), loops.start.ctypes, loops.grid.ctypes),
        *(
            len(loops.grid) - 1,
            loops.step,
            math.ceil((TRANSIENT - 1e-9) / loops.step),
            loops.band.ctypes,
        ),
        *(figures.ctypes, None if rows is None else rows.ctypes),
    )


def compilers() -> list[str]:
    """Names of C compilers, the first that is there to be taken."""
    return [*filter(None, [os.environ.get('CC')]), 'cc', 'gcc', 'clang']


def compiler() -> str:
    """Path of a compiler; NoCompilerError where there is none."""
    for path in filter(None, map(shutil.which, compilers())):
        return path
    raise NoCompilerError(f'{SOURCE.name}: expected a C compiler (CC, cc, gcc, clang), found none')


@cache
def library(flags: tuple[str, ...] = PLAIN) -> Any:
    """Compile `reference.c`; NoCompilerError where that is not possible."""
    # a loaded library needs its file no more
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / 'reference.so'
        command = [compiler(), '-std=gnu11', *flags, '-shared', '-fPIC', str(SOURCE), '-lm']
        done = subprocess.run(
            [*command, '-o', str(target)], capture_output=True, text=True, check=False
        )
        if done.returncode:
            error = (done.stderr.splitlines() or ['no message'])[0]
            raise NoCompilerError(f'{SOURCE.name}: expected it to compile, found {error}')
        loaded = ctypes.CDLL(str(target))
    pointer, whole, real = ctypes.c_void_p, ctypes.c_long, ctypes.c_double
    loaded.rollouts.argtypes = [
        *(pointer, whole, pointer, pointer),
        *(whole, real, whole, pointer),
        *(pointer, pointer),
    ]
    loaded.open_loops.argtypes = [
        *(pointer, whole, pointer, pointer),
        *(whole, whole, real, pointer),
    ]
    loaded.rollouts.restype = loaded.open_loops.restype = None
    return loaded
