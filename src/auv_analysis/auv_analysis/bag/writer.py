"""A rosbag2-style bag while it is recorded: files that survive a kill, a flush thread."""

import contextlib
import errno
import threading
import time
from collections.abc import Mapping
from pathlib import Path

from auv_analysis.bag.metadata import (
    METADATA,
    Definition,
    FileExtent,
    as_text,
    metadata,
    write_metadata,
)
from auv_analysis.bag.output import BagFile, Storage
from auv_analysis.output.new_files import sync_folder
from auv_dynamics.files.errors import FailedError, first_line, reason

CHUNK_PERIOD = 0.7  # s, after which a chunk is closed and handed to the system
SYNC_PERIOD = 0.7  # s between two waits for the disk
CHECK_PERIOD = 0.5  # s between two looks at the file under us and at the space that is left
LOOK = 0.1  # s between two looks
PATIENCE = 30.0  # s for a disk that does not answer; a sync behind much else may take several


class RecordingError(FailedError):
    """The bag takes no more; the text names the file and the cause."""


class FileHealth:
    """Health of the output file: whether it is still there, free space, and what has failed.

    Parameters
    ----------
    free_space : bytes that shall stay free on the file system; 0: not looked at

    Attributes
    ----------
    trouble : file and cause, when the recording must end; else empty
    broken : whether the bag cannot even be finished
    displaced : whether it could be, but is no longer where it was

    """

    def __init__(self, free_space: int):
        self.trouble, self.broken, self.displaced = '', False, False
        self._free_space = free_space
        self._seen = 0  # position in the file when space was looked at

    def check(self, file: BagFile) -> None:
        """Look whether the file is still there, and at the space that is left."""
        try:
            loss = file.output.loss()
            self._check_space(file)
        except Exception as error:
            self.fail(file, error)
            return
        if loss:
            self.give_up(f'{file.output.path}: {loss}')
            self.displaced = True

    def follow(self, file: BagFile) -> None:
        """Look at the space after every part of what shall stay free; OSError of the system."""
        position = file.output.position
        if self._free_space and abs(position - self._seen) > self._free_space // 16:
            self._seen = position
            self._check_space(file)

    def _check_space(self, file: BagFile) -> None:
        asked = self._free_space
        if asked and not self.trouble and (free := file.output.free_space()) < asked:
            text = f'{free} bytes free on its file system, storage.free_space asks for {asked}'
            self.trouble = f'{file.output.path}: {text}'

    def fail(self, file: BagFile, error: Exception, *, final: bool = False) -> None:
        """Take an error as the end: of all where the system has refused something.

        After any other error the recording ends as well, but what has been recorded is finished,
        unless that is what has failed, `final`.
        """
        if isinstance(error, OSError):
            self.give_up(f'{error.filename or file.output.path}: {reason(error)}')
            return
        text = f'{file.output.path}: {type(error).__name__}: {first_line(error)}'
        if final:
            self.give_up(text)
        self.trouble = self.trouble or text

    def give_up(self, trouble: str) -> None:
        """Nothing more is written."""
        self.broken, self.trouble = True, trouble

    def refuse_broken(self) -> None:
        """Raise RecordingError where nothing more is written."""
        if self.broken:
            raise RecordingError(self.trouble)


class BagWriter:
    """Writes raw messages; a kill loses less than a second of them.

    A thread closes chunks in time, waits for the disk, finishes the files of a split bag, and
    looks whether the file is still there and how much space is left.

    Parameters
    ----------
    folder : of the bag, made here; it must not hold a bag yet
    attachments : name -> text, written before the first message of each file
    storage : how it is stored; default: one file, zstd

    Raises
    ------
    OSError : the folder cannot be written, or holds a bag

    """

    def __init__(
        self, folder: Path, attachments: Mapping[str, str], storage: Storage | None = None
    ):
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.glob('*.mcap')):
            raise FileExistsError(errno.EEXIST, 'a bag that is there already', str(folder))
        self._folder, self._name = folder, folder.resolve().name
        self._attachments, self._storage = attachments, storage or Storage()
        self._health, self._closed = FileHealth(self._storage.free_space), False
        self._definitions: dict[str, tuple[Definition, str]] = {}
        self._extents: list[FileExtent] = []
        self._full: list[BagFile] = []  # files that are to be finished, in their order
        self._lock = threading.Lock()
        self._waits_since: float | None = None  # the first message of the chunk
        self._synced = self._checked = time.monotonic()
        self._file = self._next_file()
        sync_folder(folder)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name='bag flush', daemon=True)
        self._thread.start()

    @property
    def trouble(self) -> str:
        """File and cause, when the recording must end; else empty."""
        return self._health.trouble

    @property
    def path(self) -> Path:
        """File that is being written."""
        return self._file.output.path

    @property
    def count(self) -> int:
        """Number of messages that were written."""
        return sum(sum(extent.counts.values()) for extent in self._extents)

    def _next_file(self) -> BagFile:
        path = self._folder / f'{self._name}_{len(self._extents)}.mcap'
        file = BagFile(path, self._attachments, self._storage)
        for definition, schema in self._definitions.values():
            file.define(definition, schema)
        self._extents.append(file.extent)
        self._waits_since = None
        return file

    def add_channel(self, definition: Definition, schema: str) -> None:
        """Register a topic with the ros2msg text of its type; RecordingError: no more is taken."""
        with self._lock:
            self._health.refuse_broken()
            try:
                self._file.define(definition, schema)
            except Exception as error:
                self._health.fail(self._file, error)
                self._health.refuse_broken()
            self._definitions[definition.topic] = definition, schema

    def has_channel(self, topic: str) -> bool:
        """Whether a topic is registered."""
        return topic in self._definitions

    def write(
        self, topic: str, log_time: int, data: bytes, publish_time: int | None = None
    ) -> None:
        """Write one serialized message; RecordingError when no more is taken.

        Parameters
        ----------
        topic : registered
        log_time, publish_time : ns; without a publish time that is the log time
        data : the message

        """
        with self._lock:
            self._health.refuse_broken()
            try:
                if self._file.is_full(topic, log_time, len(data)):
                    self._split()
                closed = self._file.write(topic, log_time, data, publish_time)
                if closed:
                    self._waits_since = None
                    self._health.follow(self._file)
                elif self._waits_since is None:
                    self._waits_since = time.monotonic()
                else:
                    self._flush_due()
            except Exception as error:
                self._health.fail(self._file, error)
                self._health.refuse_broken()

    def _split(self) -> None:
        """Go on in a new file; what the old one still needs is left to the thread."""
        full = self._file
        full.flush()
        self._file = self._next_file()
        self._full.append(full)  # last: from now on the thread may close it

    def _flush_due(self) -> None:
        """Close the chunk when its first message has waited for long enough."""
        since = self._waits_since
        if since is not None and time.monotonic() - since >= CHUNK_PERIOD:
            self._file.flush()
            self._waits_since = None

    def _run(self) -> None:
        while not self._stop.wait(LOOK):
            self._look()

    def _look(self) -> None:
        """Work of the thread every tenth of a second; whatever it raises ends the recording."""
        if self._health.broken:
            return
        with self._lock:
            try:
                self._flush_due()
            except Exception as error:
                self._health.fail(self._file, error)
        self._finish_full()
        file = self._file  # open until the next look, even if it is full by now
        now = time.monotonic()
        if now - self._checked >= CHECK_PERIOD:
            self._checked = now
            self._health.check(file)
        if now - self._synced >= SYNC_PERIOD and not self._health.broken:
            try:
                file.output.sync()
            except Exception as error:
                self._health.fail(file, error)
            self._synced = time.monotonic()

    def _finish_full(self) -> None:
        while self._full and not self._health.broken:
            file = self._full[0]
            try:
                file.finish()
            except Exception as error:
                self._health.fail(file, error, final=True)
            else:
                self._full.pop(0)

    def close(self) -> None:
        """Finish the bag and write metadata.yaml; a second call does nothing.

        Raises
        ------
        RecordingError : it cannot be finished; what the system took stays readable

        """
        if self._closed:
            return
        self._closed = True
        self._stop.set()
        self._thread.join(PATIENCE)
        if self._thread.is_alive():
            self._health.give_up(f'{self.path}: the disk does not answer')
            self._health.refuse_broken()
        self._full.append(self._file)
        if not self._health.broken:
            self._health.check(self._file)
        self._finish_full()
        for file in self._full:
            if self._health.displaced:
                with contextlib.suppress(Exception):
                    file.finish()
            file.output.close()
        self._health.refuse_broken()
        definitions = [definition for definition, _ in self._definitions.values()]
        try:
            write_metadata(self._folder, as_text(metadata(definitions, self._extents)))
        except OSError as error:
            self._health.give_up(f'{self._folder / METADATA}: {reason(error)}')
        except Exception as error:
            self._health.fail(self._file, error, final=True)
        self._health.refuse_broken()
