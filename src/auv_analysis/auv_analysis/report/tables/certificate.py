"""The Lyapunov certificate of every run, as a table."""

from collections.abc import Mapping
from typing import Any

from auv_analysis.output.text import MISSING, number
from auv_analysis.report.document import Cell, Column, Table
from auv_analysis.report.tables.sources import Summaries, summary_source

ROWS = (  # symbol or words, unit or '', key of summary.json, factor
    ('identity (26): largest residual', '% of max |(26)|', 'identity_residual', 100.0),
    ('identity (26): RMS residual', '% of the RMS of (26)', 'identity_residual_rms', 100.0),
    (
        'identity (26): largest after 2 s',
        '% of max |(26)| there',
        'identity_residual_after_2s',
        100.0,
    ),
    ('L increases by (26)', '% of the samples', 'share_of_time_increasing', 100.0),
    ('condition (27) holds', '% of the samples', 'share_condition_27', 100.0),
    ('bound (28) holds', '% of the samples', 'share_bound_28', 100.0),
    ('largest ρ of (28)', 'W', 'rho_max', 1.0),
    ('sup ‖s‖', 'm/s, rad/s', 'sup_s', 1.0),
    ('sup ‖z‖', 'm, rad', 'sup_z', 1.0),
    ('sup ‖w‖', 'N, N m', 'sup_w', 1.0),
    ('L at the start', 'J', 'L_first', 1.0),
    ('L at the end', 'J', 'L_last', 1.0),
)
OF_THE_IDENTITY = ('identity_residual', 'identity_residual_rms', 'identity_residual_after_2s')


def certificate_table(summaries: Summaries) -> Table | None:
    """A row per figure of the certificate, a column per run; None where no figure is known."""
    entries = {name: summary['lyapunov'] for name, summary in summaries.items()}
    cells = [
        [_cell(name, e, key, factor) for name, e in entries.items()] for *_, key, factor in ROWS
    ]
    if all(entry.text == MISSING for row in cells for entry in row):
        return None
    marks = {text: mark for mark, _, text in reasons(summaries)}
    applies = [_applies(entry, marks) for entry in entries.values()]
    rows = [[Cell('applies'), *applies, Cell('')]]
    for (label, unit, *_), values in zip(ROWS, cells, strict=True):
        rows.append([Cell(label), *values, Cell(unit)])
    caption = 'The certificate (23) to (28) of each run. '
    if any(entry.kind for row in cells for entry in row):
        caption += 'Grey: the residual of what is no identity in that run, for the reason given. '
    caption += 'An en dash (–) stands for what does not exist or is not known.'
    columns = Column('', numeric=False), *map(Column, entries), Column('unit', numeric=False)
    return Table('certificate', caption, columns, rows)


def reasons(summaries: Summaries) -> list[tuple[str, list[str], str]]:
    """Why a certificate does not apply: mark, names of the runs, text; each reason once."""
    found: dict[str, list[str]] = {}
    for name, summary in summaries.items():
        for reason in _parts(summary['lyapunov']):
            found.setdefault(reason, []).append(name)
    return [(chr(ord('a') + i), names, text) for i, (text, names) in enumerate(found.items())]


def _parts(entry: Mapping[str, Any]) -> list[str]:
    """Why a certificate does not apply, reason by reason."""
    return [] if entry['applicable'] else (entry['reason'] or 'not applicable').split('; ')


def _applies(entry: Mapping[str, Any], marks: Mapping[str, str]) -> Cell:
    if entry['applicable']:
        return Cell('yes')
    return Cell(f'no ({", ".join(sorted(marks[part] for part in _parts(entry)))})')


def _cell(name: str, entry: Mapping[str, Any], key: str, factor: float) -> Cell:
    value = entry.get(key)
    if value is None:
        return Cell(MISSING)
    soft = key in OF_THE_IDENTITY and entry.get('share_of_time_increasing') is None
    where = summary_source(name, 'lyapunov', key) + ('*100' if factor != 1.0 else '')
    return Cell(number(factor * value), factor * value, where, 'zero' if soft else '')
