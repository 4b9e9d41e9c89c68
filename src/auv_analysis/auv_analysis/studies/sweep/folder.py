"""The folder of a sweep: its inputs, and the parts that are finished.

Whatever is in it under its final name is complete: everything is written under another name,
flushed to the disk and then renamed, a part once the manifest of the folder lists its digest. A
process may therefore be killed at any time.
"""

import hashlib
import json
import platform
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from auv_analysis.output.folder import (
    CAMPAIGN,
    MANIFEST,
    PART,
    ROLLOUTS,
    SWEEP,
    ResultsFolder,
    changed_in,
    listed_in,
    results_folder,
    sha256_of,
    write_manifest,
)
from auv_analysis.output.new_files import UNFINISHED, write
from auv_analysis.output.progress import say
from auv_analysis.scenario.scenario import write_inputs
from auv_analysis.studies.sweep.campaign import Campaign
from auv_analysis.studies.sweep.variation import kind_of
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import dotted, yaml_text
from auv_dynamics.kernel.compile import JITTED, sources_digest

if TYPE_CHECKING:
    import pyarrow as pa


@contextmanager
def sweep_folder(out: Path, campaign: Campaign, *, overwrite: bool) -> Iterator['SweepFolder']:
    """Folder of a sweep, new or gone on with; locked as long as this lasts.

    Parameters
    ----------
    out : the folder
    campaign : what is swept
    overwrite : replace an earlier sweep, once this one has come to its end

    Raises
    ------
    InputError : it holds another sweep or something else, is in use or cannot be written

    """
    manifest, stored = _manifest(campaign), None if overwrite else _stored(out)
    if stored is not None:
        _refuse_other(out, stored, {**manifest, 'block': stored['block']})
    with results_folder(
        out,
        overwrite=overwrite,
        own=[f'{ROLLOUTS}/part-*.parquet'],
        inputs=campaign.inputs,
        begun=stored is not None,
    ) as results:
        yield SweepFolder(results, campaign, stored or {**manifest, 'block': campaign.block})


class SweepFolder:
    """Inputs of a sweep, and the blocks that are finished.

    Attributes
    ----------
    folder : where they are written
    out : where they lie in the end
    data : folder of the finished blocks
    new : whether nothing was there before

    """

    def __init__(self, results: ResultsFolder, campaign: Campaign, manifest: dict[str, Any]):
        self.folder, self.out = results
        self.data = self.folder / ROLLOUTS
        self.new = not (self.folder / SWEEP).exists()
        if self.new:
            write(self.folder / SWEEP, json.dumps(manifest, indent=1).encode())
        self.block = manifest['block']
        self.data.mkdir(exist_ok=True)
        for folder in (self.folder, self.data):
            for unfinished in folder.glob(f'.*{UNFINISHED}'):
                unfinished.unlink()
        self._digests = listed_in(self.folder) or {}
        self._digests.pop(MANIFEST, None)
        for name in (SWEEP, *_write_inputs(self.folder, campaign)):
            self._digests[name] = sha256_of(self.folder / name)
        for name in changed_in(self.folder, [_name(part) for _, part in sorted(self._parts())]):
            say(f'warning: {self.folder / name}: not as it was written: made again')
            (self.folder / name).unlink()
        write_manifest(self.folder, self._digests)  # a kill may come before the first block

    def finished(self, columns: list[str]) -> Iterator[tuple[int, 'pa.Table']]:
        """Number and some columns of each finished block; what cannot be read is not finished."""
        for number, path in sorted(self._parts()):
            import pyarrow.parquet as pq

            from auv_analysis.output.arrow import pa

            with suppress(pa.ArrowInvalid, OSError):
                yield number, pq.ParquetFile(path).read(columns)

    def stored(self, rollouts: int) -> int:
        """Number of finished rollouts in the folder."""
        blocks = (block for block, _ in self._parts())
        return sum(min(self.block, rollouts - block * self.block) for block in blocks)

    def _parts(self) -> Iterator[tuple[int, Path]]:
        for entry in self.data.iterdir():
            if match := PART.fullmatch(entry.name):
                yield int(match[1]), entry

    def store(self, block: int, table: 'pa.Table') -> None:
        """Write a finished block."""
        import pyarrow.parquet as pq

        from auv_analysis.output.arrow import pa

        sink = pa.BufferOutputStream()
        words = [field.name for field in table.schema if pa.types.is_string(field.type)]
        options = {'compression': 'zstd', 'use_dictionary': words, 'write_statistics': False}
        pq.write_table(table, sink, **options)  # what is asked of a sweep is asked of all its rows
        path, contents = self.data / f'part-{block:08d}.parquet', sink.getvalue()
        self._digests[_name(path)] = hashlib.sha256(contents).hexdigest()
        write_manifest(self.folder, self._digests)
        write(path, contents)


def _name(part: Path) -> str:
    return f'{ROLLOUTS}/{part.name}'


def _manifest(campaign: Campaign) -> dict[str, Any]:
    """What the rows depend on."""
    scenario = campaign.scenario
    data = dict(scenario.data)
    if table := scenario.attachments.get('setpoint.csv'):
        data['setpoint'] = {'file': 'setpoint.csv'}
    kinds = {kind_of(spec) for spec in campaign.data['vary']} - {'grid', 'zip'}
    packages = (['scipy'] if kinds else []) + (['SALib'] if 'morris' in kinds else [])
    drawn_by = {package: metadata.version(package) for package in packages}
    return json.loads(json.dumps({
        'format': 1,
        'campaign': campaign.data,
        'scenario': data,
        'vehicles': {entry.data['vehicle']: entry.vehicle_data
                     for entry in campaign.scenarios.values()},
        'setpoint.csv': table,
        'laws': laws_of(campaign),
        'versions': {**versions(), **drawn_by, 'machine': platform.machine()},
        'rollouts': campaign.rollouts,
    }))  # fmt: skip


def _write_inputs(out: Path, campaign: Campaign) -> list[str]:
    """Write texts for people, which are not read again; their names."""
    names = list(write_inputs(campaign.scenario, out))
    header = f'# {campaign.path.name} with every default filled in\n'
    text = yaml_text({**campaign.data, 'scenario': 'scenario.yaml'})
    write(out / CAMPAIGN, (header + text).encode())
    return [*names, CAMPAIGN]


def _stored(out: Path) -> dict[str, Any] | None:
    """Manifest of the folder, None where there is none."""
    try:
        stored = json.loads((out / SWEEP).read_text(encoding='utf-8'))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError):
        stored = None
    if not isinstance(stored, dict) or not isinstance(stored.get('block'), int):
        found = f'a {SWEEP} that is not ours'
        raise InputError(out, '--out', 'a folder of `auv sweep`, or --overwrite', found)
    return stored


def _refuse_other(out: Path, stored: dict[str, Any], manifest: dict[str, Any]) -> None:
    for path, before, now in _differences(stored, manifest):
        if path[0] == 'laws':  # digests say nothing to people
            expected = 'the module of the law as when it was begun, or --overwrite'
            raise InputError(out, dotted(path), expected, 'an edited one')
        expected = f'{json.dumps(before)[:40]} as when it was begun, or --overwrite'
        raise InputError(out, dotted(path), expected, json.dumps(now)[:40])


def _differences(
    a: Any, b: Any, path: tuple[Any, ...] = ()
) -> Iterator[tuple[tuple[Any, ...], Any, Any]]:
    """Where two JSON documents differ, and what each has there."""
    if isinstance(a, dict) and isinstance(b, dict):
        for key in dict.fromkeys([*a, *b]):
            yield from _differences(a.get(key), b.get(key), (*path, key))
    elif isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        for i, pair in enumerate(zip(a, b, strict=True)):
            yield from _differences(*pair, (*path, i))
    elif a != b:
        yield path, a, b


@lru_cache
def versions() -> dict[str, str]:
    """What the last bit of a figure may depend on."""
    found = {'sources': sources_digest(), 'python': '.'.join(map(str, sys.version_info[:2]))}
    for package in ('numpy', 'numba') if JITTED else ('numpy',):
        found[package] = metadata.version(package)
    return found


def laws_of(campaign: Campaign) -> dict[str, str]:
    """Digest of the source file of each user's own law."""
    import inspect

    found = {}
    for name, law in campaign.own_laws.items():
        if file := inspect.getsourcefile(law):
            found[name] = hashlib.sha256(Path(file).read_bytes()).hexdigest()[:16]
    return found
