"""The `auv` command: one function per subcommand, imports only when they are needed."""

import _thread
import importlib
import json
import os
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from auv_analysis.cli.command_line import parser

HOME = {'import-vehicle': 'vehicle_formats', 'export-vehicle': 'vehicle_formats'}
AGAIN = 0.05  # s after which a Ctrl-C that was dropped is repeated


def main(arguments: list[str] | None = None) -> None:
    """Run the command; exit code 0 fine, 1 the work failed, 2 wrong input."""
    before, sys.unraisablehook = sys.unraisablehook, _repeat_interrupt
    try:
        _main(arguments)
    except KeyboardInterrupt:
        print('interrupted', file=sys.stderr, flush=True)
        sys.exit(1)
    finally:
        sys.unraisablehook = before


def _function(command: str) -> Callable[..., dict[str, Any]]:
    """Function of a subcommand: options in, a JSON-ready document out."""
    name = command.replace('-', '_')
    return getattr(importlib.import_module(f'auv_analysis.cli.{HOME.get(command, name)}'), name)


def _repeat_interrupt(dropped: Any) -> None:
    """Repeat a Ctrl-C that Python drops, since it came inside a callback of C.

    Loading or compiling kernels, LLVM calls back while it works; whatever is raised there is lost.
    """
    if dropped.exc_type is not KeyboardInterrupt:
        sys.__unraisablehook__(dropped)
        return
    timer = threading.Timer(AGAIN, _thread.interrupt_main)
    timer.daemon = True
    timer.start()


def _main(arguments: list[str] | None) -> None:
    # it must start where packages are broken, for `auv doctor`: nothing here imports any
    grammar = parser()
    if '_ARGCOMPLETE' in os.environ:  # the shell asks what could follow
        from auv_analysis.cli.completion import complete

        complete(grammar)
    options = grammar.parse_args(arguments)
    if options.command is None:
        from auv_analysis.cli.guide import print_guide

        return print_guide(Path())
    from auv_dynamics.files.ending import ENDING
    from auv_dynamics.files.errors import FailedError, InputError

    for number in ENDING:  # end in good order, as with Ctrl-C
        if signal.getsignal(number) == signal.SIG_DFL:
            signal.signal(number, signal.default_int_handler)
    try:
        _work(_function(options.command), options)
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
    except OSError as error:  # a full disk, a quota, a folder that has gone
        _say(f'{error.filename or "auv"}: {error.strerror or error}')
        sys.exit(1)


def _work(command: Callable[..., dict[str, Any]], options: Any) -> None:
    from auv_dynamics.files.errors import FailedError

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
    from auv_dynamics.files.errors import printable

    with suppress(OSError):  # the terminal was closed
        print(printable(text), file=sys.stderr, flush=True)


if __name__ == '__main__':
    main()
