"""Shared by commands on scenarios and runs: scenario and folder, runs, summary and report."""

import argparse
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from auv_analysis.graph.supervisor import TroubleError
from auv_analysis.metrics.authority import beyond_authority, both_ways
from auv_analysis.metrics.summary import Window, summarize
from auv_analysis.output.folder import ResultsFolder, results_folder
from auv_analysis.output.new_files import write_json
from auv_analysis.output.progress import console, say, share_bar, waiting
from auv_analysis.output.text import MISSING, join, largest, number, plain, residuals
from auv_analysis.report.digest import RunDigest, digests
from auv_analysis.report.verdict import FAILED, verdict
from auv_analysis.runs.run import Hold, Run
from auv_analysis.runs.samples import ENDING, write_samples
from auv_analysis.scenario.scenario import Scenario, check_names, load_scenario, write_inputs
from auv_analysis.simulation.simulate import announce, simulate
from auv_dynamics.files.errors import FailedError, first_line
from auv_dynamics.vehicle import DOFS

VELOCITY, WRENCH = 'm,rad/s', 'N,N m'
BAR = 24  # columns
WIDTH = 9  # columns of a number
ZERO = 'zero'
Column = tuple[str, Sequence[str]]
Examine = Callable[[Mapping[str, Run], Mapping[str, Mapping[str, Any]]], dict[str, Any]]


def open_scenario(options: argparse.Namespace) -> tuple[Scenario, list[str]]:
    """Scenario of the command line and those of its controllers that are asked for."""
    scenario = load_scenario(options.scenario)
    names = list(dict.fromkeys(options.controller or scenario.controllers))
    for name in names:
        scenario.controller(name)
    return scenario, names


def scenario_folder(
    options: argparse.Namespace, scenario: Scenario, names: Sequence[str], *own: str
) -> AbstractContextManager[ResultsFolder]:
    """Folder of the results.

    Parameters
    ----------
    options : out and overwrite of the command line
    scenario : whose files must not be replaced
    names : of the controllers
    own : endings of what is written of each controller, such as '.npz' or '/*'

    Raises
    ------
    InputError : a controller is called as a file of ours, or as for `results_folder`

    """
    check_names(names, scenario.path, own)
    return results_folder(
        options.out or Path('runs') / scenario.name,
        overwrite=options.overwrite,
        own=[f'{name}{ending}' for name in names for ending in own],
        inputs=scenario.inputs,
    )


def warn(scenario: Scenario, names: Sequence[str]) -> None:
    """Say what is odd about a scenario, once nothing is refused: a refusal is one line."""
    for warning in scenario.warnings:
        say(f'warning: {warning}')
    say_margins(scenario, names)


def say_margins(
    scenario: Scenario, names: Sequence[str], delay: float | None = None, *, driver: bool = False
) -> None:
    """Say the margins of controllers whose wrench is late, see `margin_notes`."""
    if 'actuators' in scenario.data or delay is not None or driver:
        from auv_analysis.studies.linearize.margins import margin_notes  # with scipy.optimize

        for note in margin_notes(scenario, names, delay, driver=driver):
            say(note)


def simulated(
    scenario: Scenario, names: list[str], out: Path, hold: Hold
) -> tuple[dict[str, Run], Exception | None]:
    """Simulate controllers into a folder; runs by name, and the first failure."""
    write_inputs(scenario, out)
    announce(scenario, names)
    runs: dict[str, Run] = {}
    failure = None
    for name in names:
        try:
            with waiting(f'{scenario.name} {name}: simulating'):
                run = simulate(scenario, name, hold)
        except ArithmeticError as error:  # it diverges, or a user's own law fails
            failure = failure or error
            continue
        runs[name] = run
        write_samples(run, out / f'{name}{ENDING}')
    return runs, failure


def summary_tables(summaries: Mapping[str, Mapping[str, Any]]) -> RenderableType:
    """Errors, effort, couplings and energy of each run; of several, a comparison at the end.

    Parameters
    ----------
    summaries : name -> what `summarize` gives

    """
    parts: list[RenderableType] = []
    for name, summary in summaries.items():
        parts += [*_one(name, summary), Text()]
    return Group(*parts, *([comparison_table(summaries)] if len(summaries) > 1 else []))


def _one(name: str, summary: Mapping[str, Any]) -> list[RenderableType]:
    law, duration, step = summary['law'], plain(summary['duration']), plain(summary['step'])
    facts = f': law {law}, {duration} s in steps of {step} s, by {summary["source"]}'
    title = Text(name, 'bold').append(facts, 'not bold')
    parts: list[RenderableType] = [title, _tracking(summary), _couplings(summary)]
    parts += [_estimate(summary, kind) for kind in HEADS if summary.get(kind)]
    parts += [Text(line, 'dim') for line in _remarks(summary)]
    parts += [Text(f'note: {note}', 'yellow') for note in summary['notes']]
    return parts


def _tracking(summary: Mapping[str, Any]) -> Table:
    """Errors and effort, a line per degree of freedom."""
    error, lumped, effort = (summary[k] for k in ('velocity_error', 'lumped_error', 'effort'))
    return _table(
        (f'error\nrms\n{VELOCITY}', _numbers(error['rms'])),
        (f'error\nmax > 2 s\n{VELOCITY}', _numbers(error['max_after_2s'])),
        ('settled\n\ns', _numbers(error['settling_time'])),
        (f'w = f - F\nrms\n{WRENCH}', _numbers(lumped['rms'])),
        (f'w = f - F\nmax > 2 s\n{WRENCH}', _numbers(lumped['max_after_2s'])),
        (f'tau\nrms\n{WRENCH}', _numbers(effort['rms'])),
        (f'tau\nmax\n{WRENCH}', _numbers(effort['max'])),
    )


def _couplings(summary: Mapping[str, Any]) -> Table:
    """Couplings and kinetic energy, a line per degree of freedom."""
    coupling, energy = summary['coupling'], summary['kinetic_energy']
    shares, zeros = energy['shares_percent'], coupling['structural_zeros']
    return _table(
        (f'delta_xi\nmax\n{VELOCITY}', _coupled(coupling['delta_xi_max'], zeros['delta_xi'])),
        (f'delta_pi\nmax\n{WRENCH}', _coupled(coupling['delta_pi_max'], zeros['delta_pi'])),
        ('energy\nmean\nJ', _numbers(energy['mean_by_component'])),
        ('share\n\n%', [MISSING] * 6 if shares is None else [f'{x:.2f}' for x in shares]),
        bars=[] if shares is None else [share_bar(share, BAR) for share in shares],
    )


HEADS = {'unexplained': 'F by (1)', 'required_wrench': 'required'}


def _estimate(summary: Mapping[str, Any], kind: str) -> Table:
    """F by (1) of a recorded motion, or the wrench that it needed, with its error, by axis."""
    heads = {'mean': 'mean', 'rms': 'rms', 'max': 'max', 'error_rms': 'error'}
    return _table(
        *(
            (f'{HEADS[kind]}\n{head}\n{WRENCH}', _numbers(summary[kind][key]))
            for key, head in heads.items()
        )
    )


def _remarks(summary: Mapping[str, Any]) -> Iterable[str]:
    """Notes on the tables: window of the energy, zeros, errors that do not settle."""
    energy = summary['kinetic_energy']
    first, last = (plain(time) for time in energy['window'])
    if energy['mean'] is not None:
        mean = number(energy['mean'], 5)
        yield f'kinetic energy {mean} J, mean over {first} to {last} s'
    zeros = summary['coupling']['structural_zeros']
    named = [f'{key} of {join(dofs)}' for key, dofs in zeros.items() if dofs]
    if named:
        yield f'{ZERO} in every motion: {"; ".join(named)}'
    times = summary['velocity_error']['settling_time']
    left = (summary['settling'] or {}).get('residual', ())
    late = [i for i, error in enumerate(left) if error is not None and times[i] is None]
    if late:
        reached, last = residuals(summary), plain(summary['settling']['dwell'])
        listed = join([f'{DOFS[i]} ({reached[i]})' for i in late])
        yield f'not settled: {listed}; in brackets the largest error of the last {last} s'


def comparison_table(summaries: Mapping[str, Mapping[str, Any]]) -> Table:
    """Each run in a line."""
    table = Table(box=None, header_style='bold', pad_edge=False)
    table.add_column('', overflow='fold')
    for column in ('energy, J', 'settled, s', 'largest error after 2 s', 'in'):
        table.add_column(column, justify='right' if column != 'in' else 'left')
    for name, summary in summaries.items():
        times = summary['velocity_error']['settling_time']
        settled = MISSING if times is None or None in times else number(max(times))
        worst = _worst(summary['velocity_error']['max_after_2s'])
        mean = number(summary['kinetic_energy']['mean'], 5)
        table.add_row(Text(name), mean, settled, *worst)
    return table


def _worst(errors: Sequence[float | None] | None) -> tuple[str, str]:
    i = None if errors is None else largest(errors)
    if errors is None or i is None:
        return MISSING, ''
    return f'{number(errors[i])} {"m/s" if i < 3 else "rad/s"}', DOFS[i]


def _table(*columns: Column, bars: Sequence[RenderableType] = ()) -> Table:
    table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False, header_style='bold')
    table.add_column('')
    for header, _ in columns:
        table.add_column(header, justify='right', no_wrap=True, min_width=WIDTH)
    for i, dof in enumerate(DOFS):
        table.add_row(dof, *(texts[i] for _, texts in columns), *bars[i : i + 1])
    return table


def _numbers(values: Sequence[float | None] | None) -> list[str]:
    return [_short(value) for value in values or [None] * 6]


def _short(value: float | None) -> str:
    """Number with three digits; with fewer, where it is so small that a column does not hold it."""
    texts = [number(value, digits) for digits in (3, 2, 1)]
    return next((text for text in texts if len(text) <= WIDTH), texts[-1])


def _coupled(values: Sequence[float | None] | None, zeros: Sequence[str]) -> list[str]:
    """Couplings; those that vanish for this vehicle whatever it does are no measurement."""
    texts = zip(DOFS, _numbers(values), strict=True)
    return [ZERO if dof in zeros else text for dof, text in texts]


def finish(
    out: Path,
    runs: Mapping[str, Run],
    failure: Exception | None,
    scenario: Scenario,
    **chosen: Any,
) -> dict[str, Any]:
    """Conclude the runs that came to their end; then raise the failure of another one with them."""
    texts, document = scenario.attachments, {}
    if failure is not None:
        note = first_line(failure)
        if not isinstance(failure, TroubleError):
            note = f'{FAILED}: {note}'
        runs = {name: replace(run, notes=(*run.notes, note)) for name, run in runs.items()}
    if runs:
        document = conclude(out, runs, texts['scenario.yaml'], texts['vehicle.yaml'], **chosen)
    if failure is not None:
        raise FailedError(str(failure), document or None) from failure
    return document


def conclude(
    out: Path,
    runs: Mapping[str, Run],
    scenario_text: str | dict[str, str],
    vehicle_text: str | dict[str, str],
    *,
    windows: Sequence[Window] = (),
    examine: Examine = lambda *_: {},
    report: bool = True,
) -> dict[str, Any]:
    """Write summary and report, show the tables.

    Parameters
    ----------
    out : folder of the results
    runs : name -> run
    scenario_text, vehicle_text : as for `write_report`
    windows : of the kinetic energy beside the usual ones, s
    examine : runs and summaries -> what the report has beside them: sections by place in `more`,
        `sentences`, and `claims` of the paper, as they were judged
    report : whether there is a report, with its plots

    Returns
    -------
    summaries : name -> summary

    """
    with waiting('computing the metrics of summary.json'):
        summaries = {name: summarize(run, windows=windows) for name, run in runs.items()}
        shown = digests(runs) if report or len(runs) > 1 else {}
    write_json(out / 'summary.json', summaries)
    if report:
        added = examine(runs, summaries)
        _report(out, runs, shown, summaries, (scenario_text, vehicle_text), added)
    for sentence in verdict(shown, summaries):
        say(sentence)
    console.print(summary_tables(summaries))
    for name, run in runs.items():
        most = summaries[name]['effort']['max']
        for remark in beyond_authority(run.vehicle, most, both_ways(run)):
            say(f'note: {name}: {remark}')
    return summaries


def _report(
    out: Path,
    runs: Mapping[str, Run],
    shown: Mapping[str, RunDigest],
    summaries: dict[str, Any],
    texts: tuple[Any, Any],
    added: Mapping[str, Any],
) -> None:
    # with matplotlib, which loads slowly
    from auv_analysis.herman2018.claims import claims_part, judge_runs
    from auv_analysis.report.faults import fault_part
    from auv_analysis.report.run_report import write_report

    more = {name: [*sections] for name, sections in added.get('more', {}).items()}
    judged = added.get('claims')
    judged = judge_runs(shown, summaries) if judged is None else judged
    claims, counted = claims_part(out, judged, shown)
    more['couplings'] = [*more.get('couplings', ()), *claims]
    sentences = [*counted, *added.get('sentences', ())]
    part = fault_part(out, runs)
    if part is not None:
        section, on_faults = part
        more['tracking'] = [section, *more.get('tracking', ())]
        sentences = [*on_faults, *sentences]
    with waiting('drawing plots, writing the report'):
        write_report(out, shown, summaries, *texts, more=more, sentences=sentences)
