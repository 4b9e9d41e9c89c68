"""`auv linearize`: poles and matrices of a vehicle, or of a scenario's loops, and their margins."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from auv_analysis.cli.arguments import add_delay, add_results, number, refuse_given
from auv_dynamics.files.errors import InputError

if TYPE_CHECKING:
    from auv_analysis.scenario.scenario import Scenario
    from auv_dynamics.vehicle.vehicle import Vehicle


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
    loop = command.add_mutually_exclusive_group()
    add_delay(loop)
    text = 'the delay that `auv check-driver --actuate --json` measured, from its document'
    loop.add_argument('--delay-from', type=Path, metavar='CHECK.json', help=text)
    text = "time constant of the actuators, s; default: the scenario's"
    command.add_argument('--lag', type=number(at_least=0.0), metavar='SECONDS', help=text)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Poles and matrices of a vehicle, or of a scenario's closed loops."""
    from auv_analysis.output.folder import results_folder
    from auv_analysis.output.progress import say, waiting
    from auv_analysis.scenario.scaling import plain_name
    from auv_analysis.scenario.scenario import Scenario
    from auv_analysis.studies.linearize.linearize import linearize
    from auv_analysis.studies.linearize.margins import ControlLoop, stability_margins
    from auv_analysis.studies.linearize.modes import (
        OPEN,
        print_margins,
        print_poles,
        results_of,
    )
    from auv_gvc_controller.laws import OPEN_LOOP
    from auv_gvc_controller.laws.law import refusal

    subject, paths = _subject(options.subject)
    names: list[str] = []
    left_out: list[str] = []
    if isinstance(subject, Scenario):
        left_out = subject.sampled
        asked = dict.fromkeys(options.controller or subject.controllers)
        names = [name for name in asked if subject.controller(name)['law'] != OPEN_LOOP]
    else:
        expected, found = 'a scenario, which has controllers', f'{paths[0]}, a vehicle'
        refuse_given(options, ('controller', 'delay', 'delay_from', 'lag'), expected, found)
    delay = options.delay if options.delay_from is None else measured_delay(options.delay_from)
    eta0 = None if options.attitude is None else [0.0, 0.0, 0.0, *options.attitude]
    try:
        with waiting('linearising'):
            point = {'nu0': options.nu0, 'eta0': eta0}
            models = {OPEN: linearize(subject, **point)}
            models |= {name: linearize(subject, controller=name, **point) for name in names}
            loops = {}
            if isinstance(subject, Scenario) and _is_soon(subject, delay):
                loops = {
                    name: ControlLoop(subject, name, delay, options.lag, options.nu0, eta0)
                    for name in names
                }
            margins = {name: stability_margins(loop) for name, loop in loops.items()}
    except ValueError as error:
        raise InputError(paths[0], *refusal(error)) from None
    out = options.out or Path('runs') / plain_name('linearize', subject.name)
    made = results_of(subject.name, models, margins, left_out)
    document = made.to_json()
    with results_folder(out, overwrite=options.overwrite, inputs=paths) as results:
        made.write(results.folder)
        from auv_analysis.studies.linearize.plots import draw  # with matplotlib, which loads slowly

        with waiting('drawing'):
            draw(models, loops, results.folder / 'figures')
    if not options.json:
        print_poles(document)
        print_margins(margins)
    say(f'matrices: {out / made.file}, pole map: {out / "figures" / "poles.png"}')
    return document


def _is_soon(scenario: Scenario, delay: float | None) -> bool:
    """Whether there can be margins: with any delay that is given, as a longer one is refused."""
    from auv_analysis.output.progress import say
    from auv_analysis.studies.linearize.margins import MOST_PERIODS

    own = scenario.data.get('actuators', {}).get('delay', 0.0)
    if delay is not None or own <= MOST_PERIODS * scenario.step:
        return True
    say(f'{scenario.path}: actuators.delay: no margins beyond {MOST_PERIODS} steps')
    return False


def measured_delay(path: Path) -> float:
    """Delay from command to response in the document of `auv check-driver --json`, s."""
    import json

    from auv_dynamics.files.yaml_files import read_text

    key = 'command_to_response_delay'
    try:
        measured = json.loads(read_text(path, 'check-driver')).get(key)
    except (ValueError, AttributeError):
        raise InputError(path, '', 'the document of auv check-driver --json', 'another') from None
    seconds = measured.get('seconds') if isinstance(measured, dict) else None
    if not isinstance(seconds, int | float) or not seconds >= 0:
        expected = 'a delay in s, which check-driver measures with --actuate'
        raise InputError(path, f'{key}.seconds', expected, seconds)
    return float(seconds)


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
