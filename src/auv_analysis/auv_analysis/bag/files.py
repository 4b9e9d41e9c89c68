"""The files of a bag, in the order in which they were recorded."""

import os
from pathlib import Path

from auv_dynamics.files.errors import InputError

BAG = 'a bag: a folder, an .mcap, a .db3 or a ROS 1 .bag file'
OTHERS = ('.db3', '.bag')  # endings of files that rosbags reads


def is_mcap(bag: Path) -> bool:
    """Whether our own reader reads this bag; InputError when there is no bag at all."""
    if os.path.isdir(bag):
        if any(bag.glob('*.mcap')):
            return True
        if not any(bag.glob('*.db3*')):
            raise InputError(bag, '', BAG, 'a folder with neither .mcap nor .db3 files')
        return False
    if not os.path.isfile(bag):
        raise InputError(bag, '', BAG, 'no such file or folder')
    return bag.suffix not in OTHERS


def files_of(bag: Path) -> list[Path]:
    """Files that a bag of any kind consists of, which results must not overwrite."""
    if is_mcap(bag):
        return bag_files(bag)
    return sorted(bag.iterdir()) if bag.is_dir() else [bag]


def bag_files(bag: str | Path) -> list[Path]:
    """MCAP files of a bag, in order; InputError when there are none."""
    path = Path(bag)
    is_folder = os.path.isdir(path)  # Path.is_dir raises for a name that is too long
    files = sorted(path.glob('*.mcap'), key=split_order) if is_folder else [path]
    if not files or not os.path.isfile(files[0]):
        found = 'a folder without .mcap files' if is_folder else 'no such file or folder'
        raise InputError(path, '', 'a bag folder or an .mcap file', found)
    for file in files:
        check_regular(file, path if is_folder else file.resolve().parent)
    return files


def check_regular(path: Path, folder: Path) -> None:
    """Refuse what is no file, such as a pipe, or lies outside of the folder of its bag."""
    if not os.path.isfile(path):
        raise InputError(path, '', 'a file', 'something else of that name')
    if not path.resolve().is_relative_to(folder.resolve()):
        expected = 'a file in the folder of its bag, or the file itself'
        raise InputError(path, '', expected, f'a link to {path.resolve()}')


def split_order(path: Path) -> tuple[int, str]:
    """Place of a file in its bag: by the number at the end of its name."""
    number = path.stem.rpartition('_')[2]
    return (int(number) if number.isdecimal() else 0, path.name)
