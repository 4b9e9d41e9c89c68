"""The zero-order hold: z += dt e_{k-1}, S += dt s_{k-1}, nothing at k = 0, then tau_k."""

import re
from typing import Any, NamedTuple

import herman_reference as reference
import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics import load_vehicle
from auv_dynamics.files.shipped import shipped
from auv_dynamics.kernel.compile import uncached
from auv_dynamics.vehicle.kinematics import quaternion
from auv_gvc_controller.control.sampled_law import SampledLaw, state_rate, user_law
from auv_gvc_controller.laws.law import make_gains
from auv_gvc_controller.laws.model import control_model

PAPER = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
LAWS = ['cl', 'gvc']  # those of the paper
GENERATOR = np.random.default_rng(5)
TIMES = np.array([0.0, 0.01, 0.03, 0.04, 0.09, 0.1])  # not evenly spaced
NU, NU_D, NU_D_DOT = (GENERATOR.normal(size=(6, 6)) for _ in range(3))
ETA = np.array([0, 0, 0, 0.2, -0.3, 0.5])
ATTITUDE = tuple(quaternion(ETA[3:]))


def make(law: str) -> SampledLaw:
    return SampledLaw(make_gains(law, PAPER), control_model(load_vehicle('rexrov')))


def sample(one: SampledLaw, k: int, dt: float, **changed):
    values = {'nu': NU[k], 'nu_d': NU_D[k], 'nu_d_dot': NU_D_DOT[k]} | changed
    arguments = (tuple(values[key]) for key in ('nu', 'nu_d', 'nu_d_dot'))
    nu, nu_d, nu_d_dot = arguments
    tau, f = one.sample(TIMES[k], dt, nu, ATTITUDE, nu_d, nu_d_dot)
    return np.array(tau), np.array(f)


def steps(k: int) -> float:
    return TIMES[k] - TIMES[k - 1] if k else 0.0


def expected(law: str, held=()):
    """(tau, f) at each sample by the recursion of the contract; no rate after those held."""
    data = yaml.safe_load(shipped('vehicles', 'rexrov').read_text(encoding='utf-8'))
    m = reference.vehicle_matrices(data)
    one = reference.make_law(m['M'], PAPER | {'law': law})
    z, S, rows, e, s = np.zeros(6), np.zeros(6), [], np.zeros(6), np.zeros(6)
    for k in range(len(TIMES)):
        if k not in held:
            z, S = z + steps(k) * e, S + steps(k) * s
        tau, s, f = one(NU[k], NU_D[k], NU_D_DOT[k], z, S, reference.coriolis(m['M'], NU[k]),
                        reference.damping(m, NU[k]), reference.restoring(m, ETA))  # fmt: skip
        e = NU_D[k] - NU[k]
        rows.append((tau, f))
    return rows


def check(found, wanted) -> None:
    for (tau, f), (tau_wanted, f_wanted) in zip(found, wanted, strict=True):
        assert_allclose(tau, tau_wanted, rtol=0, atol=1e-10 * np.abs(tau_wanted).max())
        assert_allclose(f, f_wanted, rtol=0, atol=1e-10 * (1 + np.abs(f_wanted).max()))


@pytest.mark.parametrize('law', LAWS)
def test_the_recursion_of_the_contract(law):
    one = make(law)
    found = [sample(one, k, steps(k)) for k in range(len(TIMES))]
    check(found, expected(law))
    assert not found[0][1].any()
    assert found[1][1].any()


@pytest.mark.parametrize('law', LAWS)
def test_nothing_is_integrated_at_the_first_sample(law):
    without, with_dt = sample(make(law), 0, 0.0), sample(make(law), 0, 0.5)
    assert_array_equal(without, with_dt)


@pytest.mark.parametrize('law', LAWS)
def test_a_sample_that_is_not_finite_leaves_the_state(law):
    one = make(law)
    found = [sample(one, k, steps(k)) for k in range(3)]
    for bad in (
        {'nu': [np.nan] * 6},
        {'nu_d': [np.inf, 0, 0, 0, 0, 0]},
        {'nu_d_dot': [np.nan] * 6},
    ):
        with pytest.raises(ArithmeticError, match='a wrench that is not finite'):
            sample(one, 3, steps(3), **bad)
    found += [sample(one, k, steps(k)) for k in range(3, len(TIMES))]
    check(found, expected(law))


@pytest.mark.parametrize('law', LAWS)
def test_a_rate_that_is_forgotten_is_not_integrated(law):
    one = make(law)
    found = []
    for k in range(len(TIMES)):
        if k == 3:
            one.forget_rate()
        found.append(sample(one, k, steps(k)))
    check(found, expected(law, held={3}))
    assert np.abs(found[3][0] - expected(law)[3][0]).max() > 1e-3


@pytest.mark.parametrize('law', LAWS)
def test_reset_starts_from_zero_integrals(law):
    one = make(law)
    first = [sample(one, k, steps(k)) for k in range(len(TIMES))]
    one.reset()
    again = [sample(one, k, steps(k)) for k in range(len(TIMES))]
    assert_array_equal(again, first)


def test_two_laws_do_not_share_their_state():
    one, other = make('gvc'), make('gvc')
    for k in range(4):
        sample(one, k, steps(k))
    assert_array_equal(sample(other, 0, 0.0), sample(make('gvc'), 0, 0.0))


def test_answers_are_plain_floats():
    tau, f = make('cl').sample(0.0, 0.0, (0.0,) * 6, ATTITUDE, (1.0,) * 6, (0.0,) * 6)
    assert len(tau) == len(f) == 6
    assert {type(value) for value in (*tau, *f)} == {float}


class Own(NamedTuple):
    """Gains of a law of one's own."""

    k: float


class Short(NamedTuple):
    """Gains of a law whose answers change their shape after half a second."""

    STATES = 2

    wrenches: Any
    rates: Any

    @staticmethod
    def wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return gains.wrenches if t > 0.5 else ((0.0,) * 6, (0.0,) * 6)

    @staticmethod
    def state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return gains.rates if t > 0.5 else (0.0, 0.0)


@pytest.mark.parametrize(
    ('tau', 'f', 'rates', 'text'),
    [
        (np.zeros(7), np.zeros(6), (0, 0), 'expected 6 numbers as tau, found 7'),
        (np.zeros(6), np.zeros(5), (0, 0), 'expected 6 numbers as f, found 5'),
        (np.zeros((3, 2)), np.zeros(6), (0, 0), 'TypeError'),
        (np.zeros(6), np.zeros(6), (0, 0, 0), 'expected 2 numbers as state_rate, found 3'),
        (np.zeros(6), np.zeros(6), (0,), 'expected 2 numbers as state_rate, found 1'),
    ],
)
def test_answers_of_another_size_are_refused_by_the_name_of_the_law(tau, f, rates, text):
    one = SampledLaw(Short((tau, f), rates), control_model(load_vehicle('rexrov')))
    zero = (0.0,) * 6
    one.sample(0.0, 0.0, zero, ATTITUDE, zero, zero)
    with pytest.raises(ArithmeticError, match=f'the law Short failed: .*{text}'):
        one.sample(1.0, 1.0, zero, ATTITUDE, zero, zero)


class Told(NamedTuple):
    """Gains of a law that says what it was told."""

    STATES = 6

    k: float

    @staticmethod
    def wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        tau = np.array(nu) + 2 * np.array(nu_d) + 4 * np.array(nu_d_dot) + 8 * np.array(state)
        return tau, (*attitude, t, gains.k)

    @staticmethod
    def state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return np.array(nu) + 2 * np.array(nu_d) + 4 * np.array(nu_d_dot) + state[0] + t + gains.k


def test_a_law_of_ones_own_is_told_each_quantity_in_its_place():
    one, state = SampledLaw(Told(3.0), control_model(load_vehicle('rexrov'))), np.zeros(6)
    for k in range(3):
        seen = NU[k] + 2 * NU_D[k] + 4 * NU_D_DOT[k]
        tau, f = sample(one, k, steps(k))
        assert_allclose(tau, seen + 8 * state)
        assert_allclose(f, [*ATTITUDE, TIMES[k], 3.0])
        state = state + steps(k + 1) * (seen + state[0] + TIMES[k] + 3.0)


@pytest.mark.parametrize(
    ('raised', 'text'),
    [
        (KeyError('k_Q'), "the law Own failed: KeyError: 'k_Q'"),
        (OverflowError('too large'), 'the law Own failed: OverflowError: too large'),
    ],
)
def test_what_a_law_of_ones_own_raises_names_it(raised, text):
    with pytest.raises(ArithmeticError, match=re.escape(text)), user_law(Own(1.0)):
        raise raised
    with pytest.raises(KeyError), user_law(make_gains('cl', PAPER)):
        raise KeyError('a defect of ours stays what it is')


@pytest.mark.parametrize('rates', [(), np.zeros(0)], ids=['tuple', 'array'])
def test_a_law_without_states_is_compiled_as_well(rates):
    class Nothing(NamedTuple):
        k: Any
        STATES = 0

        @staticmethod
        def state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
            return rates

    @uncached
    def entries(six, state, gains):
        change, total = state_rate(0.0, six, six, six, six, state, gains, six), 0.0
        for i in range(state.shape[0]):
            total += change[i]
        return total

    assert entries((0.0,) * 6, np.zeros(0), Nothing(np.ones(36))) == 0.0
