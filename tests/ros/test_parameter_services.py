"""What `ros2 param` asks the nodes: all are described, and what is dumped starts them again."""

from pathlib import Path

import pytest
import yaml
from helpers.node_processes import CONTROLLER, Peer, fresh_domain, graph, parameters, stop
from helpers.nodes_in_process import program
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.parameter import parameter_value_to_python

from auv_analysis.nodes.recorder_node import RecorderNode
from auv_dynamics.files.errors import InputError
from auv_dynamics.nodes.frame_converter_node import FrameConverterNode
from auv_dynamics.ros.parameters import _taken, declare
from auv_gvc_controller.nodes.controller_node import ControllerNode

FAULT = ['-p', 'faults.names:=["gone"]', *parameters(faults__gone__kind='sensor_drop_out')]
HARMONIC = ['-p', 'disturbance.names:=["a"]', *parameters(disturbance__a__kind='harmonic')]
NODES = {
    'controller_node': [*CONTROLLER, *parameters(limits__wrench='[50.0]')],
    'plant_node': [*parameters(vehicle='herman2018', start_paused=True), *FAULT, *HARMONIC],
    'setpoint_node': parameters(setpoint__surge__offset=0.2),
    'analysis_node': parameters(vehicle='herman2018'),
    'frame_converter_node': [],
    'recorder_node': [],
}

WHOLE, WIDE = 2**62, 1e308  # what stands for no limit
RANGES = {  # of the plant's parameters
    'step': (1e-9, 1e9), 'duration': (0.0, 1e9), 'recorder_window': (0, 2999), 'seed': (0, WHOLE),
    'wrench_timeout': (0.0, WIDE), 'actuators.delay': (0.0, 60.0), 'actuators.lag': (0.0, WIDE),
    'actuators.rotor_lag': (0.0, WIDE), 'sensors.drop_out': (0.0, 1.0),
    'faults.gone.from': (0.0, WIDE), 'faults.gone.probability': (0.0, 1.0),
}  # fmt: skip


def asked(peer: Peer, node: str) -> tuple[list[str], list, list]:
    """Names, values and descriptors, as the command line asks for them."""
    listed = peer.call(ListParameters, f'{node}/list_parameters').result.names
    get = peer.call(GetParameters, f'{node}/get_parameters', GetParameters.Request(names=listed))
    describe = DescribeParameters.Request(names=listed)
    told = peer.call(DescribeParameters, f'{node}/describe_parameters', describe)
    return listed, get.values, told.descriptors


@pytest.mark.parametrize('node', NODES)
def test_what_is_dumped_loads_back(node: str, tmp_path: Path) -> None:
    bag = parameters(bag=tmp_path / 'first') if node == 'recorder_node' else []
    with graph((node, [*NODES[node], *bag])) as (peer, _):
        names, values, descriptors = asked(peer, node)
    assert len(values) == len(descriptors) == len(names) > 0
    own = [d for d in descriptors if not d.name.startswith(('use_sim', 'qos_', 'start_type'))]
    assert all(d.description for d in own)
    if node == 'plant_node':
        bounds = [(d.name, [*d.integer_range, *d.floating_point_range]) for d in descriptors]
        ends = {name: (one.from_value, one.to_value) for name, found in bounds for one in found}
        assert ends == RANGES
    dumped = {
        name: parameter_value_to_python(value) for name, value in zip(names, values, strict=True)
    }
    if bag:
        dumped['bag'] = str(tmp_path / 'second')
    path = tmp_path / 'dump.yaml'
    path.write_text(yaml.safe_dump({f'/{node}': {'ros__parameters': dumped}}))
    with graph((node, ['--params-file', str(path)]), domain=fresh_domain()) as (peer, _):
        again = asked(peer, node)
    assert again[0] == names
    assert dict(zip(names, map(parameter_value_to_python, again[1]), strict=True)) == dumped


def test_an_empty_list_and_null_are_no_value() -> None:
    given = ['-p', 'limits.wrench_rate:=[]', '-p', 'actuators.limit:=null']
    with graph(('controller_node', [*NODES['controller_node'], *given])) as (peer, processes):
        names, values, _ = asked(peer, 'controller_node')
        found = dict(zip(names, values, strict=True))
        assert found['limits.wrench_rate'].type == found['actuators.limit'].type == 0
        assert processes['controller_node'].poll() is None


def test_whole_numbers_are_numbers_and_one_is_a_list_where_several_may_be() -> None:
    given = {'limits.wrench': [70, 71, 72, 73, 74, 75], 'limits.wrench_rate': 80, 'ramp': 2}
    gains = {'gains.k_D': 12, 'gains.k_I': [1], 'gains.Lambda': 0.8, 'gains.Gamma': [60.0]}
    gains['gains.of_my_own_law'] = 3
    with program() as made:
        node = made.add(ControllerNode, {'law': 'gvc', 'vehicle': 'herman2018', **gains, **given})
        found = {name: node.get_parameter(name).value for name in given}
        assert list(node.get_parameter('gains.of_my_own_law').value) == [3.0]
    expected = {'limits.wrench': [70.0, 71.0, 72.0, 73.0, 74.0, 75.0], 'limits.wrench_rate': [80.0]}
    assert found == {**expected, 'ramp': 2.0}
    assert {type(value) for value in (*found['limits.wrench'], found['ramp'])} == {float}


def test_what_decides_whom_a_controller_hears_is_fixed() -> None:
    with program() as made:
        node = made.add(ControllerNode, CONTROL)
        names = node.get_parameters_by_prefix('')
        own = [name for name in names if not name.startswith('qos_overrides.')]
        fixed = {about.name for about in node.describe_parameters(own) if about.read_only}
    assert fixed == {
        'vehicle', 'lockstep', 'autostart', 'setpoint_pairing', 'setpoint_acceleration',
        'odom_frame', 'base_frame', 'expected_subscribers', 'start_type_description_service',
    }  # fmt: skip


@pytest.mark.parametrize(
    ('given', 'kind', 'taken'),
    [
        (3, float, 3.0), (True, float, True), ('a', float, 'a'), (2.5, list[float], [2.5]),
        ((1, 2.5), list[float], [1.0, 2.5]), ([1.0, True], list[float], [1.0, True]),
        ([1, '2'], list[float], [1, '2']), (('a', 'b'), list[str], ['a', 'b']), (7, int, 7),
        ('', list[float], ''),
    ],
)  # fmt: skip
def test_only_numbers_are_taken_for_numbers(given, kind, taken) -> None:
    found = _taken(given, kind)
    assert found == taken
    assert type(found) is type(taken)
    if isinstance(taken, list):
        assert [*map(type, found)] == [*map(type, taken)]


def test_a_gain_that_is_refused_is_told_with_what_is_expected_and_what_was_found() -> None:
    gains = {'gains.k_D': [1.0, 2.0], 'gains.k_I': 1.0, 'gains.Lambda': 0.8, 'gains.Gamma': 60.0}
    given = {'law': 'gvc', 'vehicle': 'herman2018', **gains}
    with program() as made:
        node = made.add(ControllerNode, given)
        with pytest.raises(InputError) as caught:
            node._settings.build()
    error = caught.value
    assert (error.key, error.expected, error.found) == (
        'gains.k_D', '1, 6 or 36 numbers', 'shape (2,)'
    )  # fmt: skip


CONTROL = {'law': 'gvc', 'vehicle': 'herman2018', 'gains.k_D': 12.0}


def test_the_first_unknown_parameter_is_told_with_all_that_are_known_but_those_of_rclpy() -> None:
    with program() as made, pytest.raises(InputError) as caught:
        made.add(FrameConverterNode, {'shade': 1, 'colour': 'red', 'tone': 2})
    error = caught.value
    known = 'base_frame, enu_frame, expected_subscribers, flu_frame, lockstep, odom_frame'
    assert (error.key, error.expected) == ('colour', f'one of {known}, twist_frame')


def test_what_every_node_of_rclpy_takes_is_taken() -> None:
    given = {'use_sim_time': True, 'start_type_description_service': False}
    given['qos_overrides./odom.publisher.depth'] = 1
    with program() as made:
        node = made.add(FrameConverterNode, given)
        assert {name: node.get_parameter(name).value for name in given} == given


def test_null_is_a_word_where_one_is_taken_for_granted_and_the_words_are_described() -> None:
    with program() as made:
        node = made.add(FrameConverterNode, {'enu_frame': 'null'})
        assert node.get_parameter('enu_frame').value == 'null'
        frame, twist = node.describe_parameters(['enu_frame', 'twist_frame'])
    assert (frame.additional_constraints, frame.read_only) == ('', True)
    assert (twist.additional_constraints, twist.read_only) == ('one of child, world', True)


def test_a_range_may_have_an_upper_end_alone() -> None:
    with program() as made:
        node = made.add(FrameConverterNode, {})
        assert declare(node, 'depth', float, -1.0, 'm', at_most=0.0) == -1.0
        assert declare(node, 'count', int, -1, 'of layers', at_most=0) == -1
        depth, count = node.describe_parameters(['depth', 'count'])
        (depth,), (count,) = depth.floating_point_range, count.integer_range
        node.given['height'] = 1.0
        with pytest.raises(InputError) as caught:
            declare(node, 'height', float, 0.0, 'm', at_most=0.0)
    assert (depth.from_value, depth.to_value) == (-WIDE, 0.0)
    assert (count.from_value, count.to_value) == (-WHOLE, 0)
    assert caught.value.expected == 'a number from -inf to 0.0'


@pytest.mark.parametrize(
    ('kind', 'given', 'expected'),
    [
        (RecorderNode, {'storage.chunk_size': 1000}, 'a number from 1024 to'),
        (RecorderNode, {'storage.max_duration': 1e10}, 'a number from 0.0 to 1000000000.0'),
        (RecorderNode, {'strict': 1}, 'true or false'),
        (RecorderNode, {'topics': [1]}, 'a list of words'),
        (RecorderNode, {'storage.max_size': 0.5}, 'a whole number'),
        (ControllerNode, {'ramp': -1.0}, 'a number from 0.0 to inf'),
        (ControllerNode, {'ramp': '1'}, 'a number'),
        (ControllerNode, {'ramp': True}, 'a number'),
        (ControllerNode, {'vehicle': 1}, 'a word'),
        (ControllerNode, {'limits.wrench': ['1']}, 'a list of numbers'),
        (ControllerNode, {'limits.wrench': [1.0, float('nan')]}, 'finite numbers'),
        (ControllerNode, {'setpoint_pairing': 'last'}, 'one of exact, latest'),
        (ControllerNode, {'rampe': 1.0}, '(nearest: ramp)'),
        (ControllerNode, {'expected_subscribers': ['wrnch=1']}, 'lumped_error (nearest: wrench)'),
        (ControllerNode, {'expected_subscribers': ['wrench=x']}, 'topic=count'),
    ],
)
def test_what_is_refused_is_told_by_name(kind, given, expected: str) -> None:
    own = CONTROL if kind is ControllerNode else {'bag': 'x'}
    with program() as made, pytest.raises(InputError) as caught:
        made.add(kind, own | given)
    assert caught.value.key == next(iter(given))
    assert expected in caught.value.expected


@pytest.mark.parametrize('kind', [SetParameters, SetParametersAtomically])
def test_a_value_of_a_type_that_there_is_not_is_refused(kind: type) -> None:
    """rclpy raises for it, and answers nothing."""
    odd = Parameter(name='gains.k_D', value=ParameterValue(type=200))
    with graph(('controller_node', NODES['controller_node'])) as (peer, processes):
        name = kind.__name__.replace('Set', 'set_').replace('sA', 's_a').replace('_P', '_p')
        client = peer.node.create_client(kind, f'controller_node/{name}')
        peer.until(client.service_is_ready, 'the service')
        peer.call(GetParameters, 'controller_node/get_parameters')  # then both ends are known
        client.call_async(kind.Request(parameters=[odd]))
        assert asked(peer, 'controller_node')[0]
        code, output = stop(processes['controller_node'])
    assert code == 0
    assert 'refused: 200 is not a valid' in output
