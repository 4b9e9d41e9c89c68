"""The open loop: its wrench is the excitation's, in one run and in many at once."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.rollouts import rollouts
from auv_dynamics.files.errors import InputError

SURGE = {'offset': 1.0, 'terms': [{'amplitude': 20.0, 'omega': 0.5},
                                  {'amplitude': 10.0, 'omega': 1.7, 'phase': 1.0}]}  # fmt: skip
OPEN = {
    'name': 'open',
    'vehicle': 'bluerov2_heavy',
    'duration': 4.0,
    'step': 0.02,
    'controllers': {'open_loop': {'law': 'multisine'}},
    'setpoint': {},
    'excitation': {'surge': SURGE, 'yaw': {'terms': [{'amplitude': -2.0, 'omega': 0.9}]}},
}


def scenario_of(folder: Path, **changes) -> Scenario:
    path = folder / 'open.yaml'
    values = {key: value for key, value in (OPEN | changes).items() if value is not None}
    path.write_text(yaml.safe_dump(values))
    return load_scenario(path)


def test_the_wrench_is_that_of_the_excitation(tmp_path: Path) -> None:
    open_loop = {'law': 'multisine', 'anti_windup': True}  # which is no gain
    run = simulate(scenario_of(tmp_path, controllers={'open_loop': open_loop}), 'open_loop', 'zoh')
    expected = np.zeros_like(run.tau)
    expected[:, 0] = 1.0 + 20.0 * np.sin(0.5 * run.t) + 10.0 * np.sin(1.7 * run.t + 1.0)
    expected[:, 5] = -2.0 * np.sin(0.9 * run.t)
    np.testing.assert_allclose(run.tau, expected, atol=1e-12)
    assert np.abs(run.nu[-1, 0]) > 0.1
    six = SURGE | {'terms': SURGE['terms'] * 3}
    gains = scenario_of(tmp_path, excitation={'surge': six}).gains('open_loop')
    np.testing.assert_array_equal(gains.omega[:6], [0.5, 1.7] * 3)
    assert not run.disturbance_estimate.any()


def test_many_at_once_are_those_alone(tmp_path: Path) -> None:
    scenario = scenario_of(tmp_path)
    changes = {
        'excitation.surge.terms[1].omega': np.array([1.0, 1.7, 2.9]),
        'vehicle.damping.linear[0]': np.array([10.0, 13.7, 20.0]),
    }
    columns = rollouts(scenario, 'open_loop', changes, hold='zoh')
    assert set(columns['status']) == {'ok'}
    for i in range(3):
        one = changed_scenario(scenario, {path: values[i] for path, values in changes.items()})
        alone = summarize(simulate(one, 'open_loop', 'zoh'))
        for key in ('effort.rms.surge', 'kinetic_energy.mean_by_component.yaw'):
            group, name, dof = key.split('.')
            value = alone[group][name][('surge', 'yaw').index(dof) * 5]
            np.testing.assert_allclose(columns[key][i], value, rtol=1e-9)
    assert len(set(columns['effort.rms.surge'])) == 3


@pytest.mark.parametrize(
    ('changes', 'said'),
    [
        ({'excitation': {'sway': {'terms': [{'amplitude': 1.0, 'omega': 1.0}] * 7}}},
         'excitation.sway.terms: expected at most 6 terms, found 7'),
        ({'excitation': None},
         'excitation: expected a mapping of degrees of freedom, the wrench of the law multisine, '
         'found nothing'),
        ({'controllers': {'pid': {'law': 'pid', 'k_P': 1.0, 'k_I': 1.0, 'k_D': 1.0}}},
         'controllers: expected one of law multisine, which follows excitation, found pid'),
        ({'controllers': {'open_loop': {'law': 'multisine', 'omega': 2.0}}},
         'controllers.open_loop: expected no gains beside the law: excitation is its wrench, '
         'found omega'),
    ],
)  # fmt: skip
def test_what_no_law_would_follow_is_refused(changes, said, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        scenario_of(tmp_path, **changes)
    assert str(caught.value).endswith(said)
