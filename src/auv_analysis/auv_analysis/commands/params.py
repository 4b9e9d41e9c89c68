"""`auv params`: the parameter file that `auv run` would write."""

import argparse
from pathlib import Path
from typing import Any

from auv_analysis.node_parameters import node_parameters, parameter_file
from auv_analysis.scenario import load_scenario
from auv_dynamics.files import InputError, reason


def params(options: argparse.Namespace) -> dict[str, Any]:
    """The parameter file that `auv run` would write, for plain `ros2 run`."""
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
    text = parameter_file(
        parameters, f'auv params {scenario.name} --controller {options.controller}'
    )
    if options.out is not None:
        if options.out.exists() and not options.overwrite:
            raise InputError(options.out, '--out', 'a new file, or --overwrite', 'an existing file')
        try:
            options.out.parent.mkdir(parents=True, exist_ok=True)
            options.out.write_text(text, encoding='utf-8')
        except OSError as error:
            found = reason(error)
            raise InputError(options.out, '--out', 'a file that can be written', found) from None
    elif not options.json:
        print(text, end='')
    return parameters
