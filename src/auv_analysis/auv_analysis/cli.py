"""The `auv` command: one function per subcommand, imports only when they are needed."""

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any

SCENARIO = 'a scenario file, or the bare name of a shipped one'


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> Any:
        """Exit 2 with one line instead of usage and a line."""
        text = message.replace(' (choose from ', '; expected one of (')
        expected = text if 'expected' in text else f'expected a valid command line, found: {text}'
        found = '' if 'found' in expected else f', found none; see {self.prog} --help'
        _say(f'{self.prog}: {expected}{found}')
        sys.exit(2)


def parser() -> argparse.ArgumentParser:
    """Command line of `auv`."""
    main = _Parser(prog='auv', description=__doc__.split(':')[0])
    commands = main.add_subparsers(dest='command', required=True, metavar='COMMAND')

    def command(name: str, text: str, *, writes: bool = True) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=text, description=text)
        if writes:
            sub.add_argument('--out', type=Path, help='folder of the results')
            sub.add_argument('--overwrite', action='store_true', help='replace earlier results')
        sub.add_argument('--json', action='store_true', help='one JSON document on stdout')
        return sub

    run = command('run', 'run a scenario on real nodes, record, analyse and report')
    run.add_argument('scenario', help=SCENARIO)
    run.add_argument('--controller', action='append', help='only this one; may be repeated')
    run.add_argument('--domain-id', help='ROS domain, default: a free one')
    run.add_argument('--composed', action='store_true', help='all nodes in one process: faster')
    simulate = command('simulate', 'simulate a scenario in this process, analyse and report')
    simulate.add_argument('scenario', help=SCENARIO)
    simulate.add_argument('--controller', action='append', help='only this one; may be repeated')
    simulate.add_argument('--hold', choices=('continuous', 'zoh'), default='continuous')
    study = command('study', 'the procedure of the paper, steps 1 to 6, as one report')
    study.add_argument('scenario', help=SCENARIO)
    study.add_argument('--controller', action='append', help='only this one; may be repeated')
    study.add_argument('--hold', choices=('continuous', 'zoh'), default='continuous')
    study.add_argument('--run', action='store_true', help='real nodes in place of this process')
    study.add_argument('--domain-id', help='ROS domain with --run, default: a free one')
    study.add_argument(
        '--composed', action='store_true', help='with --run: all nodes in one process'
    )
    study.add_argument(
        '--window', nargs=2, action='append', type=float, metavar=('FROM', 'TO'), default=[],
        help='kinetic energy over this window as well, s; may be repeated',
    )  # fmt: skip
    study.add_argument('--sensitivity', choices=('sobol', 'morris', 'none'), default='sobol')
    study.add_argument('--samples', type=int, metavar='N', help='base points or trajectories of it')
    study.add_argument(
        '--span', type=float, default=2.0, help='gains vary from 1/SPAN to SPAN times'
    )
    study.add_argument('--seed', type=int, default=0, help='of what is drawn')
    analyze = command('analyze', 'summary and report from recorded bags')
    analyze.add_argument('bags', nargs='+', metavar='BAG', type=Path)
    analyze.add_argument('--vehicle', help='for bags that do not carry their own')
    sweep = command('sweep', 'many rollouts of a scenario, with values that vary, to Parquet')
    sweep.add_argument('campaign', help='a campaign file, or the bare name of a shipped one')
    sweep.add_argument('--executor', choices=('threads', 'dask'), help='default: threads')
    sweep.add_argument('--scheduler', metavar='ADDRESS', help='of dask, such as tcp://host:8786')
    sweep.add_argument('--workers', metavar='N', help='threads or processes; default: the cores')
    design = command('design', 'which change of a vehicle removes which coupling, simulated')
    _add_design_options(design)
    info = command('info', 'what lies in a bag', writes=False)
    info.add_argument('bag', type=Path, metavar='BAG')
    params = command('params', 'the ROS parameter file of a scenario', writes=True)
    params.add_argument('scenario', help=SCENARIO)
    params.add_argument('--controller', required=True)
    params.add_argument('--real-time', action='store_true', help='paced by the clock')
    check = command('check-vehicle', 'inertia, couplings and limits of a vehicle', writes=False)
    check.add_argument('vehicle', metavar='FILE', help='a vehicle file, or a shipped bare name')
    return main


def _add_design_options(design: argparse.ArgumentParser) -> None:
    design.add_argument('vehicle', help='a vehicle file, or the bare name of a shipped one')
    design.add_argument('--scenario', help=f'{SCENARIO}, with this vehicle in it')
    design.add_argument('--reduce', metavar='COUPLING', help='such as delta_pi.pitch')
    text = 'NAME=LOWER:UPPER of a parameter, such as shift.x=-0.05:0.05; may be repeated'
    design.add_argument('--bound', action='append', default=[], help=text)


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
