"""`auv completion`: the line of the shell that makes the TAB key know `auv`."""

import argparse
from typing import Any

from argcomplete.shell_integration import shellcode


def completion(options: argparse.Namespace) -> dict[str, Any]:
    """Code for the shell, to be evaluated there."""
    text = shellcode(['auv'], shell=options.shell)
    if not options.json:
        print(text)
    return {'shell': options.shell, 'code': text}
