"""What can go wrong with a file under a recorder, and what has."""

from auv_analysis.recording.bag_file import BagFile
from auv_dynamics.files.errors import FailedError, first_line, reason


class RecordingError(FailedError):
    """The bag takes no more; the text names the file and the cause."""


class Guard:
    """Watches the file that is being recorded.

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
