"""In-process simulation of a scenario by the one kernel, and the kernel made ready for it."""

import sys
import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from auv_analysis.output.progress import each
from auv_analysis.runs.run import HOLDS, Hold, Run
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.closed_loop import (
    RUNS,
    Log,
    Loop,
    LoopState,
    StepBlock,
    Tables,
    Workspace,
)
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import LARGEST
from auv_dynamics.kernel.compile import INSTALLED, JITTED, cache_folder, plain
from auv_dynamics.kernel.integrator import TABLEAUS, stage_times
from auv_dynamics.kernel.lanes import with_batch_axis
from auv_dynamics.plant.actuators import memory
from auv_dynamics.plant.devices import SensorNoise, history_shape
from auv_dynamics.plant.faults import FaultRows
from auv_dynamics.plant.plant import SIZE, Plant, initial_state, unwrapped_eta
from auv_gvc_controller.control.sampled_law import SampledLaw, anti_windup, is_compiled
from auv_gvc_controller.control.setpoint import Setpoint
from auv_gvc_controller.laws.model import control_model

BLOCK = 1024  # steps that are tabulated at once


class DivergedError(ArithmeticError):
    """The closed loop left the finite numbers."""


def simulate(scenario: Scenario, controller: str, hold: Hold = 'continuous') -> Run:
    """Run one controller of a scenario.

    Parameters
    ----------
    scenario : of `load_scenario`
    controller : name of one of its controllers
    hold : 'continuous' puts the law inside every stage of the integrator, as the paper does;
        'zoh' samples it at every step and holds the wrench, as the nodes do

    Returns
    -------
    run : Run of n + 1 samples, n = duration / step

    Raises
    ------
    InputError : no controller of that name; actuators, sensors or faults with hold 'continuous'
    ValueError : no such hold
    DivergedError : a value stopped being finite; the text says when

    """
    check_hold(scenario, hold)
    gains = scenario.gains(controller)
    log = Log.empty(scenario.steps, type(gains).STATES)
    nu_d_dot = _run_kernel(scenario, controller, hold, gains, log)
    t = np.arange(scenario.steps + 1) * scenario.step
    _check_finite(log, t, scenario, controller)
    return Run(
        t=t,
        eta=unwrapped_eta(log.x),
        nu=log.x[:, 7:],
        nu_d=log.nu_d,
        nu_d_dot=nu_d_dot,
        tau=log.tau,
        disturbance=log.F,
        disturbance_estimate=log.f,
        vehicle=scenario.vehicle,
        scenario=scenario.name,
        controller=controller,
        law=scenario.controller(controller)['law'],
        gains=scenario.gain_values(controller),
        step=scenario.step,
        source='simulate',
        hold=hold,
        measured=log.measured[:, 7:] if scenario.senses else None,
        applied=log.applied if scenario.acts else None,
        law_state=log.state,
        kinds=scenario.kinds,
        faults=scenario.marks,
    )


def check_hold(scenario: Scenario, hold: Hold) -> None:
    """Raise ValueError for no such hold, InputError where something acts on samples only."""
    if hold not in HOLDS:
        raise ValueError(f'hold: expected {" or ".join(HOLDS)}, found {hold!r}')
    if hold == 'continuous' and scenario.sampled:
        expected = "hold 'zoh' (--hold zoh): they act on samples"
        raise InputError(scenario.path, scenario.sampled[0], expected, "hold 'continuous'")


def blocks(scenario: Scenario, hold: Hold) -> Iterator[tuple[StepBlock, Tables]]:
    """Inputs of a run that are known before it starts, a block of steps at a time."""
    tableau, count = TABLEAUS[scenario.data['integrator']], scenario.steps + 1
    noise, faults = scenario.noise(), scenario.fault_rows()
    for first in range(0, count, BLOCK):
        t = stage_times(tableau, scenario.step, first, min(BLOCK, count - first))
        known = tables(scenario, t, noise, faults, hold)
        yield StepBlock(t, scenario.step, first, count - 1), known


def tables(
    scenario: Scenario,
    t: np.ndarray,
    noise: SensorNoise | None = None,
    faults: FaultRows | None = None,
    hold: Hold = 'continuous',
) -> Tables:
    """Set-points, disturbance, current and the next rows of noise and faults at t (T, s)."""
    drawn = (next_rows(one, len(t)) for one in (noise, faults))
    return Tables(reference(scenario.setpoint, t, hold), *scenario.uncertainty.tables(t), *drawn)


def next_rows(drawn: SensorNoise | FaultRows | None, count: int) -> np.ndarray:
    """The next rows of noise or of faults, (0, 0) where there are none of them."""
    return np.zeros((0, 0)) if drawn is None else drawn.rows(count)


def reference(setpoint: Setpoint, t: np.ndarray, hold: Hold) -> np.ndarray:
    """nu_d and nu_d_dot (..., T, s, 12) at the stage times t (T, s); at the first alone if held."""
    t = t[:, :1] if hold == 'zoh' else t
    return np.concatenate([setpoint.value(t), setpoint.derivative(t)], axis=-1)


def _run_kernel(
    scenario: Scenario, controller: str, hold: Hold, gains: Any, log: Log
) -> np.ndarray:
    """Fill the log; nu_d_dot (n + 1, 6) at the samples."""
    tableau, loop = TABLEAUS[scenario.data['integrator']], loop_of(scenario, controller)
    run = RUNS[hold] if is_compiled(gains) else plain(RUNS[hold])
    motion, work = (with_batch_axis(part) for part in at_start(scenario, loop))
    kept = with_batch_axis(log)
    nu_d_dot, vehicle = np.empty((scenario.steps + 1, 6)), with_batch_axis(loop)
    for grid, known in each(blocks(scenario, hold), scenario.steps // BLOCK + 1):
        nu_d_dot[grid.first : grid.first + len(grid.t)] = known.reference[:, 0, 6:]
        with np.errstate(all='ignore'):
            tables_of = with_batch_axis(known)
            run(vehicle, tables_of, grid, tableau, motion, work, kept, 0, 1, None)
    return nu_d_dot


def loop_of(scenario: Scenario, controller: str) -> Loop:
    """The vehicle of a scenario with one of its controllers."""
    gains = scenario.gains(controller)
    guard = anti_windup(gains, scenario.reach(controller))
    model, actuators = control_model(scenario.vehicle), scenario.actuators
    return Loop(scenario.uncertainty.truth, actuators, gains, model, guard, scenario.faults.shape)


def at_start(scenario: Scenario, loop: Loop) -> tuple[LoopState, Workspace]:
    """Where a run begins, and room for its stages."""
    states = type(loop.gains).STATES
    x = np.concatenate([initial_state(*scenario.initial), np.zeros(states)])
    stages = len(TABLEAUS[scenario.data['integrator']].b)
    faults = loop.faults
    held, history = memory(loop.actuators, faults=faults.any), np.zeros(history_shape(faults))
    motion = LoopState(x, x[:SIZE].copy(), np.zeros(states), held, history)
    return motion, Workspace(np.zeros((stages, len(x))), np.zeros(len(x)))


def _check_finite(log: Log, t: np.ndarray, scenario: Scenario, controller: str) -> None:
    finite = np.all([(np.abs(part) < LARGEST).all(axis=1) for part in log], axis=0)
    if not finite.all():
        first = t[np.argmin(finite)]
        where = f'{scenario.name}, {controller}'
        raise DivergedError(f'{where}: the closed loop diverges, not finite from t = {first:g} s')


NOTICE_AFTER = 1.0  # s of work: a cached kernel is loaded in less, however busy the machine is


def announce(scenario: Scenario, controllers: list[str]) -> None:
    """Say how the kernel runs where that costs time: not compiled, or to be compiled first."""
    for name in controllers:
        gains = scenario.gains(name)
        if JITTED and not is_compiled(gains):
            law = type(gains).__name__
            print(f'{name}: the law {law} runs as plain Python', file=sys.stderr)
    if not JITTED:
        why = 'numba is switched off' if INSTALLED else 'numba is not installed'
        print(f'{why}: the kernel runs as plain Python, slower', file=sys.stderr)
    elif not any(cache_folder().glob('**/*.nbi')):
        print('compiling the kernel for this machine, once ...', file=sys.stderr, flush=True)


def warm_up(scenario: Scenario, controllers: list[str]) -> None:
    """Load or compile the kernel for one step of each law; say so when it takes time."""
    announce(scenario, controllers)
    if not JITTED:
        return
    begin, work = time.monotonic(), time.process_time()
    model = control_model(scenario.vehicle)
    for name in controllers:
        gains = scenario.gains(name)
        if is_compiled(gains):
            SampledLaw(gains, model, scenario.reach(name))
    x = initial_state(np.zeros(6), np.zeros(6))
    integrator = scenario.data['integrator']
    devices = scenario.actuators, scenario.noise(), scenario.faults
    Plant(scenario.uncertainty, scenario.step, integrator, x, *devices)
    if time.process_time() - work > NOTICE_AFTER:
        print(f'kernel ready after {time.monotonic() - begin:.1f} s', file=sys.stderr)
