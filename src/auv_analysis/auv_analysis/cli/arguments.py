"""The command line's grammar: the parser, numbers with bounds, options that commands share."""

import argparse
import math
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from auv_analysis.bag.foreign_topics import TopicMap

NAMES = 15  # columns of the names of commands in the help
SCENARIO = 'a scenario file, or the bare name of a shipped one'
VEHICLE = 'a vehicle file, or the bare name of a shipped one'
TO_FILE = 'file to write; default: printed'
NAMESPACE = re.compile(r'/|(/[A-Za-z_][A-Za-z0-9_]*)+')
TOPIC = re.compile(r'/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*')


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
        self.register('type', float, number())

    @property
    def arguments(self) -> list[argparse.Action]:
        """Its options and positional arguments."""
        return self._actions

    def error(self, message: str) -> Any:
        """Exit 2 with one line instead of usage and a line."""
        from auv_dynamics.files.errors import printable

        given = 'expected' in message
        expected = message if given else f'expected a valid command line, found: {message}'
        found = '' if 'found' in expected else f', found none; see {self.prog} --help'
        print(printable(f'{self.prog}: {expected}{found}'), file=sys.stderr, flush=True)
        sys.exit(2)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse; an option that is not known is refused before one that is missing."""
        args = sys.argv[1:] if args is None else list(args)
        if option := self._unknown(args):
            from auv_dynamics.files.nearest import meant

            known = (name for name in self._option_string_actions if name[:2] == '--')
            self.error(f'expected an option of {self.prog}{meant(option, known)}, found {option}')
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
        more = f'{self.prog} COMMAND --help says more of each, {self.prog} --version which this is.'
        return '\n'.join([*lines, '', more, ''])

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

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            from auv_dynamics.files.nearest import one_of

            expected = one_of(value, map(str, action.choices))
            raise argparse.ArgumentError(action, f'expected {expected}, found {value}')


def refused(expected: str, found: str) -> argparse.ArgumentTypeError:
    """What a type raises where a text does not fit it."""
    return argparse.ArgumentTypeError(f'expected {expected}, found {found}')


def number(
    *,
    above: float = -math.inf,
    at_least: float = -math.inf,
    below: float = math.inf,
    at_most: float = math.inf,
    words: str = '',
) -> Callable[[str], float]:
    """Type of an option that is a finite number within bounds; `words`: what else is taken."""
    bounds = (('above', above), ('of at least', at_least), ('below', below), ('at most', at_most))
    said = ', '.join(f'{bound} {value:g}' for bound, value in bounds if math.isfinite(value))
    said += words

    def parse(text: str) -> float:
        from auv_dynamics.files.yaml_files import LARGEST

        finite = f'a finite number, at most {LARGEST:g}'
        try:
            value = float(text)
        except ValueError:
            raise refused(f'a number {said}' if said else finite, text) from None
        if not abs(value) <= LARGEST:
            raise refused(finite, text)
        if not (above < value < below and at_least <= value <= at_most):
            raise refused(f'a number {said}', text)
        return value

    return parse


def whole(at_least: int, at_most: int | None = None) -> Callable[[str], int]:
    """Type of an option that is a whole number within bounds."""
    upper = 'on' if at_most is None else f'to {at_most}'

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = at_least - 1
        if value < at_least or (at_most is not None and value > at_most):
            raise refused(f'a whole number from {at_least} {upper}', text)
        return value

    return parse


def namespace(text: str) -> str:
    """Type of an option that is a ROS namespace; with its slash."""
    absolute = '/' + text.strip('/')
    if not NAMESPACE.fullmatch(absolute):
        raise refused('a ROS namespace such as /auv1', text)
    return absolute


def topic(text: str) -> str:
    """Type of an option that is a ROS topic, relative to the namespace or absolute."""
    if not TOPIC.fullmatch(text):
        raise refused('a ROS topic such as odom or /auv1/odom', text)
    return text


def import_law(law: str) -> None:
    """Import a law that the user has named with --law; one that only a file names is not."""
    from auv_dynamics.files.errors import InputError
    from auv_gvc_controller.laws.law import law_class, refusal

    try:
        law_class(law)
    except ValueError as error:
        raise InputError('--law', '', *refusal(error)[1:]) from None


def refuse_given(
    options: argparse.Namespace, names: Sequence[str], expected: str, found: object
) -> None:
    """Refuse options of these names, which mean nothing where this is called."""
    from auv_dynamics.files.errors import InputError

    for name in names:
        value = getattr(options, name)
        if value is not None and value is not False:  # 0 was given
            option = {'odometry': '--odom'}.get(name, f'--{name.replace("_", "-")}')
            raise InputError(option, '', expected, found)


def add_results(command: argparse.ArgumentParser, text: str = 'folder of the results') -> None:
    """What a command writes, and whether it may replace what is there."""
    command.add_argument('--out', type=Path, help=text)
    command.add_argument('--overwrite', action='store_true', help='replace earlier results')


def add_scenario(command: argparse.ArgumentParser) -> None:
    """A scenario, which of its controllers, and where their results go."""
    add_results(command)
    command.add_argument('scenario', help=SCENARIO)
    command.add_argument('--controller', action='append', help='only this one; may be repeated')


def add_topics(command: argparse.ArgumentParser) -> argparse._ArgumentGroup:
    """What a bag of another system does not say of itself; the group, for more of that."""
    group = command.add_argument_group('bags of other systems')
    group.add_argument('--map', metavar='FILE', help='mapping file; options replace its keys')
    group.add_argument('--odom', dest='odometry', metavar='TOPIC', help='nav_msgs/Odometry')
    group.add_argument('--wrench', metavar='TOPIC', help='the commanded WrenchStamped or Wrench')
    group.add_argument('--frames', choices=('ned_fsd', 'enu_flu'), help='axes of all topics')
    text = 'axes in which the odometry writes the velocity, default: child'
    group.add_argument('--twist-frame', choices=('child', 'world'), help=text)
    return group


def topic_map(options: argparse.Namespace, vehicle: str | None = None) -> 'TopicMap | None':
    """What is told of bags of other systems; None where nothing is."""
    from auv_analysis.bag.foreign_topics import OPTIONS, read_mapping

    given = {key: getattr(options, key, None) for key in OPTIONS}
    if options.map is None and all(value is None for value in given.values()):
        return None
    return read_mapping(options.map, given | {'vehicle': vehicle})


def add_graph(command: argparse.ArgumentParser, when: str = '') -> None:
    """How the nodes of a run are started."""
    add_domain(command, f'{when}ROS domain, default: a free one')
    text = f'{when}all nodes in one process: faster'
    command.add_argument('--composed', action='store_true', help=text)


def add_domain(
    command: argparse.ArgumentParser, text: str = 'ROS domain, default: $ROS_DOMAIN_ID, else 0'
) -> None:
    """The domain that is joined."""
    from auv_analysis.graph.domain import LARGEST

    command.add_argument('--domain-id', type=whole(0, LARGEST), help=text)


def add_frames(command: argparse.ArgumentParser) -> None:
    """Frame ids of the messages of a vehicle."""
    from auv_dynamics.ros.interface import Frames

    text = 'frame of poses, default: odom_ned'
    command.add_argument('--odom-frame', default=Frames().odom, help=text)
    text = 'body frame, default: base_link_fsd'
    command.add_argument('--base-frame', default=Frames().base, help=text)


def add_no_report(command: argparse.ArgumentParser) -> None:
    """Whether there is a report."""
    text = 'no plots, no page'
    command.add_argument('--no-report', action='store_true', help=text)


def add_delay(command: argparse._ActionsContainer) -> None:
    """How late a wrench acts, for the margins of the loop."""
    text = "s from a measurement to the wrench at the actuators; default: the scenario's"
    command.add_argument('--delay', type=number(at_least=0.0), metavar='SECONDS', help=text)


def add_hold(command: argparse.ArgumentParser) -> None:
    """How the law is evaluated between samples."""
    text = 'law in every stage of the integrator, or by zero-order hold; default: continuous'
    command.add_argument('--hold', choices=('continuous', 'zoh'), default='continuous', help=text)
