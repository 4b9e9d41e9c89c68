"""`auv linearize`: poles and matrices of a vehicle, or of a scenario's closed loops."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from auv_analysis.cli.arguments import add_results
from auv_dynamics.files.errors import InputError

if TYPE_CHECKING:
    from auv_analysis.scenario.scenario import Scenario
    from auv_dynamics.vehicle.vehicle import Vehicle

DOCUMENT = 'linearization.json'
LONGEST = 90  # of the name in that of the folder


def add_arguments(command: argparse.ArgumentParser) -> None:
    """What is linearised, and about which point."""
    add_results(command)
    text = 'of a vehicle or a scenario: a file, or the bare name of a shipped one'
    command.add_argument('subject', metavar='VEHICLE_OR_SCENARIO', help=text)
    text = "only this one of a scenario's; may be repeated"
    command.add_argument('--controller', action='append', help=text)
    six = ('U', 'V', 'W', 'P', 'Q', 'R')
    text = 'velocity of the operating point, m/s and rad/s; default: at rest'
    command.add_argument('--nu0', nargs=6, type=float, metavar=six, help=text)
    text, three = 'attitude of the operating point, rad; default: level', ('PHI', 'THETA', 'PSI')
    command.add_argument('--attitude', nargs=3, type=float, metavar=three, help=text)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Poles and matrices of a vehicle, or of a scenario's closed loops."""
    from auv_analysis.output.folder import results_folder
    from auv_analysis.output.new_files import write_json
    from auv_analysis.output.progress import say, waiting
    from auv_analysis.scenario.scaling import UNFIT
    from auv_analysis.scenario.scenario import Scenario
    from auv_analysis.studies.linearize.modes import document_of, linear_models, print_poles
    from auv_gvc_controller.laws.law import refusal

    subject, paths = _subject(options.subject)
    names: list[str] = []
    left_out: list[str] = []
    if isinstance(subject, Scenario):
        left_out = subject.sampled
        names = list(dict.fromkeys(options.controller or subject.controllers))
        for name in names:
            subject.controller(name)
    elif options.controller:
        expected = 'a scenario, which has controllers'
        raise InputError(paths[0], '--controller', expected, 'a vehicle')
    eta0 = None if options.attitude is None else [0.0, 0.0, 0.0, *options.attitude]
    try:
        with waiting('linearising'):
            models = linear_models(subject, names, options.nu0, eta0)
    except ValueError as error:
        raise InputError(paths[0], *refusal(error)) from None
    folder = f'linearize_{UNFIT.sub("_", subject.name)[:LONGEST]}'
    out = options.out or Path('runs') / folder
    document = document_of(subject.name, models, left_out)
    with results_folder(out, overwrite=options.overwrite, inputs=paths) as results:
        write_json(results.folder / DOCUMENT, document)
        from auv_analysis.studies.linearize.plots import draw  # with matplotlib, which loads slowly

        with waiting('drawing the pole map'):
            draw(models, results.folder / 'figures')
    if not options.json:
        print_poles(document)
    say(f'matrices: {out / DOCUMENT}, pole map: {out / "figures" / "poles.png"}')
    return document


def _subject(given: str) -> tuple[Vehicle | Scenario, list[Path]]:
    """What is linearised, a scenario being what has controllers, and the files it was read from."""
    from auv_analysis.scenario.scenario import load_scenario
    from auv_dynamics.files.shipped import shipped
    from auv_dynamics.files.yaml_files import read_yaml
    from auv_dynamics.vehicle.vehicle_file import load_vehicle

    for kind in ('scenarios', 'vehicles'):
        try:
            path = shipped(kind, given)
        except InputError:
            continue
        if 'controllers' in read_yaml(path, 'vehicle or scenario'):
            scenario = load_scenario(path)
            return scenario, scenario.inputs
        return load_vehicle(path), [path]
    expected = 'a vehicle or scenario file, or the bare name of a shipped one'
    raise InputError(given, '', expected, 'no such file or name')
