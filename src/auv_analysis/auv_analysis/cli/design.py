"""`auv design`: which change of a vehicle removes which coupling, proposed and simulated."""

import argparse
import re
from pathlib import Path
from typing import Any

from auv_analysis.design.couplings import coupling_named, present
from auv_analysis.design.parameters import NAMES
from auv_analysis.design.printed import print_design
from auv_analysis.design.proposal import Proposal, propose
from auv_analysis.design.result import concluded
from auv_analysis.design.setting import Setting, open_setting
from auv_analysis.output.folder import results_folder
from auv_analysis.output.progress import bar, count, say, waiting
from auv_analysis.scenario.scaling import UNFIT
from auv_analysis.simulation.warm_up import announce
from auv_dynamics.files.errors import InputError

BOUND = re.compile(r'([a-z.]+)=([^:=]+):([^:=]+)')
LONGEST = 90  # of the vehicle's name in that of the folder


def design(options: argparse.Namespace) -> dict[str, Any]:
    """Which change of a vehicle removes which coupling."""
    own = [_bound(text) for text in options.bound]
    setting = open_setting(options.vehicle, options.scenario, own)
    if options.reduce is not None:
        coupling_named(options.reduce, present(setting.space.vehicle))
    name = UNFIT.sub('_', setting.space.vehicle.name)[:LONGEST]
    out = options.out or Path('runs') / f'design_{name}'
    with results_folder(out, overwrite=options.overwrite, inputs=setting.inputs) as results:
        for warning in setting.scenario.warnings:
            say(f'warning: {warning}')
        announce(setting.scenario, [setting.controller])
        found = _found(setting, options.reduce)
        with waiting('simulating the vehicle before and after'):
            result = concluded(found, results)
        from auv_analysis.design.report import write_design_report  # with matplotlib, which is slow

        with waiting('drawing figures, writing the report'):
            write_design_report(result, results.folder)
        if not options.json:
            print_design(result.document)
    return result.document


def _found(setting: Setting, reduce: str | None) -> Proposal:
    with bar(count('couplings')) as shown:
        task = shown.add_task('searching', total=1)
        return propose(
            setting, reduce, lambda done, of: shown.update(task, completed=done, total=of)
        )


def _bound(text: str) -> tuple[str, float, float]:
    match = BOUND.fullmatch(text)
    expected = f'NAME=LOWER:UPPER with NAME one of {", ".join(NAMES)}'
    if match is None:
        raise InputError('--bound', '', expected, text)
    try:
        return match[1], float(match[2]), float(match[3])
    except ValueError:
        raise InputError('--bound', match[1], 'two numbers LOWER:UPPER', text) from None
