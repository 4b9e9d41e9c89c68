"""`auv sweep`: a campaign's rollouts into a folder; the same command goes on after a stop."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from auv_analysis.cli.arguments import add_results, whole
from auv_dynamics.files.errors import FailedError

if TYPE_CHECKING:
    from auv_analysis.studies.sweep.campaign import Campaign
    from auv_analysis.studies.sweep.engine import Outcome
    from auv_analysis.studies.sweep.folder import SweepFolder


def add_arguments(command: argparse.ArgumentParser) -> None:
    """A campaign, and what computes it."""
    add_results(command)
    text = 'a campaign file, or the bare name of a shipped one'
    command.add_argument('campaign', help=text)
    command.add_argument('--executor', choices=('threads', 'dask'), help='default: threads')
    command.add_argument('--scheduler', metavar='ADDRESS', help='of dask, such as tcp://host:8786')
    text = 'threads or processes; default: the cores'
    command.add_argument('--workers', type=whole(1, 1024), metavar='N', help=text)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Run a campaign, or what is left of it."""
    from auv_analysis.output.progress import say
    from auv_analysis.simulation.simulate import announce
    from auv_analysis.studies.sweep.campaign import load_campaign
    from auv_analysis.studies.sweep.engine import opened
    from auv_analysis.studies.sweep.folder import sweep_folder

    campaign = load_campaign(options.campaign)
    out = options.out or Path('runs') / campaign.name
    with (
        opened(options.executor, options.scheduler, options.workers) as executor,
        sweep_folder(out, campaign, overwrite=options.overwrite) as folder,
    ):
        for warning in campaign.scenario.warnings:
            say(f'warning: {warning}')
        if folder.new:
            own = campaign.own_laws
            announce(campaign.scenario, [name for name in campaign.controllers if name not in own])
        outcome = _run(campaign, folder, *executor)
    return _conclude(campaign, out, outcome)


def _run(
    campaign: Campaign,
    folder: SweepFolder,
    executor: Executor,
    in_flight: Callable[[], int],
) -> Outcome:
    from auv_analysis.output.progress import Speed, bar, count, say
    from auv_analysis.studies.sweep.engine import SweepStoppedError, sweep

    try:
        with bar(count('rollouts'), Speed('rollouts'), keep=True) as shown:
            task = shown.add_task(campaign.name, total=campaign.rollouts)
            return sweep(
                campaign, folder, executor, in_flight,
                lambda done: shown.update(task, completed=done),
            )  # fmt: skip
    except SweepStoppedError as stopped:
        stored = folder.stored(campaign.rollouts)  # the interrupt may come when one is just stored
        done = f'{stored} of {campaign.rollouts} rollouts'
        line = f'{folder.folder}: {stopped}; {done} are finished, {_how(folder)}'
        raise FailedError(line) from None
    except KeyboardInterrupt:  # the second one: running blocks are not waited for
        say(f'{folder.folder}: interrupted; {_how(folder)}')
        os._exit(1)


def _how(folder: SweepFolder) -> str:
    """In words, how a sweep that was stopped goes on."""
    other = f' with --out {folder.folder}, without --overwrite,'
    return f'the same command{"" if folder.folder == folder.out else other} goes on from there'


def _conclude(campaign: Campaign, out: Path, outcome: Outcome) -> dict[str, Any]:
    from rich.table import Table

    from auv_analysis.output.folder import ROLLOUTS
    from auv_analysis.output.progress import console, say
    from auv_analysis.studies.sweep.engine import REFUSED

    statuses = ('ok', 'diverged', REFUSED)
    counts = {
        name: {status: outcome.counts[name, status] for status in statuses}
        for name in campaign.controllers
    }
    table = Table('controller', *statuses, box=None, header_style='bold')
    for name, row in counts.items():
        table.add_row(name, *(str(row[status]) for status in statuses))
    console.print(table)
    refused = sum(row[REFUSED] for row in counts.values())
    rows = sum(outcome.counts.values())
    if refused:
        say(f'warning: {refused} of {rows} rows refused, the first: {outcome.reason}')
    say(f"rollouts: {rows} rows, pandas.read_parquet('{out / ROLLOUTS}')")
    document = {
        'campaign': campaign.name,
        'folder': str(out),
        'dataset': str(out / ROLLOUTS),
        'rollouts': outcome.rollouts,
        'rollouts_before': outcome.before,
        'rows': rows,
        'controllers': counts,
        'paths': list(campaign.values(0, 1)),
    }
    if refused == rows:
        raise FailedError('every rollout was refused', document)
    return document
