"""`auv analyze`: summary and report of runs, recorded or simulated, and of sweeps."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from auv_analysis.cli.arguments import (
    add_no_report,
    add_results,
    add_topics,
    import_law,
    refuse_given,
    topic_map,
)
from auv_dynamics.files.errors import InputError

if TYPE_CHECKING:
    from auv_analysis.output.folder import ResultsFolder
    from auv_analysis.studies.compare.sources import RunSource

FEW = 3  # runs up to which the report shows every figure of each
LONGEST = 80  # of a folder's name
OF_BAGS = (
    'vehicle', 'namespace', 'map', 'odometry', 'wrench', 'setpoint', 'frames', 'twist_frame',
    'step', 'gap',
)  # fmt: skip
OF_RUNS = ('no_report', 'law', *OF_BAGS)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Runs, and what their bags do not say of themselves."""
    add_results(command)
    text = 'a bag, a folder of results or of a sweep, or a scenario, which is simulated'
    command.add_argument('results', nargs='+', metavar='BAG', help=text)
    command.add_argument('--by', metavar='METRIC', help='of a sweep: metric that ranks its rows')
    command.add_argument('--vehicle', help='vehicle file, for bags without their own')
    text = 'of the vehicle in a bag of several; default: that of the recorder'
    command.add_argument('--namespace', metavar='NS', help=text)
    add_no_report(command)
    text = 'own law that results may name, as its code may run; may be repeated'
    command.add_argument('--law', metavar='MODULE:CLASS', action='append', help=text)
    group = add_topics(command)
    group.add_argument('--setpoint', metavar='TOPIC', help='TwistStamped, Twist or Odometry')
    text = 'resampling period, default: the median period of the velocity'
    group.add_argument('--step', type=float, metavar='S', help=text)
    group.add_argument('--gap', type=float, metavar='S', help='longer pauses are gaps, s')


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Summary and report of runs, recorded or simulated, or of a sweep."""
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # small matrices: threads only wait
    from auv_analysis.output.folder import check_free
    from auv_analysis.studies.compare.sources import is_sweep, sources_of

    sweeps = [argument for argument in options.results if is_sweep(argument)]
    if sweeps:
        if len(options.results) > 1:
            found = f'{len(options.results)} arguments'
            raise InputError(sweeps[0], '', 'a sweep alone, without other results', found)
        refuse_given(options, OF_RUNS, 'runs', f'{sweeps[0]}, a sweep')
        from auv_analysis.studies.sweep.report import explore

        chosen = {'out': options.out, 'by': options.by, 'overwrite': options.overwrite}
        return explore(Path(sweeps[0]), **chosen)
    refuse_given(options, ('by',), 'a sweep', options.results[0])
    for law in options.law or ():
        import_law(law)
    mapping = topic_map(options, options.vehicle)
    if mapping is not None:
        refuse_given(options, ('namespace',), 'a bag of our nodes', 'a mapping of topics')
    sources = sources_of(options.results, mapping, options.namespace)
    if all(source.kind != 'bag' for source in sources):
        refuse_given(options, OF_BAGS, 'a bag', options.results[0])
    if options.out:
        check_free(options.out, overwrite=options.overwrite, inputs=_inputs(sources, options))
    return _few(sources, options) if len(sources) <= FEW else _many(sources, options)


def _few(sources: Sequence[RunSource], options: argparse.Namespace) -> dict[str, Any]:
    from auv_analysis.cli.scenario_runs import conclude
    from auv_analysis.output.progress import waiting
    from auv_analysis.studies.compare.sources import named, open_source

    opened = []
    for source in sources:
        with waiting(f'reading {source.path}'):
            opened.append(open_source(source, options.vehicle))
    pairs = [(source, entry.run) for source, entry in zip(sources, opened, strict=True)]
    names = named(pairs, join='_')
    runs = dict(zip(names, (entry.run for entry in opened), strict=True))
    scenario_texts, vehicle_texts = (
        {n: one.attachments.get(file, '') for n, one in zip(names, opened, strict=True)}
        for file in ('scenario.yaml', 'vehicle.yaml')
    )
    report = not options.no_report
    with _folder([entry.run.scenario for entry in opened], sources, options) as results:
        return conclude(results.folder, runs, scenario_texts, vehicle_texts, report=report)


def _many(sources: Sequence[RunSource], options: argparse.Namespace) -> dict[str, Any]:
    from auv_analysis.cli.scenario_runs import comparison_table
    from auv_analysis.output.progress import console, waiting
    from auv_analysis.studies.compare.report import conclude_comparison, entries_of

    with waiting(f'reading {len(sources)} runs'):
        entries = entries_of(sources, options.vehicle)
    with _folder([entry.scenario for entry in entries], sources, options) as results:
        summaries = conclude_comparison(results.folder, entries, report=not options.no_report)
    table = comparison_table({name: summary for name, summary in summaries.items() if summary})
    console.print(table)
    return summaries


def _inputs(sources: Sequence[RunSource], options: argparse.Namespace) -> list[Path]:
    files = [file for source in sources for file in source.files]
    return files + ([Path(options.map)] if options.map else [])


def _folder(
    scenarios: Sequence[str], sources: Sequence[RunSource], options: argparse.Namespace
) -> AbstractContextManager[ResultsFolder]:
    """Folder of the results, only now that all has been read."""
    from auv_analysis.output.folder import results_folder

    names = list(dict.fromkeys(scenarios))
    name = '_'.join(names)
    if len(names) > 1 and (len(names) > FEW or len(name) > LONGEST):
        name = f'{names[0]}_and_{len(names) - 1}_more'
    inputs = _inputs(sources, options)
    out = options.out or Path('runs') / f'analyze_{name}'
    return results_folder(out, overwrite=options.overwrite, inputs=inputs)
