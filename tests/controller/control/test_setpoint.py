"""Set-points from a CSV file: interpolation, slopes at the knots, and files that are refused."""

import re

import numpy as np
import pytest
from helpers.strategies import QUICK
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics import InputError
from auv_gvc_controller.control.setpoint import (
    COLUMNS,
    SetpointTable,
    load_table,
    make_setpoint,
)

HEADER = 't,surge,sway,heave,roll,pitch,yaw'
T = np.array([0.0, 0.5, 0.6, 2.0])
NU_D = np.array([[0, 0, 0, 0, 0, 0], [1, -1, 2, 0.1, -0.1, 0.2],
                 [1, -1, 3, 0.1, -0.1, 0.2], [0, 4, 3, 0.3, 0.2, -0.5]])  # fmt: skip
TABLE = SetpointTable(T, NU_D)


def rows(t=T, nu_d=NU_D) -> str:
    lines = [','.join(map(repr, [float(a), *map(float, b)])) for a, b in zip(t, nu_d, strict=True)]
    return '\n'.join([HEADER, *lines, ''])


def written(tmp_path, text):
    path = tmp_path / 'nu_d.csv'
    path.write_text(text, encoding='utf-8')
    return path


@QUICK
@given(st.floats(0.0, 2.0))
def test_linear_between_the_rows(t):
    expected = [np.interp(t, T, column) for column in NU_D.T]
    assert_allclose(TABLE.value(t), expected, atol=1e-12)
    assert_allclose(TABLE.value(np.array([t, t]))[1], expected, atol=1e-12)


@pytest.mark.parametrize('k', range(3))
def test_slope_at_a_knot_is_that_of_the_segment_that_begins_there(k):
    begins = (NU_D[k + 1] - NU_D[k]) / (T[k + 1] - T[k])
    ended = (NU_D[k] - NU_D[k - 1]) / (T[k] - T[k - 1]) if k else None
    assert_allclose(TABLE.derivative(T[k]), begins, rtol=1e-14)
    assert ended is None or np.abs(begins - ended).max() > 0.1
    middle = (T[k] + T[k + 1]) / 2
    assert_allclose(TABLE.derivative(middle), begins, rtol=1e-14)
    assert_array_equal(TABLE.value(T[k]), NU_D[k])


def test_a_hair_of_rounding_does_not_choose_another_segment():
    t = np.arange(31) * 0.1
    table = SetpointTable(t, np.stack([np.arange(31.0) ** 2 * 0.1] * 6, axis=1))
    for k in range(30):
        grid = 0.01 * (10 * k)  # the same moment as the run's grid has it
        assert_allclose(table.derivative(grid), 2 * k + 1, rtol=1e-9)
        assert_allclose(table.derivative(np.nextafter(t[k], -1)), 2 * k + 1, rtol=1e-9)


def test_past_the_end_the_last_value_is_held():
    assert_allclose(TABLE.value(2.5), NU_D[-1], rtol=1e-15)
    assert_array_equal(TABLE.derivative(2.5), np.zeros(6))
    assert TABLE.value(np.zeros((3, 6))).shape == (3, 6, 6)
    assert TABLE.derivative(np.zeros((3, 6))).shape == (3, 6, 6)


def test_without_a_duration_it_goes_to_zero_over_a_ramp_after_its_file(tmp_path):
    table = load_table(written(tmp_path, rows()), 0.0)
    t = np.arange(0.0, 60.0, 0.01)
    nu_d, slope = table.value(t), table.derivative(t)
    assert_array_equal(table.value(2.0), NU_D[-1])
    after = t[:-1] >= 2.0
    assert np.abs(np.diff(nu_d, axis=0)[after]).max() == pytest.approx(0.002), '0.2 m/s2'
    assert_allclose(np.diff(nu_d, axis=0)[after] / 0.01, slope[:-1][after], atol=1e-9)
    assert not nu_d[-1].any()
    assert not slope[-1].any()


def test_a_file_gives_the_same_as_its_numbers(tmp_path):
    path = written(tmp_path, rows())
    t = np.linspace(0.0, 2.0, 81)
    for table in (load_table(path, 2.0), make_setpoint({'file': str(path)}, 2.0)):
        assert_array_equal(table.value(t), TABLE.value(t))
        assert_array_equal(table.derivative(t), TABLE.derivative(t))


def test_blanks_empty_lines_and_early_starts_are_read(tmp_path):
    text = rows(T - 0.5).replace(HEADER, HEADER.replace(',', ' , ')).replace('\n', '\n\n')
    table = load_table(written(tmp_path, text), 1.5)
    assert_array_equal(table.value(0.0), NU_D[1])


def test_without_a_file_it_is_a_harmonic():
    setpoint = make_setpoint({'yaw': {'offset': 0.3}}, 5.0)
    assert_array_equal(setpoint.value(1.0), [0, 0, 0, 0, 0, 0.3])


def test_the_columns_are_those_of_the_contract():
    assert ','.join(COLUMNS) == HEADER


@pytest.mark.parametrize(
    ('text', 'line'),
    [
        ('', f'line 1: expected the columns {HEADER}, found nothing'),
        ('t,u,v,w,p,q,r\n', f'line 1: expected the columns {HEADER}, found t,u,v,w,p,q,r'),
        (rows()[len(HEADER) + 1 :], 'line 1: expected the columns'),
        (HEADER, 't: expected at least two rows, found 0'),
        (rows(T[:1], NU_D[:1]), 't: expected at least two rows, found 1'),
        (rows().replace('0.6,', '0.5,', 1), 'line 4: expected a time later than the line before'),
        (rows().replace('0.6,', '0.4,', 1),
         'line 4: expected a time later than the line before, found 0.4'),
        (rows().replace('-0.1', 'slow', 1), 'line 3: expected 7 finite numbers, found 0.5,'),
        (rows().replace('-0.1', 'nan', 1), 'line 3: expected 7 finite numbers'),
        (rows().replace('-0.1', '1e150', 1), 'line 3: expected 7 finite numbers, at most 1e+100'),
        (rows().replace('-0.1', '1_0', 1), 'line 3: expected 7 finite numbers, found'),
        (rows().replace('-0.1', 'inf', 1), 'line 3: expected 7 finite numbers'),
        (rows().replace(',0.2\n', '\n', 1), 'line 3: expected 7 finite numbers'),
        (rows().replace(',0.2\n', ',0.2,9\n', 1), 'line 3: expected 7 finite numbers'),
        (HEADER + '\n' + 'x' * 200_000,
         'line 2: expected 7 finite numbers, found a cell of more than'),
        (rows(T + 0.01), 't: expected 0 to 2 s covered, found 0.01 to 2.01 s'),
        (rows(T * 0.9), 't: expected 0 to 2 s covered, found 0 to 1.8 s'),
    ],
)  # fmt: skip
def test_files_that_are_refused(tmp_path, text, line):
    path = written(tmp_path, text)
    with pytest.raises(InputError, match='^' + re.escape(f'{path}: {line}')):
        load_table(path, 2.0)


def test_lines_are_counted_as_an_editor_counts_them(tmp_path):
    text = rows().replace('\n', '\n\n').replace('-0.1', 'slow', 1)
    bad = next(i for i, line in enumerate(text.splitlines(), start=1) if 'slow' in line)
    with pytest.raises(InputError, match=f'line {bad}: expected 7 finite numbers'):
        load_table(written(tmp_path, text), 2.0)


def test_a_missing_file(tmp_path):
    with pytest.raises(
        InputError, match=r'none\.csv: expected a CSV set-point file, found no such'
    ):
        load_table(tmp_path / 'none.csv', 2.0)
