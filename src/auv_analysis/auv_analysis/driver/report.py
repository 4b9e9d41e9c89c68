"""The report of a check of a driver: page, figures, and the log of what was heard and sent."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pyarrow import parquet

from auv_analysis.driver.checks import CHECKS, GROUPS
from auv_analysis.driver.evidence import FAIL, NOT_CHECKED, PASS, CheckResult, DriverRecord
from auv_analysis.driver.excitation import MeasuredTrial
from auv_analysis.driver.odometry_checks import reference_ns
from auv_analysis.output.arrow import pa
from auv_analysis.output.new_files import write_json
from auv_analysis.output.text import join
from auv_analysis.report import plots
from auv_analysis.report.document import Block, Section, Sentence, write_document
from auv_analysis.report.plots import COLOURS, GREY, Curve, Drawn, FigureRecord, Panel, save_figures
from auv_analysis.report.results import Column, Shown, make_table
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.vehicle import DOFS

DOCUMENT, SAMPLES, WRENCHES = 'check.json', 'samples.parquet', 'wrenches.parquet'
STATE = ('x', 'y', 'z', 'qw', 'qx', 'qy', 'qz', 'u', 'v', 'w', 'p', 'q', 'r')
TAU = ('X', 'Y', 'Z', 'K', 'M', 'N')
SHOWN: dict[str, Shown] = {
    'id': 'check',
    'verdict': Column('verdict', kind='look'),
    'expected': 'expected',
    'found': 'found',
    'advice': 'what to do',
}
LOOKS = {PASS: 'good', FAIL: 'bad', NOT_CHECKED: ''}
DRAWN = {'time': ('timing',), 'motion': ('linear', 'angular'), 'response': ('answers',)}
MS = 1e3
BINS = 60
WIDER = 1.05
FEW = 3  # messages


def write_results(
    out: Path, evidence: DriverRecord, findings: Sequence[CheckResult], document: Mapping[str, Any]
) -> Path:
    """Write check.json, Parquet files, figures and report.html; returns the path of the last.

    Parameters
    ----------
    out : folder, existing
    evidence, findings : on a driver
    document : of `document_of`

    """
    write_json(out / DOCUMENT, document)
    _write_samples(out, evidence)
    figures = draw(evidence, out / 'figures')
    sections = []
    for group, title in GROUPS.items():
        rows = [
            {key: getattr(one, key) for key in SHOWN} | {'look': LOOKS[one.verdict]}
            for one in findings
            if CHECKS[one.id].group == group
        ]
        table = make_table(f'checks_{group}', f'{title}.', rows, SHOWN, anchor='check')
        drawn: list[Block] = [figures[name] for name in DRAWN.get(group, ()) if name in figures]
        sections.append(Section(group, title, [table, *drawn]))
    graph = evidence.graph
    about = (
        f'{graph.odom} and {graph.wrench} in {graph.place}, {evidence.log.seconds:.1f} s. '
        f'All numbers: {DOCUMENT}; what was heard: {SAMPLES}.'
    )
    sentences = [
        Sentence(f'{verdict.capitalize()}, {len(ids)}: {join(ids)}.')
        for verdict in (FAIL, NOT_CHECKED, PASS)
        if (ids := [one.id for one in findings if one.verdict == verdict])
    ]
    return write_document(out, 'Check of a vehicle driver', about, sentences, sections)


def _write_samples(out: Path, evidence: DriverRecord) -> None:
    log = evidence.log
    columns = {'arrived_ns': log.arrived_ns, 'stamp_ns': log.stamp_ns}
    columns |= dict(zip(STATE, log.x.T, strict=True))
    parquet.write_table(pa.table(columns), out / SAMPLES)
    if evidence.excitation is None:
        return
    steps = [(one.trial.dof, ns, *tau) for one in evidence.excitation.sent for ns, tau in one.steps]
    names = ('trial', 'sent_ns', *TAU)
    table = pa.table({name: [row[i] for row in steps] for i, name in enumerate(names)})
    parquet.write_table(table, out / WRENCHES)


def draw(evidence: DriverRecord, folder: Path) -> dict[str, FigureRecord]:
    """Draw what the evidence allows, as PNG and PDF: name -> figure."""
    drawn: dict[str, Callable[[], Drawn]] = {}
    if len(evidence.log.arrived_ns) >= FEW:
        drawn['timing'] = partial(_timing, evidence)
    if evidence.has_motion:
        drawn['linear'] = partial(_motion, evidence, 'Linear', slice(3), 'm/s')
        drawn['angular'] = partial(_motion, evidence, 'Angular', slice(3, 6), 'rad/s')
    if evidence.answered:
        drawn['answers'] = partial(_answers, evidence.answered)
    return save_figures(folder, drawn)


def _timing(evidence: DriverRecord) -> Drawn:
    log = evidence.log
    t = (log.arrived_ns - log.began_ns) / NANOSECONDS
    now, _ = reference_ns(evidence)
    ages = (now - log.stamp_ns) / NANOSECONDS
    ages = ages - np.nanmin(ages) if np.isfinite(ages).any() else np.zeros_like(ages)
    figure = plots.new_figure(2.4)
    left, right = figure.subplots(1, 2)
    apart = np.diff(np.sort(t)) * MS
    left.hist(apart, bins=BINS, range=(0.0, WIDER * float(np.max(apart))), color=COLOURS[0])
    left.set(xlabel='between two messages (ms)', ylabel='messages', yscale='log')
    right.plot(t, ages * MS, '.', markersize=2, color=COLOURS[0])
    right.set(xlabel='$t$ (s)', ylabel='older than the freshest (ms)')
    for i, axes in enumerate((left, right)):
        plots.letter(axes, i)
    title = 'When messages came'
    caption = (
        f'{title}: (a) times between arrivals; (b) age of each stamp beyond the smallest one, '
        'which grows or falls steadily where the two clocks drift apart.'
    )
    return figure, title, caption


def _motion(evidence: DriverRecord, word: str, half: slice, unit: str) -> Drawn:
    pair = evidence.rates[word.lower()]
    panels = [
        Panel(
            [
                Curve(pair.t, pair.path[:, i], 'by the pose', {'color': GREY, 'linewidth': 2.4}),
                Curve(pair.t, pair.velocity[:, i], 'twist', {'color': COLOURS[half][i]}),
            ],
            f'{dof} ({unit})',
        )
        for i, dof in enumerate(DOFS[half])
    ]
    figure = plots.time_panels(panels, height=1.1)
    title = f'{word} velocity by pose and twist'
    caption = (
        f'{title}: rates of the pose in body axes, and the twist, both through local polynomials '
        'of order 3; where they part, axes, sign or unit of the twist are not what they should be.'
    )
    return figure, title, caption


def _answers(trials: Sequence[MeasuredTrial]) -> Drawn:
    panels = []
    for measured in trials:
        trial, response = measured.trial, measured.response
        nu, late = measured.nu[:, trial.axis], response.t + response.delay
        curves = [
            Curve(measured.t, nu - nu[0], 'measured', {'color': COLOURS[trial.axis]}),
            Curve(late, response.form, 'fit', {'color': GREY, 'linestyle': '--'}),
        ]
        panels.append(Panel(curves, f'{trial.dof} ({trial.speed_unit})'))
    figure = plots.time_panels(panels, across=2)
    title = 'Answers to small wrenches'
    caption = (
        f'{title}: velocity since the beginning of each trial, and what the wrench adds to it by '
        'the fit, with its inertia, damping and delay; drift beside it is taken off.'
    )
    return figure, title, caption
