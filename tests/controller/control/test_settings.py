"""Parameters of a controller: which limit, filter, timeout and wrench each of them is."""

from contextlib import nullcontext

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError
from auv_gvc_controller.control.odometry_guard import Now
from auv_gvc_controller.control.settings import ControllerSettings
from auv_gvc_controller.laws.law import make_gains

HEAVY, REXROV = load_vehicle('bluerov2_heavy'), load_vehicle('rexrov')
GAINS = make_gains('gvc', {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0})
SIX = [60.0, 70.0, 80.0, 6.0, 7.0, 8.0]
MS = 1_000_000


def settings(**values) -> ControllerSettings:
    """`__` stands for a dot."""
    given = {name.replace('__', '.'): value for name, value in values.items()}
    return ControllerSettings.read(
        lambda name, kind, default, text, **accepted: given.get(name, default), 'node'
    )


def test_each_limit_is_that_of_its_name():
    found = settings(limits__speed=2.0, limits__rate=0.5, limits__acceleration=7.0)
    assert (found.limits.speed, found.limits.rate, found.limits.acceleration) == (2.0, 0.5, 7.0)
    names = 'omega', 'zeta', 'speed', 'rate', 'acceleration', 'angular_acceleration'
    values = dict(zip(names, (1.5, 2.0, 3.0, 0.4, 0.3, 0.1), strict=True))
    given = {f'setpoint_filter__{name}': value for name, value in values.items()}
    built = settings(**given)._reference_filter()
    assert (built._omega, built._zeta) == (1.5, 2.0)
    assert built._fastest == (3.0,) * 3 + (0.4,) * 3
    assert built._steepest == settings(**given).believed[1] == (0.3,) * 3 + (0.1,) * 3
    assert settings(**given, lockstep=True).believed[1] is None


def test_what_differs_is_named_as_its_parameter():
    given = {'limits.speed': 2.0, 'ramp': 0.9}
    other = ControllerSettings.read(
        lambda name, kind, default, text, **accepted: given.get(name, default), 'other'
    )
    assert other.unlike(settings()) == given
    assert other.unlike(other) == {}


@pytest.mark.parametrize(
    ('given', 'most'),
    [
        ({'limits__wrench': [50.0], 'actuators__limit': SIX}, [50.0] * 6),
        ({'actuators__limit': SIX, 'actuators__thrusters': True}, SIX),
        ({'actuators__thrusters': True}, HEAVY.thrusters.largest()),
        ({'lockstep': True, 'limits__wrench': SIX, 'actuators__limit': [1.0]}, SIX),
        ({'lockstep': True, 'actuators__limit': SIX, 'limits__acceleration': 2.0},
         2.0 * np.abs(HEAVY.M).sum(axis=1)),
    ],
)  # fmt: skip
def test_the_largest_wrench(given, most):
    found = settings(**given)
    found.check_bounded()
    assert_array_equal(found._wrench_limit(HEAVY), most)


def test_in_real_time_the_largest_wrench_must_be_known():
    settings(lockstep=True).check_bounded()
    with pytest.raises(InputError, match=r'node: limits\.wrench: expected in real time the larg'):
        settings(limits__wrench_rate=[5.0]).check_bounded()


def test_anti_windup_knows_the_smaller_limit_of_each_axis_and_the_thrusters():
    both = settings(limits__wrench=[65.0], actuators__limit=SIX)
    assert_array_equal(both._reach(HEAVY).limit, [60.0, 65.0, 65.0, 6.0, 7.0, 8.0])
    assert len(both._reach(HEAVY).forward) == 0
    known = settings(actuators__thrusters=True, actuators__saturation='priority')._reach(HEAVY)
    assert len(known.forward) == 8
    assert known.first is not None
    assert not settings(limits__wrench=[65.0], anti_windup=False)._reach(HEAVY).bounded
    with pytest.raises(InputError, match='thrusters: expected a vehicle with thrusters, not rex'):
        settings(actuators__thrusters=True)._reach(REXROV)


@pytest.mark.parametrize(
    'listed', [[1.0, 2.0], [-1.0], [0.0] * 6, [float('inf')], [True], [*SIX, 1.0]]
)
def test_what_is_no_largest_wrench_is_refused(listed):
    with pytest.raises(InputError, match=r'node: limits\.wrench: expected 1 or 6 numbers of at'):
        settings(limits__wrench=listed)
    assert settings(limits__wrench=[*SIX[:5], 0.0]).limits_wrench == (*SIX[:5], 0.0)


X = (0.0, 0.0, 3.0, 1.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0)


def answered(found: ControllerSettings, ms: int):
    """Answers of a controller to odometry from 0 to `ms`, with a set-point at 0 alone."""
    setpoints = found.setpoints()
    controller = found.build(GAINS, HEAVY, setpoints)
    setpoints.setpoint(0, (0.5, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0)
    steps = range(0, ms + 1, 10)
    return controller, [controller.odometry(k * MS, X, Now(k / 1000)) for k in steps]


def test_timeouts_ramp_and_filter_are_those_of_the_built_controller():
    live = {'limits__wrench': [1e4], 'odometry_timeout': 0.3, 'setpoint_timeout': 0.1}
    controller, found = answered(settings(**live, ramp=0.2), 150)
    assert [one.trouble for one in found[:11]] == [''] * 11
    assert found[11].trouble.startswith('no set-point for 0.11 s')
    assert controller.watch(Now(0.44)).trouble.startswith('no set-point for')
    assert controller.watch(Now(0.46)).trouble.startswith('no odometry for 0.3 s')
    bare = {**live, 'setpoint_acceleration': 'none', 'setpoint_timeout': 9.0}
    (_, gentle), (_, steep) = (answered(settings(**bare, ramp=r), 30) for r in (0.2, 0.0))
    assert [one.tau[0] / full.tau[0] for one, full in zip(gentle, steep, strict=True)] == (
        pytest.approx([0.0, 0.05, 0.1, 0.15])
    )
    filtered = answered(settings(**{**bare, 'setpoint_acceleration': 'filter'}, ramp=0.0), 0)[1]
    assert abs(filtered[0].tau[0]) < 0.1 * abs(steep[0].tau[0]), 'it begins at the velocity'
    with pytest.raises(ValueError, match='stamp jumped'):
        answered(settings(**bare, limits__gap=0.005), 10)


def test_the_timeout_of_odometry_is_also_the_age_and_the_pause_that_its_stamps_may_have():
    controller, _ = answered(settings(limits__wrench=[1e4], odometry_timeout=0.3), 100)
    with pytest.raises(ValueError, match=r'stamp old: expected at most 0\.3 s'):
        controller.odometry(200 * MS, X, Now(0.7))
    for ms, at in ((10, 0.2), (20, 0.21), (30, 0.39)):
        with pytest.raises(ValueError, match='stamp went back'):
            controller.odometry(ms * MS, X, Now(at))
    assert controller.odometry(40 * MS, X, Now(0.41)).ns == 40 * MS


@pytest.mark.parametrize(('clock', 'refused'), [('own', False), ('ros', True), ('auto', True)])
def test_ages_are_judged_by_the_clock_of_the_parameter(clock, refused):
    found = settings(limits__wrench=[1e4], stamp_clock=clock)
    controller = found.build(GAINS, HEAVY, found.setpoints())
    late = Now(0.0, 5_000 * MS)  # the node's clock is 5 s ahead of the stamps
    at_rest = (0.0, 0.0, 3.0, 1.0, *[0.0] * 9)
    with pytest.raises(ValueError, match='stamp old') if refused else nullcontext():
        controller.odometry(0, at_rest, late)
