"""What `ros2 param` asks the nodes: all are described, and what is dumped starts them again."""

from pathlib import Path

import pytest
import yaml
from helpers.node_processes import CONTROLLER, Peer, fresh_domain, graph, parameters
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters
from rclpy.parameter import parameter_value_to_python

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


def test_an_empty_list_and_null_are_no_value_and_whole_numbers_are_numbers() -> None:
    given = ['-p', 'limits.wrench_rate:=[]', '-p', 'actuators.limit:=null']
    given += ['-p', 'limits.wrench:=70', '-p', 'ramp:=2']
    with graph(('controller_node', [*NODES['controller_node'], *given])) as (peer, processes):
        names, values, _ = asked(peer, 'controller_node')
        found = dict(zip(names, values, strict=True))
        assert found['limits.wrench_rate'].type == found['actuators.limit'].type == 0
        assert parameter_value_to_python(found['limits.wrench']) == [70.0]
        assert found['limits.wrench'].type == ParameterType.PARAMETER_DOUBLE_ARRAY
        assert found['ramp'].type == ParameterType.PARAMETER_DOUBLE
        assert processes['controller_node'].poll() is None
