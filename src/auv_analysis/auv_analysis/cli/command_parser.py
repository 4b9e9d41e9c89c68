"""A parser of command lines whose complaint is one line with the nearest word, and grouped help."""

import argparse
import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any

NAMES = 15  # columns of the names of commands in the help


class Parser(argparse.ArgumentParser):
    """A parser whose complaint is one line.

    Attributes
    ----------
    children : name -> parser of each subcommand
    groups : title -> name -> line of help of the subcommands, for the help

    """

    def __init__(self, **options: Any):
        super().__init__(**options)
        self.children: dict[str, Parser] = {}
        self.groups: Mapping[str, Mapping[str, str]] = {}
        self.register('type', float, _finite)

    @property
    def arguments(self) -> list[argparse.Action]:
        """Its options and positional arguments."""
        return self._actions

    def error(self, message: str) -> Any:
        """Exit 2 with one line instead of usage and a line."""
        given = 'expected' in message
        expected = message if given else f'expected a valid command line, found: {message}'
        found = '' if 'found' in expected else f', found none; see {self.prog} --help'
        print(f'{self.prog}: {expected}{found}', file=sys.stderr, flush=True)
        sys.exit(2)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse; an option that is not known is refused before one that is missing."""
        args = sys.argv[1:] if args is None else list(args)
        unknown = self._unknown(args)
        if unknown:
            self._refuse(unknown)
        return super().parse_known_args(args, namespace)

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse; what is left over is refused."""
        options, left = self.parse_known_args(args, namespace)
        if left:
            self.children.get(options.command, self).error(
                f'expected no further arguments, found {left[0]}'
            )
        return options

    def format_help(self) -> str:
        """Help; of a parser with groups of subcommands these, in place of one list."""
        if not self.groups:
            return super().format_help()
        lines = [f'usage: {self.prog} COMMAND ...', '', str(self.description)]
        for title, entries in self.groups.items():
            lines += ['', f'{title}:']
            lines += [f'  {name:<{NAMES}}{text}' for name, text in entries.items()]
        return '\n'.join([*lines, '', f'{self.prog} COMMAND --help says more of each.', ''])

    def _unknown(self, args: Sequence[str]) -> str:
        """The first option that this parser does not know, or an empty text."""
        for arg in args:
            name = arg.partition('=')[0]
            if arg == '--' or (self.children and not name.startswith('--')):
                break  # what follows is not for this parser
            known = self._option_string_actions
            if name.startswith('--') and not any(option.startswith(name) for option in known):
                return name
        return ''

    def _refuse(self, option: str) -> None:
        from auv_dynamics.files.nearest import meant

        likely = meant(option, (name for name in self._option_string_actions if name[:2] == '--'))
        self.error(f'expected an option of {self.prog}{likely}, found {option}')

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            from auv_dynamics.files.nearest import one_of

            expected = one_of(value, map(str, action.choices))
            raise argparse.ArgumentError(action, f'expected {expected}, found {value}')


def _finite(text: str) -> float:
    """What stands for `type=float`: inf and nan are no numbers that a command can work with."""
    from auv_dynamics.files.yaml_files import LARGEST

    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) <= LARGEST:
        expected = f'a finite number, at most {LARGEST:g}'
        raise argparse.ArgumentTypeError(f'expected {expected}, found {text}')
    return value
