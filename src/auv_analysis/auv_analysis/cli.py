"""The `auv` command: one function per subcommand, imports only when they are needed."""

import json
import os
import sys
from typing import Any

from auv_analysis.command_line import parser


def main(arguments: list[str] | None = None) -> None:
    """Run the command; exit code 0 fine, 1 the work failed, 2 wrong input."""
    options = parser().parse_args(arguments)
    from auv_analysis.commands import function
    from auv_analysis.failure import FailedError
    from auv_dynamics.files import InputError

    try:
        result = function(options.command)(options)
        if options.json:
            print(json.dumps(result, allow_nan=False), flush=True)
    except InputError as error:
        _say(str(error))
        sys.exit(2)
    except (FailedError, ArithmeticError) as error:
        _say(str(error))
        sys.exit(1)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # nothing left to flush
        sys.exit(1)
    except KeyboardInterrupt:
        _say('interrupted')
        sys.exit(1)


def _say(text: Any) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == '__main__':
    main()
