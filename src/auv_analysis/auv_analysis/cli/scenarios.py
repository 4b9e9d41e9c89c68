"""What commands on scenarios begin with: the scenario, its controllers, the results' folder."""

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from glob import escape
from pathlib import Path

from auv_analysis.output.folder import Results, results_folder
from auv_analysis.output.progress import say
from auv_analysis.scenario.scenario import Scenario, load_scenario


def open_scenario(options: argparse.Namespace) -> tuple[Scenario, list[str]]:
    """Scenario of the command line and those of its controllers that are asked for."""
    scenario = load_scenario(options.scenario)
    names = list(dict.fromkeys(options.controller or scenario.controllers))
    for name in names:
        scenario.controller(name)
    return scenario, names


@contextmanager
def scenario_folder(
    options: argparse.Namespace, scenario: Scenario, names: Sequence[str], *own: str
) -> Iterator[Results]:
    """Folder of the results; warnings only now, so that a refusal is one line.

    Parameters
    ----------
    options : out and overwrite of the command line
    scenario : whose files must not be replaced
    names : of the controllers
    own : endings of what is written of each controller, such as '.npz' or '/*'

    """
    with results_folder(
        options.out or Path('runs') / scenario.name,
        overwrite=options.overwrite,
        own=[f'{escape(name)}{ending}' for name in names for ending in own],
        inputs=scenario.inputs,
    ) as results:
        for warning in scenario.warnings:
            say(f'warning: {warning}')
        yield results
