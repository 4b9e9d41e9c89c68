"""Single samples as the analysis node sees them, against matrices written out."""

import numpy as np
from numpy.testing import assert_allclose

from auv_analysis.metrics.coupling import LiveAnalysis
from auv_dynamics import load_vehicle

NU = (0.5, -0.3, 0.2, 0.1, -0.4, 0.6)
TAU = (10.0, -20.0, 30.0, 4.0, -5.0, 6.0)


def test_samples_of_the_papers_vehicle():
    vehicle = load_vehicle('herman2018')
    live = LiveAnalysis(vehicle)
    p, q, r = NU[3:]
    found = live.delta_xi(NU)
    assert_allclose(found[:3], [0.025 * q, -0.015 * p + 0.075 * r, -0.075 * q], atol=1e-12)
    assert_allclose(found[4:], 0.0, atol=1e-15)
    assert_allclose(live.delta_pi(TAU)[:3], 0.0, atol=1e-15)
    assert_allclose(live.delta_pi(TAU)[4], -0.025 * TAU[0] + 0.075 * TAU[2], rtol=1e-9)
    energy, shares = live.energy(NU)
    assert_allclose(energy.sum(), 0.5 * np.array(NU) @ vehicle.M @ NU, rtol=1e-12)
    assert_allclose(energy[0], 0.5 * 300.0 * (NU[0] + 0.025 * q) ** 2, rtol=1e-9)
    assert_allclose(shares, 100.0 * energy / energy.sum(), rtol=1e-12)


def test_shares_of_little_energy():
    live = LiveAnalysis(load_vehicle('herman2018'))
    components, shares = live.energy((1e-3, 0, 0, 0, 0, 0))
    assert components.sum() < 1e-3
    assert_allclose(shares, [100.0, 0, 0, 0, 0, 0])
    assert_allclose(live.energy((0.0,) * 6)[1], np.zeros(6))
