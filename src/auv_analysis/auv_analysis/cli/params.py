"""`auv params`: the parameter file that `auv run` would write."""

import argparse
from pathlib import Path
from typing import Any

from auv_analysis.cli.arguments import SCENARIO, TO_FILE, add_delay, add_results
from auv_dynamics.files.errors import InputError


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Scenario, controller, and whether the plant takes part."""
    add_results(command, TO_FILE)
    command.add_argument('scenario', help=SCENARIO)
    command.add_argument('--controller', required=True)
    command.add_argument('--real-time', action='store_true', help='in real time, not in lock-step')
    text = "for a vehicle driver in the plant's place: in real time, without simulated time"
    command.add_argument('--no-plant', action='store_true', help=text)
    add_delay(command)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """The parameter file that `auv run` would write, for plain `ros2 run`."""
    from auv_analysis.cli.scenario_runs import say_margins
    from auv_analysis.graph.node_parameters import CONTROLLER, node_parameters, parameter_file
    from auv_analysis.output.new_files import write_text
    from auv_analysis.output.progress import say
    from auv_analysis.scenario.scenario import load_scenario

    scenario = load_scenario(options.scenario)
    plant = not options.no_plant
    attachments = {}
    if not plant and options.out is not None:  # what a bag needs to be read by itself
        attachments = {'params.yaml': options.out, 'vehicle.yaml': scenario.vehicle_path}
    bag = Path('runs') / scenario.name / options.controller
    parameters = node_parameters(
        scenario,
        options.controller,
        bag=bag,
        plant=plant,
        lockstep=plant and not options.real_time,
        use_sim_time=plant,
        vehicle=scenario.shipped_vehicle,
        attachments={name: path.resolve() for name, path in attachments.items()},
    )
    if note := _missing(parameters[CONTROLLER], CONTROLLER):
        say(note)
    say_margins(scenario, [options.controller], options.delay, driver=not plant)
    command = f'auv params {scenario.name} --controller {options.controller}'
    text = parameter_file(parameters, command)
    if options.out is not None:
        write_text(options.out, text, overwrite=options.overwrite, inputs=scenario.inputs)
    elif not options.json:
        print(text, end='')
    return parameters


def _missing(controller: dict[str, Any], node: str) -> str:
    """Parameters that the controller needs and the scenario does not give."""
    from auv_analysis.replay.open_loop import recorded_settings

    try:
        recorded_settings(controller, node).check_bounded()
    except InputError as error:
        return f'{error}; give it, or the scenario `actuators: {{limit: ...}}`'
    return ''
