"""`auv simulate`: a scenario in this process, by the same kernel."""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.commands.conclude import console, finish
from auv_analysis.commands.scenarios import open_scenario, prepare_out
from auv_analysis.experiment import write_inputs
from auv_analysis.run import Run
from auv_analysis.simulation import check_hold
from auv_analysis.simulation import simulate as simulate_run
from auv_analysis.warm_up import announce


def simulate(options: argparse.Namespace) -> dict[str, Any]:
    """In this process, by the same kernel."""
    scenario, names = open_scenario(options)
    check_hold(scenario, options.hold)
    out = prepare_out(options, scenario, names)
    write_inputs(scenario, out)
    announce(scenario, names)
    runs, failure = {}, None
    for name in names:
        try:
            with console.status(f'{scenario.name} {name}: simulating'):
                runs[name] = simulate_run(scenario, name, options.hold)
        except ArithmeticError as error:  # it diverges, or a user's own law fails
            failure = failure or error
            continue
        _write_samples(runs[name], out / f'{name}.npz')
    return finish(out, runs, scenario, failure)


def _write_samples(run: Run, path: Path) -> None:
    motion, forces = ('t', 'eta', 'nu', 'nu_measured', 'nu_d', 'nu_d_dot'), ('tau', 'tau_applied')
    names = (*motion, *forces, 'disturbance', 'disturbance_estimate')
    np.savez_compressed(path, **{name: getattr(run, name) for name in names})
