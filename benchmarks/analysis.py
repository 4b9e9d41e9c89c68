"""The figures of a long run: ours against the obvious NumPy, and the memory of an hour's bag.

`python benchmarks/analysis.py` prints both; a harness calls `measured`.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from made_bags import make_bag

from auv_analysis import load_scenario, simulate
from auv_analysis import moments as of
from auv_analysis.energy import shares
from auv_analysis.moments import Tally, maps_of
from auv_analysis.run import Run
from auv_gvc_controller.model import control_model

SAMPLES = 1_000_000
HOUR = 360_000  # steps at 100 Hz
RUNS = 7


def naive(run: Run) -> list[np.ndarray]:
    """Energy, shares, couplings, RMS and maxima as one would write them down."""
    model = control_model(run.vehicle)
    Upsilon, N = model.Upsilon.reshape(6, 6), model.N
    error, lumped = run.nu_d - run.nu, run.disturbance_estimate - run.disturbance
    xi, pi = run.nu @ np.linalg.inv(Upsilon).T, run.tau @ Upsilon
    delta_xi, delta_pi = xi - run.nu, pi - run.tau
    energy = 0.5 * N * xi**2
    components = energy.mean(axis=0)
    figures = [components, 100.0 * components / components.sum()]
    figures += [np.sqrt((x**2).mean(axis=0)) for x in (error, lumped, run.tau)]
    return figures + [
        np.abs(x).max(axis=0) for x in (error, lumped, run.tau, delta_xi, delta_pi, run.nu_d)
    ]


def fused(run: Run) -> list[np.ndarray]:
    """The same figures as `summarize` forms them."""
    tally = Tally(maps_of(control_model(run.vehicle)), ())
    for block in run.blocks():
        tally.add(block)
    whole = tally.between()
    components = whole.mean(of.ENERGY)
    figures = [components, shares(components)]
    figures += [np.array(whole.rms(signal)) for signal in (of.ERROR, of.LUMPED, of.TAU)]
    peaks = of.ERROR, of.LUMPED, of.TAU, of.DELTA_XI, of.DELTA_PI, of.SETPOINT
    return figures + [np.array(whole.peak(signal)) for signal in peaks]


def analysis_vs_numpy(samples: int = SAMPLES, runs: int = RUNS) -> dict[str, Any]:
    """Gain of `fused` over `naive`, interleaved; the figures are compared first."""
    run = _long_run(samples)
    for found, expected in zip(fused(run), naive(run), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
    pairs = []
    for _ in range(runs):
        times = [time.perf_counter()]
        for function in (fused, naive):
            function(run)
            times.append(time.perf_counter())
        pairs.append((times[1] - times[0], times[2] - times[1]))
    return {
        'value': median(ours for ours, _ in pairs),
        'unit': f's per {samples} samples',
        'ratio': median(theirs / ours for ours, theirs in pairs),
        'reference': median(theirs for _, theirs in pairs),
        'runs': runs,
    }


def analysis_one_hour_rss_mb(folder: Path, steps: int = HOUR) -> dict[str, Any]:
    """Peak of the resident memory of `auv analyze` on a bag of so many steps, a fresh process.

    Parameters
    ----------
    folder : for the bag and the results
    steps : of the bag at 100 Hz

    Returns
    -------
    result : the value in MB; the reference is the same of a bag of 30 s, ratio how much more it is

    """
    values = []
    for number, length in (('short', 3000), ('hour', steps)):
        bag = make_bag(folder / number, length)
        values.append(_peak_rss('analyze', str(bag), '--out', str(folder / f'out_{number}')))
    short, long = values
    return {'value': long, 'unit': 'MB', 'ratio': long / short, 'reference': short, 'runs': 1}


def measured(folder: Path) -> dict[str, dict[str, Any]]:
    """All results by key."""
    return {
        'analysis_vs_numpy': analysis_vs_numpy(),
        'analysis_one_hour_rss_mb': analysis_one_hour_rss_mb(folder),
    }


PEAK = """
import sys
from auv_analysis import cli
cli.main(sys.argv[1:])
lines = open('/proc/self/status').read().splitlines()
print(next(line.split()[1] for line in lines if line.startswith('VmHWM')))
"""


def _peak_rss(*arguments: str) -> float:
    """Peak in MB as the process itself sees it: that of its parent must not count."""
    command = [sys.executable, '-c', PEAK, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return int(done.stdout) / 1024


def _long_run(samples: int) -> Run:
    """A run of so many samples: the numbers of case 1 over and over."""
    run = simulate(load_scenario('case1'), 'gvc', 'zoh')
    return run.part(np.arange(samples) % len(run.t))


def main() -> None:
    """Measure in a temporary folder and print what was found."""
    with tempfile.TemporaryDirectory() as folder:
        json.dump(measured(Path(folder)), sys.stdout, indent=2)
    print()


if __name__ == '__main__':
    main()
