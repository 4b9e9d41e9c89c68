"""The report of runs that have little in common: vehicles, scenarios, gains, what is known."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers import artists

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.report.run_report import write_report
from auv_analysis.runs.run import FOREIGN, Run

FULL = (30.0 * np.eye(6) + np.diag([4.0] * 5, 1) + np.diag([4.0] * 5, -1)).tolist()
ADAPTIVE = {'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
SURGE = {'surge': {'offset': 0.2, 'terms': [{'amplitude': 0.1, 'omega': 0.5}]}}
NOISY = {
    'name': 'noisy',
    'vehicle': 'bluerov2_heavy',
    'duration': 3.0,
    'seed': 5,
    'controllers': {
        'full': {'law': 'cl', **ADAPTIVE, 'k_D': FULL},
        'pid': {'law': 'pid', 'k_P': 50.0, 'k_I': 10.0, 'k_D': 1.0},
    },
    'disturbance': {'kind': 'current', 'velocity': [0.1, -0.2, 0.0]},
    'actuators': {'thrusters': True},
    'sensors': {'velocity_noise': 0.01},
    'setpoint': SURGE,
}
SCENARIOS: dict[str, dict[str, Any]] = {  # two of one name
    'noisy': NOISY,
    'again': {
        **NOISY,
        'setpoint': {'yaw': {'offset': 0.3}},
        'faults': [{'kind': 'wrench_loss', 'from': 1.0, 'to': 1.5}],
    },
    'moved': {
        'name': 'moved',
        'vehicle': 'rexrov',
        'duration': 2.0,
        'initial': {'eta': [0.0, 0.0, -2.0, 0.0, 0.0, 0.4], 'nu': [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]},
        'controllers': {
            'gvc': {'law': 'gvc', 'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
        },
        'setpoint': SURGE,
    },
}


def _runs(folder: Path) -> tuple[dict[str, Run], dict[str, str]]:
    """Runs of all scenarios and the texts of these."""
    runs, texts = {}, {}
    for label, data in SCENARIOS.items():
        text = yaml.safe_dump({'step': 0.02, **data}, sort_keys=False)
        path = folder / f'{label}.yaml'
        path.write_text(text, encoding='utf-8')
        scenario = load_scenario(path)
        for name in scenario.controllers:
            runs[f'{label}-{name}'] = simulate(
                scenario, name, 'zoh' if scenario.sampled else 'continuous'
            )
            texts[f'{label}-{name}'] = text
    return runs, texts


def _written(out: Path, runs: dict[str, Run], texts: str | dict[str, str]) -> Path:
    summaries = {name: summarize(run) for name, run in runs.items()}
    vehicles = {name: f'name: {run.vehicle.name}' for name, run in runs.items()}
    write_report(out, runs, summaries, texts, vehicles)
    return out


@pytest.fixture(scope='module')
def folders(tmp_path_factory: pytest.TempPathFactory, composing) -> dict[str, Path]:
    """Reports of all runs, and of one beside itself as somebody else's system recorded it."""
    runs, texts = _runs(tmp_path_factory.mktemp('scenarios'))
    name = 'noisy-full'
    unknown = np.full_like(runs[name].nu_d, np.nan)
    foreign = replace(
        runs[name], source=FOREIGN, disturbance=None, nu_d=unknown, gains={}, law='', applied=None
    )
    few = {'foreign': foreign, name: runs[name]}
    with artists.undrawn():
        one = _written(
            tmp_path_factory.mktemp('one'),
            {name: runs[name] for name in ('noisy-full', 'moved-gvc')},
            texts['noisy-full'],
        )
    with composing():
        return {
            'one text': one,
            'all': _written(tmp_path_factory.mktemp('all'), runs, texts),
            'few': _written(tmp_path_factory.mktemp('few'), few, {name: texts[name]}),
        }


@pytest.mark.parametrize('which', ['all', 'few', 'one text'])
def test_all_that_it_shows(folders, which: str, approved) -> None:
    approved.folder(folders[which])
