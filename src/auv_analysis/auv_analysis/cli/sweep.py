"""`auv sweep`: a campaign's rollouts into a folder; the same command goes on after a stop."""

import argparse
import os
from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from rich.table import Table

from auv_analysis.output.folder import ROLLOUTS
from auv_analysis.output.progress import (
    Speed,
    bar,
    console,
    count,
    say,
)
from auv_analysis.simulation.warm_up import announce
from auv_analysis.studies.sweep.campaign import Campaign, load_campaign
from auv_analysis.studies.sweep.engine import REFUSED, Outcome, SweepStoppedError, opened
from auv_analysis.studies.sweep.engine import sweep as run_sweep
from auv_analysis.studies.sweep.folder import SweepFolder, sweep_folder
from auv_dynamics.files.errors import FailedError, InputError

STATUSES = ('ok', 'diverged', REFUSED)


def sweep(options: argparse.Namespace) -> dict[str, Any]:
    """Run a campaign, or what is left of it."""
    campaign = load_campaign(options.campaign)
    out = options.out or Path('runs') / campaign.name
    with (
        opened(options.executor, options.scheduler, _workers(options.workers)) as executor,
        sweep_folder(out, campaign, overwrite=options.overwrite) as folder,
    ):
        for warning in campaign.scenario.warnings:
            say(f'warning: {warning}')
        if folder.new:
            _announce(campaign)
        outcome = _run(campaign, folder, *executor)
    return _conclude(campaign, out, outcome)


def _announce(campaign: Campaign) -> None:
    own = campaign.own_laws
    announce(campaign.scenario, [name for name in campaign.controllers if name not in own])


def _workers(text: str | None) -> int | None:
    if text is None:
        return None
    if not (text.isdecimal() and len(text) < 9 and 1 <= int(text) <= 1024):
        raise InputError('--workers', '', 'a whole number from 1 to 1024', text)
    return int(text)


def _run(
    campaign: Campaign,
    folder: SweepFolder,
    executor: Executor,
    in_flight: Callable[[], int],
) -> Outcome:
    try:
        with bar(count('rollouts'), Speed('rollouts'), keep=True) as shown:
            task = shown.add_task(campaign.name, total=campaign.rollouts)
            return run_sweep(
                campaign,
                folder,
                executor,
                in_flight,
                lambda done: shown.update(task, completed=done),
            )
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
    counts = {
        name: {status: outcome.counts[name, status] for status in STATUSES}
        for name in campaign.controllers
    }
    table = Table(box=None, header_style='bold')
    for column in ('controller', *STATUSES):
        table.add_column(column)
    for name, row in counts.items():
        table.add_row(name, *(str(row[status]) for status in STATUSES))
    console.print(table)
    refused = sum(row[REFUSED] for row in counts.values())
    rows = sum(outcome.counts.values())
    if refused:
        say(f'warning: {refused} of {rows} rows refused, the first: {outcome.reason}')
    say(f"rollouts: {rows} rows, pandas.read_parquet('{out / ROLLOUTS}')")
    if refused == rows:
        raise FailedError('every rollout was refused: its values make no scenario')
    return {
        'campaign': campaign.name,
        'folder': str(out),
        'dataset': str(out / ROLLOUTS),
        'rollouts': outcome.rollouts,
        'rollouts_before': outcome.before,
        'rows': rows,
        'controllers': counts,
        'paths': list(campaign.values(0, 1)),
    }
