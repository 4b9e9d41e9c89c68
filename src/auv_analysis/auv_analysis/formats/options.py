"""The options of `auv import-vehicle` and `auv export-vehicle`."""

import argparse
from pathlib import Path

VEHICLE = 'a vehicle file, or the bare name of a shipped one'


def add_import(command: argparse.ArgumentParser) -> None:
    """File, format, and what the file cannot say for itself."""
    command.add_argument('file', type=Path, metavar='FILE', help='of the other system')
    formats = ('auto', 'uuv', 'gazebo', 'mss')
    text = 'uuv_simulator, Gazebo, a list of derivatives; default: by its contents'
    command.add_argument('--format', choices=formats, default='auto', help=text)
    command.add_argument('--source', help='citation for the vehicle file')
    text = (
        'of damping, lift and added mass in the file, where it is not the usual one of its format'
    )
    command.add_argument('--sign', choices=('sname', 'positive'), help=text)
    text = 'what Ixy, Ixz, Iyz of a list are: of x y dm, or entries of the tensor'
    command.add_argument('--products', choices=('integral', 'tensor'), help=text)
    text = 'point that the tensor of a list is about'
    command.add_argument('--inertia-reference', choices=('cg', 'co'), help=text)
    text = 'what Yuv, Nuv, Muw ... of a list are: of body and fins, or with the terms of added mass'
    command.add_argument('--lift', choices=('alone', 'combined'), help=text)
    text = 'xUU is meant as xUabsU (Gazebo)'
    command.add_argument('--quadratic-abs', action='store_true', help=text)
    text = 'W and B stand for each other'
    command.add_argument('--swap-weight-buoyancy', action='store_true', help=text)
    text = 'leave out, and report, what a vehicle file cannot hold'
    command.add_argument('--leave-out', action='store_true', help=text)
    for name, unit in (('water-density', 'kg/m3'), ('gravity', 'm/s2'), ('volume', 'm3')):
        command.add_argument(f'--{name}', type=float, metavar='VALUE', help=unit)
    point = ('X', 'Y', 'Z')
    text = 'm, forward-starboard-down'
    command.add_argument('--center-of-buoyancy', nargs=3, type=float, metavar=point, help=text)


def add_export(command: argparse.ArgumentParser) -> None:
    """Vehicle, format, and where the added mass goes."""
    command.add_argument('vehicle', help=VEHICLE)
    command.add_argument('--format', choices=('gazebo',), default='gazebo', help='default: gazebo')
    text = 'xDotU ... of the plugin, or <fluid_added_mass> of the link; default: plugin'
    places = ('plugin', 'link')
    command.add_argument('--added-mass', choices=places, default='plugin', help=text)
