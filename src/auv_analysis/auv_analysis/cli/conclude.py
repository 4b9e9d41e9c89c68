"""How commands end: summary, report and a table of the runs."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from auv_analysis.cli.terminal import comparison_table, summary_tables
from auv_analysis.graph.supervisor import TroubleError
from auv_analysis.metrics.authority import beyond_authority
from auv_analysis.metrics.summary import Window, summarize
from auv_analysis.output.new_files import write_json
from auv_analysis.output.progress import console, say, waiting
from auv_analysis.report.digest import Sketch, sketches
from auv_analysis.report.verdict import FAILED, verdict
from auv_analysis.runs.run import AnyRun
from auv_analysis.scenario.scenario import Scenario
from auv_dynamics.files.errors import first_line


class Study(Protocol):
    """What a command adds to the report of its runs."""

    @property
    def windows(self) -> Sequence[Window]:
        """Windows of the kinetic energy beside the usual ones, s."""

    def examine(
        self, runs: Mapping[str, AnyRun], summaries: Mapping[str, Mapping[str, Any]]
    ) -> dict[str, Any]:
        """Further arguments of `write_report`."""


class Outcome(NamedTuple):
    """Runs that came to their end, and the failure of another one."""

    runs: Mapping[str, AnyRun]
    failure: Exception | None


def finish(
    out: Path,
    runs: Mapping[str, AnyRun],
    failure: Exception | None,
    scenario: Scenario,
    study: Study | None = None,
    *,
    report: bool = True,
) -> dict[str, Any]:
    """Summary and report of the runs that came to their end; then the failure of another one."""
    texts, document = scenario.attachments, {}
    if failure is not None:
        note = first_line(failure)
        if not isinstance(failure, TroubleError):
            note = f'{FAILED}: {note}'
        runs = {name: replace(run, notes=(*run.notes, note)) for name, run in runs.items()}
    if runs:
        document = conclude(
            out, runs, texts['scenario.yaml'], texts['vehicle.yaml'], study, report=report
        )
    if failure is not None:
        raise failure
    return document


def conclude(
    out: Path,
    runs: Mapping[str, AnyRun],
    scenario_text: str | dict[str, str],
    vehicle_text: str | dict[str, str],
    study: Study | None = None,
    *,
    report: bool = True,
) -> dict[str, Any]:
    """Write summary and report, show the tables.

    Parameters
    ----------
    out : folder of the results
    runs : name -> run
    scenario_text, vehicle_text : as for `write_report`
    study : what the report has beside the runs, made from their summaries
    report : whether there is a report, with its figures

    Returns
    -------
    summaries : name -> summary

    """
    windows = study.windows if study else ()
    with waiting('computing the figures of summary.json'):
        summaries = {name: summarize(run, windows=windows) for name, run in runs.items()}
        shown = sketches(runs) if report or len(runs) > 1 else {}
    write_json(out / 'summary.json', summaries)
    if report:
        _report(out, runs, shown, summaries, scenario_text, vehicle_text, study)
    for sentence in verdict(shown, summaries):
        say(sentence)
    console.print(summary_tables(summaries))
    for name, run in runs.items():
        for remark in beyond_authority(run.vehicle, summaries[name]['effort']['max']):
            say(f'note: {name}: {remark}')
    return summaries


def _report(
    out: Path,
    runs: Mapping[str, AnyRun],
    shown: Mapping[str, Sketch],
    summaries: dict[str, Any],
    scenario_text: str | dict[str, str],
    vehicle_text: str | dict[str, str],
    study: Study | None,
) -> None:
    # with matplotlib, which loads slowly
    from auv_analysis.herman2018.claims import claims_part, judge_runs
    from auv_analysis.report.faults import fault_part
    from auv_analysis.report.run_report import write_report

    added: dict[str, Any] = study.examine(runs, summaries) if study else {}
    more = {name: [*sections] for name, sections in added.get('more', {}).items()}
    judged = added.get('claims')
    judged = judge_runs(shown, summaries) if judged is None else judged
    claims, counted = claims_part(out, judged, shown)
    of_claims = [*claims[:1], *more.pop('claims', ()), *claims[1:]]
    more['couplings'] = [*more.get('couplings', ()), *of_claims]
    sentences = [*counted, *added.get('sentences', ())]
    part = fault_part(out, runs)
    if part is not None:
        section, on_faults = part
        more['tracking'] = [section, *more.get('tracking', ())]
        sentences = [*on_faults, *sentences]
    with waiting('drawing figures, writing the report'):
        write_report(
            out, shown, summaries, scenario_text, vehicle_text, more=more, sentences=sentences
        )


def show(summaries: Mapping[str, Mapping[str, Any]]) -> None:
    """Print a row per run on stderr."""
    console.print(comparison_table(summaries))
