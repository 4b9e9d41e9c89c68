"""One controller of a scenario on the node graph, for `ros2 launch`.

    ros2 launch auv_analysis experiment.launch.py scenario:=case1 controller:=gvc

With `plant:=false` a vehicle driver takes the plant's place: the graph then runs in real time.
"""

import atexit
import shutil
import tempfile
from functools import partial
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    LogInfo,
    OpaqueFunction,
    RegisterEventHandler,
    SetEnvironmentVariable,
)
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.events.process import ProcessExited
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from auv_analysis.graph.experiment import PACKAGES, write_inputs
from auv_analysis.graph.node_parameters import (
    PLANT,
    RECORDER,
    node_parameters,
    parameter_file,
)
from auv_analysis.scenario.scenario import load_scenario
from auv_analysis.studies.linearize.margins import margin_notes
from auv_dynamics.ros.security import enclave, loopback

SWITCH = ('true', 'false', 'True', 'False')
ARGUMENTS = {  # name -> default, text, choices
    'scenario': ('case1', 'scenario file, or the bare name of a shipped one', None),
    'controller': ('', 'name of one of its controllers; default: the first', None),
    'namespace': ('', 'namespace of every node', None),
    'plant': ('true', 'simulate the vehicle; false: a driver offers odom and takes wrench', SWITCH),
    'publish_clock': ('true', 'the plant publishes /clock; false beside another that does', SWITCH),
    'record': ('true', 'write a bag', SWITCH),
    'analysis': ('true', 'publish analysis/* live', SWITCH),
    'use_sim_time': ('', 'default: true with a /clock of the plant, else false', ('', *SWITCH)),
    'lockstep': ('', 'default: true with the plant, false without', ('', *SWITCH)),
    'bag': ('', 'folder of the bag; default: runs/<scenario>/<namespace>/<controller>', None),
}


def _nodes(context: LaunchContext) -> list:
    values = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}

    def on(name: str, default: bool = True) -> bool:
        return {'': default, 'true': True, 'false': False}[values[name].lower()]

    scenario = load_scenario(values['scenario'])
    controller = values['controller'] or next(iter(scenario.controllers))
    plant = on('plant')
    default = Path('runs') / scenario.name / values['namespace'].strip('/') / controller
    bag = Path(values['bag'] or default) if on('record') else None
    inputs = Path(tempfile.mkdtemp(prefix='auv_gvc_'))
    atexit.register(shutil.rmtree, inputs, ignore_errors=True)
    files = write_inputs(scenario, inputs)
    path = inputs / 'params.yaml'
    parameters = node_parameters(
        scenario,
        controller,
        bag=bag and bag.resolve(),
        plant=plant,
        analysis=on('analysis'),
        lockstep=on('lockstep', plant),
        use_sim_time=on('use_sim_time', plant and on('publish_clock')),
        attachments={**files, 'params.yaml': path},
    )
    if plant:
        parameters[PLANT]['publish_clock'] = on('publish_clock')
    path.write_text(parameter_file(parameters, f'{scenario.name}, {controller}: ros2 launch'))
    # the recorder leaves when it has everything, a plant without one when its last step is answered
    last = RECORDER if bag else PLANT
    actions = []
    for name in parameters:
        node = Node(
            package=PACKAGES[name],
            executable=name,
            name=name,
            namespace=values['namespace'],
            parameters=[str(path)],
            ros_arguments=enclave(name)[1:],
            output='screen',
        )
        ended = OnProcessExit(target_action=node, on_exit=partial(_on_exit, name, name == last))
        actions += [RegisterEventHandler(ended), node]
    # a driver may be on another machine: then the user's discovery range holds, by default this one
    local = [SetEnvironmentVariable(*item) for item in loopback().items()] if plant else []
    said = [f'warning: {text}' for text in scenario.warnings]
    said += margin_notes(scenario, [controller], driver=not plant)
    return [*(LogInfo(msg=text) for text in said), *local, *actions]


def _on_exit(name: str, last: bool, event: ProcessExited, context: LaunchContext) -> list:
    """End with the last node; one that fails ends the launch with an exit code that says so."""
    if event.returncode and not context.is_shutdown:
        raise RuntimeError(f'{name} ended with exit code {event.returncode}')
    return [EmitEvent(event=Shutdown(reason=f'{name} has ended'))] if last else []


def generate_launch_description() -> LaunchDescription:
    """Launch description of one run."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text, choices=choices)
        for name, (default, text, choices) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=_nodes)])
