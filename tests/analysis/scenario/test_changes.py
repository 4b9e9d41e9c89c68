"""Values addressed by dotted paths: read, replaced without touching the original, refused."""

import copy

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from auv_analysis import load_scenario
from auv_analysis.scenario.changes import (
    changed,
    changed_scenario,
    check_paths,
    split,
)
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import dotted

KEYS = st.from_regex(r'[A-Za-z_][A-Za-z0-9_+-]*', fullmatch=True)
INDICES = st.integers(0, 99)


@given(KEYS, st.lists(KEYS | INDICES, max_size=6))
def test_split_undoes_what_errors_write(first: str, rest: list) -> None:
    assert split(dotted([first, *rest])) == (first, *rest)


def test_key_with_a_dot_stands_in_quotes() -> None:
    assert split("controllers.'gvc.2'.k_D[0]") == ('controllers', 'gvc.2', 'k_D', 0)


@pytest.mark.parametrize(
    'path',
    ['', '.', 'a.', '.a', 'a..b', '[0]', 'a[', 'a[-1]', 'a[x]', 'a[01]', 'a b', 'a.[0]',
     "a.'b", 'a[0]b', "''"],
)  # fmt: skip
def test_what_is_no_path_is_refused(path: str) -> None:
    with pytest.raises(InputError, match='expected keys and '):
        split(path)


def test_changed_replaces_one_value_and_shares_the_rest() -> None:
    data = {'a': {'b': [1, {'c': 2}], 'd': {}}, 'e': {}}
    before = copy.deepcopy(data)
    new = changed(data, 'a.b[1].c', np.float64(7))
    assert new == {'a': {'b': [1, {'c': 7.0}], 'd': {}}, 'e': {}}
    assert type(new['a']['b'][1]['c']) is float
    assert data == before
    assert new['e'] is data['e']
    assert new['a']['d'] is data['a']['d']


def test_changed_adds_what_is_absent() -> None:
    assert changed({}, 'initial.nu', np.arange(2)) == {'initial': {'nu': [0, 1]}}


@pytest.mark.parametrize(
    ('path', 'words'),
    {
        'a.b[2]': 'a.b.2.: expected an index below 2, found 2',
        'a.b.c': r'a.b: expected \[0\] or another index before c',
        'a[0]': r'a: expected a list that has \[0\]',
        'e.f': 'e: expected a mapping that has f, found 1.5',
        'g[0]': 'expected a list that has',
    }.items(),
)
def test_changed_refuses_a_way_that_is_not_there(path: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        changed({'a': {'b': [1, 2]}, 'e': 1.5}, path, 0)


CASE1 = load_scenario('case1')
REACHED = [
    'controllers.gvc.k_D', 'controllers.cl.Gamma', 'vehicle', 'vehicle.rigid_body.mass',
    'vehicle.damping.linear[0]', 'vehicle.inertia_matrix[3][5]', 'vehicle.added_mass',
    'setpoint.surge.terms[0].amplitude', 'setpoint.surge.terms[0].phase', 'setpoint.sway.offset',
    'initial.nu[2]', 'initial.eta', 'disturbance[0].exponent_sign', 'disturbance[0].scale',
    'duration', 'integrator', 'actuators.limit', 'sensors.drop_out',
]  # fmt: skip
UNREACHED = {  # path -> what its one line says
    'controllers.gcv.k_D': r'controllers.gcv: expected one of gvc, cl \(nearest: gvc\), found gcv',
    'controllers.gvc.kD': 'controllers.gvc.kD: expected one of .*nearest: k_D',
    'controllers.gvc.k_D[0]': r'controllers.gvc.k_D: expected a list that has \[0\], found 12.0',
    'vehicle.rigid_body.masse': 'herman2018.yaml: rigid_body.masse: .*nearest: mass',
    'vehicle.damping.linear[6]': 'damping.linear.6.: expected an index below 6',
    'vehicle.added_mass[0]': 'added_mass: expected a list',
    'setpoint.surge.terms[1].amplitude': 'setpoint.surge.terms.1.: expected an index below 1',
    'setpoint.north.offset': 'setpoint.north: expected one of .*, found north',
    'setpoint.surge.ofset': 'setpoint.surge.ofset: .*nearest: offset',
    'setpoint.sway.offset.x': 'setpoint.sway.offset.x: expected a single value, found x',
    'disturbance[1].mass': 'disturbance.1.: expected an index below 1',
    'disturbance[0].mass': 'disturbance.0..mass: expected one of kind, exponent_sign, scale',
    'disturbance.scale': r'disturbance: expected \[0\] or another index before scale',
    'duration.s': 'duration: expected a mapping that has s, found 30.0',
    'durations': 'case1.yaml: durations: .*nearest: duration',
}


@pytest.mark.parametrize('path', REACHED)
def test_path_that_the_files_know_is_taken(path: str) -> None:
    check_paths(CASE1, [path])


@pytest.mark.parametrize('path', UNREACHED)
def test_unknown_path_is_refused_with_the_nearest(path: str) -> None:
    with pytest.raises(InputError, match=UNREACHED[path]):
        check_paths(CASE1, [path])


def test_changed_scenario_has_the_values_and_leaves_the_first_as_it_was() -> None:
    before = copy.deepcopy((CASE1.data, CASE1.vehicle_data))
    values = {'controllers.gvc.k_D': 7, 'vehicle.damping.linear[0]': 71.0, 'duration': 2,
              'setpoint.sway.offset': 0.25}  # fmt: skip
    new = changed_scenario(CASE1, values)
    assert new.gains('gvc').k_D[0] == 7.0
    assert new.vehicle.D_linear[0, 0] == 71.0
    assert new.steps == 200
    assert new.setpoint.value(0.0)[1] == 0.25
    assert (CASE1.data, CASE1.vehicle_data) == before
    given = {'nu': [1, 0, 0, 0, 0, 0]}
    assert changed_scenario(CASE1, {'initial': given}).initial[0].tolist() == [0.0] * 6
    assert given == {'nu': [1, 0, 0, 0, 0, 0]}


def test_another_vehicle_is_put_in_place_before_its_values_are() -> None:
    values = {'vehicle.rigid_body.mass': 1900.0, 'vehicle': 'rexrov'}
    by_name = changed_scenario(CASE1, values)
    contents = load_scenario('case1_rexrov').vehicle_data
    by_contents = changed_scenario(CASE1, {**values, 'vehicle': contents})
    for new in (by_name, by_contents):
        assert (new.vehicle.name, new.vehicle_data['rigid_body']['mass']) == ('rexrov', 1900.0)
    assert by_name.shipped_vehicle == 'rexrov'
    assert CASE1.vehicle.name == 'herman2018'


@pytest.mark.parametrize(
    ('values', 'words'),
    [
        ({'controllers.gvc.k_D': 'much'}, 'case1.yaml: controllers.gvc.k_D: expected a number'),
        ({'controllers.gvc.k_P': 1.0}, 'case1.yaml: controllers.gvc.k_P: expected'),
        ({'vehicle.rigid_body.mass': -1.0}, 'herman2018.yaml: rigid_body.mass: expected'),
        ({'vehicle': 'nautilus'}, 'case1.yaml: vehicle: expected'),
        ({'duration': 0.015}, 'duration: expected a multiple of step'),
        ({'initial.nu[0]': np.nan}, 'initial.nu.0.: expected a finite number'),
        ({'setpoint': 3}, 'setpoint: expected'),
    ],
)
def test_values_that_make_no_scenario_are_refused(values: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        changed_scenario(CASE1, values)


def test_setpoint_file_may_be_another_one(tmp_path) -> None:
    for name, surge in (('slow', 0.1), ('fast', 0.9)):
        rows = (f'{t},{surge},0,0,0,0,0' for t in (0, 60))
        text = '\n'.join(['t,surge,sway,heave,roll,pitch,yaw', *rows])
        (tmp_path / f'{name}.csv').write_text(text)
    path = tmp_path / 'scenario.yaml'
    path.write_text(
        'name: x\nvehicle: herman2018\nduration: 1\nstep: 0.01\nsetpoint: {file: slow.csv}\n'
        'controllers: {gvc: {law: gvc, k_D: 1, k_I: 1, Lambda: 1, Gamma: 1}}\n'
    )
    slow = load_scenario(path)
    fast = changed_scenario(slow, {'setpoint.file': 'fast.csv', 'duration': 2.0})
    assert fast.setpoint.value(1.0)[0] == 0.9
    assert fast.inputs[-1] == (tmp_path / 'fast.csv').resolve(), 'no result may replace it'
    assert changed_scenario(slow, {'duration': 2.0}).setpoint.value(1.0)[0] == 0.1
    (tmp_path / 'slow.csv').unlink()  # its text has been read: workers elsewhere have no file
    assert changed_scenario(slow, {'duration': 2.0}).setpoint.value(1.0)[0] == 0.1
