"""Folders of sweeps whose figures are known functions of what varies, without a simulation."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from auv_analysis.simulation.reduction import COLUMNS
from auv_analysis.studies.sweep.analysis import Analysis
from auv_analysis.studies.sweep.campaign import Campaign, load_campaign
from auv_analysis.studies.sweep.engine import table_of
from auv_analysis.studies.sweep.folder import sweep_folder

Values = dict[str, np.ndarray]
Known = Callable[[str, Values, np.ndarray], dict[str, np.ndarray]]
ENERGY, SETTLED = 'kinetic_energy.mean', 'overall.velocity_error.settling_time'
SIMPLE = """
name: simple
scenario: case1
block: 200
vary:
  - random:
      controllers.*.k_D: {uniform: {from: 1.0, to: 3.0}}
      vehicle.damping.linear[0]: {uniform: {from: 0.0, to: 1.0}}
      controllers.cl.k_I: {loguniform: {from: 0.1, to: 10.0}}
    count: 400
  - grid: {integrator: [ode5, rk4]}
"""
K_D, DAMPING = 'controllers.*.k_D', 'vehicle.damping.linear[0]'


def simple(controller, values, index):
    bent = 4 * (values[DAMPING] - 0.5) ** 2  # its rank correlation is nothing
    factor = 1.0 if controller == 'gvc' else 1.5
    heave = np.where(values[K_D] > 2.0, 1.0, np.nan)  # settles in half of the rows
    return {ENERGY: factor * values[K_D] ** 2, 'effort.max.roll': 2.0 + bent,
            'velocity_error.settling_time.heave': heave}  # fmt: skip


MORRIS = f"""
name: morr
scenario: case1
vary:
  - morris:
      {K_D}: {{uniform: {{from: 1.0, to: 2.0}}}}
      {DAMPING}: {{uniform: {{from: 1.0, to: 2.0}}}}
    count: 12
"""
SALTELLI = MORRIS.replace('morris', 'saltelli').replace('count: 12', 'count: 32')
MIXED = """
name: mixed
scenario: case1
block: 4
vary:
  - grid:
      vehicle: [herman2018, rexrov]
      controllers.gvc.k_D: [[1, 1, 1, 1, 1, 1], [2, 2, 2, 2, 2, 2]]
      vehicle.rigid_body.mass: [-1.0, 250.0, 300.0]
"""


def mixed(controller, values, index):
    count = len(index)
    status, reason = np.full(count, 'ok', object), np.full(count, '', object)
    lost = values['vehicle.rigid_body.mass'] < 0
    status[lost], reason[lost] = 'refused', 'too light'
    wild = ~lost & (np.array(values['vehicle']) == 'rexrov') & (controller == 'cl')
    status[wild], reason[wild] = 'diverged', 'not finite'
    gain = np.array([entry[0] for entry in values['controllers.gvc.k_D']])
    energy = np.where(lost | wild, np.nan, gain + (controller == 'cl'))
    return {'status': status, 'reason': reason, ENERGY: energy}


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
    with sweep_folder(folder / 'out', loaded, overwrite=False) as sweep:
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


def rows(results: Analysis, table: str, **names: object) -> list[dict]:
    """Rows of a table of what was found, with these entries."""
    return [r for r in results.tables[table] if all(r[k] == v for k, v in names.items())]
