"""`auv import-vehicle`: a vehicle file from that of another system, or from a hull's mesh."""

import argparse
from pathlib import Path
from typing import Any

from auv_analysis.cli.arguments import TO_FILE, add_results, number, whole

NAMES = {
    'uuv': 'uuv_simulator', 'gazebo': 'Gazebo', 'mss': 'a list of derivatives', 'mesh': 'a mesh',
}  # fmt: skip


def add_arguments(command: argparse.ArgumentParser) -> None:
    """File, format, and what the file cannot say for itself."""
    add_results(command, TO_FILE)
    command.add_argument(
        'file', type=Path, metavar='FILE', help='of the other system; STL, OBJ, PLY'
    )
    formats = ('auto', 'uuv', 'gazebo', 'mss', 'mesh')
    text = 'uuv_simulator, Gazebo, a list of derivatives, a mesh; default: by its contents'
    command.add_argument('--format', choices=formats, default='auto', help=text)
    command.add_argument('--source', help='citation for the vehicle file')
    text = 'sign convention of damping, lift, added mass, where not the usual one of the format'
    command.add_argument('--sign', choices=('sname', 'positive'), help=text)
    text = 'Ixy, Ixz, Iyz of a list or of --inertia: integrals of x y dm, or entries of the tensor'
    command.add_argument('--products', choices=('integral', 'tensor'), help=text)
    text = 'reference point of the inertia tensor of a list or of --inertia (default there: cg)'
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
    _add_mesh(command, point)


def _add_mesh(command: argparse.ArgumentParser, point: tuple[str, ...]) -> None:
    """What a mesh cannot say; see docs/vehicle-formats.md."""
    mesh = command.add_argument_group('a mesh', 'needs pip install -r requirements-mesh.txt')
    positive = number(above=0)
    text = 'kg, with the water inside a flooded hull'
    mesh.add_argument('--mass', type=positive, metavar='VALUE', help=text)
    mesh.add_argument('--units', choices=('mm', 'cm', 'm', 'in'), help='of its coordinates')
    text = 'directions of its x, y, z: front, back, left, right, up, down; flu: as in ROS'
    mesh.add_argument('--axes', metavar='LETTERS', help=text)
    text = "the body's origin in the mesh's axes and units; default: its own"
    mesh.add_argument('--origin', nargs=3, type=float, metavar=point, help=text)
    text = 'm, forward-starboard-down; default: the centre of buoyancy'
    mesh.add_argument('--center-of-gravity', '--cog', nargs=3, type=float, metavar=point, help=text)
    text = 'Ixx Iyy Izz, and perhaps Ixy Ixz Iyz, kg m2; default: uniform density'
    mesh.add_argument('--inertia', nargs='+', type=float, metavar='VALUE', help=text)
    text = 'relative error of the added mass that ends the refinement; default: 0.02'
    mesh.add_argument('--tolerance', type=number(above=0, below=1), metavar='VALUE', help=text)
    text = 'at most so many (48 bytes for each pair of them); default: 5500'
    mesh.add_argument('--panels', type=whole(2000, 30000), metavar='COUNT', help=text)


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
