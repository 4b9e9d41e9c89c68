"""A run in blocks gives the figures of the whole run, wherever its borders fall."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.block_runs import in_blocks
from helpers.certificates import certificate_of
from helpers.strategies import examples
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.metrics import certificate
from auv_analysis.metrics import signals as of
from auv_analysis.metrics.certificate import certificate_blocks
from auv_analysis.metrics.compiled_moments import add_compiled
from auv_analysis.metrics.moments import Moments
from auv_analysis.runs.run import Run
from auv_gvc_controller.laws.model import control_model

quick = examples(10)


@pytest.fixture(scope='module')
def run() -> Run:
    scenario = load_scenario('case1')
    return simulate(replace(scenario, data=scenario.data | {'duration': 4.0}), 'gvc', 'zoh')


def assert_same_figures(found: Any, expected: Any) -> None:
    if isinstance(expected, dict):
        assert found.keys() == expected.keys()
        for key, value in expected.items():
            assert_same_figures(found[key], value)
    elif isinstance(expected, list):
        for one, other in zip(found, expected, strict=True):
            assert_same_figures(one, other)
    elif isinstance(expected, float):
        assert found == pytest.approx(expected, rel=1e-12)
    else:
        assert found == expected


@given(rows=st.integers(1, 130), blocks=st.floats(0.1, 8))
@quick
def test_summary(run, rows, blocks) -> None:
    part = run.part(slice(0, max(int(blocks * rows), 1)))
    assert_same_figures(summarize(in_blocks(part, rows)), summarize(part))


@given(rows=st.integers(50, 450), first=st.floats(-1, 5), last=st.floats(-1, 5))
@quick
def test_window_of_the_energy(run, rows, first, last) -> None:
    window = first, last
    assert_same_figures(summarize(in_blocks(run, rows), window), summarize(run, window))


@given(rows=st.integers(1, 60), n=st.integers(1, 60), known=st.booleans(), seed=st.integers(0, 99))
@quick
def test_certificate_at_the_borders(run, rows, n, known, seed) -> None:
    """Bit for bit: derivative over nine samples, and z that is summed up from the start."""
    steps = np.random.default_rng(seed).uniform(0.005, 0.02, n)
    part = replace(run.part(slice(0, n)), t=np.cumsum(steps) - steps[0], step=0.02)
    part = part if known else replace(part, law_state=None)
    model = control_model(part.vehicle)
    whole = certificate_of(part, model)
    blocks = [*certificate_blocks(in_blocks(part, rows), model, rows)]
    for name in ('t', 's', 'z', 'w', 'L', 'L_dot', 'dissipation', 'drift', 'rho'):
        found = np.concatenate([getattr(block, name) for block in blocks])
        # products of matrices with other numbers of rows may round in another way
        assert_allclose(found, getattr(whole, name), rtol=1e-9, atol=1e-9 * abs(whole.L).max())


@pytest.mark.parametrize('kept', [0, 3, 1000])
def test_a_bound_that_is_often_broken_is_counted_in_a_second_pass(run, kept, monkeypatch) -> None:
    jumpy = run.disturbance_estimate + np.random.default_rng(5).normal(size=run.nu.shape)
    bent = replace(run, disturbance_estimate=jumpy)
    expected = summarize(bent)['lyapunov']
    assert 0.0 < expected['share_bound_28'] < 0.9
    found = certificate_of(bent, control_model(bent.vehicle))
    allowed = 1e-6 * np.abs(found.identity).max()
    assert expected['share_bound_28'] == np.mean(found.L_dot <= found.bound + allowed)
    monkeypatch.setattr(certificate, 'KEPT', kept)
    assert_same_figures(summarize(in_blocks(bent, 50))['lyapunov'], expected)


def test_a_late_error_and_a_late_set_point_are_seen_over_borders(run) -> None:
    for k in (0, 99, 100, 199, 379, 380, 400):
        nu_d = run.nu_d.copy()
        nu_d[k, 3] += 2.0
        bent = replace(run, nu_d=nu_d)
        found = summarize(in_blocks(bent, 100))['velocity_error']['settling_time']
        assert found == summarize(bent)['velocity_error']['settling_time']
        assert found[3] == (None if k >= 380 else pytest.approx((k + 1) / 100))


def numbers(seed: int, n: int) -> list[np.ndarray]:
    return [*np.random.default_rng(seed).normal(size=(5, n, 6))]


@given(seed=st.integers(0, 99), n=st.integers(1, 40))
@quick
def test_moments_by_their_definition(run, seed, n) -> None:
    nu, nu_d, tau, f, F = numbers(seed, n)
    model = control_model(run.vehicle)
    Upsilon, inverse = model.Upsilon.reshape(6, 6), model.Upsilon_inv.reshape(6, 6)
    xi, pi = np.linalg.solve(Upsilon, nu.T).T, tau @ Upsilon
    expected = nu_d - nu, f - F, tau, xi - nu, pi - tau, 0.5 * model.N * xi**2, nu_d
    found = Moments()
    flat = (values.ravel() for values in (nu, nu_d, tau, f, F))
    add_compiled(*flat, of.maps_of(model), found.sums, found.squares, found.peaks)
    assert_allclose(found.sums[of.ENERGY], expected[of.ENERGY].sum(axis=0), rtol=1e-11)
    for signal in (of.ERROR, of.LUMPED, of.TAU):
        assert_allclose(found.squares[signal], (expected[signal] ** 2).sum(axis=0), rtol=1e-11)
    for signal in (of.ERROR, of.LUMPED, of.TAU, of.DELTA_XI, of.DELTA_PI, of.SETPOINT):
        assert_allclose(found.peaks[signal], abs(expected[signal]).max(axis=0), atol=1e-12)
    assert np.allclose(inverse @ Upsilon, np.eye(6))


SCRIPT = """
import json, sys
import numpy as np
from auv_analysis.metrics import signals as of
from auv_analysis.metrics.compiled_moments import add_compiled
from auv_analysis.metrics.moments import Moments, add_columns
from auv_dynamics import load_vehicle
from auv_dynamics.kernel.compile import JITTED
from auv_gvc_controller.laws.model import control_model

maps = of.maps_of(control_model(load_vehicle('herman2018')))
flat = [v.ravel() for v in np.random.default_rng(7).normal(size=(5, 43, 6))]
found = {'JITTED': JITTED}
for add in (add_compiled, add_columns):
    m = Moments()
    add(*flat, maps, m.sums, m.squares, m.peaks)
    found[add.__name__] = [m.sums.tolist(), m.squares.tolist(), m.peaks.tolist()]
print(json.dumps(found))
"""


def test_without_a_compiler_columns_give_what_samples_give(run) -> None:
    """The same source, plain, in a process without compiled code, against the compiled sums."""
    environment = {**os.environ, 'NUMBA_DISABLE_JIT': '1'}
    done = subprocess.run(
        [sys.executable, '-c', SCRIPT], env=environment, capture_output=True, text=True, check=True
    )
    document = json.loads(done.stdout)
    assert document['JITTED'] is False
    compiled = Moments()
    flat = [values.ravel() for values in numbers(7, 43)]
    maps = of.maps_of(control_model(run.vehicle))
    add_compiled(*flat, maps, compiled.sums, compiled.squares, compiled.peaks)
    kept = {
        'sums': [of.ENERGY],
        'squares': [of.ERROR, of.LUMPED, of.TAU],
        'peaks': [of.ERROR, of.LUMPED, of.TAU, of.DELTA_XI, of.DELTA_PI, of.SETPOINT],
    }
    for name in ('add_compiled', 'add_columns'):
        for kind, values in zip(kept, document[name], strict=True):
            expected = getattr(compiled, kind)[kept[kind]]
            assert_allclose(np.array(values)[kept[kind]], expected, rtol=1e-12, atol=1e-12)
