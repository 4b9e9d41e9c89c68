"""One block of a sweep, as a worker runs it: contents of files and values in, figures out.

A worker may be on another machine: it gets no paths to read, and checks that it runs the same
sources and libraries as the sweep.
"""

import json
import sys
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from auv_analysis.scenario.changes import VEHICLE, split
from auv_analysis.scenario.scenario import Scenario, scenario_from
from auv_analysis.studies.distributions import Values, take
from auv_analysis.studies.sweep.campaign import Campaign, of_controller
from auv_dynamics.files.errors import InputError
from auv_dynamics.kernel.compile import JITTED, sources_digest

Figures = dict[str, np.ndarray]  # column -> (n,)


class BlockError(RuntimeError):
    """A block could not be run; the text is one line."""


@lru_cache
def versions() -> dict[str, str]:
    """What the last bit of a figure may depend on."""
    found = {'sources': sources_digest(), 'python': '.'.join(map(str, sys.version_info[:2]))}
    for package in ('numpy', 'numba') if JITTED else ('numpy',):
        found[package] = metadata.version(package)
    return found


def contents_of(campaign: Campaign) -> str:
    """Scenario and vehicles of a campaign as a JSON text; `scenario_of` makes them from it."""
    scenario = campaign.scenario
    vehicles = {
        name: {'path': entry.vehicle_path.name, 'data': entry.vehicle_data}
        for name, entry in campaign.scenarios.items()
    }
    return json.dumps({
        'path': scenario.path.name,  # named in reasons, which shall not depend on the machine
        'scenario': scenario.data,
        'vehicles': vehicles,
        'setpoint.csv': scenario.attachments.get('setpoint.csv'),
        'versions': versions(),
    })  # fmt: skip


@lru_cache(maxsize=64)
def scenario_of(contents: str, vehicle: str) -> Scenario:
    """Scenario of `contents_of` with one of its vehicles."""
    parts = json.loads(contents)
    entry, table = parts['vehicles'][vehicle], parts['setpoint.csv']
    texts = {} if table is None else {'setpoint.csv': table}
    data = parts['scenario'] | ({VEHICLE: vehicle} if vehicle else {})
    return scenario_from(data, entry['data'], Path(parts['path']), Path(entry['path']), texts)


def block_figures(
    contents: str,
    controllers: list[str],
    hold: str,
    changes: dict[str, Values],
    seeds: np.ndarray,
) -> dict[str, Figures]:
    """Figures of a block.

    Parameters
    ----------
    contents : of `contents_of`
    controllers : names
    hold : 'continuous' or 'zoh'
    changes : path -> n values
    seeds : (n,)

    Returns
    -------
    figures : controller -> column -> (n,), see `rollouts`

    Raises
    ------
    BlockError : this worker cannot run it

    """
    asked, here = json.loads(contents)['versions'], versions()
    if asked != here:
        differing = ', '.join(k for k in asked if asked[k] != here.get(k))
        raise BlockError(f'expected workers with the same versions, found another {differing}')
    try:
        return {name: _figures(contents, name, hold, changes, seeds) for name in controllers}
    except InputError as error:  # the sweep could load it: the worker lacks the user's own law
        raise BlockError(f'a worker cannot run this: {error}') from None


def _figures(
    contents: str, controller: str, hold: Any, changes: dict[str, Values], seeds: np.ndarray
) -> Figures:
    from auv_analysis.simulation.rollouts import rollouts

    varied = {
        of_controller(path, controller): values
        for path, values in changes.items()
        if path != VEHICLE and not _of_another(path, controller)
    }
    vehicles = np.array(changes.get(VEHICLE, [''] * len(seeds)))
    parts, order = [], []
    for vehicle in dict.fromkeys(vehicles.tolist()):
        mine = np.flatnonzero(vehicles == vehicle)
        values = {path: take(column, mine) for path, column in varied.items()}
        scenario = scenario_of(contents, vehicle)
        parts.append(rollouts(scenario, controller, values, seeds=seeds[mine], hold=hold))
        order.append(mine)
    if len(parts) == 1:
        return parts[0]
    back = np.argsort(np.concatenate(order))
    return {key: np.concatenate([part[key] for part in parts])[back] for key in parts[0]}


def _of_another(path: str, controller: str) -> bool:
    """Whether a path is that of another controller, which has no say in this one's loop."""
    parts = split(path)
    return parts[0] == 'controllers' and parts[1] not in ('*', controller)


def laws_of(campaign: Campaign) -> dict[str, str]:
    """Digest of the source file of each user's own law."""
    import hashlib
    import inspect

    found = {}
    for name, law in campaign.own_laws.items():
        if file := inspect.getsourcefile(law):
            found[name] = hashlib.sha256(Path(file).read_bytes()).hexdigest()[:16]
    return found


def table_of(
    first: int, seeds: np.ndarray, changes: dict[str, Values], figures: dict[str, Figures]
) -> pa.Table:
    """Table of a block: a row per rollout and controller, controller by controller.

    Parameters
    ----------
    first : index of the first of the n rollouts
    seeds : (n,) of the rollouts
    changes : path -> n values
    figures : controller -> column -> (n,)

    Returns
    -------
    table : index, controller, seed, a column per path, then the figures; what is not known is null

    """
    given = {'index': np.arange(first, first + len(seeds)), 'seed': seeds} | changes
    parts = []
    for name, found in figures.items():
        columns = {key: _column(values) for key, values in (given | found).items()}
        words = pa.repeat(name, len(seeds))
        parts.append(pa.table({'index': columns.pop('index'), 'controller': words} | columns))
    return pa.concat_tables(parts).combine_chunks()


def _column(values: Values) -> pa.Array:
    """Arrow array of values of one kind; NaN becomes null, lists of numbers hold floats."""
    if isinstance(values, np.ndarray):
        return pa.array(values, from_pandas=True)
    return pa.array(values, _lists_of_floats(values[0]))


def _lists_of_floats(value: Any) -> pa.DataType | None:
    """Type of nested lists, which hold floats whether they are written so or not."""
    if not isinstance(value, list):
        return pa.float64() if isinstance(value, int | float) else None
    return pa.list_(_lists_of_floats(value[0]) if value else pa.float64())
