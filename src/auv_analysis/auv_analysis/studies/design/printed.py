"""The tables of `auv design` for a terminal."""

from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.table import Table

from auv_analysis.output.progress import TextConsole
from auv_analysis.output.text import number
from auv_analysis.studies.design.change import part_words

NEAR = 1e-9  # relative: no change


def print_design(document: Mapping[str, Any], out: Console | None = None) -> None:
    """Print what a design came to.

    Parameters
    ----------
    document : of `concluded`
    out : none: standard output

    """
    out = out or TextConsole(highlight=False)
    if document['measures']:
        out.print(_measures(document))
        _say(out, '')
        out.print(_alternatives(document))
        _say(out, '')
    _say(out, document['statement'])
    for warning in document.get('warnings', ()):
        _say(out, f'warning: {warning}')
    _say(out, f'folder: {document["folder"]}')


def _measures(document: Mapping[str, Any]) -> Table:
    table = Table(box=None, header_style='bold')
    for i, head in enumerate(('', 'before', 'after', '', 'change')):
        table.add_column(head, justify='left' if i in (0, 3) else 'right', no_wrap=True)
    target = f'{document["reduce"].replace(".", "_max.")}'
    worse = {row['name'] for row in document['side_effects']}
    for row in document['measures']:
        before, after = row['before'], row['after']
        cells = (row['name'], number(before), number(after), row['unit'], change(before, after))
        style = 'bold' if row['name'] == target else 'yellow' if row['name'] in worse else None
        table.add_row(*cells, style=style)
    return table


def change(before: float | None, after: float | None) -> str:
    """Change in per cent as text; a dash where there is none to speak of."""
    if before is None or after is None:
        return ''
    if abs(after - before) <= NEAR * max(abs(before), abs(after)):
        return '='
    if before == 0:
        return 'new'
    text = f'{100 * (after / before - 1):+.1f} %'
    return '0.0 %' if text[1:] == '0.0 %' else text.replace('-', '−')


def _alternatives(document: Mapping[str, Any]) -> Table:
    """What each change leaves of each coupling."""
    parts = list(dict.fromkeys(one['part'] for one in document['alternatives']))
    table = Table(box=None, header_style='bold', title_justify='left')
    table.add_column('left of the coupling by the best change of')
    for part in parts:
        table.add_column(part_words(part), justify='right', no_wrap=True)
    for coupling, row in left(document).items():
        table.add_row(coupling, *(share(row.get(part)) for part in parts))
    return table


def left(document: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """Coupling -> part -> the least that a change of that part was found to leave, a ratio."""
    found: dict[str, dict[str, float]] = {}
    for one in document['alternatives']:
        row = found.setdefault(one['coupling'], {})
        if one['ratio'] is not None:
            row[one['part']] = min(one['ratio'], row.get(one['part'], one['ratio']))
    return found


def share(ratio: float | None) -> str:
    """A ratio in per cent as text."""
    return 'cannot be run' if ratio is None else f'{100 * ratio:.1f} %'


def _say(out: Console, text: str) -> None:
    out.print(text, markup=False, soft_wrap=True)
