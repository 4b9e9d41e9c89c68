"""The folder of a sweep: what it was made of, and the parts that are finished.

Whatever is in it under its final name is complete: everything is written under another name,
flushed to the disk and then renamed. A process may therefore be killed at any time.
"""

import fcntl
import json
import os
import platform
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from auv_analysis.folder import CAMPAIGN, MANIFEST, PART, ROLLOUTS, UNFINISHED, prepare
from auv_analysis.new_files import replacing
from auv_analysis.sweep.block import laws_of, versions
from auv_analysis.sweep.campaign import Campaign
from auv_dynamics.files import InputError, dotted

if TYPE_CHECKING:
    import pyarrow as pa


class SweepFolder:
    """Folder of a sweep, new or gone on with; locked as long as this process holds it.

    Parameters
    ----------
    out : the folder
    campaign : what is swept
    overwrite : clear it of earlier results

    Raises
    ------
    InputError : it holds another sweep or something else, is in use or cannot be written

    """

    def __init__(self, out: Path, campaign: Campaign, *, overwrite: bool):
        self.out, self.data = out, out / ROLLOUTS
        self._lock = _lock(out) if out.is_dir() else None
        try:
            self._open(campaign, overwrite=overwrite)
        except BaseException:
            self.close()
            raise

    def _open(self, campaign: Campaign, *, overwrite: bool) -> None:
        out, manifest = self.out, _manifest(campaign)
        stored = None if overwrite else _stored(out)
        self.new = stored is None
        if stored is None:
            _clear_unfinished(out)
            prepare(out, overwrite=overwrite, inputs=campaign.inputs, new=[MANIFEST, ROLLOUTS])
            self._lock = self._lock or _lock(out)
            stored = {**manifest, 'block': campaign.block}
            write(out / MANIFEST, json.dumps(stored, indent=1).encode())
        self.block = stored.pop('block')
        _refuse_other(out, stored, manifest)
        _write_inputs(out, campaign)
        self.data.mkdir(exist_ok=True)
        _clear_unfinished(self.data)

    def close(self) -> None:
        """Let another process use it."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def finished(self, columns: list[str]) -> Iterator[tuple[int, 'pa.Table']]:
        """Number and some columns of each finished block; what cannot be read is not finished."""
        for number, path in sorted(self._parts()):
            import pyarrow as pa
            import pyarrow.parquet as pq

            with suppress(pa.ArrowInvalid, OSError):
                yield number, pq.ParquetFile(path).read(columns)

    def stored(self, rollouts: int) -> int:
        """How many of so many rollouts lie in the folder."""
        blocks = (block for block, _ in self._parts())
        return sum(min(self.block, rollouts - block * self.block) for block in blocks)

    def _parts(self) -> Iterator[tuple[int, Path]]:
        for entry in self.data.iterdir():
            if match := PART.fullmatch(entry.name):
                yield int(match[1]), entry

    def store(self, block: int, table: 'pa.Table') -> None:
        """Write a finished block."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        sink = pa.BufferOutputStream()
        words = [field.name for field in table.schema if pa.types.is_string(field.type)]
        pq.write_table(table, sink, compression='zstd', use_dictionary=words)
        write(self.data / f'part-{block:08d}.parquet', sink.getvalue())


def write(path: Path, contents: Any) -> None:
    """Write a file so that it is there as a whole or not at all, whatever ends the process."""
    with replacing(path, path.with_name(f'.{path.name}{UNFINISHED}')) as file:
        file.write(contents)


def _lock(out: Path) -> int | None:
    """Lock of a folder, which ends with the process; None where the file system has none."""
    try:
        handle = os.open(out, os.O_RDONLY)
    except OSError:
        return None  # `prepare` says why
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(handle)
        expected = 'a folder that no other process is sweeping into'
        raise InputError(out, '--out', expected, 'one in use') from None
    except OSError:
        os.close(handle)
        return None
    return handle


def _clear_unfinished(folder: Path) -> None:
    if folder.is_dir():
        for entry in folder.glob(f'.*{UNFINISHED}'):
            entry.unlink()


def _manifest(campaign: Campaign) -> dict[str, Any]:
    """What the rows depend on."""
    scenario = campaign.scenario
    data = dict(scenario.data)
    if table := scenario.attachments.get('setpoint.csv'):
        data['setpoint'] = {'file': 'setpoint.csv'}
    return json.loads(json.dumps({
        'format': 1,
        'campaign': campaign.data,
        'scenario': data,
        'vehicles': {entry.data['vehicle']: entry.vehicle_data
                     for entry in campaign.scenarios.values()},
        'setpoint.csv': table,
        'laws': laws_of(campaign),
        'versions': {**versions(), **_sampling_versions(campaign), 'machine': platform.machine()},
        'rollouts': campaign.rollouts,
    }))  # fmt: skip


def _sampling_versions(campaign: Campaign) -> dict[str, str]:
    """Versions of the libraries that drew the samples."""
    from importlib import metadata

    from auv_analysis.sweep.groups import kind_of

    kinds = {kind_of(spec) for spec in campaign.data['vary']} - {'grid', 'zip'}
    packages = (['scipy'] if kinds else []) + (['SALib'] if 'morris' in kinds else [])
    return {package: metadata.version(package) for package in packages}


def _write_inputs(out: Path, campaign: Campaign) -> None:
    """Texts for people: the manifest alone is read again."""
    from auv_analysis.experiment import write_inputs

    write_inputs(campaign.scenario, out)
    header = f'# {campaign.path.name} with every default filled in\n'
    resolved = {**campaign.data, 'scenario': 'scenario.yaml'}
    text = yaml.safe_dump(resolved, sort_keys=False, default_flow_style=None, width=100)
    write(out / CAMPAIGN, (header + text).encode())


def _stored(out: Path) -> dict[str, Any] | None:
    """Manifest of the folder, None where there is none."""
    try:
        stored = json.loads((out / MANIFEST).read_text(encoding='utf-8'))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError):
        stored = None
    if not isinstance(stored, dict) or not isinstance(stored.get('block'), int):
        found = f'a {MANIFEST} that is not ours'
        raise InputError(out, '--out', 'a folder of `auv sweep`, or --overwrite', found)
    return stored


def _refuse_other(out: Path, stored: dict[str, Any], manifest: dict[str, Any]) -> None:
    difference = _difference(stored, manifest)
    if difference is not None:
        path, before, now = difference
        with suppress(TypeError):
            before, now = (json.dumps(x)[:40] for x in (before, now))
        expected = f'{before} as when it was begun, or --overwrite'
        raise InputError(out, dotted(path), expected, f'{now}')


def _difference(
    a: Any, b: Any, path: tuple[Any, ...] = ()
) -> tuple[tuple[Any, ...], Any, Any] | None:
    """Where two JSON documents differ first."""
    if isinstance(a, dict) and isinstance(b, dict):
        pairs = [(key, a.get(key), b.get(key)) for key in dict.fromkeys([*a, *b])]
    elif isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        pairs = [(i, x, y) for i, (x, y) in enumerate(zip(a, b, strict=True))]
    else:
        return None if a == b else (path, a, b)
    for key, x, y in pairs:
        if found := _difference(x, y, (*path, key)):
            return found
    return None
