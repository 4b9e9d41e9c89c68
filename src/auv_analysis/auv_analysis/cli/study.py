"""`auv study`: the paper's procedure, steps 1 to 6, as one report."""

import argparse
import os
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from auv_analysis.cli.conclude import finish
from auv_analysis.cli.run import free_graph, recorded
from auv_analysis.cli.scenarios import open_scenario, scenario_folder
from auv_analysis.cli.simulate import simulated
from auv_analysis.herman2018.cases import PaperClaims, claims_sentences, paper_claims
from auv_analysis.herman2018.paper import CASES
from auv_analysis.metrics.summary import Window
from auv_analysis.output.progress import say, waiting
from auv_analysis.report.document import Section
from auv_analysis.runs.run import AnyRun
from auv_analysis.runs.samples import ENDING
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.simulate import check_hold
from auv_analysis.studies.study.discussion import discussion
from auv_analysis.studies.study.indices import Design, Method
from auv_analysis.studies.study.procedure import (
    sensitivity_section,
    write_samples,
)
from auv_analysis.studies.study.sensitivity import Sensitivity, sensitivity
from auv_dynamics.files.errors import InputError

LARGEST_SPAN = 1e3


def study(options: argparse.Namespace) -> dict[str, Any]:
    """The paper's procedure, by `simulate` or on the node graph."""
    scenario, names = open_scenario(options)
    windows = [_window(scenario, first, last) for first, last in options.window]
    _check(options)
    if options.run:
        options.hold = 'zoh'  # as the nodes do
    check_hold(scenario, options.hold)
    of_a_run = '/*' if options.run else ENDING
    with ExitStack() as stack:
        graph = stack.enter_context(free_graph(options)) if options.run else None
        folder = scenario_folder(options, scenario, names, '.parquet', of_a_run)
        results = stack.enter_context(folder)
        outcome = (
            recorded(options, scenario, names, results, graph)
            if graph
            else simulated(options, scenario, names, results)
        )
        procedure = Procedure(scenario, results.folder, windows, options)
        return finish(results.folder, *outcome, scenario, procedure)


def _window(scenario: Scenario, first: float, last: float) -> Window:
    if not 0.0 <= first < last <= scenario.duration + scenario.step / 2:
        expected = f'two times, FROM < TO, from 0 to {scenario.duration:g} s'
        raise InputError('--window', '', expected, f'{first:g} {last:g}')
    return first, last


def _check(options: argparse.Namespace) -> None:
    if not 1.0 < options.span <= LARGEST_SPAN:
        expected = f'a number above 1, up to {LARGEST_SPAN:g}'
        raise InputError('--span', '', expected, f'{options.span:g}')
    if options.seed < 0:
        raise InputError('--seed', '', 'a whole number from 0 on', str(options.seed))
    if options.samples is not None:
        method: Method = 'morris' if options.sensitivity == 'morris' else 'sobol'
        try:
            Design(method, ('gain',), options.samples, 0)
        except ValueError as error:
            expected = str(error).partition('expected ')[2].partition(', found')[0]
            raise InputError('--samples', '', expected, str(options.samples)) from None


@dataclass(frozen=True)
class Procedure:
    """What a study has beside its runs.

    Attributes
    ----------
    scenario : that is studied
    out : folder of the results
    windows : of the kinetic energy, s
    options : of the command line

    """

    scenario: Scenario
    out: Path
    windows: list[Window]
    options: argparse.Namespace

    def examine(
        self, runs: Mapping[str, AnyRun], summaries: Mapping[str, Mapping[str, Any]]
    ) -> dict[str, Any]:
        """Further arguments of `write_report`, and the Parquet files that they rest on."""
        for name, run in runs.items():
            with waiting(f'writing {name}.parquet'):
                write_samples(run, self.out / f'{name}.parquet')
        found = self._sensitivities(list(runs))
        claims = self._claims(runs, found)
        said = claims_sentences(claims) if claims else []
        leading = min(runs.values(), key=lambda run: run.law != 'gvc').controller
        more: dict[str, list[Section]] = {}
        sentences = discussion(summaries, leading)
        if found:
            section, gains = sensitivity_section(self.out, list(found.values()))
            more['tracking'] = [section]
            sentences += gains
            said = [*gains[:1], *said]
        more['couplings'] = [Section('discussion', 'Step 6: discussion', sentences)]
        judged = claims.claims if claims else None
        return {'more': more, 'sentences': said, 'claims': judged}

    def _sensitivities(self, names: list[str]) -> dict[str, Sensitivity]:
        options = self.options
        if options.sensitivity == 'none':
            return {}
        found = {}
        for name in names:
            with waiting(f'{self.scenario.name} {name}: varying the gains'):
                found[name] = sensitivity(
                    self.scenario, name, method=options.sensitivity, count=options.samples,
                    span=options.span, seed=options.seed, hold=options.hold, threads=_threads(),
                )  # fmt: skip
            if found[name].refusal:
                say(f'note: {name}: no sensitivity to the gains: {found[name].refusal}')
        return found

    def _claims(
        self, runs: Mapping[str, AnyRun], found: Mapping[str, Sensitivity]
    ) -> PaperClaims | None:
        """The 21 claims; None for a scenario that is none of the paper's."""
        with waiting('judging the claims of the paper'):
            claims = paper_claims(
                self.scenario, runs, found, hold=self.options.hold, threads=_threads()
            )
        return claims if claims.claims or self.scenario.name in CASES else None


def _threads() -> int:
    return os.cpu_count() or 1
