"""A scenario as ROS parameters: one file per controller, for `auv run`, launch and `ros2 run`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from auv_analysis.scenario.scenario import Scenario
from auv_dynamics.plant.parameters import flattened, listed, numbers, part
from auv_dynamics.ros import interface
from auv_gvc_controller.control.settings import ControllerSettings

PLANT, SETPOINT, CONTROLLER = 'plant_node', 'setpoint_node', 'controller_node'
ANALYSIS, RECORDER = 'analysis_node', interface.RECORDER
EVERY = 10  # steps between live analysis samples
WINDOW = 2000  # steps that the plant may be ahead of the recorder
HORIZON = 200  # steps that set-points are published ahead in lock-step
WRENCH_TIMEOUT = 30.0  # s of silence that end a lock-step run
TIMEOUT = 0.5  # s, the real-time watchdogs
OF_PLANT_ALONE = (  # no driver has to offer them
    *(interface.TWIST, interface.DISTURBANCE),
    *(interface.WRENCH_APPLIED, interface.GROUND_TRUTH),
)
SUBSCRIBERS: dict[str, dict[str, tuple[str, ...]]] = {  # topic -> who subscribes, by publisher
    PLANT: {
        interface.ODOM: (CONTROLLER, SETPOINT, ANALYSIS, RECORDER),
        interface.TWIST: (RECORDER,),
        interface.DISTURBANCE: (ANALYSIS, RECORDER),
        interface.WRENCH_APPLIED: (RECORDER,),
        interface.GROUND_TRUTH: (ANALYSIS, RECORDER),
    },
    SETPOINT: {
        interface.CMD_VEL: (CONTROLLER, ANALYSIS, RECORDER),
        interface.CMD_ACCEL: (CONTROLLER, RECORDER),
    },
    CONTROLLER: {
        interface.WRENCH: (PLANT, ANALYSIS, RECORDER),
        interface.DISTURBANCE_ESTIMATE: (ANALYSIS, RECORDER),
    },
    ANALYSIS: dict.fromkeys(interface.ANALYSIS_TOPICS, (RECORDER,)),
}


def node_parameters(
    scenario: Scenario,
    controller: str,
    *,
    bag: Path | None,
    plant: bool = True,
    analysis: bool = True,
    lockstep: bool = True,
    use_sim_time: bool = True,
    vehicle: str | None = None,
    attachments: Mapping[str, Path] | None = None,
) -> dict[str, dict[str, Any]]:
    """Parameters of every node, all written out.

    Parameters
    ----------
    scenario : resolved scenario
    controller : name of one of its controllers
    bag : folder that the recorder writes to; None: no recorder
    plant : whether the plant node runs; else a vehicle driver takes its place
    analysis : whether the analysis node runs
    lockstep : deterministic and as fast as the machine allows, else in real time
    use_sim_time : of all nodes but the plant
    vehicle : how the files name the vehicle, by default its full path
    attachments : name -> path of files that travel in the bag

    Returns
    -------
    parameters : node name -> parameter name -> value

    """
    nodes = [PLANT] * plant + [SETPOINT, CONTROLLER]
    nodes += [ANALYSIS] * analysis + [RECORDER] * (bag is not None)
    vehicle = vehicle or str(scenario.vehicle_path.resolve())
    clock = {'use_sim_time': use_sim_time}
    grid = {'step': scenario.step, 'duration': scenario.duration}
    parameters: dict[str, dict[str, Any]] = {
        PLANT: {'use_sim_time': False, **_plant(scenario, vehicle, nodes, lockstep)},
        SETPOINT: {
            **clock,
            **grid,
            'horizon': HORIZON if lockstep else 0,
            **_of_key(scenario, 'setpoint'),
        },
        CONTROLLER: {**clock, **_controller(scenario, controller, vehicle, lockstep)},
    }
    sensing = plant and scenario.senses
    if analysis:
        parameters[ANALYSIS] = {
            **clock, 'vehicle': vehicle, 'every': EVERY, 'ground_truth': sensing
        }  # fmt: skip
    if not plant:
        del parameters[PLANT]
    published = _published(scenario)
    for publisher, values in parameters.items():
        counts = {
            topic: sum(_listens(node, topic, sensing) for node in who if node in nodes)
            for topic, who in SUBSCRIBERS[publisher].items()
            if topic in published
        }
        listed = [f'{topic}={count}' for topic, count in counts.items() if count]
        values.update(_frames(), lockstep=lockstep, expected_subscribers=listed)
    if bag is not None:
        parameters[RECORDER] = {
            **clock,
            **grid,
            'bag': str(bag),
            'topics': [
                topic
                for topic in (*interface.STEP_TOPICS, *interface.OPTIONAL_STEP_TOPICS)
                if topic in published and (plant or topic not in OF_PLANT_ALONE)
            ],
            'strict': lockstep,
            'analysis_every': EVERY if analysis and plant else 0,
            'storage.compression': 'zstd',
            'storage.chunk_size': 1 << 20,
            'storage.max_size': 0,
            'storage.max_duration': 0.0,
            'storage.free_space': 1 << 25,
            'attachments': [f'{name}={path}' for name, path in (attachments or {}).items()],
        }
    return {node: _without_empty_lists(values) for node, values in parameters.items()}


def _published(scenario: Scenario) -> list[str]:
    """Topics of which something is published in this scenario."""
    there = {interface.WRENCH_APPLIED: scenario.acts, interface.GROUND_TRUTH: scenario.senses}
    listed = (*interface.STEP_TOPICS, *interface.OPTIONAL_STEP_TOPICS, *interface.ANALYSIS_TOPICS)
    return [topic for topic in listed if there.get(topic, True)]


def _listens(node: str, topic: str, sensing: bool) -> bool:
    """Whether a node subscribes: analysis looks at the truth where there are sensors."""
    unused = interface.ODOM if sensing else interface.GROUND_TRUTH
    return node != ANALYSIS or topic != unused


def _frames() -> dict[str, str]:
    return {'odom_frame': 'odom_ned', 'base_frame': 'base_link_fsd'}


def _plant(scenario: Scenario, vehicle: str, nodes: list[str], lockstep: bool) -> dict[str, Any]:
    others = [node for node in nodes if node != PLANT]
    parameters: dict[str, Any] = {
        'vehicle': vehicle,
        'step': scenario.step,
        'duration': scenario.duration,
        'start_paused': False,
        'publish_clock': True,
        'recorder_window': WINDOW if RECORDER in nodes and lockstep else 0,
        'integrator': scenario.data['integrator'],
        'seed': scenario.data['seed'],
        'initial.eta': scenario.data['initial']['eta'],
        'initial.nu': scenario.data['initial']['nu'],
        'start_after': others,
        'wrench_timeout': WRENCH_TIMEOUT if lockstep else TIMEOUT,
    }
    parameters |= listed('disturbance', scenario.data['disturbance'])
    parameters |= _of_key(scenario, 'actuators') | _of_key(scenario, 'sensors')
    return parameters | listed('faults', [fault.spec for fault in scenario.faults.entries])


def _of_key(scenario: Scenario, key: str) -> dict[str, Any]:
    """Parameters of a key of the scenario that is a mapping."""
    flat = flattened(part(key), scenario.data.get(key, {}))
    return {f'{key}.{name}': value for name, value in flat.items()}


def _controller(
    scenario: Scenario, controller: str, vehicle: str, lockstep: bool
) -> dict[str, Any]:
    known = {'law': scenario.controller(controller)['law']}
    if 'actuators' in scenario.data:
        known.update(_anti_windup(scenario, controller))
    parameters = {
        **known,
        'vehicle': vehicle,
        'setpoint_pairing': 'exact' if lockstep else 'latest',
        'setpoint_acceleration': 'topic',
        'setpoint_timeout': TIMEOUT,
        'odometry_timeout': TIMEOUT,
        'ramp': ControllerSettings.ramp,
        'stamp_clock': ControllerSettings.stamp_clock,
        'limits.gap': max(ControllerSettings.limits_gap, 10 * scenario.step),
        **{f'limits.{name}': value for name, value in _limits(scenario, lockstep).items()},
        'autostart': True,
    }
    gains = scenario.gain_values(controller)
    return {**parameters, **{f'gains.{name}': numbers(value) for name, value in gains.items()}}


def _anti_windup(scenario: Scenario, controller: str) -> dict[str, Any]:
    """What the controller is told of the actuators."""
    spec = scenario.data['actuators']
    told: dict[str, Any] = {'anti_windup': scenario.controller(controller).get('anti_windup', True)}
    if 'limit' in spec:
        told['actuators.limit'] = numbers(spec['limit'])
    if spec.get('thrusters'):
        told['actuators.thrusters'] = True
    return told


def _limits(scenario: Scenario, lockstep: bool) -> dict[str, Any]:
    """What the controller believes; in lock-step more than the plant, which ends at 100 m/s.

    Beside a vehicle, also the largest wrench of its thrusters, where they are known.
    """
    if lockstep:
        return {'speed': 120.0, 'rate': 120.0, 'acceleration': 1e5}
    usual = ControllerSettings
    believed = {
        'speed': usual.limits_speed,
        'rate': usual.limits_rate,
        'acceleration': usual.limits_acceleration,
    }
    thrusters = scenario.vehicle.thrusters
    return believed if thrusters is None else {**believed, 'wrench': thrusters.largest().tolist()}


def _without_empty_lists(parameters: dict[str, Any]) -> dict[str, Any]:
    # an empty list has no type in a ROS parameter file
    return {name: value for name, value in parameters.items() if value != []}


def parameter_file(parameters: Mapping[str, Mapping[str, Any]], comment: str) -> str:
    """Text of a ROS parameter file; the nodes are found in any namespace."""
    data = {f'/**/{node}': {'ros__parameters': dict(v)} for node, v in parameters.items()}
    body = yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=100)
    return f'# {comment}\n{body}'
