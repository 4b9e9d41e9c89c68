"""`auv identify`: a model with its uncertainty from recordings, and a vehicle file."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from auv_analysis.cli.arguments import (
    VEHICLE,
    add_no_report,
    add_results,
    add_topics,
    number,
    refused,
    topic_map,
    whole,
)
from auv_dynamics.files.errors import InputError

if TYPE_CHECKING:
    from auv_analysis.studies.identify.record import Record
    from auv_dynamics.vehicle.vehicle import Vehicle


PRIOR = {  # JSON schema of what `--prior` reads
    'additionalProperties': {
        'title': 'a mapping with value and a positive deviation',
        'type': 'object', 'required': ['value', 'deviation'], 'additionalProperties': False,
        'properties': {
            'value': {'title': 'a number', 'type': 'number'},
            'deviation': {'title': 'a positive number', 'type': 'number', 'exclusiveMinimum': 0},
        },
    }
}  # fmt: skip


class Trial(NamedTuple):
    """What both commands are given: a vehicle, and recordings to learn from and held out.

    Attributes
    ----------
    vehicle : as filed
    training, held : recordings
    notes : what is odd about them
    inputs : files that no result may replace
    out : folder of the results

    """

    vehicle: Vehicle
    training: list[Record]
    held: list[Record]
    notes: list[str]
    inputs: list[Path]
    out: Path


def add_bags(command: argparse.ArgumentParser) -> None:
    """Recordings, and what their topics hold."""
    command.add_argument('bags', nargs='+', type=Path, metavar='BAG', help='one or several')
    text = f'{VEHICLE}: where the search begins, and what is kept where the data are silent'
    command.add_argument('--vehicle', required=True, help=text)
    text = 'only this part of each bag, s from its start; may be repeated'
    command.add_argument('--part', type=_span, action='append', default=[], metavar='FROM:TO',
                         help=text)  # fmt: skip
    text = 'the wrench that acted (wrench_applied) in place of the command'
    command.add_argument('--applied', action='store_true', help=text)
    text = 'what the model does not see: a share of the recordings, their last part, or a bag; '
    command.add_argument('--holdout', default='0.25', metavar='SHARE_OR_BAG',
                         help=f'{text}default: 0.25')  # fmt: skip
    add_topics(command)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Recordings, what is free, and what somebody knows."""
    add_results(command)
    add_bags(command)
    text = 'what is searched beside the usual: M, M.diagonal, M.pitch.surge, '
    text += 'D_linear, D_linear.full, D_quadratic, restoring, lag, delay, gain, bias, current'
    command.add_argument('--free', action='append', metavar='NAME', help=text)
    text = 'what keeps the value of the vehicle file; may be repeated'
    command.add_argument('--fixed', action='append', default=[], metavar='NAME', help=text)
    text = 'YAML file: coefficient to {value, deviation} of what is known beforehand'
    command.add_argument('--prior', metavar='FILE', help=text)
    text = 'length of the segments, s; default: by the instability of the vehicle'
    command.add_argument('--segment', type=number(above=0.0), metavar='S', help=text)
    text = (
        'gain from 0 to below 1, or auto: along segments the state follows the measurements by it; '
    )
    text += 'for recordings with a disturbance that the model lacks; default: 0'
    command.add_argument('--observer', type=_gain, default=0.0, metavar='GAIN', help=text)
    text = 'intervals by N refits to blocks of time drawn anew, beside the usual ones'
    command.add_argument('--bootstrap', type=whole(at_least=40), default=0, metavar='N', help=text)
    text = 'profile likelihood of these coefficients, as of --free, with commas between; auto: of '
    text += 'those whose cost is far from a parabola'
    command.add_argument('--profile', metavar='NAMES', help=text)
    text = 'write the vehicle file even where the recording contradicts the prior'
    command.add_argument('--accept', action='store_true', help=text)
    add_no_report(command)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """A model with its uncertainty from recordings, and a vehicle file."""
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # small matrices: threads only wait
    from auv_analysis.output.folder import results_folder
    from auv_analysis.output.progress import say, waiting
    from auv_analysis.studies.identify.identify import Settings, identify
    from auv_analysis.studies.identify.report import print_results, results_of, write_report
    from auv_analysis.studies.identify.unknowns import DEFAULT
    from auv_analysis.studies.identify.vehicle_text import vehicle_text, write_vehicle
    from auv_dynamics.files.errors import FailedError
    from auv_dynamics.files.yaml_files import read_yaml

    applied = ['lag', 'delay'] if options.applied else []  # nothing is between it and the vehicle
    settings = Settings(
        free=(*DEFAULT, *(options.free or ())), fixed=[*options.fixed, *applied],
        believed=_believed(options.prior), segment=options.segment,
        origin=options.prior or 'options', observer=options.observer, bootstrap=options.bootstrap,
        profile=[name.strip() for name in options.profile.split(',')] if options.profile else (),
    )  # fmt: skip
    trial = read(options, 'identify')
    vehicle, data = trial.vehicle, read_yaml(trial.inputs[-1], 'vehicle')
    with results_folder(trial.out, overwrite=options.overwrite, inputs=trial.inputs) as folder:
        found = identify(trial.training, trial.held, vehicle, settings, lambda t: say(f'  {t}'))
        results = results_of(found, trial.notes, accepted=options.accept)
        if results.facts['file']:
            names = dict.fromkeys(record.name for record in trial.training)
            source = f'identified from {", ".join(names)}; prior: '
            source += str(data.get('source') or vehicle.name)
            name = f'{vehicle.name}_identified'
            text = vehicle_text(found, data, name, source)
            write_vehicle(text, results, folder.folder)
        results.write(folder.folder)
        if not options.no_report:
            with waiting('drawing plots, writing the report'):
                write_report(found, results, folder.folder)
        if not options.json:
            print_results(results, trial.out)
    if not results.facts['file']:
        raise FailedError(results.facts['verdict'], results.to_json())
    return results.to_json()


def read(options: argparse.Namespace, command: str) -> Trial:
    """Vehicle and recordings that a command is given."""
    from auv_analysis.output.progress import waiting
    from auv_analysis.scenario.scaling import plain_name
    from auv_dynamics.files.shipped import shipped
    from auv_dynamics.vehicle.vehicle_file import load_vehicle

    vehicle = load_vehicle(options.vehicle)
    notes: list[str] = []
    with waiting('reading'):
        training, held = _recordings(options, vehicle, notes)
    others = [getattr(options, name, None) for name in ('map', 'prior', 'holdout')]
    inputs = [*options.bags, *(Path(one) for one in others if one and Path(one).exists())]
    inputs.append(shipped('vehicles', options.vehicle))
    out = options.out or Path('runs') / plain_name(command, vehicle.name)
    return Trial(vehicle, training, held, notes, inputs, out)


def _recordings(
    options: argparse.Namespace, vehicle: Vehicle, notes: list[str]
) -> tuple[list[Record], list[Record]]:
    """Recordings to learn from, and those held out."""
    from auv_analysis.studies.identify.bags import on_one_step, parts, read_records
    from auv_analysis.studies.identify.identify import split

    mapping = topic_map(options)

    def records(bag: Path) -> list[Record]:
        return read_records(bag, vehicle, mapping, applied=options.applied, notes=notes)

    bags = {bag.resolve(): bag for bag in options.bags}  # one that is named twice tells no more
    if Path(options.holdout).resolve() in bags:
        expected = 'a bag that nothing is learned from'
        raise InputError('--holdout', '', expected, options.holdout)
    every = [one for bag in bags.values() for one in parts(records(bag), options.part)]
    other = records(Path(options.holdout)) if Path(options.holdout).exists() else None
    if other is None:
        share = number(at_least=0.0, at_most=0.9, words=' or a bag')
        try:
            every, other = split(on_one_step(every), share(options.holdout))
        except argparse.ArgumentTypeError as error:
            expected, _, text = str(error).removeprefix('expected ').rpartition(', found ')
            raise InputError('--holdout', '', expected, text) from None
        return every, other
    both = on_one_step([*every, *other])
    return both[: len(every)], both[len(every) :]


def _believed(file: str | None) -> dict[str, tuple[float, float]]:
    """Coefficients that somebody knows: name -> value and standard deviation."""
    if file is None:
        return {}
    from auv_dynamics.files.yaml_files import read_yaml, validate

    known = read_yaml(Path(file), 'prior')
    validate(known, PRIOR, file)
    return {str(k): (float(of['value']), float(of['deviation'])) for k, of in known.items()}


def _gain(text: str) -> float | None:
    """Gain of the observer; None: found by `identify`."""
    if text == 'auto':
        return None
    return number(at_least=0.0, below=1.0, words=' or auto')(text)


def _span(text: str) -> tuple[float, float]:
    first, _, last = text.partition(':')
    try:
        begin, end = float(first or 0.0), float(last or 'inf')
    except ValueError:
        begin, end = 1.0, 0.0
    if not begin < end:
        raise refused('FROM:TO in s, such as 20:95', text)
    return begin, end
