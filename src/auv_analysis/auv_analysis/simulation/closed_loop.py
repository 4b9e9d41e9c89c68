"""The one kernel: plant, law and integrator composed into a closed loop, for one or many vehicles.

What stands here is written for one vehicle; with `lanes` it takes several of them at a time.
"""

from typing import Any, NamedTuple

import numpy as np

from auv_analysis.simulation.records import Sample, fill_record
from auv_dynamics.kernel.compile import compiled, helper
from auv_dynamics.kernel.integrator import Tableau, fill_step
from auv_dynamics.kernel.lanes import uncounted
from auv_dynamics.kernel.six import Numbers, Vector, vector
from auv_dynamics.plant.actuators import Actuators, fill_applied
from auv_dynamics.plant.faults import FaultShape
from auv_dynamics.plant.faulty_devices import fill_arrived, fill_faulty
from auv_dynamics.plant.plant import (
    SIZE,
    HeldWrench,
    attitude_of,
    fill_plant_rate,
    fill_unit_attitude,
)
from auv_dynamics.plant.sensors import fill_measured
from auv_dynamics.plant.uncertainty import Truth, lumped
from auv_gvc_controller.control.sampled import (
    AntiWindup,
    fill_sample,
    state_rate,
    wrench,
)
from auv_gvc_controller.laws.model import ControlModel


class Loop(NamedTuple):
    """One vehicle and its controller.

    Attributes
    ----------
    truth : coefficients of the plant
    actuators : between the command and the applied wrench
    gains, model : the law's gains and what it knows of the vehicle
    guard : what stops its integrals
    faults : what of them there is

    """

    truth: Truth
    actuators: Actuators
    gains: Any
    model: ControlModel
    guard: AntiWindup
    faults: FaultShape


class LawInside(NamedTuple):
    """A step with the law inside every stage, as the paper has it: x = plant (13), law's state.

    Attributes
    ----------
    loop : the vehicle and its controller
    t : (s,) times of the stages of this step, s
    reference : (s, 12) nu_d, nu_d_dot at the stages
    F : (s, 6) external disturbance at the stages
    current : (s, 6) at the stages, (0, 6) in still water

    """

    loop: Loop
    t: np.ndarray
    reference: np.ndarray
    F: np.ndarray
    current: np.ndarray

    @staticmethod
    def fill_rate(system: 'LawInside', stage: int, x: np.ndarray, rate: np.ndarray) -> None:
        """x_dot at one stage."""
        tau, _, change = answer(system, stage, x)
        fill_answered(system, stage, x, tau, change, rate)


@helper
def answer(system: LawInside, stage: int, x: np.ndarray) -> tuple[Numbers, Numbers, Vector]:
    """(tau, f, state rate) of the law at a stage of the step."""
    t, nu, attitude, state = system.t[stage], vector(x, 7), attitude_of(x), x[SIZE:]
    nu_d, nu_d_dot = vector(system.reference[stage], 0), vector(system.reference[stage], 6)
    gains, model = system.loop.gains, system.loop.model
    tau, f = wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model)
    change = state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model)
    return tau, f, change


@helper
def fill_answered(
    system: LawInside, stage: int, x: np.ndarray, tau: Vector, change: Vector, rate: np.ndarray
) -> None:
    """Write x_dot at a stage of the step at which the law has answered into `rate`."""
    F = vector(system.F[stage], 0)
    fill_plant_rate(system.loop.truth, x, tau, F, system.current, stage, rate)
    for i in range(x.shape[0] - SIZE):
        rate[SIZE + i] = change[i]


class Grid(NamedTuple):
    """A block of consecutive steps: T samples, the first of which is sample `first` of the run.

    Attributes
    ----------
    t : (T, s) times of the stages, s
    step : s
    first, last : index of the block's first sample, and of the last one of the run

    """

    t: np.ndarray
    step: float
    first: int
    last: int


class Tables(NamedTuple):
    """What is known of these steps before they are taken, on the grid of steps and stages.

    Attributes
    ----------
    reference : (T, s, 12) nu_d, nu_d_dot
    F : (T, s, 6) external disturbance, N, N m
    current : (T, s, 6) v_c, v_c_dot in NED; (T, 0, 6) in still water
    noise : (T, 11) of the sensors; (0, 11): they are perfect
    faults : (T, 14 + 2 n), see `faulty_devices`; (0, 0): there are none

    """

    reference: np.ndarray
    F: np.ndarray
    current: np.ndarray
    noise: np.ndarray
    faults: np.ndarray


class SharedTables(Tables):
    """Tables of a batch that are the same for all its vehicles."""

    SHARED = True


class Motion(NamedTuple):
    """What goes on from one block of steps to the next.

    Attributes
    ----------
    x : (13 + m,) state of the plant, then of the law
    measured : (13,) what the law last saw of the plant
    rate : (m,) of the law's state, held between samples
    memory : (1 + delay, 6) of the actuators; with faults one row more
    history : (delay + 2, 13) measurements that are under way where sensors are late, else (0, 13)

    """

    x: np.ndarray
    measured: np.ndarray
    rate: np.ndarray
    memory: np.ndarray
    history: np.ndarray


class Workspace(NamedTuple):
    """Stages (s, n) and trial state (n,) of the integrator, n = 13 + m."""

    stages: np.ndarray
    trial: np.ndarray


@helper
def fill_continuous(
    loop: Loop, tables: Tables, grid: Grid, tableau: Tableau, motion: Motion, work: Workspace,
    record: Any,
) -> None:  # fmt: skip
    """Take a block of steps with the law inside every stage."""
    x = motion.x
    body, state = x[:SIZE], x[SIZE:]
    for row in range(grid.t.shape[0]):
        k = grid.first + row
        reference, F, current = tables.reference[row], tables.F[row], tables.current[row]
        system = LawInside(loop, grid.t[row], reference, F, current)
        tau, f, change = answer(system, 0, x)
        total = lumped(loop.truth, attitude_of(x), vector(x, 7), tau, vector(F[0], 0), current)
        nu_d = vector(reference[0], 0)
        fill_record(record, k, Sample(body, body, state, nu_d, tau, tau, f, total))
        if k < grid.last:
            fill_answered(system, 0, x, tau, change, work.stages[0])
            fill_step(system, x, grid.step, tableau, work.stages, work.trial, 1)
            fill_unit_attitude(x)


@helper
def fill_held(
    loop: Loop, tables: Tables, grid: Grid, tableau: Tableau, motion: Motion, work: Workspace,
    record: Any,
) -> None:  # fmt: skip
    """Take a block of steps with the law at the samples, the wrench held between."""
    truth, x, measured = loop.truth, motion.x, motion.measured
    late = motion.history.shape[0] > 0
    body, state = x[:SIZE], x[SIZE:]
    for row in range(grid.t.shape[0]):
        k = grid.first + row
        reference, F, current = tables.reference[row], tables.F[row], tables.current[row]
        if late:
            fill_measured(tables.noise[row], body, motion.history[motion.history.shape[0] - 1])
            fill_arrived(tables.faults[row], k, motion.history, measured)
        elif tables.noise.shape[0] > 0:
            fill_measured(tables.noise[row], body, measured)
        else:
            for i in range(SIZE):
                measured[i] = body[i]
        nu_d, nu_d_dot = vector(reference[0], 0), vector(reference[0], 6)
        dt = grid.step if k > 0 else 0.0
        tau, f = fill_sample(
            grid.t[row, 0], dt, vector(measured, 7), attitude_of(measured), nu_d, nu_d_dot,
            state, motion.rate, loop.gains, loop.model, loop.guard,
        )  # fmt: skip
        if loop.faults.any:
            applied = fill_faulty(loop.actuators, tables.faults[row], k, tau, motion.memory)
        else:
            applied = fill_applied(loop.actuators, k, tau, motion.memory)
        total = lumped(truth, attitude_of(x), vector(x, 7), applied, vector(F[0], 0), current)
        fill_record(record, k, Sample(body, measured, state, nu_d, tau, applied, f, total))
        if k < grid.last:
            held = HeldWrench(truth, applied, F, current)
            fill_step(held, body, grid.step, tableau, work.stages, work.trial)
            fill_unit_attitude(body)


@compiled
def run_continuous(
    loop: Loop, tables: Tables, grid: Grid, tableau: Tableau, motion: Motion, work: Workspace,
    record: Any,
) -> None:  # fmt: skip
    """`fill_continuous` for one vehicle, to be called from Python."""
    fill_continuous(
        uncounted(loop), uncounted(tables), uncounted(grid), uncounted(tableau),
        uncounted(motion), uncounted(work), uncounted(record),
    )  # fmt: skip


@compiled
def run_held(
    loop: Loop, tables: Tables, grid: Grid, tableau: Tableau, motion: Motion, work: Workspace,
    record: Any,
) -> None:  # fmt: skip
    """`fill_held` for one vehicle, to be called from Python."""
    fill_held(
        uncounted(loop), uncounted(tables), uncounted(grid), uncounted(tableau),
        uncounted(motion), uncounted(work), uncounted(record),
    )  # fmt: skip
