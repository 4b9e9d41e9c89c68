"""What ends a command whose input was right."""


class FailedError(RuntimeError):
    """The work failed: exit code 1; the text is one line, or one with a program's last lines."""
