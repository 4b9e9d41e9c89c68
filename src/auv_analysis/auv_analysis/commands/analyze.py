"""`auv analyze`: summary and report of bags that are there already."""

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from auv_analysis.bag import bag_files, load_run, read_bag
from auv_analysis.commands.conclude import conclude
from auv_analysis.folder import prepare
from auv_analysis.run import Run


def analyze(options: argparse.Namespace) -> dict[str, Any]:
    """Summary and report of bags that are there already."""
    runs: dict[str, Run] = {}
    texts = ('', '')
    for bag in options.bags:
        run = load_run(bag, options.vehicle)
        attached = read_bag(bag, decode=False).attachments
        texts = (attached.get('scenario.yaml', ''), attached.get('vehicle.yaml', ''))
        runs[_free_name(run.controller, runs)] = run
    name = '_'.join(dict.fromkeys(run.scenario for run in runs.values()))
    out = options.out or Path('runs') / f'analyze_{name}'
    files = [file for bag in options.bags for file in bag_files(bag)]
    return conclude(prepare(out, overwrite=options.overwrite, inputs=files), runs, *texts)


def _free_name(name: str, taken: Iterable[str]) -> str:
    taken = list(taken)
    number, free = 2, name
    while free in taken:
        free, number = f'{name}_{number}', number + 1
    return free
