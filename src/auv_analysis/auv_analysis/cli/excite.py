"""`auv excite`: an excitation for identification, with the confidence intervals to expect."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from auv_analysis.cli.arguments import VEHICLE, add_no_report, add_results, number, whole
from auv_analysis.studies.excite import SPEED

DEPTH = 10.0  # m


def add_arguments(command: argparse.ArgumentParser) -> None:
    """A vehicle, what is free, and what the motion must stay within."""
    add_results(command)
    command.add_argument('vehicle', help=f'{VEHICLE}: the best guess that there is')
    text = 'what is to be learned beside the usual, as in auv identify; may be repeated'
    command.add_argument('--free', action='append', default=[], metavar='NAME', help=text)
    text = 'what keeps the value of the vehicle file; may be repeated'
    command.add_argument('--fixed', action='append', default=[], metavar='NAME', help=text)
    positive = number(above=0.0)
    text = 'length of the recording, s; default: 60, or 45, 30 or 20 where the bounds '
    text += 'cannot be kept for longer'
    command.add_argument('--duration', type=number(at_least=20.0, at_most=3600.0), help=text)
    text = 's, of commands and measurements; default: 0.05, or less for a vehicle that damping '
    text += 'stops faster'
    command.add_argument('--step', type=number(at_least=0.005, at_most=0.2), help=text)
    text = 'largest wrench, 1 or 6 numbers, N and N m; 0: an axis that is not driven; default: a '
    text += 'third of what the thrusters give, else what moves the vehicle at the speed'
    command.add_argument('--limit', type=number(at_least=0.0), nargs='+', metavar='N', help=text)
    text = f'largest speed, m/s; default: {SPEED:g}, or more where vehicles near the file drift as '
    text += 'fast'
    command.add_argument('--speed', type=positive, metavar='M/S', help=text)
    text = 'largest angular rate, rad/s; default: twice the number of the speed, or more where '
    text += 'vehicles near the file swing as fast by themselves'
    command.add_argument('--rate', type=positive, metavar='RAD/S', help=text)
    room = command.add_mutually_exclusive_group()
    text = 'size of the tank, m: north, east, down; the vehicle starts in its middle'
    room.add_argument('--tank', type=positive, nargs=3, metavar=('X', 'Y', 'Z'), help=text)
    text = f'open water of this depth, m, the vehicle halfway down; default: {DEPTH:g}'
    room.add_argument('--depth', type=positive, default=DEPTH, metavar='M', help=text)
    text = 'drive set-points of GVC: for a vehicle that does not stay where it is by itself'
    command.add_argument('--closed-loop', action='store_true', help=text)
    text = 'by how much the vehicle may differ from its file and must still stay inside; '
    command.add_argument('--spread', type=number(at_least=0.0, at_most=0.5), default=0.1,
                         help=f'{text}default: 0.1')  # fmt: skip
    group = command.add_argument_group('what the prediction assumes')
    for option, default, unit in (
        ('velocity-noise', 0.005, 'standard deviation, m/s and rad/s'),
        ('attitude-noise', 0.003, 'standard deviation, rad'),
    ):
        group.add_argument(f'--{option}', type=number(above=0.0, at_most=1.0), default=default,
                           metavar='SD', help=f'{unit}; default: {default:g}')  # fmt: skip
    text = 'of the actuators, s; default: 0.1'
    group.add_argument('--lag', type=number(at_least=0.0, at_most=2.0), default=0.1, metavar='S',
                       help=text)  # fmt: skip
    text = 'of phases and drawn vehicles; default: 0'
    command.add_argument('--seed', type=whole(0, 2**63 - 1), default=0, help=text)
    add_no_report(command)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """What to drive so that a model can be identified."""
    import os
    from functools import partial

    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # small matrices: threads only wait
    import numpy as np

    from auv_analysis.output.folder import results_folder
    from auv_analysis.output.progress import bar, say, waiting
    from auv_analysis.scenario.scaling import plain_name
    from auv_analysis.studies.excite.drive import Request, bounds_of
    from auv_analysis.studies.excite.excite import LENGTHS, planned, usual_step
    from auv_analysis.studies.excite.report import (
        SCENARIO,
        print_results,
        results_of,
        scenario_text,
        write_report,
    )
    from auv_analysis.studies.identify.unknowns import DEFAULT
    from auv_dynamics.files.errors import InputError
    from auv_dynamics.files.shipped import shipped
    from auv_dynamics.vehicle.vehicle_file import load_vehicle

    vehicle = load_vehicle(options.vehicle)
    if options.limit is not None and len(options.limit) not in (1, 6):
        raise InputError('--limit', '', '1 or 6 numbers', f'{len(options.limit)} numbers')
    wrench = None if options.limit is None else np.broadcast_to(np.array(options.limit), 6)
    room = np.array(options.tank or (np.inf, np.inf, options.depth))
    bounds = partial(bounds_of, vehicle, room, wrench, options.speed, options.rate)
    lengths = [options.duration] if options.duration else LENGTHS
    request = Request(
        options.vehicle, bounds(), lengths[0], options.step or usual_step(vehicle, bounds()),
        (*DEFAULT, *options.free), options.fixed, options.lag, options.velocity_noise,
        options.attitude_noise, options.spread, options.closed_loop, options.seed,
    )  # fmt: skip
    out = options.out or Path('runs') / plain_name('excite', vehicle.name)
    with results_folder(
        out, overwrite=options.overwrite, inputs=[shipped('vehicles', options.vehicle)]
    ) as folder:
        with bar() as shown:
            task = shown.add_task('phases', total=1)
            found = planned(
                request, lengths, bounds,
                lambda text, share: shown.update(task, description=text, completed=share),
            )  # fmt: skip
        if found.request.duration < lengths[0] - request.step:
            say(f'{found.request.duration:g} s: in longer recordings the motion leaves its bounds')
        if found.request.clipped:
            say('the law also asks for axes that nothing drives: record wrench_applied, identify '
                'with --applied')  # fmt: skip
        results = results_of(found)
        (folder.folder / SCENARIO).write_text(scenario_text(found), 'utf-8')
        results.write(folder.folder)
        if not options.no_report:
            with waiting('drawing plots, writing the report'):
                write_report(found, results, folder.folder)
        if not options.json:
            print_results(results, out)
    return results.to_json()
