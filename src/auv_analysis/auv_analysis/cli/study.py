"""`auv study`: the paper's procedure, steps 1 to 6, as one report."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from auv_analysis.cli.arguments import (
    add_graph,
    add_hold,
    add_scenario,
    number,
    refuse_given,
    whole,
)
from auv_dynamics.files.errors import InputError

if TYPE_CHECKING:
    from auv_analysis.runs.run import Run
    from auv_analysis.scenario.scenario import Scenario
    from auv_analysis.studies.study.sensitivity import Sensitivity


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Scenario, windows of the energy, and how the sensitivity to the gains is estimated."""
    add_scenario(command)
    add_hold(command)
    command.set_defaults(hold=None)
    text = 'real nodes, recorded, in place of this process'
    command.add_argument('--run', action='store_true', help=text)
    add_graph(command, 'with --run: ')
    command.add_argument(
        '--window', nargs=2, action='append', type=float, metavar=('FROM', 'TO'), default=[],
        help='kinetic energy over this window as well, s; may be repeated',
    )  # fmt: skip
    text = 'sensitivity indices of the metrics to the gains; default: sobol'
    command.add_argument('--sensitivity', choices=('sobol', 'morris', 'none'), help=text)
    text = 'base points of sobol, a power of two; trajectories of morris'
    command.add_argument('--samples', type=int, metavar='N', help=text)
    text = 'gains vary from 1/SPAN to SPAN times their value; default: 2'
    command.add_argument('--span', type=number(above=1, at_most=1e3), help=text)
    command.add_argument('--seed', type=whole(0), help='random seed; default: 0')


def run(options: argparse.Namespace) -> dict[str, Any]:
    """The paper's procedure, by `simulate` or on the node graph."""
    from auv_analysis.cli.scenario_runs import (
        finish,
        open_scenario,
        scenario_folder,
        simulated,
        warn,
    )
    from auv_analysis.graph.domain import own_domain
    from auv_analysis.graph.recorded_runs import free_graph, recorded
    from auv_analysis.runs.samples import ENDING
    from auv_analysis.simulation.simulate import check_hold

    scenario, names = open_scenario(options)
    windows = [_window(scenario, first, last) for first, last in options.window]
    if options.sensitivity == 'none':
        refuse_given(options, ('samples', 'span', 'seed'), 'sobol or morris', '--sensitivity none')
    _check_samples(options)
    if not options.run:
        refuse_given(options, ('domain_id', 'composed'), '--run beside it', None)
    elif options.hold == 'continuous':
        raise InputError('--hold', '', 'zoh with --run, as the nodes hold', options.hold)
    options.hold = options.hold or ('zoh' if options.run else 'continuous')
    check_hold(scenario, options.hold)
    with ExitStack() as stack:
        domain = stack.enter_context(own_domain(options.domain_id)) if options.run else None
        of_a_run = '/*' if domain else ENDING
        folder = scenario_folder(options, scenario, names, '.parquet', of_a_run)
        results = stack.enter_context(folder)
        graph = stack.enter_context(free_graph(*domain, scenario, names)) if domain else None
        warn(scenario, names)
        runs, failure = (
            recorded(scenario, names, results, graph, composed=options.composed)
            if graph
            else simulated(scenario, names, results.folder, options.hold)
        )
        examine = partial(_examine, options, scenario, results.folder)
        return finish(
            results.folder, runs, failure, scenario, windows=windows, examine=examine
        )  # fmt: skip


def _window(scenario: Scenario, first: float, last: float) -> tuple[float, float]:
    if not 0.0 <= first < last <= scenario.duration + scenario.step / 2:
        expected = f'two times, FROM < TO, from 0 to {scenario.duration:g} s'
        raise InputError('--window', '', expected, f'{first:g} {last:g}')
    return first, last


def _check_samples(options: argparse.Namespace) -> None:
    """Refuse a number of samples that the method of the sensitivity does not take."""
    from auv_analysis.studies.sweep.indices import SensitivityPlan

    if options.samples is not None:
        method: Any = 'morris' if options.sensitivity == 'morris' else 'sobol'
        try:
            SensitivityPlan(method, ('gain',), options.samples, 0)
        except ValueError as error:
            expected = str(error).partition('expected ')[2].partition(', found')[0]
            raise InputError('--samples', '', expected, str(options.samples)) from None


def _examine(
    options: argparse.Namespace,
    scenario: Scenario,
    out: Path,
    runs: Mapping[str, Run],
    summaries: Mapping[str, Mapping[str, Any]],
) -> dict[str, Any]:
    """Parts of the report beside the runs, and the Parquet files behind them."""
    from auv_analysis.herman2018.cases import claims_sentences, paper_claims
    from auv_analysis.herman2018.paper import CASES
    from auv_analysis.output.progress import waiting
    from auv_analysis.report.document import Section
    from auv_analysis.studies.study.procedure import discussion, sensitivity_section, write_samples

    for name, run in runs.items():
        with waiting(f'writing {name}.parquet'):
            write_samples(run, out / f'{name}.parquet')
    found = {} if options.sensitivity == 'none' else _sensitivities(options, scenario, runs)
    with waiting('judging the claims of the paper'):
        cores = len(os.sched_getaffinity(0))
        claims = paper_claims(scenario, runs, found, hold=options.hold, threads=cores)
    judged = claims if claims.claims or scenario.name in CASES else None
    said = claims_sentences(judged) if judged else []
    leading = min(runs.values(), key=lambda run: run.law != 'gvc').controller
    more: dict[str, list[Section]] = {}
    if found:
        section, gains = sensitivity_section(out, list(found.values()))
        more['tracking'] = [section]
        said = [*gains[:1], *said]
    step_6 = Section('discussion', 'Step 6: discussion', discussion(leading, summaries[leading]))
    more['couplings'] = [step_6]
    return {'more': more, 'sentences': said, 'claims': judged.claims if judged else None}


def _sensitivities(
    options: argparse.Namespace, scenario: Scenario, names: Mapping[str, Any]
) -> dict[str, Sensitivity]:
    from auv_analysis.output.progress import say, waiting
    from auv_analysis.studies.study.sensitivity import SPAN, sensitivity

    found = {}
    for name in names:
        with waiting(f'{scenario.name} {name}: varying the gains'):
            found[name] = sensitivity(
                scenario, name, method=options.sensitivity, count=options.samples,
                span=options.span or SPAN, seed=options.seed or 0, hold=options.hold,
                threads=len(os.sched_getaffinity(0)),
            )  # fmt: skip
        if found[name].refusal:
            say(f'note: {name}: no sensitivity to the gains: {found[name].refusal}')
    return found
