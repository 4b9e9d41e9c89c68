"""A recorded run: as a `Run`, or as a `LongRun` where it would not fit into memory."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.bag import attached
from auv_analysis.bag.contents import Contents
from auv_analysis.bag.held import SETPOINTS, held_parts, held_series, holds
from auv_analysis.bag.reading import batches, read_bag
from auv_analysis.bag.steps import (
    Steps,
    complete,
    complete_blocks,
    dropped,
    joined_series,
    topics_of_one_graph,
)
from auv_analysis.bag.survey import Survey
from auv_analysis.runs.run import (
    AnyRun,
    Extent,
    LongRun,
    Run,
    widened,
)
from auv_dynamics.plant.plant import unwrapped_eta
from auv_dynamics.ros import interface

WHOLE = 1 << 16  # steps up to which a recording is kept in memory


class Recording(NamedTuple):
    """A recorded run, and name -> text of what travels with it."""

    run: AnyRun
    attachments: dict[str, str]


def load_run(
    bag: str | Path, vehicle: str | Path | None = None, namespace: str | None = None
) -> Run:
    """Run of a recorded bag.

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
    return _whole(read_bag(bag, namespace), Path(bag), vehicle)


def open_bag(
    bag: str | Path,
    vehicle: str | Path | None = None,
    whole: int = WHOLE,
    namespace: str | None = None,
) -> Recording:
    """The same run, in memory that hardly grows with its length.

    A long bag is read once now, which finds and checks all that is in it, and once more for every
    pass over the blocks of its run.

    Parameters
    ----------
    bag, vehicle, namespace : as for `load_run`
    whole : number of messages per topic up to which the run is kept in memory

    Raises
    ------
    InputError : as for `load_run`

    """
    bag, survey = Path(bag), Survey(whole)
    contents = Contents(namespace=namespace, asked=namespace is not None)
    for batch in batches(bag, contents):
        survey.add(batch)
    run: AnyRun
    if survey.kept is not None:
        contents.messages = {topic: joined_series(parts) for topic, parts in survey.kept.items()}
        run = _whole(contents, bag, vehicle)
    elif survey.rising:
        run = _long(contents, survey, bag, vehicle)
    else:
        run = load_run(bag, vehicle, namespace)  # its steps have to be sorted
    return Recording(run, contents.attachments)


def _whole(contents: Contents, bag: Path, vehicle: str | Path | None) -> Run:
    topics = topics_of_one_graph(contents.messages, contents, bag)
    series = {role: contents.messages[topic] for role, topic in topics.items()}
    held = _holds(contents, bag)
    if held:
        series = held_series(series)
    steps = complete(series)
    ns = steps[0]
    counts = {role: len(stamps) for role, (stamps, _) in series.items()}
    notes = dropped(_step_by_step(counts, held), len(ns), bag)
    facts = _facts(contents, bag, vehicle, float(np.median(np.diff(ns))), notes)
    return _with_slope(_run(steps, int(ns[0]), facts))


def _long(contents: Contents, survey: Survey, bag: Path, vehicle: str | Path | None) -> LongRun:
    topics = topics_of_one_graph(survey.counts, contents, bag)
    held = _holds(contents, bag)
    number, first, last, interval = survey.steps(topics, held=held)
    counts = {role: survey.counts[topic] for role, topic in topics.items()}
    notes = dropped(_step_by_step(counts, held), number, bag)
    facts = _facts(contents, bag, vehicle, interval, notes)
    ends = survey.ends(topics, held=held)
    roles = {topic: role for role, topic in topics.items()}

    def blocks(rows: int) -> Iterator[Run]:
        found = batches(bag, Contents(namespace=contents.namespace, asked=True))
        parts = ((roles.get(b.topic, ''), (b.stamps, b.rows)) for b in found)
        steps = complete_blocks(held_parts(parts) if held else parts, ends, rows)
        return _blocks(steps, first, facts)

    optional = interface.GROUND_TRUTH, interface.WRENCH_APPLIED, interface.DISTURBANCE
    duration = (last - first) / interface.NANOSECONDS
    extent = Extent(number, 0.0, duration, *(role in topics for role in optional))
    return LongRun(**facts, known_extent=extent, source_of_blocks=blocks)


def _holds(contents: Contents, bag: Path) -> bool:
    controller = attached.parameters_of(contents, bag).get('controller_node', {})
    return holds(contents, controller)


def _step_by_step(counts: dict[str, int], held: bool) -> dict[str, int]:
    """Counts of the roles that have a message for every step."""
    return {role: count for role, count in counts.items() if not (held and role in SETPOINTS)}


def _facts(
    contents: Contents, bag: Path, vehicle: str | Path | None, interval: float, notes: list[str]
) -> dict[str, Any]:
    """What a `Run` has beside its samples; `interval` in ns where no parameter says the step."""
    parameters = attached.parameters_of(contents, bag)
    step = attached.step_of(parameters, bag)
    law, gains = attached.law_and_gains(parameters.get('controller_node', {}), bag)
    known = attached.vehicle_of(contents, bag, vehicle)
    return {
        'vehicle': known,
        'scenario': attached.scenario_name(contents, bag),
        'controller': attached.controller_name(parameters, bag),
        'law': law,
        'gains': gains,
        'step': interval / interface.NANOSECONDS if step is None else step,
        'source': 'bag',
        'kinds': attached.kinds_of(contents, bag),
        'faults': attached.faults_of(contents, known),
        'notes': (*contents.notes, *attached.notes_on(law), *notes),
    }


def _blocks(blocks: Iterator[Steps], origin: int, facts: dict[str, Any]) -> Iterator[Run]:
    """Runs of consecutive blocks of steps."""
    for wide, inside in widened(_unrolled(blocks, origin, facts), 1):
        yield _with_slope(wide).part(inside)


def _unrolled(blocks: Iterator[Steps], origin: int, facts: dict[str, Any]) -> Iterator[Run]:
    """Runs of blocks whose psi goes on from one to the next."""
    psi = None
    for block in blocks:
        run = _run(block, origin, facts)
        if psi is not None:
            run.eta[:, 5] += np.unwrap([psi, run.eta[0, 5]])[1] - run.eta[0, 5]
        psi = run.eta[-1, 5]
        yield run


def _run(steps: Steps, origin: int, facts: dict[str, Any]) -> Run:
    """Run of complete steps, t from `origin` in ns; nu_d_dot is NaN where it was not recorded."""
    ns, series = steps
    x = series.get(interface.GROUND_TRUTH, series[interface.ODOM])
    zeros, unknown = np.zeros((len(ns), 6)), np.full((len(ns), 6), np.nan)
    sensing = interface.GROUND_TRUTH in series
    return Run(
        **facts,
        t=(ns - origin) / interface.NANOSECONDS,
        eta=unwrapped_eta(x),
        nu=x[:, 7:],
        nu_d=series.get(interface.CMD_VEL, zeros),
        nu_d_dot=series.get(interface.CMD_ACCEL, unknown),
        tau=series[interface.WRENCH],
        disturbance=series.get(interface.DISTURBANCE),
        disturbance_estimate=series.get(interface.DISTURBANCE_ESTIMATE, zeros),
        measured=series[interface.ODOM][:, 7:] if sensing else None,
        applied=series.get(interface.WRENCH_APPLIED),
    )


def _with_slope(run: Run) -> Run:
    """The run with the differences of nu_d in place of a nu_d_dot that was not recorded."""
    if np.isfinite(run.nu_d_dot[0, 0]):
        return run
    return replace(run, nu_d_dot=np.gradient(run.nu_d, run.step, axis=0))
