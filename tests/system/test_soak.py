"""Random scenarios on the node graph, one after the other: each equals its simulation.

`make soak COUNT=10 SEED=0`; a scenario of run i is drawn by (SEED, i) and named after both.
"""

import os
from pathlib import Path

import numpy as np
import pytest
import yaml
from harness import auv

from auv_analysis import load_scenario, simulate
from auv_analysis.bag import load_run, read_bag
from auv_dynamics import interface
from auv_dynamics.signals import DOFS

COUNT = int(os.environ.get('AUV_GVC_COUNT', '10'))
SEED = int(os.environ.get('AUV_GVC_SEED', '0'))
VEHICLES = ('herman2018', 'herman2018_neutral', 'rexrov', 'bluerov2_heavy', 'girona500')
PAPER = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
SIGNALS = ('eta', 'nu', 'nu_d', 'nu_d_dot', 'tau', 'disturbance', 'disturbance_estimate',
           'nu_measured', 'tau_applied')  # fmt: skip


def drawn(i: int) -> dict:
    """A scenario of this run: vehicle, set-point, disturbances, actuators, sensors."""
    g = np.random.default_rng([SEED, i])

    def waves(size: float) -> dict:
        return {
            dof: {
                'offset': float(g.uniform(-size, size)),
                'terms': [{'amplitude': float(size), 'omega': float(g.uniform(0.2, 1.0))}],
            }
            for dof in DOFS
            if g.random() < 0.5
        }

    scenario = {
        'name': f'soak_{SEED}_{i}',
        'vehicle': str(g.choice(VEHICLES)),
        'duration': 30.0,
        'step': 0.01,
        'seed': int(g.integers(1000)),
        'initial': {
            'eta': g.uniform(-0.5, 0.5, 6).tolist(),
            'nu': g.uniform(-0.2, 0.2, 6).tolist(),
        },
        'controllers': {'gvc': {'law': 'gvc', **PAPER}},
        'setpoint': waves(0.3),
        'disturbance': [{'kind': 'harmonic', **waves(3.0)}],
    }
    if g.random() < 0.5:
        scenario['disturbance'] += [
            {'kind': 'current', 'velocity': g.uniform(-0.3, 0.3, 3).tolist()}
        ]
    if g.random() < 0.5:
        scenario['actuators'] = {'limit': 5e3, 'lag': 0.05, 'delay': 0.02}
    if g.random() < 0.5:
        scenario['sensors'] = {'velocity_noise': 0.001, 'drop_out': 0.1}
    return scenario


@pytest.mark.long
@pytest.mark.parametrize('i', range(COUNT))
def test_a_random_run_loses_nothing_and_equals_its_simulation(i: int, tmp_path: Path) -> None:
    path = tmp_path / 'drawn.yaml'
    path.write_text(yaml.safe_dump(drawn(i)))
    ended = auv('run', str(path), '--out', str(tmp_path / 'out'))
    assert ended.returncode == 0, ended.stderr
    scenario = load_scenario(path)
    contents = read_bag(tmp_path / 'out' / 'gvc', decode=False)
    for topic in interface.STEP_TOPICS:
        assert contents.counts[f'/{topic}'] == scenario.steps + 1, topic
    assert contents.counts['/analysis/lumped_error'] == scenario.steps // 10 + 1
    recorded, simulated = load_run(tmp_path / 'out' / 'gvc'), simulate(scenario, 'gvc', 'zoh')
    for name in SIGNALS:
        a, b = getattr(recorded, name), getattr(simulated, name)
        assert np.all(np.abs(a - b) <= 1e-9 * np.maximum(1, np.abs(b))), name
