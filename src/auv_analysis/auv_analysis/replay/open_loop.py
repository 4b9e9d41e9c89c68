"""A law on recorded odometry: what it would have commanded, had it been asked.

The loop is open: the vehicle moved as the recorded wrench made it move, whatever this law says.
Messages go through the very controller that the node runs, in the order in which a node needs them.
"""

import heapq
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.bag import attached
from auv_analysis.bag.contents import Contents, NotOursError, Series
from auv_analysis.bag.reading import read_bag
from auv_analysis.bag.steps import topics_of_one_graph
from auv_analysis.node_parameters import CONTROLLER
from auv_analysis.replay.recorded_controller import RecordedController
from auv_dynamics import interface
from auv_gvc_controller.controller import Answer, VelocityController
from auv_gvc_controller.pairing import Pairing

Progress = Callable[[int], None]


@dataclass(frozen=True, eq=False)
class RecordedLoop:
    """What a controller was told, and what it said to it.

    Attributes
    ----------
    series : our name of a topic -> stamps (n,) in ns and values; `odom` (n, 13), others (n, 6)
    controller : its law, gains and limits
    scenario, name : of the scenario and of the controller
    notes : what is odd, one line each

    """

    series: Mapping[str, Series]
    controller: RecordedController
    scenario: str
    name: str
    notes: tuple[str, ...] = field(default=())

    @property
    def samples(self) -> int:
        """Number of odometry messages."""
        return len(self.series[interface.ODOM][0])


@dataclass(frozen=True, eq=False)
class OpenLoop:
    """Answers of a law to recorded odometry.

    Attributes
    ----------
    ns : (n,) stamps of the odometry that it answered
    tau, f : (n, 6) wrench and estimate, N and N m, body frame
    refused : odometry and set-points that were not used, and wrenches that the law had not
    trouble : why, of the first one

    """

    ns: np.ndarray
    tau: np.ndarray
    f: np.ndarray
    refused: int = 0
    trouble: str = ''


def recorded_loop(bag: str | Path, vehicle: str | Path | None = None) -> RecordedLoop:
    """What the controller of a bag was told and said.

    Parameters
    ----------
    bag : folder or .mcap file
    vehicle : vehicle file for a bag that does not carry its own

    Raises
    ------
    InputError : no bag, no vehicle, no set-points, or topics of another system

    """
    bag, contents = Path(bag), read_bag(bag)
    topics = topics_of_one_graph(contents.messages, contents, bag)
    series = {role: contents.messages[topic] for role, topic in topics.items()}
    if interface.CMD_VEL not in series:
        raise NotOursError(bag, interface.CMD_VEL, 'messages', ', '.join(sorted(contents.types)))
    return _loop(series, contents, bag, vehicle)


def _loop(
    series: dict[str, Series], contents: Contents, bag: Path, vehicle: str | Path | None
) -> RecordedLoop:
    parameters = attached.parameters_of(contents, bag)
    known, own = attached.vehicle_of(contents, bag, vehicle), parameters.get(CONTROLLER, {})
    return RecordedLoop(
        series,
        RecordedController(own, known, bag, derivatives=interface.CMD_ACCEL in series),
        attached.scenario_name(contents, bag),
        attached.controller_name(parameters, bag),
        tuple(contents.notes),
    )


def open_loop(
    recorded: RecordedLoop,
    law: str,
    gains: Mapping[str, Any],
    progress: Progress = lambda _: None,
) -> OpenLoop:
    """What a law would have commanded.

    Parameters
    ----------
    recorded : what it is told
    law : 'gvc', 'cl', 'pid', 'smc' or 'module:Class'
    gains : its gains by name, 1, 6, 36 numbers or 6x6
    progress : told the number of odometry messages that have been answered

    Returns
    -------
    answers : sampled and held as the nodes do: the law of the bag with its gains gives the
        recorded wrench to the last bit, where it was recorded in lock-step

    Raises
    ------
    InputError : no such law, a gain is missing or wrong

    """
    controller, pairing = recorded.controller.build(law, gains)
    answers: list[Answer] = []
    troubles: list[str] = []
    for k, (ns, role, values) in enumerate(_in_order(recorded.series)):
        try:
            answer = _tell(controller, pairing, role, ns, values)
        except ValueError as error:
            troubles.append(f'{role}: {error}')
            continue
        if answer is not None:
            answers.append(answer)
            troubles += [answer.trouble] if answer.trouble else []
        if k % 1024 == 0:
            progress(len(answers))
    progress(recorded.samples)
    return OpenLoop(
        np.array([answer.ns for answer in answers], np.int64),
        np.array([answer.tau for answer in answers], float).reshape(-1, 6),
        np.array([answer.f for answer in answers], float).reshape(-1, 6),
        len(troubles),
        troubles[0] if troubles else '',
    )


def _tell(
    controller: VelocityController, pairing: Pairing, role: str, ns: int, values: tuple[float, ...]
) -> Answer | None:
    if role == interface.ODOM:
        return controller.odometry(ns, values)
    keep = pairing.setpoint if role == interface.CMD_VEL else pairing.derivative
    keep(ns, values)
    return controller.answer()


def _in_order(series: Mapping[str, Series]) -> Iterator[tuple[int, str, tuple[float, ...]]]:
    """Messages by stamp, set-points before the odometry that they belong to."""
    told = (interface.CMD_ACCEL, interface.CMD_VEL, interface.ODOM)

    def of(order: int, role: str) -> Iterator[tuple[int, int, str, tuple[float, ...]]]:
        stamps, rows = series[role]
        for ns, row in zip(stamps.tolist(), rows.tolist(), strict=True):
            yield ns, order, role, tuple(row)

    parts = [of(order, role) for order, role in enumerate(told) if role in series]
    for ns, _, role, values in heapq.merge(*parts, key=lambda entry: entry[:2]):
        yield ns, role, values
