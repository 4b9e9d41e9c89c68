"""The samples of a simulated run in a file, and the run that they make again."""

import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.runs.run import HOLDS, Run
from auv_analysis.scenario.scenario import Scenario
from auv_dynamics.files.errors import InputError, reason

MOTION, FORCES = ('t', 'eta', 'nu', 'nu_d', 'nu_d_dot'), ('tau', 'disturbance_estimate')
OPTIONAL = {  # name in the file -> of `Run`
    'nu_measured': 'measured',
    'tau_applied': 'applied',
    'disturbance': 'disturbance',
    'law_state': 'law_state',
}
ENDING = '.npz'
# of what is no archive, or a damaged one
DAMAGED = (ValueError, TypeError, AttributeError, EOFError, MemoryError)


def write_samples(run: Run, path: Path) -> None:
    """Write the samples of a run, with whether its law was sampled and held."""
    found = {name: getattr(run, name) for name in (*MOTION, *FORCES, *OPTIONAL)}
    known = {name: values for name, values in found.items() if values is not None}
    np.savez_compressed(path, **known, hold=np.array(run.hold))


def load_samples(path: Path, scenario: Scenario) -> Run:
    """Run of a file of `auv simulate`.

    Parameters
    ----------
    path : `<controller>.npz`
    scenario : the one beside it, whose controllers name the file

    Returns
    -------
    run : the run that was written

    Raises
    ------
    InputError : no such controller; not such a file, cut or damaged

    """
    controller = path.stem
    entry = scenario.controller(controller)
    arrays = _arrays(path)
    hold = str(arrays.pop('hold', 'continuous'))
    if hold not in HOLDS:
        raise InputError(path, 'hold', ' or '.join(HOLDS), hold)
    there = {'nu_measured': scenario.senses, 'tau_applied': scenario.acts}  # else nu, tau
    signals: dict[str, Any] = {name: arrays[name] for name in (*MOTION, *FORCES)}
    signals |= {name: arrays.get(key) for key, name in OPTIONAL.items() if there.get(key, True)}
    return Run(
        **signals,
        vehicle=scenario.vehicle,
        scenario=scenario.name,
        controller=controller,
        law=entry['law'],
        gains=scenario.gain_values(controller),
        step=scenario.step,
        source='simulate',
        hold=hold,
        kinds=scenario.kinds,
        faults=scenario.marks,
    )


def _arrays(path: Path) -> dict[str, np.ndarray]:
    """Arrays of the file, checked for their shapes."""
    expected = 'samples of `auv simulate`'
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except OSError as error:
        raise InputError(path, '', expected, reason(error)) from None
    except (*DAMAGED, zipfile.BadZipFile, zlib.error):
        raise InputError(path, '', expected, 'a file that is cut, damaged or no archive') from None
    for name in (*MOTION, *FORCES):
        if name not in arrays:
            raise InputError(path, name, 'an array of samples', 'nothing')
    _check_shapes(arrays, path)
    return arrays


def _check_shapes(arrays: dict[str, np.ndarray], path: Path) -> None:
    shape = arrays['t'].shape
    if len(shape) != 1 or shape[0] < 2:
        raise InputError(path, 't', 'the times of two samples at least', f'shape {shape}')
    for name in (*MOTION[1:], *FORCES, *OPTIONAL):
        found = arrays[name].shape if name in arrays else None
        width = found[-1:] if name == 'law_state' and found else (6,)  # a law has its own number
        expected = (*shape, *width)
        if found not in (None, expected):
            raise InputError(path, name, f'{expected} numbers', f'shape {found}')
