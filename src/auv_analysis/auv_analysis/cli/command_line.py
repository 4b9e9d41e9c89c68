"""The grammar of the `auv` command: its subcommands in the order of the help, and their options."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from auv_analysis.cli.command_parser import Parser
from auv_analysis.cli.linearize import add_options as add_linearize
from auv_analysis.cli.tune import add_arguments as add_tune
from auv_analysis.cli.vehicle_formats import add_export, add_import
from auv_analysis.replay.options import add_options as add_replay

SCENARIO = 'a scenario file, or the bare name of a shipped one'
VEHICLE = 'a vehicle file, or the bare name of a shipped one'
RESULT = 'a bag, a folder of results or of a sweep, or a scenario, which is simulated'


def parser() -> Parser:
    """Command line of `auv`; without a command, `command` is None."""
    main = Parser(
        prog='auv', description='Experiments with underwater vehicles, and what they say.'
    )
    main.groups = {
        title: {name: command.text for name, command in group.items()}
        for title, group in GROUPS.items()
    }
    commands = main.add_subparsers(dest='command', metavar='COMMAND')
    for name, (text, add_options, writes) in COMMANDS.items():
        command = commands.add_parser(name, help=text, description=text)
        main.children[name] = command
        if writes:
            command.add_argument('--out', type=Path, help=writes)
            command.add_argument('--overwrite', action='store_true', help='replace earlier results')
        command.add_argument('--json', action='store_true', help='one JSON document on stdout')
        add_options(command)
    return main


def _scenario(command: argparse.ArgumentParser) -> None:
    command.add_argument('scenario', help=SCENARIO)
    command.add_argument('--controller', action='append', help='only this one; may be repeated')


def _graph(command: argparse.ArgumentParser, when: str = '') -> None:
    text = f'{when}ROS domain, default: a free one'
    command.add_argument('--domain-id', help=text)
    text = f'{when}all nodes in one process: faster'
    command.add_argument('--composed', action='store_true', help=text)


def _no_report(command: argparse.ArgumentParser) -> None:
    text = 'summary.json alone: no figures, no page'
    command.add_argument('--no-report', action='store_true', help=text)


def _hold(command: argparse.ArgumentParser) -> None:
    text = 'law in every stage of the integrator, or sampled and held; default: continuous'
    command.add_argument('--hold', choices=('continuous', 'zoh'), default='continuous', help=text)


def _run(command: argparse.ArgumentParser) -> None:
    _scenario(command)
    _no_report(command)
    _graph(command)


def _simulate(command: argparse.ArgumentParser) -> None:
    _scenario(command)
    _no_report(command)
    _hold(command)


def _study(command: argparse.ArgumentParser) -> None:
    _scenario(command)
    _hold(command)
    text = 'real nodes, recorded, in place of this process'
    command.add_argument('--run', action='store_true', help=text)
    _graph(command, 'with --run: ')
    command.add_argument(
        '--window', nargs=2, action='append', type=float, metavar=('FROM', 'TO'), default=[],
        help='kinetic energy over this window as well, s; may be repeated',
    )  # fmt: skip
    text = 'of the figures to the gains; default: sobol'
    command.add_argument('--sensitivity', choices=('sobol', 'morris', 'none'), help=text)
    text = 'base points of sobol, a power of two; trajectories of morris'
    command.add_argument('--samples', type=int, metavar='N', help=text)
    text = 'gains vary from 1/SPAN to SPAN times their value; default: 2'
    command.add_argument('--span', type=float, default=2.0, help=text)
    command.add_argument('--seed', type=int, default=0, help='of what is drawn; default: 0')


def _analyze(command: argparse.ArgumentParser) -> None:
    command.add_argument('results', nargs='+', metavar='BAG', help=RESULT)
    command.add_argument('--by', metavar='MEASURE', help='of a sweep: what sorts the best rows')
    command.add_argument('--vehicle', help='for bags that do not carry their own')
    text = 'of the vehicle in a bag of several; default: that of the recorder'
    command.add_argument('--namespace', metavar='NS', help=text)
    _no_report(command)
    text = 'own law that results may name, as its code may run; may be repeated'
    command.add_argument('--law', metavar='MODULE:CLASS', action='append', help=text)
    _add_foreign(command.add_argument_group('bags of other systems'))


def _add_foreign(group: argparse._ArgumentGroup) -> None:
    """Options that tell what the topics of a bag of another system hold."""
    group.add_argument('--map', metavar='FILE', help='mapping file; options replace its keys')
    group.add_argument('--odom', dest='odometry', metavar='TOPIC', help='nav_msgs/Odometry')
    group.add_argument('--wrench', metavar='TOPIC', help='the commanded WrenchStamped or Wrench')
    group.add_argument('--setpoint', metavar='TOPIC', help='TwistStamped, Twist or Odometry')
    group.add_argument('--frames', choices=('ned_fsd', 'enu_flu'), help='axes of all topics')
    text = 'axes in which the odometry writes the velocity, default: child'
    group.add_argument('--twist-frame', choices=('child', 'world'), help=text)
    text = 'common time base, default: the median period of the velocity'
    group.add_argument('--step', type=float, metavar='S', help=text)
    group.add_argument('--gap', type=float, metavar='S', help='longer pauses are gaps')


def _atlas(command: argparse.ArgumentParser) -> None:
    text = 'beside the shipped ones'
    command.add_argument('vehicles', nargs='*', metavar='VEHICLE', help=text)
    command.add_argument('--only', action='store_true', help='the given ones alone')


def _design(command: argparse.ArgumentParser) -> None:
    command.add_argument('vehicle', help=VEHICLE)
    command.add_argument('--scenario', help=f'{SCENARIO}, with this vehicle in it')
    text = 'such as delta_pi.pitch; default: the largest'
    command.add_argument('--reduce', metavar='COUPLING', help=text)
    text = 'NAME=LOWER:UPPER of a parameter, such as shift.x=-0.05:0.05; may be repeated'
    command.add_argument('--bound', action='append', default=[], help=text)


def _sweep(command: argparse.ArgumentParser) -> None:
    text = 'a campaign file, or the bare name of a shipped one'
    command.add_argument('campaign', help=text)
    command.add_argument('--executor', choices=('threads', 'dask'), help='default: threads')
    command.add_argument('--scheduler', metavar='ADDRESS', help='of dask, such as tcp://host:8786')
    text = 'threads or processes; default: the cores'
    command.add_argument('--workers', metavar='N', help=text)


def _tune(command: argparse.ArgumentParser) -> None:
    command.add_argument('scenario', help=SCENARIO)
    add_tune(command)
    _hold(command)


def _watch(command: argparse.ArgumentParser) -> None:
    command.add_argument('--domain-id', help='ROS domain, default: $ROS_DOMAIN_ID, else 0')
    command.add_argument('--namespace', default='/', help='of the graph, such as /auv1')
    text = 'for energy and couplings where no analysis_node runs'
    command.add_argument('--vehicle', help=text)
    text = 'refreshes per second; default: 4, in a pipe 1'
    command.add_argument('--rate', metavar='HZ', help=text)
    command.add_argument('--once', action='store_true', help='print a single snapshot')
    text = 'print the last snapshot after so long'
    command.add_argument('--for', dest='limit', metavar='SECONDS', help=text)
    command.add_argument('--odom-frame', help='frame of poses, default: odom_ned')
    command.add_argument('--base-frame', help='body frame, default: base_link_fsd')


def _info(command: argparse.ArgumentParser) -> None:
    command.add_argument('bag', type=Path, metavar='BAG')


def _params(command: argparse.ArgumentParser) -> None:
    command.add_argument('scenario', help=SCENARIO)
    command.add_argument('--controller', required=True)
    command.add_argument('--real-time', action='store_true', help='paced by the clock')
    text = "for a vehicle driver in the plant's place: in real time, without simulated time"
    command.add_argument('--no-plant', action='store_true', help=text)


def _check_vehicle(command: argparse.ArgumentParser) -> None:
    command.add_argument('vehicle', metavar='FILE', help=VEHICLE)
    text = 'ahead, at which the poles are, m/s; default: the top speed of a shipped one, else 1'
    command.add_argument('--speed', type=float, metavar='U', help=text)


def _check_driver(command: argparse.ArgumentParser) -> None:
    from auv_analysis.driver.options import add_options

    add_options(command)


def _new(command: argparse.ArgumentParser) -> None:
    command.add_argument('kind', choices=('vehicle', 'scenario', 'law'), help='what to make')
    command.add_argument('name', metavar='NAME', help='of the new file, in the working folder')
    text = f'of a scenario or law: {VEHICLE}'
    command.add_argument('--vehicle', help=text)


def _shell(command: argparse.ArgumentParser) -> None:
    command.add_argument('shell', choices=('bash', 'zsh', 'fish'))


def _nothing(_: argparse.ArgumentParser) -> None:
    """No option of its own."""


TO_FILE = 'file to write; default: printed'


class Command(NamedTuple):
    """A subcommand: its line of help, what adds its options, what it writes if anything."""

    text: str
    add_options: Callable[[argparse.ArgumentParser], None]
    writes: str = 'folder of the results'


GROUPS = {
    'To begin with': {
        'new': Command('a vehicle, a scenario or a law of your own to start from', _new, ''),
        'doctor': Command('what is wrong with the set-up, and what to do', _nothing, ''),
        'completion': Command('names of commands and files by the TAB key', _shell, ''),
    },
    'Experiments': {
        'simulate': Command('simulate a scenario in this process, analyse and report', _simulate),
        'run': Command('run a scenario on real nodes, record, analyse and report', _run),
        'study': Command('the procedure of the paper, steps 1 to 6, as one report', _study),
        'watch': Command('live dashboard in the terminal', _watch, ''),
        'params': Command('the ROS parameter file of a scenario', _params, TO_FILE),
    },
    'Results and bags': {
        'analyze': Command('summary and report of bags, folders of results, or a sweep', _analyze),
        'info': Command('what lies in a bag', _info, ''),
        'replay': Command(
            'a bag as live topics again, or what another law makes of it', add_replay
        ),
        'recover': Command('repair a bag that was cut or damaged, in place', _info, ''),
        'export-rerun': Command('a bag as a file for the rerun viewer', _info),
    },
    'Vehicles and laws compared': {
        'check-vehicle': Command('inertia, couplings and limits of a vehicle', _check_vehicle, ''),
        'design': Command('which change of a vehicle removes which coupling, simulated', _design),
        'linearize': Command(
            'poles and matrices of a vehicle or of its closed loops', add_linearize
        ),
        'import-vehicle': Command(
            'a vehicle file from that of another system', add_import, TO_FILE
        ),
        'export-vehicle': Command('a vehicle as an SDF model for Gazebo', add_export, TO_FILE),
        'atlas': Command('couplings by inertia of the shipped vehicles, side by side', _atlas),
        'tune': Command('laws tuned to equal effort or error, and compared over draws', _tune),
        'sweep': Command('many rollouts of a scenario, with values that vary, to Parquet', _sweep),
    },
    'A real vehicle': {
        'check-driver': Command('whether a driver offers what our nodes need', _check_driver),
    },
}
COMMANDS = {name: command for group in GROUPS.values() for name, command in group.items()}
