"""What commands on scenarios begin with: the scenario, its controllers, the results' folder."""

import argparse
from pathlib import Path

from auv_analysis.console import say
from auv_analysis.folder import prepare
from auv_analysis.scenario import Scenario, load_scenario


def open_scenario(options: argparse.Namespace) -> tuple[Scenario, list[str]]:
    """Scenario of the command line and those of its controllers that are asked for."""
    scenario = load_scenario(options.scenario)
    names = list(dict.fromkeys(options.controller or scenario.controllers))
    for name in names:
        scenario.controller(name)
    return scenario, names


def prepare_out(options: argparse.Namespace, scenario: Scenario, names: list[str]) -> Path:
    """Folder of the results; warnings only now, so that a refusal is one line."""
    out = prepare(
        options.out or Path('runs') / scenario.name,
        overwrite=options.overwrite,
        inputs=scenario.inputs,
        new=names,
    )
    for warning in scenario.warnings:
        say(f'warning: {warning}')
    return out
