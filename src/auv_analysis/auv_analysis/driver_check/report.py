"""What `auv check-driver` leaves: the report, the document, and what was heard and sent."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa
from pyarrow import parquet

from auv_analysis.driver_check.catalogue import CHECKS, GROUPS
from auv_analysis.driver_check.figures import draw
from auv_analysis.driver_check.finding import FAIL, NOT_CHECKED, PASS, Finding
from auv_analysis.driver_check.outcome import DOCUMENT, Result
from auv_analysis.output.new_files import write_json
from auv_analysis.output.text import join
from auv_analysis.report.document import Block, Cell, Column, Section, Sentence, Table
from auv_analysis.report.rendering import write_document

SAMPLES, WRENCHES = 'samples.parquet', 'wrenches.parquet'
STATE = ('x', 'y', 'z', 'qw', 'qx', 'qy', 'qz', 'u', 'v', 'w', 'p', 'q', 'r')
TAU = ('X', 'Y', 'Z', 'K', 'M', 'N')
LOOKS = {PASS: 'good', FAIL: 'bad', NOT_CHECKED: ''}
COLUMNS = [
    Column('check', numeric=False),
    Column('verdict', numeric=False),
    Column('expected', numeric=False),
    Column('found', numeric=False),
]
DRAWN = {'time': ('timing',), 'motion': ('linear', 'angular'), 'response': ('answers',)}


def write_results(out: Path, result: Result, document: Mapping[str, Any]) -> Path:
    """Write check.json, Parquet files, figures and report.html; returns the path of the last.

    Parameters
    ----------
    out : folder, existing
    result : of `judged`
    document : of `document_of`

    """
    write_json(out / DOCUMENT, document)
    _write_samples(out, result)
    figures = draw(result, out / 'figures')
    sections = []
    for group, title in GROUPS.items():
        found = [one for one in result.findings if CHECKS[one.id].group == group]
        drawn: list[Block] = [figures[name] for name in DRAWN.get(group, ()) if name in figures]
        sections.append(Section(group, title, [_table(group, title, found), *drawn]))
    scene = result.scene
    about = (
        f'{scene.odom} and {scene.wrench} in {scene.place}, {result.recording.seconds:.1f} s. '
        f'All numbers: {DOCUMENT}; what was heard: {SAMPLES}.'
    )
    return write_document(out, 'Check of a vehicle driver', about, _sentences(result), sections)


def _table(group: str, title: str, findings: list[Finding]) -> Table:
    rows = [
        (
            Cell(one.id, anchor=one.id),
            Cell(one.verdict, kind=LOOKS[one.verdict]),
            Cell(one.expected),
            Cell(one.found, figures=_figures(one), remark=one.advice),
        )
        for one in findings
    ]
    return Table(f'checks_{group}', f'{title}.', COLUMNS, rows)


def _figures(finding: Finding) -> dict[str, float]:
    return {
        name: float(value)
        for name, value in finding.numbers.items()
        if value is not None and math.isfinite(value)
    }


def _sentences(result: Result) -> list[Sentence]:
    parts = []
    for verdict in (FAIL, NOT_CHECKED, PASS):
        found = [one.id for one in result.findings if one.verdict == verdict]
        if found:
            parts.append(Sentence(f'{verdict.capitalize()}, {len(found)}: {join(found)}.'))
    return parts


def _write_samples(out: Path, result: Result) -> None:
    heard = result.recording
    columns = {'arrived_ns': heard.arrived_ns, 'stamp_ns': heard.stamp_ns}
    columns |= dict(zip(STATE, heard.x.T, strict=True))
    parquet.write_table(pa.table(columns), out / SAMPLES)
    if result.actuation is None:
        return
    steps = [(one.trial.dof, ns, *tau) for one in result.actuation.sent for ns, tau in one.steps]
    names = ('trial', 'sent_ns', *TAU)
    table = pa.table({name: [row[i] for row in steps] for i, name in enumerate(names)})
    parquet.write_table(table, out / WRENCHES)
