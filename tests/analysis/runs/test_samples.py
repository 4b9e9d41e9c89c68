"""Samples in a file: the run that they make again, and what is refused."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.runs.samples import FORCES, MOTION, OPTIONAL, load_samples, write_samples
from auv_analysis.scenario.scenario import Scenario
from auv_dynamics import InputError

ROOT = Path(__file__).parents[3]
SHORT = (ROOT / 'config/scenarios/case1.yaml').read_text().replace('30.0', '0.3')
SENSING = f'{SHORT}\nsensors: {{velocity_noise: 0.01}}\n'
NOISY = (
    SENSING
    + """
actuators: {lag: 0.02}
faults: [{kind: sensor_drop_out, from: 0.1, to: 0.2}]
"""
)
FACTS = ('scenario', 'controller', 'law', 'gains', 'step', 'source', 'kinds', 'faults')


def scenario_of(folder: Path, text: str) -> Scenario:
    (folder / 'short.yaml').write_text(text)
    return load_scenario(folder / 'short.yaml')


@pytest.mark.parametrize(
    ('text', 'hold'), [(SHORT, 'continuous'), (SHORT, 'zoh'), (SENSING, 'zoh'), (NOISY, 'zoh')]
)
def test_samples_make_the_run_again(tmp_path: Path, text: str, hold: str) -> None:
    scenario = scenario_of(tmp_path, text)
    for name in ('gvc', 'cl'):
        run, path = simulate(scenario, name, hold), tmp_path / f'{name}.npz'
        write_samples(run, path)
        again = load_samples(path, scenario)
        assert (again.hold, again.sensing, again.acting) == (hold, run.sensing, run.acting)
        assert again.arrays().keys() == run.arrays().keys()
        for signal, values in run.arrays().items():
            assert np.array_equal(getattr(again, signal), values), signal
        assert summarize(again) == summarize(run)
        assert all(getattr(again, fact) == getattr(run, fact) for fact in FACTS)
    assert bool(run.faults) == (text == NOISY)


@pytest.fixture
def written(tmp_path: Path) -> tuple[Path, Scenario]:
    """Samples of a run with all signals that there can be, and its scenario."""
    scenario, path = scenario_of(tmp_path, NOISY), tmp_path / 'gvc.npz'
    write_samples(simulate(scenario, 'gvc', 'zoh'), path)
    return path, scenario


@pytest.mark.parametrize(
    ('spoil', 'words'),
    [
        (lambda path: path.write_bytes(b'no archive'), 'cut, damaged or no archive'),
        (lambda path: path.write_bytes(path.read_bytes()[:-400]), 'cut, damaged or no archive'),
        (lambda path: np.save(path.open('wb'), np.zeros(3)), 'cut, damaged or no archive'),
        (lambda path: declare(path, 10**12), 'cut, damaged or no archive'),
        (lambda path: np.savez(path, t=np.arange(3.0)), 'eta: expected an array of samples'),
        (lambda path: change(path, t=np.zeros((31, 1))), 't: expected the times'),
        (lambda path: change(path, nu=np.zeros((31, 5))), r'nu: expected \(31, 6\) numbers'),
        (lambda path: change(path, t=np.zeros(1)), 't: expected the times'),
        (lambda path: change(path, hold=np.array('foh')), 'hold: expected continuous or zoh'),
        (lambda path: (path.unlink(), path.mkdir()), 'gvc.npz: expected samples of `auv simul'),
    ],
)
def test_broken_samples_are_refused(written: tuple[Path, Scenario], spoil, words: str) -> None:
    spoil(written[0])
    with pytest.raises(InputError, match=words):
        load_samples(*written)


@pytest.mark.parametrize('name', [*MOTION[1:], *FORCES, *OPTIONAL])
def test_every_signal_has_a_row_for_each_time(written: tuple[Path, Scenario], name: str) -> None:
    width = 12 if name == 'law_state' else 6
    change(written[0], **{name: np.zeros((30, width))})
    with pytest.raises(InputError) as caught:
        load_samples(*written)
    error = caught.value
    assert (error.key, error.expected, error.found) == (
        name, f'(31, {width}) numbers', f'shape (30, {width})'
    )  # fmt: skip


@pytest.mark.parametrize('name', [*MOTION, *FORCES, *OPTIONAL])
def test_a_signal_that_is_missing_is_named_where_no_run_is_without(
    written: tuple[Path, Scenario], name: str
) -> None:
    change(written[0], without=name)
    if name in OPTIONAL:
        assert getattr(load_samples(*written), OPTIONAL[name]) is None
        return
    with pytest.raises(InputError, match=f'{name}: expected an array of samples'):
        load_samples(*written)


def test_two_samples_are_a_run(written: tuple[Path, Scenario]) -> None:
    with np.load(written[0]) as file:
        first = {name: file[name][:2] for name in file.files if name != 'hold'}
    np.savez(written[0], **first, hold=np.array('zoh'))
    assert load_samples(*written).samples == 2


def test_of_samples_that_tell_no_hold_the_law_was_continuous(
    written: tuple[Path, Scenario],
) -> None:
    change(written[0], without='hold')
    assert load_samples(*written).hold == 'continuous'


def declare(path: Path, count: int) -> None:
    """Write an archive with an array that says that it has so many numbers."""
    said = {'descr': '<f8', 'fortran_order': False, 'shape': (count,)}
    with zipfile.ZipFile(path, 'w') as file, file.open('t.npy', 'w') as array:
        np.lib.format.write_array_header_1_0(array, said)


def change(path: Path, without: str = '', **arrays: np.ndarray) -> None:
    """Replace arrays of a file, or leave one out."""
    with np.load(path) as file:
        found = {name: file[name] for name in file.files if name != without}
    np.savez(path, **(found | arrays))
