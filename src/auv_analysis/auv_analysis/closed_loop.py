"""The one kernel: plant, law and integrator composed into a closed loop over a whole run."""

from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.integrator import fill_step
from auv_dynamics.jit import compiled, jitable
from auv_dynamics.model import Model
from auv_dynamics.plant import (
    SIZE,
    attitude_of,
    fill_plant_rate,
    fill_plant_step,
    fill_unit_attitude,
)
from auv_dynamics.six import fill_vector, vector
from auv_gvc_controller.model import ControlModel
from auv_gvc_controller.sampled import fill_sample, state_rate, wrench


class ClosedLoop(NamedTuple):
    """The law inside every stage, as the paper simulates it: x = plant (13), law's state.

    Attributes
    ----------
    plant : coefficients of the true vehicle
    gains, model : the law's gains and what it knows
    t : (s,) times of the stages of this step, s
    reference : (s, 12) nu_d, nu_d_dot at the stages
    F : (s, 6) lumped uncertainty at the stages

    """

    plant: Model
    gains: Any
    model: ControlModel
    t: np.ndarray
    reference: np.ndarray
    F: np.ndarray

    @staticmethod
    def fill_rate(system, stage, x, rate):
        """x_dot at one stage."""
        tau, _, change = answer(system, stage, x)
        fill_plant_rate(system.plant, x, tau, vector(system.F[stage], 0), rate)
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
    F : (n + 1, s, 6) N, N m
    step : s

    """

    t: np.ndarray
    reference: np.ndarray
    F: np.ndarray
    step: float


class Log(NamedTuple):
    """What a run leaves, a row per sample: x (n + 1, 13), state (n + 1, m), tau, f (n + 1, 6)."""

    x: np.ndarray
    state: np.ndarray
    tau: np.ndarray
    f: np.ndarray


@compiled
def fill_continuous(plant, gains, model, grid, tableau, x, log):
    """Run the loop with the law inside every stage; x (13 + m,) is advanced in place."""
    stages, trial = np.zeros((tableau.b.shape[0], x.shape[0])), np.zeros(x.shape[0])
    last = grid.t.shape[0] - 1
    for k in range(last + 1):
        system = ClosedLoop(plant, gains, model, grid.t[k], grid.reference[k], grid.F[k])
        tau, f, _ = answer(system, 0, x)
        log.x[k], log.state[k] = x[:SIZE], x[SIZE:]
        fill_vector(log.tau[k], 0, tau)
        fill_vector(log.f[k], 0, f)
        if k < last:
            fill_step(system, x, grid.step, tableau, stages, trial)
            fill_unit_attitude(x)


@compiled
def fill_held(plant, gains, model, grid, tableau, x, log):
    """Run the loop with the law at the samples, tau held between; x (13 + m,) in place."""
    stages, trial = np.zeros((tableau.b.shape[0], SIZE)), np.zeros(SIZE)
    last = grid.t.shape[0] - 1
    body, state = x[:SIZE], x[SIZE:]
    rate = np.zeros(state.shape[0])
    for k in range(last + 1):
        nu_d, nu_d_dot = vector(grid.reference[k, 0], 0), vector(grid.reference[k, 0], 6)
        dt = grid.step if k > 0 else 0.0
        tau, f = fill_sample(
            grid.t[k, 0], dt, vector(body, 7), attitude_of(body), nu_d, nu_d_dot,
            state, rate, gains, model,
        )  # fmt: skip
        log.x[k], log.state[k] = body, state
        fill_vector(log.tau[k], 0, tau)
        fill_vector(log.f[k], 0, f)
        if k < last:
            fill_plant_step(plant, body, tau, grid.F[k], grid.step, tableau, stages, trial)
