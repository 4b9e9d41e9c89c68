"""What ends a command whose input was right."""

from typing import Any


class FailedError(RuntimeError):
    """The work failed: exit code 1; the text is one line, or one with a program's last lines.

    Parameters
    ----------
    text : what failed
    document : what `--json` prints all the same; none: nothing

    """

    def __init__(self, text: str, document: dict[str, Any] | None = None):
        super().__init__(text)
        self.document = document
