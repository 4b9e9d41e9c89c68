"""`auv predict`: how well a vehicle file predicts a recording that it has not seen."""

from __future__ import annotations

import argparse
import os
from typing import Any

from auv_analysis.cli.arguments import add_results, number
from auv_analysis.cli.identify import add_bags, read

SETTLED = 5.0  # lags: commands of before count less than a hundredth


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Recordings and a vehicle."""
    add_results(command)
    add_bags(command)
    text = 'lag of the actuators, s, which a vehicle file does not hold; default: none'
    command.add_argument('--lag', type=number(at_least=0.0), default=0.0, metavar='S', help=text)
    text = 'their delay, s; default: none'
    command.add_argument('--delay', type=number(at_least=0.0), default=0.0, metavar='S', help=text)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """How well a vehicle file predicts a recording, beside persistence and a black box."""
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # small matrices: threads only wait
    from auv_analysis.output.folder import results_folder
    from auv_analysis.output.progress import TextConsole, waiting
    from auv_analysis.report.plots import save_figures
    from auv_analysis.studies.identify.identify import HISTORY, compared
    from auv_analysis.studies.identify.plots import prediction
    from auv_analysis.studies.identify.prediction import held_of
    from auv_analysis.studies.identify.report import narrow, prediction_results

    vehicle, training, held, notes, inputs, out = read(options, 'predict')
    with results_folder(out, overwrite=options.overwrite, inputs=inputs) as folder:
        with waiting('predicting'):
            moments = held_of(held, max(HISTORY, options.delay + SETTLED * options.lag))
            rows = compared(training, moments, vehicle, lag=options.lag, delay=options.delay)
        results = prediction_results(vehicle.name, held, rows, notes)
        results.write(folder.folder)
        save_figures(folder.folder / 'figures', {'prediction': lambda: prediction(rows)})
        if not options.json:
            console = TextConsole(highlight=False)
            console.print(narrow(results, 'predictions'))
            console.print(f'\n{results.facts["verdict"]}\nfolder: {out}', markup=False)
    return results.to_json()
