"""Figures of the study of what is unknown: verdicts of all variants, energy over the window."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from auv_analysis.output.text import fixed
from auv_analysis.report import plotting
from auv_analysis.report.evidence import DECIDED
from auv_analysis.report.figure_files import FigureRecord
from auv_analysis.report.paper import KINETIC_ENERGY
from auv_analysis.study.robustness import met
from auv_analysis.study.unknowns import Variant
from auv_analysis.study.unknowns_run import Unknowns

VERDICT_COLOURS = ('#56B4E9', '#F0E442', '#D55E00')  # apart in lightness too
OPEN = '#dddddd'  # not evaluated


def unknowns_figure(found: Unknowns, folder: Path) -> FigureRecord:
    """Verdict of every claim for every variant, over the longest window."""
    last = len(found.windows) - 1
    with plotting.style():
        figure = plotting.new_figure(4.5)
        grid = figure.subplots(1, 2, sharey=True)
        for axes, sign, index in zip(grid, (-1, 1), (0, 1), strict=True):
            chosen = sorted(
                (i for i, v in enumerate(found.variants) if v.exponent_sign == sign),
                key=lambda i: _order(found.variants[i]),
            )
            _strip(axes, found.verdicts[chosen, last], [found.variants[i] for i in chosen])
            plotting.letter(axes, index, f'exponents {"−" if sign < 0 else "+"}')
        grid[0].set_ylabel('number of the claim')
        keys = [Patch(color=c) for c in VERDICT_COLOURS]
        figure.legend(keys, DECIDED, loc='outside lower center', ncols=len(keys))
        files = plotting.save(figure, folder, 'open_claims')
    title = 'Claims over what the paper leaves open'
    caption = (
        f'{title}, runs of {found.windows[last]:g} s: a row per claim, a column per variant, by '
        'rising damping (linear and quadratic factors added); (a) the exponents of (39) read '
        'with −, (b) with +. A tick marks the shipped vehicle.'
    )
    return FigureRecord('open_claims', title, caption, *files)


def _order(variant: Variant) -> tuple[float, float]:
    return variant.linear + variant.quadratic, variant.mass


def _strip(axes: Axes, verdicts: np.ndarray, variants: list[Variant]) -> None:
    claims = len(verdicts[0])
    codes = np.full((len(verdicts), claims), len(DECIDED))
    for code, verdict in enumerate(DECIDED):
        codes[verdicts == verdict] = code
    colours = ListedColormap([*VERDICT_COLOURS, OPEN])
    extent = (-0.5, len(variants) - 0.5, claims + 0.5, 0.5)
    axes.imshow(
        codes.T, cmap=colours, vmin=-0.5, vmax=3.5, aspect='auto', interpolation='none',
        extent=extent,
    )  # fmt: skip
    axes.set_yticks(range(1, claims + 1))
    axes.tick_params(axis='y', length=0)
    shipped = [i for i, variant in enumerate(variants) if variant.kind == 'shipped']
    axes.set_xticks(shipped or [0], ['shipped' if shipped else ' '])
    axes.tick_params(axis='x', length=3.5 if shipped else 0)
    axes.set_xlabel('variants, by rising damping')
    axes.grid(visible=False)
    for row in range(1, claims):
        axes.axhline(row + 0.5, color='white', linewidth=0.8)


def energy_window_figure(found: Unknowns, folder: Path) -> FigureRecord:
    """Mean kinetic energy over 0 to T, with the band of all variants and the paper's value."""
    total, times = found.energy.sum(axis=2), met(found)
    with plotting.style():
        figure = plotting.new_figure(2.6)
        axes = figure.subplots()
        low, high = total.min(axis=0), total.max(axis=0)
        blue, orange = plotting.COLOURS[0], plotting.COLOURS[4]
        band = axes.fill_between(found.ends, low, high, color=blue, alpha=0.3, linewidth=0)
        (line,) = axes.plot(found.ends, total[0], color=blue)
        paper = axes.axhline(KINETIC_ENERGY, color=orange, linestyle=plotting.DASHES[1])
        if times:
            axes.plot(times[0], KINETIC_ENERGY, 'o', color=orange, markersize=4)
        axes.set_xlabel('$T$, end of the window from 0 (s)')
        axes.set_ylabel('mean kinetic energy (J)')
        words = ['shipped vehicle', 'all variants', f'paper, {fixed(KINETIC_ENERGY, 2)} J']
        axes.legend([line, band, paper], words)
        files = plotting.save(figure, folder, 'energy_window')
    title = 'Kinetic energy over the window'
    printed = f'{fixed(KINETIC_ENERGY, 2)} J and no window'
    caption = f'{title}: mean over 0 to T of GVC. The paper prints {printed}'
    if times:
        caption += f'; it would be met at T = {fixed(times[0], 2)} s, a fit, not a finding'
    return FigureRecord('energy_window', title, f'{caption}.', *files)
