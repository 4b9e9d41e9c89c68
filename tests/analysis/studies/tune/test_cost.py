"""Measures gathered in the kernel are those of the samples, with M and its inverse."""

from dataclasses import replace

import numpy as np
from helpers.tunings import GVC, scenario

from auv_analysis import load_scenario, simulate
from auv_analysis.metrics.quantities import COSTS
from auv_analysis.metrics.settling import band_of
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.simulation.closed_loop import Sample
from auv_analysis.studies.tune.cost import (
    Cost,
    Measures,
    measured,
    measures_of,
    measures_of_run,
    of_each,
)
from auv_gvc_controller.laws.model import control_model

ROUGH = [{'kind': 'model_error', 'mass': 0.1, 'added_mass': -0.2, 'damping': 0.3},
         {'kind': 'current', 'velocity': [0.2, -0.1, 0.0]}]  # fmt: skip
LIMITS = {'limit': [400, 400, 600, 80, 80, 80], 'lag': 0.05}


def test_measures_of_a_batch_are_those_of_the_samples() -> None:
    base = load_scenario('case1')
    one = {'gvc': base.controllers['gvc']}  # a law more is a kernel more to compile
    values = {'vehicle': 'rexrov', 'duration': 2.5, 'controllers': one, 'disturbance': ROUGH}
    base = changed_scenario(base, values)
    found, expected = of_each(base, 'continuous')['gvc'], measures_of_run(simulate(base, 'gvc'))
    for measure in Measures._fields:
        np.testing.assert_allclose(
            getattr(found, measure), getattr(expected, measure), rtol=1e-9, err_msg=measure
        )
    assert set(COSTS) == set(Measures._fields)


def test_effort_is_that_of_the_wrench_applicable(tmp_path) -> None:
    """The record without a kernel, sample by sample, of a run with actuators in between."""
    base = scenario(tmp_path, {'gvc': GVC}, vehicle='rexrov', duration=2.5, actuators=LIMITS)
    run = simulate(base, 'gvc', 'zoh')
    model, band = control_model(base.vehicle), band_of(np.abs(run.nu_d).max(axis=0))
    cost = Cost.start(model, band, run.step, np.full)
    for k in range(run.samples):
        x = np.concatenate([np.zeros(7), run.nu[k]])
        six = (tuple(v[k]) for v in (run.nu_d, run.tau, run.tau_applied))
        Cost.fill_record(cost, k, Sample(x, x, np.zeros(12), *six, (0.0,) * 6, (0.0,) * 6))
    batch = Cost(
        *(v if name in Cost._fields[:5] else v[None] for name, v in cost._asdict().items())
    )
    found, expected = measures_of(batch, run.samples, run.step), measures_of_run(run)
    for measure in Measures._fields:
        np.testing.assert_allclose(
            getattr(found, measure), getattr(expected, measure), rtol=1e-9, err_msg=measure
        )
    commanded = measures_of_run(replace(run, applied=None))
    assert found.effort[0] < 0.9 * commanded.effort[0]


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
