"""A simulated run, written as another system would, comes back as it was."""

from pathlib import Path

import numpy as np
import pytest
from helpers.foreign_bags import NAMED, UNNAMED, Maker, loaded, motion, simple, simulated, write
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from auv_analysis import summarize
from auv_analysis.runs.run import Run
from auv_dynamics.vehicle.frames import ENU_FLU, NED_FSD

TOPICS = {'odometry': '/auv/state', 'wrench': '/auv/force'}
AXES = {'enu': ENU_FLU, 'ned': NED_FSD}


@pytest.fixture(scope='module')
def run() -> Run:
    return simulated()


@pytest.fixture(scope='module')
def kept(run: Run) -> np.ndarray:
    """Samples that an irregular odometry has, the first and the last among them."""
    chosen = np.random.default_rng(3).random(run.samples) < 0.5
    chosen[[0, 1, -2, -1]] = True
    return np.flatnonzero(chosen)


def bag_of(run: Run, kept: np.ndarray, folder: Path, *, enu: bool, world: bool) -> Path:
    seen, forces = motion(run, enu=enu, world=world, keep=kept), motion(run, enu=enu)
    messages = simple(seen, Maker(), *TOPICS.values(), UNNAMED, forces)
    return write(folder / 'other', messages, Maker())


def interpolated(run: Run, kept: np.ndarray, t: np.ndarray, name: str) -> np.ndarray:
    values = getattr(run, name)[kept]
    return np.stack([np.interp(t, run.t[kept], column) for column in values.T], axis=1)


@pytest.mark.parametrize('world', [False, True], ids=['child', 'world'])
@pytest.mark.parametrize('axes', AXES)
def test_motion_and_wrench_come_back(axes, world, run, kept, tmp_path) -> None:
    bag = bag_of(run, kept, tmp_path, enu=axes == 'enu', world=world)
    how = {'frames': AXES[axes], 'twist_frame': 'world' if world else 'child', 'step': 0.013}
    found = loaded(bag, **TOPICS, **how)
    assert found.source == 'foreign_bag'
    assert_allclose(found.t, 0.013 * np.arange(found.samples), atol=1e-9)
    assert_allclose(found.nu, interpolated(run, kept, found.t, 'nu'), atol=1e-9)
    held = np.searchsorted(np.round(run.t, 9), found.t + 1e-9, 'right') - 1
    assert_allclose(found.tau, run.tau[held], atol=1e-9)
    assert_allclose(found.eta[:, :3], interpolated(run, kept, found.t, 'eta')[:, :3], atol=1e-9)
    truth = np.stack([np.interp(found.t, run.t, column) for column in run.eta.T], axis=1)
    turned, expected = (Rotation.from_euler('ZYX', eta[:, [5, 4, 3]]) for eta in (found.eta, truth))
    # the great circle leaves a steady turn by at most h^2/8 times the angular acceleration
    longest = np.diff(run.t[kept]).max()
    bound = longest**2 / 8.0 * np.abs(np.diff(run.nu[:, 3:], axis=0)).max() / run.step
    assert (turned.inv() * expected).magnitude().max() < 2.0 * np.sqrt(3.0) * bound
    assert (turned[0].inv() * expected[0]).magnitude() < 1e-9


def test_energies_and_couplings_are_those_of_the_run(run, kept, tmp_path) -> None:
    bag = bag_of(run, kept, tmp_path, enu=True, world=False)
    found, ours = summarize(loaded(bag, **TOPICS, frames=ENU_FLU, step=0.01)), summarize(run)
    M, between = run.vehicle.M, interpolated(run, kept, run.t, 'nu')
    energies = [0.5 * np.einsum('ni,ij,nj->n', nu, M, nu) for nu in (between, run.nu)]
    assert found['kinetic_energy']['mean'] == pytest.approx(energies[0].mean(), rel=1e-9)
    error = abs(energies[0] - energies[1]).mean()
    assert abs(found['kinetic_energy']['mean'] - ours['kinetic_energy']['mean']) <= error + 1e-9
    assert error < 0.01 * ours['kinetic_energy']['mean']
    inverse = np.linalg.inv(ours['decomposition']['Upsilon'])
    deformed = np.abs(inverse - np.eye(6)).sum(axis=1)
    worst = deformed * np.abs(between - run.nu).max() * 2.0
    apart = np.subtract(found['coupling']['delta_xi_max'], ours['coupling']['delta_xi_max'])
    assert np.all(np.abs(apart) <= worst + 1e-9)
    assert_allclose(found['coupling']['delta_pi_max'], ours['coupling']['delta_pi_max'], rtol=1e-9)
    assert_allclose(found['effort']['rms'], ours['effort']['rms'], rtol=1e-9)


def test_what_is_not_known_is_none(run, kept, tmp_path) -> None:
    bag = bag_of(run, kept, tmp_path, enu=True, world=False)
    found = summarize(loaded(bag, **TOPICS, frames=ENU_FLU))
    assert found['velocity_error'] == dict.fromkeys(('rms', 'max_after_2s', 'settling_time'))
    assert found['lumped_error'] == {'rms': None, 'max_after_2s': None}
    assert found['gains'] == {'K_D': None, 'K_f': None}
    assert not found['lyapunov']['applicable']
    assert found['gaps'] == {'valid_share': pytest.approx(1.0), 'spans': []}


@pytest.mark.parametrize('told', [NED_FSD, ENU_FLU])
def test_wrong_axes_show_as_unexplained_wrench(told, run, kept, tmp_path) -> None:
    bag = bag_of(run, kept, tmp_path, enu=True, world=False)
    found = summarize(loaded(bag, **TOPICS, frames=told))['unexplained']
    true = np.sqrt((run.disturbance**2).mean(axis=0))
    ratio = np.linalg.norm(found['rms'][:3]) / np.linalg.norm(true[:3])
    assert (0.5 < ratio < 2.0) == (told == ENU_FLU)


def test_frames_with_names_need_no_telling(run, kept, tmp_path) -> None:
    messages = simple(motion(run, enu=False, keep=kept), Maker(), *TOPICS.values(), NAMED)
    found = loaded(write(tmp_path / 'other', messages, Maker()), **TOPICS)
    assert any('ned_fsd by their frame ids' in note for note in found.notes)
    assert_allclose(found.nu[0], run.nu[kept[0]], atol=1e-9)
