"""The `auv` command: a table of its subcommands, each a module of this room, and exit codes.

A module has `add_arguments(parser)` and `run(options)`, and imports what is heavy when it runs:
help and completion are quick.
"""

import _thread
import atexit
import gc
import importlib
import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from auv_analysis.cli.arguments import Parser

GROUPS = {
    'To begin with': {
        'new': 'a vehicle, a scenario or a law of your own to start from',
        'doctor': 'what is wrong with the set-up, and what to do',
        'completion': 'names of commands and files by the TAB key',
    },
    'Experiments': {
        'simulate': 'simulate a scenario in this process, analyse and report',
        'run': 'run a scenario on real nodes, record, analyse and report',
        'study': 'the procedure of the paper, steps 1 to 6, as one report',
        'watch': 'live dashboard in the terminal',
        'params': 'the ROS parameter file of a scenario',
    },
    'Results and bags': {
        'analyze': 'summary and report of bags, folders of results, or a sweep',
        'info': 'what lies in a bag',
        'replay': 'a bag as live topics again, or what another law would command',
        'recover': 'repair a bag that was cut or damaged, in place',
        'export-rerun': 'a bag as a file for the rerun viewer',
    },
    'Vehicles and laws compared': {
        'check-vehicle': 'inertia, couplings and limits of a vehicle',
        'design': 'suggest and simulate a hull change that removes a coupling',
        'excite': 'what to drive to identify a model, and the intervals to expect',
        'identify': 'a model with its uncertainty from a recording',
        'predict': 'how well a vehicle file predicts a recording',
        'linearize': 'poles and matrices of a vehicle or of its closed loops',
        'import-vehicle': "a vehicle file from that of another system, or a hull's mesh",
        'export-vehicle': 'a vehicle as an SDF model for Gazebo',
        'atlas': 'inertial couplings of the shipped vehicles, side by side',
        'tune': 'laws tuned to equal effort or error, and compared over draws',
        'sweep': 'many rollouts of a scenario, with values that vary, to Parquet',
    },
    'A real vehicle': {
        'check-driver': 'whether a driver offers what our nodes need',
    },
}
COMMANDS = {name: text for group in GROUPS.values() for name, text in group.items()}
AGAIN = 0.05  # s after which a Ctrl-C that was dropped is repeated


def main(arguments: list[str] | None = None) -> None:
    """Run the command; exit code 0 fine, 1 the work failed, 2 wrong input."""
    atexit.register(gc.freeze)  # else Python looks through all that is left, for a second
    before, sys.unraisablehook = sys.unraisablehook, _repeat_interrupt
    try:
        _main(arguments)
    except KeyboardInterrupt:
        print('interrupted', file=sys.stderr, flush=True)
        sys.exit(1)
    finally:
        sys.unraisablehook = before


def parser(line: Sequence[str] | None = None) -> Parser:
    """Grammar of `auv` for a line, with the options of the subcommands that it names; None: of all.

    A subcommand that the line begins with is there alone. Without any, `command` is None.
    """
    main = Parser(
        prog='auv', description='Experiments with underwater vehicles, and what they say.'
    )
    main.add_argument('--version', action='store_true', help='which version is installed')
    main.groups = GROUPS
    commands = main.add_subparsers(dest='command', metavar='COMMAND')
    first = line[0] if line else ''
    for name in [first] if first in COMMANDS else COMMANDS:
        command = commands.add_parser(name, help=COMMANDS[name], description=COMMANDS[name])
        main.children[name] = command
        command.add_argument('--json', action='store_true', help='one JSON document on stdout')
        if line is None or name in line:
            _module(name).add_arguments(command)
    return main


def _module(command: str) -> Any:
    return importlib.import_module(f'auv_analysis.cli.{command.replace("-", "_")}')


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
    if '_ARGCOMPLETE' in os.environ:  # the shell asks what could follow
        from auv_analysis.cli.completion import complete

        complete(parser())
    arguments = sys.argv[1:] if arguments is None else arguments
    options = parser(arguments).parse_args(arguments)
    if options.version:
        from importlib.metadata import version

        return print(f'auv_gvc {version("auv_analysis")}')
    if options.command is None:
        from auv_analysis.cli.guide import print_guide

        return print_guide(Path())
    from auv_dynamics.files.errors import ENDING, FailedError, InputError

    for number in ENDING:  # end in good order, as with Ctrl-C
        if signal.getsignal(number) == signal.SIG_DFL:
            signal.signal(number, signal.default_int_handler)
    try:
        _work(_module(options.command).run, options)
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
    from auv_analysis.output.parallel import a_copy_beside
    from auv_dynamics.files.errors import FailedError

    if options.json:
        _keep_stdout()
    try:
        with a_copy_beside():
            document = command(options)
        _print(options, document)
    except FailedError as error:
        if error.document is not None:
            _print(options, error.document)
        raise


def _keep_stdout() -> None:
    """Leave standard output to the document: libraries such as Fast DDS print to it as well."""
    if sys.stdout is sys.__stdout__ and sys.stdout is not None:  # nor closed, nor replaced
        sys.stdout = os.fdopen(os.dup(1), 'w', encoding=sys.stdout.encoding)
        with suppress(OSError):  # standard error was closed
            os.dup2(2, 1)


def _print(options: Any, document: dict[str, Any]) -> None:
    if options.json:
        print(json.dumps(document, allow_nan=False))
    print(end='', flush=True)  # whoever reads may have gone: not first known when Python ends


def _say(text: str) -> None:
    from auv_dynamics.files.errors import printable

    with suppress(OSError):  # the terminal was closed
        print(printable(text), file=sys.stderr, flush=True)


if __name__ == '__main__':
    main()
