"""The report of a comparison: what differs, one table with a row per run, six figures each."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa

from auv_analysis.cli.conclude import show
from auv_analysis.metrics.measures import (
    BY_NAME,
    FAMILIES,
    MEASURES,
    described,
)
from auv_analysis.metrics.summary import summarize
from auv_analysis.output.new_files import write_json
from auv_analysis.output.progress import each, say, waiting
from auv_analysis.output.text import join, number
from auv_analysis.report.digest import Sketch
from auv_analysis.report.document import (
    Cell,
    Column,
    Section,
    Sentence,
    Table,
    cell,
    write_document,
)
from auv_analysis.report.plots import ALWAYS, FigureRecord
from auv_analysis.report.run_report import namesakes
from auv_analysis.studies.compare.plots import SIX
from auv_analysis.studies.compare.ranking import (
    CSV,
    ERRORS,
    TABLE,
    Entry,
    Ranking,
    comparison_table,
    rank,
    write_table,
)
from auv_analysis.studies.compare.sources import Source, named, open_source
from auv_dynamics.files.errors import FailedError, first_line
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle

NAMED = {  # column of words -> head, meaning
    'scenario': 'what is asked of the vehicle, and what disturbs it',
    'vehicle': 'what the controller knows of the vehicle',
    'controller': 'name of the controller in its scenario',
    'law': 'control law',
}
PLAIN = {  # column of numbers -> unit, meaning
    'duration': ('s', 'length of the run'),
    'step': ('s', 'control period'),
}
SHARES = 'kinetic_energy.shares_percent'
TABLES = {  # section -> families of its tables and figures
    'errors': ('Errors', ('rms_errors', 'late_errors', 'settling_times')),
    'couplings': ('Couplings', ('delta_xi', 'delta_pi')),
    'inputs': ('Inputs', ('rms_inputs', 'peak_inputs')),
}


def write_comparison(
    out: Path,
    entries: Sequence[Entry],
    table: pa.Table,
    ranking: Ranking,
    figures: Mapping[str, FigureRecord],
) -> Path:
    """Write report.html of a comparison; returns its path.

    Parameters
    ----------
    out : folder, existing
    entries, table, ranking, figures : of the same runs

    """
    rows = table.to_pylist()
    sections = [
        Section('overview', 'All runs', [overview(rows), figures['ranking'], figures['errors']]),
        Section('energy', 'Kinetic energy', [_six_table(rows, SHARES), figures['kinetic_energy']]),
    ]
    for name, (title, members) in TABLES.items():
        blocks = [block for m in members for block in (_six_table(rows, SIX[m][0]), figures[m])]
        sections.append(Section(name, title, blocks))
    about = (
        f'{len(entries)} runs of {_counted(entries, "scenario")} on '
        f'{_counted(entries, "vehicle")}. '
        f'Every figure of every run: {TABLE} and {CSV}.'
    )
    title = f'Comparison of {len(entries)} runs'
    return write_document(out, title, about, findings(entries, rows, ranking), sections)


def _counted(entries: Sequence[Entry], name: str) -> str:
    """'3 scenarios', or the only one by its name."""
    found = list(dict.fromkeys(getattr(entry, name) for entry in entries))
    return f'{name} {found[0]}' if len(found) == 1 else f'{len(found)} {name}s'


def overview(rows: Sequence[Mapping[str, Any]]) -> Table:
    """The table with a row per run: who it is, and every measure that sums it up."""
    columns = [Column('run', numeric=False)]
    columns += [Column(name, meaning=text, numeric=False) for name, text in NAMED.items()]
    columns += [Column(name, unit, text) for name, (unit, text) in PLAIN.items()]
    columns += [Column(m.label, m.unit, m.meaning) for m in MEASURES]
    columns += [_column(f'{SHARES}.{dof}', dof, 'share of kinetic energy') for dof in DOFS]
    numbers = [*PLAIN, *(m.name for m in MEASURES), *(f'{SHARES}.{dof}' for dof in DOFS)]
    body = []
    for i, row in enumerate(rows):
        words = [Cell(row[name]) for name in NAMED]
        body.append([_head(row), *words, *(_cell(row, name, i) for name in numbers)])
    caption = 'All runs. Click on a head to sort by it.'
    failed = [row['run'] for row in rows if row['failure']]
    note = f'Failed, without figures: {join(failed)}.' if failed else ''
    return Table('runs', caption, columns, body, note=note)


def _six_table(rows: Sequence[Mapping[str, Any]], family: str) -> Table:
    columns = [Column('run', numeric=False)]
    columns += [_column(f'{family}.{dof}', dof) for dof in DOFS]
    body = [
        [_head(row), *(_cell(row, f'{family}.{dof}', i) for dof in DOFS)]
        for i, row in enumerate(rows)
    ]
    meaning = FAMILIES[family].meaning
    return Table(family.replace('.', '_'), f'{meaning[0].upper()}{meaning[1:]}.', columns, body)


def _head(row: Mapping[str, Any]) -> Cell:
    return Cell(row['run'], remark='failed' if row['failure'] else '')


def _column(name: str, label: str, group: str = '') -> Column:
    _, unit, meaning = described(name)
    return Column(label, unit, meaning, group=group)


def _cell(row: Mapping[str, Any], name: str, index: int) -> Cell:
    family, _, dof = name.rpartition('.')
    kind = family.removeprefix('coupling.').removesuffix('_max')
    if dof in (row.get(f'coupling.structural_zeros.{kind}') or '').split('; '):
        return Cell(ALWAYS, 0.0, f'{TABLE}:{name}[{index}]', 'zero')
    return cell(row.get(name), f'{TABLE}:{name}[{index}]')


SETTLED = 'overall.velocity_error.settling_time'
EXTREMES = (  # measures whose smallest and largest are said, and what they are called
    ('overall.velocity_error.rms.linear', 'rms linear velocity error'),
    ('overall.velocity_error.rms.angular', 'rms angular velocity error'),
    ('overall.effort.rms.linear', 'rms force'),
    ('overall.coupling.delta_xi_max.angular', 'deformation Δξ of an angular velocity'),
)
RUNS = 'table-runs'
MOST_NAMES = 6
Rows = Sequence[Mapping[str, Any]]


def findings(entries: Sequence[Entry], rows: Rows, ranking: Ranking) -> list[Sentence]:
    """Sentences of the summary: what differs, who settles, the extremes, what cannot be compared.

    Parameters
    ----------
    entries, rows, ranking : of the same runs

    """
    known = [row for row in rows if not row['failure']]
    found = [_settled(known), *(_extremes(known, *which) for which in EXTREMES)]
    found += [_uncoupled(entries), _differing(known), _diverged(rows)]
    found += namesakes([entry.sketch for entry in entries if entry.sketch])
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


def _extremes(rows: Rows, name: str, word: str) -> str:
    values = {row['run']: row[name] for row in rows if row[name] is not None}
    if len(set(values.values())) < 2:
        return ''
    least, most = min(values, key=values.__getitem__), max(values, key=values.__getitem__)
    unit = BY_NAME[name].unit
    return (
        f'The {word} goes from {number(values[least])} {unit} ({least}) to '
        f'{number(values[most])} {unit} ({most}).'
    )


def _uncoupled(entries: Sequence[Entry]) -> str:
    vehicles = dict.fromkeys(
        entry.vehicle
        for entry in entries
        if entry.summary
        and all(len(z) == 6 for z in entry.summary['coupling']['structural_zeros'].values())
    )
    if not vehicles:
        return ''
    verb = 'has' if len(vehicles) == 1 else 'have'
    names = join(list(vehicles))
    return f'{names} {verb} a diagonal M: Upsilon = I, nothing is coupled by inertia.'


def _differing(rows: Rows) -> str:
    """Durations and steps where they are not all the same, and what that means."""
    parts = []
    for name in ('duration', 'step'):
        counts = Counter(row[name] for row in rows)
        if len(counts) > 1:
            listed = [f'{value:g} s ({count} runs)' for value, count in counts.most_common(6)]
            parts.append(f'{name}s differ: {join(listed)}')
    if not parts:
        return ''
    text = '; '.join(parts)
    return f'{text[0].upper()}{text[1:]}; means and root mean squares are those of each whole run.'


def _diverged(rows: Rows) -> str:
    failed = [row['run'] for row in rows if row['failure']]
    if not failed:
        return ''
    shown = [*failed[:MOST_NAMES], *(['others'] if len(failed) > MOST_NAMES else [])]
    return f'{len(failed)} of {len(rows)} runs failed and have no figures: {join(shown)}.'


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
    from auv_analysis.report.digest import sketch  # with matplotlib, which loads slowly

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
    from auv_analysis.studies.compare.plots import draw
    from auv_analysis.studies.compare.report import write_comparison

    with waiting('drawing figures, writing the report'):
        figures = draw(entries, table, ranking, out / 'figures')
        write_comparison(out, entries, table, ranking, figures)
