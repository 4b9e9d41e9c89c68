"""Control authority: commanded wrench against the vehicle's weight and its thrusters' limits."""

from collections.abc import Iterator, Sequence

import numpy as np

from auv_analysis.metrics.quantities import SIGNALS
from auv_analysis.output.text import join, number
from auv_analysis.runs.run import Run
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.thrusters import Thrusters
from auv_dynamics.vehicle.vehicle import Vehicle

NOTHING = 1e-6  # of the largest command of its kind: rounding
INPUT = SIGNALS['tau']


def both_ways(run: Run) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest command of a run, (6,) each, N and N m; NaN: not recorded."""
    each = [(block.tau.min(axis=0), block.tau.max(axis=0)) for block in run.blocks()]
    low, high = zip(*each, strict=True)
    return np.min(low, axis=0), np.max(high, axis=0)


def beyond_authority(
    vehicle: Vehicle, largest: Sequence[float], ways: Sequence[np.ndarray] | None = None
) -> list[str]:
    """Remarks on the largest commands of a run, a phrase each; none where all is well.

    Parameters
    ----------
    vehicle : whose weight and thrusters are known, the latter where its file gives them
    largest : (6,) magnitudes of the command, N and N m; None: not recorded
    ways : its least and its largest values, (6,) each, NaN: not recorded; None: not known

    """
    largest = [0.0 if value is None else value for value in largest]
    found = list(_above_weight(float(vehicle.weight), largest))
    if vehicle.thrusters is not None:
        found += _without_actuators(vehicle.thrusters, largest)
        found += _above_thrust(vehicle.thrusters, largest, ways)
    return found


def _above_weight(weight: float, largest: Sequence[float]) -> Iterator[str]:
    i = int(np.argmax(largest[:3]))
    if largest[i] > weight:
        yield (
            f'the largest force commanded, {number(largest[i])} N in {DOFS[i]}, is '
            f'{number(largest[i] / weight, 2)} times the weight of the vehicle'
        )


def _without_actuators(thrusters: Thrusters, largest: Sequence[float]) -> Iterator[str]:
    asked = []
    for dof, others in thrusters.unactuated().items():
        i = DOFS.index(dof)
        if largest[i] > NOTHING * max(largest[:3] if i < 3 else largest[3:]):
            apart = f', not apart from {join(list(others))}' if others else ''
            asked.append(f'{dof} (up to {number(largest[i])} {INPUT.unit_of(i)}{apart})')
    if asked:
        yield (
            f'{join(asked)} {"is" if len(asked) == 1 else "are"} commanded, which no thruster '
            f'actuates: T has rank {thrusters.rank} of 6'
        )


def _above_thrust(
    thrusters: Thrusters, largest: Sequence[float], ways: Sequence[np.ndarray] | None
) -> Iterator[str]:
    lost, (astern, ahead) = thrusters.unactuated(), thrusters.both_ways()
    asked = []
    for i, dof in enumerate(DOFS):
        either = (largest[i], max(ahead[i], astern[i]))
        each = [] if ways is None else [(ways[0][i], -astern[i]), (ways[1][i], ahead[i])]
        above = [(tau, most) for tau, most in (either, *each)
                 if abs(tau) > abs(most) and tau * most >= 0.0]  # fmt: skip
        if dof not in lost and above:
            tau, most = above[0]
            asked.append(f'{number(tau)} of at most {number(most)} {INPUT.unit_of(i)} in {dof}')
    if asked:
        yield f'more is commanded than the thrusters can give: {join(asked)}'
