"""`auv export-vehicle`: a vehicle as an SDF model for Gazebo."""

import argparse
from typing import Any

from auv_analysis.cli.arguments import TO_FILE, VEHICLE, add_results


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Vehicle, format, and where the added mass goes."""
    add_results(command, TO_FILE)
    command.add_argument('vehicle', help=VEHICLE)
    command.add_argument('--format', choices=('gazebo',), default='gazebo', help='default: gazebo')
    text = 'xDotU ... of the plugin, or <fluid_added_mass> of the link; default: plugin'
    places = ('plugin', 'link')
    command.add_argument('--added-mass', choices=places, default='plugin', help=text)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """A vehicle as an SDF model for Gazebo."""
    from auv_analysis.formats.sdf_export import notes, sdf_text
    from auv_analysis.output.new_files import write_text
    from auv_analysis.output.progress import say
    from auv_dynamics.files.shipped import shipped
    from auv_dynamics.files.yaml_files import read_yaml
    from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict

    path = shipped('vehicles', options.vehicle)
    data = read_yaml(path, 'vehicle')
    vehicle = vehicle_from_dict(data, path)
    text = sdf_text(vehicle, data['environment'], path, options.added_mass)
    if options.out is not None:
        write_text(options.out, text, overwrite=options.overwrite, inputs=[path])
    elif not options.json:
        print(text, end='')
    said = notes(vehicle, options.added_mass)
    for sentence in said:
        say(sentence)
    return {'format': options.format, 'sdf': text, 'notes': said}
