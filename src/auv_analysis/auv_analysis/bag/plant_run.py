"""The extent of a run of our plant in a recording: its beginning, its end, and one start."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from auv_analysis.bag.reading import slices
from auv_analysis.runs.run import rows_of
from auv_dynamics.plant.plant import initial_state
from auv_dynamics.ros import interface

FEW = 3  # resets whose times are named
BACK_AT, AWAY = 1e-12, 1e-6  # from where it started: a step from one to the other is a reset
LOOSE = 1.0  # s that a recording in real time may lack at its end


def time_zero(ns: np.ndarray, plant: Mapping[str, Any]) -> tuple[int, list[str]]:
    """Stamp, ns, from which the time of a run counts, and notes on what of it is missing.

    That of the first of steps (n,), but that our plant in lock-step begins with zero, whatever is
    missing in the bag.

    Parameters
    ----------
    ns : (n,) rising stamps
    plant : parameters of the plant node, empty beside a driver

    """
    step, planned = (plant.get(key, math.nan) for key in ('step', 'duration'))
    told, end = isinstance(step, int | float), float(ns[-1]) / interface.NANOSECONDS
    # of a run without an end, or stamps that are no plant's, nothing is known
    if not (told and isinstance(planned, int | float) and end <= planned + step / 2):
        return int(ns[0]), []
    lockstep = plant.get('lockstep') is True
    notes = [f'begins at {ns[0] / interface.NANOSECONDS:.6g} s'] * bool(lockstep and ns[0] > 0)
    if planned - end > (step / 2 if lockstep else LOOSE):
        notes.append(f'ends at {end:.6g} s of the {planned:g} s that were planned')
    return 0 if lockstep else int(ns[0]), notes


def longest_part(
    ns: np.ndarray, values: Mapping[str, np.ndarray], plant: Mapping[str, Any], zero: int
) -> tuple[slice, list[str]]:
    """The longest part of a run that no reset of the plant interrupts, and a note on the others.

    Parameters
    ----------
    ns, values : (n,) stamps, role -> rows
    plant : parameters of the plant node, empty beside a driver
    zero : stamp from which time counts, ns

    """
    if not plant:
        return slice(None), []
    try:
        initial = [plant.get(f'initial.{key}', [0.0] * 6) for key in ('eta', 'nu')]
        start = initial_state(*np.array(initial, float).reshape(2, 6))
    except (TypeError, ValueError):
        return slice(None), []
    x = values.get(interface.GROUND_TRUTH, values[interface.ODOM])
    blocks = (np.abs(rows_of(x, here) - start).max(axis=1) for here in slices(len(x)))
    there = ((far < BACK_AT, far > AWAY) for far in blocks)
    back, away = (np.concatenate(parts) for parts in zip(*there, strict=True))
    resets = np.flatnonzero(back[1:] & away[:-1]) + 1
    if not len(resets):
        return slice(None), []
    edges = [0, *resets.tolist(), len(ns)]
    kept = int(np.argmax(np.diff(edges)))
    times = ', '.join(f'{(ns[k] - zero) / interface.NANOSECONDS:.6g}' for k in resets[:FEW])
    more = f' and {len(resets) - FEW} times more' * (len(resets) > FEW)
    note = f'the plant was reset at {times} s{more}; read the longest of {len(edges) - 1} parts'
    return slice(*edges[kept : kept + 2]), [note]
