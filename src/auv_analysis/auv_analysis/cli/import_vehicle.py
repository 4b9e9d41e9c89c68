"""`auv import-vehicle`: a vehicle file from that of another system."""

import argparse
from pathlib import Path
from typing import Any

from auv_analysis.cli.arguments import TO_FILE, add_results

NAMES = {'uuv': 'uuv_simulator', 'gazebo': 'Gazebo', 'mss': 'a list of derivatives'}


def add_arguments(command: argparse.ArgumentParser) -> None:
    """File, format, and what the file cannot say for itself."""
    add_results(command, TO_FILE)
    command.add_argument('file', type=Path, metavar='FILE', help='of the other system')
    formats = ('auto', 'uuv', 'gazebo', 'mss')
    text = 'uuv_simulator, Gazebo, a list of derivatives; default: by its contents'
    command.add_argument('--format', choices=formats, default='auto', help=text)
    command.add_argument('--source', help='citation for the vehicle file')
    text = 'sign convention of damping, lift, added mass, where not the usual one of the format'
    command.add_argument('--sign', choices=('sname', 'positive'), help=text)
    text = 'products of inertia Ixy, Ixz, Iyz of a list: integrals of x y dm, or tensor entries'
    command.add_argument('--products', choices=('integral', 'tensor'), help=text)
    text = 'reference point of the inertia tensor of a list'
    command.add_argument('--inertia-reference', choices=('cg', 'co'), help=text)
    text = 'what Yuv, Nuv, Muw ... of a list are: of body and fins, or with the terms of added mass'
    command.add_argument('--lift', choices=('alone', 'combined'), help=text)
    text = 'xUU is meant as xUabsU (Gazebo)'
    command.add_argument('--quadratic-abs', action='store_true', help=text)
    text = 'W and B are exchanged in the file'
    command.add_argument('--swap-weight-buoyancy', action='store_true', help=text)
    text = 'leave out, and report, what a vehicle file cannot hold'
    command.add_argument('--leave-out', action='store_true', help=text)
    for name, unit in (('water-density', 'kg/m3'), ('gravity', 'm/s2'), ('volume', 'm3')):
        command.add_argument(f'--{name}', type=float, metavar='VALUE', help=unit)
    point = ('X', 'Y', 'Z')
    text = 'm, forward-starboard-down'
    command.add_argument('--center-of-buoyancy', nargs=3, type=float, metavar=point, help=text)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """A vehicle file of what another system holds of a vehicle."""
    from auv_analysis.formats.convert import read_vehicle, vehicle_text
    from auv_analysis.formats.imported import Choices
    from auv_analysis.output.new_files import write_text
    from auv_analysis.output.progress import say
    from auv_dynamics.files.yaml_files import parse_yaml
    from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict

    chosen = {name: getattr(options, name) for name in Choices.__dataclass_fields__}
    kind, draft = read_vehicle(options.file, options.format, Choices(**chosen))
    name = options.out.stem if options.out else draft.name
    source = options.source or f'imported from {NAMES[kind]}, {options.file.name}'
    text = vehicle_text(draft, name, source)
    place = options.out or options.file
    data = parse_yaml(text, place, 'vehicle')
    vehicle = vehicle_from_dict(data, place)
    if options.out is not None:
        write_text(options.out, text, overwrite=options.overwrite, inputs=[options.file])
    elif not options.json:
        print(text, end='')
    warnings = list(vehicle.warnings)
    for title, sentences in {**draft.report, 'warning': warnings}.items():
        for sentence in sentences:
            say(f'{title}: {sentence}')
    return {
        'format': kind, 'vehicle': data, 'traps': draft.traps, 'assumed': draft.assumed,
        'left_out': draft.left_out, 'warnings': warnings,
    }  # fmt: skip
