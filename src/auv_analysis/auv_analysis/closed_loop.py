"""The one kernel: plant, law and integrator composed into a closed loop over a whole run."""

from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.actuators import fill_applied
from auv_dynamics.integrator import fill_step
from auv_dynamics.jit import compiled, jitable
from auv_dynamics.plant import (
    SIZE,
    attitude_of,
    fill_plant_rate,
    fill_plant_step,
    fill_unit_attitude,
)
from auv_dynamics.sensors import fill_measured
from auv_dynamics.six import fill_vector, vector
from auv_dynamics.uncertainty import Truth, lumped
from auv_gvc_controller.model import ControlModel
from auv_gvc_controller.sampled import fill_sample, state_rate, wrench


class ClosedLoop(NamedTuple):
    """The law inside every stage, as the paper simulates it: x = plant (13), law's state.

    Attributes
    ----------
    truth : coefficients of the plant
    gains, model : the law's gains and what it knows
    t : (s,) times of the stages of this step, s
    reference : (s, 12) nu_d, nu_d_dot at the stages
    F : (s, 6) external disturbance at the stages
    current : (s, 6) at the stages, (0, 6) in still water

    """

    truth: Truth
    gains: Any
    model: ControlModel
    t: np.ndarray
    reference: np.ndarray
    F: np.ndarray
    current: np.ndarray

    @staticmethod
    def fill_rate(system, stage, x, rate):
        """x_dot at one stage."""
        tau, _, change = answer(system, stage, x)
        F = vector(system.F[stage], 0)
        fill_plant_rate(system.truth, x, tau, F, system.current, stage, rate)
        for i in range(x.shape[0] - SIZE):
            rate[SIZE + i] = change[i]


@jitable
def answer(system, stage, x):
    """(tau, f, state rate) of the law at a stage of the step."""
    t, nu, attitude, state = system.t[stage], vector(x, 7), attitude_of(x), x[SIZE:]
    nu_d, nu_d_dot = vector(system.reference[stage], 0), vector(system.reference[stage], 6)
    gains, model = system.gains, system.model
    tau, f = wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model)
    change = state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model)
    return tau, f, change


class Grid(NamedTuple):
    """What is known of a run before it starts, on the grid of steps and stages.

    Attributes
    ----------
    t : (n + 1, s) s
    reference : (n + 1, s, 12) nu_d, nu_d_dot
    F : (n + 1, s, 6) external disturbance, N, N m
    current : (n + 1, s, 6) v_c, v_c_dot in NED; (n + 1, 0, 6) in still water
    noise : (n + 1, 10) of the sensors; (0, 10): they are perfect
    step : s

    """

    t: np.ndarray
    reference: np.ndarray
    F: np.ndarray
    current: np.ndarray
    noise: np.ndarray
    step: float


class Log(NamedTuple):
    """What a run leaves, a row per sample.

    Attributes
    ----------
    x, measured : (n + 1, 13) true state and what the law saw of it
    state : (n + 1, m) of the law
    tau, applied, f, F : (n + 1, 6) command, applied wrench, adaptive term, lumped uncertainty

    """

    x: np.ndarray
    measured: np.ndarray
    state: np.ndarray
    tau: np.ndarray
    applied: np.ndarray
    f: np.ndarray
    F: np.ndarray


@jitable
def fill_log(log, k, truth, x, measured, state, tau, applied, f, F, current):
    """Write sample k; F (s, 6) and `current` at the stages of the step that begins there."""
    log.x[k], log.measured[k], log.state[k] = x, measured, state
    fill_vector(log.tau[k], 0, tau)
    fill_vector(log.applied[k], 0, applied)
    fill_vector(log.f[k], 0, f)
    total = lumped(truth, attitude_of(x), vector(x, 7), applied, vector(F[0], 0), current)
    fill_vector(log.F[k], 0, total)


@compiled
def fill_continuous(truth, gains, model, grid, tableau, x, log):
    """Run the loop with the law inside every stage; x (13 + m,) is advanced in place."""
    stages, trial = np.zeros((tableau.b.shape[0], x.shape[0])), np.zeros(x.shape[0])
    last = grid.t.shape[0] - 1
    body, state = x[:SIZE], x[SIZE:]
    for k in range(last + 1):
        F, current = grid.F[k], grid.current[k]
        system = ClosedLoop(truth, gains, model, grid.t[k], grid.reference[k], F, current)
        tau, f, _ = answer(system, 0, x)
        fill_log(log, k, truth, body, body, state, tau, tau, f, F, current)
        if k < last:
            fill_step(system, x, grid.step, tableau, stages, trial)
            fill_unit_attitude(x)


@compiled
def fill_held(truth, actuators, memory, gains, model, guard, grid, tableau, x, log):
    """Run the loop with the law at the samples, the wrench held between; x (13 + m,) in place."""
    stages, trial = np.zeros((tableau.b.shape[0], SIZE)), np.zeros(SIZE)
    last = grid.t.shape[0] - 1
    body, state = x[:SIZE], x[SIZE:]
    measured = body.copy()
    rate = np.zeros(state.shape[0])
    for k in range(last + 1):
        F, current = grid.F[k], grid.current[k]
        if grid.noise.shape[0] > 0:
            fill_measured(grid.noise[k], k, body, measured)
        else:
            measured[:] = body
        nu_d, nu_d_dot = vector(grid.reference[k, 0], 0), vector(grid.reference[k, 0], 6)
        dt = grid.step if k > 0 else 0.0
        tau, f = fill_sample(
            grid.t[k, 0], dt, vector(measured, 7), attitude_of(measured), nu_d, nu_d_dot,
            state, rate, gains, model, guard,
        )  # fmt: skip
        applied = fill_applied(actuators, k, tau, memory)
        fill_log(log, k, truth, body, measured, state, tau, applied, f, F, current)
        if k < last:
            fill_plant_step(truth, body, applied, F, current, grid.step, tableau, stages, trial)
