"""The paper's claims and its kinetic energy over everything that it leaves open."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from auv_analysis.metrics.energy import kinetic_energy
from auv_analysis.report.claim import BOTH
from auv_analysis.report.claims import judged
from auv_analysis.report.evidence import Evidence, Response, Signals, Verdict
from auv_analysis.report.paper import CASES, CL_GAINS, GVC_GAINS
from auv_analysis.report.sketching import sketch
from auv_analysis.runs.run import Run
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.simulate import DivergedError, simulate
from auv_analysis.study.paper_claims import SENSITIVE_CASE, case_of, departures_of
from auv_analysis.study.unknowns import Variant, scenario_of, variants
from auv_analysis.study.unknowns_responses import responses_of
from auv_dynamics.files.errors import InputError
from auv_gvc_controller.laws.model import control_model

WINDOWS = (10.0, 30.0)  # s: how long the runs may have been
ENDS = np.arange(50, 301) / 10  # s: of the windows of the mean kinetic energy
CONTROLLERS = {  # of both cases, whose GVC is one and the same
    'gvc': {'law': 'gvc', **GVC_GAINS},
    **{case: {'law': 'cl', **gains} for case, gains in CL_GAINS.items()},
}
STEPS_OF_RESPONSES = 8  # what they count as in the progress, in variants


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Verdicts and energies of all variants.

    Attributes
    ----------
    variants : those whose loops all came to their end
    windows : s, lengths of the runs
    verdicts : (V, W, 21) of the claims
    ends : (K,) s, of the windows 0 to T
    energy : (V, K, 6) mean kinetic energy of GVC by component over these windows, J; (30)
    failed : variant -> why a loop of it did not come to its end

    """

    variants: tuple[Variant, ...]
    windows: tuple[float, ...]
    verdicts: np.ndarray
    ends: np.ndarray
    energy: np.ndarray
    failed: Mapping[Variant, str]


def unknowns(
    scenario: Scenario,
    *,
    seed: int = 0,
    threads: int = 1,
    progress: Callable[[int, int], None] | None = None,
    chosen: Sequence[Variant] | None = None,
) -> Unknowns:
    """Judge the paper's claims for every variant of what it leaves open.

    Parameters
    ----------
    scenario : case1 or case2 with the shipped vehicle, set-point and disturbance
    seed : of the points inside
    threads : for the rollouts
    progress : called with what is done and how much there is
    chosen : variants; none: `variants`

    Raises
    ------
    InputError : another scenario, or one that was changed

    """
    if scenario.name not in CASES:
        raise InputError(scenario.path, 'name', f'one of {", ".join(CASES)}', scenario.name)
    for path, found, expected in departures_of(scenario):
        if path != 'duration':
            raise InputError(scenario.path, path, f'{expected} as shipped', found)
    base = changed_scenario(scenario, {'duration': max(WINDOWS), 'controllers': CONTROLLERS})
    tried = tuple(variants(scenario, seed) if chosen is None else chosen)
    report = _Progress(progress, len(tried) + STEPS_OF_RESPONSES * len(WINDOWS))
    answers = []
    for window in WINDOWS:
        answers.append(responses_of(case_of(base, SENSITIVE_CASE), tried, window, threads))
        report.add(STEPS_OF_RESPONSES)
    kept, verdicts, energies, failed = [], [], [], {}
    for i, variant in enumerate(tried):
        try:
            varied = scenario_of(variant, base)
            runs = {name: simulate(varied, name) for name in CONTROLLERS}
        except DivergedError as error:
            failed[variant] = str(error)
        else:
            kept.append(variant)
            verdicts.append([
                _verdicts(runs, window, {law: of[law][i] for law in BOTH})
                for window, of in zip(WINDOWS, answers, strict=True)
            ])  # fmt: skip
            energies.append(_energies(runs['gvc']))
        report.add(1)
    return Unknowns(
        tuple(kept), WINDOWS, np.array(verdicts, object), ENDS, np.array(energies), failed
    )


Runs = Mapping[str, Run]  # name of `CONTROLLERS` -> run


def _verdicts(runs: Runs, window: float, responses: Mapping[str, Response | None]) -> list[Verdict]:
    """Verdicts of the 21 claims on the first seconds of the runs."""
    done = {}
    for name, run in runs.items():
        until = slice(0, round(window / run.step) + 1)
        done[name] = Signals(sketch(run.part(until), lines=False))
    N = tuple(control_model(runs['gvc'].vehicle).N.tolist())
    cases = {case: Evidence({'gvc': done['gvc'], 'cl': done[case]}, N) for case in CASES}
    known = {law: answer for law, answer in responses.items() if answer is not None}
    cases[SENSITIVE_CASE] = replace(cases[SENSITIVE_CASE], responses=known)
    return [claim.verdict for claim in judged(cases)]


def _energies(gvc: Run) -> np.ndarray:
    """Mean kinetic energies (K, 6) over 0 to each of `ENDS`, J."""
    model = control_model(gvc.vehicle)
    sums = np.cumsum(kinetic_energy(model.Upsilon_inv.reshape(6, 6), model.N, gvc.nu), axis=0)
    last = np.round(ENDS / gvc.step).astype(int)
    return sums[last] / (last + 1)[:, None]


class _Progress:
    """Tells a callback how far it is."""

    def __init__(self, tell: Callable[[int, int], None] | None, total: int):
        self._tell, self._total, self._done = tell, total, 0

    def add(self, steps: int) -> None:
        self._done += steps
        if self._tell:
            self._tell(self._done, self._total)
