"""Figures of long runs: against NumPy over whole arrays, and how much memory an hour takes."""

import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from bench_commands import AUV
from loops import CONTROLLER, case1
from made_bags import BRIEF, made_bag
from measure import Measured, interleaved, speed

from auv_analysis import simulate
from auv_analysis.metrics.coupling import delta_pi, delta_xi
from auv_analysis.metrics.energy import kinetic_energy
from auv_analysis.metrics.moments import Tally
from auv_analysis.metrics.settling import TRANSIENT
from auv_analysis.metrics.signals import DELTA_PI, DELTA_XI, ENERGY, ERROR, LUMPED, TAU, maps_of
from auv_analysis.runs.run import Run
from auv_gvc_controller.laws.model import ControlModel, control_model

SAMPLES = 1_000_000
SIGNALS = ('eta', 'nu', 'nu_d', 'nu_d_dot', 'tau', 'disturbance', 'disturbance_estimate')
SAME = 1e-9  # relative, of sums that are taken in another order
HOUR = 360_000  # steps at 100 Hz
MB = 1e6


def against_numpy() -> dict[str, Measured]:
    """Samples per second of the figures that are sums and peaks: no settling, no certificate."""
    run = _long_run()
    model = control_model(run.vehicle)
    for ours, theirs in zip(reduced(run, model), whole(run, model), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=SAME)
    return interleaved(
        {'analysis_vs_numpy': speed(lambda: reduced(run, model), SAMPLES)},
        speed(lambda: whole(run, model), SAMPLES),
        'samples/s',
    )


def _long_run() -> Run:
    """A run of random samples: their values do not matter, their number does."""
    run, generator = simulate(case1(1.0), CONTROLLER), np.random.default_rng(0)
    values: dict[str, Any] = {name: generator.normal(size=(SAMPLES, 6)) for name in SIGNALS}
    return replace(run, t=np.arange(SAMPLES) * run.step, law_state=None, **values)


def reduced(run: Run, model: ControlModel) -> list[np.ndarray]:
    """Figures in one go over the samples."""
    late = run.start + TRANSIENT - 1e-9
    tally = Tally(maps_of(model), (late,))
    for block in run.blocks():
        tally.add(block)
    everything, after = tally.between(), tally.between(late)
    figures = [everything.mean(ENERGY)]
    figures += [np.array(everything.rms(signal)) for signal in (ERROR, LUMPED, TAU)]
    figures += [np.array(after.peak(signal)) for signal in (ERROR, LUMPED)]
    return figures + [np.array(everything.peak(s)) for s in (DELTA_XI, DELTA_PI, TAU)]


def whole(run: Run, model: ControlModel) -> list[np.ndarray]:
    """The same figures as one writes them down: an array for each signal."""
    assert run.disturbance is not None
    Upsilon, Upsilon_inv = model.Upsilon.reshape(6, 6), model.Upsilon_inv.reshape(6, 6)
    error, lumped = run.nu_d - run.nu, run.disturbance_estimate - run.disturbance
    late = run.t >= run.t[0] + TRANSIENT - 1e-9
    figures = [kinetic_energy(Upsilon_inv, model.N, run.nu).mean(axis=0)]
    figures += [np.sqrt(np.mean(values**2, axis=0)) for values in (error, lumped, run.tau)]
    figures += [np.abs(values[late]).max(axis=0) for values in (error, lumped)]
    signals = (delta_xi(Upsilon_inv, run.nu), delta_pi(Upsilon, run.tau), run.tau)
    return figures + [np.abs(values).max(axis=0) for values in signals]


def one_hour() -> dict[str, Measured]:
    """Peak memory of `auv analyze` and `auv info` on a bag of an hour, beside six minutes."""
    with tempfile.TemporaryDirectory() as folder:
        analyze = ['analyze', '--out', folder, '--overwrite', '--json']
        found: dict[str, Measured] = {}
        for key, command in (('analysis', analyze), ('info', ['info', '--json'])):
            hour, brief = (_memory([AUV, *command, str(made_bag(n))]) for n in (HOUR, BRIEF))
            found |= interleaved({f'{key}_one_hour_rss_mb': hour}, brief, 'MB', warm=False)
        return found


def _memory(command: Sequence[str]) -> Callable[[], float]:
    """Measurement of the peak memory of a command, MB."""
    return lambda: peak_memory(command) / MB


# a process takes the peak of the one that started it along: this small one stands between
BETWEEN = """
import resource, subprocess, sys
code = subprocess.call(sys.argv[1:], stdout=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
sys.exit(code)
"""


def peak_memory(command: Sequence[str]) -> int:
    """Largest resident memory in bytes of a command that must succeed."""
    between = [sys.executable, '-c', BETWEEN, *command]
    done = subprocess.run(between, capture_output=True, text=True, check=False)
    if done.returncode:
        last = (done.stderr.splitlines() or ['no message'])[-1]
        raise RuntimeError(f'{" ".join(command)}: exit code {done.returncode}: {last}')
    return int(done.stdout) * 1024
