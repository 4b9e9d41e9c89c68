"""The folder of a command's results: locked, listed in a manifest, replaced only as a whole."""

import fcntl
import hashlib
import json
import os
import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from fnmatch import fnmatchcase
from itertools import count
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from auv_analysis.output.new_files import UNFINISHED, write
from auv_analysis.output.progress import say
from auv_dynamics.files.errors import FailedError, InputError, refusing, undisturbed

MANIFEST = 'manifest.json'
Signature = tuple[int, int, int]  # of a file: inode, bytes, time of its last change in ns


def listed_in(folder: Path) -> dict[str, str] | None:
    """Path in the folder -> digest of what its manifest lists; None without one of ours."""
    try:
        files = json.loads((folder / MANIFEST).read_text(encoding='utf-8'))['files']
        ours = all(
            isinstance(text, str) and name == str(path := PurePosixPath(name))
            and not path.is_absolute() and '..' not in path.parts
            for name, text in files.items()
        )  # fmt: skip
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return None
    return {**files, MANIFEST: sha256_of(folder / MANIFEST)} if ours else None


def paths_in(folder: Path) -> Iterator[str]:
    """Relative path of every file and link in a folder; no link is followed."""
    for root, folders, files in os.walk(folder):
        links = [name for name in folders if os.path.islink(os.path.join(root, name))]
        for name in [*files, *links]:
            yield (Path(root) / name).relative_to(folder).as_posix()


def has_links(folder: Path, name: str) -> bool:
    """Whether a file, or a folder on the way to it, is a link."""
    parts = Path(name).parts
    return any((folder / Path(*parts[: i + 1])).is_symlink() for i in range(len(parts)))


def sha256_of(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal digits."""
    with path.open('rb') as file:
        return hashlib.file_digest(file, 'sha256').hexdigest()


def changed_in(folder: Path, names: Iterable[str]) -> Iterator[str]:
    """Those of some files in a folder that are not what its manifest lists."""
    listed = listed_in(folder) or {}
    return (n for n in names if n in listed and sha256_of(folder / n) != listed[n])


def signature(path: Path) -> Signature:
    """Fingerprint of a file, taken without reading it."""
    found = path.lstat()
    return found.st_ino, found.st_size, found.st_mtime_ns


def write_manifest(folder: Path, files: Mapping[str, str]) -> None:
    """Write the manifest of a folder: path in it -> digest."""
    document = {'format': 1, 'about': 'written by auv; path: SHA-256', 'files': dict(files)}
    write(folder / MANIFEST, (json.dumps(document, indent=1) + '\n').encode())


def discard(left: Path) -> None:
    """Remove what a command that failed has left, where a manifest lists it and it is the same."""
    known = listed_in(left) or {}
    listed = [name for name in known if os.path.lexists(left / name)]
    with suppress(OSError):
        if all(not has_links(left, n) and sha256_of(left / n) == known[n] for n in listed):
            half = [n for n in paths_in(left) if fnmatchcase(Path(n).name, f'.*{UNFINISHED}')]
            remove(left, [*listed, *(half if listed else ())])


def remove(folder: Path, names: Iterable[str]) -> None:
    """Remove files of a folder, and with them the folders that they leave empty."""
    for name in names:
        (folder / name).unlink(missing_ok=True)
        remove_empty((folder / name).parents)


def remove_empty(folders: Iterable[Path]) -> None:
    """Remove folders, innermost first, up to one that holds something."""
    with suppress(OSError):
        for folder in folders:
            folder.rmdir()


WRITABLE = 'a folder that can be written'
STAGING = 'unfinished'  # folder of a result that is to replace another one
SWEEP, CAMPAIGN, ROLLOUTS = 'sweep.json', 'campaign.yaml', 'rollouts'  # of a sweep
PART = re.compile(r'part-(\d{8})\.parquet')
REPORT, SUMMARY = 'report.html', 'summary.json'
SHARED = ('figures', 'logs')  # folders of ours in which a user's files may lie as well
NAMES = (
    MANIFEST, SUMMARY, REPORT, *SHARED, 'numbers.parquet', 'scenario.yaml',
    'vehicle.yaml', 'setpoint.csv', 'claims.parquet', 'sensitivity.parquet',
    'comparison.parquet', 'comparison.csv', 'atlas.json', 'atlas.parquet', 'analysis.json',
    'quantiles.parquet', 'influence.parquet', 'dependence.parquet', 'together.parquet',
    'failures.parquet', 'paired.parquet', 'indices.parquet', 'best.parquet', 'design.json',
    'summary_before.json', 'vehicle_before.yaml', 'tune.json', 'search.parquet',
    'monte_carlo.parquet', 'open_loop.json', 'check.json', 'samples.parquet',
    'wrenches.parquet', 'faults.parquet', 'linearization.json', SWEEP, CAMPAIGN, 'identify.json',
    'predict.json', 'coefficients.parquet', 'predictions.parquet', 'inertia.parquet',
    'deformation.parquet', 'shares.parquet', 'whiteness.parquet', 'profiles.parquet',
    'excite.json', 'intervals.parquet', 'bounds.parquet', 'motion.parquet', 'margins.parquet',
)  # fmt: skip


class ResultsFolder(NamedTuple):
    """Where results go.

    Attributes
    ----------
    folder : to write into
    out : where they lie in the end: the same folder where it was new

    """

    folder: Path
    out: Path


@contextmanager
def results_folder(
    out: Path,
    *,
    overwrite: bool,
    own: Sequence[str] = (),
    inputs: Iterable[Path] = (),
    begun: bool = False,
) -> Iterator[ResultsFolder]:
    """Folder for results, locked, with a manifest at the end.

    New results are written in place. Those that replace others are written into a folder beside
    them, and take their place when they are whole: a command that fails, is interrupted or killed
    leaves the earlier ones as they were. Only files that the manifest lists are ever removed.

    Parameters
    ----------
    out : the folder
    overwrite : replace the results in it
    own : patterns of paths in it, beside `NAMES`, that the command writes
    inputs : files and folders that the command reads, which must not be replaced
    begun : go on with what is there

    Raises
    ------
    InputError : it exists, is in use, is no folder, cannot be written, holds an input, or
        something that the manifest does not list, or that has changed, is in the way

    """
    made = _make(out)
    with _locked(out):
        try:
            old = {} if begun else _replaceable(out, own, inputs, overwrite=overwrite)
        except InputError:
            remove_empty(made)
            raise
        folder = _staging(out) if old else out
        try:
            yield ResultsFolder(folder, out)
            files = {path: sha256_of(folder / path) for path in _written(folder, out, own)}
            if folder != out:
                _swap(folder, out, old, files)
            else:
                write_manifest(out, files)
        except BaseException as error:
            with suppress(OSError):
                _give_up(folder, out, own, error)
                remove_empty(made)
            raise
        _say_where(out)


def check_free(out: Path, *, overwrite: bool, inputs: Iterable[Path]) -> None:
    """Refuse, before any work, what `results_folder` would refuse after it."""
    made = _make(out)
    try:
        with _locked(out):
            _replaceable(out, (), inputs, overwrite=overwrite)
    finally:
        remove_empty(made)


def _make(out: Path) -> list[Path]:
    """Make a folder and see that it can be written; those that were not there, innermost first."""
    try:
        with refusing(out, '--out', WRITABLE):
            missing = [path for path in (out, *out.parents) if not path.exists()]
            str(out).encode()  # Arrow takes no other names
            out.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=out).close()
    except UnicodeEncodeError:
        raise InputError(out, '--out', 'a name in UTF-8', 'other bytes') from None
    return missing


@contextmanager
def _locked(out: Path) -> Iterator[None]:
    """Lock a folder as long as this lasts or the process lives, where the file system can."""
    handle = os.open(out, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            expected = 'a folder that no other command is writing into'
            raise InputError(out, '--out', expected, 'one in use') from None
        except OSError:
            pass
        yield
    finally:
        os.close(handle)


def _replaceable(
    out: Path, own: Sequence[str], inputs: Iterable[Path], *, overwrite: bool
) -> dict[str, Signature]:
    """Files of the results that may be replaced; none where the folder is empty."""
    with refusing(out, '--out', WRITABLE):
        if all(fnmatchcase(path.name, f'.*{UNFINISHED}') for path in out.iterdir()):
            return {}  # or a command was killed at its first file
    if not overwrite:
        raise InputError(out, '--out', 'a new folder, or --overwrite', 'an existing folder')
    listed = listed_in(out)
    if listed is None:
        expected = f'a new folder, or results whose {MANIFEST} says what may be replaced'
        raise InputError(out, '--out', expected, 'files that none lists')
    read = [path.resolve() for path in inputs]
    old = {}
    for name, known in listed.items():
        path = out / name
        if not os.path.lexists(path):
            continue
        if has_links(out, name) or not path.is_file() or sha256_of(path) != known:
            raise InputError(path, '--out', 'the file as it was written', 'one that has changed')
        for given in read:
            if path.resolve().is_relative_to(given):
                expected = 'a folder that does not hold what is read'
                raise InputError(out, '--out', expected, str(given))
        old[name] = signature(path)
    for name in paths_in(out):
        top, inside, _ = name.partition('/')
        if name not in listed and _is_own(name, own) and not (top in SHARED and inside):
            raise InputError(out / name, '--out', 'no such file or folder', 'what is not ours')
    return old


def _is_own(name: str, own: Sequence[str]) -> bool:
    first = [pattern.partition('/')[0] for pattern in own]
    return (
        name.partition('/')[0] in NAMES
        or any(fnmatchcase(name, pattern) for pattern in own)
        or any('/' not in name and fnmatchcase(name, top) for top in first)
    )


def _written(folder: Path, out: Path, own: Sequence[str]) -> list[str]:
    """Files that a command has written: in a new folder beside the results all that is there."""
    mine = [name for name in paths_in(folder) if folder != out or _is_own(name, own)]
    return [name for name in sorted(mine) if name != MANIFEST and not has_links(folder, name)]


def _staging(out: Path) -> Path:
    """A new folder beside the results that are to be replaced."""
    for i in count():
        folder = out / (f'{STAGING}_{i}' if i else STAGING)
        with suppress(FileExistsError):
            folder.mkdir()
            break
    return folder


def _swap(staging: Path, out: Path, old: dict[str, Signature], files: Mapping[str, str]) -> None:
    """Put whole results in the place of others, which have not changed since they were checked."""
    for name in files:
        way = [out / parent for parent in PurePosixPath(name).parents]
        there = os.path.lexists(out / name)
        mine = name in old and there and signature(out / name) == old[name]
        if has_links(out, name) or (there and not mine) or any(p.is_file() for p in way):
            raise FailedError(f'{out / name}: expected no such file, found what is not ours')
    with undisturbed():
        for name in files:
            (out / name).parent.mkdir(parents=True, exist_ok=True)
            (staging / name).replace(out / name)
        remove(out, [name for name in old if name not in files and name != MANIFEST])
        write_manifest(out, files)
        shutil.rmtree(staging)
        for left in out.glob(f'{STAGING}*'):
            discard(left)


def _give_up(folder: Path, out: Path, own: Sequence[str], error: BaseException) -> None:
    """List what a command that failed has left; drop of a replacement what is no use."""
    failed = isinstance(error, FailedError | ArithmeticError)
    recorded = any(any(folder.rglob(kind)) for kind in ('*.mcap*', 'part-*.parquet'))
    if folder != out and not recorded and not (failed and (folder / SUMMARY).is_file()):
        shutil.rmtree(folder)
        return
    if files := _written(folder, out, own):
        write_manifest(folder, {name: sha256_of(folder / name) for name in files})
        _say_where(folder)
    if folder != out:
        say(f'{out}: the earlier results stay; what there is of the new ones: {folder}')


def _say_where(folder: Path) -> None:
    """Say where results lie: the page, or the summary alone where there is none."""
    for kind, name in (('report', REPORT), ('summary', SUMMARY)):
        if (folder / name).is_file():
            say(f'{kind}: {folder / name}')
            return
