"""`auv import-vehicle` and `auv export-vehicle`: vehicle parameters from and to other systems."""

import argparse
from typing import Any

from auv_analysis.console import say
from auv_analysis.formats.draft import Choices, Draft
from auv_analysis.formats.reading import read_vehicle
from auv_analysis.formats.sdf import notes, sdf_text
from auv_analysis.formats.writing import vehicle_text
from auv_analysis.new_files import write_text
from auv_dynamics.config import shipped
from auv_dynamics.files import parse_yaml, read_yaml
from auv_dynamics.vehicle_file import vehicle_from_dict

NAMES = {'uuv': 'uuv_simulator', 'gazebo': 'Gazebo', 'mss': 'a list of derivatives'}


def import_vehicle(options: argparse.Namespace) -> dict[str, Any]:
    """A vehicle file of what another system holds of a vehicle."""
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
    _report(draft, list(vehicle.warnings))
    return {
        'format': kind, 'vehicle': data, 'traps': draft.traps, 'assumed': draft.assumed,
        'left_out': draft.left_out, 'warnings': list(vehicle.warnings),
    }  # fmt: skip


def _report(draft: Draft, warnings: list[str]) -> None:
    for title, sentences in draft.report.items():
        for sentence in sentences:
            say(f'{title}: {sentence}')
    for warning in warnings:
        say(f'warning: {warning}')


def export_vehicle(options: argparse.Namespace) -> dict[str, Any]:
    """A vehicle as an SDF model for Gazebo."""
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
