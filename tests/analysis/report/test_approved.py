"""The comparison with approved texts: words exactly, numbers nearly, and what it says of others."""

from pathlib import Path

import pytest
from helpers import approved, shown
from matplotlib.figure import Figure


@pytest.mark.parametrize(
    ('one', 'other', 'same'),
    [
        ('RMS 0.500 m/s', 'RMS 0.5001 m/s', True),
        ('RMS 0.500 m/s', 'RMS 0.5004 m/s', False),  # as near, with more digits
        ('RMS 0.872 m/s', 'RMS 0.8724 m/s', False),
        ('RMS 0.3 m/s', 'RMS 0.2999 m/s', True),  # without trailing zeros
        ('RMS 9.996 m/s', 'RMS 10.00 m/s', True),
        ('RMS 99.96 m/s', 'RMS 100.04 m/s', True),
        ('RMS 0.500 m/s', 'RMS 0.502 m/s', False),
        ('RMS 0.500 m/s', 'RMS 0.500 m', False),
        ('RMS 0.500 m/s', 'max 0.500 m/s', False),
        ('−1.20 N', '1.20 N', False),
        ('2 of 3', '3 of 2', False),
        ('by 12\u202f345 N', 'by 12\u202f350 N', True),
        ('by 12\u202f345 N', 'by 12\u202f445 N', False),
        ('3.24·10⁻⁵', '3.243·10⁻⁵', False),
        ('3.240·10⁻⁵', '3.243·10⁻⁵', True),
        ('3.2·10⁻⁵', '3.2·10⁻⁴', False),
        ('4.1·10⁻¹⁷ J', '0 J', True),  # rounding noise
        ('1.234e+05', '1.235e+05', True),
        ('#0072b2 T1', '#0073b2 T1', False),
        ('case1', 'case2', False),
    ],
)
def test_words_are_the_same_and_numbers_near(one: str, other: str, same: bool) -> None:
    assert approved.alike(one, other) is approved.alike(other, one) is same


def test_a_difference_is_shown_and_approved_on_request(tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / 'approved' / 'page.txt'
    monkeypatch.setattr(approved, 'APPROVE', True)
    approved.check(path, 'b', ['first 1', 'second 2'])
    approved.check(path, 'a', [f'in {tmp_path}/out/report.html'])
    monkeypatch.setattr(approved, 'APPROVE', False)
    assert path.read_text() == '=== a\nin <folder>/report.html\n=== b\nfirst 1\nsecond 2\n'
    approved.check(path, 'b', ['first 1', 'second 2'])
    approved.check(path, 'none', [])
    for lines in (['first 1', 'second 3'], ['first 1'], ['second 2', 'first 1'], []):
        with pytest.raises(pytest.fail.Exception, match='AUV_GVC_APPROVE=1'):
            approved.check(path, 'b', lines)
    with pytest.raises(pytest.fail.Exception, match='- \n\\+ new'):
        approved.check(path, 'unknown', ['new'])


def test_a_text_that_cannot_be_set_is_no_figure() -> None:
    figure = Figure()
    figure.subplots().set_xlabel(r'$\xi_1$')
    assert list(shown.figure_lines(figure))
    figure.text(0.5, 0.5, r'$\frac{1$')
    with pytest.raises(ValueError, match='frac'):
        list(shown.figure_lines(figure))
