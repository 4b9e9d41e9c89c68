"""`auv tune`: laws tuned to equal effort or equal error, then compared over random changes."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from auv_analysis.cli.arguments import SCENARIO, add_hold, add_results, number, refused, whole
from auv_dynamics.files.errors import InputError
from auv_gvc_controller.laws import NAMES as LAWS

if TYPE_CHECKING:
    from auv_analysis.scenario.scenario import Scenario
    from auv_analysis.studies.tune.search import Request

FEWEST, MOST = 10, 100_000  # draws: a test of fewer says nothing
INDICES = {'time': 'weighted_error', 'mean': 'error'}


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Scenario, laws, what they are given alike, and the perturbations that compare them."""
    add_results(command)
    command.add_argument('scenario', help=SCENARIO)
    text = 'controller that the laws are tuned to equal; default: the first of law gvc'
    command.add_argument('--reference', metavar='NAME', help=text)
    text = "only this one beside the reference's own; may be repeated; default: all shipped"
    command.add_argument('--law', action='append', choices=LAWS, help=text)
    text = 'what the tuned laws have in common with it; default: effort'
    command.add_argument('--equal', choices=('effort', 'error'), default='effort', help=text)
    text = 'performance index: error weighted by time, or its mean; default: time'
    command.add_argument('--index', choices=tuple(INDICES), default='time', help=text)
    structures = ('best', 'scalar', 'mass', 'diagonal', 'inertia')
    text = 'of gains: scalar, diag(M), diagonal, times M; default: the better of the first two'
    command.add_argument('--structure', choices=structures, default='best', help=text)
    text = 'relative tolerance of the equality; default: 0.001'
    command.add_argument('--tolerance', type=number(above=0, below=0.1), default=0.001, help=text)
    text = 'Monte Carlo samples; 0: none; default: 256'
    command.add_argument('--samples', type=_samples, metavar='N', default=256, help=text)
    text = 'range of a perturbation, such as damping=0.3 or current=0.1; may be repeated'
    command.add_argument('--spread', action='append', metavar='NAME=VALUE', help=text)
    text = 'random seed of search and samples; default: 0'
    command.add_argument('--seed', type=whole(0, 2**63 - 1), default=0, help=text)
    add_hold(command)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Tune, compare and report."""
    from auv_analysis.output.folder import results_folder
    from auv_analysis.output.progress import bar, count, say, waiting
    from auv_analysis.scenario.scenario import load_scenario
    from auv_analysis.simulation.simulate import announce
    from auv_analysis.studies.tune.results import tune

    scenario = load_scenario(options.scenario)
    request = _request(options, scenario)
    out = options.out or Path('runs') / f'tune_{scenario.name}'
    with results_folder(out, overwrite=options.overwrite, inputs=scenario.inputs) as results:
        for warning in scenario.warnings:
            say(f'warning: {warning}')
        announce(scenario, [request.reference])
        with bar(count(), keep=True) as shown:

            def stage(text: str, parts: int) -> Any:
                task = shown.add_task(text, total=parts)
                return lambda: shown.advance(task)

            tuning = tune(request, results.folder, stage)
        from auv_analysis.studies.tune.report import print_tuning, write_report  # with matplotlib

        with waiting('drawing plots, writing the report'):
            write_report(tuning, results.folder)
        print_tuning(tuning)
        return tuning.results.to_json()


def _request(options: argparse.Namespace, scenario: Scenario) -> Request:
    from auv_analysis.simulation.simulate import check_hold
    from auv_analysis.studies.tune.perturbations import spread_of
    from auv_analysis.studies.tune.search import Request

    check_hold(scenario, options.hold)
    reference = _reference(scenario, options.reference)
    own = scenario.controller(reference)['law']
    laws = options.law or LAWS
    if own in LAWS:
        laws = [own, *laws]
    return Request(
        scenario, reference, tuple(dict.fromkeys(laws)), options.equal, INDICES[options.index],
        options.tolerance, options.structure, options.hold, options.seed,
        len(os.sched_getaffinity(0)), options.samples,
        spread_of(options.spread or (), scenario.vehicle),
    )  # fmt: skip


def _reference(scenario: Scenario, name: str | None) -> str:
    """The controller named, else the first one under GVC."""
    if name is not None:
        scenario.controller(name)
        return name
    for candidate, entry in scenario.controllers.items():
        if entry['law'] == 'gvc':
            return candidate
    expected = 'a controller of law gvc, or --reference with another one'
    raise InputError(scenario.path, 'controllers', expected, ', '.join(scenario.controllers))


def _samples(text: str) -> int:
    try:
        samples = int(text)
    except ValueError:
        samples = -1
    if samples != 0 and not FEWEST <= samples <= MOST:
        raise refused(f'0 for none, or a whole number from {FEWEST} to {MOST}', text)
    return samples
