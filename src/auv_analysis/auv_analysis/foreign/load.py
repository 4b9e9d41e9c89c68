"""A bag of another system as a `Run`: mapped, put into our axes, brought to one time base."""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from auv_analysis.bag.load import Recording
from auv_analysis.foreign import words
from auv_analysis.foreign.conversion import tracks_of
from auv_analysis.foreign.mapping import TopicMap
from auv_analysis.foreign.reading import read_sources
from auv_analysis.foreign.time_base import TimeBase, sensible_step, time_base
from auv_analysis.foreign.tracks import Track, at_times, means_over
from auv_analysis.foreign.unexplained import unexplained
from auv_analysis.runs.run import FOREIGN, Run
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import read_text
from auv_dynamics.plant.plant import unwrapped_eta
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_dynamics.vehicle.vehicle_file import load_vehicle


def load_foreign(bag: str | Path, mapping: TopicMap) -> Recording:
    """Run of a bag of another system, and the vehicle file that it is interpreted with.

    All its messages are held in memory.

    Parameters
    ----------
    bag : folder or file: MCAP, rosbag2's SQLite or ROS 1
    mapping : which topics hold what; it must name a vehicle

    Returns
    -------
    recording : a run in NED and FSD with equal steps wherever motion and wrench are known;
        `run.notes` says every assumption, `run.unexplained` is F by (1)

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    bag, notes = Path(bag), list[str]()
    if mapping.vehicle is None:
        expected = 'a vehicle file or a shipped bare name: M, D and g of the analysis'
        raise InputError(mapping.origin, 'vehicle (--vehicle)', expected, None)
    vehicle = load_vehicle(mapping.vehicle)
    text = read_text(shipped('vehicles', mapping.vehicle), 'vehicle')
    tracks = tracks_of(read_sources(bag, mapping, notes), mapping, vehicle, notes)
    step = round((mapping.step or 0.0) * NANOSECONDS) or sensible_step(tracks['twist'].period)
    base = time_base([*tracks.values()], tracks['twist'], step)
    if len(base.ns) < 2:
        expected = 'a time with all mapped topics and velocities enough for rates'
        raise InputError(bag, '', expected, words.spans(tracks.values()))
    notes += words.of_the_time_base(base, tracks)
    return Recording(_run(bag, mapping, vehicle, base, tracks, notes), {'vehicle.yaml': text})


def _run(
    bag: Path,
    mapping: TopicMap,
    vehicle: Vehicle,
    base: TimeBase,
    tracks: Mapping[str, Track],
    notes: list[str],
) -> Run:
    acted = tracks.get('wrench_applied', tracks['wrench'])
    estimate = unexplained(vehicle, base, tracks['pose'], tracks['twist'], acted, mapping.window)
    rows = {role: _sampled(track, base) for role, track in tracks.items()}
    unknown = np.full((len(base.ns), 6), np.nan)
    state = np.concatenate([rows['pose'], rows['twist']], axis=1)
    name = mapping.name or _name_of(bag.resolve())
    return Run(
        vehicle=vehicle,
        scenario=name,
        controller=name,
        law='unknown',
        gains={},
        step=base.step / NANOSECONDS,
        source=FOREIGN,
        notes=(*notes, *words.of_the_estimate(estimate)),
        gaps=base.spans(),
        acceleration=estimate.figures(),
        t=base.t,
        eta=unwrapped_eta(state),
        nu=rows['twist'],
        nu_d=rows.get('setpoint', unknown),
        nu_d_dot=unknown,
        tau=rows['wrench'],
        disturbance=None,
        disturbance_estimate=np.zeros((len(base.ns), 6)),
        applied=rows.get('wrench_applied'),
        unexplained=estimate.F,
        unexplained_error=estimate.error,
    )


def _name_of(bag: Path) -> str:
    """Name of a bag as a word that may name files."""
    return re.sub(r'[^A-Za-z0-9_.+-]', '_', bag.name if bag.is_dir() else bag.stem)[:100]


def _sampled(track: Track, base: TimeBase) -> np.ndarray:
    """Values of a signal at the samples, means over a step where it has several in one."""
    if not track.is_averaged(base.step):
        return at_times(track, base.ns)
    return means_over(track, base.ns - base.step // 2, base.ns + base.step // 2)
