"""What each node publishes, hears and offers, of which type and quality, in both paces."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from helpers.nodes_in_process import program
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy

from auv_analysis import load_scenario
from auv_analysis.graph.node_parameters import node_parameters
from auv_analysis.nodes.analysis_node import AnalysisNode
from auv_analysis.nodes.recorder_node import RecorderNode
from auv_dynamics.nodes.frame_converter_node import FrameConverterNode
from auv_dynamics.nodes.plant_node import PlantNode
from auv_dynamics.ros import topics
from auv_dynamics.ros.topics import type_name
from auv_gvc_controller.nodes.controller_node import ControllerNode
from auv_gvc_controller.nodes.setpoint_node import SetpointNode

ODOMETRY, TWIST, ACCEL, WRENCH, JOINTS, TIME, CLOCK, HEALTH = (
    'nav_msgs/msg/Odometry', 'geometry_msgs/msg/TwistStamped', 'geometry_msgs/msg/AccelStamped',
    'geometry_msgs/msg/WrenchStamped', 'sensor_msgs/msg/JointState', 'std_msgs/msg/Header',
    'rosgraph_msgs/msg/Clock', 'diagnostic_msgs/msg/DiagnosticArray',
)  # fmt: skip
TYPES = {
    'odom': ODOMETRY, 'twist': TWIST, 'cmd_vel': TWIST, 'cmd_accel': ACCEL, 'wrench': WRENCH,
    'wrench_applied': WRENCH, 'disturbance': WRENCH, 'disturbance_estimate': WRENCH,
    'ground_truth/odom': ODOMETRY, 'analysis/kinetic_energy': JOINTS,
    'analysis/kinetic_energy_shares': JOINTS, 'analysis/delta_xi': TWIST,
    'analysis/delta_pi': WRENCH, 'analysis/lumped_error': WRENCH, 'recorder/progress': TIME,
    '/clock': CLOCK, '/diagnostics': HEALTH, 'enu_flu/odom': ODOMETRY, 'enu_flu/wrench': WRENCH,
    'enu_flu/cmd_vel': TWIST, 'enu_flu/cmd_accel': ACCEL,
}  # fmt: skip
ALL, FEW, ONE = ('RELIABLE', 3000), ('RELIABLE', 10), ('RELIABLE', 1)
LOSSY, NEWEST = ('BEST_EFFORT', 10), ('BEST_EFFORT', 1)
ANALYSIS = [name for name in TYPES if name.startswith('analysis/')]
EVERYTHING = [name for name in TYPES if not name.startswith('enu_flu/')]
VEHICLE = {'vehicle': 'herman2018'}
GAINS = {'gains.k_D': [12.0], 'gains.k_I': [1.0], 'gains.Lambda': [0.8], 'gains.Gamma': [60.0]}
LAW = {**VEHICLE, **GAINS, 'law': 'gvc', 'limits.wrench': [1e5]}
STAMPED = {'setpoint_acceleration': 'topic'}
FULL = {**VEHICLE, 'actuators.limit': [1e4], 'sensors.velocity_noise': [0.1]}
Ends = dict[str, tuple[str, int]]
CASES: list[tuple[Callable[..., Any], dict[str, Any], bool, Ends, Ends]] = [
    (PlantNode, {**VEHICLE, 'recorder_window': 5}, True,
     dict.fromkeys(['odom', 'twist', 'disturbance', '/clock'], ALL),
     {'wrench': FEW, 'recorder/progress': FEW}),
    (PlantNode, {**FULL, 'publish_clock': False}, False,
     dict.fromkeys(['odom', 'twist', 'disturbance', 'wrench_applied', 'ground_truth/odom'], ALL),
     {'wrench': ONE}),
    (ControllerNode, {**LAW, **STAMPED}, True,
     dict.fromkeys(['wrench', 'disturbance_estimate'], ALL),
     {'odom': FEW, 'cmd_vel': ALL, 'cmd_accel': ALL}),
    (ControllerNode, LAW, False, dict.fromkeys(['wrench', 'disturbance_estimate'], ALL),
     {'odom': LOSSY, 'cmd_vel': ALL}),
    (SetpointNode, {}, True, dict.fromkeys(['cmd_vel', 'cmd_accel'], ALL), {'odom': FEW}),
    (SetpointNode, {}, False, dict.fromkeys(['cmd_vel', 'cmd_accel'], ALL), {'odom': NEWEST}),
    (AnalysisNode, VEHICLE, True, dict.fromkeys(ANALYSIS, ALL),
     dict.fromkeys(['odom', 'cmd_vel', 'wrench', 'disturbance', 'disturbance_estimate'], ALL)),
    (AnalysisNode, {**VEHICLE, 'ground_truth': True}, False, dict.fromkeys(ANALYSIS, ALL),
     dict.fromkeys(['ground_truth/odom', 'cmd_vel', 'wrench', 'disturbance',
                    'disturbance_estimate'], ALL)),
    (FrameConverterNode, {}, True,
     dict.fromkeys(['odom', 'cmd_vel', 'cmd_accel', 'enu_flu/wrench'], ALL),
     {'enu_flu/odom': FEW, 'wrench': FEW, 'enu_flu/cmd_vel': ALL, 'enu_flu/cmd_accel': ALL}),
    (FrameConverterNode, {}, False,
     dict.fromkeys(['odom', 'cmd_vel', 'cmd_accel', 'enu_flu/wrench'], ALL),
     {'enu_flu/odom': LOSSY, 'wrench': ONE, 'enu_flu/cmd_vel': ALL, 'enu_flu/cmd_accel': ALL}),
    (RecorderNode, {'bag': 'bag'}, False, {'recorder/progress': FEW},
     dict.fromkeys(EVERYTHING, ALL)),
]  # fmt: skip
SENSING = {'actuators': {'limit': 1e4}, 'sensors': {'velocity_noise': 0.1}}
SERVICES = {  # beside ~/ready and what every node of rclpy offers
    'plant_node': {'run', 'reset'},
    'controller_node': {
        'reset', 'change_state', 'get_state', 'get_available_states',
        'get_available_transitions', 'get_transition_graph',
    },
}  # fmt: skip
OF_RCLPY = {'/rosout', '/parameter_events'}


def ends(found: Any) -> dict[str, tuple[str, str, str, int]]:
    """Name -> type, reliability, durability and depth."""
    listed = [(e.topic_name if hasattr(e, 'topic_name') else e.topic, e) for e in found]
    return {
        name: (
            type_name(end.msg_type), end.qos_profile.reliability.name,
            end.qos_profile.durability.name, end.qos_profile.depth,
        )
        for name, end in listed
        if name not in OF_RCLPY and 'transition_event' not in name
    }  # fmt: skip


def wanted(listed: Ends, space: str) -> dict[str, tuple[str, str, str, int]]:
    return {
        name if name.startswith('/') else f'{space}/{name}': (
            TYPES[name], reliability, DurabilityPolicy.VOLATILE.name, depth
        )
        for name, (reliability, depth) in listed.items()
    }  # fmt: skip


@pytest.mark.parametrize('case', CASES, ids=lambda c: f'{c[0].__name__}-{c[2] * "lockstep"}')
def test_topics_types_and_quality_of_service_are_those_of_the_contract(
    case: tuple, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    make, given, lockstep, published, heard = case
    told = given if make is RecorderNode else {**given, 'lockstep': lockstep}
    with program() as made:
        node = made.add(make, told, namespace='/auv1')
        assert ends(node.publishers) == wanted({**published, '/diagnostics': FEW}, '/auv1')
        assert ends(node.subscriptions) == wanted(heard, '/auv1')
        assert node.graph.hardware_id == given.get('vehicle', 'auv1')
        name = node.get_name()
        own = {f'/auv1/{name}/{one}' for one in {'ready'} | SERVICES.get(name, set())}
        offered = dict(made.until(
            lambda: own <= dict(node.get_service_names_and_types_by_node(name, '/auv1')).keys()
            and node.get_service_names_and_types_by_node(name, '/auv1'), 'services',
        ))  # fmt: skip
        usual = ('parameter', 'type_description')
        rest = {service for service in offered if not any(word in service for word in usual)}
        assert rest == own


def test_a_second_publisher_is_an_error_where_it_would_be_obeyed_as_well() -> None:
    with program() as made:
        made.add(FrameConverterNode, {})
        made.listen(topics.DIAGNOSTICS)
        second = (topics.ODOM, topics.CMD_VEL, topics.CMD_ACCEL, topics.WRENCH, topics.WRENCH)
        for topic in second:
            made.node.create_publisher(topic.type, topic.name, 1)
        said = made.heard[topics.DIAGNOSTICS.name]
        expected = {'/odom: expected one publisher, found /frame_converter_node, /test_peer',
                    '/wrench: expected one publisher, found /test_peer, /test_peer'}  # fmt: skip
        made.until(
            lambda: said and {*said[-1].status[0].message.split('; ')} == expected, 'both of them'
        )


def test_two_clocks_are_an_error_of_who_follows_one() -> None:
    with program() as made:
        alone = {'use_sim_time': True, 'expected_subscribers': ['wrench=1']}
        node = made.add(SetpointNode, alone)
        for _ in range(2):
            made.node.create_publisher(topics.CLOCK.type, topics.CLOCK.name, 1)
        made.until(lambda: made.node.count_publishers('/clock') == 2, 'both')
        crowd = '/clock: expected one publisher, found /test_peer, /test_peer'
        made.until(lambda: node.graph._crowd()[1] == crowd, 'an error')
        assert node.set_parameters([Parameter('use_sim_time', value=False)])[0].successful
        assert node.graph._crowd()[1] == '', 'nor of who follows none'
        missing = 'wrench: expected 1 subscribers, found 0'
        assert node.graph._missing() == missing, 'of what it does not publish'


def test_whoever_is_in_the_loop_is_waited_for() -> None:
    loop = {PlantNode, ControllerNode, FrameConverterNode}
    assert {make for make, *_ in CASES if make.latency_critical} == loop


@pytest.mark.parametrize('sensing', [False, True])
def test_a_run_waits_for_all_who_subscribe(sensing: bool) -> None:
    plant, controller, setpoint, recorder = CASES[sensing], CASES[2], CASES[4], CASES[-1]
    nodes = (plant, setpoint, controller, CASES[6 + sensing], recorder)
    scenario = load_scenario('case1')
    scenario = replace(scenario, data=scenario.data | (SENSING if sensing else {}))
    given = node_parameters(scenario, 'gvc', bag=Path('bag'))
    found = [values.get('expected_subscribers', []) for values in given.values()]
    for said, (_, _, _, published, _) in zip(found, nodes, strict=True):
        counts = {
            topic: sum(topic in heard for *_, heard in nodes)
            for topic in published if topic in EVERYTHING and not topic.startswith(('/', 'rec'))
        }  # fmt: skip
        assert {*said} == {f'{topic}={count}' for topic, count in counts.items() if count}
