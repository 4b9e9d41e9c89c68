"""Errors, energy and couplings of what was heard, against the samples themselves."""

import numpy as np
import pytest
from helpers.strategies import QUICK
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from auv_analysis.metrics.coupling import LiveAnalysis
from auv_analysis.watch import monitor
from auv_analysis.watch.monitor import FRESH, HELD_NS, LiveMotion
from auv_dynamics import load_vehicle
from auv_dynamics.ros import interface

STEP = 10_000_000
LIVE = LiveAnalysis(load_vehicle('herman2018'))
SIX = st.tuples(*[st.floats(-5.0, 5.0)] * 6)
NU, NU_D, TAU = (0.5, -0.3, 0.2, 0.1, -0.4, 0.6), (1.0, 0.0, 0.0, 0.0, 0.1, 0.2), (10.0,) * 6


def state(nu: tuple) -> tuple:
    return (1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0, *nu)


@QUICK
@given(SIX, SIX)
def test_the_error_is_the_set_point_less_the_velocity(nu: tuple, nu_d: tuple) -> None:
    motion = LiveMotion()
    motion.hear(0.0, interface.CMD_VEL, 7 * STEP, nu_d)
    motion.hear(0.1, interface.ODOM, 7 * STEP, state(nu))
    assert (motion.nu, motion.nu_d, motion.ns) == (nu, nu_d, 7 * STEP)
    assert_allclose(motion.errors.now, np.subtract(nu_d, nu))
    assert_allclose(motion.errors.largest, np.abs(np.subtract(nu_d, nu)))


@QUICK
@given(st.lists(st.integers(0, 400), min_size=1, max_size=40, unique=True), st.integers(0, 500))
def test_the_set_point_is_the_newest_at_or_before_the_odometry(ks: list[int], k: int) -> None:
    motion = LiveMotion()
    for one in sorted(ks):
        motion.hear(0.0, interface.CMD_VEL, one * STEP, (float(one),) * 6)
    motion.hear(0.0, interface.ODOM, k * STEP, state(NU))
    before = [one for one in ks if one <= k and (k - one) * STEP <= HELD_NS]
    assert motion.nu_d == ((float(max(before)),) * 6 if before else None)


def test_set_points_published_far_ahead_are_kept() -> None:
    motion = LiveMotion()
    for k in range(20_000):
        motion.hear(0.0, interface.CMD_VEL, k * STEP, (float(k),) * 6)
    motion.hear(0.0, interface.ODOM, 17_000 * STEP, state(NU))
    assert motion.nu_d == (17_000.0,) * 6


def test_set_points_that_begin_anew_replace_the_old_ones() -> None:
    motion = LiveMotion()
    for k in (5, 6, 7):
        motion.hear(0.0, interface.CMD_VEL, k * STEP, (1.0,) * 6)
    motion.hear(0.0, interface.CMD_VEL, 6 * STEP, (2.0,) * 6)
    motion.hear(0.0, interface.ODOM, 7 * STEP, state(NU))
    assert motion.nu_d == (2.0,) * 6


def test_a_velocity_without_its_set_point_does_not_replace_a_pair_at_once() -> None:
    motion = LiveMotion()
    motion.hear(0.0, interface.CMD_VEL, 0, NU_D)
    motion.hear(0.0, interface.ODOM, 0, state(NU))
    motion.hear(0.1, interface.ODOM, 2 * HELD_NS, state(TAU))
    assert (motion.nu, motion.ns) == (NU, 0)
    motion.hear(FRESH + 0.1, interface.ODOM, 3 * HELD_NS, state(TAU))
    assert (motion.nu, motion.nu_d, motion.ns) == (TAU, None, 3 * HELD_NS)
    assert motion.errors.now is None


def test_the_true_state_comes_before_the_measured_one() -> None:
    motion = LiveMotion()
    motion.hear(0.0, interface.CMD_VEL, 0, NU_D)
    motion.hear(0.0, interface.ODOM, 0, state((9.0,) * 6))
    motion.hear(0.0, interface.GROUND_TRUTH, 0, state(NU))
    motion.hear(0.0, interface.ODOM, STEP, state((9.0,) * 6))
    assert (motion.source, motion.nu) == (interface.GROUND_TRUTH, NU)
    assert_allclose(motion.errors.largest, np.abs(np.subtract(NU_D, NU)))


@QUICK
@given(SIX, SIX)
def test_the_lumped_error_is_of_one_stamp(F: tuple, f: tuple) -> None:
    motion = LiveMotion()
    motion.hear(0.0, interface.DISTURBANCE, 0, F)
    motion.hear(0.0, interface.DISTURBANCE, STEP, (100.0,) * 6)
    assert motion.lumped(0.0) is None
    motion.hear(0.0, interface.DISTURBANCE_ESTIMATE, 0, f)
    assert_allclose(motion.lumped(0.0), np.subtract(f, F))


def test_of_what_waits_for_its_other_half_the_newest_is_kept(monkeypatch) -> None:
    monkeypatch.setattr(monitor, 'PENDING', 3)
    motion = LiveMotion()
    for k in range(5):
        motion.hear(0.0, interface.DISTURBANCE, k * STEP, (float(k),) * 6)
    motion.hear(0.0, interface.DISTURBANCE_ESTIMATE, STEP, TAU)
    assert motion.lumped(0.0) is None
    motion.hear(0.0, interface.DISTURBANCE_ESTIMATE, 2 * STEP, TAU)
    assert motion.lumped(0.0) == (8.0,) * 6


@QUICK
@given(SIX, SIX)
def test_without_an_analysis_node_the_vehicle_tells(nu: tuple, tau: tuple) -> None:
    motion = LiveMotion(LIVE)
    motion.hear(0.0, interface.ODOM, 0, state(nu))
    motion.hear(0.0, interface.WRENCH, 0, tau)
    energy, (components, shares) = motion.energy(0.0), LIVE.energy(nu)
    assert_allclose(energy.by_component, components)
    assert_allclose(energy.shares_percent, shares)
    assert energy.total == pytest.approx(components.sum())
    assert_allclose(motion.delta_xi(0.0), LIVE.delta_xi(nu))
    assert_allclose(motion.delta_pi(0.0), LIVE.delta_pi(tau))


def test_what_is_published_comes_first_as_long_as_it_comes() -> None:
    motion = LiveMotion(LIVE)
    motion.hear(0.0, interface.ODOM, 0, state(NU))
    motion.hear(0.0, interface.WRENCH, 0, TAU)
    for topic in interface.ANALYSIS_TOPICS:
        motion.hear(0.0, topic, 0, (7.0,) * 6)
    assert motion.energy(1.0).by_component == motion.delta_xi(1.0) == motion.delta_pi(1.0)
    assert motion.lumped(1.0) == (7.0,) * 6
    assert_allclose(motion.delta_xi(FRESH), LIVE.delta_xi(NU))
    assert motion.lumped(FRESH) is None


def test_without_vehicle_and_analysis_energy_and_couplings_are_unknown() -> None:
    motion = LiveMotion()
    motion.hear(0.0, interface.ODOM, 0, state(NU))
    motion.hear(0.0, interface.WRENCH, 0, TAU)
    assert motion.energy(0.0) is motion.delta_xi(0.0) is motion.delta_pi(0.0) is None
    assert motion.tau == TAU
