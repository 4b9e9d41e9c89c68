"""The `auv` command: one module a command, and what commands share."""

import sys
from types import TracebackType


def _said(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    """Say of a Ctrl-C no more than that it came, also before `main` is there to do so."""
    if issubclass(kind, KeyboardInterrupt):
        print('interrupted', file=sys.stderr, flush=True)
    else:
        sys.__excepthook__(kind, error, trace)


if sys.argv[0].rpartition('/')[2] == 'auv':
    sys.excepthook = _said
