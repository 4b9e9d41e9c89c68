"""What each subcommand of `auv` does: options in, a JSON-ready document out."""

import argparse
import json
import os
import sys
import time
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from auv_analysis import vehicle_check
from auv_analysis.bag import bag_files, load_run, read_bag
from auv_analysis.domain import VARIABLE, chosen_domain
from auv_analysis.experiment import environment, run_controller, write_inputs
from auv_analysis.folder import prepare
from auv_analysis.node_parameters import node_parameters, parameter_file
from auv_analysis.run import Run
from auv_analysis.scenario import Scenario, load_scenario
from auv_analysis.simulation import check_hold
from auv_analysis.simulation import simulate as simulate_run
from auv_analysis.summary import summarize
from auv_analysis.supervisor import NodeDiedError
from auv_analysis.vehicle_table import print_check
from auv_analysis.warm_up import announce, warm_up
from auv_dynamics.files import InputError, reason
from auv_dynamics.signals import DOFS

FailedError = NodeDiedError
DISCOVERY = 3.0  # s: discovery may take so long
console = Console(stderr=True)


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _open(options: argparse.Namespace) -> tuple[Scenario, list[str]]:
    scenario = load_scenario(options.scenario)
    names = list(dict.fromkeys(options.controller or scenario.controllers))
    for name in names:
        scenario.controller(name)
    return scenario, names


def _prepare(options: argparse.Namespace, scenario: Scenario, names: list[str]) -> Path:
    """Folder of the results; warnings only now, so that a refusal is one line."""
    out = prepare(
        options.out or Path('runs') / scenario.name,
        overwrite=options.overwrite,
        inputs=scenario.inputs,
        new=names,
    )
    for warning in scenario.warnings:
        _say(f'warning: {warning}')
    return out


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Real nodes, in lock-step, recorded."""
    scenario, names = _open(options)
    domain, picked = chosen_domain(options.domain_id)
    os.environ.update(environment(domain))
    # the middleware reads its environment when it is loaded
    from auv_dynamics.ros.watcher import Watcher

    graph = Watcher(domain)
    try:
        if not picked:
            _refuse_strangers(graph, domain)
        out = _prepare(options, scenario, names)
        warm_up(scenario, names)
        _say(f'export {VARIABLE}={domain}')
        failure, done = None, []
        for name in names:
            graph.running = False
            with _progress() as bar:
                task = bar.add_task(f'{scenario.name} {name}', total=scenario.steps)
                show = partial(_show_step, bar, task)
                try:
                    run_controller(scenario, name, out, domain, graph, show)
                except NodeDiedError as error:
                    failure = error
                    break  # the graph is broken; what was recorded is still worth a report
            done.append(name)
    finally:
        graph.close()
    return _finish(out, {name: load_run(out / name) for name in done}, scenario, failure)


def _refuse_strangers(graph: Any, domain: int) -> None:
    until = time.monotonic() + DISCOVERY
    strangers: list[str] = []
    while not strangers and time.monotonic() < until:
        graph.spin(0.1)
        strangers = graph.endpoints()
    if strangers:
        graph.spin(0.5)  # the names of nodes arrive behind their endpoints
        strangers = graph.endpoints() or strangers
        expected = 'a domain without endpoints on wrench or odom'
        raise InputError(f'{VARIABLE}={domain}', '', expected, ', '.join(strangers))


def _show_step(bar: Progress, task: TaskID, step: int) -> None:
    bar.update(task, completed=step)


class _Speed(ProgressColumn):
    """Steps per second, of a run that has begun."""

    def render(self, task: Task) -> str:
        """Text of the column."""
        speed = task.finished_speed or task.speed
        return f'{speed:>6.0f} steps/s' if speed else ''


def _progress() -> Progress:
    return Progress(
        TextColumn('{task.description:<16}'),
        BarColumn(bar_width=40),
        TextColumn('{task.completed:>6}/{task.total} steps'),
        _Speed(),
        TimeRemainingColumn(),
        console=console,
    )


def simulate(options: argparse.Namespace) -> dict[str, Any]:
    """In this process, by the same kernel."""
    scenario, names = _open(options)
    check_hold(scenario, options.hold)
    out = _prepare(options, scenario, names)
    write_inputs(scenario, out)
    announce(scenario, names)
    runs, failure = {}, None
    for name in names:
        try:
            with console.status(f'{scenario.name} {name}: simulating'):
                runs[name] = simulate_run(scenario, name, options.hold)
        except ArithmeticError as error:  # it diverges, or a user's own law fails
            failure = failure or error
            continue
        _write_samples(runs[name], out / f'{name}.npz')
    return _finish(out, runs, scenario, failure)


def _write_samples(run: Run, path: Path) -> None:
    motion, forces = ('t', 'eta', 'nu', 'nu_measured', 'nu_d', 'nu_d_dot'), ('tau', 'tau_applied')
    names = (*motion, *forces, 'disturbance', 'disturbance_estimate')
    np.savez_compressed(path, **{name: getattr(run, name) for name in names})


def _finish(
    out: Path, runs: dict[str, Run], scenario: Scenario, failure: Exception | None
) -> dict[str, Any]:
    """Summary and report of the runs that came to their end; then the failure of another one."""
    texts, document = scenario.attachments, {}
    if failure is not None:
        note = f'another controller did not come to its end: {str(failure).splitlines()[0]}'
        runs = {name: replace(run, notes=(*run.notes, note)) for name, run in runs.items()}
    if runs:
        document = _conclude(out, runs, texts['scenario.yaml'], texts['vehicle.yaml'])
    if failure is not None:
        raise failure
    return document


def _conclude(
    out: Path, runs: dict[str, Run], scenario_text: str, vehicle_text: str
) -> dict[str, Any]:
    summaries = {name: summarize(run) for name, run in runs.items()}
    text = json.dumps(summaries, indent=2, allow_nan=False)
    (out / 'summary.json').write_text(text + '\n', encoding='utf-8')
    from auv_analysis.report.page import write_report  # with matplotlib, which loads slowly

    with console.status('drawing figures, writing the report'):
        report = write_report(out, runs, summaries, scenario_text, vehicle_text)
    for name, run in runs.items():
        for note in run.notes:
            _say(f'note: {name}: {note}')
    _show(summaries)
    _say(f'report: {report}')
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
    return _conclude(prepare(out, overwrite=options.overwrite, inputs=files), runs, *texts)


def _free_name(name: str, taken: Iterable[str]) -> str:
    taken = list(taken)
    number, free = 2, name
    while free in taken:
        free, number = f'{name}_{number}', number + 1
    return free


def info(options: argparse.Namespace) -> dict[str, Any]:
    """What lies in a bag."""
    contents = read_bag(options.bag, decode=False)
    first, last = contents.first, contents.last
    span = None if first is None or last is None else (last - first) / 1e9
    document = {
        'bag': str(options.bag),
        'files': [path.name for path in bag_files(options.bag)],
        'duration': span,
        'messages': sum(contents.counts.values()),
        'topics': {
            topic: {'type': kind, 'messages': contents.counts.get(topic, 0)}
            for topic, kind in sorted(contents.types.items())
        },
        'attachments': sorted(contents.attachments),
        'notes': contents.notes,
    }
    if not options.json:
        _print_info(document)
    return document


def _print_info(document: dict[str, Any]) -> None:
    out = Console()
    span = 'no messages' if document['duration'] is None else f'{document["duration"]:g} s'
    out.print(f'{document["bag"]}: {document["messages"]} messages, {span}')
    table = Table(box=None, header_style='bold')
    for column in ('topic', 'type', 'messages'):
        table.add_column(column)
    for topic, entry in document['topics'].items():
        table.add_row(topic, entry['type'], str(entry['messages']))
    out.print(table)
    out.print(f'attachments: {", ".join(document["attachments"]) or "none"}')
    for note in document['notes']:
        out.print(f'note: {note}')


def params(options: argparse.Namespace) -> dict[str, Any]:
    """The parameter file that `auv run` would write, for plain `ros2 run`."""
    scenario = load_scenario(options.scenario)
    lockstep = not options.real_time
    bag = Path('runs') / scenario.name / options.controller
    parameters = node_parameters(
        scenario,
        options.controller,
        bag=bag,
        lockstep=lockstep,
        vehicle=scenario.shipped_vehicle,
    )
    text = parameter_file(
        parameters, f'auv params {scenario.name} --controller {options.controller}'
    )
    if options.out is not None:
        if options.out.exists() and not options.overwrite:
            raise InputError(options.out, '--out', 'a new file, or --overwrite', 'an existing file')
        try:
            options.out.parent.mkdir(parents=True, exist_ok=True)
            options.out.write_text(text, encoding='utf-8')
        except OSError as error:
            found = reason(error)
            raise InputError(options.out, '--out', 'a file that can be written', found) from None
    elif not options.json:
        print(text, end='')
    return parameters


def check_vehicle(options: argparse.Namespace) -> dict[str, Any]:
    """What a vehicle file says about how it can be controlled."""
    document = vehicle_check.check_vehicle(options.vehicle)
    if not options.json:
        print_check(document)
    return document
