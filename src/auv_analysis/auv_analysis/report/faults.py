"""Faults in the report: a table each, one plot and a sentence per controller over all of them."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from auv_analysis.metrics.fault_response import (
    FILE,
    PARTS,
    SHORTEST,
    FaultResponse,
    fault_rows,
    responses,
)
from auv_analysis.metrics.quantities import SIGNALS
from auv_analysis.metrics.settling import BAND_TEXT, TRANSIENT
from auv_analysis.output.new_files import write_table
from auv_analysis.output.text import Maths, capital, join, number
from auv_analysis.report import plots
from auv_analysis.report.digest import RunDigest, digests
from auv_analysis.report.document import Block, Section, Sentence
from auv_analysis.report.plots import GREY, Drawn, save_figures
from auv_analysis.report.results import Shown, Table, described, view_of_file
from auv_analysis.report.run_plots import common_bands, fitting, left_out
from auv_analysis.runs.run import Run
from auv_dynamics.vehicle import DOFS

ABOUT = (
    'The simulated vehicle has faults that the controllers do not know of. Each is held against '
    'the times before and behind it.'
)
TITLE = 'Faults: what each law does under them'
NO_ERROR = 'No set-point of these runs is known, and so no error.'


def fault_part(out: Path, runs: Mapping[str, Run]) -> tuple[Section, list[Sentence]] | None:
    """Section on the faults of some runs; writes `faults.parquet` and the figure.

    Parameters
    ----------
    out : folder of the results
    runs : name -> run

    Returns
    -------
    section, sentences : and what the summary says; None where the runs have no faults, or not the
        same ones

    """
    if len({run.faults for run in runs.values()}) != 1 or not next(iter(runs.values())).faults:
        return None
    found: dict[str, list[FaultResponse]] = {name: responses(run) for name, run in runs.items()}
    blocks: list[Block] = [NO_ERROR]
    if all(found.values()):
        write_table(out / FILE, fault_rows(found))
        drawn = {'faults': partial(fault_figure, digests(runs))}
        blocks = [ABOUT, *save_figures(out / 'figures', drawn).values(), *fault_tables(found)]
    else:
        found = {}
    return Section('faults', TITLE, blocks), [*fault_overview(found)]


Found = Mapping[str, Sequence[FaultResponse]]


def fault_overview(found: Found) -> Iterator[Sentence]:
    """A sentence per controller on all faults together."""
    for name, several in found.items():
        there = [response for response in several if response.rms[1] is not None]
        if not there:
            continue
        worst = max(there, key=_rise)
        ended = {one.mark.number for one in several if one.until is not None}
        open_ones = {n.mark.number for n in several if n.until is not None and n.recovery is None}
        text = f'The fault that disturbs {name} most is number {worst.mark.number} '
        text += f'({worst.mark.label}, {worst.mark.times}): up to {number(worst.peak[1], 2)} '
        text += f'{"rad/s" if worst.dof in DOFS[3:] else "m/s"} in {worst.dof}'
        if ended:
            back = len(ended) - len(open_ones)
            text += f'; after {back or "none"} of the {len(ended)} that end every error comes back '
            text += 'into its settling band before anything else changes'
        yield Sentence(f'{text}.', 'faults')


def _rise(response: FaultResponse) -> float:
    """Growth of the error, in settling bands."""
    before, during, _ = response.rms
    return ((during or 0.0) - (before or 0.0)) / response.band


ROOM = 1.3  # of the axis above what it shows, for the numbers of the faults


def fault_figure(runs: Mapping[str, RunDigest]) -> Drawn:
    """Velocity errors of runs of one scenario with faults, each with a set-point."""
    figure = plots.new_figure(7.2)
    panels = figure.subplots(6, 1, sharex=True)
    first = next(iter(runs.values()))
    bands = common_bands(runs)
    for i, axes in enumerate(panels):
        _panel(axes, runs, i, bands[i])
        axes.set_ylabel(SIGNALS['error'].axis([i]))
        plots.letter(axes, i, DOFS[i])
    panels[-1].set_xlabel('$t$ (s)')
    handles = [Line2D([], [], **_look(n)) for n in range(len(runs))]
    names, columns = fitting([*runs], 4)
    figure.legend(handles, names, loc='outside upper right', ncols=columns, handlelength=2.6)
    named = [f'{mark.number}  {mark.label}, {mark.times}' for mark in first.faults]
    patches = [Patch(color=plots.FAULT) for _ in named]
    figure.legend(patches, named, loc='outside lower left', ncols=2)
    title = 'Velocity errors under faults'
    caption = (
        f'{title}, of {join(list(runs))}. Dotted: settling band{left_out(bands)}. '
        f'The axes are those of the errors after {TRANSIENT:g} s.{plots.shade_sentence(first)}'
    )
    return figure, title, caption


def _panel(axes: Axes, runs: Mapping[str, RunDigest], i: int, band: float | None) -> None:
    low = high = 0.0
    for n, run in enumerate(runs.values()):
        split = ('error', 'early') in run.traces
        for part in ('early', 'late') if split else ('whole',):
            t, error = run.drawn('error', i, part)
            axes.plot(t, error, **_look(n))
            if part != 'early':
                low, high = min(low, np.nanmin(error)), max(high, np.nanmax(error))
    if band is not None:
        for level in (-band, band):
            axes.axhline(level, color=GREY, linewidth=0.7, linestyle=(0, (1, 2)), zorder=1.5)
        low, high = min(low, -1.2 * band), max(high, 1.2 * band)
    axes.set_ylim(1.1 * low, ROOM * high)
    plots.shade(axes, next(iter(runs.values())))


def _look(n: int) -> dict[str, Any]:
    return plots.look(n) | {'linewidth': 0.9}


ERROR, EFFORT = Maths('RMS of ν_d − ν'), 'RMS of τ'
BEFORE, AFTER = 'before the fault', 'the same behind it'
SHOWN: dict[str, Shown] = {
    'dof': described('', 'degree of freedom'),
    'controller': described('controller', 'name of the run'),
    'rms_before': described(
        'before', f'RMS of the velocity error {BEFORE}; m/s, rad/s', group=ERROR
    ),
    'rms_during': described('during', 'the same while it is there', group=ERROR),
    'rms_after': described('after', AFTER, group=ERROR),
    'max_during': described('max', Maths('largest |ν_d − ν| during the fault; m/s, rad/s')),
    'band': described('band', f'of a settled error: {BAND_TEXT}; m/s, rad/s'),
    'recovery': described(
        'recovery', 'time behind the end of the fault from which the error stays within', 's',
        decimals=2,
    ),
    'effort_before': described('before', f'RMS of the command {BEFORE}; N, N m', group=EFFORT),
    'effort_during': described('during', 'the same while it is there', group=EFFORT),
    'effort_after': described('after', AFTER, group=EFFORT),
    'effort_unit': 'unit',
}  # fmt: skip


def fault_tables(found: Mapping[str, Sequence[FaultResponse]]) -> Iterator[Table]:
    """A table per fault: a row per degree of freedom and controller.

    Parameters
    ----------
    found : controller -> `responses(run)`, of one scenario

    """
    stored = list(enumerate(fault_rows(found)))
    every = {one.mark.number: one for several in found.values() for one in several}
    for index, first in every.items():
        mine = [(i, row) for i, row in stored if row['fault'] == index]
        mine.sort(key=lambda pair: DOFS.index(pair[1]['dof']))
        caption = f'Fault {index}: {first.mark.label}, {first.mark.times}. {_times(first)}'
        yield view_of_file(f'faults_{index}', caption, mine, SHOWN, FILE, stub=2)


def _times(response: FaultResponse) -> str:
    texts = [
        f'{part} is {begin:g}–{end:.6g} s' if end > begin else f'there is no time {part}'
        for part, (begin, end) in zip(PARTS, response.windows, strict=True)
        if part != 'during'
    ]
    note = f'as long as the fault ({SHORTEST:g} s at least) or up to the next change'
    until = '' if response.until is None else f'; recovery is looked for up to {response.until:g} s'
    text = ', '.join(texts)
    return f'{capital(text)} ({note}){until}.'
