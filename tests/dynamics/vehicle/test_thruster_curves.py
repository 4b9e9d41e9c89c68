"""Thruster curves: published thrusts, dead bands, inverses, and tables that are none."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.thruster_curves import ThrusterCurve, load_curve, shipped_curves

KGF = 9.80665


def test_published_thrusts_at_full_throttle():
    # kgf, https://bluerobotics.com/store/thrusters/t100-t200-thrusters/t200-thruster-r2-rp/
    for name, forward, reverse in (
        ('t200_12v', 3.71, 2.90), ('t200_16v', 5.25, 4.07), ('t200_20v', 6.7, 5.05),
    ):  # fmt: skip
        ends = load_curve(name).thrust(np.array([1100, 1900]))
        assert_allclose(ends / KGF, [-reverse, forward], atol=0.03)


@pytest.mark.parametrize('name', shipped_curves())
def test_shipped_curves_rise_from_a_dead_band(name):
    curve = load_curve(name)
    assert np.all(np.diff(curve.thrusts) >= 0.0)
    low, high = curve.dead_band
    assert 1440 < low < 1500 < high < 1560
    assert_array_equal(curve.thrust(np.linspace(low, high, 9)), 0.0)
    assert curve.thrust(np.array(high + 4)) > 0.0 > curve.thrust(np.array(low - 4))


def test_thrust_rises_with_the_voltage():
    at_90_percent = [
        load_curve(f't200_{v}v').thrust(np.array([1140, 1860])) for v in range(10, 21, 2)
    ]
    assert np.all(np.diff(np.abs(at_90_percent), axis=0) > 1.0)


@pytest.mark.parametrize('mirrored', [False, True])
@pytest.mark.parametrize('name', shipped_curves())
def test_command_is_the_inverse_of_thrust(name, mirrored):
    curve = load_curve(name)
    u = np.linspace(curve.thrusts[0], curve.thrusts[-1], 1001)
    assert_allclose(curve.thrust(curve.command(u, mirrored), mirrored), u, atol=1e-9)
    assert curve.thrust(curve.command(0.0, mirrored), mirrored) == 0.0


def test_a_reversed_thruster_keeps_its_stronger_side():
    curve = load_curve('t200_16v')
    assert_array_equal(curve.thrust(np.array([1100, 1900]), True), curve.thrusts[[-1, 0]])


def test_no_pulse_is_no_thrust_and_more_than_the_table_is_its_end():
    curve = load_curve('t200_16v')
    assert_array_equal(curve.thrust(np.array([0, 1000, 2000])), [0.0, *curve.thrusts[[0, -1]]])
    assert_array_equal(curve.command(np.array([-99.0, 99.0])), [1100, 1900])


def written(folder, text):
    path = folder / 'curve.csv'
    path.write_text(text)
    return path


def test_curve_of_a_file_in_percent(tmp_path, monkeypatch):
    written(tmp_path, '# bench, 12 V\npercent, thrust_n\n-100,-20\n\n-10,0\n8,0\n100,30\n')
    curve = load_curve('curve.csv', tmp_path)
    assert curve.unit == 'percent'
    assert_allclose(curve.thrust(np.array([-55, 0, 54])), [-10, 0, 15])
    assert_allclose(curve.command(np.array([-10, 0, 15])), [-55, 0, 54])
    assert_allclose(curve.thrust(np.array([-55, 54]), True), curve.thrust(np.array([55, -54])))
    monkeypatch.chdir(tmp_path)
    assert load_curve('curve.csv', tmp_path / 'elsewhere').unit == 'percent'


def test_a_measured_curve_may_fall_by_its_noise_only(tmp_path):
    table = 'command,thrust_kgf\n-1,-4\n-0.9,-4.05\n0,0\n1,5\n'
    curve = load_curve(written(tmp_path, table))
    assert_allclose(curve.thrusts, KGF * np.array([-4.05, -4, 0, 5]))
    with pytest.raises(InputError, match='thrust that rises with the command'):
        load_curve(written(tmp_path, table.replace('-4.05', '-4.5')))


def test_a_curve_without_a_dead_band_crosses_zero_at_its_command():
    curve = ThrusterCurve('x', 'command', np.array([-1.0, 1.0]), np.array([-1.0, 3.0]))
    assert curve.dead_band == (-0.5, -0.5)
    assert curve.thrust(0.0) == 1.0  # no pulse is of pulse widths alone
    assert_array_equal(curve.thrust(np.array([1.0, -0.5]), True), [-1.0, 2.0])
    assert_allclose(curve.command(np.array([-0.5, 0.0, 1.0])), [-0.75, -0.5, 0.0])


@pytest.mark.parametrize('way', [1.0, -1.0])
def test_a_thruster_that_pushes_one_way_only_has_a_curve(tmp_path, way):
    rows = sorted([[0.0, 0.0], [0.2 * way, 0.0], [1.0 * way, 4.0 * way]])
    table = '\n'.join(f'{command},{thrust}' for command, thrust in rows)
    curve = load_curve(written(tmp_path, f'command,thrust_n\n{table}\n'))
    assert_allclose(curve.command(way * np.array([0.0, 1.0, 2.0])), way * np.array([0.0, 0.4, 0.6]))


@pytest.mark.parametrize(
    ('text', 'expected'),
    [
        ('', 'first line: expected one column pwm_us or percent or command, found nothing'),
        ('pwm_us,percent,thrust_n\n', 'one column pwm_us or percent'),
        ('pwm_us,kgf\n1100,2\n', 'one column thrust_n or thrust_kgf, found pwm_us,kgf'),
        ('pwm_us,thrust_n\n1100,2\nx,3\n', 'line 3: expected two numbers, found x,3'),
        ('pwm_us,thrust_n\n1100\n', 'line 2: expected two numbers'),
        ('pwm_us,thrust_n\n1100,1\n', 'two and more rows'),
        ('pwm_us,thrust_n\n1100,-1\n1500,nan\n', 'finite numbers'),
        (
            'pwm_us,thrust_n\n1100,-1\n1500,0\n1500,2\n',
            'commands that rise, found 1500 after 1500',
        ),
        pytest.param(f'pwm_us,thrust_n\n{1:0200000},2\n', 'a CSV table', id='a huge cell'),
        (
            'pwm_us,thrust_n\n1100,2\n1900,-2\n',
            r'from astern or zero to ahead, found \[2.0, -2.0\]',
        ),
        ('pwm_us,thrust_n\n1100,0\n1900,0\n', 'from astern or zero to ahead'),
        ('pwm_us,thrust_n\n1100,1\n1900,2\n', 'from astern or zero to ahead'),
        ('pwm_us,thrust_n\n1100,-2\n1900,-1\n', 'from astern or zero to ahead'),
    ],
)
def test_tables_that_are_no_curve(tmp_path, text, expected):
    with pytest.raises(InputError, match=expected):
        load_curve(written(tmp_path, text))


def test_an_unknown_curve_is_answered_by_the_nearest():
    with pytest.raises(
        InputError, match=r'curve: .*one of .*\(nearest: t200_16v\).* found t200_16V'
    ):
        load_curve('t200_16V')
    with pytest.raises(InputError, match='no such file'):
        load_curve('missing.csv')
