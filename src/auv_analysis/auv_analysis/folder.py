"""The folder of a run's results: made, checked and, when asked, cleared of what we left there."""

import os
import shutil
from pathlib import Path

from auv_dynamics.files import InputError

OURS = (
    'summary.json', 'report.html', 'figures', 'logs', 'scenario.yaml', 'vehicle.yaml',
    'setpoint.csv',
)  # fmt: skip
OURS_IN_RUN = ('params.yaml', 'metadata.yaml')
OURS_ENDINGS = ('.mcap', '.npz')


def prepare(out: Path, *, overwrite: bool) -> Path:
    """Make an empty folder for results.

    Parameters
    ----------
    out : the folder
    overwrite : clear it of earlier results; anything else in it stays where it is

    Raises
    ------
    InputError : it exists, is no folder, or cannot be written

    """
    try:
        if out.is_dir() and any(out.iterdir()):
            if not overwrite:
                raise InputError(out, '--out', 'a new folder, or --overwrite', 'an existing folder')
            _clear(out)
        out.mkdir(parents=True, exist_ok=True)
        probe = out / '.writable'
        probe.touch()
        probe.unlink()
    except OSError as error:
        found = (error.strerror or str(error)).lower()
        raise InputError(out, '--out', 'a folder that can be written', found) from None
    return out


def _clear(out: Path) -> None:
    for entry in list(out.iterdir()):
        if (
            entry.name in OURS
            or entry.suffix in OURS_ENDINGS
            or (entry.is_dir() and _is_run(entry))
        ):
            _remove(entry)


def _is_run(folder: Path) -> bool:
    names = [entry.name for entry in folder.iterdir()]
    ours = all(n in OURS_IN_RUN or n.endswith(OURS_ENDINGS) for n in names)
    return ours and bool(names)


def _remove(entry: Path) -> None:
    if entry.is_dir() and not entry.is_symlink():
        shutil.rmtree(entry)
    else:
        os.unlink(entry)
