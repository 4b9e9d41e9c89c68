"""Places of the shipped vehicles and scenarios: checkout, colcon install tree or wheel."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import meant

OWNER = {'vehicles': 'auv_dynamics', 'scenarios': 'auv_analysis', 'params': 'auv_analysis',
         'campaigns': 'auv_analysis', 'laws': 'auv_analysis'}  # fmt: skip


def _folders(kind: str) -> Iterator[Path]:
    package = OWNER[kind]
    here = Path(__file__).resolve()
    yield here.parents[3] / package / 'config' / kind  # src/<package>/config of a checkout
    for root in (*here.parents, Path(sys.prefix)):
        yield root / 'share' / package / 'config' / kind  # a prefix with everything below it
        yield root / package / 'share' / package / 'config' / kind  # colcon: one prefix each


def shipped(kind: str, name: str | Path) -> Path:
    """Path of a file given by path or by the bare name of a shipped one.

    Parameters
    ----------
    kind : 'vehicles', 'scenarios', 'campaigns', 'params' or 'laws'
    name : a path, or a bare name without folder and ending

    Returns
    -------
    path : of a file; a path that was given is returned as it is, existing or not

    Raises
    ------
    InputError : a bare name that is no file and not shipped

    """
    path = Path(name)
    if path.suffix in ('.yaml', '.yml') or len(path.parts) != 1 or os.path.isfile(path):
        return path
    return shipped_by_name(kind, str(name))


def shipped_names(kind: str) -> list[str]:
    """Bare names of the shipped files of a kind, sorted."""
    return sorted({path.stem for folder in _folders(kind) for path in folder.glob('*.yaml')})


def shipped_by_name(kind: str, name: str) -> Path:
    """Path of a shipped file by its bare name; InputError when there is none."""
    for folder in _folders(kind):
        candidate = folder / f'{name}.yaml'
        if os.path.isfile(candidate):  # Path.is_file raises for a name that is too long
            return candidate
    found = shipped_names(kind)
    listed = f'{", ".join(found) or "none"}{meant(name, found)}'
    expected = f'a file, or one of the shipped {kind}: {listed}'
    raise InputError(name, '', expected, 'no such file or name')
