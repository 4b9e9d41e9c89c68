"""The report of a study: one HTML file that needs nothing but itself."""

import base64
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import jinja2
import markupsafe
import numpy as np

from auv_analysis.report import paper, tables
from auv_analysis.report.certificates import certificate_table
from auv_analysis.report.claims import claims_table
from auv_analysis.report.figures import FigureRecord, draw_figures, reference
from auv_analysis.report.findings import findings
from auv_analysis.report.set_up import set_up
from auv_analysis.report.sketch import Sketch
from auv_analysis.report.sketching import sketches
from auv_analysis.report.text import fixed, join, number, plain, tied
from auv_analysis.run import AnyRun
from auv_analysis.summary import BAND, SMALLEST_BAND
from auv_dynamics.signals import DOFS

Texts = str | Mapping[str, str]
HERE = Path(__file__).parent
SECTIONS = {  # section of the report -> beginnings of the names of its figures
    'errors': ('errors_', 'settling'),
    'estimates': ('lumped_error_', 'uncertainty_'),
    'inputs': ('inputs_',),
    'certificates': ('certificate_',),
    'energy': ('kinetic_energy', 'energy_shares'),
    'couplings': ('delta_',),
}


def write_report(
    out: Path,
    runs: Mapping[str, AnyRun | Sketch],
    summaries: dict[str, dict[str, Any]],
    scenario_text: Texts,
    vehicle_text: Texts,
) -> Path:
    """Write the report and its figures.

    Parameters
    ----------
    out : folder; gets `report.html` and `figures/`
    runs : name -> run, one at least
    summaries : name -> `summarize(run)`
    scenario_text, vehicle_text : the files as they were read, shown as listings: one of all runs,
        or name -> that of a run; may be empty

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
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {
        'num': number, 'plain': plain, 'fixed': fixed, 'tied': tied, 'join_words': join,
        'maths': maths,
    }  # fmt: skip
    template = environment.get_template('report.html.j2')
    context = _context(shown, summaries)
    text = template.render(
        **context,
        figures=_sections(figures),
        scenes=scenes,
        scenario_texts=_listings(shown, scenario_text),
        vehicle_texts=_listings(shown, vehicle_text),
    )
    path = out / 'report.html'
    path.write_text(text + '\n', encoding='utf-8')
    return path


def _shared_by(runs: Mapping[str, Sketch], texts: Texts) -> list[tuple[tuple[str, ...], str]]:
    """Names of the runs that share a text, and that text."""
    if isinstance(texts, str):
        return [(tuple(runs), texts)]
    names: dict[str, list[str]] = {}
    for name in runs:
        names.setdefault(texts.get(name, ''), []).append(name)
    return [(tuple(members), text) for text, members in names.items()]


def _listings(runs: Mapping[str, Sketch], texts: Texts) -> list[tuple[str, str]]:
    """Texts that are not empty, each with the runs that it is of where there are several."""
    shared = _shared_by(runs, texts)
    return [
        (f' of {join(names)}' if len(shared) > 1 else '', text) for names, text in shared if text
    ]


def maths(text: str) -> markupsafe.Markup:
    """Text with its indices lowered: w_X, K_D, ξ3; Lambda and Gamma become letters."""
    safe = str(markupsafe.escape(tied(text))).replace('Lambda', 'Λ').replace('Gamma', 'Γ')
    safe = safe.replace('omega', 'ω').replace('phi', 'φ')
    safe = re.sub(r'(?<=[A-Za-zτξπωΓΛ])_([A-Za-z0-9]|FF)\b', r'<sub>\1</sub>', safe)
    return markupsafe.Markup(re.sub(r'(?<=[ξπ])([1-6])\b', r'<sub>\1</sub>', safe))


def _context(
    runs: Mapping[str, Sketch], summaries: Mapping[str, Mapping[str, Any]]
) -> dict[str, Any]:
    """What the template prints, computed."""
    leading = reference(runs)
    claims = claims_table(runs, summaries)
    vehicles = list(dict.fromkeys(run.vehicle.name for run in runs.values()))
    original = paper.paper_run(runs, 'gvc')
    return {
        'dofs': DOFS,
        'runs': runs,
        'summaries': summaries,
        'scenarios': list(dict.fromkeys(run.scenario for run in runs.values())),
        'vehicles': vehicles,
        'is_herman': any(name.startswith('herman2018') for name in vehicles),
        'leading': leading,
        'findings': findings(runs, summaries, claims),
        'controllers': [tables.controller_row(run) for run in runs.values()],
        'decompositions': tables.decompositions(runs, summaries),
        'body_gains': tables.body_gains(summaries),
        'energy': tables.energy_rows(runs, original),
        'has_original': original is not None,
        'certificates': certificate_table(summaries),
        'laws': {run.law for run in runs.values()},
        'without_estimate': [n for n, run in runs.items() if not run.estimates],
        'commanded': any(run.acting for run in runs.values()),
        'couplings': tables.couplings(runs, summaries),
        'claims': claims,
        'ends': {name: run.end[:3] for name, run in runs.items()},
        'ends_apart': _ends_apart(runs),
        'notes': tables.notes(runs),
        'band': f'{100 * BAND:g} % of the peak of the set-point, at least {SMALLEST_BAND:g}',
        'paper': paper,
    }


def _ends_apart(runs: Mapping[str, Sketch]) -> float | None:
    """Largest distance of the final positions of runs of equal length, m; None for one run."""
    ends = [run.end[:3] for run in runs.values()]
    if len(ends) < 2 or len({run.samples for run in runs.values()}) > 1:
        return None
    return max(float(np.linalg.norm(a - b)) for a in ends for b in ends)


def _sections(figures: list[FigureRecord]) -> dict[str, list[dict[str, Any]]]:
    """Figures by section, numbered in the order in which the report shows them."""
    sections: dict[str, list[dict[str, Any]]] = {}
    shown = 0
    for section, beginnings in SECTIONS.items():
        sections[section] = []
        for figure in figures:
            if not figure.name.startswith(beginnings):
                continue
            entry: dict[str, Any] = {'figure': figure, 'number': None, 'data': None}
            if figure.png is not None:
                shown += 1
                data = base64.b64encode(figure.png.read_bytes()).decode('ascii')
                entry |= {'number': shown, 'data': data}
            sections[section].append(entry)
    return sections
