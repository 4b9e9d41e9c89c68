"""How commands end: summary, report and a table of the runs."""

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from rich.console import Console
from rich.table import Table

from auv_analysis.run import AnyRun
from auv_analysis.scenario import Scenario
from auv_analysis.summary import Window, summarize
from auv_dynamics.signals import DOFS

console = Console(stderr=True)


class Study(Protocol):
    """What a command adds to the report of its runs."""

    @property
    def windows(self) -> Sequence[Window]:
        """Windows of the kinetic energy beside the usual ones, s."""

    def examine(
        self, runs: Mapping[str, AnyRun], summaries: Mapping[str, Mapping[str, Any]]
    ) -> dict[str, Any]:
        """Further arguments of `write_report`."""


def say(text: str) -> None:
    """Print a line on stderr."""
    print(text, file=sys.stderr, flush=True)


class Outcome(NamedTuple):
    """Runs that came to their end, the folder that they lie in, and the failure of another one."""

    out: Path
    runs: Mapping[str, AnyRun]
    failure: Exception | None


def finish(
    out: Path,
    runs: Mapping[str, AnyRun],
    failure: Exception | None,
    scenario: Scenario,
    study: Study | None = None,
) -> dict[str, Any]:
    """Summary and report of the runs that came to their end; then the failure of another one."""
    texts, document = scenario.attachments, {}
    if failure is not None:
        note = f'another controller did not come to its end: {str(failure).splitlines()[0]}'
        runs = {name: replace(run, notes=(*run.notes, note)) for name, run in runs.items()}
    if runs:
        document = conclude(out, runs, texts['scenario.yaml'], texts['vehicle.yaml'], study)
    if failure is not None:
        raise failure
    return document


def conclude(
    out: Path,
    runs: Mapping[str, AnyRun],
    scenario_text: str | dict[str, str],
    vehicle_text: str | dict[str, str],
    study: Study | None = None,
) -> dict[str, Any]:
    """Write summary and report, show the table; returns the summaries.

    Parameters
    ----------
    out : folder of the results
    runs : name -> run
    scenario_text, vehicle_text : as for `write_report`
    study : what the report has beside the runs, made from their summaries

    """
    windows = study.windows if study else ()
    with console.status('computing the figures of summary.json'):
        summaries = {name: summarize(run, windows=windows) for name, run in runs.items()}
    text = json.dumps(summaries, indent=2, allow_nan=False)
    (out / 'summary.json').write_text(text + '\n', encoding='utf-8')
    from auv_analysis.report.page import write_report  # with matplotlib, which loads slowly

    more = study.examine(runs, summaries) if study else {}
    with console.status('drawing figures, writing the report'):
        report = write_report(out, runs, summaries, scenario_text, vehicle_text, **more)
    for name, run in runs.items():
        for note in run.notes:
            say(f'note: {name}: {note}')
    _show(summaries)
    say(f'report: {report}')
    return summaries


def _show(summaries: dict[str, dict[str, Any]]) -> None:
    table = Table(box=None, header_style='bold')
    for column in ('controller', 'kinetic energy', 'settled', 'largest error after 2 s', 'by'):
        table.add_column(column)
    for name, summary in summaries.items():
        energy = summary['kinetic_energy']
        times = summary['velocity_error']['settling_time']
        settled = 'not all' if None in times else f'{max(times):.2f} s'
        worst, dof = _worst(summary['velocity_error']['max_after_2s'])
        mean = 'unknown' if energy['mean'] is None else f'{energy["mean"]:.2f} J'
        window = f'{energy["window"][0]:g}-{energy["window"][1]:g} s'
        table.add_row(name, f'{mean} ({window})', settled, worst, dof)
    console.print(table)


def _worst(errors: list[float] | None) -> tuple[str, str]:
    if errors is None:
        return 'unknown', ''
    i = int(np.argmax(errors))
    return f'{errors[i]:.4f} {"m/s" if i < 3 else "rad/s"}', DOFS[i]
