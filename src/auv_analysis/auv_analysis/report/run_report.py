"""The report of runs: errors, energy and couplings along the paper's procedure."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.metrics.authority import beyond_authority
from auv_analysis.metrics.quantities import VELOCITY, WRENCH
from auv_analysis.metrics.settling import band_of
from auv_analysis.output.parallel import meanwhile
from auv_analysis.output.text import fixed, join, largest, number, plain, residuals
from auv_analysis.report import run_tables as tables
from auv_analysis.report.digest import (
    ESTIMATES,
    TINY,
    RunDigest,
    alike,
    digests,
    last_third,
    same_vehicle,
)
from auv_analysis.report.document import Block, Gallery, Section, Sentence, prose, write_document
from auv_analysis.report.panels import PanelSet, interactive
from auv_analysis.report.plots import GROUPS, FigureRecord
from auv_analysis.report.run_plots import draw_figures, reference
from auv_analysis.report.scenario_text import SetUp, set_up
from auv_analysis.report.verdict import verdict
from auv_analysis.report.wrench_plots import estimate_finding
from auv_analysis.runs.run import FOREIGN, Run
from auv_dynamics.vehicle import DOFS

Texts = str | Mapping[str, str]
Summaries = Mapping[str, Mapping[str, Any]]
FIGURES = {  # part of the report -> beginnings of the names of its figures
    'errors': ('errors_', 'settling'),
    'estimates': ('lumped_error_', 'uncertainty_', *(f'{kind}_' for kind in ESTIMATES)),
    'inputs': ('inputs_', 'compared_inputs'),
    'certificates': ('certificate_',),
    'energy': ('kinetic_energy', 'energy_shares'),
    'couplings': ('delta_',),
}
NO_F = 'The lumped uncertainty F of these runs is not known, so w is neither drawn nor tabulated.'
NO_CERTIFICATE = '(26) is the derivative of L in none of these runs, so nothing is drawn.'
RESTLESS = 10.0  # times that an error of noise crosses its own range in the last third of a run
_SEVERAL = 'do', 'their errors reach'


def write_report(
    out: Path,
    runs: Mapping[str, Run | RunDigest],
    summaries: Mapping[str, dict[str, Any]],
    scenario_text: Texts,
    vehicle_text: Texts,
    *,
    more: Mapping[str, Sequence[Section]] | None = None,
    sentences: Sequence[Sentence] = (),
) -> Path:
    """Write the report and its figures.

    Parameters
    ----------
    out : folder; gets `report.html`, `numbers.parquet` and `figures/`
    runs : name -> run, one at least
    summaries : name -> `summarize(run)`
    scenario_text, vehicle_text : the files as they were read, shown as listings: one of all runs,
        or name -> that of a run; may be empty
    more : name of a section -> sections of the caller that follow it
    sentences : that the summary says beside those on the runs

    Returns
    -------
    path : of report.html

    """
    if not runs:
        raise ValueError('runs: expected at least one run, found none')
    given = digests(runs)
    shown = {name: replace(run, controller=name) for name, run in given.items()}
    scenes = {
        names: set_up({name: given[name] for name in names}, summaries, text)
        for names, text in _shared_by(shown, scenario_text)
    }
    limits = {name: scene.limit for names, scene in scenes.items() for name in names}
    with meanwhile(partial(interactive, shown)) as made:
        figures = draw_figures(shown, out / 'figures', summaries, limits)
        panels = made()
    sections = SectionInputs(shown, summaries, scenes, figures, panels.sets).sections()
    scenarios = list(dict.fromkeys(run.scenario for run in shown.values()))
    vehicles = list(dict.fromkeys(run.vehicle.name for run in shown.values()))
    return write_document(
        out,
        f'Velocity tracking in generalised velocity components: {join(scenarios)}',
        f'Vehicle {join(vehicles)}; controllers {join(list(shown))}.',
        [*findings(shown, summaries), *sentences],
        [section for one in sections for section in (one, *(more or {}).get(one.name, ()))],
        [
            *_listings(shown, 'Vehicle file', vehicle_text),
            *_listings(shown, 'Scenario file', scenario_text),
        ],
        panels,
    )


def _shared_by(runs: Mapping[str, RunDigest], texts: Texts) -> list[tuple[tuple[str, ...], str]]:
    """Names of the runs that share a text, and that text."""
    of_runs = ((name, texts if isinstance(texts, str) else texts.get(name, '')) for name in runs)
    return [(tuple(names), text) for names, text in tables.shared(of_runs)]


def _listings(runs: Mapping[str, RunDigest], what: str, texts: Texts) -> list[tuple[str, str]]:
    """Texts that are not empty, each with the runs that it is of where there are several."""
    shared = _shared_by(runs, texts)
    return [
        (f'{what} of {join(names)}' if len(shared) > 1 else what, text)
        for names, text in shared
        if text
    ]


@dataclass(frozen=True)
class SectionInputs:
    """Data of the sections.

    Attributes
    ----------
    runs, summaries : by name
    scenes : names of the runs that share a scenario -> what is said of it
    figures : all that were drawn
    panels : part of the report -> its panels

    """

    runs: Mapping[str, RunDigest]
    summaries: Mapping[str, Mapping[str, Any]]
    scenes: Mapping[tuple[str, ...], SetUp]
    figures: Sequence[FigureRecord]
    panels: Mapping[str, PanelSet]

    def sections(self) -> list[Section]:
        """All sections in their order."""
        return [
            Section('experiment', 'Experiment', [*self._experiment()]),
            Section('gains', 'Step 1: the gains in the body frame', [*self._gains()]),
            Section('tracking', 'Steps 2 and 3: errors, estimates and inputs', [*self._tracking()]),
            Section('energy', 'Step 4: kinetic energy', [*self._energy()]),
            Section('couplings', 'Step 5: couplings', [*self._couplings()]),
            Section('basis', 'What this rests on', [*self._basis()]),
        ]

    def _drawn(self, part: str) -> list[FigureRecord]:
        return [figure for figure in self.figures if figure.name.startswith(FIGURES[part])]

    def _shown(self, part: str) -> Iterator[Block]:
        """Figures of a part, then its panels with those figures that they stand for."""
        drawn, panels = self._drawn(part), self.panels.get(part)
        stills = [one for one in drawn if one.png and panels and panels.stands_for(one.name)]
        yield from (figure for figure in drawn if figure not in stills)
        if panels is not None:
            yield Gallery(panels, stills)

    def _experiment(self) -> Iterator[Block]:
        scenarios = list(dict.fromkeys(run.scenario for run in self.runs.values()))
        commanded = any(run.acting for run in self.runs.values())
        foreign = any(run.source == FOREIGN for run in self.runs.values())
        same, other = self._shared()
        yield prose('experiment', same=same, other=other, commanded=commanded, foreign=foreign)
        yield tables.controllers_table(self.runs)
        several = len(self.scenes) > 1
        for index, (names, scene) in enumerate(self.scenes.items(), start=1):
            name = f'set_up_{index}' if several else 'set_up'
            yield tables.set_up_table(name, scene, names, several=several)
        if not several and scene.name and len(scenarios) > 1:
            yield 'The other scenarios’ files are not shown.'
        ends = {n: run.end[:3] for n, run in self.runs.items() if not np.isnan(run.end[:3]).all()}
        yield prose('position', ends=ends, ends_apart=_apart(self.runs))

    def _shared(self) -> tuple[list[str], list[str]]:
        """Common settings of all runs, and their known differences."""
        runs = list(self.runs.values())
        if len(runs) < 2:
            return [], []
        apart = np.ptp([run.begin for run in runs], axis=0)
        alike_in = {
            'start': False if np.any(apart > TINY) else None if np.isnan(apart).any() else True,
            'set-point': alike(runs, 'nu_d'),
            'disturbance': True if self._share_disturbances(runs) else alike(runs, 'F'),
        }
        same = [word for word, is_same in alike_in.items() if is_same]
        return same, [word for word, is_same in alike_in.items() if is_same is False]

    def _share_disturbances(self, runs: Sequence[RunDigest]) -> bool:
        """Whether the scenarios describe the same disturbances and faults of the same vehicle."""
        wanted = [(s.data.get('disturbance'), s.data.get('faults')) for s in self.scenes.values()]
        known = all(scene.data for scene in self.scenes.values())
        return known and same_vehicle(runs) and all(one == wanted[0] for one in wanted)

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
        estimates = (tables.estimate_table(self.summaries, kind) for kind in ESTIMATES)
        yield from (table for table in estimates if table is not None)
        yield from self._shown('estimates')
        yield from self._shown('inputs')
        yield prose('certificate', sampled=_sampled(self.summaries))
        certificate = tables.certificate_table(self.summaries)
        if certificate is not None:
            yield certificate
        yield from tables.reasons(self.summaries)
        if not self._drawn('certificates'):
            yield NO_CERTIFICATE
        yield from self._shown('certificates')

    def _energy(self) -> Iterator[Block]:
        yield prose('energy')
        yield tables.energy_table(self.summaries)
        components = tables.components_table(self.summaries)
        if components is not None:
            yield components
        yield from self._shown('energy')

    def _couplings(self) -> Iterator[Block]:
        vehicles = tables.decompositions(self.runs, self.summaries)
        vehicle = self.runs[vehicles[0][0][0]].vehicle.name if len(vehicles) > 1 else ''
        yield prose('couplings')
        yield tables.couplings_table(self.summaries, vehicle)
        leading = reference(self.runs).controller
        terms = tables.terms_table(leading, self.summaries[leading])
        if terms is not None:
            yield terms
        yield from self._shown('couplings')

    def _basis(self) -> Iterator[Block]:
        found = tables.notes(self.runs)
        yield from found or ['The runs and their vehicle carry no notes.']


def _sampled(summaries: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Names of runs under zero-order hold whose identity is held against L."""
    entries = {name: summary['lyapunov'] for name, summary in summaries.items()}
    return [
        name
        for name, entry in entries.items()
        if entry.get('sampled') and entry.get('identity_residual') is not None
    ]


def _apart(runs: Mapping[str, RunDigest]) -> float | None:
    """Largest distance of the final positions of runs alike, m; None for one run and for others.

    Alike are runs of equal length with the same start and the same set-point.
    """
    ends = [run.end[:3] for run in runs.values()]
    lengths = [run.duration for run in runs.values()]
    moved = not np.ptp([run.begin for run in runs.values()], axis=0).max() <= TINY  # or unknown
    if len(ends) < 2 or np.ptp(lengths) > TINY or moved or not alike([*runs.values()], 'nu_d'):
        return None
    return max(float(np.linalg.norm(a - b)) for a in ends for b in ends)


def findings(runs: Mapping[str, RunDigest], summaries: Summaries) -> list[Sentence]:
    """Sentences of the summary, each with a number that decides something.

    Parameters
    ----------
    runs, summaries : by name

    Returns
    -------
    sentences : verdict of several runs, or errors and inputs of one; settling, energy, couplings;
        what is not known is left out

    """
    leading = reference(runs)
    mine = summaries[leading.controller]
    metrics = 'table-key_figures'
    ranked = verdict(runs, summaries)
    found = [Sentence(text, metrics) for text in ranked]
    found += [Sentence(text, 'experiment') for text in namesakes([*runs.values()])]
    found += [Sentence(_settling(n, run, summaries[n]), metrics) for n, run in runs.items()]
    if not ranked:
        late = {n: s['velocity_error']['max_after_2s'] or [None] * 6 for n, s in summaries.items()}
        commands = {n: s['effort']['max'] for n, s in summaries.items()}
        texts = (
            _reached('After 2 s the errors reach at most', late, VELOCITY, 2),
            _reached('The largest commands are', commands, WRENCH, 3),
        )
        found += [Sentence(text, metrics) for text in texts]
    for name, run in runs.items():
        tau, most = run.part('tau'), summaries[name]['effort']['max']
        if remarks := beyond_authority(run.vehicle, most, (tau.low, tau.high)):
            found.append(Sentence(f'Under {name} {"; ".join(remarks)}.', metrics))
    found += [Sentence(_applied(runs), 'figure-compared_inputs')]
    found += [
        Sentence(estimate_finding(n, s), f'table-{ESTIMATES[s["unexplained"] is None]}')
        for n, s in summaries.items()
    ]
    found += [Sentence(_energy(leading, mine), 'table-energy')]
    found += [Sentence(_couplings(mine, leading), 'table-couplings')]
    return [sentence for sentence in found if sentence.text]


def namesakes(runs: Sequence[RunDigest]) -> list[str]:
    """Note on runs whose scenarios have one name and other set-points."""
    groups: dict[str, list[RunDigest]] = {}
    for run in runs:
        groups.setdefault(run.scenario, []).append(run)
    return [
        f'Not all {len(group)} runs of {name} have the same set-point: only the name is the same.'
        for name, group in groups.items()
        if alike(group, 'nu_d') is False
    ]


def _settling(name: str, run: RunDigest, summary: Mapping[str, Any]) -> str:
    times = summary['velocity_error']['settling_time']
    if times is None:
        return f'Of {name} no set-point is known, and so no error.'
    known = [i for i, x in enumerate(summary['settling']['residual']) if x is not None]
    missing = [i for i in known if times[i] is None]
    if not known:
        return f'Of {name} no axis has both a set-point and a velocity, and so no error is known.'
    if not missing:
        every = 'every velocity error' if len(known) == 6 else 'every velocity error that is known'
        return f'Under {name} {every} has settled after {max(times[i] for i in known):.2f} s.'
    noisy = [i for i in missing if _is_noise(run, i)]
    reached = residuals(summary)
    parts = []
    if still := [i for i in missing if i not in noisy]:
        verb, whose = ('does', 'its error reaches') if len(still) == 1 else _SEVERAL
        last = plain(summary['settling']['dwell'])
        parts.append(
            f'{join([DOFS[i] for i in still])} {verb} not settle within {run.duration:g} s: '
            f'in the last {last} s {whose} {join([reached[i] for i in still])}'
        )
    if noisy:
        floors = join([f'{reached[i]} in {DOFS[i]}' for i in noisy])
        parts.append(
            f'the error is within its noise floor of {floors}, wider than the settling band'
        )
    return f'Under {name}, {"; ".join(parts)}.'


def _is_noise(run: RunDigest, i: int) -> bool:
    """Whether a measured error fluctuates about a mean that lies in the band."""
    late, band = run.part('error', last_third(run)), band_of(run.part('nu_d').peak)
    measured = run.sensing or run.acceleration is not None
    return measured and abs(late.mean[i]) <= band[i] and late.path[i] >= RESTLESS * late.span[i]


def _reached(
    words: str, values: Mapping[str, Sequence[float | None]], units: Sequence[str], digits: int
) -> str:
    """Largest linear and angular value of each run with its axis, as far as they are known."""
    parts = []
    for name, six in values.items():
        found = [i for members in GROUPS if (i := largest(six, members)) is not None]
        texts = [f'{number(six[i], digits)} {units[i // 3]} ({DOFS[i]})' for i in found]
        parts += [f'{join(texts)} under {name}'] if texts else []
    return f'{words} {"; ".join(parts)}.' if parts else ''


def _applied(runs: Mapping[str, RunDigest]) -> str:
    """Effect of the actuators on the commands, for runs that have any."""
    parts = []
    for name, run in runs.items():
        if run.acting:
            peak = run.part('applied').peak
            force, moment = peak[:3].max(), peak[3:].max()
            parts.append(f'{number(force)} N and {number(moment)} N m under {name}')
    return f'The actuators deliver at most {"; ".join(parts)}.' if parts else ''


def _energy(leading: RunDigest, summary: Mapping[str, Any]) -> str:
    if leading.unknown:
        lacking = join(leading.unknown)
        return (
            f'Of {leading.controller} no velocity in {lacking} was recorded: what rests on it, the '
            'total kinetic energy before all, is not known.'
        )
    entries = summary['kinetic_energy_windows'][:2]
    means = [
        f'{fixed(entry["mean"], 2)} J over {entry["window"][0]:g}–{entry["window"][1]:g} s'
        for entry in entries
        if entry['mean'] is not None and entry['window'][0] == entries[0]['window'][0]
    ]
    return f'The mean kinetic energy of {leading.controller} is {join(means)}.' if means else ''


def _couplings(summary: Mapping[str, Any], leading: RunDigest) -> str:
    coupling = summary['coupling']
    if all(len(zeros) == 6 for zeros in coupling['structural_zeros'].values()):
        return 'M is diagonal: no degree of freedom is coupled to another by inertia.'
    xi, pi = coupling['delta_xi_max'], coupling['delta_pi_max']
    parts = [
        f'{symbol} of {DOFS[i]} by up to {number(values[i], 2)} {unit}'
        for symbol, values, unit, members in (
            ('the velocity component', xi, 'm/s', range(3)),
            ('the velocity component', xi, 'rad/s', range(3, 6)),
            ('the input', pi, 'N', range(3)),
            ('the input', pi, 'N m', range(3, 6)),
        )
        for i in [largest(values, members)]
        if i is not None and values[i] > 0
    ]
    return f'Inertial coupling deforms, under {leading.controller}, {join(parts)}.' if parts else ''
