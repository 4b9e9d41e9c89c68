"""The `auv` command: one function per subcommand, imports only when they are needed."""

import json
import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from auv_analysis.command_line import parser


def main(arguments: list[str] | None = None) -> None:
    """Run the command; exit code 0 fine, 1 the work failed, 2 wrong input.

    It must start where packages are broken, for `auv doctor`: nothing here imports any.
    """
    grammar = parser()
    if '_ARGCOMPLETE' in os.environ:  # the shell asks what could follow
        from auv_analysis.completion import complete

        complete(grammar)
    options = grammar.parse_args(arguments)
    if options.command is None:
        from auv_analysis.guide import print_guide

        return print_guide(Path())
    from auv_analysis.commands import function
    from auv_analysis.failure import FailedError
    from auv_dynamics.ending import ENDING
    from auv_dynamics.refusal import InputError

    for number in ENDING:  # end in good order, as with Ctrl-C
        if signal.getsignal(number) == signal.SIG_DFL:
            signal.signal(number, signal.default_int_handler)
    try:
        _work(function(options.command), options)
    except InputError as error:
        _say(str(error))
        sys.exit(2)
    except (FailedError, ArithmeticError) as error:
        _say(str(error))
        sys.exit(1)
    except ImportError as error:
        if (error.name or '').startswith('auv_'):
            raise
        _say(f'{error}: see auv doctor')
        sys.exit(1)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # nothing left to flush
        sys.exit(1)
    except KeyboardInterrupt:
        _say('interrupted')
        sys.exit(1)


def _work(command: Callable[..., dict[str, Any]], options: Any) -> None:
    from auv_analysis.failure import FailedError

    try:
        _print(options, command(options))
    except FailedError as error:
        if error.document is not None:
            _print(options, error.document)
        raise


def _print(options: Any, document: dict[str, Any]) -> None:
    if options.json:
        print(json.dumps(document, allow_nan=False), flush=True)


def _say(text: str) -> None:
    from auv_dynamics.printable import printable

    with suppress(OSError):  # the terminal was closed
        print(printable(text), file=sys.stderr, flush=True)


if __name__ == '__main__':
    main()
