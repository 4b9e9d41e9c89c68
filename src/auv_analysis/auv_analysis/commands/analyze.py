"""`auv analyze`: summary and report of bags that are there already."""

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from auv_analysis.bag import bag_files, open_bag
from auv_analysis.commands.conclude import conclude, console
from auv_analysis.folder import prepare
from auv_analysis.run import AnyRun


def analyze(options: argparse.Namespace) -> dict[str, Any]:
    """Summary and report of bags that are there already."""
    runs: dict[str, AnyRun] = {}
    texts: dict[str, dict[str, str]] = {'scenario.yaml': {}, 'vehicle.yaml': {}}
    for bag in options.bags:
        with console.status(f'reading {bag}'):
            run, attachments = open_bag(bag, options.vehicle)
        name = _free_name(run.controller, runs)
        runs[name] = run
        for file, by_name in texts.items():
            by_name[name] = attachments.get(file, '')
    name = '_'.join(dict.fromkeys(run.scenario for run in runs.values()))
    out = options.out or Path('runs') / f'analyze_{name}'
    files = [file for bag in options.bags for file in bag_files(bag)]
    out = prepare(out, overwrite=options.overwrite, inputs=files)
    return conclude(out, runs, texts['scenario.yaml'], texts['vehicle.yaml'])


def _free_name(name: str, taken: Iterable[str]) -> str:
    taken = list(taken)
    number, free = 2, name
    while free in taken:
        free, number = f'{name}_{number}', number + 1
    return free
