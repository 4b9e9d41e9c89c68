"""Measures gathered in the kernel are those of the samples, with M and its inverse."""

from dataclasses import replace

import numpy as np
import pytest
from tunings import GVC, scenario

from auv_analysis import load_scenario, simulate
from auv_analysis.changes import changed_scenario
from auv_analysis.tuning.loops import measured
from auv_analysis.tuning.measures import MEANINGS, Measures, measures_of_run
from auv_analysis.tuning.monte_carlo import of_each

ROUGH = [{'kind': 'model_error', 'mass': 0.1, 'added_mass': -0.2, 'damping': 0.3},
         {'kind': 'current', 'velocity': [0.2, -0.1, 0.0]}]  # fmt: skip
LIMITS = {'limit': [40, 40, 60, 8, 8, 8], 'lag': 0.05}
NOISE = {'velocity_noise': 0.02, 'attitude_noise': 0.01}


@pytest.mark.parametrize(
    ('hold', 'changes'),
    [
        ('continuous', {'disturbance': ROUGH}),
        ('zoh', {'disturbance': ROUGH, 'actuators': LIMITS, 'sensors': NOISE}),
    ],
)
def test_measures_of_a_batch_are_those_of_the_samples(hold: str, changes: dict) -> None:
    base = load_scenario('case1')
    one = {'gvc': base.controllers['gvc']}  # a law more is a kernel more to compile
    values = {'vehicle': 'rexrov', 'duration': 2.5, 'controllers': one, **changes}
    base = changed_scenario(base, values)
    found = of_each(base, hold)
    for name in base.controllers:
        expected = measures_of_run(simulate(base, name, hold))
        for measure in Measures._fields:
            np.testing.assert_allclose(
                getattr(found[name], measure),
                getattr(expected, measure),
                rtol=1e-9,
                err_msg=measure,
            )
    assert set(MEANINGS) == set(Measures._fields)


def test_error_and_effort_are_the_same_in_another_body_frame(tmp_path) -> None:
    """A shift of the body frame's origin: nu' = H nu, M' = H^-T M H^-1, tau' = H^-T tau."""
    run = simulate(scenario(tmp_path, {'gvc': GVC}), 'gvc')
    H = np.eye(6)
    H[:3, 3:] = [[0, 0.3, -0.2], [-0.3, 0, 0.5], [0.2, -0.5, 0]]
    back = np.linalg.inv(H)
    vehicle = run.vehicle.changed(M=back.T @ run.vehicle.M @ back)
    moved = replace(run, vehicle=vehicle, nu=run.nu @ H.T, nu_d=run.nu_d @ H.T, tau=run.tau @ back)
    for measure in ('error', 'weighted_error', 'effort', 'late_error', 'peak_effort'):
        np.testing.assert_allclose(
            getattr(measures_of_run(moved), measure), getattr(measures_of_run(run), measure),
            rtol=1e-12, equal_nan=True,
        )  # fmt: skip


def test_a_loop_that_diverges_has_no_measures(tmp_path) -> None:
    base = scenario(tmp_path, {'gvc': GVC})
    found = measured(base, 'gvc', {'k_D': np.array([6.0, 1e7])}, 'continuous', 1)
    assert all(
        np.isnan(values).tolist() == [False, True] for values in (found.error, found.settling)
    )


def test_late_error_does_not_exist_in_a_run_that_ends_before(tmp_path) -> None:
    found = measured(scenario(tmp_path, {'gvc': GVC}), 'gvc', {}, 'continuous', 1)
    assert np.isnan(found.late_error[0])
    assert found.error[0] > 0
