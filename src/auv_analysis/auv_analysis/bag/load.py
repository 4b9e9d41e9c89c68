"""A recorded run, in memory or, where it is long, in files that are mapped."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.bag import attachments
from auv_analysis.bag.reading import Contents, gathered, read_bag, slices
from auv_analysis.bag.steps import (
    SETPOINTS,
    complete,
    dropped,
    held_series,
    holds,
    topics_of_one_graph,
)
from auv_analysis.runs.run import Run, rows_of
from auv_dynamics.plant.plant import unwrapped_eta
from auv_dynamics.ros import interface

WHOLE = 1 << 16  # steps up to which a recording is kept in memory


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
    bag, contents = Path(bag), read_bag(bag, namespace, whole=whole)
    topics = topics_of_one_graph(contents.messages, contents, bag)
    series = {role: contents.messages.pop(topic) for role, topic in topics.items()}
    controller = attachments.parameters_of(contents, bag).get('controller_node', {})
    held = holds(contents, controller)
    if held:
        series = held_series(series, whole)
    counts = {role: len(stamps) for role, (stamps, _) in series.items()}
    ns, values = complete(series, whole)
    step_by_step = {r: count for r, count in counts.items() if not (held and r in SETPOINTS)}
    notes = dropped(step_by_step, len(ns), bag)
    facts = _facts(contents, bag, vehicle, ns, notes)
    return Recording(_run(ns, values, facts, whole), contents.attachments)


def _facts(
    contents: Contents, bag: Path, vehicle: str | Path | None, ns: np.ndarray, notes: list[str]
) -> dict[str, Any]:
    """What a `Run` has beside its samples; stamps (n,) say the step if nothing else does."""
    parameters = attachments.parameters_of(contents, bag)
    step = attachments.step_of(parameters, bag)
    law, gains = attachments.law_and_gains(parameters.get('controller_node', {}), bag)
    known = attachments.vehicle_of(contents, bag, vehicle)
    return {
        'vehicle': known,
        'scenario': attachments.scenario_name(contents, bag),
        'controller': attachments.controller_name(parameters, bag),
        'law': law,
        'gains': gains,
        'step': float(np.median(np.diff(ns))) / interface.NANOSECONDS if step is None else step,
        'source': 'bag',
        'kinds': attachments.kinds_of(contents, bag),
        'faults': attachments.faults_of(contents, known),
        'notes': (*contents.notes, *attachments.notes_on(law), *notes),
    }


def _run(ns: np.ndarray, values: dict[str, np.ndarray], facts: dict[str, Any], whole: float) -> Run:
    """Run of complete steps; a nu_d_dot that was not recorded is the slope of nu_d."""
    x = values.get(interface.GROUND_TRUTH, values[interface.ODOM])
    t = ((rows_of(ns, here) - ns[0]) / interface.NANOSECONDS for here in slices(len(ns)))
    zeros = np.zeros((len(ns), 6))
    nu_d, nu_d_dot = values.get(interface.CMD_VEL, zeros), values.get(interface.CMD_ACCEL)
    if nu_d_dot is None:
        nu_d_dot = gathered(_slopes(nu_d, facts['step']), whole)
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
        disturbance_estimate=values.get(interface.DISTURBANCE_ESTIMATE, zeros),
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


def _slopes(rows: np.ndarray, step: float) -> Iterator[np.ndarray]:
    """Central differences of rows (n, 6), in blocks."""
    for here in slices(len(rows)):
        first = max(here.start - 1, 0)
        slope = np.gradient(rows_of(rows, slice(first, here.stop + 1)), step, axis=0)
        yield slope[here.start - first :][: here.stop - here.start]
