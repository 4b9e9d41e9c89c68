"""Lists of an axis as ROS parameters: each may be the one that is too short or too long."""

import pytest

from auv_dynamics.plant.signals import harmonic_spec

GOOD = {'amplitude': [1.0, 2.0], 'omega': [3.0, 4.0], 'phase': [0.5, 0.6]}


@pytest.mark.parametrize('dof', ['surge', 'sway', 'heave', 'roll', 'pitch', 'yaw'])
@pytest.mark.parametrize('key', GOOD)
@pytest.mark.parametrize('values', [[1.0], [1.0, 2.0, 3.0]])
def test_a_list_of_another_length_is_refused(dof, key, values):
    columns = {f'{dof}.{name}': entry for name, entry in (GOOD | {key: values}).items()}
    with pytest.raises(ValueError, match=f'{dof}: amplitude, omega and phase of equal length'):
        harmonic_spec(columns)


@pytest.mark.parametrize('missing', ['amplitude', 'omega'])
def test_amplitude_and_omega_belong_together(missing):
    columns = {f'yaw.{name}': entry for name, entry in GOOD.items() if name != missing}
    with pytest.raises(ValueError, match='yaw: '):
        harmonic_spec(columns)


def test_terms_keep_their_order():
    columns = {f'yaw.{name}': entry for name, entry in GOOD.items()} | {'yaw.offset': 9.0}
    terms = [
        {'amplitude': 1.0, 'omega': 3.0, 'phase': 0.5},
        {'amplitude': 2.0, 'omega': 4.0, 'phase': 0.6},
    ]
    found = harmonic_spec(columns)
    assert found['yaw'] == {'offset': 9.0, 'terms': terms}
    assert found['surge'] == {'offset': 0.0, 'terms': []}
