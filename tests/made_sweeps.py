"""Folders of sweeps whose figures are known functions of what varies, without a simulation."""

import json
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np

from auv_analysis.reduction import COLUMNS
from auv_analysis.sweep.campaign import Campaign, load_campaign
from auv_analysis.sweep.folder import SweepFolder
from auv_analysis.sweep.table import table_of

Values = dict[str, np.ndarray]
Known = Callable[[str, Values, np.ndarray], dict[str, np.ndarray]]


def make_sweep(folder: Path, campaign: str, known: Known, blocks: range | None = None) -> Path:
    """Write the folder of a campaign.

    Parameters
    ----------
    folder : gets `campaign.yaml` and `out`, which is returned
    campaign : text of the campaign file
    known : controller, path -> values, indices -> columns (n,), of which every other one is 1.0;
        `status` and `reason` among them are 'ok' and '' where they are not given
    blocks : that are finished; none: all

    """
    (folder / 'campaign.yaml').write_text(campaign)
    loaded = load_campaign(folder / 'campaign.yaml')
    with closing(SweepFolder(folder / 'out', loaded, overwrite=False)) as sweep:
        count = -(-loaded.rollouts // sweep.block)
        for block in blocks if blocks is not None else range(count):
            first = block * sweep.block
            last = min(first + sweep.block, loaded.rollouts)
            sweep.store(block, _table(loaded, known, first, last))
    return folder / 'out'


def _table(campaign: Campaign, known: Known, first: int, last: int):
    values, index = campaign.values(first, last), np.arange(first, last)
    figures = {name: _figures(known(name, values, index), last - first)
               for name in campaign.controllers}  # fmt: skip
    return table_of(first, campaign.seeds(first, last), values, figures)


def _figures(given: dict[str, np.ndarray], count: int) -> dict[str, np.ndarray]:
    found = {'status': np.full(count, 'ok', object), 'reason': np.full(count, '', object)}
    found |= {name: np.full(count, 1.0) for name in COLUMNS}
    return {name: np.asarray(given.get(name, values)) for name, values in found.items()}


def change_manifest(out: Path, **entries: object) -> None:
    """Replace entries of the manifest."""
    path = out / 'sweep.json'
    path.write_text(json.dumps(json.loads(path.read_text()) | entries))
