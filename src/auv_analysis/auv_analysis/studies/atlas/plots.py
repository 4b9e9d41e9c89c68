"""Figures of the atlas: a panel of 6x6 cells per vehicle, a ranking."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from auv_analysis.output.text import Maths, join
from auv_analysis.report import plots
from auv_analysis.report.plots import (
    COLOURS,
    Drawn,
    FigureRecord,
    HeatMap,
    draw_grid,
    save_figures,
    scale_bar,
)
from auv_analysis.studies.atlas.atlas import Chart
from auv_dynamics.vehicle import DOFS

ACROSS = 2  # panels in a row
SMALLEST_SHARE = 0.001  # %, low end of the scale


def draw(charts: Sequence[Chart], folder: Path) -> dict[str, FigureRecord]:
    """Draw the figures of an atlas as PNG and PDF: name -> figure; the folder is made."""
    drawn: dict[str, Callable[[], Drawn]] = {
        'strength': lambda: _strength(charts),
        'correlation': lambda: _correlation(charts),
        'shares': lambda: _shares(charts),
    }
    return save_figures(folder, drawn)


def coupled(charts: Sequence[Chart]) -> list[tuple[str, Chart]]:
    """Charts that have couplings, once for vehicles of equal correlation, with their names."""
    found: list[tuple[list[str], Chart]] = []
    for chart in charts:
        if chart.is_diagonal:
            continue
        R = chart.correlation
        for names, other in found:
            if np.array_equal(other.correlation, R):
                names.append(chart.name)
                break
        else:
            found.append(([chart.name], chart))
    return [(', '.join(names), chart) for names, chart in found]


def uncoupled(charts: Sequence[Chart]) -> str:
    """Sentence, behind a blank, that names the vehicles of diagonal M; '' where there is none."""
    names = [chart.name for chart in charts if chart.is_diagonal]
    if not names:
        return ''
    verb = 'has' if len(names) == 1 else 'have'
    return f' {join(names)} {verb} a diagonal M: Upsilon = I, nothing is coupled by inertia.'


def _correlation(charts: Sequence[Chart]) -> Drawn:
    end = max([chart.largest for chart in charts])
    grids = {
        name: HeatMap(
            np.where(np.eye(6), np.nan, chart.correlation),
            DOFS,
            'inertial correlation',
            'PuOr_r',
            Normalize(-end, end),
        )
        for name, chart in coupled(charts)
    }
    title = 'Inertial correlation'
    caption = Maths(
        f'{title} M_ij / sqrt(M_ii M_jj) of the vehicles that are coupled: where i and j move with '
        'equal kinetic energies, their cross term is this part of the sum of the two. All panels '
        'have one scale; 0: not coupled; the diagonal is left out.{}',
        uncoupled(charts),
    )
    return _panels(grids), title, caption


def _shares(charts: Sequence[Chart]) -> Drawn:
    values = {}
    for name, chart in coupled(charts):
        both = chart.velocity_shares + chart.input_shares
        values[name] = 100 * np.where(np.eye(6), np.nan, both)
    largest = max([10 * SMALLEST_SHARE, *map(np.nanmax, values.values())])
    scale = LogNorm(SMALLEST_SHARE, largest, clip=True)
    grids = {
        name: HeatMap(cells, DOFS, 'share of energy (%)', 'cividis_r', scale)
        for name, cells in values.items()
    }
    title = 'Which degree of freedom deforms which'
    caption = (
        f'{title}: of the energy of a motion in the column’s degree of freedom alone, the share '
        'that the decomposition finds in the row’s component ξ (above the diagonal: what deforms '
        'velocities, Δξ); of the energy that an impulse in the column’s alone leaves, the share in '
        'the row’s component (below: what deforms inputs, Δπ). One logarithmic scale; 0: none.'
    )
    return _panels(grids), title, caption + uncoupled(charts)


def _panels(grids: dict[str, HeatMap]) -> Figure | None:
    """A square panel per grid, all on one scale."""
    if not grids:
        return None
    figure, panels = plots.small_multiples(len(grids), ACROSS, height=2.9)
    for axes, (name, grid) in zip(panels, grids.items(), strict=True):
        draw_grid(axes, grid)
        axes.set_yticks(range(6), DOFS)
        axes.set_title(name, loc='left', fontweight='bold')
    one = next(iter(grids.values()))
    place: dict[str, Any] = {'location': 'bottom', 'aspect': 60, 'fraction': 0.03}
    scale_bar(figure, panels[0].images[0], one.label, ax=panels, **place)
    return figure


def _strength(charts: Sequence[Chart]) -> Drawn:
    shown = [chart for chart in charts if not chart.is_diagonal]
    title = 'Strength of inertial coupling'
    if not shown:
        return None, title, f'{title}:{uncoupled(charts)}'
    figure = plots.new_figure(0.9 + 0.3 * len(shown))
    axes = figure.subplots()
    places = np.arange(len(shown))
    axes.barh(places, [100 * c.strength for c in shown], color=COLOURS[5], height=0.7)
    axes.plot([100 * c.largest for c in shown], places, 'o', color=COLOURS[0])
    for i, chart in enumerate(shown):
        pair = '–'.join(chart.pairs[0])
        axes.annotate(pair, (100 * chart.strength, i), xytext=(9, 0), va='center',
                      textcoords='offset points', fontsize='medium')  # fmt: skip
    axes.set_yticks(places, [chart.name for chart in shown])
    axes.set(ylim=(len(shown) - 0.5, -0.5), xlabel='cross terms / energy without them (%)')
    axes.margins(x=0.15)
    axes.set_xlim(left=0.0)
    axes.grid(axis='y', visible=False)
    caption = (
        f'{title}: bars, the largest part that all cross terms together have, over all motions, of '
        'the kinetic energy without them; dots, the same of the pair that is named.'
    )
    return figure, title, caption + uncoupled(charts)
