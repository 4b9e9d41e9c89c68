"""`auv new`: a commented vehicle, scenario or law of one's own that works as it is."""

import argparse
import os
from pathlib import Path
from typing import Any

from auv_analysis.cli.arguments import VEHICLE, refuse_given
from auv_dynamics.files.errors import InputError, refusing


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Kind and name of what is made."""
    command.add_argument('kind', choices=('vehicle', 'scenario', 'law'), help='what to make')
    command.add_argument('name', metavar='NAME', help='of the new file, in the working folder')
    command.add_argument('--vehicle', help=f'of a scenario or law: {VEHICLE}')


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Write the files into the working folder; nothing is ever overwritten."""
    from auv_analysis.scenario.templates import (
        checked_name,
        law_files,
        scenario_files,
        vehicle_files,
    )

    kind, vehicle = options.kind, options.vehicle
    name = checked_name(kind, options.name)
    if kind == 'vehicle':
        refuse_given(options, ('vehicle',), 'a scenario or a law to be made', 'vehicle')
        files = vehicle_files(name)
    else:
        files = (scenario_files if kind == 'scenario' else law_files)(name, vehicle)
    _write({Path(file): text for file, text in files.items()})
    following = [f'auv simulate {name}.yaml', f'auv run {name}.yaml']
    if kind == 'vehicle':
        scenario = f'auv new scenario {name}_case1 --vehicle {name}.yaml'
        following = [f'auv check-vehicle {name}.yaml', scenario]
    if not options.json:
        print(f'made {" and ".join(files)}')
        print('next:', *(f'  {line}' for line in following), sep='\n')
    return {'files': list(files), 'next': following}


def _write(files: dict[Path, str]) -> None:
    for path in files:
        if os.path.lexists(path):
            raise InputError(path, '', 'a name that is free here', 'an existing file')
    for path, text in files.items():
        expected = 'a file that can be written'
        with refusing(path, '', expected), path.open('x', encoding='utf-8') as file:
            file.write(text)
