"""What the files that travel with a bag say of its run."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from auv_analysis import load_scenario
from auv_analysis.bag import attachments
from auv_analysis.bag.reading import BagContents
from auv_analysis.scenario.fault_words import marks_of
from auv_dynamics.files.errors import MARK, InputError

BAG = Path('dives/harbour/bag')
GAINS = {f'gains.{name}': [value] for name, value in
         (('k_D', 12.0), ('k_I', 1.0), ('Lambda', 0.8), ('Gamma', 60.0))}  # fmt: skip


def contents(**data: Any) -> BagContents:
    """A bag with these attachments, `name.yaml`."""
    texts = {f'{name}.yaml': yaml.safe_dump(value) for name, value in data.items()}
    return BagContents(attachments=texts)


def test_parameters_are_those_of_nodes_whatever_their_namespaces() -> None:
    told = {
        '/**/plant_node': {'ros__parameters': {'step': 0.01}},
        '/auv1/controller_node': {'ros__parameters': {'law': 'gvc'}},
        'recorder_node': {'ros__parameters': {}},
    }
    found = attachments.parameters_of(contents(params=told), BAG)
    assert found == {'plant_node': {'step': 0.01}, 'controller_node': {'law': 'gvc'},
                     'recorder_node': {}}  # fmt: skip
    nested = {'/sea': {'auv1': {'controller_node': {'ros__parameters': {'law': 'gvc'}}}},
              '/**/controller_node': {'ros__parameters': {'law': 'pid'}},
              'auv2': {'controller_node': {'ros__parameters': {'law': 'cl'}}}}  # fmt: skip
    for space, law in (('/sea/auv1', 'gvc'), ('/auv2', 'cl'), ('/auv3', 'pid')):
        bag = contents(params=nested)
        bag.namespace = space
        assert attachments.parameters_of(bag, BAG) == {'controller_node': {'law': law}}
    bag.recorder = '/auv1'  # whom the pattern is about
    assert attachments.parameters_of(bag, BAG) == {}
    assert attachments.parameters_of(BagContents(), BAG) == {}
    for wrong, key in (
        ({'plant_node': 7}, 'plant_node'), ({'plant_node': {'step': 0.01}}, 'plant_node'),
        ({'sea': {'a': {'ros__parameters': {}}, 'plant_node': 7}}, 'sea/plant_node'),
    ):  # fmt: skip
        with pytest.raises(InputError, match=f'params.yaml: {key}: expected a mapping with'):
            attachments.parameters_of(contents(params=wrong), BAG)


SECOND = 10**9


def told(law: str, k_D: float) -> tuple[str, str]:
    return law, json.dumps({'k_D': [k_D], 'k_I': [1.0], 'Lambda': [0.8], 'Gamma': [60.0]})


UNCHANGED = ('{}',)


@pytest.mark.parametrize(('laws', 'kept', 'note'), [
    ([told('gvc', 12.0)], ('gvc', 12.0), None),
    ([told('cl', 12.0)], ('cl', 12.0), 'law and gains are those that the controller says'),
    ([told('gvc', 50.0)], ('gvc', 50.0), 'law and gains are those that the controller says'),
    ([told('gvc', 12.0), told('gvc', 50.0)], ('unknown', None), 'gvc from 0 s, gvc from 4.5 s'),
    ([('gvc', '{')], ('gvc', 12.0), None), ([('gvc', '[1]')], ('gvc', 12.0), None),
])  # fmt: skip
def test_law_and_gains_are_those_that_the_controller_says(laws, kept, note) -> None:
    bag = contents(params={'controller_node': {
        'ros__parameters': {'law': 'gvc', 'ramp': 0.2, **GAINS, 'gains.k_P': None},
    }})  # fmt: skip
    bag.messages['/wrench'] = np.array([5, 6]) * SECOND, np.zeros((2, 6))
    times = SECOND, 9_500_000_000
    bag.laws = [(law + UNCHANGED, at) for law, at in zip(laws, times, strict=False)]
    own = attachments.parameters_of(bag, BAG)['controller_node']
    assert own['ramp'] == 0.2
    assert (own.get('law', 'unknown'), *own.get('gains.k_D', [None])) == kept
    assert len(bag.notes) == (note is not None)
    assert note is None or note in bag.notes[0]


@pytest.mark.parametrize(('changed', 'kept', 'note'), [
    (['{}', '{}'], 0.2, ''), (['{"ramp": 0.9}'], 0.9, ''), (['x'], 0.2, ''),
    (['{"ramp": 0.9}', '{"ramp": 0.1}'], 0.9, 'settings of the controller were changed while it'),
])  # fmt: skip
def test_settings_are_those_that_the_controller_says(changed, kept, note) -> None:
    bag = contents(params={'controller_node': {
        'ros__parameters': {'law': 'gvc', 'ramp': 0.2, **GAINS},
    }})  # fmt: skip
    bag.messages['/wrench'] = np.array([5, 6]) * SECOND, np.zeros((2, 6))
    bag.laws = [((*told('gvc', 12.0), text), k * SECOND) for k, text in enumerate(changed, start=5)]
    own = attachments.parameters_of(bag, BAG)['controller_node']
    assert (own['law'], own['ramp']) == ('gvc', kept)
    assert len(bag.notes) == bool(note)
    assert ' '.join(bag.notes).startswith(note)


def test_a_law_that_was_changed_before_the_first_wrench_was_never_in_charge() -> None:
    bag = contents(params={'controller_node': {'ros__parameters': {'law': 'gvc', **GAINS}}})
    bag.messages['/wrench'] = np.array([5, 6]) * SECOND, np.zeros((2, 6))
    course = [(told('cl', 1.0), 1), (told('gvc', 9.0), 3), (told('cl', 1.0), 5)]
    bag.laws = [(law + UNCHANGED, at * SECOND) for law, at in course]
    own = attachments.parameters_of(bag, BAG)['controller_node']
    assert (own['law'], own['gains.k_D']) == ('cl', [1.0])


def test_a_controller_whose_parameters_no_file_has_says_its_law_and_gains() -> None:
    for data in ({}, {'params': {'/**': {'ros__parameters': {'step': 0.01}}}}):
        bag = contents(**data)
        bag.laws = [(told('cl', 5.0) + UNCHANGED, SECOND)]
        own = attachments.parameters_of(bag, BAG)['controller_node']
        assert (own['law'], own['gains.k_D'], bag.notes) == ('cl', [5.0], [])


def test_a_control_period_is_a_positive_number() -> None:
    assert attachments.step_of({}, BAG) is None
    assert attachments.step_of({'plant_node': {}}, BAG) is None
    found = attachments.step_of({'plant_node': {'step': 1}}, BAG)
    assert (found, type(found)) == (1.0, float)
    for wrong in (0, -0.01, math.inf, math.nan, '0.01'):
        with pytest.raises(InputError, match='plant_node: step: expected a positive number'):
            attachments.step_of({'plant_node': {'step': wrong}}, BAG)


@pytest.mark.parametrize(('recorded', 'name'), [
    ('runs/dive 7/gvc', 'gvc'), ('runs/my law,(2)', 'my_law_2_'), ('runs/.-_+x-y', 'x-y'),
    ('x' * 101, 'x' * 100), ('.' + 'x' * 101, 'x' * 99), ('..', 'controller'), (None, 'bag'),
])  # fmt: skip
def test_a_controller_is_called_as_the_folder_it_was_recorded_into(recorded, name) -> None:
    parameters = {'recorder_node': {'bag': recorded} if recorded else {}}
    assert attachments.controller_name(parameters, BAG) == name
    with pytest.raises(InputError, match='recorder_node: bag: expected a folder, found 7'):
        attachments.controller_name({'recorder_node': {'bag': 7}}, BAG)


def test_a_law_has_the_gains_that_were_written_with_it() -> None:
    six = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    told = {'law': 'gvc', **GAINS, 'gains.k_D': six, 'ramp': 0.2}
    found = attachments.law_and_gains(told, BAG)
    assert found == ('gvc', {'k_D': six, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0})
    assert attachments.law_and_gains(GAINS, BAG) == ('unknown', {})
    assert attachments.law_and_gains({'law': 'a.b:My_law', **GAINS}, BAG) == ('a.b:My_law', {})
    (note,) = attachments.notes_on('a.b:My_law')
    assert note.startswith('gains of a.b:My_law not looked at')
    assert attachments.notes_on('gvc') == []
    for wrong in ({'law': 'a b:Law'}, {'law': 'gvc'}, {'law': 'gvc', **GAINS, 'gains.k_P': [1.0]}):
        with pytest.raises(InputError, match=r'params.yaml: controller_node: expected'):
            attachments.law_and_gains(wrong, BAG)


def test_a_vehicle_is_the_one_that_is_given_else_that_of_the_bag() -> None:
    bag = contents(vehicle=load_scenario('case1').vehicle_data)
    own = attachments.vehicle_of(bag, BAG, None)
    assert own.name == load_scenario('case1').vehicle_data['name']
    assert attachments.vehicle_of(bag, BAG, 'rexrov').name == 'rexrov' != own.name
    with pytest.raises(InputError, match=r'vehicle.yaml: expected an attachment, or --vehicle'):
        attachments.vehicle_of(BagContents(), BAG, None)


def test_faults_are_those_of_a_scenario_that_is_one() -> None:
    case = load_scenario('faults_bluerov2_heavy')
    vehicle = attachments.vehicle_of(contents(vehicle=case.vehicle_data), BAG, None)
    told = yaml.safe_load(case.attachments['scenario.yaml'])
    assert attachments.faults_of(told, vehicle) == marks_of(told['faults'], vehicle) != ()
    assert attachments.faults_of(None, vehicle) == ()
    assert attachments.faults_of(told | {'duration': 'long'}, vehicle) == ()


@pytest.mark.parametrize(('told', 'kind', 'signal', 'topic'), [
    ({'sensors': {}}, 'sensor_bias', 'measured', 'ground_truth/odom'),
    ({'actuators': {}}, 'wrench_loss', 'applied', 'wrench_applied'),
])  # fmt: skip
def test_what_counts_for_a_topic_that_is_missing_is_said(told, kind, signal, topic) -> None:
    by_scenario = attachments.unrecorded(told, set(), {'odom'})
    by_fault = attachments.unrecorded(None, {kind}, {'odom'})
    assert by_scenario[signal].partition(':')[0] == topic
    assert by_fault == by_scenario
    assert attachments.unrecorded(told, {kind}, {topic}) == {}
    assert attachments.unrecorded({}, set(), {'odom'}) == {}
    (unknown,) = attachments.unrecorded(None, set(), {'disturbance'}).items()
    assert unknown[0] == 'disturbance_estimate'
    assert unknown[1].endswith('f and its error are unknown')


def test_kinds_of_disturbances_are_known_where_a_scenario_is() -> None:
    assert attachments.kinds_of(None) is None
    for told, kinds in (
        ({}, []), ({'disturbance': {'kind': 'harmonic'}}, ['harmonic']), ({'disturbance': []}, []),
        ({'disturbance': [{'kind': 'step'}, 'odd', {'offset': 1}, {'kind': 'noise'}]},
         ['noise', 'step']),
    ):  # fmt: skip
        assert attachments.kinds_of(told) == {*kinds}


def test_a_scenario_has_its_own_name_else_that_of_the_folder_around() -> None:
    assert attachments.scenario_name(None, BAG) == 'harbour'
    assert attachments.scenario_name(None, Path('/$a$\udcff/bag')) == f'_a_{MARK}'
    for name in ('case1', 'a.b_c-d+1', 'x' * 100):
        assert attachments.scenario_name({'name': name}, BAG) == name
    for name in ('_x', 'x' * 101, 'a b', None, 7):
        with pytest.raises(InputError, match=r'scenario.yaml: name: expected a word'):
            attachments.scenario_name({'name': name}, BAG)
