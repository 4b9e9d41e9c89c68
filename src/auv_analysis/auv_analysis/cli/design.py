"""`auv design`: which change of a vehicle removes which coupling, proposed and simulated."""

import argparse
import re
from pathlib import Path
from typing import Any

from auv_analysis.cli.arguments import SCENARIO, VEHICLE, add_results, refused

BOUND = re.compile(r'([a-z.]+)=([^:=]+):([^:=]+)')


def add_arguments(command: argparse.ArgumentParser) -> None:
    """A vehicle, which of its couplings, and how far it may be changed."""
    add_results(command)
    command.add_argument('vehicle', help=VEHICLE)
    command.add_argument('--scenario', help=f'{SCENARIO}, with this vehicle in it')
    text = 'coupling to reduce, such as delta_pi.pitch; default: the largest'
    command.add_argument('--reduce', metavar='COUPLING', help=text)
    text = 'NAME=LOWER:UPPER: a design parameter, such as shift.x=-0.05:0.05; may be repeated'
    command.add_argument('--bound', type=_bound, action='append', default=[], help=text)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Which change of a vehicle removes which coupling."""
    from auv_analysis.output.folder import results_folder
    from auv_analysis.output.progress import bar, count, say, waiting
    from auv_analysis.scenario.scaling import plain_name
    from auv_analysis.simulation.simulate import announce
    from auv_analysis.studies.design.prediction import coupling_named, present
    from auv_analysis.studies.design.results import write_results
    from auv_analysis.studies.design.search import propose
    from auv_analysis.studies.design.setting import open_setting

    setting = open_setting(options.vehicle, options.scenario, options.bound)
    if options.reduce is not None:
        coupling_named(options.reduce, present(setting.space.vehicle))
    out = options.out or Path('runs') / plain_name('design', setting.space.vehicle.name)
    scenario = setting.scenario
    with results_folder(out, overwrite=options.overwrite, inputs=scenario.inputs) as results:
        for warning in scenario.warnings:
            say(f'warning: {warning}')
        announce(scenario, [setting.controller])
        with bar(count('couplings')) as shown:
            task = shown.add_task('searching', total=1)
            proposal = propose(
                setting, options.reduce,
                lambda done, of: shown.update(task, completed=done, total=of),
            )  # fmt: skip
        with waiting('simulating the vehicle before and after'):
            found = write_results(proposal, results)
        from auv_analysis.studies.design.report import print_design, write_report

        with waiting('drawing plots, writing the report'):
            write_report(found, results.folder)
        if not options.json:
            print_design(found.document)
    return found.document


def _bound(text: str) -> tuple[str, float, float]:
    from auv_analysis.studies.design.change import NAMES

    match = BOUND.fullmatch(text)
    try:
        if match:
            return match[1], float(match[2]), float(match[3])
    except ValueError:
        pass
    raise refused(f'NAME=LOWER:UPPER with NAME one of {", ".join(NAMES)}', text)
