"""The folder of a run's results: made, checked and, when asked, cleared of what we left there."""

import json
import os
import re
import shutil
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from auv_dynamics.files import InputError, read_yaml, reason

OURS = (
    'summary.json', 'report.html', 'numbers.parquet', 'figures', 'logs', 'scenario.yaml',
    'vehicle.yaml', 'setpoint.csv', 'claims.parquet', 'sensitivity.parquet', 'unknowns.parquet',
    'unknowns_claims.parquet', 'energy_window.parquet', 'comparison.parquet', 'comparison.csv',
    'atlas.json', 'atlas.parquet', 'analysis.json', 'quantiles.parquet', 'influence.parquet',
    'dependence.parquet', 'together.parquet', 'failures.parquet', 'paired.parquet',
    'indices.parquet', 'best.parquet', 'design.json', 'summary_before.json',
    'vehicle_before.yaml',
    'tune.json', 'search.parquet', 'monte_carlo.parquet', 'open_loop.json', 'check.json',
    'samples.parquet', 'wrenches.parquet', 'faults.parquet', 'linearization.json',
)  # fmt: skip
OURS_IN_RUN = ('params.yaml', 'metadata.yaml')
OF_A_BAG = re.compile(r'.*\.mcap(\.damaged(\.\d+)?)?')
MANIFEST, CAMPAIGN, ROLLOUTS = 'sweep.json', 'campaign.yaml', 'rollouts'  # of a sweep
PART = re.compile(r'part-(\d{8})\.parquet')
UNFINISHED = '.unfinished'  # ends the name of a file that is being written


def prepare(
    out: Path, *, overwrite: bool, inputs: Iterable[Path] = (), new: Iterable[str] = ()
) -> Path:
    """Make an empty folder for results.

    Parameters
    ----------
    out : the folder
    overwrite : clear it of earlier results; anything else in it stays where it is
    inputs : files that the command reads, which must not be cleared away
    new : names in the folder that must be free afterwards

    Raises
    ------
    InputError : it exists, is no folder, cannot be written or holds an input

    """
    try:
        if check_free(out, overwrite=overwrite):
            _clear(out, [path.resolve() for path in inputs], new)
        out.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=out).close()
    except OSError as error:
        found = reason(error)
        raise InputError(out, '--out', 'a folder that can be written', found) from None
    return out


def check_free(out: Path, *, overwrite: bool) -> bool:
    """Whether a folder has something in it; InputError where that must not be overwritten."""
    try:
        taken = out.is_dir() and any(out.iterdir())
    except OSError as error:
        found = reason(error)
        raise InputError(out, '--out', 'a folder that can be written', found) from None
    if taken and not overwrite:
        raise InputError(out, '--out', 'a new folder, or --overwrite', 'an existing folder')
    return taken


def write_text(path: Path, text: str, *, overwrite: bool) -> None:
    """Write a file that was asked for; InputError where it exists or cannot be written."""
    try:
        if os.path.lexists(path) and not overwrite:
            raise InputError(path, '--out', 'a new file, or --overwrite', 'an existing file')
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open('w' if overwrite else 'x', encoding='utf-8') as file:
            file.write(text)
    except OSError as error:
        found = reason(error)
        raise InputError(path, '--out', 'a file that can be written', found) from None


def write_json(path: Path, document: Any) -> None:
    """Write a document as `--json` prints it, for people: indented; NaN is a ValueError."""
    text = json.dumps(document, indent=2, allow_nan=False)
    path.write_text(text + '\n', encoding='utf-8')


def _clear(out: Path, inputs: list[Path], new: Iterable[str]) -> None:
    samples = _samples(out)
    ours = [
        entry
        for entry in out.iterdir()
        if entry.name in OURS
        or entry.name in samples
        or (entry.is_dir() and _is_run(entry))
        or _is_of_sweep(entry)
    ]
    for entry in ours:
        for path in inputs:
            if path.is_relative_to(entry.resolve()):
                expected = 'a folder that does not hold what is read'
                raise InputError(out, '--out', expected, str(path))
    left = {entry.name for entry in out.iterdir()} - {entry.name for entry in ours}
    for name in new:
        if name in left:
            raise InputError(out / name, '--out', 'no such file or folder', 'what is not ours')
    # a sweep's manifest goes last: without it, its parts would be taken for somebody else's
    for entry in sorted(ours, key=lambda entry: entry.name == MANIFEST):
        _remove(entry)


def _samples(out: Path) -> set[str]:
    """Names of the sample files of `auv simulate`: its summary and scenario list the runs."""
    names: set[str] = set()
    for file, key in (('summary.json', None), ('scenario.yaml', 'controllers')):
        try:
            data = read_yaml(out / file, 'results')
            names.update(data[key] if key else data)
        except (OSError, ValueError, TypeError, KeyError):
            continue
    return {f'{name}{ending}' for name in names for ending in ('.npz', '.parquet')}


def _is_run(folder: Path) -> bool:
    names = [entry.name for entry in folder.iterdir()]
    # params.yaml is written before anything else: without it the bag is somebody else's
    return 'params.yaml' in names and all(_is_ours_in_run(name) for name in names)


def _is_ours_in_run(name: str) -> bool:
    name = name.removesuffix(UNFINISHED)
    return name in OURS_IN_RUN or OF_A_BAG.fullmatch(name) is not None


def _is_of_sweep(entry: Path) -> bool:
    if not (entry.parent / MANIFEST).is_file():
        return False
    if entry.name == ROLLOUTS and entry.is_dir():
        names = [part.name for part in entry.iterdir()]
        return all(PART.fullmatch(name) or name.endswith(UNFINISHED) for name in names)
    return entry.name in (MANIFEST, CAMPAIGN)


def _remove(entry: Path) -> None:
    if entry.is_dir() and not entry.is_symlink():
        shutil.rmtree(entry)
    else:
        os.unlink(entry)
