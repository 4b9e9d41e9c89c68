"""What the TAB key offers: commands, options, shipped names, controllers; it must not be slow."""

import argparse
from collections.abc import Callable, Iterable
from typing import Any

import argcomplete
from argcomplete.completers import BaseCompleter, FilesCompleter
from argcomplete.shell_integration import shellcode

from auv_analysis.cli.arguments import Parser
from auv_analysis.cli.tune import LAWS
from auv_dynamics.files.shipped import shipped, shipped_names

YAML = FilesCompleter(('yaml', 'yml'))


def complete(main: Parser) -> None:
    """Answer the shell and end; return where it is not the shell that asks."""
    for command in main.children.values():
        for argument in command.arguments:
            if argument.dest in COMPLETERS:
                argument.completer = COMPLETERS[argument.dest]  # type: ignore[attr-defined]
    argcomplete.autocomplete(main)


class _Names(BaseCompleter):
    """Shipped names and the files of the user.

    Parameters
    ----------
    kind : of the shipped files
    files : of the user; none: YAML

    """

    def __init__(self, kind: str, files: Callable[..., Iterable[str]] = YAML):
        self._kind, self._files = kind, files

    def __call__(self, prefix: str = '', **options: Any) -> list[str]:
        return [*shipped_names(self._kind), *self._files(prefix=prefix, **options)]


def controllers(parsed_args: Any, **_: Any) -> list[str]:
    """Names of the controllers of the scenario on the command line."""
    from auv_dynamics.files.yaml_files import parse_any_yaml

    try:
        path = shipped('scenarios', parsed_args.scenario)
        return list(parse_any_yaml(path.read_text(encoding='utf-8'), path)['controllers'])
    except (OSError, ValueError, TypeError, LookupError, AttributeError):
        return []  # no scenario is typed yet, or none that can be read


def laws(**_: Any) -> tuple[str, ...]:
    """Shipped laws."""
    return LAWS


def subjects(prefix: str = '', **options: Any) -> list[str]:
    """Shipped scenarios and vehicles, and the files of the user."""
    return [*shipped_names('scenarios'), *_Names('vehicles')(prefix, **options)]


COMPLETERS: dict[str, Callable[..., Iterable[str]]] = {
    'scenario': _Names('scenarios'),
    'vehicle': _Names('vehicles'),
    'vehicles': _Names('vehicles'),
    'subject': subjects,
    'campaign': _Names('campaigns'),
    'results': _Names('scenarios', FilesCompleter()),
    'controller': controllers,
    'reference': controllers,
    'law': laws,
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
