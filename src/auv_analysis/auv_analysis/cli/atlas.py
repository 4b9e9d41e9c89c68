"""`auv atlas`: inertial couplings of vehicles, side by side."""

import argparse
from pathlib import Path
from typing import Any

from auv_analysis.cli.arguments import add_results
from auv_dynamics.files.errors import InputError


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Which vehicles."""
    add_results(command)
    text = 'a vehicle file, beside the shipped ones'
    command.add_argument('vehicles', nargs='*', metavar='VEHICLE', help=text)
    command.add_argument('--only', action='store_true', help='the given vehicles alone')


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Couplings of the shipped vehicles and of the given ones, or of these alone."""
    from auv_analysis.output.folder import results_folder
    from auv_analysis.output.progress import say, waiting
    from auv_analysis.studies.atlas.atlas import charts, results_of
    from auv_dynamics.files.shipped import shipped, shipped_names

    given = list(dict.fromkeys(options.vehicles))
    if options.only and not given:
        raise InputError('--only', '', 'VEHICLE, one at least', 'none')
    known = [] if options.only else shipped_names('vehicles')
    vehicles = [*known, *(vehicle for vehicle in given if vehicle not in known)]
    out = options.out or Path('runs') / 'atlas'
    files = [shipped('vehicles', vehicle) for vehicle in vehicles]
    with results_folder(out, overwrite=options.overwrite, inputs=files) as results:
        with waiting(f'case 1 on {len(vehicles)} vehicles'):
            found = charts(vehicles)
        atlas = results_of(found)
        atlas.write(results.folder)
        from auv_analysis.studies.atlas.plots import draw  # with matplotlib, which loads slowly
        from auv_analysis.studies.atlas.report import findings, write_report

        with waiting('drawing plots, writing the report'):
            write_report(results.folder, found, draw(found, results.folder / 'figures'))
        for sentence in findings(found):
            say(sentence.text)
    return atlas.to_json()
