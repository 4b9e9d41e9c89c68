"""The figures of a design, before and after: couplings, the reduced one over time, Upsilon."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.metrics.settling import TRANSIENT
from auv_analysis.output.text import Maths
from auv_analysis.report import plots as plotting
from auv_analysis.report.digest import RunDigest, digests
from auv_analysis.report.plots import Drawn, FigureRecord, before_after, save_figures
from auv_analysis.studies.design.results import DesignStudy
from auv_dynamics.vehicle import DOFS

WAS, IS = plotting.GREY, plotting.COLOURS[0]
FAINT = 1e-4  # of the largest share: smaller couplings are not drawn
SYMBOLS = {'delta_xi': r'\Delta\xi', 'delta_pi': r'\Delta\pi'}


def draw_design(result: DesignStudy, folder: Path) -> dict[str, FigureRecord]:
    """Draw a design as PNG and PDF; nothing where there was nothing to reduce."""
    if not result.simulated:
        return {}
    main = result.document['controller']
    lines = digests({name: one.runs[main] for name, one in result.simulated.items()})
    parts = {
        'couplings': partial(_couplings, result.document),
        'reduced': partial(_reduced, result.document, lines),
        'Upsilon': partial(_upsilon, result.document, result.proposal.setting.space.vehicle.M),
    }
    return save_figures(folder, parts)


def _symbol(coupling: str) -> str:
    kind, dof = coupling.split('.')
    return f'${SYMBOLS[kind]}_{DOFS.index(dof) + 1}$ {dof}'


def _couplings(document: Mapping[str, Any]) -> Drawn:
    largest = document['ranking'][0]['share']['before']
    rows = [row for row in document['ranking'] if max(row['share'].values()) > FAINT * largest]

    figure = plotting.new_figure(0.9 + 0.27 * len(rows))
    axes = figure.subplots()
    pairs = ([row['share'][k] for row in rows] for k in ('before', 'after'))
    before, after = (np.maximum(shares, 1e-3 * FAINT * largest) for shares in pairs)
    names = [_symbol(row['coupling']) for row in rows]
    before_after(axes, names, before, after, _symbol(document['reduce']))
    axes.set_xscale('log')
    axes.set_xlabel('share of the motion (free of units)')

    caption = (
        'Share of each coupling in the whole motion before (circle) and after (diamond) the '
        f'change, simulated with {document["controller"]}; in bold the one that was to be '
        f'reduced. Shares below {FAINT:g} of the largest are not drawn.'
    )
    return figure, 'Couplings before and after', caption


def _reduced(document: Mapping[str, Any], lines: Mapping[str, RunDigest]) -> Drawn:
    main, (kind, dof) = document['controller'], document['reduce'].split('.')
    column = DOFS.index(dof)
    split = (kind, 'early') in lines['before'].traces  # which last as long
    parts = ('early', 'late') if split else ('whole',)
    unit = next(row['unit'] for row in document['measures'] if row['name'] == f'{kind}_max.{dof}')

    figure = plotting.new_figure(2.5)
    widths = (1, 1.9) if split else (1,)
    (grid,) = figure.subplots(1, len(parts), squeeze=False, width_ratios=widths)
    for axes, part in zip(grid, parts, strict=True):
        for name, colour, dash in (('before', WAS, '-'), ('after', IS, (0, (4, 1.6)))):
            t, y = lines[name].line(kind, column, part)
            axes.plot(t, y, color=colour, linestyle=dash, label=name)
            axes.set_xlim(t[0], t[-1])
        axes.set_xlabel('$t$ (s)')
    grid[0].set_ylabel(f'${SYMBOLS[kind]}_{column + 1}$ ({unit})')
    plotting.legend_above(grid[-1], 2)

    caption = f'{document["reduce"]} of the vehicle before and after the change, under {main}.'
    if split:
        caption += f' Left the first {TRANSIENT:g} s, right the rest on a scale of its own.'
    return figure, 'The reduced coupling over time', caption


def _upsilon(document: Mapping[str, Any], M: np.ndarray) -> Drawn:
    weight = np.sqrt(np.diag(M)[:, None] / np.diag(M))
    pair = {key: np.array(document['proposal'][f'Upsilon_{key}']) for key in ('before', 'after')}
    sizes = {key: np.abs(weight * U - np.eye(6)) for key, U in pair.items()}
    top = max(size.max() for size in sizes.values())

    figure = plotting.new_figure(3.4)
    grid = figure.subplots(1, 2)
    for i, (axes, (key, U)) in enumerate(zip(grid, pair.items(), strict=True)):
        image = axes.imshow(sizes[key], cmap='Blues', vmin=0.0, vmax=top)
        for row, column in np.argwhere(sizes[key] > 1e-12):
            dark = sizes[key][row, column] > 0.6 * top
            text = f'{U[row, column]:.2g}'.replace('-', '−')
            colour = 'white' if dark else 'black'
            axes.text(column, row, text, ha='center', va='center', fontsize=6.5, color=colour)
        axes.grid(False)
        axes.set_xticks(range(6), DOFS, rotation=45, ha='right')
        axes.set_yticks(range(6), DOFS if i == 0 else [''] * 6)
        plotting.letter(axes, i, key)
    label = 'weight of the entry (free of units)'
    figure.colorbar(image, ax=grid, label=label, shrink=0.8)

    caption = Maths(
        'Entries of Υ − I before and after the change, from ξ (columns) to ν (rows). The numbers '
        'are the entries in SI units; the colour is their size times the root of M_ii / M_jj, '
        'which is free of units. Below the diagonal everything is zero.'
    )
    return figure, 'Upsilon before and after', caption
