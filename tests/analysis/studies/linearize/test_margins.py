"""Margins of sampled loops against a second sampling of them, simulations and known answers."""

import copy
import json
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.signal
import yaml
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from auv_analysis import load_scenario, simulate
from auv_analysis.cli import linearize
from auv_analysis.cli.main import main
from auv_analysis.cli.scenario_runs import warn
from auv_analysis.studies.linearize import margins
from auv_analysis.studies.linearize.margins import (
    ControlLoop,
    axis_margins,
    margin_notes,
    stability_margins,
    stable,
)
from auv_analysis.studies.linearize.sampled_loop import behind_rotors
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.thrusters import Rotor

CRUISE = np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.1])
STEP = 0.02
SOFT = [2.0, 2.0, 3.0, 1.0, 1.0, 0.01]
PULL = [5.0, 5.0, 8.0, 1.0, 1.0, 0.04]
LAWS = {
    'gvc': {'law': 'gvc', 'k_D': [5, 5, 6, 5, 5, 4], 'k_I': SOFT, 'Lambda': 0.2, 'Gamma': 0.2},
    'cl': {
        'law': 'cl',
        'k_D': [50, 60, 90, 1.2, 1, 1.6],
        'k_I': SOFT,
        'Lambda': 0.3,
        'Gamma': PULL,
    },
    'pid': {'law': 'pid', 'k_P': [90, 110, 130, 3, 3, 2], 'k_I': PULL, 'k_D': 0.1, 'omega_f': 9.0},
    'smc': {'law': 'smc', 'k_D': [60, 60, 90, 2, 3, 3], 'Lambda': 0.2, 'Gamma': PULL, 'k_S': 0.1},
}


def scenario_of(step=STEP, vehicle='case1_bluerov2_heavy', **changes):
    """A shipped scenario with these entries in place of its own."""
    base = load_scenario(vehicle)
    data = {'controllers': LAWS, 'disturbance': [], 'step': step} | changes
    return replace(base, data=base.data | data)


def grown(loop, gain=(1,) * 6, later=(0,) * 6, fine=2):
    """Largest modulus of the closed loop's multipliers over a period, from parts of it.

    The wrench of each axis, `gain` times the law's, is looked up in a list of past ones for every
    part; delays are whole multiples of the `fine`-th of a period, `later` on top for each axis.
    """
    plant, h, delay = loop.plant, loop.plant.period, loop.held.delay
    n = len(plant.A)
    system = plant.A, plant.B, np.eye(n), np.zeros((n, 6))
    ticks = round(delay / h * fine) + np.array(later)
    assert ticks[0] - later[0] == pytest.approx(delay / h * fine, abs=1e-6)
    law, m = loop.law, len(loop.law.rate_by_x)
    past = int(-(-ticks.max() // fine))
    now = np.eye(n + m + 6 * past, dtype=complex)
    x, s, before = now[:n], now[n : n + m], now[n + m :].reshape(past, 6, now.shape[1])
    u = np.array(gain)[:, None] * (law.by_x @ x[:8] + law.by_state @ s)
    wrenches = [u, *before]  # the newest first
    after = x
    changes = sorted({0, *(ticks % fine).tolist()})  # where a newer wrench begins to act
    for tick, end in pairwise([*changes, fine]):
        ago = -((tick - ticks) // fine)
        held = np.stack([wrenches[k][i] for i, k in enumerate(ago)])
        A, B, *_ = scipy.signal.cont2discrete(system, (end - tick) * h / fine, 'zoh')
        after = A @ after + B @ held
    s = s + h * (law.rate_by_x @ x[:8] + law.rate_by_state @ s)
    return np.abs(np.linalg.eigvals(np.concatenate([after, s, *wrenches[:past]]))).max()


def at_border(inside, outside):
    """Whether a loop turns unstable between two sets of multipliers; neutral ones stay at one."""
    return inside < 1 + 1e-10 and outside > 1 + 1e-10


@pytest.mark.parametrize(('law', 'late'), [*product(LAWS, [(0.0, 0.0), (0.03, 0.0), (0.05, 0.15)])])
def test_margins_are_where_a_second_sampling_of_the_loop_turns_unstable(law, late):
    setting = ControlLoop(scenario_of(), law, *late, nu0=CRUISE)
    loop, wild = setting.loop(), setting.loop((100.0,) * 6)
    assert stable(loop)
    assert_allclose(np.abs(wild.multipliers).max(), grown(wild), rtol=1e-9)
    assert not stable(wild)
    found = setting.margins(loop)
    for i, one in enumerate(found):
        unit = np.eye(6)[i]

        def scaled(factor, unit=unit):
            return grown(loop, 1 + (factor - 1) * unit)

        assert np.isfinite(one.gain), DOFS[i]
        assert at_border(scaled(one.gain * 0.9999), scaled(one.gain * 1.0001)), (DOFS[i], one)
        if one.reduction:
            assert at_border(scaled(one.reduction * 1.001), scaled(one.reduction * 0.999))
        turned = [
            [scaled(np.exp(sign * 1j * one.phase * near)) for near in (0.9999, 1.0001)]
            for sign in (1, -1)
        ]
        assert at_border(*np.max(turned, axis=0)), (DOFS[i], one)
        if one.delay > 1.0:  # more past wrenches than eigenvalues are worth
            continue
        fine = 1000  # delays in steps of a thousandth of a period
        ticks = int(one.delay / STEP * fine)
        borders = [grown(loop, later=(k * unit).astype(int), fine=fine)
                   for k in (ticks, ticks + 1)]  # fmt: skip
        assert at_border(*borders), (DOFS[i], one)


def test_margins_are_of_the_plant_with_its_model_errors():
    scenario = scenario_of(disturbance=[{'kind': 'model_error', 'added_mass': 0.5, 'damping': 0.3}])
    plant, vehicle = ControlLoop(scenario, 'gvc').plant, scenario.vehicle
    M = vehicle.M_RB + 1.5 * vehicle.M_A
    assert_allclose(plant.A[2:, 2:], -np.linalg.solve(M, 1.3 * vehicle.D_linear), atol=1e-12)
    assert_allclose(plant.B[2:], np.linalg.inv(M), atol=1e-12)


def test_of_several_crossovers_the_nearest_to_the_border_counts():
    """A loop whose S comes to 1/2 + j y, on |L| = 1, three times."""
    crossings = {1.0: 0.5, 3.0: 2.0, 9.0: -1.0}  # rad/s -> y

    def sensitivity(at):
        x = np.log(at)[..., None] - np.log(list(crossings))
        y = sum(value * np.exp(-20 * x[..., k] ** 2) for k, value in enumerate(crossings.values()))
        return (0.5 + 0.3 * np.prod(x, axis=-1) + 1j * y)[..., None, None] * np.eye(6)

    def closing(omega, axis, extra):
        s = sensitivity(np.array(omega))[axis, axis]
        return 1 + (1 / s - 1) * np.exp(-1j * omega * extra)

    omega = np.geomspace(0.5, 20.0, 500)
    loop = SimpleNamespace(sensitivity=sensitivity, closing=closing)
    found = axis_margins(loop, 2, omega, sensitivity(omega)[:, 2, 2], delays=True)
    assert found.crossover == pytest.approx(3.0, rel=1e-3)
    assert found.phase == pytest.approx(np.pi - 2 * np.arctan(4.0), rel=1e-3)
    phases = {at: np.angle(1 / (0.5 + 1j * y) - 1) for at, y in crossings.items()}
    delays = [(np.pi + phase) % (2 * np.pi) / at for at, phase in phases.items()]
    assert found.delay == pytest.approx(min(delays), rel=1e-2)


@pytest.mark.parametrize('periods', [0, 1, 2.5])
def test_a_single_axis_has_the_margins_of_its_formula(periods):
    """x_{k+1} = Phi x_k + newest u_{k-d} + older u_{k-d-1} with u = -k x, on paper."""
    law = {'law': 'cl', 'k_D': 30.0, 'k_I': 0.0, 'Lambda': 0.0, 'Gamma': 0.0}
    scenario = scenario_of(controllers={'cl': law})
    setting = ControlLoop(scenario, 'cl', periods * STEP)
    surge = setting.margins(setting.loop())[0]
    m, d = scenario.vehicle.M[0, 0], scenario.vehicle.D_linear[0, 0]
    held = lambda t: (1 - np.exp(-d * t / m)) / d  # noqa: E731
    rest = periods % 1 * STEP
    older = np.exp(-d * (STEP - rest) / m) * held(rest)

    def L(omega):
        z = np.exp(1j * omega * STEP)
        forced = (held(STEP - rest) + older / z) / z ** int(periods)
        return 30.0 * forced / (z - np.exp(-d * STEP / m))

    omega = np.linspace(1e-4, np.pi / STEP, 2001)

    def first(function):
        """Where it first changes its sign, else the end."""
        for k in np.flatnonzero(np.diff(np.sign(function(omega))))[:1]:
            return brentq(function, omega[k], omega[k + 1])
        return omega[-1]

    assert_allclose(surge.gain, -1 / L(first(lambda at: L(at).imag)).real, rtol=1e-5)
    if periods == 0:
        Phi = np.exp(-d * STEP / m)
        assert_allclose(surge.gain, (1 + Phi) / (30.0 * held(STEP)), rtol=1e-12)
    met = first(lambda at: np.abs(L(at)) - 1)
    assert_allclose(surge.crossover, met, rtol=1e-3)
    assert_allclose(surge.phase, np.pi + np.angle(L(met)), rtol=1e-3)


def test_a_simulation_with_delay_dies_out_below_the_gain_margin_and_grows_above():
    law = {'law': 'pid', 'k_P': 150.0, 'k_I': 20.0, 'k_D': 0.0, 'k_FF': 0.0}
    pushed = {'eta': [0.0] * 6, 'nu': [0, 0, 1e-3, 0, 0, 0]}
    quiet = {'initial': pushed, 'setpoint': {}, 'duration': 60.0, 'actuators': {'delay': 0.04}}
    scenario = scenario_of(controllers={'pid': law}, **quiet)
    setting = ControlLoop(scenario, 'pid')
    assert setting.delay == 0.04
    heave = setting.margins(setting.loop())[2]

    def last(factor, delay=0.04):
        scaled = {key: value * factor for key, value in law.items() if key not in ('law',)}
        data = scenario.data | {
            'controllers': {'pid': {'law': 'pid', **scaled}}, 'actuators': {'delay': delay},
        }  # fmt: skip
        run = simulate(replace(scenario, data=data), 'pid', hold='zoh')
        return np.abs(run.nu[-200:, 2]).max() / 1e-3

    assert last(0.99 * heave.gain) < 0.2
    assert last(1.01 * heave.gain) > 2.0
    periods = int(heave.delay / STEP)
    assert last(1.0, 0.04 + periods * STEP) < 0.5
    assert last(1.0, 0.04 + (periods + 1) * STEP) > 2.0


OWN = """
from typing import NamedTuple
import numpy as np

class Squared(NamedTuple):
    k_D: np.ndarray
    STATES = 6

    @staticmethod
    def wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        if gains.k_D[0] > MOST:
            raise ArithmeticError('too much')
        return 3.0 * gains.k_D.reshape(6, 6) ** 2 @ np.subtract(nu_d, nu) + state, np.zeros(6)

    @staticmethod
    def state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return gains.k_D.reshape(6, 6) @ np.subtract(nu_d, nu)
"""


@pytest.mark.parametrize(('value', 'most'), [(2.0, 1e3), (20.0, 1e3), (2.0, 2.5)])
def test_the_largest_gain_of_a_law_that_is_not_linear_in_it(value, most, tmp_path, monkeypatch):
    module = f'own_{value:g}_{most:g}'.replace('.', '_')
    (tmp_path / f'{module}.py').write_text(OWN.replace('MOST', str(most)))
    monkeypatch.syspath_prepend(tmp_path)
    spec = {'own': {'law': f'{module}:Squared', 'k_D': [value, 2.0, 2.0, 1.0, 1.0, 1.0]}}
    setting = ControlLoop(scenario_of(controllers=spec), 'own', 0.1, 0.1)
    factor = setting.largest(0)
    if most == 2.5:
        assert factor == pytest.approx(2.5 / value, rel=1e-5)
        return
    for times, kept in ((0.9999, True), (1.0001, False)):
        loop = setting.loop([times * factor, *[1.0] * 5])
        assert setting.margins(loop)[0].kept == kept
    again = ControlLoop(scenario_of(controllers=spec), 'own', 0.1, 0.1)
    for found, fresh in zip(setting.sensitivity(loop), again.sensitivity(loop), strict=True):
        assert_allclose(found, fresh, rtol=1e-12)


def test_a_gain_that_is_too_small_for_its_integral_has_a_larger_one():
    law = LAWS['pid'] | {'k_P': 6.0, 'k_I': 60.0, 'k_D': 0.0}
    setting = ControlLoop(scenario_of(controllers={'pid': law}), 'pid', 0.02)
    assert not setting.margins(setting.loop())[0].kept
    factor = setting.largest(0)
    assert factor > 2
    for times in (0.9999, 1.0001):
        scale = [times * factor, *[1.0] * 5]
        assert setting.margins(setting.loop(scale))[0].kept == (times < 1)


@pytest.mark.parametrize(
    ('kept', 'factor'),
    [((0.0, 1e9), np.inf), ((0.3, 4.0), 4.0), ((0.02, 0.5), 0.5), ((3.0, 7.0), 7.0),
     ((3.0, 1e9), np.inf), ((1e3, 1e9), 0.0)],
)  # fmt: skip
@pytest.mark.parametrize('axis', [None, 4])
def test_the_largest_gain_is_the_end_of_a_range_that_keeps_the_margins(
    kept, factor, axis, monkeypatch
):
    """Of the range around the present gain, else of the one below it, else of the one above."""
    low, high = kept

    def margins_of(scale, i, *_, delays):
        value = scale[i] if axis in (None, i) else pytest.fail('an axis that is not scaled')
        if i != 4:  # which has more to spare
            return SimpleNamespace(to_spare=9.0)
        return SimpleNamespace(to_spare=min(np.log(value / low) if low else 9.0, high / value - 1))

    asked = []
    setting = SimpleNamespace(loop=lambda scale: asked.append(scale) or scale.copy(),
                              sensitivity=lambda loop: (None, np.zeros((1, 6, 6))))  # fmt: skip
    monkeypatch.setattr(margins, 'axis_margins', margins_of)
    monkeypatch.setattr(margins, 'stable', lambda loop: True)
    assert ControlLoop.largest(setting, axis) == pytest.approx(factor, rel=1e-5)
    others = np.delete(np.array(asked), axis if axis is not None else range(6), axis=1)
    assert np.all(others == 1.0)


@pytest.mark.parametrize('law', LAWS)
def test_the_largest_gain_keeps_6_db_and_45_deg_and_not_a_little_more(law):
    scenario = scenario_of(actuators={'delay': 0.04, 'lag': 0.05})
    setting = ControlLoop(scenario, law)
    for axes in ([0], [2]):
        factor = setting.largest(axes[0] if len(axes) == 1 else None)
        for times, kept in ((0.9999, True), (1.0001, False)):
            scale = np.ones(6)
            scale[list(axes)] = factor * times
            found = setting.margins(setting.loop(scale))
            assert all(found[i].kept for i in axes) == kept


def test_disk_margin_holds_for_gains_and_phases_of_all_axes_at_once():
    setting = ControlLoop(scenario_of(), 'gvc', 0.04, 0.15, nu0=CRUISE)
    loop = setting.loop()
    alpha = setting.disk_margin(loop)
    axes = setting.margins(loop)
    high = (2 + alpha) / (2 - alpha)
    assert 1.02 < high <= min(one.gain for one in axes) * (1 + 1e-9)
    assert 2 * np.arctan(alpha / 2) <= min(one.phase for one in axes) + 1e-9
    random = np.random.default_rng(7)
    for _ in range(200):
        # the border of the disk: (2 + alpha w)/(2 - alpha w), w on the unit circle
        w = np.exp(2j * np.pi * random.random(6))
        assert grown(loop, (2 + 0.999 * alpha * w) / (2 - 0.999 * alpha * w)) < 1 + 1e-7


def test_an_unstable_loop_has_no_margins_but_a_gain_that_has():
    law = LAWS['gvc'] | {'k_D': 20.0, 'k_I': SOFT, 'Lambda': 0.1, 'Gamma': 0.05}
    found = stability_margins(ControlLoop(scenario_of(controllers={'gvc': law}), 'gvc', 0.06, 0.15))
    assert (found['stable'], found['kept'], found['disk_margin']) == (False, False, None)
    assert 0 < found['together'] < 1
    assert 'gain_margin' not in found['axes'][0]


def test_thrusters_that_give_no_roll_leave_it_out_of_the_loop():
    scenario = scenario_of(vehicle='case1_bluerov2', actuators={'thrusters': True, 'delay': 0.02})
    setting = ControlLoop(scenario, 'gvc')
    found = setting.margins(setting.loop())
    lost = list(scenario.vehicle.thrusters.unactuated())
    for dof, one in zip(DOFS, found, strict=True):
        assert np.isfinite(one.crossover) == (dof not in lost), dof
    assert lost
    law = LAWS['smc'] | {'Lambda': 1.5, 'Gamma': [180, 180, 270, 6, 9, 9]}
    late = {'actuators': {'thrusters': True, 'lag': 0.05}, 'controllers': {'smc': law}}
    loop = ControlLoop(scenario_of(vehicle='case1_bluerov2', step=0.01, **late), 'smc').loop()
    assert margins.stable(loop), 'three integrals that drive nothing'


def test_a_rotors_lag_counts_where_the_plant_has_it():
    asked = ({'rotors': True}, {'voltage': 15.0}, {'dead_band': 1.0}, {'rotors': False})
    made = [
        ControlLoop(scenario_of(actuators={'thrusters': True, **one}), 'gvc').late for one in asked
    ]
    assert made == [True, False, False, False]


def test_rotors_of_every_order_filter_their_own_thrusts():
    random, s = np.random.default_rng(3), 7.0j
    A, B, into, out = (random.normal(size=n) for n in ((8, 8), (8, 6), (6, 6), (6, 6)))
    rotors = [Rotor(lag=0.2), Rotor(omega=9.0, zeta=0.3), Rotor(), Rotor(omega=5.0), Rotor(lag=1.0)]
    rotors.append(Rotor(lag=1e-60))  # beside 1e60 the rates of the plant would be lost
    filters = [1 / (0.2 * s + 1), 81 / (s**2 + 5.4 * s + 81), 1, 25 / (s + 5) ** 2, 1 / (s + 1), 1]
    lagged, forced = behind_rotors(A, B, rotors, into, out)
    assert len(lagged) == 8 + 1 + 2 + 2 + 1
    found = np.linalg.solve(s * np.eye(len(lagged)) - lagged, forced)[:8]
    expected = np.linalg.solve(s * np.eye(8) - A, B) @ out @ np.diag(filters) @ into
    assert_allclose(found, expected, rtol=1e-12)


def test_a_simulation_with_rotors_that_swing_dies_out_below_the_gain_margin(tmp_path):
    """Far from what a lag of 2 zeta/omega would give; thrusts are small about those that hold.

    Rotors that step with the samples are half a step earlier than those that turn all the time.
    """
    omega, zeta, step = 12.0, 0.25, 0.005
    data = copy.deepcopy(load_scenario('case1_bluerov2_heavy').vehicle_data)
    for one in data['thrusters']:
        one['rotor'] = {'omega': omega, 'zeta': zeta}
    data['rigid_body']['mass'] += 6.0  # thrusts are well away from zero
    (tmp_path / 'swinging.yaml').write_text(yaml.safe_dump(data))
    law = {'law': 'pid', 'k_P': 60.0, 'k_I': 0.0, 'k_D': 0.0}
    spec = {
        'name': 'swing', 'vehicle': 'swinging.yaml', 'duration': 25.0, 'step': step, 'setpoint': {},
        'initial': {'nu': [0, 0, 1e-4, 0, 0, 0]}, 'controllers': {'pid': law},
    }  # fmt: skip

    def scenario(factor, actuators):
        gains = law | {'k_P': [60.0, 60.0, 60.0 * factor, 1.0, 1.0, 1.0]}
        text = yaml.safe_dump(spec | {'controllers': {'pid': gains}, 'actuators': actuators})
        (tmp_path / 'swings.yaml').write_text(text)
        return load_scenario(tmp_path / 'swings.yaml')

    def margin(**actuators):
        setting = ControlLoop(scenario(1.0, {'thrusters': True, **actuators}), 'pid', step / 2)
        return setting.margins(setting.loop())[2].gain

    heave = margin(rotors=True)
    assert margin(rotor_lag=2 * zeta / omega) > 2 * heave

    def left(factor):
        actuators = {'thrusters': True, 'rotors': True, 'delay': step}
        run = simulate(scenario(factor, actuators), 'pid', hold='zoh')
        return [np.abs(run.nu[at : at + 400, 2]).max() for at in (2000, 4600)]

    before, after = left(0.98 * heave)
    assert after < 0.5 * before < 0.1
    assert min(left(1.02 * heave)) > 1.0


@pytest.mark.usefixtures('undrawn')
def test_a_delay_of_many_steps_leaves_the_poles(tmp_path, capsys):
    data = scenario_of(step=0.01, actuators={'delay': 2.0, 'lag': 3.0}).data
    path = tmp_path / 'late.yaml'
    path.write_text(yaml.safe_dump({**data, 'vehicle': 'bluerov2_heavy'}))
    main(['linearize', str(path), '--controller', 'gvc', '--out', str(tmp_path / 'out')])
    said = capsys.readouterr()
    assert 'no margins beyond 100 steps' in said.err
    assert 'pole, 1/s' in said.out
    assert 'not in these models: actuators' in said.out
    assert linearize._is_soon(load_scenario(path), 0.1), 'a delay that was given counts'


@pytest.mark.usefixtures('unrendered')
def test_the_command_prints_margins_and_writes_them(tmp_path, monkeypatch, capsys, approved):
    out, asked = tmp_path / 'out', []

    def kept(setting):
        found = stability_margins(setting)
        asked.append((setting, copy.deepcopy(found)))
        return found

    monkeypatch.setattr(margins, 'stability_margins', kept)
    check = tmp_path / 'check.json'
    check.write_text('{"command_to_response_delay": {"seconds": 0.03}}')
    line = ['linearize', 'case1_bluerov2_heavy', '--controller', 'gvc', '--out', str(out)]
    main([*line, '--delay-from', str(check), '--lag', '0.02'])
    text = capsys.readouterr().out
    approved.folder(out)
    approved.add(text.splitlines())
    for word in (
        'period 0.01 s, delay 0.03 s, lag 0.02 s',
        'disk margin',
        'axis   gain, dB  phase, deg  delay, s  crossover, rad/s  velocity gain  at most',
    ):
        assert word in text
    document = json.loads((out / 'linearization.json').read_text())
    ((setting, expected),) = asked
    given = load_scenario('case1_bluerov2_heavy')
    assert setting.scenario.data == given.data
    assert setting.scenario.vehicle_data == given.vehicle_data
    assert (setting.controller, setting.delay, setting.lag) == ('gvc', 0.03, 0.02)
    assert (setting.nu0, setting.eta0) == (None, None)
    assert document['models']['gvc']['margins'] == expected
    assert (out / 'margins.parquet').is_file()
    assert (out / 'figures' / 'bode_gvc.png').is_file()

    def refused(setting):
        asked.append((setting, {}))
        raise FailedError('enough')

    monkeypatch.setattr(margins, 'stability_margins', refused)
    with pytest.raises(SystemExit):
        main([*line, '--nu0', *'123456', '--attitude', *'789'])
    moving, _ = asked[-1]
    assert (moving.nu0, moving.eta0) == ([1, 2, 3, 4, 5, 6], [0, 0, 0, 7, 8, 9])


@pytest.mark.parametrize(
    ('seconds', 'known'), [(0, True), (0.5, True), (-0.1, False), ('1', False)]
)
def test_a_delay_that_was_measured_may_be_none_and_is_never_negative(seconds, known, tmp_path):
    path = tmp_path / 'check.json'
    path.write_text(json.dumps({'command_to_response_delay': {'seconds': seconds}}))
    if known:
        assert linearize.measured_delay(path) == seconds
    else:
        with pytest.raises(InputError, match=r'delay\.seconds: expected a delay in s'):
            linearize.measured_delay(path)


@pytest.mark.parametrize(
    ('options', 'said'),
    [
        ('rexrov --delay 0.1', '--delay: expected a scenario'),
        ('case1 --delay 60', 'delay: expected 0 to 1 s, 100 steps, found 60'),
        ('case1 --delay-from FILE', 'command_to_response_delay.seconds: expected a delay in s'),
    ],
)
def test_refusals(options, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'FILE').write_text('{"command_to_response_delay": null}')
    with pytest.raises(SystemExit) as end:
        main(f'linearize {options} --out out'.split())
    assert end.value.code == 2
    assert said in capsys.readouterr().err


def test_a_scenario_without_delay_says_nothing_and_one_with_it_its_margins(approved):
    assert margin_notes(scenario_of(), ['gvc']) == []
    (note,) = margin_notes(scenario_of(actuators={'delay': 0.04, 'lag': 0.04}), ['gvc'])
    assert note.startswith('note: ')
    assert 'with a loop delay of 0.04 s and a lag of 0.04 s' in note
    fast = scenario_of(controllers={'gvc': LAWS['gvc'] | {'k_D': 20.0}})
    (warning,) = margin_notes(fast, ['gvc'], delay=0.04)
    assert warning.startswith('warning: ')
    assert 'below 6 dB and 45 deg' in warning
    approved.add([note, warning])


def test_a_loop_that_is_unstable_or_that_nobody_can_judge_is_named():
    fast = scenario_of(controllers={'gvc': LAWS['gvc'] | {'k_D': 80.0}})
    (warning,) = margin_notes(fast, ['gvc'], delay=0.04)
    assert warning.startswith(f'warning: {fast.path}: controllers.gvc: unstable with a loop delay')
    (note,) = margin_notes(fast, ['gvc'], delay=9.0)
    assert note == (
        f'note: {fast.path}: controllers.gvc: no margins: delay: expected 0 to 2 s, 100 steps, '
        'found 9'
    )
    behind = scenario_of(actuators={'thrusters': True, 'rotor_lag': 0.05})
    (note,) = margin_notes(behind, ['gvc'])
    assert 'a lag of 0 s beside that of the rotors' in note
    driven = scenario_of(controllers={'still': {'law': 'multisine'}}, excitation={})
    assert margin_notes(driven, ['still'], driver=True) == []
    with pytest.raises(ValueError, match=r'lag: expected 0 to 2 s, 100 steps, found -0\.1'):
        ControlLoop(fast, 'gvc', lag=-0.1)


def test_the_note_is_of_the_worse_of_rest_and_way(monkeypatch):
    """What cannot be held under way is left out, what cannot be held at rest has no margins."""
    scenario = scenario_of(actuators={'delay': 0.04}, setpoint={'surge': {'offset': 0.5}})
    loops = {'rest': (6.0, 50.0), 'way': (4.0, 60.0)}  # gain, degrees of phase

    def loop(setting, *_):
        name = 'way' if np.any(setting.nu0) else 'rest'
        if loops[name] is None:
            raise ArithmeticError('lost')
        return name

    def found(setting, name, *, delays):
        gain, phase = loops[name]
        one = margins.AxisMargins(gain=gain, reduction=0.1, phase=np.radians(phase))
        return (margins.AxisMargins(),) * 4 + (one, margins.AxisMargins())

    monkeypatch.setattr(ControlLoop, 'loop', loop)
    monkeypatch.setattr(ControlLoop, 'margins', found)
    monkeypatch.setattr(margins, 'stable', lambda loop: True)
    (note,) = margin_notes(scenario, ['gvc'])
    assert 'gain margin 12 dB (pitch), phase margin 50 deg (pitch)' in note
    assert note.startswith('note: ')
    loops['way'] = (4.0, 44.0)
    (note,) = margin_notes(scenario, ['gvc'])
    assert note.startswith('warning: ')
    loops['way'] = None
    (note,) = margin_notes(scenario, ['gvc'])
    assert 'gain margin 15.6 dB (pitch)' in note
    loops['rest'] = None
    assert margin_notes(scenario, ['gvc'])[0].endswith('controllers.gvc: no margins: lost')


def test_the_way_is_at_the_mean_of_the_set_point():
    """A whole period of a sine adds nothing to it."""
    sine = {'amplitude': 2.0, 'omega': 2.0 * np.pi / 5.0, 'phase': 0.3}
    setpoint = {'surge': {'offset': 0.5, 'terms': [sine]}, 'yaw': {'offset': -0.1}}
    found = margins._mean_setpoint(scenario_of(setpoint=setpoint, duration=5.0))
    assert_allclose(found, [0.5, 0.0, 0.0, 0.0, 0.0, -0.1], atol=2e-3)


def test_what_is_odd_about_a_scenario_is_said(capsys):
    warn(SimpleNamespace(warnings=('file: key: odd', 'two'), path='x', data={}), [])
    assert capsys.readouterr().err.splitlines() == ['warning: file: key: odd', 'warning: two']


def test_simulating_and_parameters_for_a_driver_warn(tmp_path, capsys):
    text = (
        'name: quick\nvehicle: bluerov2_heavy\nduration: 0.1\nstep: 0.02\nsetpoint: {}\n'
        'controllers: {gvc: {law: gvc, k_D: 20.0, k_I: 2.0, Lambda: 0.8, Gamma: 2.0}}\n'
    )
    path = tmp_path / 'quick.yaml'
    path.write_text(f'{text}actuators: {{delay: 0.06}}\n')
    main(['simulate', str(path), '--out', str(tmp_path / 'run'), '--no-report', '--hold', 'zoh'])
    assert 'with a loop delay of 0.06 s and a lag of 0 s: below 6 dB' in capsys.readouterr().err
    path.write_text(text)
    common = ['params', str(path), '--controller', 'gvc', '--no-plant']
    main(common[:-1])
    assert 'margin' not in capsys.readouterr().err
    main(common)
    assert 'note: ' in (said := capsys.readouterr().err)
    assert 'no delay is known, and no margins' in said
    main([*common, '--delay', '0.03'])
    assert 'below 6 dB and 45 deg' in capsys.readouterr().err


def test_what_a_genuine_autopilot_did_with_three_gains():
    """Heave with 25.5 ms from stamp to PWM and 20 ms more: 60 limit-cycled, 40 in between."""

    def holds(k_D, delay):
        law = {'law': 'gvc', 'k_D': k_D, 'k_I': 2.0, 'Lambda': 0.8, 'Gamma': 2.0}
        setting = ControlLoop(scenario_of(controllers={'gvc': law}), 'gvc', delay)
        return stable(setting.loop())

    assert [holds(k_D, 0.0255) for k_D in (20, 40, 60)] == [True, True, False]
    assert [holds(k_D, 0.0455) for k_D in (20, 40, 60)] == [True, False, False]


@pytest.mark.parametrize('late', [(None, None), (0.03, 0.15)])
def test_the_dive_of_the_example_keeps_the_margins_that_its_file_says(late):
    path = Path(__file__).parents[4] / 'examples' / 'bluerov2_mavlink' / 'dive.yaml'
    scenario = load_scenario(path)
    for nu0 in (np.zeros(6), [0.4, 0, 0.1, 0, 0, 0.2]):
        setting = ControlLoop(scenario, 'gvc', *late, nu0=nu0)
        loop = setting.loop()
        assert stable(loop)
        found = setting.margins(loop)
        assert all(one.kept for one in found)
        if late == (None, None):
            said = '14 dB and 48 deg'
            assert f'at least {said}' in Path(path).read_text()
            assert (
                min(20 * np.log10(min(one.gain, 1 / max(one.reduction, 1e-3))) for one in found)
                >= 14
            )
            assert min(np.degrees(one.phase) for one in found) >= 48
    (note,) = margin_notes(scenario, ['gvc'])
    assert note.startswith('note: ')
    controllers = {'gvc': scenario.controllers['gvc'] | {'k_D': [20, 20, 20, 2, 2, 2]}}
    before = replace(scenario, data=scenario.data | {'controllers': controllers})
    (warning,) = margin_notes(before, ['gvc'])
    assert warning.startswith('warning: ')


def test_the_dive_is_quiet_with_6_db_more_on_any_axis_and_real_thrusters():
    """Dead band, lag and a curve that is another one than was inverted: T200 at 15 V for 16 V."""
    scenario = load_scenario(Path(__file__).parents[4] / 'examples/bluerov2_mavlink/dive.yaml')
    real = {'thrusters': True, 'rotor_lag': 0.15, 'dead_band': [0.35, 0.4], 'voltage': 15.0}
    gains = scenario.controllers['gvc']

    def swing(k_D):
        data = scenario.data | {
            'controllers': {'gvc': gains | {'k_D': list(k_D)}},
            'actuators': {'delay': 0.04, **real},
            'duration': 60.0,
        }
        run = simulate(replace(scenario, data=data), 'gvc', hold='zoh')
        return (run.nu - run.nu_d)[1500:].std(axis=0), run.tau[1500:].std(axis=0)

    for factor in np.vstack([np.ones(6), 1 + np.eye(6)]):
        error, tau = swing(factor * gains['k_D'])
        assert error.max() < 0.002, factor
        assert tau.max() < 0.2, factor
    error, tau = swing([40, 40, 60, 4, 4, 4])
    assert error.max() > 0.05
    assert tau.max() > 20
