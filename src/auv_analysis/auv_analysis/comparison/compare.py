"""Many runs, one after the other, into a comparison: table, figures, report."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa

from auv_analysis.commands.conclude import show
from auv_analysis.comparison.entries import Entry, comparison_table, write_table
from auv_analysis.comparison.opening import named, open_source
from auv_analysis.comparison.ranking import Ranking, rank
from auv_analysis.comparison.sources import Source
from auv_analysis.console import say
from auv_analysis.counting import each
from auv_analysis.failure import FailedError
from auv_analysis.new_files import write_json
from auv_analysis.progress import waiting
from auv_analysis.report.sketch import Sketch
from auv_analysis.summary import summarize
from auv_dynamics.files import first_line
from auv_dynamics.vehicle import Vehicle


class _Plan(NamedTuple):
    """Names of a run that diverged."""

    scenario: str
    controller: str
    law: str
    vehicle: Vehicle


class _Found(NamedTuple):
    source: Source
    known: Sketch | _Plan
    summary: dict[str, Any]
    failure: str


def entries_of(sources: Sequence[Source], vehicle: str | None = None) -> list[Entry]:
    """Read or simulate each source, keep its figures and forget its samples.

    Parameters
    ----------
    sources : of `sources_of`
    vehicle : for bags that do not carry their own

    Returns
    -------
    entries : in the order of the sources; a simulation that diverges has no figures

    Raises
    ------
    InputError : a source cannot be read
    FailedError : every one diverged

    """
    from auv_analysis.report.sketching import sketch  # with matplotlib, which loads slowly

    found = []
    for source in each(sources, len(sources)):
        try:
            run = open_source(source, vehicle).run
        except ArithmeticError as error:  # it diverges, or a user's own law fails
            found.append(_Found(source, _plan(source), {}, first_line(error)))
        else:
            found.append(_Found(source, sketch(run), summarize(run), ''))
    if all(entry.failure for entry in found):
        raise FailedError(f'all of {len(found)} runs failed, the first: {found[0].failure}')
    names = named([(entry.source, entry.known) for entry in found])
    return [_entry(*pair) for pair in zip(names, found, strict=True)]


def _plan(source: Source) -> _Plan:
    scenario = source.scenario
    assert scenario is not None, 'only what is simulated diverges'
    law = scenario.controller(source.controller)['law']
    return _Plan(scenario.name, source.controller, law, scenario.vehicle)


def _entry(name: str, found: _Found) -> Entry:
    source, known = found.source, found.known
    return Entry(
        name=name,
        scenario=known.scenario,
        vehicle=known.vehicle.name,
        controller=known.controller,
        law=known.law,
        origin='simulated now' if source.kind == 'scenario' else str(source.path),
        summary=found.summary,
        sketch=None if isinstance(known, _Plan) else known,
        failure=found.failure,
    )


def conclude_comparison(
    out: Path, entries: Sequence[Entry], *, report: bool = True
) -> dict[str, Any]:
    """Write summary.json, table, figures and report.

    Parameters
    ----------
    out : folder, prepared
    entries : of `entries_of`
    report : whether there is a report, with its figures

    Returns
    -------
    summaries : name -> summary, None of a run that diverged

    """
    summaries = {entry.name: entry.summary or None for entry in entries}
    write_json(out / 'summary.json', summaries)
    table = comparison_table(entries)
    ranking = rank(table)
    write_table(table, ranking, out)
    if report:
        _report(out, entries, table, ranking)
    for entry in entries:
        for note in [entry.failure] if entry.failure else entry.summary['notes']:
            say(f'note: {entry.name}: {note}')
    show({entry.name: entry.summary for entry in entries if entry.summary})
    return summaries


def _report(out: Path, entries: Sequence[Entry], table: pa.Table, ranking: Ranking) -> None:
    # with matplotlib, which loads slowly
    from auv_analysis.comparison.figures import draw
    from auv_analysis.comparison.report import write_comparison

    with waiting('drawing figures, writing the report'):
        figures = draw(entries, table, ranking, out / 'figures')
        write_comparison(out, entries, table, ranking, figures)
