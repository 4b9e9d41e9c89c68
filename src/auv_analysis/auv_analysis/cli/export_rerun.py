"""`auv export-rerun`: a bag as a file for the rerun viewer."""

import argparse
from pathlib import Path
from typing import Any

from auv_analysis.cli.arguments import add_results


def add_arguments(command: argparse.ArgumentParser) -> None:
    """A bag."""
    add_results(command, 'file to write; default: beside the bag')
    command.add_argument('bag', type=Path, metavar='BAG')


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Write a bag as a file for the rerun viewer."""
    from auv_analysis.bag.load import open_bag
    from auv_analysis.output.new_files import check_file
    from auv_analysis.report.rerun_export import export, library
    from auv_dynamics.files.errors import printable

    library()  # before anything is read
    bag = options.bag
    named = bag if bag.name.strip('.') else bag.resolve()  # `.` and `..` name nothing
    out = options.out or named.with_name(f'{named.name if named.is_dir() else named.stem}.rrd')
    check_file(out, overwrite=options.overwrite, inputs=[bag])
    run = open_bag(bag).run
    samples = export(run, out)
    if not options.json:
        print(printable(f'{out}: {samples} samples, trajectory, velocity, wrench, energy shares'))
        print(printable(f'rerun {out}'))
    return {'file': str(out), 'controller': run.controller, 'samples': samples}
