"""An excitation on real nodes: the graph equals the simulation, and the bag has its wrench."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.graph_runs import assert_same, both, recorded

from auv_analysis import load_scenario

OPEN = {
    'name': 'open',
    'vehicle': 'bluerov2_heavy',
    'duration': 2.0,
    'step': 0.02,
    'seed': 1,
    'controllers': {'open_loop': {'law': 'multisine'}},
    'setpoint': {},
    'excitation': {
        'surge': {'offset': 2.0, 'terms': [{'amplitude': 20.0, 'omega': 2.0}]},
        'yaw': {'terms': [{'amplitude': 3.0, 'omega': 4.0, 'phase': 1.0}]},
    },
    'actuators': {'lag': 0.08, 'delay': 0.04},
    'sensors': {'velocity_noise': 0.005, 'attitude_noise': 0.003},
}


@pytest.mark.long
def test_the_graph_equals_the_simulation(tmp_path: Path) -> None:
    path = tmp_path / 'open.yaml'
    path.write_text(yaml.safe_dump(OPEN))
    out = recorded(path, tmp_path / 'out')
    run, simulated = both(out, path, 'open_loop')
    assert_same(run, simulated)
    assert run.law == 'multisine'
    np.testing.assert_allclose(run.tau[:, 0], 2.0 + 20.0 * np.sin(2.0 * run.t), atol=1e-9)
    driven = load_scenario(path).gain_values('open_loop')
    assert {name: np.ravel(value).tolist() for name, value in driven.items()} == run.gains
