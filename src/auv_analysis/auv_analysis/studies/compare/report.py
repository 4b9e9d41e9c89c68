"""The report of a comparison of any number of runs: a table with a row each, and its findings."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from auv_analysis.metrics.measures import FAMILIES, MEASURES
from auv_analysis.metrics.quantities import quantity
from auv_analysis.metrics.summary import summarize
from auv_analysis.output.arrow import pa
from auv_analysis.output.new_files import write_json
from auv_analysis.output.progress import each, say, waiting
from auv_analysis.output.text import capital, join, number
from auv_analysis.report.digest import digest
from auv_analysis.report.document import Section, Sentence, write_document
from auv_analysis.report.plots import FigureRecord
from auv_analysis.report.results import Column, Table, described, make_table
from auv_analysis.report.run_report import namesakes
from auv_analysis.studies.compare.plots import draw
from auv_analysis.studies.compare.ranking import (
    CSV,
    ERRORS,
    TABLE,
    Entry,
    comparison_table,
    rank,
    write_table,
)
from auv_analysis.studies.compare.sources import RunSource, named, open_source
from auv_dynamics.files.errors import FailedError, first_line, printable
from auv_dynamics.vehicle import DOFS

SECTIONS = {  # section -> its title, and the families of metrics in it
    'errors': (
        'Errors',
        ('velocity_error.rms', 'velocity_error.max_after_2s', 'velocity_error.settling_time'),
    ),
    'couplings': ('Couplings', ('coupling.delta_xi_max', 'coupling.delta_pi_max')),
    'inputs': ('Inputs', ('effort.rms', 'effort.max')),
}
NAMED = {
    'run': described('run'),
    'scenario': described('scenario', 'what is asked of the vehicle, and what disturbs it'),
    'vehicle': described('vehicle', 'what the controller knows of the vehicle'),
    'controller': described('controller', 'name of the controller in its scenario'),
    'law': described('law', 'control law'),
    'duration': described('duration', 'length of the run', 's'),
    'step': described('step', 'control period', 's'),
}
SHARES = 'kinetic_energy.shares_percent'
SETTLED = 'overall.velocity_error.settling_time'
RUNS = 'table-runs'
MOST_NAMES = 6
Rows = Sequence[Mapping[str, Any]]


def entries_of(sources: Sequence[RunSource], vehicle: str | None = None) -> list[Entry]:
    """Read or simulate each source, keep its metrics and forget its samples.

    Parameters
    ----------
    sources : of `sources_of`
    vehicle : for bags that do not carry their own

    Returns
    -------
    entries : in the order of the sources; a simulation that diverges has no metrics

    Raises
    ------
    InputError : a source cannot be read
    FailedError : every one diverged

    """
    found = [_entry(source, vehicle) for source in each(sources, len(sources))]
    if all(entry.failure for entry in found):
        raise FailedError(f'all of {len(found)} runs failed, the first: {found[0].failure}')
    names = named([*zip(sources, found, strict=True)])
    return [replace(entry, name=name) for entry, name in zip(found, names, strict=True)]


def _entry(source: RunSource, vehicle: str | None) -> Entry:
    """Entry without a name."""
    origin = 'simulated now' if source.kind == 'scenario' else printable(str(source.path))
    try:
        run = open_source(source, vehicle).run
    except ArithmeticError as error:  # it diverges, or a user's own law fails
        one, name = source.scenario, source.controller
        assert one is not None, 'only what is simulated diverges'
        names = one.name, one.vehicle.name, name, one.controller(name)['law']
        return Entry('', *names, origin, {}, None, first_line(error))
    names = run.scenario, run.vehicle.name, run.controller, run.law
    return Entry('', *names, origin, summarize(run), digest(run))


def conclude_comparison(out: Path, entries: Sequence[Entry], *, report: bool) -> dict[str, Any]:
    """Write summary.json, table and, where asked for, plots and report.

    Returns name -> summary, None of a run that diverged.
    """
    summaries = {entry.name: entry.summary or None for entry in entries}
    write_json(out / 'summary.json', summaries)
    table = comparison_table(entries)
    ranking = rank(table)
    write_table(table, ranking, out)
    if report:
        with waiting('drawing figures, writing the report'):
            figures = draw(entries, table, ranking, out / 'figures')
            write_comparison(out, entries, table, figures)
    for entry in entries:
        for note in [entry.failure] if entry.failure else entry.summary['notes']:
            say(f'note: {entry.name}: {note}')
    return summaries


def write_comparison(
    out: Path,
    entries: Sequence[Entry],
    table: pa.Table,
    figures: Mapping[str, FigureRecord],
) -> Path:
    """Write report.html of a comparison into an existing folder; returns its path."""
    sections = [
        Section('overview', 'All runs', [overview(table), figures['ranking'], figures['errors']]),
        Section('energy', 'Kinetic energy', [six_table(table, SHARES), figures['kinetic_energy']]),
        *(
            Section(name, title, [six_table(table, family) for family in families])
            for name, (title, families) in SECTIONS.items()
        ),
    ]
    about = (
        f'{len(entries)} runs of {_counted(entries, "scenario")} on '
        f'{_counted(entries, "vehicle")}. '
        f'Every metric of every run: {TABLE} and {CSV}.'
    )
    title = f'Comparison of {len(entries)} runs'
    said = findings(entries, table.to_pylist())
    return write_document(out, title, about, said, sections)


def _counted(entries: Sequence[Entry], name: str) -> str:
    """'3 scenarios', or the only one by its name."""
    found = list(dict.fromkeys(getattr(entry, name) for entry in entries))
    return f'{name} {join(found)}' if len(found) == 1 else f'{len(found)} {name}s'


def overview(table: pa.Table) -> Table:
    """The table with a row per run: who it is, and every measure that sums it up."""
    measures = {m.name: described(m.label, m.meaning, m.unit) for m in MEASURES}
    caption = 'All runs. Click on a head to sort by it.'
    return make_table('runs', caption, table, NAMED | measures, file=TABLE)


def six_table(table: pa.Table, family: str) -> Table:
    """A row per run, a column per degree of freedom."""
    meaning = FAMILIES[family].meaning
    caption, name = f'{capital(meaning)}.', family.replace('.', '_')
    shown = {'run': NAMED['run']}
    for dof in DOFS:
        column = f'{family}.{dof}'
        shown[column] = Column(replace(quantity(column), label=dof))
    return make_table(name, caption, table, shown, file=TABLE)


def findings(entries: Sequence[Entry], rows: Rows) -> list[Sentence]:
    """Sentences of the summary: who settles, what differs, what cannot be compared."""
    known = [row for row in rows if not row['failure']]
    found = [_settled(known), _differing(known), _diverged(rows)]
    found += namesakes([entry.digest for entry in entries if entry.digest])
    return [Sentence(text, RUNS) for text in found if text]


def _settled(rows: Rows) -> str:
    times = {row['run']: row[SETTLED] for row in rows if row[ERRORS] is not None}
    if not times:
        return ''
    settled = {name: time for name, time in times.items() if time is not None}
    if not settled:
        return f'In none of {len(times)} runs do all six velocity errors settle.'
    first, last = min(settled, key=settled.__getitem__), max(settled, key=settled.__getitem__)
    text = f'In {len(settled)} of {len(times)} runs all six velocity errors settle'
    if len(settled) == 1:
        return f'{text}: {first} after {number(settled[first])} s.'
    ends = f'{first} after {number(settled[first])} s, the last {last} after'
    return f'{text}, the first {ends} {number(settled[last])} s.'


def _first(words: Sequence[str]) -> str:
    """As many as are listed, and whether there are others."""
    return join([*words[:MOST_NAMES], *(['others'] if len(words) > MOST_NAMES else [])])


def _differing(rows: Rows) -> str:
    """Durations and steps where they are not all the same, and what that means."""
    parts = []
    for name in ('duration', 'step'):
        counts = Counter(f'{row[name]:g} s' for row in rows)  # 0.3 and 3 * 0.1 are the same
        if len(counts) > 1:
            listed = [f'{text} ({count} runs)' for text, count in counts.most_common()]
            parts.append(f'{name}s differ: {_first(listed)}')
    if not parts:
        return ''
    text = '; '.join(parts)
    return f'{capital(text)}; means and root mean squares are those of each whole run.'


def _diverged(rows: Rows) -> str:
    failed = [row['run'] for row in rows if row['failure']]
    if not failed:
        return ''
    return f'{len(failed)} of {len(rows)} runs failed and have no figures: {_first(failed)}.'
