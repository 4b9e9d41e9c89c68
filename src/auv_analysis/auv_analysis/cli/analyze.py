"""`auv analyze`: summary and report of runs, recorded or simulated, and of sweeps."""

import argparse
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from auv_analysis.bag.foreign_topics import OPTIONS, TopicMap, read_mapping
from auv_analysis.cli.conclude import conclude, show
from auv_analysis.output.folder import Results, check_free, results_folder
from auv_analysis.output.progress import waiting
from auv_analysis.studies.compare.sources import Source, is_sweep, named, open_source, sources_of
from auv_dynamics.files.errors import InputError
from auv_gvc_controller.laws.law import law_class, refusal

FEW = 3  # runs up to which the report shows every figure of each
LONGEST = 80  # of a folder's name


def analyze(options: argparse.Namespace) -> dict[str, Any]:
    """Summary and report of runs, recorded or simulated, or of a sweep."""
    sweeps = [argument for argument in options.results if is_sweep(argument)]
    if sweeps:
        if len(options.results) > 1:
            found = f'{len(options.results)} arguments'
            raise InputError(sweeps[0], '', 'a sweep alone, without other results', found)
        if options.no_report:
            raise InputError('--no-report', '', 'runs', f'{sweeps[0]}, a sweep')
        from auv_analysis.studies.sweep.report import explore

        chosen = {'out': options.out, 'by': options.by, 'overwrite': options.overwrite}
        return explore(Path(sweeps[0]), **chosen)
    _import_laws(options.law or ())
    mapping = _mapping(options)
    sources = sources_of(options.results, mapping, options.namespace)
    if options.out:
        check_free(options.out, overwrite=options.overwrite)
    return _few(sources, options) if len(sources) <= FEW else _many(sources, options)


def _import_laws(names: Sequence[str]) -> None:
    """Import the own laws that may be: bags and results that name them do not."""
    for name in names:
        try:
            law_class(name)
        except ValueError as error:
            _, expected, found = refusal(error)
            raise InputError('--law', '', expected, found) from None


def _mapping(options: argparse.Namespace) -> TopicMap | None:
    """What is told of bags of other systems; None where nothing is."""
    given = {key: getattr(options, key) for key in OPTIONS}
    if options.map is None and all(value is None for value in given.values()):
        return None
    return read_mapping(options.map, given | {'vehicle': options.vehicle})


def _few(sources: Sequence[Source], options: argparse.Namespace) -> dict[str, Any]:
    opened = []
    for source in sources:
        with waiting(f'reading {source.path}'):
            opened.append(open_source(source, options.vehicle))
    pairs = [(source, entry.run) for source, entry in zip(sources, opened, strict=True)]
    names = named(pairs, join='_')
    runs = dict(zip(names, (entry.run for entry in opened), strict=True))
    scenario_texts = dict(zip(names, (entry.scenario_text for entry in opened), strict=True))
    vehicle_texts = dict(zip(names, (entry.vehicle_text for entry in opened), strict=True))
    report = not options.no_report
    with _folder([entry.run.scenario for entry in opened], sources, options) as results:
        return conclude(results.folder, runs, scenario_texts, vehicle_texts, report=report)


def _many(sources: Sequence[Source], options: argparse.Namespace) -> dict[str, Any]:
    from auv_analysis.studies.compare.report import conclude_comparison, entries_of

    with waiting(f'reading {len(sources)} runs'):
        entries = entries_of(sources, options.vehicle)
    with _folder([entry.scenario for entry in entries], sources, options) as results:
        summaries = conclude_comparison(results.folder, entries, report=not options.no_report)
    show({name: summary for name, summary in summaries.items() if summary})
    return summaries


def _folder(
    scenarios: Sequence[str], sources: Sequence[Source], options: argparse.Namespace
) -> AbstractContextManager[Results]:
    """Folder of the results, only now that all has been read."""
    names = list(dict.fromkeys(scenarios))
    name = '_'.join(names)
    if len(names) > FEW or len(name) > LONGEST:
        name = f'{names[0]}_and_{len(names) - 1}_more'
    files = [file for source in sources for file in source.files]
    files += [Path(options.map)] if options.map else []
    out = options.out or Path('runs') / f'analyze_{name}'
    return results_folder(out, overwrite=options.overwrite, inputs=files)
