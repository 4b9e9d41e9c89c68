"""F by (1) of recorded motion, held against the F that was simulated."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.foreign_bags import loaded, motion, simulated
from helpers.foreign_logs import TABLES, tables
from numpy.testing import assert_allclose

from auv_analysis.runs.run import Run
from auv_dynamics.vehicle import DOFS

NOISE = np.array([3e-3, 3e-3, 3e-3, 2e-3, 2e-3, 2e-3])  # m/s, rad/s
LEVEL = {'initial': {'eta': [0.0] * 6, 'nu': [0.0] * 6}}
NONE = {'disturbance': []}


@pytest.fixture(scope='module')
def run() -> Run:
    return simulated(duration=20.0, **LEVEL)


def recorded(run: Run, folder: Path, noise: np.ndarray, seed: int = 0, **keys) -> Run:
    """The run as estimated from half of its velocities, at irregular times, with noise."""
    rng = np.random.default_rng(seed)
    kept = np.sort(rng.choice(run.samples, run.samples // 2, replace=False))
    noisy = replace(run, nu=run.nu + noise * rng.standard_normal(run.nu.shape))
    seen, forces = motion(noisy, enu=False, keep=kept), motion(run, enu=False)
    return loaded(tables(folder / f'seed_{seed}', seen, forces), **TABLES, **keys)


@pytest.fixture(scope='module')
def noisy(run: Run, tmp_path_factory: pytest.TempPathFactory) -> list[Run]:
    """Four recordings with all of the noise."""
    folder = tmp_path_factory.mktemp('noisy')
    return [recorded(run, folder, NOISE, seed) for seed in range(4)]


def true_F(run: Run, found: Run, start: float) -> np.ndarray:
    return np.stack([np.interp(found.t + start, run.t, c) for c in run.disturbance.T], axis=1)


def deviations(run: Run, found: Run) -> np.ndarray:
    """Errors of F (n, 6) in units of the error that is shown."""
    start = run.duration - found.duration
    start = min((start, 0.0), key=lambda s: np.abs(found.unexplained - true_F(run, found, s)).max())
    return (found.unexplained - true_F(run, found, start)) / found.unexplained_error


@pytest.mark.parametrize('scale', [0.1, 1.0])
def test_the_error_that_is_shown_covers_the_real_one(scale, run, noisy, tmp_path) -> None:
    """Of Gaussian errors 68 % are within one standard error, 95 % within two."""
    little = range(2 if scale < 1.0 else 0)
    runs = [recorded(run, tmp_path, scale * NOISE, seed) for seed in little] or noisy
    found = np.concatenate([deviations(run, one) for one in runs])
    within = [(np.abs(found) < k).mean(axis=0) for k in (1.0, 2.0)]
    assert np.all(within[0] > 0.6), within[0]
    assert np.all(within[1] > 0.9), within[1]
    assert np.all(within[0] < 0.95), 'an error that is said to be far larger than it is'


def test_the_estimate_is_close_enough_to_be_of_use(run, noisy) -> None:
    found = noisy[0]
    said = np.sqrt((found.unexplained_error**2).mean(axis=0))
    assert np.all(said < 0.5 * np.sqrt((run.disturbance**2).mean(axis=0)))
    assert_allclose(found.acceleration['velocity_noise'], NOISE, rtol=0.15)
    assert set(found.acceleration) == {'filter', 'order', 'window', 'velocity_noise', 'error_rms'}
    assert found.disturbance is None, 'it is estimated, not known'


def test_without_disturbance_nothing_is_unexplained(tmp_path) -> None:
    run = simulated(duration=10.0, **LEVEL, **NONE)
    found = recorded(run, tmp_path, NOISE, step=0.05)
    within = np.abs(found.unexplained) / found.unexplained_error
    assert np.all((within < 2.0).mean(axis=0) > 0.9)


def test_it_is_positive_where_it_opposes_the_wrench(tmp_path) -> None:
    """Signs of F, M nu_dot and tau: constant forces, of another size on each axis, from rest."""
    F = np.array([300.0, -250.0, 200.0, 150.0, -100.0, 50.0])
    offsets = {name: {'offset': size} for name, size in zip(DOFS, F.tolist(), strict=True)}
    harmonic = {'kind': 'harmonic', **offsets}
    run = simulated(duration=3.0, **LEVEL, disturbance=[harmonic])
    found = recorded(run, tmp_path, 0.0 * NOISE, step=0.05)
    settled = found.t > 0.5
    assert_allclose(found.unexplained[settled].mean(axis=0), F, rtol=0.02)


def test_a_wrench_in_the_wrong_direction_is_found(run, noisy, tmp_path) -> None:
    turned = replace(run, tau=run.tau * [1, 1, -1, 1, 1, 1])
    found = recorded(turned, tmp_path, NOISE)
    sizes = [
        np.linalg.norm(one.unexplained, axis=0) / np.sqrt(one.samples) for one in (found, noisy[1])
    ]
    ratio = sizes[0] / sizes[1]
    assert ratio[2] > 5.0
    assert np.all(np.delete(ratio, 2) < 1.5)


def test_a_given_window_is_used(run, tmp_path) -> None:
    found = recorded(run, tmp_path, NOISE, window=0.7)
    assert_allclose(found.acceleration['window'], 0.7, rtol=0.05)


def test_one_window_is_worse_than_the_one_that_was_chosen(run, noisy, tmp_path) -> None:
    chosen = noisy[0]
    narrow = recorded(run, tmp_path, NOISE, seed=1, window=0.2)
    errors = [np.abs(true_F(run, one, 0.0) - one.unexplained).mean(axis=0)
              for one in (chosen, narrow)]  # fmt: skip
    assert np.all(errors[0] < errors[1])
    assert np.all(np.array(narrow.unexplained_error).mean(axis=0)
                  > np.array(chosen.unexplained_error).mean(axis=0))  # fmt: skip
