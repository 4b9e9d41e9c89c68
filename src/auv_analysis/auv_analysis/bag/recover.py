"""Repair of a bag: a file written anew from what was kept, with indices, summary and statistics."""

import contextlib
import errno
import fcntl
import os
import re
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from mcap.opcode import Opcode
from mcap.records import Attachment, Metadata
from mcap.writer import Writer

from auv_analysis.bag.chunks import MessageTable
from auv_analysis.bag.inspection import PROFILE, ROSBAG2, FileReport, Inspection, Report
from auv_analysis.bag.mcap_file import McapFile, Read
from auv_analysis.bag.metadata import (
    METADATA,
    ROOT,
    Definition,
    as_text,
    check_regular,
    counts_in,
    metadata,
    refuse_packed,
    split_order,
    write_metadata,
)
from auv_analysis.bag.output import COMPRESSIONS
from auv_analysis.output.new_files import created, sync_folder, synced, unfinished_name
from auv_dynamics.files.errors import FailedError, InputError, reason
from auv_dynamics.files.yaml_files import read_yaml

NEVER = 1 << 62  # bytes: a chunk ends where that of the damaged file does
CHUNK_SIZE = 1 << 20  # bytes, where the damaged file has none
ZSTD = 'zstd'
OURS = 'auv_gvc recovery'


class Rewriter:
    """Writes what an inspection has found.

    Parameters
    ----------
    inspection : of the damaged file
    name : that the new file will have

    """

    def __init__(self, inspection: Inspection, name: str):
        self._inspection, self._name = inspection, name
        self._channels: dict[int, int] = {}
        self._schemas: dict[int, int] = {}
        self._metadata: set[tuple[str, frozenset[tuple[str, str]]]] = set()

    def write(self, path: Path, progress: Callable[[int], None] = lambda _: None) -> None:
        """Write the file and wait until it is on the disk; an older one is replaced.

        Parameters
        ----------
        path : of the new file
        progress : told the byte of the damaged file up to which all is done

        """
        known = self._inspection
        with created(path, known.path.stat().st_mode & 0o777) as file:
            self._writer = Writer(
                file,
                chunk_size=CHUNK_SIZE if known.compression is None else NEVER,
                compression=COMPRESSIONS[known.compression or ZSTD],
            )
            told = (known.header.profile, known.header.library) if known.header else ('', OURS)
            definitions = known.definitions.of_rosbag2()
            self._writer.start(told[0] if definitions is None else PROFILE, told[1])
            for item in McapFile(known.path, resync=True).items():
                if isinstance(item, Read):
                    self._take(item)
                progress(item.end)
            for channel in known.definitions.channels():
                self._channel(channel.id)
            if definitions is not None:
                extents = [known.extent(self._name)]
                text = as_text(metadata(definitions, extents, packed=known.packed))
                self._writer.add_metadata(ROSBAG2, {'serialized_metadata': text})
            self._writer.finish()
            synced(file)

    def _take(self, item: Read) -> None:
        for part in item.parts:
            if isinstance(part, MessageTable):
                self._messages(part)
            elif isinstance(part, Attachment):
                a = part
                self._writer.add_attachment(a.create_time, a.log_time, a.name, a.media_type, a.data)
            elif isinstance(part, Metadata) and part.name != ROSBAG2:
                self._keep(part)
        if item.opcode == Opcode.CHUNK:
            self._writer.flush()

    def _keep(self, record: Metadata) -> None:
        """Write metadata, once."""
        key = record.name, frozenset(record.metadata.items())
        if key not in self._metadata:
            self._metadata.add(key)
            self._writer.add_metadata(record.name, record.metadata)

    def _messages(self, table: MessageTable) -> None:
        rows = zip(*(column.tolist() for column in table[3:]), strict=True)
        for i, (number, sequence, log, publish) in enumerate(rows):
            channel = self._channel(number)
            if channel is not None:
                self._writer.add_message(channel, log, table.payload(i), publish, sequence)

    def _channel(self, number: int) -> int | None:
        """Id of a channel in the new file, None of one that is not known."""
        if number in self._channels:
            return self._channels[number]
        known = self._inspection.definitions
        channel = known.channel(number)
        if channel is None:
            return None
        schema = 0
        if (found := known.schema_of(channel)) is not None:
            if found.id not in self._schemas:
                registered = self._writer.register_schema(found.name, found.encoding, found.data)
                self._schemas[found.id] = registered
            schema = self._schemas[found.id]
        about = channel.topic, channel.message_encoding, schema, channel.metadata
        self._channels[number] = self._writer.register_channel(*about)
        return self._channels[number]


KEPT = re.compile(r'(?P<target>.*\.mcap)\.damaged(\.(?P<number>\d+))?')
EXPECTED = 'a bag: a folder with .mcap files, or an .mcap file'
DAMAGED = '.damaged'  # ends the name under which a damaged file is kept
QUIET = 2.0  # s: a file that was written more recently is watched for so long
UNUSED = 'a bag that nobody is recording'
Progress = Callable[[str, int, int], None]  # what is done, bytes of all, bytes that are done


def recover(bag: Path, progress: Progress = lambda *_: None) -> Report:
    """Repair a bag in place; a healthy one is not touched.

    Each damaged file is kept under a name that ends in `.mcap.damaged`. The repair may be ended at
    any moment; the next one goes on.

    Parameters
    ----------
    bag : folder or .mcap file
    progress : told what is done, bytes of all and bytes that are done

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
        text = f'{error.filename or bag}: {reason(error)}; the file is as it was'
        raise FailedError(text) from None


def _sources(bag: Path) -> dict[Path, Path]:
    """Names of the files of a bag -> where their content is: an ended repair may have moved it."""
    folder = bag if bag.is_dir() else bag.parent
    if not folder.is_dir():
        raise InputError(bag, '', EXPECTED, 'no such file or folder')
    found = {path: path for path in folder.glob('*.mcap')}
    if bag.is_dir():
        refuse_packed(bag, found)
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
    inspected = {}
    for target, source in sources.items():
        before, size = state(source), source.stat().st_size
        show = partial(progress, f'reading {source.name}', size)
        inspected[target] = Inspection(source, show), before
    found = [one for one, _ in inspected.values()]
    if not any(_holds_something(one) or not one.faults for one in found):
        if not any(one.begins_well or not one.size for one in found):
            raise InputError(bag, '', EXPECTED, 'what is no MCAP file')
        raise FailedError(f'{bag}: nothing in it can be recovered')
    for one, before in inspected.values():
        if one.faults:
            watch(one.path, before)
    report = Report(str(bag))
    for target, (one, before) in inspected.items():
        if not one.faults and one.path == target:
            report.files.append(FileReport(one, target.name, 'healthy'))
        elif _holds_something(one):
            kept = repair(one, target, before, progress)
            report.files.append(FileReport(one, target.name, 'repaired', kept))
        elif one.path == target:
            kept = keep(target).name
            target.unlink(missing_ok=True)
            sync_folder(target.parent)
            report.files.append(FileReport(one, target.name, 'left out', kept))
    if bag.is_dir():
        report.metadata = _settle_metadata(bag, report)
    return report


def _holds_something(inspection: Inspection) -> bool:
    return bool(inspection.count or inspection.attachments)


def _settle_metadata(folder: Path, report: Report) -> str:
    """Write metadata.yaml where it is missing or does not say what is there; what was done."""
    inspections = [file.inspection for file in report.files if file.state != 'left out']
    names = [file.name for file in report.files if file.state != 'left out']
    definitions: dict[str, Definition] = {}
    for inspection in inspections:
        found = inspection.definitions.of_rosbag2()
        if found is None:
            return 'none'
        for definition in found:
            definitions.setdefault(definition.topic, definition)
    extents = [one.extent(name) for name, one in zip(names, inspections, strict=True)]
    packed = any(one.packed for one in inspections)
    document = metadata(definitions.values(), extents, packed=packed)
    try:
        told = read_yaml(folder / METADATA, 'metadata')[ROOT]
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
    """Files, counts and span, which must agree."""
    return (
        [*document['relative_file_paths']],
        document['message_count'],
        counts_in(document),
        document['message_count'] and document['starting_time']['nanoseconds_since_epoch'],
        document['duration']['nanoseconds'],
    )


@contextlib.contextmanager
def taken(paths: list[Path]) -> Iterator[list[str]]:
    """Hold the locks of files; InputError where a recorder or another repair has one.

    Gives a note for each file that could not be locked: one that somebody else repairs at the same
    time is not noticed.
    """
    with contextlib.ExitStack() as stack:
        notes = []
        for path in paths:
            descriptor = _opened(path)
            stack.callback(os.close, descriptor)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InputError(path, '', UNUSED, 'a file that is being written') from None
            except OSError as error:
                notes.append(f'{path.name}: not locked: {reason(error)}')
        yield notes


def _opened(path: Path) -> int:
    """Descriptor of a file, for writing where that is allowed: network file systems want that."""
    try:
        return os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError as error:
        if error.errno not in (errno.EACCES, errno.EPERM, errno.EROFS):
            raise
        return os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)


def watch(path: Path, before: tuple[int, int, int]) -> None:
    """Refuse a file that grows: a recorder that takes no lock.

    Parameters
    ----------
    path : of the file, which is not finished
    before : its `state` before it was read

    """
    age = time.time() - path.stat().st_mtime
    if 0 <= age < QUIET:
        time.sleep(QUIET - age)
    if state(path) != before:
        raise InputError(path, '', UNUSED, 'a file that is being written')


def state(path: Path) -> tuple[int, int, int]:
    """Fingerprint that changes when a file is written or replaced."""
    status = path.stat()
    return status.st_ino, status.st_size, status.st_mtime_ns


def repair(
    inspection: Inspection, target: Path, before: tuple[int, int, int], progress: Progress
) -> str:
    """Write a file anew and put it into the place of the damaged one, which is kept.

    Parameters
    ----------
    inspection : of the damaged file: `target`, or what an interrupted repair has kept of it
    target : name of the repaired file
    before : `state` of the damaged file when it was inspected

    Returns
    -------
    kept_as : name of the damaged file

    """
    unfinished = unfinished_name(target)
    show = partial(progress, f'repairing {target.name}', inspection.size)
    Rewriter(inspection, target.name).write(unfinished, show)
    if state(inspection.path) != before:
        unfinished.unlink()
        raise InputError(inspection.path, '', UNUSED, 'a file that is being written')
    os.chmod(unfinished, inspection.path.stat().st_mode & 0o777)
    kept = inspection.path if inspection.path != target else keep(target)
    os.replace(unfinished, target)
    sync_folder(target.parent)
    return kept.name


def keep(path: Path) -> Path:
    """Give a file a second name that says that it is damaged; an earlier one is not replaced."""
    kept = path.with_name(f'{path.name}{DAMAGED}')
    number = 2
    while os.path.lexists(kept):
        if os.path.samestat(
            os.lstat(kept), os.lstat(path)
        ):  # of a repair that was ended after this
            return kept
        kept = path.with_name(f'{path.name}{DAMAGED}.{number}')
        number += 1
    try:
        os.link(path, kept)
    except OSError:  # a file system without links: between here and the next step there is only
        os.rename(path, kept)  # the damaged name, from which the next repair goes on
    sync_folder(path.parent)
    return kept
