"""Loading a recorded run: the steps complete on all topics, in memory or in mapped files."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.bag import attachments
from auv_analysis.bag.attachments import Parameters
from auv_analysis.bag.mcap_file import DAMAGED
from auv_analysis.bag.plant_run import longest_part, time_zero
from auv_analysis.bag.reading import (
    BagContents,
    Series,
    are_swapped,
    gathered,
    read_bag,
    slices,
    strays,
    stretches,
    usual_limit,
)
from auv_analysis.bag.step_topics import KINDS, READERS, NotOursError, namespace_of, role_of
from auv_analysis.metrics.certificate import SPARSE
from auv_analysis.runs.run import Run, rows_of
from auv_dynamics.files.errors import InputError
from auv_dynamics.plant.plant import unwrapped_eta
from auv_dynamics.ros import interface
from auv_dynamics.vehicle.frames import NED_FSD, named_axes
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_gvc_controller.control.setpoint_buffer import followed

WHOLE = 1 << 16  # steps up to which a recording is kept in memory
REQUIRED = (interface.ODOM, interface.WRENCH)
Steps = tuple[np.ndarray, dict[str, np.ndarray]]  # stamps (n,) in ns, role -> values
SETPOINTS = (interface.CMD_VEL, interface.CMD_ACCEL)
LATEST = 'latest'
UNPAIRED = 0.25  # share of odometry without a set-point of its stamp, up to which they were lost


class Recording(NamedTuple):
    """A recorded run, and name -> text of what travels with it."""

    run: Run
    attachments: dict[str, str]


def load_run(
    bag: str | Path, vehicle: str | Path | None = None, namespace: str | None = None
) -> Run:
    """Run of a recorded bag, in memory.

    Parameters
    ----------
    bag : folder or .mcap file
    vehicle : vehicle file for a bag that does not carry its own
    namespace : of the vehicle; None: that of the recorder, or the only one in the bag

    Returns
    -------
    run : Run that ends at the last step complete on all step topics; `run.notes` says what was
        dropped and whether the recording was finished

    Raises
    ------
    InputError : no bag, no vehicle, or topics missing

    """
    return open_bag(bag, vehicle, math.inf, namespace).run


def open_bag(
    bag: str | Path,
    vehicle: str | Path | None = None,
    whole: float = WHOLE,
    namespace: str | None = None,
) -> Recording:
    """The same run, in memory that hardly grows with its length: of a long one, files are mapped.

    Parameters
    ----------
    bag, vehicle, namespace : as for `load_run`
    whole : number of messages per topic up to which the run is kept in memory

    Raises
    ------
    InputError : as for `load_run`
    FailedError : no room for temporary files

    """
    bag = Path(bag)
    contents = read_vehicle(bag, namespace, whole)
    topics = topics_of_one_graph(contents, bag)
    parameters = attachments.parameters_of(contents, bag)
    series = {role: contents.messages.pop(topic) for role, topic in topics.items()}
    series, begun = (series, []) if contents.strict else longest_stretch(series, whole)
    controller = parameters.get(interface.CONTROLLER, {})
    # where the bag does not say it: a controller beside a driver held its set-points
    lacking, between = _unpaired(series) if contents.strict is None else (0, 0)
    free = contents.strict is False or lacking > UNPAIRED * between
    if held := controller.get('setpoint_pairing', LATEST if free else None) == LATEST:
        if lacking and 'setpoint_pairing' not in controller:
            told = f'{lacking} of {between} odometry messages have none of their stamp'
            begun.append(f'{interface.CMD_VEL}: taken as held until the next one, since {told}')
        timeout, lockstep = controller.get('setpoint_timeout'), controller.get('lockstep') is True
        if not lockstep:
            series = obeyed(series, whole)
        if lockstep or not isinstance(timeout, int | float):
            timeout = math.inf
        series, aged = held_series(series, whole, timeout)
        begun += aged
    ns, values = complete(series, whole)
    if len(ns) < 2:
        expected = 'at least two steps that are complete on all step topics'
        raise NotOursError(bag, '', expected, f'{len(ns)}')
    counted = {role: stamps for role, (stamps, _) in series.items()
               if not (held and role in SETPOINTS)}  # fmt: skip
    dropped = [note for role, stamps in counted.items() for note in _dropped(role, stamps, len(ns))]
    known = attachments.vehicle_of(contents, bag, vehicle)
    plant = parameters.get(interface.PLANT, {})
    zero, missing = time_zero(ns, plant)
    kept, again = longest_part(ns, values, plant, zero)
    values = {role: rows[kept] for role, rows in values.items()}
    facts = _facts(contents, bag, parameters, known, (ns[kept], zero), {*values})
    facts['notes'] += *begun, *missing, *again, *dropped
    return Recording(_run(ns[kept], zero, values, facts, whole), contents.attachments)


def read_vehicle(bag: Path, namespace: str | None, whole: float = math.inf) -> BagContents:
    """Contents of a bag; what cannot be read of others does not matter where one is complete.

    Parameters
    ----------
    bag, namespace, whole : as for `read_bag`

    Raises
    ------
    InputError : as for `read_bag`

    """
    try:
        return read_bag(bag, namespace, whole=whole)
    except InputError as error:
        if namespace is not None:
            raise
        found = read_bag(bag, decode=False)
        ours = {topic for topic, kind in found.types.items()
                if found.counts.get(topic) and KINDS.get(role_of(topic)) == kind}  # fmt: skip
        spaces = {space for space in map(namespace_of, ours)
                  if ours.issuperset(f'{space}{role}' for role in REQUIRED)}  # fmt: skip
        if found.namespace is not None or len(spaces) != 1 or namespace_of(error.key) in spaces:
            raise
        (space,) = spaces
        contents = read_bag(bag, space, whole=whole)
        contents.notes.append(f'read the vehicle in {space} alone: {error}')
        return contents


def _unpaired(series: Mapping[str, Series]) -> tuple[int, int]:
    """How much odometry between the set-points has none of its stamp, and how much there is."""
    odometry, _ = series[interface.ODOM]
    stamps, _ = series.get(interface.CMD_VEL, series[interface.ODOM])
    stamps, met, count = stamps if _is_rising(stamps) else np.sort(stamps), 0, 0
    for here in slices(len(odometry)):
        ns = rows_of(odometry, here)
        between = ns[(ns >= stamps[0]) & (ns <= stamps[-1])]
        met += int((stamps[np.searchsorted(stamps, between)] == between).sum())
        count += len(between)
    return count - met, count


def _dropped(role: str, stamps: np.ndarray, kept: int) -> list[str]:
    """Notes on messages with stamps (n,) that are no steps of the run."""
    if len(stamps) == kept:
        return []
    doubled = len(stamps) - len(np.unique(stamps))
    notes = [f'{role}: {doubled} stamps came again, the first of each is kept'] * bool(doubled)
    if left := len(stamps) - doubled - kept:
        notes.append(f'{role}: {left} of {len(stamps)} messages are not complete on all topics')
    return notes


def _facts(
    contents: BagContents, bag: Path, parameters: Parameters, known: Vehicle,
    times: tuple[np.ndarray, int], topics: set[str],
) -> dict[str, Any]:  # fmt: skip
    """What a `Run` has beside its samples; stamps (n,) say the step if nothing else does.

    `times` are these stamps and the one from which time counts, ns.
    """
    ns, zero = times
    step = attachments.step_of(parameters, bag)
    law, gains = attachments.law_and_gains(parameters.get(interface.CONTROLLER, {}), bag)
    scenario = attachments.scenario_of(contents, bag)
    faults, gaps = attachments.faults_of(scenario, known), _gaps(ns, zero)
    if interface.PLANT in parameters:  # whose time a fault is told in, that of the stamps
        late = zero / interface.NANOSECONDS
        faults = tuple(  # one that holds throughout goes on to do so
            f._replace(start=f.start and f.start - late, end=f.end - late) for f in faults
        )
    missing = attachments.unrecorded(scenario, {fault.kind for fault in faults}, topics)
    notes, usual = [*missing.values()], float(np.median(np.diff(ns))) / interface.NANOSECONDS
    if step is not None and usual > SPARSE * step:
        notes.append(f'samples are {usual:.6g} s apart, in a run of steps of {step:.6g} s')
    if lost := sum(end - begin for begin, end in gaps):
        counted = f'{len(gaps)} gap{"s" * (len(gaps) > 1)}'
        notes.append(f'no samples in {counted}, {lost:.6g} s together')
    return {
        'vehicle': known,
        'scenario': attachments.scenario_name(scenario, bag),
        'controller': attachments.controller_name(parameters, bag),
        'law': law,
        'gains': gains,
        'step': usual if step is None else step,
        'source': 'bag',
        'kinds': attachments.kinds_of(scenario),
        'faults': faults,
        'unrecorded': frozenset(missing),
        'gaps': gaps,
        'notes': (*contents.notes, *attachments.notes_on(law), *notes),
    }


def _gaps(ns: np.ndarray, zero: int) -> tuple[tuple[float, float], ...]:
    """Last time before and first behind each pause of rising stamps (n,), s since `zero`."""
    where = np.flatnonzero(np.diff(ns) > usual_limit(ns))
    edges = (np.stack([ns[where], ns[where + 1]], axis=1) - zero) / interface.NANOSECONDS
    return tuple((begin, end) for begin, end in edges.tolist())


def _run(
    ns: np.ndarray, zero: int, values: dict[str, np.ndarray], facts: dict[str, Any], whole: float
) -> Run:
    """Run of complete steps; NaN is what was not recorded, nu_d_dot then the slope of nu_d."""
    x = values.get(interface.GROUND_TRUTH, values[interface.ODOM])
    t = ((rows_of(ns, here) - zero) / interface.NANOSECONDS for here in slices(len(ns)))
    unknown = np.broadcast_to(np.nan, (len(ns), 6))
    nu_d, nu_d_dot = values.get(interface.CMD_VEL, unknown), values.get(interface.CMD_ACCEL)
    if nu_d_dot is None:
        nu_d_dot = gathered(_slopes(nu_d, ns), whole)
    sensing = interface.GROUND_TRUTH in values
    return Run(
        **facts,
        t=gathered(t, whole),
        eta=gathered(_unrolled(x), whole),
        nu=x[:, 7:],
        nu_d=nu_d,
        nu_d_dot=nu_d_dot,
        tau=values[interface.WRENCH],
        disturbance=values.get(interface.DISTURBANCE),
        disturbance_estimate=values.get(interface.DISTURBANCE_ESTIMATE, unknown),
        measured=values[interface.ODOM][:, 7:] if sensing else None,
        applied=values.get(interface.WRENCH_APPLIED),
    )


def _unrolled(x: np.ndarray) -> Iterator[np.ndarray]:
    """Eta of states (n, 13) in blocks, whose psi goes on from one to the next."""
    psi = None
    for here in slices(len(x)):
        eta = unwrapped_eta(rows_of(x, here))
        if psi is not None:
            eta[:, 5] += np.unwrap([psi, eta[0, 5]])[1] - eta[0, 5]
        psi = eta[-1, 5]
        yield eta


def _slopes(rows: np.ndarray, ns: np.ndarray) -> Iterator[np.ndarray]:
    """Slopes at rows (n, 6) with stamps (n,), in blocks: of the parabola through the neighbours.

    Beside a gap or at an end it is the slope to the only neighbour, NaN where there is none.
    """
    limit, edge = usual_limit(ns), np.full((1, 6), np.nan)
    for here in slices(len(rows)):
        first = max(here.start - 1, 0)
        wide = slice(first, here.stop + 1)
        apart = np.diff(rows_of(ns, wide))[:, None]
        slopes = np.diff(rows_of(rows, wide), axis=0) / (apart / interface.NANOSECONDS)
        slopes[apart[:, 0] > limit] = np.nan
        before, after = np.concatenate([edge, slopes]), np.concatenate([slopes, edge])
        back, ahead = np.concatenate([[[1]], apart]), np.concatenate([apart, [[1]]])
        middle = (ahead * before + back * after) / (back + ahead)
        found = np.where(np.isnan(before), after, np.where(np.isnan(after), before, middle))
        yield found[here.start - first :][: here.stop - here.start]


def topics_of_one_graph(contents: BagContents, bag: Path) -> dict[str, str]:
    """Role -> topic, of the namespace that is read, or of the only one that is complete.

    Parameters
    ----------
    contents : of the bag, with the messages of our topics
    bag : for the refusal

    Raises
    ------
    InputError : a topic without which there is no run has no messages, or there are several runs

    """
    topics = set(contents.messages)
    space = _namespace(topics, contents, bag)
    frames = contents.frames[space]
    named = all(named_axes(name) == NED_FSD for name in (frames.odom, frames.base))
    if 'params.yaml' not in contents.attachments and not named:
        expected = 'frames whose names say that they are NED and FSD'
        found = f'{frames.odom}, {frames.base}'
        raise NotOursError(bag, f'{space}{interface.ODOM}: frame_id', expected, found)
    ours = {role: f'{space}{role}' for role in READERS if f'{space}{role}' in topics}
    for role in REQUIRED:
        if role not in ours:
            raise _without(role, contents, bag)
    return ours


def _without(role: str, contents: BagContents, bag: Path) -> InputError:
    """Refusal of a bag without messages of a role: damage may have taken them."""
    topics = [topic for topic in contents.types if role_of(topic) == role]
    damage = [note for note in contents.notes if DAMAGED in note]
    if damage and (topics or not contents.types):
        key, *_ = *topics, role
        return InputError(bag, key, 'messages', f'{damage[0]}: auv recover may find more')
    return NotOursError(bag, role, 'messages', ', '.join(sorted(contents.types)) or 'no topics')


def _namespace(topics: set[str], contents: BagContents, bag: Path) -> str:
    """Namespace that is read, as it stands before our names."""
    spaces = sorted(namespace_of(t) for t in topics if role_of(t) == interface.ODOM)
    whole = [space for space in spaces if all(f'{space}{role}' in topics for role in REQUIRED)]
    if not spaces and contents.namespace is not None:
        others = {namespace_of(t) for t in contents.counts if role_of(t) == interface.ODOM}
        listed = ', '.join(sorted(space.rstrip('/') or '/' for space in others))
        key = f'namespace {contents.namespace}'
        if others:
            expected = f'{interface.ODOM} in it, or --namespace with one that has it'
            raise InputError(bag, key, expected, listed)
        if contents.asked:
            found = ', '.join(sorted(contents.types)) or 'no topics'
            raise InputError(bag, key, interface.ODOM, found)
    if not spaces:
        raise _without(interface.ODOM, contents, bag)
    if len(whole) > 1:
        listed = ', '.join(space.rstrip('/') or '/' for space in whole)
        raise InputError(bag, '', 'one vehicle, or --namespace with that of one', listed)
    return whole[0] if whole else spaces[0]


def longest_stretch(
    series: Mapping[str, Series], whole: float
) -> tuple[dict[str, Series], list[str]]:
    """The part of each topic in which the odometry goes on longest, and notes on what is left out.

    Where a clock begins anew, that of every topic does, but for one that has another clock. Before,
    a few messages with stamps of another time are left out, but for set-points, see `obeyed`. What
    only stands in another order is sorted.

    Parameters
    ----------
    series : role -> stamps in the order of the bag, and rows
    whole : steps up to which rows that have to be picked are kept in memory

    """
    found, notes, cuts = dict(series), list[str](), dict[str, list[int]]()
    for role, (ns, rows) in series.items():
        stamps = rows_of(ns, slice(None))
        if role not in SETPOINTS and (stray := strays(stamps, role, notes)).any():
            stamps = stamps[~stray]
            found[role] = stamps, _picked(rows, np.flatnonzero(~stray), whole)
        cuts[role] = stretches(stamps)
    edges = cuts[interface.ODOM]
    if len(edges) == 2:
        return found, notes
    if are_swapped(found[interface.ODOM][0]):
        return in_order(found, whole), notes
    kept = int(np.argmax(np.diff(edges)))
    times = len(edges) - 2
    notes.append(
        f'{interface.ODOM}: the clock jumps back {times} times; read the longest of {times + 1} '
        f'stretches, left {edges[-1] - edges[kept + 1] + edges[kept]} messages'
    )
    for role, (ns, rows) in found.items():
        if len(cuts[role]) == len(edges):
            part = slice(*cuts[role][kept : kept + 2])
            found[role] = ns[part], rows[part]
        else:
            own = f'{role}: its clock jumps back {len(cuts[role]) - 2} times'
            notes.append(f'{own}: what it says may be of another time')
    return found, notes


def in_order(series: Mapping[str, Series], whole: float = math.inf) -> dict[str, Series]:
    """The series, role -> stamps and rows, by rising stamps."""
    orders = {role: np.argsort(ns, kind='stable') for role, (ns, _) in series.items()}
    return {role: (ns[orders[role]], _picked(rows, orders[role], whole))
            for role, (ns, rows) in series.items()}  # fmt: skip


def complete(series: Mapping[str, Series], whole: float = math.inf) -> Steps:
    """Stamps that are on every topic, rising, and the values there; of a doubled one the first.

    Parameters
    ----------
    series : role -> stamps and rows
    whole : steps up to which values that have to be picked are kept in memory

    """
    stamps, *others = (ns for ns, _ in series.values())
    if _is_rising(stamps) and all(_are_equal(stamps, ns) for ns in others):
        return stamps, {role: rows for role, (_, rows) in series.items()}
    for ns in others:
        stamps = np.intersect1d(stamps, ns)
    stamps = np.unique(stamps)
    values = {}
    for role, (ns, rows) in series.items():
        order = np.argsort(ns, kind='stable')
        values[role] = _picked(rows, order[np.searchsorted(ns, stamps, sorter=order)], whole)
    return stamps, values


def _is_rising(ns: np.ndarray) -> bool:
    overlapping = (slice(here.start, here.stop + 1) for here in slices(len(ns)))
    return all(np.all(np.diff(rows_of(ns, here)) > 0) for here in overlapping)


def _are_equal(one: np.ndarray, other: np.ndarray) -> bool:
    same = len(one) == len(other)
    return same and all(
        np.array_equal(rows_of(one, here), rows_of(other, here)) for here in slices(len(one))
    )


def _picked(rows: np.ndarray, index: np.ndarray, whole: float) -> np.ndarray:
    """Rows of some numbers (n,)."""
    if not len(index):
        return rows[:0]
    return gathered((rows_of(rows, index[here]) for here in slices(len(index))), whole)


def obeyed(series: Mapping[str, Series], whole: float = math.inf) -> dict[str, Series]:
    """The series, role -> stamps in the order of the bag and rows, as a controller follows them.

    In real time a set-point takes the place of those that lie ahead of its stamp, see `followed`.
    """
    found = dict(series)
    for role in SETPOINTS:
        if role in series and not _is_rising(series[role][0]):
            ns, rows = series[role]
            kept = followed(ns)
            found[role] = ns[kept], _picked(rows, kept, whole)
    return found


def held_series(
    series: Mapping[str, Series], whole: float = math.inf, timeout: float = math.inf
) -> tuple[dict[str, Series], list[str]]:
    """The series, role -> stamps and rows, with set-points at the stamps of the odometry.

    A set-point holds until the next one, or the timeout, s: each odometry has the newest at or
    before its stamp, the first of a doubled one. Notes say where it was too old.
    """
    notes = list[str]()
    stamps = np.sort(series[interface.ODOM][0])
    held = dict(series)
    for role in SETPOINTS:
        if role in series:
            ns, rows = series[role]
            ns, first = np.unique(ns, return_index=True)
            index = np.searchsorted(ns, stamps, 'right') - 1
            known = index >= 0
            age = (stamps - ns[index]) / interface.NANOSECONDS
            if role == interface.CMD_VEL and (count := np.count_nonzero(known & (age > timeout))):
                text = f'{role}: older than {timeout:g} s, the timeout of the controller, at '
                notes.append(f'{text}{count} of {len(stamps)} odometry messages: not held there')
                known &= age <= timeout
                if not known.any():  # such as stamps of zero, which the controller refused
                    del held[role]
                    continue
            held[role] = stamps[known], _picked(rows, first[index[known]], whole)
    return held, notes
