"""Set-points as a controller in real time follows them: the newest at or before each odometry.

A driver stamps its odometry when it measures, the set-points lie on a grid of their own: the two
have no stamps in common.
"""

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from auv_analysis.bag.contents import Contents, Series
from auv_dynamics.ros import interface

SETPOINTS = (interface.CMD_VEL, interface.CMD_ACCEL)
LATEST = 'latest'


def holds(contents: Contents, controller: Mapping[str, object]) -> bool:
    """Whether the recorded controller held its set-points.

    Parameters
    ----------
    contents : of the bag
    controller : parameters of the controller node; empty: not recorded

    """
    if 'setpoint_pairing' in controller:
        return controller['setpoint_pairing'] == LATEST
    return contents.lenient


def held_series(series: Mapping[str, Series]) -> dict[str, Series]:
    """The series, role -> stamps and rows, with set-points at the stamps of the odometry."""
    stamps = np.sort(series[interface.ODOM][0])
    return {role: _at(stamps, one) if role in SETPOINTS else one for role, one in series.items()}


def held_parts(parts: Iterable[tuple[str, Series]]) -> Iterator[tuple[str, Series]]:
    """The same of roles and what comes next of them, whose stamps rise."""
    asked: dict[str, list[np.ndarray]] = {role: [] for role in SETPOINTS}
    known: dict[str, Series] = {}
    for role, one in parts:
        if role in SETPOINTS:
            known[role] = _joined(known.get(role), one)
        else:
            yield role, one
        if role == interface.ODOM:
            for stamps in asked.values():
                stamps.append(one[0])
        yield from _answers(asked, known, finished=False)
    yield from _answers(asked, known, finished=True)


def _answers(
    asked: dict[str, list[np.ndarray]], known: dict[str, Series], *, finished: bool
) -> Iterator[tuple[str, Series]]:
    """Set-points of the stamps that no later set-point can change."""
    for role, one in known.items():
        if not asked[role]:
            continue
        stamps, newest = np.concatenate(asked[role]), int(one[0][-1])
        n = len(stamps) if finished else int(np.searchsorted(stamps, newest))
        asked[role] = [stamps[n:]] if n < len(stamps) else []
        if n:
            yield role, _at(stamps[:n], one)
            kept = max(0, int(np.searchsorted(one[0], stamps[n - 1], 'right')) - 1)
            known[role] = one[0][kept:], one[1][kept:]


def _at(stamps: np.ndarray, one: Series) -> Series:
    """Values of a series at stamps (n,), each that of the newest stamp at or before it."""
    order = np.argsort(one[0], kind='stable')
    index = np.searchsorted(one[0][order], stamps, 'right') - 1
    known = index >= 0
    return stamps[known], one[1][order][index[known]]


def _joined(first: Series | None, then: Series) -> Series:
    if first is None:
        return then
    return np.concatenate([first[0], then[0]]), np.concatenate([first[1], then[1]])
