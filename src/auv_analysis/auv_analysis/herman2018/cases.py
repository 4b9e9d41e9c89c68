"""All 21 claims in a study of one of the paper's cases, the other one simulated too."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from auv_analysis.herman2018 import paper
from auv_analysis.herman2018.claims import judged
from auv_analysis.herman2018.evidence import BOTH, Claim, ErrorSensitivity, Evidence
from auv_analysis.herman2018.responses import response
from auv_analysis.report.digest import RunDigest, digests
from auv_analysis.report.document import Sentence
from auv_analysis.runs.run import Hold, Run
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scenario import SAMPLED, Scenario, load_scenario
from auv_analysis.simulation.simulate import DivergedError, simulate
from auv_analysis.studies.study.sensitivity import Sensitivity, sensitivity
from auv_gvc_controller.laws.model import control_model

COMPARED = ('duration', 'step', 'integrator', 'initial', 'setpoint', 'disturbance')
SENSITIVE_CASE = 'case1'  # whose gains the claim on sensitivity is of


@dataclass(frozen=True)
class PaperClaims:
    """The claims table of a study.

    Attributes
    ----------
    claims : 21, or none where the scenario is none of the paper's cases
    departures : what the scenario has other than the shipped one of its name: path, ours, shipped
    reason : why there are no claims; empty where there are

    """

    claims: tuple[Claim, ...]
    departures: tuple[tuple[str, Any, Any], ...] = ()
    reason: str = ''


def paper_claims(
    scenario: Scenario,
    runs: Mapping[str, Run | RunDigest],
    sensitivities: Mapping[str, Sensitivity] | None = None,
    *,
    hold: Hold = 'continuous',
    threads: int = 1,
) -> PaperClaims:
    """Judge every claim of the paper in a study of case1 or case2.

    Both cases are the scenario with the paper's gains: what is changed in a scenario is changed in
    either case, and named. Runs that the study has are taken, others are simulated.

    Parameters
    ----------
    scenario : of the study
    runs : controller -> its run or digest
    sensitivities : controller -> how its figures follow its gains; what is missing is made
    hold : of the runs that are simulated
    threads : for the rollouts of a sensitivity

    """
    if scenario.name not in paper.CASES:
        return PaperClaims((), reason=f'{scenario.name} is no case of the paper')
    has = [key for key in ('excitation', *SAMPLED) if key in scenario.data]
    has += sorted(scenario.kinds - {'herman2018'})
    if has or 'file' in scenario.data['setpoint']:
        words = ', '.join([key.replace('_', ' ') for key in has] or ['a set-point from a file'])
        return PaperClaims((), reason=f'the scenario has {words}, which the paper’s have not')
    departures = tuple(departures_of(scenario))
    evidence = {}
    for case in (scenario.name, *(name for name in paper.CASES if name != scenario.name)):
        at_hand = runs if case == scenario.name else {}
        try:
            evidence[case] = case_evidence(case_of(scenario, case), at_hand, hold)
        except DivergedError as error:
            return PaperClaims((), departures, f'with the paper’s gains, {error}')
    known = _responses(scenario, runs, sensitivities or {}, hold, threads)
    evidence[SENSITIVE_CASE] = replace(evidence[SENSITIVE_CASE], responses=known)
    claims = judged(evidence)
    if departures:
        claims = [replace(claim, case=f'{claim.case}, changed') for claim in claims]
    return PaperClaims(tuple(claims), departures)


def case_of(scenario: Scenario, case: str) -> Scenario:
    """The same scenario under the name and with the gains of one of the paper's cases."""
    gains = {'gvc': paper.GVC_GAINS, 'cl': paper.CL_GAINS[case]}
    controllers = {law: {'law': law, **values} for law, values in gains.items()}
    return changed_scenario(scenario, {'name': case, 'controllers': controllers})


def case_evidence(
    case: Scenario,
    at_hand: Mapping[str, Run | RunDigest] | None = None,
    hold: Hold = 'continuous',
) -> Evidence:
    """Evidence of one of the paper's cases, from runs at hand where they have its gains."""
    found = {law: paper.paper_run(at_hand or {}, law) for law in BOTH}
    runs = {law: run or simulate(case, law, hold) for law, run in found.items()}
    return Evidence(digests(runs), tuple(control_model(case.vehicle).N.tolist()))


def departures_of(scenario: Scenario) -> Iterator[tuple[str, Any, Any]]:
    """Differences to the shipped scenario of the same name: path, its value, the shipped."""
    shipped = load_scenario(scenario.name)
    for key in COMPARED:
        yield from _differences(key, scenario.data[key], shipped.data[key])
    ours, theirs = scenario.vehicle_data, shipped.vehicle_data
    for key in dict.fromkeys([*ours, *theirs]):
        if key not in ('name', 'source', 'format'):
            yield from _differences(f'vehicle.{key}', ours.get(key), theirs.get(key))


def _differences(path: str, ours: Any, theirs: Any) -> Iterator[tuple[str, Any, Any]]:
    if isinstance(ours, Mapping) and isinstance(theirs, Mapping):
        for key in dict.fromkeys([*ours, *theirs]):
            yield from _differences(f'{path}.{key}', ours.get(key), theirs.get(key))
    elif ours != theirs:
        yield path, ours, theirs


def _responses(
    scenario: Scenario,
    runs: Mapping[str, Run | RunDigest],
    sensitivities: Mapping[str, Sensitivity],
    hold: Hold,
    threads: int,
) -> dict[str, ErrorSensitivity]:
    """What the errors follow, by law; without a law whose loops do not all run."""
    case = case_of(scenario, SENSITIVE_CASE)
    known: dict[str, ErrorSensitivity] = {}
    for law in BOTH:
        run = paper.paper_run(runs, law) if scenario.name == SENSITIVE_CASE else None
        found = sensitivities.get(run.controller) if run else None
        found = found or sensitivity(case, law, hold=hold, threads=threads)
        answer = response(case, law, found, hold)
        if answer is not None:
            known[law] = answer
    return known


def claims_sentences(found: PaperClaims) -> list[Sentence]:
    """Note on the scenario beside the table of claims; nothing for a shipped one."""
    if found.reason:
        return [Sentence(f'The paper’s claims are not judged: {found.reason}.')]
    changes = [f'{path} = {ours} (shipped: {theirs})' for path, ours, theirs in found.departures]
    if not changes:
        return []
    text = 'The claims are judged on a changed scenario, either case with the same changes'
    return [Sentence(f'{text}: {"; ".join(changes)}.', 'table-claims')]
