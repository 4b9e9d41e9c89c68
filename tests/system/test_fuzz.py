"""A hundred inputs of `make fuzz` with a fixed seed, without the targets that atheris guides."""

import os
import re
import subprocess
import sys
from pathlib import Path

from helpers.patience import patience

ROOT = Path(__file__).resolve().parents[2]
RUN = ROOT / 'tests' / 'fuzz' / 'run.py'
COUNT, SEED = 100, 20222


def test_nothing_from_outside_breaks_anything(tmp_path: Path) -> None:
    options = '--unguided', '--count', str(COUNT), '--seed', str(SEED)
    ended = subprocess.run(
        [sys.executable, str(RUN), *options],
        cwd=tmp_path,
        env=os.environ | {'HYPOTHESIS_STORAGE_DIRECTORY': str(ROOT / '.hypothesis')},
        capture_output=True,
        text=True,
        timeout=patience(540),
        check=False,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr[-6000:]
    counts = [int(found) for found in re.findall(r'"inputs": (\d+)', ended.stdout)]
    assert sum(counts) >= COUNT
    assert not list(tmp_path.rglob('*crash*'))
