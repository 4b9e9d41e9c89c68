"""The unexplained wrench: F of (1) from measured motion and wrench, with its error.

From (1), F is the rate of the impulse less the momentum,

    F = d/dt [ integral of (tau - C nu - D nu - g) dt - M nu ],

so that the only rate to be estimated is that of a signal that stays smooth where tau and nu_dot
jump: a rate of nu alone would smear a step of tau into F. Where no wrench was recorded, -F of
tau = 0 is the wrench that the motion needed: M nu_dot + C nu + D nu + g.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from auv_analysis.bag.any_bag import survey
from auv_analysis.bag.foreign_checks import contradictions
from auv_analysis.bag.foreign_fields import EULER, FORCE, TORQUE
from auv_analysis.bag.foreign_messages import read_sources
from auv_analysis.bag.foreign_topics import MOTION, SHOWN, TopicMap, candidates
from auv_analysis.bag.foreign_tracks import tracks_of, unknown_angles
from auv_analysis.bag.load import Recording
from auv_analysis.bag.tracks import (
    TimeBase,
    Track,
    at_times,
    integral,
    means_over,
    sensible_step,
    time_base,
)
from auv_analysis.metrics.energy import depends_on_known
from auv_analysis.metrics.local_polynomials import (
    ORDER,
    Stretch,
    filtered,
    given_window,
    narrow_window,
    variance,
)
from auv_analysis.runs.run import FOREIGN, Run
from auv_analysis.scenario.scaling import UNFIT
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import read_text
from auv_dynamics.kernel.compile import plain
from auv_dynamics.plant.plant import unwrapped_eta
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.kinematics import quaternion
from auv_dynamics.vehicle.model import coriolis, damping, restoring
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_dynamics.vehicle.vehicle_file import load_vehicle

FILTER = 'local polynomials of order 3 (Savitzky-Golay for uneven stamps)'
PROBES = 20  # motions by which is found what a wrench depends on
SAME = 1e-12  # of the largest wrench
LEVEL = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)  # pose, of an attitude that is not known
FINEST = 200  # steps in a period of the velocity: time and memory follow the size of the file
SMALL = 1e-6  # m/s, rad/s: step of the differences that tell how resistance depends on nu


@dataclass(frozen=True, eq=False)
class Unexplained:
    """F with what is known of its error.

    Attributes
    ----------
    F : (n, 6) N and N m, body frame
    error : (n, 6) standard error of each, N and N m
    window : (6,) s, of the filter
    nu_dot_error : (6,) root mean square of the error of nu_dot that goes with it, m/s2 and rad/s2
    noise : (6,) standard deviation of white noise found in nu, m/s and rad/s

    """

    F: np.ndarray
    error: np.ndarray
    window: np.ndarray
    nu_dot_error: np.ndarray
    noise: np.ndarray

    def figures(self) -> dict[str, Any]:
        """Method of the acceleration's estimate, for `summary.json`."""
        return {
            'filter': FILTER,
            'order': ORDER,
            'window': self.window.tolist(),
            'velocity_noise': self.noise.tolist(),
            'error_rms': self.nu_dot_error.tolist(),
        }


def unexplained(
    vehicle: Vehicle,
    base: TimeBase,
    pose: Track,
    twist: Track,
    tau: Track | None,
    window: float | None,
    unknown: Collection[str] = (),
) -> Unexplained:
    """Estimate F of (1) at the samples of a time base; NaN where it needs what was not recorded.

    Parameters
    ----------
    vehicle : the model
    base : whose samples are asked for
    pose, twist, tau : motion and the wrench that acted; None: the one that would be needed is -F
    window : s, None: by its error, per degree of freedom
    unknown : angles that were not recorded, of phi, theta and psi

    """
    moved = ~np.isnan(twist.rows[0])
    known = told_by(vehicle, moved, [angle not in unknown for angle in EULER])
    if not moved.all():
        twist = replace(twist, rows=np.where(moved, twist.rows, 0.0))
    if len(unknown) == len(EULER):
        pose = replace(pose, rows=np.tile(LEVEL, (len(pose.ns), 1)))
    parts = [slice(*np.searchsorted(twist.ns, [begin, end + 1])) for begin, end in base.stretches]
    velocities = [(twist.ns[inside], twist.rows[inside]) for inside in parts]
    seconds = [(ns - base.ns[0]) / NANOSECONDS for ns, _ in velocities]
    noise = variance(zip(seconds, (nu for _, nu in velocities), strict=True))
    stretches = [
        _stretch(vehicle, pose, tau, (t, ns, nu), base.t[base.owner == i], noise)
        for i, (t, (ns, nu)) in enumerate(zip(seconds, velocities, strict=True))
    ]
    period = twist.period / NANOSECONDS
    counts = given_window(window, period) if window else narrow_window(stretches)
    F, error = (
        np.where(known, part, np.nan)
        for part in filtered(stretches, counts, base.step / NANOSECONDS)
    )
    inverse = np.linalg.inv(vehicle.M)
    nu_dot_error = np.sqrt((error**2 @ (inverse**2).T).mean(axis=0))
    windows = np.where(known, counts * period, np.nan)
    noise = np.where(moved, noise, np.nan)
    return Unexplained(F, error, windows, nu_dot_error, np.sqrt(noise))


def told_by(vehicle: Vehicle, velocity: np.ndarray, angles: Sequence[bool]) -> np.ndarray:
    """Whether each row of M nu_dot + C nu + D nu + g can be told by the structure of the model.

    Parameters
    ----------
    vehicle : the model
    velocity : (6,) which velocities are known
    angles : (3,) which of phi, theta and psi are

    Returns
    -------
    told : (6,) rows whose value needs none of the others

    """
    if velocity.all() and np.all(angles):
        return np.ones(6, bool)
    one, other = np.random.default_rng(0).uniform(-1.0, 1.0, (2, PROBES, 9))
    other = np.where([*velocity, *angles], one, other)
    wrench, moved = (resistance(vehicle, x[:, :6], quaternion(x[:, 6:])) for x in (one, other))
    same = np.abs(moved - wrench).max(axis=0) <= SAME * np.abs(wrench).max()
    return same & depends_on_known(vehicle.M, velocity)


def _stretch(
    vehicle: Vehicle,
    pose: Track,
    tau: Track | None,
    samples: tuple[np.ndarray, np.ndarray, np.ndarray],
    at: np.ndarray,
    noise: np.ndarray,
) -> Stretch:
    """Impulse less momentum at the velocity samples: times in s and ns, velocities."""
    t, ns, nu = samples
    attitude = at_times(pose, ns)[:, 3:]
    resisted = resistance(vehicle, nu, attitude)
    fine = cumulative_trapezoid(resisted, t, axis=0, initial=0.0)
    coarse = cumulative_trapezoid(resisted[::2], t[::2], axis=0, initial=0.0)
    apart = (fine[::2] - coarse) / 3.0  # Richardson: the error of the finer one is of order 2
    y = (0.0 if tau is None else integral(tau, ns)) - fine - nu @ vehicle.M.T
    spread = np.zeros(nu.shape)  # of the resistance by noise of the velocity
    for i in range(6):
        moved = resistance(vehicle, nu + SMALL * np.eye(6)[i], attitude)
        spread += ((moved - resisted) / SMALL) ** 2 * noise[i]
    doubt = np.stack([np.interp(t, t[::2], column) for column in apart.T], axis=1)
    return Stretch(t, y - y[0], doubt, spread, at)


def resistance(vehicle: Vehicle, nu: np.ndarray, attitude: np.ndarray) -> np.ndarray:
    """C nu + D nu + g (n, 6) in N and N m of velocities (n, 6) and quaternions (n, 4)."""
    model, columns = vehicle.model, tuple(nu.T)
    terms = (
        plain(coriolis)(model.M, columns, columns),
        plain(damping)(model, columns, columns),
        plain(restoring)(model, tuple(attitude.T)),
    )
    return np.sum([np.stack(np.broadcast_arrays(*term), axis=1) for term in terms], axis=0)


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
    notes += _notes_on_missing(bag, mapping)
    text = read_text(shipped('vehicles', mapping.vehicle), 'vehicle')
    tracks, otherwise = tracks_of(read_sources(bag, mapping, notes), mapping, vehicle, notes)
    notes += contradictions(tracks, otherwise, mapping)
    step = round((mapping.step or 0.0) * NANOSECONDS) or sensible_step(tracks['twist'].period)
    if step * FINEST < tracks['twist'].period:
        least = tracks['twist'].period / FINEST / NANOSECONDS
        expected = f'at least {least:.3g} s, of which {FINEST} make a period of the velocity'
        raise InputError(mapping.origin, 'step', expected, mapping.step)
    base = time_base([*tracks.values()], tracks['twist'], step)
    if len(base.ns) < 2:
        expected = 'a time with all mapped topics and velocities enough for rates'
        raise InputError(bag, '', expected, _time_spans(tracks.values()))
    notes += _notes_on_time_base(base, tracks)
    return Recording(_run(bag, mapping, vehicle, base, tracks, notes), {'vehicle.yaml': text})


def _run(
    bag: Path,
    mapping: TopicMap,
    vehicle: Vehicle,
    base: TimeBase,
    tracks: Mapping[str, Track],
    notes: list[str],
) -> Run:
    acted = tracks.get('wrench_applied', tracks.get('wrench'))
    lacking = unknown_angles(tracks['pose'], mapping)
    estimate = unexplained(
        vehicle, base, tracks['pose'], tracks['twist'], acted, mapping.window, lacking
    )
    found: dict[str, Any] = {'unexplained': estimate.F, 'unexplained_error': estimate.error}
    if acted is None:
        found = {'required_wrench': -estimate.F, 'required_wrench_error': estimate.error}
    rows = {role: _sampled(track, base) for role, track in tracks.items()}
    unknown = np.full((len(base.ns), 6), np.nan)
    state = np.concatenate([rows['pose'], rows['twist']], axis=1)
    eta = unwrapped_eta(state)
    eta[:, 3:][:, [angle in lacking for angle in EULER]] = np.nan
    tau = rows.get('wrench', unknown)
    place = bag.resolve()
    name = mapping.name or UNFIT.sub('_', place.name if place.is_dir() else place.stem)[:100]
    return Run(
        vehicle=vehicle,
        scenario=name,
        controller=name,
        law='unknown',
        gains={},
        step=base.step / NANOSECONDS,
        source=FOREIGN,
        notes=(
            *notes,
            *_notes_on_run(eta, rows['twist'], tau),
            *_notes_on_estimate(estimate, acted),
        ),
        gaps=base.spans(),
        acceleration=estimate.figures(),
        t=base.t,
        eta=eta,
        nu=rows['twist'],
        nu_d=rows.get('setpoint', unknown),
        nu_d_dot=unknown,
        tau=tau,
        disturbance=None,
        disturbance_estimate=np.zeros((len(base.ns), 6)),
        applied=rows.get('wrench_applied'),
        **found,
    )


def _sampled(track: Track, base: TimeBase) -> np.ndarray:
    """Values of a signal at the samples, means over a step where it has several in one."""
    if not track.is_averaged(base.step):
        return at_times(track, base.ns)
    return means_over(track, base.ns - base.step // 2, base.ns + base.step // 2)


def _notes_on_time_base(base: TimeBase, tracks: Mapping[str, Track]) -> list[str]:
    """Step, methods of resampling, gaps."""
    step = base.step / NANOSECONDS
    notes = [f'time base: {step:.6g} s, from the first time at which all mapped topics are known']
    between = [_between(role, track, base.step) for role, track in tracks.items()]
    notes.append(f'resampling: {"; ".join(between)}')
    notes += dict.fromkeys(note for track in tracks.values() for note in _gaps(track))
    spans = base.spans()
    if spans:
        lost = sum(end - begin for begin, end in spans)
        notes.append(
            f'no samples in {_counted(len(spans), "gap")}, {lost:.6g} s together: nothing is '
            'interpolated across'
        )
    if base.left_out:
        notes.append(f'{_counted(base.left_out, "part")} between gaps too short to be of use')
    ns = tracks['twist'].ns
    before, behind = (int(t) / NANOSECONDS for t in (base.ns[0] - ns[0], ns[-1] - base.ns[-1]))
    if max(before, behind) > 2.0 * step:
        notes.append(
            f'velocities of {before:.6g} s before and {behind:.6g} s behind the samples are not '
            'used: there another topic is missing'
        )
    return notes


def _notes_on_missing(bag: Path, mapping: TopicMap) -> list[str]:
    """That no wrench was mapped, and which topics might have been."""
    if mapping.knows_wrench:
        return []
    found = candidates(survey(bag))
    there = [topic for role in ('wrench', 'thrusters') for topic in found[role]]
    hint = f'; {", ".join(there[:SHOWN])} of the bag may be one' if there else ''
    return [
        'no wrench was mapped: F, the input and what rests on them are not known; the wrench that '
        f'the motion needed is estimated in their place{hint}'
    ]


def _notes_on_run(eta: np.ndarray, nu: np.ndarray, tau: np.ndarray) -> list[str]:
    """Components of the motion and of a recorded wrench that are not known."""
    rows = np.concatenate([eta[0], nu[0], [] if np.isnan(tau[0]).all() else tau[0]])
    names = (*MOTION, *(f'tau_{axis}' for axis in FORCE + TORQUE))
    lacking = [name for name, x in zip(names, rows, strict=False) if np.isnan(x)]
    if not lacking:
        return []
    return [f'not recorded: {", ".join(lacking)}; what depends on them is left out, never zero']


def _notes_on_estimate(found: Unexplained, acted: Track | None) -> list[str]:
    """Filter of the estimated wrench, and what its error does not hold."""
    what = 'F by (1)' if acted else 'the wrench that the motion needed'
    windows = {dof: w for dof, w in zip(DOFS, found.window, strict=True) if not np.isnan(w)}
    if not windows:
        return [f'{what} is not estimated: every row of (1) needs what was not recorded']
    listed = ', '.join(f'{dof} {time:.3g} s' for dof, time in windows.items())
    late = 'nor a wrench that acted at another time, ' if acted else ''
    return [
        f'{what} is estimated, not known: rate of impulse less momentum by {FILTER}; windows '
        f'{listed}. Its error counts white noise of the velocity and the bias of the filter, '
        f'neither noise that is correlated over the window, {late}nor an error of the model: M, D '
        'and g are taken as the vehicle file has them'
    ]


def _time_spans(tracks: Iterable[Track]) -> str:
    """When each topic was there, s from the first of all, for a refusal."""
    tracks = list(tracks)
    origin = min(int(track.ns[0]) for track in tracks)
    parts = []
    for track in tracks:
        begin, end = ((int(ns) - origin) / NANOSECONDS for ns in (track.ns[0], track.ns[-1]))
        parts.append(f'{track.topic} {begin:.6g} to {end:.6g} s')
    return ', '.join(dict.fromkeys(parts))


def _between(role: str, track: Track, step: int) -> str:
    name = role.replace('_', ' ')
    if role == 'pose':
        return 'position by straight lines, attitude by slerp'
    if track.is_averaged(step):
        return f'{name} by its mean over each step, against aliasing'
    if track.held:
        return f'{name} held until the next message'
    return f'{"velocity" if role == "twist" else name} by straight lines between its samples'


def _counted(number: int, word: str) -> str:
    return f'{number} {word}{"" if number == 1 else "s"}'


def _gaps(track: Track) -> list[str]:
    """Pauses of a topic that are gaps; the same of the pose and velocity of an odometry."""
    found = track.gaps()
    if not len(found):
        return []
    lost = float((found[:, 1] - found[:, 0]).sum()) / NANOSECONDS
    longer = f'longer than {track.limit / NANOSECONDS:.3g} s'
    counted = _counted(len(found), 'pause')
    return [f'{track.topic}: {counted} {longer}, {lost:.6g} s together']
