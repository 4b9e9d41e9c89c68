"""Figures of an identification."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import welch

from auv_analysis.metrics.quantities import SIGNALS
from auv_analysis.report import plots
from auv_analysis.report.plots import (
    COLOURS,
    GREY,
    Curve,
    Drawn,
    FigureRecord,
    Panel,
    save_figures,
    small_multiples,
    time_panels,
)
from auv_analysis.studies.identify.identified import Identified
from auv_analysis.studies.identify.prediction import by_name
from auv_analysis.studies.identify.record import Segment
from auv_analysis.studies.identify.whiteness import at_even_rate
from auv_dynamics.vehicle import DOFS

LOOKS: dict[str, dict[str, Any]] = {
    'new': {'color': COLOURS[0], 'marker': 'D'},
    'prior': {'color': COLOURS[1], 'marker': 'o', 'linestyle': '--'},
    'persistence': {'color': GREY, 'marker': 's', 'linestyle': ':'},
    'black box': {'color': COLOURS[2], 'marker': '^', 'linestyle': '-.'},
}

Pairs = Sequence[tuple[Segment, np.ndarray]]  # segments with their residuals


def draw(
    found: Identified, tables: Mapping[str, Sequence[Any]], folder: Path
) -> dict[str, FigureRecord]:
    """Draw the figures as PNG and PDF: name -> figure."""
    pairs = list(found.problem.misfit(found.fit))
    figures = {
        'prediction': lambda: prediction(found.predictions),
        'trace': lambda: _trace(found, pairs),
        'inertia': lambda: _inertia(tables['inertia']),
        'residuals': lambda: _residuals(found, pairs),
    }
    if found.profiles:
        figures['profiles'] = lambda: _profiles(found)
    return save_figures(folder, figures)


def prediction(rows: Sequence[Mapping[str, Any]]) -> Drawn:
    """Errors over the horizon; none where nothing was held out."""
    caption = (
        'Open-loop prediction of what was held out: root mean square of the velocity error, by '
        'kinetic energy, over how far ahead is predicted.'
    )
    if not rows:
        return None, 'Prediction', f'{caption} There is none.'
    figure = plots.new_figure(2.9)
    axes = figure.subplots()
    for name in dict.fromkeys(row['predictor'] for row in rows):
        some = by_name(rows, name)
        x, y = ([row[key] for row in some] for key in ('horizon', 'error'))
        axes.plot(x, y, label=name, markersize=4, **LOOKS.get(name, {}))
    plots.logarithmic(axes, 'x', 'y')
    axes.set_xlabel('horizon (s)')
    axes.set_ylabel('velocity error (m/s)')
    axes.legend()
    return figure, 'Prediction', caption


def _trace(found: Identified, pairs: Pairs) -> Drawn:
    """Measured and simulated velocity of the segments around the middle."""
    middle = len(pairs) // 2
    some = pairs[max(middle - 3, 0) : middle + 3]
    panels = []
    for i, dof in enumerate(DOFS):
        curves = []
        for k, (segment, e) in enumerate(some):
            t = segment.begin + found.problem.step * segment.at
            nu = segment.nu[:, i]
            there = np.isfinite(nu)
            simulated = nu - e[:, i] * found.problem.noise[i]
            first = k == 0
            curves += [
                Curve(t[there], nu[there], 'measured' if first else '',
                      {'color': GREY, 'linewidth': 0.8}),
                Curve(t[there], simulated[there], 'simulated' if first else '',
                      {'color': COLOURS[0], 'linewidth': 1.2}),
            ]  # fmt: skip
        panels.append(Panel(curves, SIGNALS['nu'].unit_of(i), dof))
    figure = time_panels(panels, across=2, height=1.35)
    caption = (
        'Velocity as measured, and as the identified model has it along segments that each start '
        'anew, in the middle of the recording.'
    )
    return figure, 'Fit', caption


def _inertia(rows: Sequence[Mapping[str, Any]]) -> Drawn:
    """Off-diagonal inertia before and after, with intervals."""
    figure, panels = small_multiples(3, 3, height=2.6)
    units = dict.fromkeys(row['unit'] for row in rows)
    for axes, unit in zip(panels, units, strict=False):
        some = [row for row in rows if row['unit'] == unit]
        y = np.arange(len(some))
        value, low, high = (np.array([row[k] for row in some]) for k in ('M', 'M_low', 'M_high'))
        known = [row['verdict'] != 'not known' for row in some]
        spread = np.where(known, np.maximum([value - low, high - value], 0.0), 0.0)
        axes.errorbar(value, y, xerr=spread, fmt='D', color=COLOURS[0],
                      markersize=4, capsize=2, label='identified')  # fmt: skip
        axes.plot([row['M_prior'] for row in some], y, 'o', mfc='none', color=GREY, label='prior')
        axes.axvline(0.0, color='black', linewidth=0.6)
        axes.set_yticks(y, [row['pair'] for row in some])
        axes.invert_yaxis()
        axes.set_xlabel(unit)
    plots.shared_legend(figure)
    caption = 'Couplings in M with their 95 % intervals, and those of the prior.'
    return figure, 'Couplings', caption


def _profiles(found: Identified) -> Drawn:
    """Rise of the cost over each coefficient that was held, and the parabola of its interval."""
    count = len(found.profiles)
    figure, panels = small_multiples(count, min(count, 3), height=1.9)
    border = found.fit.quantile**2
    for axes, one in zip(panels, found.profiles, strict=False):
        x = np.linspace(one.values[0], one.values[-1], 101)
        axes.plot(x, ((x - one.value) / one.deviation) ** 2, '--', color=GREY, label='parabola')
        axes.plot(one.values, one.rise, 'D-', color=COLOURS[0], markersize=3, label='profile')
        axes.axhline(border, color='black', linewidth=0.6)
        axes.set_ylim(0.0, 2.0 * border)
        axes.set_xlabel(f'{one.name} ({one.unit})' if one.unit else one.name)
    plots.shared_legend(figure)
    caption = (
        'Profile likelihoods: rise of the cost where a coefficient is held and all others are '
        'refitted; the line is where a 95 % interval ends.'
    )
    return figure, 'Profiles', caption


def _residuals(found: Identified, pairs: Pairs) -> Drawn:
    """Spectra of the residuals: white ones are flat, at one."""
    figure, panels = small_multiples(6, 3, height=1.7, sharex=True, sharey=True)
    for i, (axes, dof) in enumerate(zip(panels, DOFS, strict=True)):
        spectra = []
        for e, period in at_even_rate(pairs, i, found.problem.step, 17):
            f, p = welch(e, 1.0 / period, nperseg=len(e))
            spectra.append((f[1:], p[1:] / period / 2))
        if spectra:
            top = min(float(f[-1]) for f, _ in spectra)  # all have it, whatever their rate
            f = min((f for f, _ in spectra), key=lambda f: float(f[0]))
            f = f[f < top * (1 + 1e-9)]
            mean = np.mean([np.interp(f, *one) for one in spectra], axis=0)
            axes.plot(f, mean, color=COLOURS[0], linewidth=0.9)
            axes.axhline(1.0, color='black', linewidth=0.6)
            plots.logarithmic(axes, 'x', 'y')
        plots.letter(axes, i, dof)
    for axes in panels[3:]:
        axes.set_xlabel('frequency (Hz)')
    caption = (
        'Spectra of the velocity residuals, in those of the measured noise: flat at one where the '
        'model explains all but noise; above one at frequencies that it misses.'
    )
    return figure, 'Residuals', caption
