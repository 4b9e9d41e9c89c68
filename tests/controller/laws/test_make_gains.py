"""Gains and laws by name: forms of a gain, a law of one's own, and what is refused."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from auv_gvc_controller.laws.cl import CL
from auv_gvc_controller.laws.gvc import GVC
from auv_gvc_controller.laws.law import law_class, make_gains

PAPER = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
OWN = """
from typing import NamedTuple


class Proportional(NamedTuple):
    K: object
    STATES = 0

    @staticmethod
    def wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return nu_d, nu

    @staticmethod
    def state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return ()


class Half(NamedTuple):
    K: object


class Plain:
    STATES = 0
    wrench = state_rate = print


class Odd(Plain):
    _fields = 'K'


class Bare(Plain):
    _fields = ('K',)


class Strict(Proportional):
    def check(gains):
        if gains.K[0] > 9.0:
            raise ValueError('K: expected 9 at most, found more')
        if gains.K[0] < 0.0:
            raise ValueError('the wrong sign')
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    (tmp_path / 'own_laws.py').write_text(OWN, encoding='utf-8')
    (tmp_path / 'broken_laws.py').write_text('import math\nmath.missing\n', encoding='utf-8')
    monkeypatch.syspath_prepend(tmp_path)


def test_every_form_of_a_gain():
    six, dense = [1.0, 2, 3, 4, 5, 6], np.arange(36.0)
    forms = {
        'k_D': 12,
        'k_I': six,
        'Lambda': dense.reshape(6, 6).tolist(),
        'Gamma': dense.tolist(),
    }
    gains = make_gains('gvc', forms)
    assert type(gains) is GVC
    assert_array_equal(gains.k_D, 12.0 * np.eye(6).ravel())
    assert_array_equal(gains.k_I, np.diag(six).ravel())
    assert_array_equal(gains.Lambda, dense)
    assert_array_equal(gains.Gamma, dense)
    assert_array_equal(make_gains('cl', forms | {'k_D': [3.0]}).k_D, 3.0 * np.eye(6).ravel())
    assert type(make_gains('cl', forms)) is CL


@pytest.mark.parametrize(
    ('values', 'line'),
    [
        ({}, '^k_D: expected a number, 6 numbers or a 6x6 matrix, found nothing$'),
        (PAPER | {'k_P': 1.0}, '^k_P: expected one of k_D, k_I, Lambda, Gamma .*found an unknown'),
        (PAPER | {'k_d': 1.0, 'gamma': 1.0}, '^k_d: .*nearest: k_D'),
        (PAPER | {'k_I': [1.0, 2.0]}, r'^k_I: expected 1, 6 or 36 numbers, found shape \(2,\)'),
        (PAPER | {'Lambda': float('nan')}, '^Lambda: expected finite numbers, found nan'),
        (PAPER | {'k_I': [1.0] * 5 + [float('inf')]}, '^k_I: expected finite numbers, found'),
        (PAPER | {'Gamma': [[1.0] * 6] * 5}, r'^Gamma: expected .* found shape \(5, 6\)'),
        (PAPER | {'Gamma': 'much'}, '^Gamma: '),
    ],
)
def test_gains_that_are_refused(values, line):
    with pytest.raises(ValueError, match=line):
        make_gains('gvc', values)


@pytest.mark.usefixtures('own')
def test_a_law_of_ones_own():
    gains = make_gains('own_laws:Proportional', {'K': 2.0})
    assert_array_equal(gains.K, 2.0 * np.eye(6).ravel())
    assert law_class('own_laws:Proportional') is type(gains)


@pytest.mark.usefixtures('own')
@pytest.mark.parametrize(
    ('name', 'line'),
    [
        ('pid2', "^expected gvc, cl.* or module:Class .*found 'pid2'$"),
        ('own_laws:', "^expected .* found 'own_laws:'$"),
        (':Half', "^expected .* found ':Half'$"),
        ('no_such_module:Law', '^expected .* found .*no_such_module'),
        ('own_laws:Missing', '^expected .* found no Missing in own_laws$'),
        ('own_laws:Half', "found 'own_laws:Half' without wrench, state_rate, STATES$"),
        ('own_laws:Plain', "found 'own_laws:Plain' without _fields$"),
        ('own_laws:Odd', "found 'own_laws:Odd' without a tuple of _fields$"),
        ('broken_laws:Law', r"found 'broken_laws:Law' \(AttributeError: .*'missing'\)$"),
    ],
)
def test_laws_that_are_refused(name, line):
    with pytest.raises(ValueError, match=line):
        law_class(name)


@pytest.mark.usefixtures('own')
@pytest.mark.parametrize(
    ('law', 'K', 'line'),
    [
        ('Bare', 1.0, '^expected a named tuple of gains, found .own_laws:Bare. .TypeError'),
        ('Strict', 10.0, '^K: expected 9 at most, found more$'),
        ('Strict', -1.0, '^expected gains that own_laws:Strict accepts, found the wrong sign$'),
    ],
)
def test_gains_that_a_law_of_ones_own_refuses(law, K, line):
    with pytest.raises(ValueError, match=line):
        make_gains(f'own_laws:{law}', {'K': K})
    assert make_gains('own_laws:Strict', {'K': 2.0}).K[0] == 2.0
