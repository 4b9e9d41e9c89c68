"""A scenario as ROS parameters: one file per controller, for `auv run`, launch and `ros2 run`."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from auv_analysis.graph.node_settings import AnalysisSettings, RecorderSettings
from auv_analysis.scenario.scenario import Scenario
from auv_dynamics.files.yaml_files import yaml_text
from auv_dynamics.plant.parameters import numbers
from auv_dynamics.ros import interface
from auv_dynamics.ros.settings import GraphSettings, PlantSettings, as_parameters, entries
from auv_dynamics.vehicle.thrusters import SCALED
from auv_gvc_controller.control.setpoint import SetpointSettings
from auv_gvc_controller.control.setpoint_buffer import SAME
from auv_gvc_controller.control.settings import EXACT, LATEST, ControllerSettings

PLANT, SETPOINT, CONTROLLER = interface.PLANT, 'setpoint_node', interface.CONTROLLER
ANALYSIS, RECORDER = 'analysis_node', interface.RECORDER
EVERY = 10  # steps between live analysis samples
WINDOW = 2000  # steps that the plant may be ahead of the recorder
HORIZON = 200  # steps that set-points are published ahead in lock-step
WRENCH_TIMEOUT = 30.0  # s of silence that end a lock-step run
TIMEOUT = 0.5  # s, the real-time watchdogs
OF_PLANT_ALONE = {  # no driver has to offer them
    *(interface.TWIST, interface.DISTURBANCE),
    *(interface.WRENCH_APPLIED, interface.GROUND_TRUTH),
}
SUBSCRIBERS: dict[str, dict[str, set[str]]] = {  # topic -> who subscribes, by publisher
    PLANT: {
        interface.ODOM: {CONTROLLER, SETPOINT, ANALYSIS, RECORDER},
        interface.TWIST: {RECORDER},
        interface.DISTURBANCE: {ANALYSIS, RECORDER},
        interface.WRENCH_APPLIED: {RECORDER},
        interface.GROUND_TRUTH: {ANALYSIS, RECORDER},
    },
    SETPOINT: {
        interface.CMD_VEL: {CONTROLLER, ANALYSIS, RECORDER},
        interface.CMD_ACCEL: {CONTROLLER, RECORDER},
    },
    CONTROLLER: {
        interface.WRENCH: {PLANT, ANALYSIS, RECORDER},
        interface.DISTURBANCE_ESTIMATE: {ANALYSIS, RECORDER},
    },
    ANALYSIS: {topic: {RECORDER} for topic in interface.ANALYSIS_TOPICS},
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
    grid = scenario.step, scenario.duration
    sensing, published = plant and scenario.senses, _published(scenario)
    horizon, attached = HORIZON if lockstep else 0, (attachments or {}).items()
    known, gains = scenario.controller(controller), scenario.gain_values(controller)
    law = {'law': known['law'], 'vehicle': vehicle, 'autostart': True}
    law |= {f'{interface.GAIN}{name}': numbers(value) for name, value in gains.items()}
    settings: dict[str, Any] = {
        PLANT: _plant(scenario, vehicle, nodes, lockstep),
        SETPOINT: SetpointSettings(*grid, horizon, scenario.data['setpoint']),
        CONTROLLER: _controller(scenario, known.get('anti_windup', True), lockstep),
        ANALYSIS: AnalysisSettings(vehicle, EVERY, sensing),
        RECORDER: RecorderSettings(
            *grid,
            str(bag),
            tuple(
                topic
                for topic in (*interface.STEP_TOPICS, *interface.OPTIONAL_STEP_TOPICS)
                if topic in published and (plant or topic not in OF_PLANT_ALONE)
            ),
            strict=lockstep,
            analysis_every=EVERY if analysis and plant else 0,
            attachments=tuple(f'{name}={path}' for name, path in attached),
        ),
    }
    parameters: dict[str, dict[str, Any]] = {}
    for node in nodes:
        counts = {
            topic: sum(_listens(other, topic, sensing) for other in who if other in nodes)
            for topic, who in SUBSCRIBERS.get(node, {}).items()
            if topic in published
        }
        expected = tuple(f'{topic}={count}' for topic, count in counts.items() if count)
        common = GraphSettings(lockstep, expected_subscribers=expected)
        parameters[node] = {
            'use_sim_time': use_sim_time and node != PLANT,
            **(law if node == CONTROLLER else {}),
            **as_parameters(settings[node]),
            **(as_parameters(common) if node != RECORDER else {}),
        }
    return parameters


def _published(scenario: Scenario) -> list[str]:
    """Topics of which something is published in this scenario."""
    there = {interface.WRENCH_APPLIED: scenario.acts, interface.GROUND_TRUTH: scenario.senses}
    listed = (*interface.STEP_TOPICS, *interface.OPTIONAL_STEP_TOPICS, *interface.ANALYSIS_TOPICS)
    return [topic for topic in listed if there.get(topic, True)]


def _listens(node: str, topic: str, sensing: bool) -> bool:
    """Whether a node subscribes: analysis looks at the truth where there are sensors."""
    unused = interface.ODOM if sensing else interface.GROUND_TRUTH
    return node != ANALYSIS or topic != unused


def _plant(scenario: Scenario, vehicle: str, nodes: list[str], lockstep: bool) -> PlantSettings:
    data = scenario.data
    return PlantSettings(
        scenario.step,
        scenario.duration,
        vehicle,
        recorder_window=WINDOW if RECORDER in nodes and lockstep else 0,
        integrator=data['integrator'],
        seed=data['seed'],
        initial_eta=data['initial']['eta'],
        initial_nu=data['initial']['nu'],
        start_after=tuple(node for node in nodes if node != PLANT),
        wrench_timeout=WRENCH_TIMEOUT if lockstep else TIMEOUT,
        disturbance=entries('disturbance', data['disturbance']),
        actuators=data.get('actuators', {}),
        sensors=data.get('sensors', {}),
        faults=entries('faults', [fault.spec for fault in scenario.faults.entries]),
    )


def _controller(scenario: Scenario, anti_windup: bool, lockstep: bool) -> ControllerSettings:
    """Settings of a controller, with what it is told of the actuators.

    In lock-step it believes more than the plant, which ends at 100 m/s. Beside a vehicle it is told
    the largest wrench of the thrusters, where they are known.
    """
    actuators, thrusters = scenario.data.get('actuators', {}), scenario.vehicle.thrusters
    settings = ControllerSettings(
        lockstep,
        LATEST,
        SAME,
        limits_gap=max(ControllerSettings.limits_gap, 10 * scenario.step),
        actuators_limit=tuple(numbers(actuators.get('limit', []))),
        actuators_thrusters=bool(actuators.get('thrusters')),
        actuators_saturation=actuators.get('saturation', SCALED),
        anti_windup=anti_windup,
    )
    if lockstep:
        return replace(
            settings,
            setpoint_pairing=EXACT,
            limits_speed=120.0,
            limits_rate=120.0,
            limits_acceleration=1e5,
        )
    largest = thrusters.largest().tolist() if thrusters is not None else ()
    return replace(settings, limits_wrench=tuple(largest))


def parameter_file(parameters: Mapping[str, Mapping[str, Any]], comment: str) -> str:
    """Text of a ROS parameter file; the nodes are found in any namespace."""
    data = {f'/**/{node}': {'ros__parameters': dict(v)} for node, v in parameters.items()}
    body = yaml_text(data)
    return f'# {comment}\n{body}'
