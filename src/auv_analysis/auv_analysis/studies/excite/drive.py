"""Multisines of wrench or of set-points, the motion that they make, and how far it goes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.runs.run import Run
from auv_analysis.scenario.scaling import plain_name, scaled_gains
from auv_analysis.scenario.scenario import Scenario, resolved, scenario_from
from auv_analysis.simulation.open_loop import open_loop
from auv_analysis.simulation.simulate import DivergedError, simulate
from auv_analysis.studies.excite import SPEED
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import read_yaml
from auv_dynamics.plant.disturbance import Harmonics
from auv_dynamics.plant.plant import initial_state
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.kinematics import quaternion
from auv_dynamics.vehicle.model import Model
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict
from auv_gvc_controller.laws import OPEN_LOOP
from auv_gvc_controller.laws.multisine import MOST

PERIODS, FASTEST = 3.0, 3.0  # of the slowest sine in the recording; rad/s of the fastest one
LOOP = {'law': 'gvc', 'k_D': 3.0, 'Lambda': 0.5, 'Gamma': 1.0}
CONTROLLER = {False: 'open_loop', True: 'gvc'}  # by whether the loop is closed
LEAST = 0.02  # of the largest wrench or set-point: the smallest that is tried
STEEPEST = 1.5  # exponent of the frequency, by which amplitudes may fall or rise
BEYOND = 1e6  # share of a bound that stands for a motion that is not finite
LOOK = 0.05  # s, from a state that shows how far a motion goes to the next, while searching
TILT = 0.8  # rad between the vertical of the body and that of the world, at most
SHARE = 1 / 3  # of what the thrusters give on one axis alone, as all are driven at once
WORDS = ('wrench', 'speed', 'angular rate', 'tilt', 'room')
LONGEST = 80  # of the vehicle's name in that of the scenario


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds of an excitation.

    Attributes
    ----------
    wrench : (6,) N and N m; 0: an axis without actuators
    speed, rate : m/s and rad/s
    room : (3,) m that there are in all along north, east and down, the start in their middle

    """

    wrench: np.ndarray
    speed: float
    rate: float
    room: np.ndarray

    def used(self, motion: 'Motion') -> np.ndarray:
        """(V, B, 5) share of each bound that motions use, in the order of `WORDS`."""
        x, limit = motion.states, np.where(self.wrench > 0.0, self.wrench, np.inf)
        with np.errstate(all='ignore'):  # states may be what is left of a divergence
            speed, rate, tilted = (
                np.einsum('...i,...i', part, part).max(axis=2)
                for part in (x[..., 7:10], x[..., 10:], x[..., 4:6])
            )
        shares = (
            (np.abs(motion.commands).max(axis=2) / limit).max(axis=-1),
            np.sqrt(speed) / self.speed,
            np.sqrt(rate) / self.rate,
            np.arccos(np.clip(1.0 - 2.0 * tilted, -1.0, 1.0)) / TILT,
            (2.0 * np.abs(x[..., :3]).max(axis=2) / self.room).max(axis=-1),
        )
        used = np.stack(np.broadcast_arrays(*shares), axis=-1)
        return np.nan_to_num(used, nan=BEYOND, posinf=BEYOND)


def bounds_of(
    vehicle: Vehicle, room: np.ndarray, wrench: np.ndarray | None, speed: float | None,
    rate: float | None, least_speed: float = 0.0, least_rate: float = 0.0,
) -> Bounds:  # fmt: skip
    """Bounds, the usual ones where none are given.

    Parameters
    ----------
    vehicle : the prior
    room, wrench, speed, rate : as of `Bounds`; None: the usual one
    least_speed, least_rate : m/s and rad/s that the usual ones must allow

    """
    speed = speed or max(SPEED, least_speed)
    rate = rate or max(2.0 * speed, least_rate)
    if wrench is None and vehicle.thrusters is not None:
        driven = [dof not in vehicle.thrusters.unactuated() for dof in DOFS]
        wrench = SHARE * vehicle.thrusters.alone().min(axis=0) * driven
    elif wrench is None:
        nu = np.repeat([speed, rate], 3)
        tilted = np.array([0.0, 0.0, 0.0, 0.5 * TILT, 0.5 * TILT, 0.0])
        still = vehicle.g(np.zeros(6))
        turning = np.abs(vehicle.g(tilted) - still)
        wrench = np.diag(vehicle.M) * nu + np.abs(np.diag(vehicle.D(nu)) * nu)
        wrench = wrench + turning + np.abs(still)
    return Bounds(wrench, speed, rate, room)


@dataclass(frozen=True, eq=False)
class Request:
    """What is asked for.

    Attributes
    ----------
    given : vehicle file or shipped bare name, the prior
    bounds : as above
    duration, step : s
    free, fixed : as of `unknowns`
    lag : s, of the actuators, as far as it is known
    velocity_noise, attitude_noise : standard deviations, m/s and rad/s, and rad
    spread : of the prior's standard deviations, by which vehicles differ that must stay within
        the bounds as well
    closed : whether set-points are driven, by GVC, in place of the wrench
    seed : of phases and draws

    """

    given: str
    bounds: Bounds
    duration: float
    step: float
    free: Sequence[str]
    fixed: Sequence[str]
    lag: float
    velocity_noise: float
    attitude_noise: float
    spread: float
    closed: bool
    seed: int

    @cached_property
    def path(self) -> Path:
        """Of the vehicle file."""
        return Path(shipped('vehicles', self.given))

    @cached_property
    def vehicle_data(self) -> dict[str, Any]:
        """Contents of the vehicle file."""
        return read_yaml(self.path, 'vehicle')

    @cached_property
    def vehicle(self) -> Vehicle:
        """The prior."""
        return vehicle_from_dict(self.vehicle_data, self.path)

    @cached_property
    def loop(self) -> dict[str, Any]:
        """Law and gains of the closed loop, as fast for any vehicle."""
        return LOOP | {'k_I': scaled_gains(self.given)['gvc']['k_I']}

    @property
    def clipped(self) -> bool:
        """Whether a law asks for axes that are not driven: what acts is to be recorded."""
        return self.closed and not self.bounds.wrench.all()

    @property
    def noise(self) -> np.ndarray:
        """(9,) as of `OutputError`."""
        return np.repeat([self.velocity_noise, self.attitude_noise], (6, 3))

    @property
    def steps(self) -> int:
        """Number of commands."""
        return round(self.duration / self.step)

    @property
    def every(self) -> int:
        """Steps from one state that the search looks at to the next."""
        return max(round(LOOK / self.step), 1)

    @property
    def follow(self) -> np.ndarray:
        """(1, 6) share of the way that the lag covers in a step."""
        return np.full((1, 6), -np.expm1(-self.step / max(self.lag, 1e-9)))

    @property
    def hold(self) -> np.ndarray:
        """(6,) wrench that holds the prior level and at rest, N and N m."""
        return self.vehicle.g(np.zeros(6))


@dataclass(frozen=True, eq=False)
class Motion:
    """Commands (V, B, n, 6), V = 1 of all vehicles the same, and states (V, B, n // every + 1, 13).

    A state has position, quaternion and velocity, the first one before the first step.
    """

    commands: np.ndarray
    states: np.ndarray


@dataclass(frozen=True, eq=False)
class Family:
    """Multisines of the same frequencies and phases.

    Every sine has a frequency of its own, so that no degree of freedom repeats another. A point x
    (2 m,) has the logarithm of the share of the bound that the peak of each of m driven degrees of
    freedom takes, then the exponent of the frequency by which its amplitudes go.

    Attributes
    ----------
    most : (6,) peak, beside the offset; 0: not driven
    offset : (6,)
    phase : (6, 6) rad, a row per degree of freedom
    t : (n,) s at which the peak is looked for

    """

    most: np.ndarray
    offset: np.ndarray
    phase: np.ndarray
    t: np.ndarray

    @classmethod
    def of(cls, request: Request, phase: np.ndarray) -> 'Family':
        """A family of phases (6, 6) in rad."""
        bounds, t = request.bounds, np.arange(request.steps) * request.step
        if request.closed:
            phase = np.where(phase < np.pi, 0.0, np.pi)  # no jump from rest at the start
            most = np.repeat([bounds.speed, bounds.rate], 3) * (bounds.wrench > 0.0)
            return cls(most, np.zeros(6), phase, t)
        driven = bounds.wrench > 0.0
        offset = np.where(driven, request.hold, 0.0)
        return cls(np.maximum(bounds.wrench - np.abs(offset), 0.0), offset, phase, t)

    @cached_property
    def driven(self) -> np.ndarray:
        """(m,) indices of the degrees of freedom that are driven."""
        return np.flatnonzero(self.most > 0.0)

    @cached_property
    def omega(self) -> np.ndarray:
        """(6, 6) rad/s, a row per degree of freedom."""
        slowest = 2.0 * np.pi * PERIODS / (self.t[-1] + self.t[1])
        return np.geomspace(min(slowest, FASTEST / 10.0), FASTEST, 6 * MOST).reshape(MOST, 6).T

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of the points."""
        m = len(self.driven)
        low = np.repeat([np.log(LEAST), -STEEPEST], m)
        return low, np.repeat([0.0, STEEPEST], m)

    def waves(self, x: np.ndarray) -> Harmonics:
        """Multisines of points (B, 2 m)."""
        count, m = len(x), len(self.driven)
        omega, phase = self.omega[self.driven], self.phase[self.driven]
        shape = omega ** x[:, m:, None]  # (B, m, 6)
        sines = np.sin(omega[..., None] * self.t + phase[..., None])  # (m, 6, n)
        peak = np.abs(np.einsum('bml,mln->bmn', shape, sines)).max(axis=-1)
        amplitude = shape * (np.exp(x[:, :m]) * self.most[self.driven] / peak)[..., None]
        terms = np.zeros((6, count, MOST, 3))
        for k, i in enumerate(self.driven):
            terms[i, ..., 0] = amplitude[:, k]
            terms[i, ..., 1], terms[i, ..., 2] = omega[k], phase[k]
        return Harmonics(np.repeat(self.offset[None], count, axis=0), tuple(terms))


def spec_of(wave: Harmonics) -> dict[str, Any]:
    """One multisine as a scenario has it."""
    found: dict[str, Any] = {}
    for i, dof in enumerate(DOFS):
        terms = [
            dict(zip(('amplitude', 'omega', 'phase'), map(_short, row), strict=True))
            for row in wave.terms[i].tolist() if row[0] != 0.0
        ]  # fmt: skip
        entry = {'offset': _short(wave.offset[i]), 'terms': terms}
        found[dof] = {key: value for key, value in entry.items() if value}
    return {dof: entry for dof, entry in found.items() if entry}


def _short(value: float) -> float:
    return float(f'{value:.6g}')


def scenario_of(request: Request, wave: Harmonics) -> dict[str, Any]:
    """Contents of the scenario that drives one multisine, sensors and lag as assumed."""
    bare = request.path != Path(request.given)
    data: dict[str, Any] = {
        'format': 1,
        'name': plain_name('excite', request.vehicle.name, LONGEST),
        'vehicle': request.given if bare else str(request.path.resolve()),
        'duration': request.duration,
        'step': request.step,
        'seed': request.seed,
    }
    if request.closed:
        data |= {'controllers': {CONTROLLER[True]: request.loop}, 'setpoint': spec_of(wave)}
    else:
        data |= {'controllers': {CONTROLLER[False]: {'law': OPEN_LOOP}}, 'setpoint': {}}
        data['excitation'] = spec_of(wave)
    limit = np.where(request.bounds.wrench > 0.0, request.bounds.wrench, 1e-6).tolist()
    data['actuators'] = {'limit': limit, **({'lag': request.lag} if request.lag else {})}
    noise = {'velocity_noise': request.velocity_noise, 'attitude_noise': request.attitude_noise}
    return data | {'sensors': noise}


def motion_of(
    request: Request, waves: Harmonics, models: Model, errors: Sequence[dict[str, Any]],
    every: int = 1,
) -> Motion:  # fmt: skip
    """Motions (V, B) of vehicles under multisines.

    Parameters
    ----------
    request : open or closed loop
    waves : (B,) multisines
    models : (V,) vehicles of the open loop, the prior first
    errors : of the closed loop, disturbances of kind model_error; {}: none
    every : steps from one state to the next

    """
    if request.closed:
        return _closed(request, waves, errors, every)
    commands = waves.value(np.arange(request.steps) * request.step)
    start = initial_state(np.zeros((1, len(commands), 6)), np.zeros((1, len(commands), 6)))
    states = open_loop(
        models, commands, start, request.step, follow=request.follow,
        applied=np.zeros((1, len(commands), 6)), every=every,
    )  # fmt: skip
    first = np.broadcast_to(start[:, :, None], (*states.shape[:2], 1, 13))
    return Motion(commands[None], np.concatenate([first, states], axis=2))


def _closed(
    request: Request, waves: Harmonics, errors: Sequence[dict[str, Any]], every: int
) -> Motion:
    """Motions of closed loops, without noise: that of the sensors is no part of the plan."""
    commands, states = [], []
    driven = request.bounds.wrench > 0.0  # what a law asks for of other axes never acts
    checked: Scenario | None = None  # the first: others differ in amplitudes and model error alone
    for error in errors:
        for b in range(len(waves.offset)):
            data = scenario_of(request, waves.part(b))
            del data['sensors']
            data['disturbance'] = [error] if error else []
            checked = checked or scenario_in_memory(request, data)
            scenario = replace(checked, data=resolved(data))
            command, state = recorded(scenario, CONTROLLER[True])
            commands.append(np.where(driven, command, 0.0))
            states.append(state[::every])
    shape = len(errors), len(waves.offset)
    return Motion(*(np.reshape(part, (*shape, *part[0].shape)) for part in (commands, states)))


def scenario_in_memory(request: Request, data: dict[str, Any]) -> Scenario:
    """Scenario of contents that no file has."""
    return scenario_from(data, request.vehicle_data, Path('excite.yaml'), request.path, {})


def recorded(scenario: Scenario, controller: str) -> tuple[np.ndarray, np.ndarray]:
    """Commands (n, 6) and states (n + 1, 13) of a simulated run; NaN where it diverges."""
    try:
        run: Run = simulate(scenario, controller, 'zoh')
    except DivergedError:
        n = scenario.steps
        return np.full((n, 6), np.nan), np.full((n + 1, 13), np.nan)
    q = quaternion(run.eta[:, 3:])
    return run.tau[:-1], np.concatenate([run.eta[:, :3], q, run.nu], axis=1)
