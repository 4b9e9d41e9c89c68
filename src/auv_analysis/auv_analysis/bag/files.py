"""The files of a bag, in the order in which they were recorded."""

import os
from pathlib import Path

from auv_dynamics.files import InputError


def bag_files(bag: str | Path) -> list[Path]:
    """MCAP files of a bag, in order; InputError when there are none."""
    path = Path(bag)
    is_folder = os.path.isdir(path)  # Path.is_dir raises for a name that is too long
    files = sorted(path.glob('*.mcap'), key=_split_order) if is_folder else [path]
    if not files or not os.path.isfile(files[0]):
        found = 'a folder without .mcap files' if is_folder else 'no such file or folder'
        raise InputError(path, '', 'a bag folder or an .mcap file', found)
    return files


def _split_order(path: Path) -> tuple[int, str]:
    number = path.stem.rpartition('_')[2]
    return (int(number) if number.isdigit() else 0, path.name)
