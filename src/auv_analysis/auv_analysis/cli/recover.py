"""`auv recover`: a bag that was cut or damaged, repaired where it lies."""

import argparse
from pathlib import Path
from typing import Any

SHOWN = 5  # damages of a file, and gaps of a topic, that are listed


def add_arguments(command: argparse.ArgumentParser) -> None:
    """A bag."""
    command.add_argument('bag', type=Path, metavar='BAG')


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Repair a bag in place."""
    from rich.progress import DownloadColumn

    from auv_analysis.bag.recover import recover
    from auv_analysis.output.progress import bar

    with bar(DownloadColumn()) as shown:
        task = shown.add_task('')

        def show(what: str, of: int, done: int) -> None:
            shown.update(task, description=what, completed=done, total=of)

        document = recover(options.bag, show).document()
    if not options.json:
        _print(document)
    return document


def _print(document: dict[str, Any]) -> None:
    from rich.table import Table

    from auv_analysis.output.progress import TextConsole

    out = TextConsole(highlight=False)
    for file in document['files']:
        kept = f', the damaged one is kept as {file["kept_as"]}' if file['kept_as'] else ''
        out.print(f'{file["file"]}: {file["state"]}{kept}')
        for fault in file['faults'][:SHOWN]:
            out.print(f'  {fault}')
        for lost in file['lost'][:SHOWN]:
            out.print(f'  lost: bytes {lost["from"]} to {lost["to"]}')
        if len(file['lost']) > SHOWN:
            out.print(f'  and {len(file["lost"]) - SHOWN} more')
    if document['metadata'] == 'written':
        out.print('metadata.yaml: written')
    table = Table('topic', box=None, header_style='bold')
    for column in ('messages', 'gaps', 'missing'):
        table.add_column(column, justify='right')
    for topic, entry in document['topics'].items():
        gaps = entry['spacing'] or {'gaps': '', 'missing': ''}
        table.add_row(topic, str(entry['messages']), str(gaps['gaps']), str(gaps['missing']))
    out.print(table)
    for topic, entry in document['topics'].items():
        for begin, end in (entry['spacing'] or {'longest': []})['longest'][:SHOWN]:
            out.print(f'{topic}: nothing between {begin:g} and {end:g} s')
    lost = document['messages_lost']
    words = 'how many were lost is not known' if lost is None else f'{lost} known to be lost'
    out.print(f'{document["messages"]} messages, {words}')
    attachments = ', '.join(document['attachments']) or 'none'
    out.print(f'attachments: {attachments}')
    for note in document['notes']:
        out.print(f'note: {note}')
    if not document['changed']:
        out.print('nothing was changed')
