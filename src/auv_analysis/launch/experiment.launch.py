"""One controller of a scenario on the node graph, for `ros2 launch`.

    ros2 launch auv_analysis experiment.launch.py scenario:=case1 controller:=gvc

With `plant:=false` a vehicle driver takes the plant's place: the graph then runs in real time.
"""

import tempfile
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    OpaqueFunction,
    RegisterEventHandler,
    SetEnvironmentVariable,
)
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from auv_analysis.experiment import PACKAGES, write_inputs
from auv_analysis.node_parameters import PLANT, RECORDER, node_parameters, parameter_file
from auv_analysis.scenario import load_scenario
from auv_dynamics.ros.reach import loopback
from auv_dynamics.ros.security import enclave

ARGUMENTS = {
    'scenario': ('case1', 'scenario file, or the bare name of a shipped one'),
    'controller': ('', 'name of one of its controllers; default: the first'),
    'namespace': ('', 'namespace of every node'),
    'plant': ('true', 'simulate the vehicle; false: a driver offers odom and takes wrench'),
    'record': ('true', 'write a bag'),
    'analysis': ('true', 'publish analysis/* live'),
    'use_sim_time': ('', 'default: true with the plant, false without'),
    'lockstep': ('', 'default: true with the plant, false without'),
    'bag': ('', 'folder of the bag; default: runs/<scenario>/<controller>'),
}


def _nodes(context: LaunchContext) -> list:
    values = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}

    def on(name: str, default: bool = True) -> bool:
        return {'': default, 'true': True, 'false': False}[values[name].lower()]

    scenario = load_scenario(values['scenario'])
    controller = values['controller'] or next(iter(scenario.controllers))
    plant = on('plant')
    bag = Path(values['bag'] or Path('runs') / scenario.name / controller) if on('record') else None
    inputs = Path(tempfile.mkdtemp(prefix='auv_gvc_'))
    files = write_inputs(scenario, inputs)
    path = inputs / 'params.yaml'
    parameters = node_parameters(
        scenario,
        controller,
        bag=bag and bag.resolve(),
        plant=plant,
        analysis=on('analysis'),
        lockstep=on('lockstep', plant),
        use_sim_time=on('use_sim_time', plant),
        attachments={**files, 'params.yaml': path},
    )
    path.write_text(parameter_file(parameters, f'{scenario.name}, {controller}: ros2 launch'))
    nodes = {
        name: Node(
            package=PACKAGES[name],
            executable=name,
            name=name,
            namespace=values['namespace'],
            parameters=[str(path)],
            ros_arguments=enclave(name)[1:],
            output='screen',
        )
        for name in parameters
    }
    # the recorder leaves when it has everything, a plant without one when its last step is answered
    last = nodes.get(RECORDER) or nodes.get(PLANT)
    end = [
        RegisterEventHandler(
            OnProcessExit(target_action=last, on_exit=[EmitEvent(event=Shutdown())])
        )
    ]
    # a driver may be on another machine: then the user's discovery range holds, by default this one
    local = [SetEnvironmentVariable(*item) for item in loopback().items()] if plant else []
    return [*local, *nodes.values(), *(end if last else [])]


def generate_launch_description() -> LaunchDescription:
    """Launch description of one run."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=_nodes)])
