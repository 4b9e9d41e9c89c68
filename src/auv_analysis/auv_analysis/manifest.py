"""The manifest of a folder of results: the files that we wrote there, and what may be removed."""

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path, PurePosixPath

from auv_analysis.new_files import write

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
    return {**files, MANIFEST: digest(folder / MANIFEST)} if ours else None


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


def digest(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal digits."""
    with path.open('rb') as file:
        return hashlib.file_digest(file, 'sha256').hexdigest()


def signature(path: Path) -> Signature:
    """What shows, without reading it, that a file is still the same."""
    found = path.lstat()
    return found.st_ino, found.st_size, found.st_mtime_ns


def write_manifest(folder: Path, files: Mapping[str, str]) -> None:
    """Write the manifest of a folder: path in it -> digest."""
    document = {'format': 1, 'about': 'written by auv; path: SHA-256', 'files': dict(files)}
    write(folder / MANIFEST, (json.dumps(document, indent=1) + '\n').encode())


def discard(left: Path) -> None:
    """Remove what a command that failed has left, where a manifest lists it and it is the same."""
    listed = listed_in(left) or {}
    with suppress(OSError):
        if all(not has_links(left, n) and digest(left / n) == listed[n] for n in listed):
            remove(left, listed)


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
