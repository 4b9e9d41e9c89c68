"""The whole of a design: what is coupled, which change helps, and what it does."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from auv_analysis.design.comparison import HALF, Candidate, Comparison
from auv_analysis.design.couplings import COUPLINGS, REST, Sizes, coupling_named, present
from auv_analysis.design.search import parts_of
from auv_analysis.design.setting import Setting
from auv_analysis.runs.run import Run

STARTS = 4  # of a search for the proposal
FEW = 1  # of one for the table of what helps against the other couplings

Told = Callable[[int, int], None]  # how many couplings are done, and of how many


@dataclass(frozen=True, eq=False)
class Proposal:
    """What was found of a vehicle in a setting.

    Attributes
    ----------
    setting : the experiment
    there : couplings that the structure of M allows
    run, before : of the unchanged vehicle; None where nothing is coupled
    target : place in `COUPLINGS` of the coupling to reduce; None: there is nothing to reduce
    asked : name of the coupling that was asked for, or None
    candidates : changes that were simulated, those for the target first
    best : the proposal, None where no change lowers the coupling

    """

    setting: Setting
    there: list[str]
    asked: str | None
    run: Run | None = None
    before: Sizes | None = None
    target: int | None = None
    candidates: tuple[Candidate, ...] = ()
    best: Candidate | None = None


def propose(setting: Setting, reduce: str | None, told: Told = lambda done, of: None) -> Proposal:
    """Find the change of a vehicle that removes a coupling, and what removes the others.

    Parameters
    ----------
    setting : the experiment
    reduce : name of a coupling; none: the one with the largest share, see `shares_of`
    told : called whenever the changes against one coupling were simulated

    Raises
    ------
    InputError : no coupling of that name
    DivergedError : the unchanged vehicle cannot be run

    """
    there = present(setting.space.vehicle)
    asked = None if reduce is None else coupling_named(reduce, there)
    if not there or (asked is not None and asked not in there):
        return Proposal(setting, there, asked)
    run, before = setting.simulated(setting.space.unchanged)
    target = int(np.argmax(before.shares)) if asked is None else COUPLINGS.index(asked)
    if before.shares[target] < REST:
        return Proposal(setting, there, asked, run, before)
    comparison = Comparison(setting, run, before)
    others = [k for k in comparison.targets() if k != target] if setting.is_quick else []
    told(0, 1 + len(others))
    found = list(comparison.candidates(target, STARTS))
    if all(one.ratio is None or one.ratio > HALF for one in found):
        found.append(comparison.at_any_cost(target, STARTS))
    best = comparison.refined(min(found, key=lambda one: one.rank))
    if best not in found:
        found.append(best)
    for i, k in enumerate(others):
        told(1 + i, 1 + len(others))
        found += comparison.candidates(k, FEW)
    told(1 + len(others), 1 + len(others))
    helps = best.ratio is not None and best.ratio < 1 and parts_of(best.x)
    return Proposal(
        setting, there, asked, run, before, target, tuple(found), best if helps else None
    )
