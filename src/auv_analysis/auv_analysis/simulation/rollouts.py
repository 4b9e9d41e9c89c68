"""Figures of many closed loops that differ in values of one scenario or of its vehicle."""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from auv_analysis.metrics.settling import band_of
from auv_analysis.runs.run import Hold
from auv_analysis.scenario.changes import changed_scenario, check_paths
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.batch import Batch, Known, run_batch
from auv_analysis.simulation.closed_loop import Tables
from auv_analysis.simulation.reduction import COLUMNS, columns
from auv_analysis.simulation.simulate import check_hold, next_rows, reference, tables
from auv_analysis.simulation.variants import Variants, in_columns, merged, packed_variants
from auv_dynamics.files.errors import InputError
from auv_gvc_controller.control.setpoint import Setpoint

BLOCK = 256  # steps whose set-points are looked at together for their peak


def rollouts(
    scenario: Scenario,
    controller: str,
    changes: Mapping[str, Sequence[Any] | np.ndarray],
    *,
    seeds: np.ndarray | None = None,
    hold: Hold = 'continuous',
    threads: int = 1,
) -> dict[str, np.ndarray]:
    """Figures of B closed loops.

    A rollout's figures do not depend, bit for bit, on which others are asked for with it.

    Parameters
    ----------
    scenario : of `load_scenario`
    controller : name of one of its controllers
    changes : path such as `controllers.gvc.k_D` or `vehicle.rigid_body.mass` -> B values that
        stand there, numbers or what the file may hold
    seeds : (B,) of the sensors' noise; none: the scenario's
    hold : 'continuous' or 'zoh', as of `simulate`
    threads : how many the compiled kernel runs on

    Returns
    -------
    columns : name -> (B,). `status` is 'ok', 'diverged' or 'refused' (values that make no
        scenario, or a user's law that failed under way), `reason` says why, and
        `diverged_at` is the time in s of the first sample that is not finite; then the figures of
        `summary.json`, such as `velocity_error.rms.surge`. NaN is what does not exist.

    Raises
    ------
    InputError : no such controller or path; actuators, sensors or faults, hold 'continuous'
    ValueError : a single value, values of different lengths, no such hold

    """
    scenario.controller(controller)
    check_paths(scenario, changes)
    check_hold(scenario, hold)
    asked = changes if seeds is None else {**changes, 'seed': seeds}
    given = {path: _array(path, values) for path, values in asked.items()}
    count = _count(given)
    result: dict[str, np.ndarray] = {name: np.full(count, np.nan) for name in COLUMNS}
    result |= {'status': np.full(count, 'refused', object), 'reason': np.full(count, '', object)}
    for variants in _batches(scenario, controller, given, count, result['reason']):
        _run(variants, hold, threads, result)
    return {name: result[name] for name in ('status', 'reason', *COLUMNS)}


def _run(variants: Variants, hold: Hold, threads: int, result: Mapping[str, np.ndarray]) -> None:
    """Put figures where they belong; where a user's law fails, each rollout runs alone."""
    batch, rows = batch_of(variants, hold), variants.rows
    try:
        found = columns(run_batch(batch, threads), batch.steps + 1, batch.step)
    except ArithmeticError as error:
        if len(rows) == 1:
            result['reason'][rows] = str(error)
        else:
            for row in rows:
                _run(variants.part(rows == row), hold, threads, result)
        return
    for name, values in found.items():
        result[name][rows] = values
    diverged = np.isfinite(found['diverged_at'])
    result['status'][rows] = np.where(diverged, 'diverged', 'ok')
    times = [f'not finite from t = {t:g} s' for t in found['diverged_at'][diverged]]
    result['reason'][rows[diverged]] = times


def _array(path: str, values: Sequence[Any] | np.ndarray) -> np.ndarray:
    """Numbers, or lists of numbers, as one array; anything else as objects."""
    if isinstance(values, str) or not np.iterable(values):
        raise ValueError(f'{path}: expected a value for each rollout, found {values!r}')
    if isinstance(values, np.ndarray):
        return values
    try:
        array = np.array(values)
    except ValueError:  # lists of different lengths
        array = np.array(None)
    if array.dtype.kind in 'iuf':
        return array
    objects = np.empty(len(values), object)
    objects[:] = list(values)
    return objects


def _count(given: Mapping[str, np.ndarray]) -> int:
    lengths = {path: len(values) for path, values in given.items()}
    if len(set(lengths.values())) > 1:
        raise ValueError(f'expected as many values of each path, found {lengths}')
    return next(iter(lengths.values()), 1)


def _batches(
    scenario: Scenario,
    controller: str,
    given: Mapping[str, np.ndarray],
    count: int,
    reasons: np.ndarray,
) -> Iterator[Variants]:
    """All rollouts that make valid scenarios, those of one structure together."""
    apart = {p: v for p, v in given.items() if not in_columns(scenario, controller, p, v)}
    together = {path: values for path, values in given.items() if path not in apart}
    parts: list[Variants] = []
    for rows in _alike(apart, count):
        values = {path: column[rows[0]] for path, column in apart.items()}
        parts += _of_scenario(scenario, controller, values, together, rows, reasons)
    structures: dict[Any, list[Variants]] = {}
    for part in parts:
        structures.setdefault(part.structure, []).append(part)
    for alike in structures.values():
        yield merged(alike)


def _alike(columns: Mapping[str, np.ndarray], count: int) -> list[np.ndarray]:
    """Indices of rollouts that have the same values in all of these columns."""
    if not columns:
        return [np.arange(count)]
    groups: dict[str, list[int]] = {}
    for i in range(count):
        key = json.dumps([_plain(column[i]) for column in columns.values()], default=str)
        groups.setdefault(key, []).append(i)
    return [np.array(rows) for rows in groups.values()]


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value


def _of_scenario(
    scenario: Scenario,
    controller: str,
    values: Mapping[str, Any],
    together: Mapping[str, np.ndarray],
    rows: np.ndarray,
    reasons: np.ndarray,
) -> Iterator[Variants]:
    """Rollouts that share all values but those in columns."""
    packed = {path: column[rows] for path, column in together.items()}
    good = np.zeros(len(rows), bool)
    try:
        base = changed_scenario(scenario, values) if values else scenario
        base.controller(controller)
        fits = all(in_columns(base, controller, path, v) for path, v in packed.items())
    except InputError:  # with the values in columns it may be a scenario
        fits = False
    if fits:
        seeds = packed.pop('seed', np.full(len(rows), base.data['seed']))
        variants, good = packed_variants(base, controller, packed, rows, seeds)
        if good.any():
            yield variants.part(good)
    for i in rows[~good]:
        single = {**values, **{path: column[i] for path, column in together.items()}}
        try:
            alone = changed_scenario(scenario, single)
            alone.controller(controller)
        except InputError as error:
            reasons[i] = f'{error.key}: expected {error.expected}, found {error.found}'
            continue
        seed = np.array([alone.data['seed']])
        yield packed_variants(alone, controller, {}, np.array([i]), seed)[0]


def batch_of(variants: Variants, hold: Hold) -> Batch:
    """Closed loops of one structure, ready to run."""
    first = variants.scenarios[0]
    if variants.setpoint is not None:
        peak = _peak(variants.setpoint, first)
    else:
        peaks = _once(variants.scenarios, 0, lambda s: _peak(s.setpoint, s))
        of_each = np.array([peaks[s.texts[0]] for s in variants.scenarios])
        peak = of_each[:1] if len(peaks) == 1 else of_each[variants.of]
    return Batch(
        loop=variants.loop,
        x=variants.x,
        band=band_of(peak),
        step=first.step,
        steps=first.steps,
        integrator=first.data['integrator'],
        hold=hold,
        shared=_shared(variants, hold),
        own=lambda vehicles: _own(variants, vehicles, hold),
    )


def _peak(setpoint: Setpoint, scenario: Scenario) -> np.ndarray:
    """Largest abs(nu_d) (..., 6) at the samples of a whole run."""
    largest = np.zeros(6)
    for start in range(0, scenario.steps + 1, BLOCK):
        t = np.arange(start, min(start + BLOCK, scenario.steps + 1)) * scenario.step
        largest = np.maximum(largest, np.abs(setpoint.value(t)).max(axis=-2))
    return largest


def _shared(variants: Variants, hold: Hold) -> Known | None:
    """Tables of all vehicles where they are the same."""
    first, *others = variants.scenarios
    own = variants.setpoint or first.senses or first.faults.entries
    if own or any(s.texts != first.texts for s in others):
        return None
    return lambda t: tables(first, t, hold=hold)


def _own(variants: Variants, vehicles: range, hold: Hold) -> Known:
    """Tables of some vehicles, each with its own."""
    used = [variants.scenarios[variants.of[i]] for i in vehicles]
    seeded = [(s, int(variants.seeds[i])) for s, i in zip(used, vehicles, strict=True)]
    noises, faults = zip(*((s.noise(seed), s.fault_rows(seed)) for s, seed in seeded), strict=True)
    varying = variants.setpoint and variants.setpoint.part(slice(vehicles.start, vehicles.stop))

    def references(t: np.ndarray) -> np.ndarray:
        if varying is not None:
            return reference(varying, t, hold)
        of_each = _once(used, 0, lambda s: reference(s.setpoint, t, hold))
        return np.stack([of_each[s.texts[0]] for s in used])

    def known(t: np.ndarray) -> Tables:
        acting = _once(used, 1, lambda s: s.uncertainty.tables(t))
        return Tables(
            references(t),
            np.stack([acting[s.texts[1]][0] for s in used]),
            np.stack([acting[s.texts[1]][1] for s in used]),
            *(np.stack([next_rows(one, len(t)) for one in drawn]) for drawn in (noises, faults)),
        )

    return known


def _once(scenarios: Sequence[Scenario], which: int, function: Any) -> dict[str, Any]:
    """What a function makes of each of several scenarios, once for those of the same text."""
    return {text: function(s) for text, s in {s.texts[which]: s for s in scenarios}.items()}
