"""Trials at sea in simulation: excited runs with noise, lag and delay; priors that are wrong."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from auv_analysis import Run, load_scenario, simulate
from auv_analysis.studies.identify.record import Record, rotated
from auv_analysis.studies.identify.unknowns import Unknowns
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.kinematics import quaternion
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_dynamics.vehicle.vehicle_file import load_vehicle

LAG, DELAY, VELOCITY_NOISE, ATTITUDE_NOISE = 0.08, 0.04, 0.005, 0.003
SWINGS = {  # amplitudes m/s and rad/s, band of the angular ones rad/s, gain of the controller
    'herman2018': ((0.35, 0.25, 0.25, 0.15, 0.12, 0.15), (0.5, 2.0), 3.0),
    'rexrov': ((0.4, 0.3, 0.3, 0.10, 0.08, 0.12), (0.5, 2.0), 2.0),
    'bluerov2_heavy': ((0.4, 0.3, 0.3, 0.35, 0.3, 0.4), (1.2, 3.5), 4.0),
}


def multisine(amplitudes: tuple[float, ...], band: tuple[float, float]) -> dict[str, Any]:
    """Set-points of four sines per degree of freedom."""
    rng, found = np.random.default_rng(1), {}
    for i, dof in enumerate(DOFS):
        low, high = (0.1, 1.2) if i < 3 else band
        omegas = np.exp(rng.uniform(np.log(low), np.log(high), 4))
        terms = [
            {'amplitude': amplitudes[i] / 2, 'omega': float(omega),
             'phase': float(rng.uniform(0.0, 2 * np.pi))}
            for omega in omegas
        ]  # fmt: skip
        found[dof] = {'offset': 0.2 * amplitudes[i] if i < 3 else 0.0, 'terms': terms}
    return found


def trial_scenario(folder: Path, name: str, vehicle: str = '', **entries: Any) -> Path:
    """Scenario of a trial of one of `SWINGS`; `vehicle`: another one that moves like it."""
    amplitudes, band, gain = SWINGS[name]
    data = {
        'format': 1, 'name': 'trial', 'vehicle': vehicle or name, 'duration': 120.0, 'step': 0.02,
        'integrator': 'ode5', 'seed': 0, 'setpoint': multisine(amplitudes, band),
        'controllers': {'gvc': {'law': 'gvc', 'k_D': gain, 'k_I': 0.5, 'Lambda': 0.5,
                                'Gamma': 1.0}},
        'disturbance': {'kind': 'harmonic'}, 'actuators': {'lag': LAG, 'delay': DELAY},
        'sensors': {'velocity_noise': VELOCITY_NOISE, 'attitude_noise': ATTITUDE_NOISE},
    } | entries  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / 'trial.yaml'
    path.write_text(yaml.safe_dump(data), encoding='utf-8')
    return path


def gauss_markov(
    deviations: np.ndarray, seed: int, time_constant: float = 5.0, duration: float = 120.0
) -> dict[str, Any]:
    """A disturbance that no model has: first-order Gauss-Markov, as sines of random phase.

    Parameters
    ----------
    deviations : (6,) standard deviations, N and N m
    seed : of the phases
    time_constant, duration : s

    """
    rng = np.random.default_rng(seed + 20_000)
    edges = np.geomspace(np.pi / duration, 20.0 / time_constant, 41)
    covered = np.diff(np.arctan(edges * time_constant)) * 2.0 / np.pi  # of the variance
    found: dict[str, Any] = {'kind': 'harmonic'}
    for dof, deviation in zip(DOFS, deviations, strict=True):
        omegas = edges[:-1] + rng.uniform(size=40) * np.diff(edges)
        amplitudes = deviation * np.sqrt(2.0 * covered / covered.sum())
        phases = rng.uniform(0.0, 2.0 * np.pi, 40)
        rows = zip(amplitudes.tolist(), omegas.tolist(), phases.tolist(), strict=True)
        found[dof] = {'terms': [{'amplitude': a, 'omega': w, 'phase': p} for a, w, p in rows]}
    return found


def trial(folder: Path, name: str, seed: int = 0, **entries: Any) -> tuple[Record, Run]:
    """What is recorded of a trial, and the run with its truth."""
    scenario = load_scenario(trial_scenario(folder, name, seed=seed, **entries))
    run = simulate(scenario, 'gvc', 'zoh')
    noise = scenario.data['sensors']['attitude_noise']
    return recorded(run, noise, seed + 10_000), run


def recorded(run: Run, noise: float, seed: int) -> Record:
    """Record of a simulated run, with noise on the attitude in rad."""
    turns = noise * np.random.default_rng(seed).normal(size=(len(run.t), 3))
    q = rotated(quaternion(run.eta[:, 3:]), turns)
    return Record(run.scenario, run.t, q, run.t, run.nu_measured, run.step, run.tau[:-1], run.start)


def wrong_prior(vehicle: Vehicle, seed: int) -> Vehicle:
    """The vehicle without couplings, M off by up to 40 %, D by a factor 2, g by 30 %."""
    rng = np.random.default_rng(seed)

    def off(low: float, high: float, count: int) -> np.ndarray:
        return np.exp(rng.uniform(np.log(low), np.log(high), count))

    h = vehicle.model.hydrostatics * off(0.7, 1.3, 4)
    weight = float(vehicle.weight)
    return vehicle.changed(
        M=np.diag(np.diag(vehicle.M) * off(0.7, 1.4, 6)),
        D_linear=np.diag(np.diag(vehicle.D_linear) * off(0.5, 2.0, 6)),
        D_quadratic=np.diag(np.diag(vehicle.D_quadratic) * off(0.5, 2.0, 6)),
        buoyancy=weight - h[0], r_B=(weight * vehicle.r_G - h[1:]) / (weight - h[0]),
    )  # fmt: skip


def truth(unknowns: Unknowns, vehicle: Vehicle) -> dict[str, float]:
    """Name -> true value of what is free."""
    true = replace(
        unknowns.prior, M=vehicle.M, D_linear=vehicle.D_linear, D_quadratic=vehicle.D_quadratic,
        hydrostatics=vehicle.model.hydrostatics, lag=np.array(LAG), delay=np.array(DELAY),
    )  # fmt: skip
    values = {
        e.name: float(getattr(true, e.group)[e.index]) for e in unknowns.entries
    }  # fmt: skip
    return values | {'delay': DELAY}


def skewed() -> Vehicle:
    """Herman's vehicle with a dense M: every degree of freedom is coupled with every other."""
    vehicle = load_vehicle('herman2018')
    s = np.sqrt(np.diag(vehicle.M))
    A = np.random.default_rng(4).uniform(-1.0, 1.0, (6, 6))
    R = A @ A.T + 2.0 * np.eye(6)
    R /= np.sqrt(np.outer(np.diag(R), np.diag(R)))
    return vehicle.changed(M=R * np.outer(s, s))
