"""Faults in a scenario file: what is refused, in one line with file, key, expected and found."""

from pathlib import Path

import pytest
import yaml

from auv_analysis import load_scenario, simulate
from auv_analysis.graph.node_parameters import node_parameters
from auv_analysis.scenario.changes import check_paths
from auv_analysis.scenario.fault_words import Mark, label, line_of, marks_of
from auv_analysis.simulation.simulate import check_hold
from auv_analysis.studies.sweep.campaign import load_campaign
from auv_dynamics.files.errors import InputError

BASE = {
    'name': 'faulty',
    'vehicle': 'bluerov2_heavy',
    'duration': 2.0,
    'step': 0.01,
    'controllers': {'pid': {'law': 'pid', 'k_P': 90.0, 'k_I': 10.0, 'k_D': 0.5}},
    'setpoint': {'surge': {'offset': 0.2}},
    'actuators': {'thrusters': True},
}
DROP = {'kind': 'sensor_drop_out'}
DELAY = {'kind': 'sensor_delay', 'delay': 0.1}
WEAK = {'kind': 'actuator', 'axis': 'yaw', 'efficiency': 0.5}
DEAD = {'kind': 'thruster', 'thruster': 0, 'efficiency': 0.0}


def written(folder: Path, faults: list, **changes) -> Path:
    path = folder / 'faulty.yaml'
    data = {key: value for key, value in {**BASE, **changes}.items() if value is not None}
    path.write_text(yaml.safe_dump({**data, 'faults': faults}))
    return path


@pytest.mark.parametrize(('faults', 'changes', 'senses', 'acts'), [
    ([], {}, False, True), ([], {'actuators': None}, False, False),
    ([], {'actuators': None, 'sensors': {'drop_out': 0.1}}, True, False),
    ([DROP], {'actuators': None}, True, False), ([WEAK], {'actuators': None}, False, True),
])  # fmt: skip
def test_what_is_between_law_and_vehicle(tmp_path, faults, changes, senses, acts) -> None:
    scenario = load_scenario(written(tmp_path, faults, **changes))
    assert (scenario.senses, scenario.acts) == (senses, acts)


@pytest.mark.parametrize(
    ('faults', 'key', 'expected', 'found'),
    [
        ([{'kind': 'sensor_freeze'}], 'faults[0].kind', 'sensor_drop_out, sensor_delay', 'freeze'),
        ([{}], 'faults[0].kind', 'sensor_drop_out', 'nothing'),
        ([DROP, {**DROP, 'colour': 1}], 'faults[1].colour', 'kind, from, to, probability', 'key'),
        ([{**DROP, 'probability': 1.5}], 'faults[0].probability', 'from 0 to 1', '1.5'),
        ([{**DROP, 'from': -1.0}], 'faults[0].from', 'a number from 0 up (s)', '-1.0'),
        ([{**DROP, 'from': 1.0, 'to': 0.5}], 'faults[0].to', 'a time after from (1 s)', '0.5 s'),
        ([{**DROP, 'from': 3.0}], 'faults[0].from', 'within the run of 2 s', '3 s'),
        ([{**DROP, 'from': 0.011, 'to': 0.019}], 'faults[0].to', '0.01 s apart', '0.019 s'),
        ([{'kind': 'sensor_delay'}], 'faults[0].delay', 'a positive number up to 10', 'nothing'),
        ([{**DELAY, 'delay': 0.015}], 'faults[0].delay', 'a multiple of step', '0.015 s'),
        ([{**DELAY, 'delay': 1e-9}], 'faults[0].delay', 'a multiple of step', '1e-09 s'),
        ([DELAY, {**DELAY, 'from': 1.0}], 'faults[1]', 'one sensor_delay at a time', 'faults[0]'),
        ([{'kind': 'sensor_bias'}], 'faults[0]', 'velocity, attitude or both', 'sensor_bias'),
        ([{'kind': 'sensor_bias', 'velocity': [1, 2]}], 'faults[0].velocity', '6 numbers', '2'),
        ([{'kind': 'actuator', 'axis': 'up', 'stuck': 1}], 'faults[0].axis', 'surge, sway', 'up'),
        ([{'kind': 'actuator', 'axis': 'yaw'}], 'faults[0]', 'efficiency or stuck', 'actuator'),
        ([{**WEAK, 'stuck': 1.0}], 'faults[0]', 'efficiency or stuck, one of', 'actuator'),
        (
            [WEAK, {'kind': 'actuator', 'axis': 'yaw', 'stuck': 1.0}],
            'faults[1]',
            'axis yaw stuck at one value and with no other fault',
            'faults[0] as well',
        ),
        (
            [{'kind': 'thruster', 'thruster': 0, 'stuck': 1.0}, DEAD],
            'faults[1]',
            'thruster T1 stuck at one value and with no other fault',
            'faults[0] as well',
        ),
        ([{**DEAD, 'thruster': 8}], 'faults[0].thruster', 'an index below 8', '8'),
        ([{**DEAD, 'thruster': 'T33'}], 'faults[0].thruster', 'nearest: ', 'T33'),
        ([DEAD, {**DEAD, 'efficiency': 2}], 'faults[1].efficiency', 'a number from 0 to 1', '2'),
        (
            [{'kind': 'thruster', 'thruster': 1, 'stuck': 400.0}],
            'faults[0].stuck',
            'a thrust of ',
            '400 N',
        ),
        ([{'kind': 'wrench_loss', 'timeout': -1}], 'faults[0].timeout', 'from 0 up (s)', '-1'),
        ({'kind': 'wrench_loss'}, 'faults', 'a list of faults', 'wrench_loss'),
    ],
)
def test_what_is_refused(tmp_path, faults, key, expected, found):
    path = written(tmp_path, faults)
    with pytest.raises(InputError) as caught:
        load_scenario(path)
    error = caught.value
    assert (error.file, error.key) == (str(path), key)
    assert expected in error.expected
    assert found in error.found
    assert '\n' not in str(error)


@pytest.mark.parametrize(
    ('changes', 'expected'),
    [
        ({'vehicle': 'rexrov', 'actuators': None}, 'rexrov has none'),
        ({'actuators': {'limit': 10.0}}, 'actuators: {thrusters: true}'),
        ({'actuators': None}, 'actuators: {thrusters: true}'),
    ],
)
def test_a_thruster_that_takes_no_part_cannot_fail(tmp_path, changes, expected):
    with pytest.raises(InputError, match=r'faults\[0\].thruster') as caught:
        load_scenario(written(tmp_path, [DEAD], **changes))
    assert expected in caught.value.expected


def test_faults_of_one_kind_may_follow_each_other_in_any_order(tmp_path):
    delays = [{**DELAY, 'to': 1.0}, {**DELAY, 'from': 1.0, 'delay': 0.2}]
    for order in (1, -1):
        faults = [*delays[::order], WEAK, {**WEAK, 'to': 1.0}]
        found = load_scenario(written(tmp_path, faults)).faults
        times = [(one.first, one.end) for one in found.entries[:2]]
        assert times[::order] == [(0, 100), (100, 1 << 62)]
        assert found.shape == (True, 20)


def test_no_faults_are_no_faults(tmp_path):
    scenario = load_scenario(written(tmp_path, [], actuators=None))
    assert 'faults' not in scenario.data
    assert scenario.sampled == []
    check_hold(scenario, 'continuous')
    assert simulate(scenario, 'pid').measured is None


@pytest.mark.parametrize('fault', [DROP, WEAK])
def test_faults_need_samples(tmp_path, fault):
    scenario = load_scenario(written(tmp_path, [fault], actuators=None))
    with pytest.raises(InputError, match=r"faults: expected hold 'zoh' \(--hold zoh\)"):
        simulate(scenario, 'pid', 'continuous')


CAMPAIGN = """
name: when
scenario: {path}
hold: {hold}
vary:
  - grid:
      faults[0].from: [0.2, 0.5]
      faults[0].efficiency: [0.0, 0.5]
"""


def test_a_campaign_varies_a_fault(tmp_path):
    path = written(tmp_path, [{**WEAK, 'from': 0.1}], actuators=None)
    campaign = tmp_path / 'campaign.yaml'
    campaign.write_text(CAMPAIGN.format(path=path, hold='zoh'))
    assert load_campaign(campaign).rollouts == 4
    campaign.write_text(CAMPAIGN.format(path=path, hold='continuous'))
    with pytest.raises(InputError, match='they act on samples'):
        load_campaign(campaign)


@pytest.mark.parametrize(
    ('path', 'expected'), [('faults[1].from', 'an index below 1'), ('faults[0].form', 'from')]
)
def test_a_campaign_knows_what_a_fault_has(tmp_path, path, expected):
    scenario = load_scenario(written(tmp_path, [WEAK]))
    with pytest.raises(InputError) as caught:
        check_paths(scenario, [path])
    assert expected in caught.value.expected


def test_the_plant_node_is_told_thrusters_by_name_and_publishes_what_it_must(tmp_path):
    scenario = load_scenario(written(tmp_path, [DEAD, {**DELAY, 'from': 1.0}]))
    parameters = node_parameters(scenario, 'pid', bag=tmp_path / 'bag')
    plant = parameters['plant_node']
    assert plant['faults.names'] == ['f1_thruster', 'f2_sensor_delay']
    assert plant['faults.f1_thruster.thruster'] == 'T1'
    assert plant['faults.f2_sensor_delay.from'] == 1.0
    topics = parameters['recorder_node']['topics']
    assert {'wrench_applied', 'ground_truth/odom'} <= set(topics)
    assert parameters['analysis_node']['ground_truth'] is True


@pytest.mark.parametrize(
    ('fault', 'topic'), [(DELAY, 'ground_truth/odom'), (WEAK, 'wrench_applied')]
)
def test_each_side_has_its_own_topic(tmp_path, fault, topic):
    scenario = load_scenario(written(tmp_path, [fault], actuators=None))
    topics = node_parameters(scenario, 'pid', bag=tmp_path / 'bag')['recorder_node']['topics']
    assert {'wrench_applied', 'ground_truth/odom'} & set(topics) == {topic}


def test_the_controller_does_not_know_of_faults(tmp_path):
    told = [
        node_parameters(load_scenario(written(tmp_path, faults)), 'pid', bag=None)
        for faults in ([], [DEAD, DELAY, WEAK])
    ]
    assert told[0]['controller_node'] == told[1]['controller_node']


def test_faults_are_marked_where_they_begin_and_end() -> None:
    specs = [{'kind': 'sensor_drop_out', 'from': 2.0, 'to': 3.5}, {'kind': 'sensor_bias'}]
    found = marks_of(specs, load_scenario('case1').vehicle)
    assert [(one.number, one.kind, one.start, one.end) for one in found] == [
        (1, 'sensor_drop_out', 2.0, 3.5), (2, 'sensor_bias', 0.0, float('inf')),
    ]  # fmt: skip


def test_numbers_of_faults_at_one_time_stand_in_four_lines() -> None:
    times = [(1.0, 9.0), (1.0, 2.0), (2.0, 9.0), (3.0, 9.0), (3.0, 9.0), (4.0, 9.0), (9.0, 10.0)]
    marks = [Mark(i, 'kind', 'label', *ends) for i, ends in enumerate(times, start=1)]
    assert [line_of(mark, marks) for mark in marks] == [0, 1, 1, 2, 3, 0, 0]


@pytest.mark.parametrize(('axis', 'unit'), [('heave', 'N'), ('roll', 'N m')])
def test_a_stuck_actuator_has_the_unit_of_its_axis(axis: str, unit: str) -> None:
    assert label({'kind': 'actuator', 'axis': axis, 'stuck': 2.5}).endswith(f'at 2.5 {unit}')
