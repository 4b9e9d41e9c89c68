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
    lockstep = not options.real_time
    bag = Path('runs') / scenario.name / options.controller
    parameters = node_parameters(
        scenario,
        options.controller,
        bag=bag,
        lockstep=lockstep,
        vehicle=scenario.shipped_vehicle,
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
