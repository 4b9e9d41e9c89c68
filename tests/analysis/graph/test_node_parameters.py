"""A scenario as ROS parameters: what the contract names, in ROS' types, and back from the file."""

import itertools
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from auv_analysis import load_scenario
from auv_analysis.graph.node_parameters import node_parameters, parameter_file
from auv_analysis.scenario.scenario import Scenario
from auv_dynamics import load_vehicle
from auv_dynamics.ros.interface import ANALYSIS_TOPICS, OPTIONAL_STEP_TOPICS, STEP_TOPICS

FRAMES = {'odom_frame', 'base_frame', 'expected_subscribers'}
CONTRACT = {  # every name of the contract's table that is not optional
    'plant_node': {
        *FRAMES, 'vehicle', 'step', 'duration', 'lockstep', 'start_paused', 'recorder_window',
        'integrator', 'seed', 'initial.eta', 'initial.nu', 'start_after', 'disturbance.names',
        'wrench_timeout', 'publish_clock',
    },
    'setpoint_node': {*FRAMES, 'step', 'duration', 'horizon'},
    'controller_node': {
        *FRAMES, 'law', 'vehicle', 'lockstep', 'setpoint_pairing', 'setpoint_acceleration',
        'setpoint_timeout', 'odometry_timeout', 'autostart', 'gains.k_D', 'gains.k_I',
        'gains.Lambda', 'gains.Gamma',
    },
    'analysis_node': {'odom_frame', 'base_frame', 'vehicle', 'every'},
    'recorder_node': {
        'bag', 'topics', 'duration', 'step', 'storage.compression', 'storage.chunk_size',
        'attachments',
    },
}  # fmt: skip
WORDS = {
    'saturation',
    'vehicle', 'integrator', 'law', 'setpoint_pairing', 'setpoint_acceleration', 'bag',
    'odom_frame', 'base_frame', 'storage.compression', 'kind', 'stamp_clock', 'exclude',
}  # fmt: skip
WHOLE = {
    'storage.max_size',
    'storage.free_space',
    'seed',
    'recorder_window',
    'horizon',
    'every',
    'analysis_every',
    'storage.chunk_size',
}
SWITCHES = {
    'lockstep', 'start_paused', 'autostart', 'use_sim_time', 'strict', 'ground_truth', 'thrusters',
    'anti_windup', 'publish_clock',
}  # fmt: skip
LISTS_OF_WORDS = {
    'expected_subscribers', 'start_after', 'disturbance.names', 'faults.names', 'topics',
    'attachments',
}  # fmt: skip
LISTS = {
    'initial.eta', 'initial.nu', 'amplitude', 'omega', 'phase', 'scale', 'dM', 'dD', 'velocity',
    'actuators.limit', 'actuators.rate', 'sensors.velocity_noise', 'sensors.attitude_noise',
    'limits.wrench',
}  # fmt: skip
WHOLE_NUMBERS = """
name: whole
vehicle: rexrov
duration: 4
step: 1
seed: 3.0
integrator: rk4
initial: {eta: [1, 0, 0, 0, 0, 0], nu: [0, 2, 0, 0, 0, 0]}
controllers:
  mine: {law: cl, k_D: 12, k_I: [1, 2, 3, 4, 5, 6], Lambda: 1, Gamma: 60}
setpoint: {surge: {offset: 1, terms: [{amplitude: 1, omega: 2}, {amplitude: 3, omega: 4}]}}
disturbance:
- {kind: herman2018, exponent_sign: 1, scale: 2}
- {kind: harmonic, yaw: {offset: -5}}
- {kind: model_error, mass: 1, added_mass: 0, damping: 2, buoyancy: 1, dM: 5}
- {kind: model_error, dD: [1, 2, 3, 4, 5, 6]}
- {kind: current, velocity: [1, 0, 0]}
actuators: {limit: 100, rate: [1, 2, 3, 4, 5, 6], lag: 1, delay: 2}
sensors: {velocity_noise: 1, attitude_noise: [1, 2, 3], drop_out: 1}
faults: [{kind: sensor_delay, delay: 1, from: 1, to: 2}, {kind: wrench_loss, from: 2, to: 3}]
"""


def _parameters(
    scenario: Scenario, controller: str, *, bag: Path | None = Path('bag'), **options: Any
) -> dict[str, dict[str, Any]]:
    files = {'scenario.yaml': Path('/x/scenario.yaml')}
    return node_parameters(scenario, controller, bag=bag, attachments=files, **options)


@pytest.fixture
def whole(tmp_path: Path) -> Scenario:
    """A scenario without a single decimal point."""
    path = tmp_path / 'whole.yaml'
    path.write_text(WHOLE_NUMBERS)
    return load_scenario(path)


def _entries(parameters: dict[str, dict[str, Any]]) -> Iterator[tuple[str, Any]]:
    for node in parameters.values():
        yield from node.items()


def _expected_type(name: str) -> type | tuple[type, type]:
    last = '' if name.startswith('setpoint_filter.') else name.rpartition('.')[2]
    for names, kind in (
        (WORDS, str), (WHOLE, int), (SWITCHES, bool), (LISTS_OF_WORDS, (list, str)),
        (LISTS, (list, float)),
    ):  # fmt: skip
        if name in names or last in names:
            return kind
    return (list, float) if name.startswith('gains.') else float


def test_case1_has_every_parameter_of_the_contract() -> None:
    parameters = _parameters(load_scenario('case1'), 'gvc')
    assert set(parameters) == set(CONTRACT)
    for node, names in CONTRACT.items():
        assert names <= set(parameters[node]), node
    assert parameters['recorder_node']['topics'] == list(STEP_TOPICS)
    assert not parameters['analysis_node']['ground_truth'], 'nothing is measured'
    assert parameters['controller_node']['setpoint_pairing'] == 'exact'
    assert parameters['controller_node']['setpoint_acceleration'] == 'topic'


def test_beside_a_vehicle_the_wrench_is_that_of_its_thrusters() -> None:
    made = load_scenario('case1')
    heavy = replace(made, vehicle=load_vehicle('bluerov2_heavy'))
    lockstep, paced = (_parameters(heavy, 'gvc', lockstep=on) for on in (True, False))
    assert 'limits.wrench' not in lockstep['controller_node'], '`simulate` would not equal it'
    most = paced['controller_node']['limits.wrench']
    thrusters = heavy.vehicle.thrusters
    T, forward, reverse = thrusters.matrix, thrusters.forward, thrusters.reverse
    corners = np.array(list(itertools.product(*zip(-reverse, forward, strict=True)))) @ T.T
    assert most == pytest.approx(np.abs(corners).max(axis=0))
    assert (lockstep['setpoint_node']['horizon'], paced['setpoint_node']['horizon']) == (200, 0)
    assert 'limits.wrench' not in _parameters(made, 'gvc', lockstep=False)['controller_node']


def test_case1_has_its_setpoint_and_disturbance() -> None:
    parameters = _parameters(load_scenario('case1'), 'gvc')
    setpoint = {k for k in parameters['setpoint_node'] if k.startswith('setpoint.')}
    parts = ('offset', 'amplitude', 'omega', 'phase')
    dofs = ('surge', 'heave', 'yaw')
    assert setpoint == {f'setpoint.{dof}.{part}' for dof in dofs for part in parts}
    plant = parameters['plant_node']
    (name,) = plant['disturbance.names']
    assert plant[f'disturbance.{name}.kind'] == 'herman2018'
    assert plant[f'disturbance.{name}.exponent_sign'] == -1.0


@pytest.mark.parametrize('lockstep', [True, False])
def test_every_value_has_its_type(whole: Scenario, lockstep: bool) -> None:
    scenarios = [(load_scenario('case1'), 'gvc'), (whole, 'mine')]
    for scenario, controller in scenarios:
        parameters = _parameters(scenario, controller, lockstep=lockstep)
        for name, value in _entries(parameters):
            kind = _expected_type(name)
            if isinstance(kind, tuple):
                assert type(value) is list, name
                assert value, f'{name}: an empty list has no type in a parameter file'
                assert {type(entry) for entry in value} == {kind[1]}, name
            else:
                assert type(value) is kind, name


@pytest.mark.parametrize('lockstep', [True, False])
def test_all_that_the_nodes_are_told(whole: Scenario, lockstep: bool, approved) -> None:
    parameters = _parameters(whole, 'mine', lockstep=lockstep)
    approved.add(parameter_file(parameters, 'whole').splitlines())


def test_the_recorder_waits_for_an_analysis_where_one_comes_at_every_step(whole: Scenario) -> None:
    for options, every in (({}, 10), ({'analysis': False}, 0), ({'plant': False}, 0)):
        recorder = _parameters(whole, 'mine', **options)['recorder_node']
        assert recorder['analysis_every'] == every


def test_no_driver_has_to_offer_what_the_plant_alone_knows(whole: Scenario) -> None:
    given = _parameters(whole, 'mine', plant=False)
    expected = ['odom', 'cmd_vel', 'cmd_accel', 'wrench', 'disturbance_estimate']
    assert sorted(given['recorder_node']['topics']) == sorted(expected)
    assert not given['analysis_node']['ground_truth']


@pytest.mark.parametrize(
    ('part', 'topic'), [('actuators', 'wrench_applied'), ('sensors', 'ground_truth/odom')]
)
def test_what_acts_or_senses_has_a_topic_of_its_own(part: str, topic: str) -> None:
    made = load_scenario('case1')
    values = {'actuators': {'limit': 100.0}, 'sensors': {'velocity_noise': 0.1}}
    some = replace(made, data=made.data | {part: values[part]})
    recorder = _parameters(some, 'gvc')['recorder_node']
    assert recorder['topics'] == [*STEP_TOPICS, topic]


def test_a_plant_without_a_recorder_waits_for_none(whole: Scenario) -> None:
    given = _parameters(whole, 'mine', bag=None)
    assert 'recorder_node' not in given
    assert given['plant_node']['recorder_window'] == 0


def test_only_those_are_waited_for_who_run(whole: Scenario) -> None:
    def expected(**options: Any) -> list[str]:
        given = _parameters(whole, 'mine', bag=None, **options)
        return given['plant_node']['expected_subscribers']

    assert expected() == ['odom=2', 'disturbance=1', 'ground_truth/odom=1']
    assert expected(analysis=False) == ['odom=2']


def test_a_controller_is_told_of_the_actuators_and_how_the_vehicle_is_called(
    whole: Scenario,
) -> None:
    actuators = {'thrusters': True, 'saturation': 'priority'}
    mine = whole.data['controllers']['mine'] | {'anti_windup': False}
    data = whole.data | {'actuators': actuators, 'controllers': {'mine': mine}}
    given = _parameters(replace(whole, data=data), 'mine', vehicle='by_name')
    controller = given['controller_node']
    assert controller['actuators.thrusters']
    assert controller['actuators.saturation'] == 'priority'
    assert not controller['anti_windup']
    for node in ('plant_node', 'controller_node', 'analysis_node'):
        assert given[node]['vehicle'] == 'by_name'


def test_every_subscriber_that_is_waited_for_runs(whole: Scenario) -> None:
    for options in ({}, {'analysis': False}):
        parameters = _parameters(whole, 'mine', **options)
        others = set(parameters) - {'plant_node'}
        assert set(parameters['plant_node']['start_after']) == others
        for node, values in parameters.items():
            for entry in values.get('expected_subscribers', []):
                topic, _, count = entry.partition('=')
                assert topic in (*STEP_TOPICS, *OPTIONAL_STEP_TOPICS, *ANALYSIS_TOPICS)
                assert 0 < int(count) < len(parameters), (node, entry)


@pytest.mark.parametrize('controller', ['gvc', 'cl'])
def test_parameter_file_round_trips(controller: str) -> None:
    parameters = _parameters(load_scenario('case1'), controller)
    text = parameter_file(parameters, 'case1')
    assert text.startswith('# case1\n')
    data = yaml.safe_load(text)
    assert {name: entry['ros__parameters'] for name, entry in data.items()} == {
        f'/**/{node}': values for node, values in parameters.items()
    }


@pytest.mark.parametrize('namespace', ['', 'auv1'])
def test_ros_itself_reads_the_file(whole, namespace, tmp_path, monkeypatch) -> None:
    import rclpy
    from rclpy.node import Node

    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF')
    parameters = _parameters(whole, 'mine')
    path = tmp_path / 'params.yaml'
    path.write_text(parameter_file(parameters, 'whole'))
    context = rclpy.Context()
    rclpy.init(context=context, args=['--ros-args', '--params-file', str(path)])
    try:
        for name, values in parameters.items():
            node = Node(
                name, context=context, namespace=namespace,
                automatically_declare_parameters_from_overrides=True,
            )  # fmt: skip
            for key, value in values.items():
                read = node.get_parameter(key).value
                assert (list(read) if isinstance(value, list) else read) == value, key
            node.destroy_node()
    finally:
        rclpy.shutdown(context=context)


def test_file_setpoint_is_named_by_its_full_path(tmp_path: Path) -> None:
    table = 't,surge,sway,heave,roll,pitch,yaw\n0,0,0,0,0,0,0\n4,1,0,0,0,0,0\n'
    (tmp_path / 'x.csv').write_text(table)
    head, _, tail = WHOLE_NUMBERS.partition('setpoint: ')
    path = tmp_path / 'scenario.yaml'
    path.write_text(f'{head}setpoint: {{file: x.csv}}\n{tail.partition(chr(10))[2]}')
    setpoint = _parameters(load_scenario(path), 'mine')['setpoint_node']
    assert setpoint['setpoint.file'] == str((tmp_path / 'x.csv').resolve())
