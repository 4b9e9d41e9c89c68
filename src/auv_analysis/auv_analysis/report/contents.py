"""What the report of runs contains, section by section, along the paper's procedure."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from auv_analysis.report import paper, tables
from auv_analysis.report.claim import Claim
from auv_analysis.report.document import Block, Gallery, Section
from auv_analysis.report.figure_files import FigureRecord
from auv_analysis.report.figures import reference
from auv_analysis.report.panel import PanelSet
from auv_analysis.report.rendering import prose
from auv_analysis.report.set_up import SetUp
from auv_analysis.report.sketch import TINY, Sketch, alike
from auv_analysis.report.tables.controllers import notes
from auv_analysis.runs.run import FOREIGN

FIGURES = {  # part of the report -> beginnings of the names of its figures
    'errors': ('errors_', 'settling'),
    'estimates': ('lumped_error_', 'uncertainty_', 'unexplained_'),
    'inputs': ('inputs_',),
    'certificates': ('certificate_',),
    'energy': ('kinetic_energy', 'energy_shares'),
    'couplings': ('delta_',),
}
NO_F = 'The lumped uncertainty F of these runs is not known, so w is neither drawn nor tabulated.'
NO_CERTIFICATE = '(26) is the derivative of L in none of these runs, so nothing is drawn.'


@dataclass(frozen=True)
class Contents:
    """What the sections are made of.

    Attributes
    ----------
    runs, summaries : by name
    scenes : names of the runs that share a scenario -> what is said of it
    figures : all that were drawn
    claims : the paper's, none where they do not apply
    panels : part of the report -> its panels

    """

    runs: Mapping[str, Sketch]
    summaries: Mapping[str, Mapping[str, Any]]
    scenes: Mapping[tuple[str, ...], SetUp]
    figures: Sequence[FigureRecord]
    claims: Sequence[Claim]
    panels: Mapping[str, PanelSet]

    def sections(self) -> list[Section]:
        """All sections in their order."""
        found = [
            Section('experiment', 'Experiment', [*self._experiment()]),
            Section('gains', 'Step 1: the gains in the body frame', [*self._gains()]),
            Section('tracking', 'Steps 2 and 3: errors, estimates and inputs', [*self._tracking()]),
            Section('energy', 'Step 4: kinetic energy', [*self._energy()]),
            Section('couplings', 'Step 5: couplings', [*self._couplings()]),
        ]
        if self.claims:
            title = 'What the paper reports, and what these runs give'
            table = tables.claims_table(self.claims)
            found.append(Section('claims', title, [prose('claims'), table]))
        found.append(Section('basis', 'What this rests on', [*self._basis()]))
        return found

    def _drawn(self, part: str) -> list[FigureRecord]:
        return [figure for figure in self.figures if figure.name.startswith(FIGURES[part])]

    def _shown(self, part: str) -> Iterator[Block]:
        """Panels of a part with the figures that they stand for, then its other figures."""
        drawn, panels = self._drawn(part), self.panels.get(part)
        if panels is None:
            yield from drawn
            return
        stills = [figure for figure in drawn if figure.png and panels.stands_for(figure.name)]
        yield Gallery(panels, stills)
        yield from (figure for figure in drawn if figure not in stills)

    def _experiment(self) -> Iterator[Block]:
        scenarios = list(dict.fromkeys(run.scenario for run in self.runs.values()))
        commanded = any(run.acting for run in self.runs.values())
        foreign = any(run.source == FOREIGN for run in self.runs.values())
        same, other = self._shared()
        yield prose('experiment', same=same, other=other, commanded=commanded, foreign=foreign)
        yield tables.controllers_table(self.runs)
        several = len(self.scenes) > 1
        for number, (names, scene) in enumerate(self.scenes.items(), start=1):
            name = f'set_up_{number}' if several else 'set_up'
            yield tables.set_up_table(name, scene, names, several=several)
        if not several and scene.name and len(scenarios) > 1:
            yield 'The other scenarios’ files are not shown.'
        ends = {name: run.end[:3] for name, run in self.runs.items()}
        yield prose('position', ends=ends, ends_apart=_apart(self.runs))

    def _shared(self) -> tuple[list[str], list[str]]:
        """What all runs have in common, and in what they are known to differ."""
        runs = list(self.runs.values())
        if len(runs) < 2:
            return [], []
        alike_in = {
            'start': bool(np.ptp([run.begin for run in runs], axis=0).max() <= TINY),
            'set-point': alike(runs, 'nu_d'),
            'disturbance': True if self._share_disturbances(runs) else alike(runs, 'F'),
        }
        same = [word for word, is_same in alike_in.items() if is_same]
        return same, [word for word, is_same in alike_in.items() if is_same is False]

    def _share_disturbances(self, runs: Sequence[Sketch]) -> bool:
        """Whether the scenarios describe the same disturbances and faults of the same vehicle."""
        wanted = [(s.data.get('disturbance'), s.data.get('faults')) for s in self.scenes.values()]
        known = all(scene.data for scene in self.scenes.values())
        M = runs[0].vehicle.M
        same = all(np.array_equal(run.vehicle.M, M) for run in runs)
        return known and same and all(one == wanted[0] for one in wanted)

    def _gains(self) -> Iterator[Block]:
        laws = {run.law for run in self.runs.values()}
        yield prose('gains', laws=laws, scalar_gains=tables.scalar_gains(self.summaries))
        yield from tables.gains_tables(self.runs, self.summaries)

    def _tracking(self) -> Iterator[Block]:
        known = {name: run for name, run in self.runs.items() if run.knows_disturbance}
        without = [name for name, run in known.items() if not run.estimates]
        yield tables.key_figures_table(self.summaries, without)
        yield from self._shown('errors')
        if not known:
            yield NO_F
        yield from tables.unexplained_tables(self.summaries)
        yield from self._shown('estimates')
        yield from self._shown('inputs')
        yield prose('certificate', sampled=_sampled(self.summaries))
        certificate = tables.certificate_table(self.summaries)
        if certificate is not None:
            yield certificate
        for mark, names, text in tables.reasons(self.summaries):
            yield f'({mark}) {", ".join(names)}: {text}.'
        if not self._drawn('certificates'):
            yield NO_CERTIFICATE
        yield from self._shown('certificates')

    def _energy(self) -> Iterator[Block]:
        original = paper.paper_run(self.runs, 'gvc') is not None
        yield prose('energy', has_original=original)
        yield tables.energy_table(self.summaries, original=original)
        yield from self._shown('energy')

    def _couplings(self) -> Iterator[Block]:
        vehicles = tables.decompositions(self.runs, self.summaries)
        vehicle = vehicles[0]['vehicle'] if len(vehicles) > 1 else ''
        yield prose('couplings')
        yield tables.couplings_table(self.summaries, vehicle)
        leading = reference(self.runs).controller
        terms = tables.terms_table(leading, self.summaries[leading])
        if terms is not None:
            yield terms
        yield from self._shown('couplings')

    def _basis(self) -> Iterator[Block]:
        if any(run.vehicle.name.startswith('herman2018') for run in self.runs.values()):
            yield prose('readings')
        found = notes(self.runs)
        yield from found or ['The runs and their vehicle carry no notes.']


def _sampled(summaries: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Names of runs under zero-order hold whose identity is held against L."""
    entries = {name: summary['lyapunov'] for name, summary in summaries.items()}
    return [
        name
        for name, entry in entries.items()
        if entry.get('sampled') and entry.get('identity_residual') is not None
    ]


def _apart(runs: Mapping[str, Sketch]) -> float | None:
    """Largest distance of the final positions of runs alike, m; None for one run and for others.

    Alike are runs of equal length with the same start and the same set-point.
    """
    ends = [run.end[:3] for run in runs.values()]
    lengths = [run.duration for run in runs.values()]
    moved = np.ptp([run.begin for run in runs.values()], axis=0).max() > TINY
    if len(ends) < 2 or np.ptp(lengths) > TINY or moved or not alike([*runs.values()], 'nu_d'):
        return None
    return max(float(np.linalg.norm(a - b)) for a in ends for b in ends)
