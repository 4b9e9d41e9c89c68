"""`recover`: a bag that was cut or damaged is repaired where it lies."""

import re
from functools import partial
from pathlib import Path
from typing import Any

from auv_analysis.bag.files import check_regular, split_order
from auv_analysis.recording.metadata import (
    NAME,
    ROOT,
    Definition,
    Extent,
    as_text,
    metadata,
    write_metadata,
)
from auv_analysis.recovery.audit import Audit
from auv_analysis.recovery.in_place import (
    Progress,
    failed,
    repair,
    set_aside,
    state,
    taken,
    watch,
)
from auv_analysis.recovery.report import FileReport, Report
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.files.yaml_files import read_yaml

KEPT = re.compile(r'(?P<target>.*\.mcap)\.damaged(\.(?P<number>\d+))?')
EXPECTED = 'a bag: a folder with .mcap files, or an .mcap file'


def recover(bag: Path, progress: Progress = lambda *_: None) -> Report:
    """Repair a bag in place; a healthy one is not touched.

    Each damaged file is kept under a name that ends in `.mcap.damaged`. The repair may be ended at
    any moment; the next one goes on.

    Parameters
    ----------
    bag : folder or .mcap file
    progress : told what is done, bytes that are done and bytes of all

    Raises
    ------
    InputError : no bag, or one that is being written
    FailedError : nothing can be recovered, or the system does not let us write

    """
    sources = _sources(bag)
    try:
        with taken([*sources.values()]) as notes:
            report = _recover(bag, sources, progress)
            report.notes += notes
            return report
    except OSError as error:
        raise failed(bag, error) from None


def _sources(bag: Path) -> dict[Path, Path]:
    """Names of the files of a bag -> where their content is: an ended repair may have moved it."""
    folder = bag if bag.is_dir() else bag.parent
    if not folder.is_dir():
        raise InputError(bag, '', EXPECTED, 'no such file or folder')
    found = {path: path for path in folder.glob('*.mcap')}
    kept = [(match, path) for path in folder.iterdir() if (match := KEPT.fullmatch(path.name))]
    for match, path in sorted(kept, key=lambda pair: int(pair[0]['number'] or 1)):
        target = folder / match['target']
        if found.get(target) != target:
            found[target] = path
    if not bag.is_dir():
        if bag.is_file() and bag.suffix != '.mcap':
            raise InputError(bag, '', EXPECTED, f'a file that ends in {bag.suffix or bag.name!r}')
        found = {target: path for target, path in found.items() if target == bag}
    if not found:
        other = any(folder.glob('*.db3*')) if bag.is_dir() else False
        text = 'a folder of .db3 files' if other else 'a folder without .mcap files'
        raise InputError(bag, '', EXPECTED, text if bag.is_dir() else 'no such file or folder')
    for path in found.values():
        check_regular(path, folder if bag.is_dir() else path.resolve().parent)
    return dict(sorted(found.items(), key=lambda pair: split_order(pair[0])))


def _recover(bag: Path, sources: dict[Path, Path], progress: Progress) -> Report:
    audits = {}
    for target, source in sources.items():
        before, size = state(source), source.stat().st_size
        audit = Audit(source, partial(_show, progress, f'reading {source.name}', size))
        audits[target] = audit, before
    if not any(_holds_something(audit) or not audit.faults for audit, _ in audits.values()):
        if not any(audit.begins_well or not audit.size for audit, _ in audits.values()):
            raise InputError(bag, '', EXPECTED, 'what is no MCAP file')
        raise FailedError(f'{bag}: nothing in it can be recovered')
    for audit, before in audits.values():
        if audit.faults:
            watch(audit.path, before)
    report = Report(str(bag))
    for target, (audit, before) in audits.items():
        if not audit.faults and audit.path == target:
            report.files.append(FileReport(audit, target.name, 'healthy'))
        elif _holds_something(audit):
            kept = repair(audit, target, before, progress)
            report.files.append(FileReport(audit, target.name, 'repaired', kept))
        elif audit.path == target:
            kept = set_aside(target)
            report.files.append(FileReport(audit, target.name, 'left out', kept))
    if bag.is_dir():
        report.metadata = _settle_metadata(bag, report)
    return report


def _show(progress: Progress, what: str, size: int, place: int) -> None:
    progress(what, place, size)


def _holds_something(audit: Audit) -> bool:
    return bool(audit.count or audit.attachments)


def _settle_metadata(folder: Path, report: Report) -> str:
    """Write metadata.yaml where it is missing or does not say what is there; what was done."""
    audits = [file.audit for file in report.files if file.state != 'left out']
    names = [file.name for file in report.files if file.state != 'left out']
    definitions: dict[str, Definition] = {}
    for audit in audits:
        found = audit.definitions.of_rosbag2()
        if found is None:
            return 'none'
        for definition in found:
            definitions.setdefault(definition.topic, definition)
    extents = [_extent(name, audit) for name, audit in zip(names, audits, strict=True)]
    document = metadata(definitions.values(), extents)
    try:
        told = read_yaml(folder / NAME, 'metadata')[ROOT]
        if _gist(told) == _gist(document):
            return 'unchanged'
    except (InputError, LookupError, TypeError, AttributeError):
        told = {}
    for key in ('custom_data', 'ros_distro'):
        if isinstance(told, dict) and told.get(key):
            document[key] = told[key]
    write_metadata(folder, as_text(document))
    return 'written'


def _gist(document: dict[str, Any]) -> Any:
    """What must agree: files, counts and span."""
    return (
        [*document['relative_file_paths']],
        document['message_count'],
        {
            entry['topic_metadata']['name']: entry['message_count']
            for entry in document['topics_with_message_count']
            if entry['message_count']
        },
        document['message_count'] and document['starting_time']['nanoseconds_since_epoch'],
        document['duration']['nanoseconds'],
    )


def _extent(name: str, audit: Audit) -> Extent:
    extent = Extent(name)
    for number, spacing in audit.spacings.items():
        channel = audit.definitions.channel(number)
        if channel is None or spacing.earliest is None or spacing.latest is None:
            continue
        extent.counts[channel.topic] = extent.counts.get(channel.topic, 0) + spacing.count
        firsts, lasts = (extent.first, spacing.earliest), (extent.last, spacing.latest)
        extent.first = min(ns for ns in firsts if ns is not None)
        extent.last = max(ns for ns in lasts if ns is not None)
    return extent
