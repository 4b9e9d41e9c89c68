"""`auv study`: the paper's procedure, steps 1 to 6, as one report."""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from auv_analysis.commands.conclude import console, finish
from auv_analysis.commands.run import recorded
from auv_analysis.commands.scenarios import open_scenario
from auv_analysis.commands.simulate import simulated
from auv_analysis.report.document import Section
from auv_analysis.run import AnyRun
from auv_analysis.scenario import Scenario
from auv_analysis.study.discussion import discussion
from auv_analysis.study.samples import write_samples
from auv_analysis.summary import Window
from auv_dynamics.files import InputError


def study(options: argparse.Namespace) -> dict[str, Any]:
    """The paper's procedure, by `simulate` or on the node graph."""
    scenario, names = open_scenario(options)
    windows = [_window(scenario, first, last) for first, last in options.window]
    outcome = (recorded if options.run else simulated)(options, scenario, names)
    return finish(*outcome, scenario, Procedure(scenario, outcome.out, windows, options))


def _window(scenario: Scenario, first: float, last: float) -> Window:
    if not 0.0 <= first < last <= scenario.duration + scenario.step / 2:
        expected = f'two times, FROM < TO, from 0 to {scenario.duration:g} s'
        raise InputError('--window', '', expected, f'{first:g} {last:g}')
    return first, last


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
            with console.status(f'writing {name}.parquet'):
                write_samples(run, self.out / f'{name}.parquet')
        leading = min(runs.values(), key=lambda run: run.law != 'gvc').controller
        sentences = discussion(summaries, leading)
        return {'more': {'couplings': [Section('discussion', 'Step 6: discussion', sentences)]}}
