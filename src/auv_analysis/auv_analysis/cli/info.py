"""`auv info`: what lies in a bag."""

import argparse
from pathlib import Path
from typing import Any

PARAMETERS = 'params.yaml'


def add_arguments(command: argparse.ArgumentParser) -> None:
    """A bag."""
    command.add_argument('bag', type=Path, metavar='BAG')


def run(options: argparse.Namespace) -> dict[str, Any]:
    """What lies in a bag."""
    from auv_analysis.bag.any_bag import survey
    from auv_analysis.bag.foreign_topics import candidates
    from auv_analysis.bag.metadata import files_of

    contents = survey(options.bag)
    first, last = contents.first, contents.last
    span = None if first is None or last is None else (last - first) / 1e9
    document = {
        'bag': str(options.bag),
        'files': [path.name for path in files_of(options.bag)],
        'duration': span,
        'messages': sum(contents.counts.values()),
        'topics': {
            topic: {'type': kind, 'messages': contents.counts.get(topic, 0)}
            for topic, kind in sorted(contents.types.items())
        },
        'namespace': contents.namespace,
        'attachments': sorted(contents.attachments),
        # what our recorder has attached says of the topics what they are
        'candidates': {} if PARAMETERS in contents.attachments else candidates(contents),
        'notes': contents.notes,
    }
    if not options.json:
        _print_info(document)
    return document


def _print_info(document: dict[str, Any]) -> None:
    from rich.table import Table

    from auv_analysis.output.progress import TextConsole

    out = TextConsole()
    span = 'no messages' if document['duration'] is None else f'{document["duration"]:g} s'
    out.print(f'{document["bag"]}: {document["messages"]} messages, {span}')
    table = Table('topic', 'type', 'messages', box=None, header_style='bold')
    for topic, entry in document['topics'].items():
        table.add_row(topic, entry['type'], str(entry['messages']))
    out.print(table)
    if document['namespace'] is not None:
        out.print(f'namespace: {document["namespace"]}')
    out.print(f'attachments: {", ".join(document["attachments"]) or "none"}')
    for role, topics in document['candidates'].items():
        if topics:
            out.print(f'could be mapped as {role}: {", ".join(topics)}')
    for note in document['notes']:
        out.print(f'note: {note}')
