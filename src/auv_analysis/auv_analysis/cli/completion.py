"""Completion for the TAB key: commands, options, shipped names, controllers; it must be fast."""

import argparse
from collections.abc import Callable, Iterable
from itertools import chain
from typing import Any

import argcomplete
from argcomplete.completers import FilesCompleter
from argcomplete.shell_integration import shellcode

from auv_analysis.cli.arguments import Parser
from auv_dynamics.files.shipped import shipped, shipped_names
from auv_gvc_controller.laws import NAMES as LAWS

Offer = Callable[..., Iterable[str]]
YAML = FilesCompleter(('yaml', 'yml'))


def complete(main: Parser) -> None:
    """Answer the shell and end; return where it is not the shell that asks."""
    for command in main.children.values():
        for argument in command.arguments:
            if argument.dest in COMPLETERS:
                argument.completer = COMPLETERS[argument.dest]  # type: ignore[attr-defined]
    argcomplete.autocomplete(main)


def names(*kinds: str, files: Offer = YAML) -> Offer:
    """Shipped names of some kinds, and files of the user."""

    def offer(prefix: str = '', **options: Any) -> list[str]:
        shipped_ones = chain.from_iterable(map(shipped_names, kinds))
        return [*shipped_ones, *files(prefix=prefix, **options)]

    return offer


def controllers(parsed_args: Any, **_: Any) -> list[str]:
    """Names of the controllers of the scenario on the command line."""
    from auv_dynamics.files.yaml_files import parse_any_yaml

    try:
        path = shipped('scenarios', parsed_args.scenario)
        return list(parse_any_yaml(path.read_text(encoding='utf-8'), path)['controllers'])
    except (OSError, ValueError, TypeError, LookupError, AttributeError):
        return []  # no scenario is typed yet, or none that can be read


COMPLETERS: dict[str, Offer] = {
    'scenario': names('scenarios'),
    'vehicle': names('vehicles'),
    'vehicles': names('vehicles'),
    'subject': names('scenarios', 'vehicles'),
    'campaign': names('campaigns'),
    'results': names('scenarios', files=FilesCompleter()),
    'controller': controllers,
    'reference': controllers,
    'law': lambda **_: LAWS,
}


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Which shell."""
    command.add_argument('shell', choices=('bash', 'zsh', 'fish'))


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Code for the shell, to be evaluated there."""
    text = shellcode(['auv'], shell=options.shell)
    if not options.json:
        print(text)
    return {'shell': options.shell, 'code': text}
