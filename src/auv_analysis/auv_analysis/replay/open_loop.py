"""A law on recorded odometry, open loop: the wrench that it would have commanded.

The loop is open: the vehicle moved as the recorded wrench made it move, whatever this law says.
Messages go through the very controller that the node runs, in the order in which a node needs them.
In real time it is told what the recorded controller has answered, and begins anew where that did.
"""

import heapq
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.bag import attachments
from auv_analysis.bag.load import (
    in_order,
    longest_stretch,
    obeyed,
    read_vehicle,
    topics_of_one_graph,
)
from auv_analysis.bag.reading import Series
from auv_analysis.bag.step_topics import NotOursError
from auv_analysis.graph.node_parameters import CONTROLLER
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import is_number
from auv_dynamics.ros import interface
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_gvc_controller.control.controller import FEWEST, Answer, VelocityController
from auv_gvc_controller.control.odometry_guard import SAME_EPOCH, Now
from auv_gvc_controller.control.setpoint_buffer import SAME, SetpointBuffer
from auv_gvc_controller.control.settings import ControllerSettings, usual_acceleration
from auv_gvc_controller.laws.law import law_class, make_gains, refusal, try_law
from auv_gvc_controller.laws.model import control_model

UNTOLD = 'the bag does not tell the settings of the controller: usual ones are taken'


class RecordedController:
    """Everything of a controller but its law; its clock is that of the stamps.

    Parameters
    ----------
    parameters : of the node, as they were attached to the bag; empty: not known
    vehicle : what it knows
    bag : for refusals
    derivatives : whether nu_d_dot was recorded
    told : parameters with later settings, and the stamp from which on it had them, ns

    Attributes
    ----------
    law, gains : as they were; 'unknown' and none where the bag does not say
    settings : what the node runs with where it is given the same parameters
    in_turn : the settings of `told`

    Raises
    ------
    InputError : a parameter is not what it should be

    """

    def __init__(
        self, parameters: Mapping[str, Any], vehicle: Vehicle, bag: Path, *, derivatives: bool,
        told: Sequence[tuple[int, Mapping[str, Any]]] = (),
    ):  # fmt: skip
        self._vehicle = vehicle
        self.law, self.gains = attachments.law_and_gains(dict(parameters), bag)
        source = f'{bag}: params.yaml: controller_node'

        def settings(values: Mapping[str, Any]) -> ControllerSettings:
            found = recorded_settings(values, source)
            if found.setpoint_acceleration == SAME and not derivatives:
                return replace(found, setpoint_acceleration=usual_acceleration(found.lockstep))
            return found

        self.settings = settings(parameters)
        self.in_turn = [(ns, settings(values)) for ns, values in told]

    def build(
        self, law: str, gains: Mapping[str, Any], setpoints: SetpointBuffer,
        settings: ControllerSettings,
    ) -> VelocityController:  # fmt: skip
        """Controller with a law, and the set-points that have come; InputError: no such law."""
        try:
            made = make_gains(law, gains)
            try_law(made, control_model(self._vehicle))
        except ValueError as error:
            gain, expected, found = refusal(error)
            raise InputError('--gain' if gain else '--law', gain, expected, found) from None
        setpoints.believe(*settings.believed)
        return settings.build(made, self._vehicle, setpoints)

    def gains_of(self, law: str, given: Mapping[str, Any]) -> dict[str, Any]:
        """Gains for a law: those that are given, the others as they were recorded."""
        names = law_class(law)._fields
        return {**{name: v for name, v in self.gains.items() if name in names}, **given}


def recorded_settings(values: Mapping[str, Any], source: str) -> ControllerSettings:
    """Settings of parameters by name, as a bag carries them; InputError for a wrong one."""

    def reader(
        name: str, kind: Any, default: Any, _: str, *, at_least: float = 0.0,
        at_most: float = interface.LARGEST, one_of: tuple[str, ...] = (),
    ) -> Any:  # fmt: skip
        value = values.get(name, default)
        usable = {
            float: (
                is_number(value) and at_least <= value <= at_most,
                f'a number from {at_least:g} to {at_most:g}',
            ),
            list[float]: (value is None or isinstance(value, list), 'a list of numbers'),
            str: (value in one_of, f'one of {", ".join(one_of)}'),
            bool: (isinstance(value, bool), 'true or false'),
        }
        is_good, expected = usable[kind]
        if not is_good:
            raise InputError(source, name, expected, value)
        return float(value) if kind is float else value

    return ControllerSettings.read(reader, source)


Progress = Callable[[int], None]


@dataclass(frozen=True, eq=False)
class RecordedLoop:
    """Inputs of a controller, and its answers.

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
    ramps : (n,) whether an answer may be on the ramp of a law that engages; None: none is
    notes : what of the recording was left out or is missing

    """

    ns: np.ndarray
    tau: np.ndarray
    f: np.ndarray
    refused: int = 0
    trouble: str = ''
    ramps: np.ndarray | None = None
    notes: tuple[str, ...] = ()


def recorded_loop(
    bag: str | Path, vehicle: str | Path | None = None, namespace: str | None = None
) -> RecordedLoop:
    """Inputs and answers of the controller of a bag.

    Parameters
    ----------
    bag : folder or .mcap file
    vehicle : vehicle file for a bag that does not carry its own
    namespace : of the vehicle; None: that of the recorder, or the only one in the bag

    Raises
    ------
    InputError : no bag, no vehicle, no set-points, or topics of another system

    """
    bag = Path(bag)
    contents = read_vehicle(bag, namespace)
    topics = topics_of_one_graph(contents, bag)
    series = {role: contents.messages[topic] for role, topic in topics.items()}
    if interface.CMD_VEL not in series:
        raise NotOursError(bag, interface.CMD_VEL, 'messages', ', '.join(sorted(contents.types)))
    parameters = attachments.parameters_of(contents, bag)
    known, own = attachments.vehicle_of(contents, bag, vehicle), parameters.get(CONTROLLER, {})
    told = attachments.settings_in_turn(contents, bag)
    derivatives = interface.CMD_ACCEL in series
    controller = RecordedController(own, known, bag, derivatives=derivatives, told=told)
    begun = [UNTOLD] * ('params.yaml' not in contents.attachments)
    if controller.settings.lockstep:  # whose clock never begins anew: only chunks may be swapped
        series = in_order(series)
    else:
        if not contents.strict:
            series, anew = longest_stretch(series, math.inf)
            begun += anew
        series = obeyed(series)
    return RecordedLoop(
        series,
        controller,
        attachments.scenario_name(attachments.scenario_of(contents, bag), bag),
        attachments.controller_name(parameters, bag),
        (*contents.notes, *begun),
    )


def open_loop(
    recorded: RecordedLoop,
    law: str,
    gains: Mapping[str, Any],
    progress: Progress = lambda _: None,
) -> OpenLoop:
    """The wrench that a law would have commanded.

    Parameters
    ----------
    recorded : what it is told
    law : name of a shipped one, or 'module:Class'
    gains : its gains by name, 1, 6, 36 numbers or 6x6
    progress : told the number of odometry messages that have been answered

    Returns
    -------
    answers : sampled and held as the nodes do: the law of the bag with its gains gives the
        recorded wrench to the last bit, where it was recorded in lock-step; in real time nearly,
        since the bag does not say when each message arrived

    Raises
    ------
    InputError : no such law, a gain is missing or wrong

    """
    own = recorded.controller
    setpoints, course = own.settings.setpoints(), _Course(recorded)
    controller = own.build(law, gains, setpoints, own.settings)
    stretch, begin = 0, (0, 0)
    ramps: list[bool] = []
    answers: list[Answer] = []
    troubles: list[str] = []
    for k, (ns, role, values) in enumerate(_in_order(recorded.series)):
        if role == interface.ODOM:
            now_in = course.stretch(ns)
            if not now_in:
                continue
            if now_in != stretch:
                controller = own.build(law, gains, setpoints, course.settings(now_in))
                stretch, begin = now_in, (ns, len(answers))
        try:
            answer = _tell(controller, setpoints, role, ns, values)
        except ValueError as error:
            troubles.append(f'{role}: {error}')
            continue
        if answer is not None:
            ramps.append(course.is_ramp(answer.ns - begin[0], len(answers) - begin[1]))
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
        np.array(ramps, bool),
        course.notes,
    )


class _Course:
    """When the recorded law was in charge, by its own wrenches and estimates.

    In real time odometry may come while nobody answers, before activation or lost on the way to
    the controller alone, and while a watchdog disengages it: the law's integrals do not know it.

    Parameters
    ----------
    recorded : odometry, wrenches and estimates

    """

    def __init__(self, recorded: RecordedLoop):
        ns, tau = recorded.series[interface.WRENCH]
        odometry = recorded.series[interface.ODOM][0]
        self._own = recorded.controller
        settings = self._own.settings
        self.notes: tuple[str, ...] = ()
        self._ends = dict[int, int]()  # ns, last answer of each time in charge
        answered, first = np.unique(ns, return_index=True)
        self._free = settings.lockstep or not np.isin(odometry, answered).any()
        ramp = max(one.ramp for _, one in [(0, settings), *self._own.in_turn])
        self._ramp = 0.0 if self._free else 1.5 * ramp * interface.NANOSECONDS
        if self._free:
            first_ns = int(odometry.min())
            if settings.lockstep and 0 < first_ns < SAME_EPOCH:
                begin = f'the bag begins at {first_ns / interface.NANOSECONDS:.6g} s of its clock'
                said = 'this law begins without the integrals of what came before'
                self.notes = (f'{begin}: {said}',)
            return
        again = np.ones(len(ns), bool)
        again[first] = False  # said later of the same odometry: a watchdog, or deactivation
        silenced = np.isin(answered, ns[again & ~tau.any(axis=1)])
        active = np.asarray(tau[first].any(axis=1))
        if interface.DISTURBANCE_ESTIMATE in recorded.series:
            stamps, f = recorded.series[interface.DISTURBANCE_ESTIMATE]
            if f.any():  # zero while the law is not in charge, and in its first answer
                adapts = np.isin(answered, stamps[f.any(axis=1)])
                active &= adapts | np.append(adapts[1:], False)
        if self._ramp:  # which begins with no wrench at all
            active[:-1] |= active[1:] & ~silenced[:-1]
        silence = round(settings.odometry_timeout * interface.NANOSECONDS)
        anew = np.ones(len(answered), bool)
        anew[1:] = ~active[:-1] | silenced[:-1] | (np.diff(answered) > silence)
        number = np.cumsum(anew & active)
        self._stretches = dict(zip(answered[active].tolist(), number[active].tolist(), strict=True))
        self._ends = {number: ns for ns, number in self._stretches.items()}
        left = np.count_nonzero(~np.isin(odometry, answered[active]))
        lost = answered[active & ~np.isin(answered, odometry)]
        early = np.count_nonzero(lost < odometry.min())
        late = np.count_nonzero(lost > odometry.max())
        within = len(lost) - early - late
        told = (
            (left, 'odometry messages left out, since the recorded law was not in charge'),
            (within, 'odometry messages that it answered are not in the bag: integrated over'),
            (early, 'odometry messages that it answered came before the first one of the bag: '
             'this law begins without their integrals'),
            (late, 'odometry messages that it answered came after the last one of the bag'),
        )  # fmt: skip
        self.notes = tuple(f'{count} {text}' for count, text in told if count)
        if self._ramp and tau[first[0]].any() and not early:
            begin = 'the recorded law was in charge before the bag begins'
            self.notes += (f'{begin}: this law begins without its integrals',)

    def stretch(self, ns: int) -> int:
        """Number of the time in charge that the odometry of a stamp belongs to; 0: to none."""
        return 1 if self._free else self._stretches.get(ns, 0)

    def settings(self, stretch: int) -> ControllerSettings:
        """Settings of a time in charge: the last ones that were told before its end."""
        end = self._ends.get(stretch, 0)
        told = [settings for ns, settings in self._own.in_turn if ns < end]
        return told[-1] if told else self._own.settings

    def is_ramp(self, since: int, count: int) -> bool:
        """Whether an answer, so many ns and answers behind the first one, may be on the ramp."""
        return self._ramp > 0.0 and (since < self._ramp or count < 1.5 * FEWEST)


def _tell(
    controller: VelocityController,
    setpoints: SetpointBuffer,
    role: str,
    ns: int,
    values: tuple[float, ...],
) -> Answer | None:
    now = Now(ns / interface.NANOSECONDS, ns)  # of what arrives when it is stamped
    if role == interface.ODOM:
        return controller.odometry(ns, values, now)
    if role == interface.CMD_VEL:
        setpoints.setpoint(ns, values, now.steady)
    else:
        setpoints.derivative(ns, values)
    return controller.answer(now)


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
