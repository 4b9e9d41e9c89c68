"""The one kernel: plant, law and integrator composed into a closed loop, for one or many vehicles.

What stands here is written for one vehicle, and takes several of them at a time as `lanes`.
"""

from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.kernel.compile import compiled, specialised
from auv_dynamics.kernel.integrator import Tableau, fill_stages, fill_sum
from auv_dynamics.kernel.lanes import align_stack, of_block
from auv_dynamics.kernel.six import Vector, fill_vector, vector
from auv_dynamics.plant.actuators import Actuators, fill_applied
from auv_dynamics.plant.devices import fill_arrived, fill_faulty, fill_measured
from auv_dynamics.plant.faults import FaultShape
from auv_dynamics.plant.plant import (
    SIZE,
    HeldWrench,
    attitude_of,
    fill_plant_rate,
    fill_unit_attitude,
)
from auv_dynamics.plant.uncertainty import PlantModel, lumped
from auv_gvc_controller.control.sampled_law import (
    AntiWindup,
    fill_sample,
    state_rate,
    wrench,
)
from auv_gvc_controller.laws.model import ControlModel


class Sample(NamedTuple):
    """Inputs at one sample: lanes or floats, six each but for the arrays.

    Attributes
    ----------
    x, measured, state : (13,) true and measured state, (m,) state of the law
    nu_d, tau, applied, f, F : set-point, command, applied wrench, adaptive term, lumped uncertainty

    """

    x: np.ndarray
    measured: np.ndarray
    state: np.ndarray
    nu_d: Vector
    tau: Vector
    applied: Vector
    f: Vector
    F: Vector


@specialised('record')
def fill_record(record: Any, k: int, sample: Sample) -> None:
    """Keep what `record` keeps of sample k."""
    type(record).fill_record(record, k, sample)


class Log(NamedTuple):
    """A full record, a row per sample.

    Attributes
    ----------
    x, measured : (n + 1, 13) true state and what the law saw of it
    state : (n + 1, m) of the law
    nu_d, tau, applied, f, F : (n + 1, 6) as in `Sample`

    """

    x: np.ndarray
    measured: np.ndarray
    state: np.ndarray
    nu_d: np.ndarray
    tau: np.ndarray
    applied: np.ndarray
    f: np.ndarray
    F: np.ndarray

    @staticmethod
    def fill_record(record: 'Log', k: int, sample: Sample) -> None:
        """Write row k."""
        for i in range(SIZE):
            record.x[k, i] = sample.x[i]
            record.measured[k, i] = sample.measured[i]
        for i in range(sample.state.shape[0]):
            record.state[k, i] = sample.state[i]
        fill_vector(record.nu_d[k], 0, sample.nu_d)
        fill_vector(record.tau[k], 0, sample.tau)
        fill_vector(record.applied[k], 0, sample.applied)
        fill_vector(record.f[k], 0, sample.f)
        fill_vector(record.F[k], 0, sample.F)

    @classmethod
    def empty(cls, n: int, states: int) -> 'Log':
        """Log of n + 1 samples of a law with so many states, all NaN."""
        widths = (SIZE, SIZE, states, 6, 6, 6, 6, 6)
        return cls(*(np.full((n + 1, width), np.nan) for width in widths))


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

    truth: PlantModel
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
    k : index of the sample at which the step begins
    t : (s,) times of the stages of this step, s
    reference : (s, 12) nu_d, nu_d_dot at the stages
    F : (s, 6) external disturbance at the stages
    current : (s, 6) at the stages, (0, 6) in still water
    record : takes the sample at stage 0

    """

    loop: Loop
    k: int
    t: np.ndarray
    reference: np.ndarray
    F: np.ndarray
    current: np.ndarray
    record: Any

    @staticmethod
    def fill_rate(system: 'LawInside', stage: int, x: np.ndarray, rate: np.ndarray) -> None:
        """x_dot at one stage; what is known at the first one is the sample."""
        truth, gains, model = system.loop.truth, system.loop.gains, system.loop.model
        body, state, F = x[:SIZE], x[SIZE:], vector(system.F[stage], 0)
        t, nu, attitude = system.t[stage], vector(x, 7), attitude_of(x)
        nu_d, nu_d_dot = vector(system.reference[stage], 0), vector(system.reference[stage], 6)
        tau, f = wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model)
        change = state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model)
        fill_plant_rate(truth, x, tau, F, system.current, stage, rate)
        if stage == 0:
            total = lumped(truth, attitude, nu, tau, F, vector(rate, 7))
            sample = Sample(body, body, state, nu_d, tau, tau, f, total)
            fill_record(system.record, system.k, sample)
        for i in range(x.shape[0] - SIZE):
            rate[SIZE + i] = change[i]


class StepBlock(NamedTuple):
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
    """Inputs of these steps, known before they are taken, on the grid of steps and stages.

    Attributes
    ----------
    reference : (T, s, 12) nu_d, nu_d_dot; with the wrench held only the first stage counts
    F : (T, s, 6) external disturbance, N, N m
    current : (T, s, 6) v_c, v_c_dot in NED; (T, 0, 6) in still water
    noise : (T, 11) of the sensors; (0, 0): they are perfect
    faults : (T, 14 + 2 n), see `plant.faults`; (0, 0): there are none

    """

    reference: np.ndarray
    F: np.ndarray
    current: np.ndarray
    noise: np.ndarray
    faults: np.ndarray


class LoopState(NamedTuple):
    """State carried from one block of steps to the next.

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


@compiled
def run_continuous(
    loops: Loop, tables: Tables, grid: StepBlock, tableau: Tableau, motions: LoopState,
    work: Workspace, records: Any, first: int, last: int, lanes: int | None,
) -> None:  # fmt: skip
    """Take a block of steps with the law inside every stage, vehicle after vehicle.

    From block of vehicles `first` to before `last`. All arrays but those of `grid` and `tableau`
    have a leading axis of these blocks, see `of_block`; `work` has one, which all use.
    """
    align_stack(lanes)
    (stages, trial), step, every = of_block(work, 0, lanes), grid.step, tableau.b.shape[0]
    for b in range(first, last):
        loop, known = of_block(loops, b, lanes), of_block(tables, b, lanes)
        x, record = of_block(motions, b, lanes).x, of_block(records, b, lanes)
        for row in range(grid.t.shape[0]):
            k, t = grid.first + row, grid.t[row]
            reference, F, current = known.reference[row], known.F[row], known.current[row]
            system = LawInside(loop, k, t, reference, F, current, record)
            count = every if k < grid.last else 1  # of the last sample nothing but its record
            fill_stages(system, x, step, tableau, stages, trial, count)
            if k < grid.last:
                fill_sum(x, x, step, tableau.b, stages, count)
                fill_unit_attitude(x)


@compiled
def run_held(
    loops: Loop, tables: Tables, grid: StepBlock, tableau: Tableau, motions: LoopState,
    work: Workspace, records: Any, first: int, last: int, lanes: int | None,
) -> None:  # fmt: skip
    """Take a block of steps with the law at the samples, the wrench held; the rest as above."""
    align_stack(lanes)
    (stages, trial), step, every = of_block(work, 0, lanes), grid.step, tableau.b.shape[0]
    for b in range(first, last):
        loop, known = of_block(loops, b, lanes), of_block(tables, b, lanes)
        motion, record = of_block(motions, b, lanes), of_block(records, b, lanes)
        truth, x, measured, history = loop.truth, motion.x, motion.measured, motion.history
        body, state = x[:SIZE], x[SIZE:]
        for row in range(grid.t.shape[0]):
            k = grid.first + row
            reference, F, current = known.reference[row], known.F[row], known.current[row]
            if history.shape[0] > 0:
                fill_measured(known.noise[row], body, history[history.shape[0] - 1])
                fill_arrived(known.faults[row], k, history, measured)
            elif known.noise.shape[0] > 0:
                fill_measured(known.noise[row], body, measured)
            else:
                for i in range(SIZE):
                    measured[i] = body[i]
            nu_d, nu_d_dot = vector(reference[0], 0), vector(reference[0], 6)
            dt = step if k > 0 else 0.0
            tau, f = fill_sample(
                grid.t[row, 0], dt, vector(measured, 7), attitude_of(measured), nu_d, nu_d_dot,
                state, motion.rate, loop.gains, loop.model, loop.guard,
            )  # fmt: skip
            if loop.faults.any:
                applied = fill_faulty(loop.actuators, known.faults[row], k, tau, motion.memory)
            else:
                applied = fill_applied(loop.actuators, k, tau, motion.memory)
            held = HeldWrench(truth, applied, F, current)
            count = every if k < grid.last else 1  # as above
            fill_stages(held, body, step, tableau, stages, trial, count)
            nu, d, nu_dot = vector(x, 7), vector(F[0], 0), vector(stages[0], 7)
            total = lumped(truth, attitude_of(x), nu, applied, d, nu_dot)
            fill_record(record, k, Sample(body, measured, state, nu_d, tau, applied, f, total))
            if k < grid.last:
                fill_sum(body, body, step, tableau.b, stages, count)
                fill_unit_attitude(body)


RUNS = {'continuous': run_continuous, 'zoh': run_held}
