"""Draw the figures of the pages from runs: `simulate`, no nodes.

A figure is drawn again when what it shows may have changed: the sources, the configuration or this
file. They lie in `docs/_figures`, outside of git.
"""

from collections.abc import Callable
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from auv_analysis import load_scenario, simulate
from auv_analysis.metrics.coupling import delta_pi, delta_xi
from auv_analysis.metrics.energy import kinetic_energy
from auv_analysis.report.plots import COLOURS, STYLE
from auv_analysis.runs.run import Run
from auv_dynamics import load_vehicle
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller import decompose

HERE = Path(__file__).resolve().parent
FOLDER = HERE / '_figures'
LATER = 1.0  # s: the jump at the start would flatten what follows
BASIS = (HERE / 'figures.py', HERE.parent / 'src', HERE.parent / 'config')


def settling() -> plt.Figure:
    """Errors of GVC and CL with the paper's gains, Case 1."""
    scenario = load_scenario('case1')
    figure, rows = plt.subplots(2, 1, sharex=True, figsize=(6.4, 4.2), layout='constrained')
    for name, dash in (('gvc', '-'), ('cl', '--')):
        run = simulate(scenario, name)
        error = np.abs(run.nu_d - run.nu) + 1e-9
        for i in (0, 2, 4, 5):
            axes = rows[i // 3]
            axes.semilogy(run.t, error[:, i], dash, color=COLOURS[i], label=f'{DOFS[i]}, {name}')
    for axes, unit in zip(rows, ('m/s', 'rad/s'), strict=True):
        axes.set(ylabel=f'|error| ({unit})', ylim=(1e-5, 3), xlim=(0, 10))
        axes.legend(ncols=2, loc='upper right')
    rows[1].set_xlabel('t (s)')
    return figure


def _case1(vehicle: str = '') -> Run:
    return simulate(load_scenario('case1' + vehicle), 'gvc')


def energy() -> plt.Figure:
    """Kinetic energy by component, equation (30), Case 1."""
    run = _case1()
    Upsilon, N = decompose(run.vehicle.M)
    parts = kinetic_energy(np.linalg.inv(Upsilon), N, run.nu)
    figure, axes = plt.subplots(figsize=(6.4, 2.6), layout='constrained')
    mean = parts.mean(axis=0)
    named = [f'{dof} ({100 * E / mean.sum():.2f} %)' for dof, E in zip(DOFS, mean, strict=True)]
    axes.stackplot(run.t, parts.T, colors=COLOURS, labels=named)
    axes.set(xlabel='t (s)', ylabel='kinetic energy (J)')
    axes.legend(ncols=3, loc='upper right')
    return figure


def couplings() -> plt.Figure:
    """Equations (33) and (34) of the RexROV in case 1 scaled to it, drawn for what comes later."""
    run = _case1('_rexrov')
    Upsilon, _ = decompose(run.vehicle.M)
    shown = (
        ('Δξ', delta_xi(np.linalg.inv(Upsilon), run.nu), ('m/s', 'rad/s')),
        ('Δπ', delta_pi(Upsilon, run.tau), ('N', 'N m')),
    )
    figure, rows = plt.subplots(2, 2, sharex=True, figsize=(6.4, 4.2), layout='constrained')
    for axes, (name, values, units) in zip(rows, shown, strict=True):
        for column, unit in enumerate(units):
            for i in range(3 * column, 3 * column + 3):
                axes[column].plot(run.t, values[:, i], color=COLOURS[i], label=DOFS[i])
            late = values[run.t > LATER, 3 * column : 3 * column + 3]
            low, high = late.min(), late.max()
            axes[column].set_ylim(low - 0.1 * (high - low), high + 0.3 * (high - low))
            axes[column].set_ylabel(f'{name} ({unit})')
            axes[column].legend(ncols=3, loc='upper right')
    for axes in rows[1]:
        axes.set_xlabel('t (s)')
    return figure


def inertia() -> plt.Figure:
    """M of the RexROV as correlations, and what the decomposition makes of it."""
    M = load_vehicle('rexrov').M
    Upsilon, _ = decompose(M)
    size = np.sqrt(np.diag(M))
    figure, columns = plt.subplots(1, 2, figsize=(6.4, 3.0), layout='constrained')
    for axes, title, matrix in (
        (columns[0], '$M_{ij} / \\sqrt{M_{ii} M_{jj}}$', M / np.outer(size, size)),
        (columns[1], '$\\Upsilon$', Upsilon),
    ):
        shown = np.where(np.eye(6), np.nan, matrix)
        image = axes.imshow(shown, cmap='RdBu', vmin=-0.25, vmax=0.25)
        axes.set_xticks(range(6), DOFS, rotation=45, ha='right')
        axes.set_yticks(range(6), DOFS)
        axes.set_title(title)
        axes.grid(visible=False)
    figure.colorbar(image, ax=columns, shrink=0.8)
    return figure


FIGURES: dict[str, Callable[[], plt.Figure]] = {
    'settling': settling,
    'energy': energy,
    'couplings': couplings,
    'inertia': inertia,
}


def newest() -> float:
    """When what the figures depend on was changed last."""
    files = [file for path in BASIS for file in ([path] if path.is_file() else path.rglob('*.*'))]
    return max(file.stat().st_mtime for file in files if file.suffix in ('.py', '.yaml'))


def main() -> None:
    """Draw what is missing or out of date."""
    FOLDER.mkdir(exist_ok=True)
    changed = newest()
    for name, draw in FIGURES.items():
        path = FOLDER / f'{name}.png'
        if path.exists() and path.stat().st_mtime > changed:
            continue
        with plt.style.context({**STYLE, 'font.family': 'DejaVu Sans'}):
            figure = draw()
            figure.savefig(path, dpi=160)
            plt.close(figure)


if __name__ == '__main__':
    main()
