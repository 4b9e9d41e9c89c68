"""A small campaign and what tests of sweeps do with it."""

from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from threading import Lock

import pyarrow as pa
import pyarrow.dataset

from auv_analysis.studies.sweep.campaign import load_campaign
from auv_analysis.studies.sweep.engine import Outcome, sweep
from auv_analysis.studies.sweep.folder import sweep_folder

ROOT = Path(__file__).parents[2]
SCENARIO = (ROOT / 'config/scenarios/case1.yaml').read_text().replace('30.0', '0.3')
CAMPAIGN = """
name: small
scenario: scenario.yaml
seed: 11
block: 5
vary:
  - grid:
      vehicle: [herman2018, herman2018_neutral]
      controllers.*.k_D: [6, 12.0]
  - random:
      vehicle.damping.linear[0]: {uniform: {from: 50, to: 90}}
      setpoint.surge.offset: {choice: [0.1, 0.2]}
    count: 4
"""
ROLLOUTS = 16


def write_files(folder: Path) -> Path:
    """A folder with a campaign and its scenario."""
    (folder / 'scenario.yaml').write_text(SCENARIO)
    (folder / 'campaign.yaml').write_text(CAMPAIGN)
    return folder


def run(
    files: Path,
    executor: Executor | None = None,
    out: str = 'out',
    ahead: int = 4,
    *,
    overwrite: bool = False,
) -> Outcome:
    campaign = load_campaign(files / 'campaign.yaml')
    with sweep_folder(files / out, campaign, overwrite=overwrite) as folder:
        return sweep(campaign, folder, executor or ThreadPoolExecutor(2), lambda: ahead)


def rows(out: Path) -> pa.Table:
    table = pyarrow.dataset.dataset(out / 'rollouts').to_table()
    return table.sort_by([('controller', 'ascending'), ('index', 'ascending')])


def parts(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((out / 'rollouts').iterdir())}


class Counting(ThreadPoolExecutor):
    """Threads that keep account of what they were given and have not finished."""

    def __init__(self) -> None:
        super().__init__(2)
        self.submitted, self.most, self._open, self._guard = 0, 0, 0, Lock()

    def submit(self, function: Callable, /, *args: object, **kwargs: object) -> Future:
        with self._guard:
            self.submitted += 1
            self._open += 1
            self.most = max(self.most, self._open)
        future = super().submit(function, *args, **kwargs)
        future.add_done_callback(self._finished)
        return future

    def _finished(self, _: Future) -> None:
        with self._guard:
            self._open -= 1


class Interrupted(Counting):
    """Ctrl-C comes when so many blocks have been handed over."""

    def __init__(self, after: int):
        super().__init__()
        self._after = after

    def submit(self, function: Callable, /, *args: object, **kwargs: object) -> Future:
        if self.submitted == self._after:
            raise KeyboardInterrupt
        return super().submit(function, *args, **kwargs)
