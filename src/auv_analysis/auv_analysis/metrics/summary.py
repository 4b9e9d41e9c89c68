"""The figures of a run, as written to summary.json."""

from collections.abc import Sequence
from itertools import chain
from typing import Any

import numpy as np

from auv_analysis.metrics import signals
from auv_analysis.metrics.coupling import (
    Products,
    coupling_terms,
    input_deformation,
    structural_zeros,
    velocity_deformation,
)
from auv_analysis.metrics.energy import depends_on_known, shares
from auv_analysis.metrics.lyapunov import lyapunov
from auv_analysis.metrics.moments import Moments, Tally
from auv_analysis.metrics.settling import TRANSIENT, band_of, dwell, settling_times
from auv_analysis.output.new_files import known
from auv_analysis.runs.run import Run
from auv_gvc_controller.control.gains import body_gains
from auv_gvc_controller.laws.law import make_gains
from auv_gvc_controller.laws.model import control_model

ENERGY_WINDOW = 10.0  # s: the paper prints no window; over this one its energy is met within 2 %
Window = tuple[float, float]


def summarize(
    run: Run, window: Window | None = None, windows: Sequence[Window] = ()
) -> dict[str, Any]:
    """Figures of a run as a plain dict, ready for JSON.

    Parameters
    ----------
    run : of `simulate`, `load_run` or `open_bag`; it is gone through in blocks
    window : (from, to) in s over whose samples energy is averaged; none: the whole run
    windows : more of them, listed beside those that are always there: the first 10 s, the whole
        run and what follows the transient

    Returns
    -------
    summary : the keys of `summary.json`; what is not known is None, never NaN

    """
    model = control_model(run.vehicle)
    Upsilon, Upsilon_inv = model.Upsilon.reshape(6, 6), model.Upsilon_inv.reshape(6, 6)
    gains = [None, None]
    if run.gains:
        gains = [K.tolist() for K in body_gains(make_gains(run.law, run.gains), model)]
    chosen = window or (run.start, run.start + run.duration)
    usual = _usual_windows(run)
    asked = [entry for entry in (chosen, *windows) if entry not in usual]
    late = run.start + TRANSIENT - 1e-9
    cuts = {entry: _cuts(run, entry) for entry in (*usual, *asked)}
    maps = signals.maps_of(model)
    tally = Tally(maps, (late, *chain.from_iterable(cuts[entry] for entry in usual)))
    # apart, so that the other figures do not depend on what is asked for, to the last bit
    special = Tally(maps, chain.from_iterable(cuts[entry] for entry in asked))
    tallies = {entry: tally if entry in usual else special for entry in cuts}
    velocities, inputs = Products(), Products()
    for block in run.blocks():
        for one in {tally, *tallies.values()}:
            one.add(block)
        velocities.add(block.nu)
        inputs.add(block.tau)
    whole, after = tally.between(), tally.between(late)
    moved, commanded = velocities.known, inputs.known
    by_xi = depends_on_known(Upsilon_inv, moved)
    energies = {w: _energy(tallies[w].between(*cuts[w]), w, by_xi) for w in cuts}
    deformed = depends_on_known(velocity_deformation(Upsilon_inv), moved)
    input_deformed = depends_on_known(input_deformation(Upsilon), commanded)
    listed = dict.fromkeys([*usual, *windows])
    figures = {
        'scenario': run.scenario,
        'law': run.law,
        'source': run.source,
        'duration': run.duration,
        'step': run.step,
        'samples': run.samples,
        'kinetic_energy': energies[chosen],
        'kinetic_energy_windows': [energies[entry] for entry in listed],
        'velocity': {'rms': velocities.rms, 'max': velocities.largest},
        **_errors(run, whole, after, moved),
        'lumped_error': {
            'rms': whole.rms(signals.LUMPED) if run.knows_disturbance else None,
            'max_after_2s': _peak(after, signals.LUMPED) if run.knows_disturbance else None,
        },
        'coupling': {
            'delta_xi_max': if_known(deformed, whole.peak(signals.DELTA_XI)),
            'delta_pi_max': if_known(input_deformed, whole.peak(signals.DELTA_PI)),
            'structural_zeros': structural_zeros(Upsilon),
        },
        'coupling_terms': {
            'delta_xi': coupling_terms(velocity_deformation(Upsilon_inv), velocities),
            'delta_pi': coupling_terms(input_deformation(Upsilon), inputs),
        },
        'effort': {
            'rms': if_known(commanded, whole.rms(signals.TAU)),
            'max': if_known(commanded, whole.peak(signals.TAU)),
        },
        'gains': {'K_D': gains[0], 'K_f': gains[1]},
        'decomposition': {'Upsilon': Upsilon.tolist(), 'N': model.N.tolist()},
        'lyapunov': lyapunov(run, model),
        'acceleration': run.acceleration,
        'unexplained': estimate_figures(run.unexplained, run.unexplained_error),
        'required_wrench': estimate_figures(run.required_wrench, run.required_wrench_error),
        'gaps': {
            'valid_share': run.valid_share,
            'spans': [{'window': list(span)} for span in run.gaps],
        },
        'notes': list(run.notes),
    }
    return known(figures)


def if_known(known: np.ndarray, values: Sequence[float | None]) -> list[float | None]:
    """Figures of six degrees of freedom, None where they rest on what was not recorded."""
    return [value if there else None for there, value in zip(known, values, strict=True)]


def _usual_windows(run: Run) -> list[Window]:
    end = run.start + run.duration
    starts = (run.start, run.start + min(ENERGY_WINDOW, run.duration)), (run.start, end)
    return [*starts, (run.start + TRANSIENT, end)] if run.duration > TRANSIENT else [*starts]


def _cuts(run: Run, window: Window) -> Window:
    """Cuts before the first and behind the last sample of a window."""
    first, last = window
    return first - run.step / 2, float(np.nextafter(last + run.step / 2, np.inf))


def _errors(run: Run, whole: Moments, after: Moments, known: np.ndarray) -> dict[str, Any]:
    if not run.knows_setpoint:
        none = dict.fromkeys(('rms', 'max_after_2s', 'settling_time'))
        return {'velocity_error': none, 'settling': None}
    asked = ~np.isnan(run.nu_d[0])
    known = known & asked
    band = band_of(whole.peaks[signals.SETPOINT])
    errors = ((block.t, block.nu_d - block.nu) for block in run.blocks())
    blocks = ((np.round(t - run.start, 9) if run.start else t, error) for t, error in errors)
    times, residual = settling_times(blocks, run.samples, band)
    late = _peak(after, signals.ERROR)
    return {
        'velocity_error': {
            'rms': if_known(known, whole.rms(signals.ERROR)),
            'max_after_2s': late and if_known(known, late),
            'settling_time': if_known(known, times),
        },
        'settling': {
            'band': if_known(asked, band.tolist()),
            'dwell': dwell(run.samples) * run.step,
            'residual': if_known(known, residual),
        },
    }


def _energy(inside: Moments, window: tuple[float, float], known: np.ndarray) -> dict[str, Any]:
    if inside.count < 2:
        none = dict.fromkeys(('mean', 'mean_by_component', 'shares_percent'))
        return none | {'window': list(window)}
    components = np.where(known, inside.mean(signals.ENERGY), np.nan)
    return {
        'mean': float(components.sum()),
        'mean_by_component': components.tolist(),
        'shares_percent': shares(components).tolist() if known.all() else None,
        'window': [float(inside.first), float(inside.last)],
    }


def _peak(part: Moments, signal: int) -> list[float] | None:
    return part.peak(signal) if part.count else None


def estimate_figures(
    wrench: np.ndarray | None, error: np.ndarray | None
) -> dict[str, list[float]] | None:
    """Figures of a wrench (n, 6) that was estimated, and of its error; None: it is not."""
    if wrench is None or error is None or np.isnan(wrench[0]).all():
        return None
    found = {
        'mean': wrench.mean(axis=0),
        'rms': np.sqrt((wrench**2).mean(axis=0)),
        'max': np.abs(wrench).max(axis=0),
        'error_rms': np.sqrt((error**2).mean(axis=0)),
    }
    return {name: values.tolist() for name, values in found.items()}
