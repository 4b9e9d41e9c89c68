"""Files that are made anew: no link is followed, and a file is there as a whole or as it was."""

import contextlib
import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from auv_dynamics.files.errors import InputError, refusing

if TYPE_CHECKING:
    import pyarrow as pa

UNFINISHED = '.unfinished'  # ends the name of a file that is being written
NEW = os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_WRONLY | os.O_CLOEXEC


def unfinished_name(path: Path) -> Path:
    """Name of a file while it is being written."""
    return path.with_name(f'{path.name}{UNFINISHED}')


def created(path: Path, mode: int = 0o666) -> IO[bytes]:
    """Open a new file, and sync it when it is whole.

    What stands under the name, such as what a killed process has left there, is removed first. Of
    a link only the link is: what it leads to is not touched, even where somebody puts it back.
    `mode` says who may read and write it, as far as the process lets them.
    """
    path.unlink(missing_ok=True)
    return os.fdopen(os.open(path, NEW, mode), 'wb')


@contextlib.contextmanager
def replacing(path: Path, unfinished: Path | None = None) -> Iterator[IO[bytes]]:
    """Write a file that takes its name when it is on the disk.

    Parameters
    ----------
    path : of the file; a link of that name is replaced, not followed
    unfinished : its name until then, in the same folder; default: `unfinished_name(path)`

    """
    unfinished = unfinished or unfinished_name(path)
    with created(unfinished) as file:
        yield file
        synced(file)
    os.replace(unfinished, path)
    sync_folder(path.parent)


def synced(file: IO[bytes]) -> None:
    """Wait until what was written is on the disk."""
    file.flush()
    os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Wait until the names in a folder are on the disk, where the system can do that."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def write_text(path: Path, text: str, *, overwrite: bool, inputs: Iterable[Path] = ()) -> None:
    """Write a file that was asked for, as a whole or not at all; a link is replaced itself.

    Raises
    ------
    InputError : it exists, is no file, is one of the inputs or cannot be written

    """
    check_file(path, overwrite=overwrite, inputs=inputs)
    with refusing(path, '--out', 'a file that can be written'):
        path.parent.mkdir(parents=True, exist_ok=True)
        write(path, text.encode())


def check_file(path: Path, *, overwrite: bool, inputs: Iterable[Path] = ()) -> None:
    """Refuse a file that must not be written, before any work."""
    if not os.path.lexists(path):
        return
    if not overwrite:
        raise InputError(path, '--out', 'a new file, or --overwrite', 'an existing file')
    if not path.is_symlink() and not path.is_file():
        raise InputError(path, '--out', 'a file that can be replaced', 'what is no file')
    for given in inputs:
        if given.resolve() == path.resolve():
            raise InputError(path, '--out', 'another file than the one that is read', str(given))


def write_json(path: Path, document: Any) -> None:
    """Write a document as `--json` prints it, for people: indented; NaN is a ValueError."""
    text = json.dumps(document, indent=2, allow_nan=False)
    path.write_text(text + '\n', encoding='utf-8')


def known(value: Any) -> Any:
    """The same for JSON: None for what is not finite, tuples and arrays as lists."""
    if isinstance(value, Mapping):
        return {key: known(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [known(entry) for entry in value]
    if hasattr(value, 'tolist'):
        return known(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_table(path: Path, rows: Sequence[Mapping[str, Any]]) -> Path:
    """Write rows of words, whole numbers or numbers as Parquet; None and NaN become null."""
    from pyarrow import parquet

    columns = {name: [row[name] for row in rows] for name in rows[0]}
    parquet.write_table(arrow_table(columns), path)
    return path


def arrow_table(columns: Mapping[str, Sequence[Any]]) -> 'pa.Table':
    """Columns of words, truths or numbers; a column of nothing but null is one of numbers."""
    from auv_analysis.output.arrow import pa

    def array(values: Sequence[Any]) -> pa.Array:
        numbers = all(type(value) in (int, float) or value is None for value in values)
        whole = numbers and all(type(value) is int for value in values)
        kind = pa.float64() if numbers and not whole else None
        return pa.array(values, kind, from_pandas=True)

    return pa.table({name: array(values) for name, values in columns.items()})


def write(path: Path, contents: Any) -> None:
    """Write a file so that it is there as a whole or not at all, whatever ends the process."""
    with replacing(path, path.with_name(f'.{path.name}{UNFINISHED}')) as file:
        file.write(contents)
