"""What the interactive panels of a report show: lines of the sketches, of all controllers."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from auv_analysis.output.text import join
from auv_analysis.report import plotting
from auv_analysis.report.certificates import BOUND, IDENTITY
from auv_analysis.report.panel import Key, Panel, PanelLine, PanelSet
from auv_analysis.report.plotting import COLOURS, GREY, Quantity
from auv_analysis.report.sketch import Sketch
from auv_analysis.report.traces import Line
from auv_dynamics.vehicle import DOFS

THIN, THICK = 1.0, 3.0  # of lines, px; the thick ones lie under others
INK = 'ink'  # the colour of the text, light or dark
GROUPS = {'linear': range(3), 'angular': range(3, 6)}
ENERGY = Quantity('energy of ξ', tuple(f'ξ{i}' for i in range(1, 7)), ('J', 'J'))
SIX = {  # signal of `Sketch` -> what it is, whether its size also shows on a logarithmic axis
    'error': (plotting.ERROR, True),
    'lumped_error': (plotting.LUMPED, True),
    'F': (plotting.UNCERTAINTY, False),
    'tau': (plotting.INPUT, False),
    'applied': (Quantity('applied wrench', (), plotting.WRENCH), False),
    'unexplained': (Quantity('unexplained wrench', (), plotting.WRENCH), False),
    'energy': (ENERGY, False),
    'delta_xi': (plotting.DELTA_XI, False),
    'delta_pi': (plotting.DELTA_PI, False),
}
SECTIONS = {  # set of panels -> its signals, beginnings of the names of the figures it stands for
    'errors': (('error',), ('errors_',)),
    'estimates': (('lumped_error', 'F', 'unexplained'), ('lumped_error_', 'uncertainty_')),
    'inputs': (('tau', 'applied'), ('inputs_',)),
    'certificates': ((), ('certificate_',)),
    'energy': (('energy',), ('kinetic_energy',)),
    'couplings': (('delta_xi', 'delta_pi'), ('delta_xi', 'delta_pi')),
}


def panel_sets(runs: Mapping[str, Sketch]) -> dict[str, PanelSet]:
    """Panels of all runs by section of the report; no set is without panels."""
    sets = {}
    for name, (signals, figures) in SECTIONS.items():
        panels = [panel for signal in signals for panel in _six_signals(signal, runs)]
        if name == 'certificates':
            panels = list(_certificates(runs))
        elif name == 'energy':
            panels = [_kinetic(runs), *_shares(runs), *panels]
        if panels:
            sets[name] = PanelSet(name, tuple(panels), figures)
    return sets


def different_disturbances(runs: Mapping[str, Sketch]) -> dict[str, Sketch]:
    """Runs with a known F that no run before them has."""
    kept: dict[bytes, str] = {}
    for name, run in runs.items():
        if run.knows_disturbance:
            kept.setdefault(run.F_digest, name)
    return {name: runs[name] for name in kept.values()}


def _with(signal: str, runs: Mapping[str, Sketch]) -> Mapping[str, Sketch]:
    """Runs that have a signal worth a line."""
    if signal == 'F':
        return different_disturbances(runs)
    there = {name: run for name, run in runs.items() if signal in run.columns}
    if signal == 'lumped_error':
        return {name: run for name, run in there.items() if run.estimates}
    return there


def _six_signals(signal: str, runs: Mapping[str, Sketch]) -> Iterator[Panel]:
    quantity, logarithmic = SIX[signal]
    there = _with(signal, runs)
    moving = {i for run in there.values() for i in plotting.moving(run.part(signal))}
    for group, members in GROUPS.items():
        columns = [i for i in members if i in moving]
        if not columns:
            continue
        unit = quantity.unit(columns[0])
        yield Panel(
            f'{signal}-{group}',
            f'{quantity.name.capitalize()}, {group}' if signal != 'energy' else _energies(columns),
            quantity.name,
            unit,
            tuple(Key(DOFS[i], COLOURS[i]) for i in columns),
            tuple(_lines(there, [(signal, i) for i in columns])),
            'both' if logarithmic else 'line',
        )


def _energies(columns: Sequence[int]) -> str:
    return f'Kinetic energy of {join([ENERGY.symbols[i] for i in columns])}'


def _certificates(runs: Mapping[str, Sketch]) -> Iterator[Panel]:
    there = {name: run for name, run in runs.items() if ('L', 'whole') in run.traces}
    there = {name: run for name, run in there.items() if len(run.line('L')[0])}
    if there:
        keys = (Key('L', INK, dof=False),)
        yield Panel('L', 'L of (23)', 'L', 'J', keys, tuple(_lines(there, [('L', 0)])), 'log')
        rates = {
            'bound': Key('bound (28)', BOUND, dof=False),
            'identity': Key('identity (26)', IDENTITY, dof=False, width=THICK),
            'L_dot': Key('measured', INK, dof=False, width=THIN),
        }
        for name, run in there.items():
            yield Panel(
                f'rates-{name}',
                f'Derivative of L, {name}',
                'dL/dt',
                'W',
                tuple(rates.values()),
                tuple(_lines({name: run}, [(signal, 0) for signal in rates])),
            )


def _kinetic(runs: Mapping[str, Sketch]) -> Panel:
    wanted = Key('of the set-point', GREY, dof=False, width=THICK)
    keys = wanted, Key('of the run', INK, dof=False)
    lines = tuple(_lines(runs, [('wanted', 0), ('kinetic', 0)]))
    return Panel('kinetic', 'Kinetic energy', 'kinetic energy', 'J', keys, lines)


def _shares(runs: Mapping[str, Sketch]) -> Iterator[Panel]:
    keys = tuple(Key(dof, colour) for dof, colour in zip(DOFS, COLOURS, strict=True))
    for name, run in runs.items():
        t, parts = run.shares()
        if len(t):
            lines = tuple(PanelLine(name, i, (t, parts[:, i]), run.step) for i in range(6))
            title = f'Shares of ξ1 to ξ6 in the kinetic energy, {name}'
            yield Panel(f'shares-{name}', title, 'share', '%', keys, lines, 'stack')


def _lines(runs: Mapping[str, Sketch], signals: Sequence[tuple[str, int]]) -> Iterator[PanelLine]:
    for name, run in runs.items():
        for key, (signal, column) in enumerate(signals):
            if any((signal, part) in run.traces for part in ('whole', 'early')):
                yield PanelLine(name, key, _whole(run, signal, column), run.step, run.gaps)


def _whole(run: Sketch, signal: str, column: int) -> Line:
    """Line over the whole run, of its phases where it is drawn in two."""
    if (signal, 'whole') in run.traces:
        return run.line(signal, column)
    phases = [run.line(signal, column, part) for part in ('early', 'late')]
    t, y = (np.concatenate(values) for values in zip(*phases, strict=True))
    return t, y
