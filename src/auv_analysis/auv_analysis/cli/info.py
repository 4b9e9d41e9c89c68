"""`auv info`: the contents of a bag."""

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
    from auv_analysis.bag.mavlink_logs import preset
    from auv_analysis.bag.metadata import files_of
    from auv_analysis.bag.proposal import looked_through, proposal
    from auv_analysis.output.progress import waiting

    with waiting(f'reading {options.bag}'):
        contents = survey(options.bag)
        ours = PARAMETERS in contents.attachments  # whose recorder says of the topics what they are
        known = preset(contents)
        looked = {} if ours or known else looked_through(options.bag, contents)
    first, last = contents.first, contents.last
    span = None if first is None or last is None else (last - first) / 1e9
    by_stamps = [one.duration for one in looked.values() if one.duration is not None]
    document = {
        'bag': str(options.bag),
        'files': [path.name for path in files_of(options.bag)],
        'duration': max(by_stamps, default=None) if span is None else span,
        'messages': sum(contents.counts.values()),
        'topics': {
            topic: {'type': kind, 'messages': contents.counts.get(topic, 0)}
            for topic, kind in sorted(contents.types.items())
        },
        'namespace': contents.namespace,
        'attachments': sorted(contents.attachments),
        'candidates': {} if ours else candidates(contents),
        'fields': {topic: one.table for topic, one in looked.items() if one.table},
        'mapping': known or ('' if ours else proposal(options.bag, contents, looked)),
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
    fields = Table('topic', 'field', 'values', 'least', 'largest', box=None, header_style='bold')
    for topic, paths in document['fields'].items():
        for path, span in paths.items():
            ends = ('' if span[end] is None else f'{span[end]:.6g}' for end in ('least', 'largest'))
            fields.add_row(topic, path, str(span['values']), *ends)
    if fields.rows:
        out.print(fields)
    for note in document['notes']:
        out.print(f'note: {note}')
    if document['mapping']:
        out.print('a mapping file to begin with, for --map:\n')
        out.print(document['mapping'], soft_wrap=True, markup=False)
