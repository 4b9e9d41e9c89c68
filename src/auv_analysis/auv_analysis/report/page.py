"""The report of runs: errors, energy and couplings along the paper's procedure."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from auv_analysis.output.text import join
from auv_analysis.report import paper
from auv_analysis.report.claim import Claim
from auv_analysis.report.claims import claims_table
from auv_analysis.report.contents import Contents
from auv_analysis.report.document import Section, Sentence
from auv_analysis.report.figures import draw_figures
from auv_analysis.report.findings import findings
from auv_analysis.report.interactive import interactive
from auv_analysis.report.rendering import write_document
from auv_analysis.report.set_up import set_up
from auv_analysis.report.sketch import Sketch
from auv_analysis.report.sketching import sketches
from auv_analysis.report.tables.claims import write_claims
from auv_analysis.runs.run import AnyRun

Texts = str | Mapping[str, str]


def write_report(
    out: Path,
    runs: Mapping[str, AnyRun | Sketch],
    summaries: dict[str, dict[str, Any]],
    scenario_text: Texts,
    vehicle_text: Texts,
    *,
    claims: Sequence[Claim] | None = None,
    more: Mapping[str, Sequence[Section]] | None = None,
    sentences: Sequence[Sentence] = (),
) -> Path:
    """Write the report and its figures.

    Parameters
    ----------
    out : folder; gets `report.html`, `numbers.parquet`, `figures/` and, of the paper's cases,
        `claims.parquet`
    runs : name -> run, one at least
    summaries : name -> `summarize(run)`
    scenario_text, vehicle_text : the files as they were read, shown as listings: one of all runs,
        or name -> that of a run; may be empty
    claims : the paper's claims; none: those that these runs decide
    more : name of a section -> sections that follow it
    sentences : that the summary says beside those on the runs

    Returns
    -------
    path : of report.html

    """
    if not runs:
        raise ValueError('runs: expected at least one run, found none')
    shown = {name: replace(run, controller=name) for name, run in sketches(runs).items()}
    scenes = {
        names: set_up({name: shown[name] for name in names}, summaries, text)
        for names, text in _shared_by(shown, scenario_text)
    }
    limits = {name: scene.limit for names, scene in scenes.items() for name in names}
    figures = draw_figures(shown, out / 'figures', summaries, limits)
    judged = claims_table(shown, summaries) if claims is None else claims
    if judged:
        write_claims(out, judged)
    panels = interactive(shown)
    sections = Contents(shown, summaries, scenes, figures, judged, panels.sets).sections()
    scenarios = list(dict.fromkeys(run.scenario for run in shown.values()))
    vehicles = list(dict.fromkeys(run.vehicle.name for run in shown.values()))
    return write_document(
        out,
        f'Velocity tracking in generalised velocity components: {join(scenarios)}',
        f'Vehicle {join(vehicles)}; controllers {join(list(shown))}; after {paper.CITATION}.',
        [*findings(shown, summaries, judged), *sentences],
        [section for one in sections for section in (one, *(more or {}).get(one.name, ()))],
        [
            *_listings(shown, 'Vehicle file', vehicle_text),
            *_listings(shown, 'Scenario file', scenario_text),
        ],
        panels,
    )


def _shared_by(runs: Mapping[str, Sketch], texts: Texts) -> list[tuple[tuple[str, ...], str]]:
    """Names of the runs that share a text, and that text."""
    if isinstance(texts, str):
        return [(tuple(runs), texts)]
    names: dict[str, list[str]] = {}
    for name in runs:
        names.setdefault(texts.get(name, ''), []).append(name)
    return [(tuple(members), text) for text, members in names.items()]


def _listings(runs: Mapping[str, Sketch], what: str, texts: Texts) -> list[tuple[str, str]]:
    """Texts that are not empty, each with the runs that it is of where there are several."""
    shared = _shared_by(runs, texts)
    return [
        (f'{what} of {join(names)}' if len(shared) > 1 else what, text)
        for names, text in shared
        if text
    ]
