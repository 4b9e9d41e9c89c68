"""The search for the excitation of most information, and the intervals that it promises.

The information is Fisher's, of the normal equations that `auv identify` would build from the
recording: of segments with starts of their own, for white noise of the sensors. What is made large
is the logarithm of det(1 + A), A that of theta in the prior's standard deviations (D-optimality):
the knowledge gained over the prior, whatever the units, in which no single coefficient that nothing
can tell outweighs all others, as it would in a sum of variances (A-optimality).
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from auv_analysis.output.text import join
from auv_analysis.scenario.scaling import scaled_case1
from auv_analysis.studies.excite.drive import (
    BEYOND,
    LEAST,
    WORDS,
    Bounds,
    Family,
    Motion,
    Request,
    motion_of,
    recorded,
    scenario_in_memory,
    scenario_of,
)
from auv_analysis.studies.identify.identified import Identified
from auv_analysis.studies.identify.identify import FEWEST, HISTORY, LONG, segment_length
from auv_analysis.studies.identify.output_error import BLOCKS, Fit, OutputError
from auv_analysis.studies.identify.prediction import held_of
from auv_analysis.studies.identify.record import Segment
from auv_analysis.studies.identify.unknowns import Unknowns, unknowns
from auv_analysis.studies.optimise import Search, sobol_points
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.plant.disturbance import Harmonics
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.model import Model
from auv_dynamics.vehicle.vehicle import Vehicle, make_model
from auv_gvc_controller.laws.multisine import MOST

PHASES, STARTS = 8, 8  # of random phases, and points of the search with the best of them
ROUNDS = {False: ((1, 8),), True: ((1, 4),)}  # by whether the loop is closed
DRAWS, CHECKED = {False: 15, True: 2}, {False: 63, True: 8}  # vehicles beside the prior
RESERVE = 0.95  # of the bounds: what the search may use, as the check draws other vehicles
TOLERANCE, APART = 1e-3, 0.1
HALVINGS = 7  # of the interval in which an amplitude is looked for that stays within the bounds
LENGTHS = (60.0, 45.0, 30.0, 20.0)  # s: the first that keeps its bounds, where none is told
STEPS, SMOOTH = (0.05, 0.02, 0.01, 0.005), 1.0  # s, and of time constants of damping
FASTER = 1.25  # times the speeds without excitation: what must be allowed
WIDER = ('--limit', '--speed', '--rate', '', '--depth or --tank')  # in the order of `WORDS`
LIGHT, CORRELATED = 0.02, 0.5  # of the weight, of off-diagonal inertia: what a spread of 1 is
Tick = Callable[[str, float], None]
Errors = list[dict[str, Any]]
Fleet = tuple[Model, Errors, int]  # as of `motion_of`
Drawn = tuple[np.ndarray, Fleet, Fleet]  # (k, 6, 6) phases in rad, vehicles of search and check


@dataclass(frozen=True, eq=False)
class Excited:
    """An excitation and what it promises.

    Attributes
    ----------
    request : what was asked for
    scenario : contents of its file
    motion : of the prior, then of vehicles drawn around it
    used : (V, 5) share of each bound that they use
    predicted : intervals of a recording of it
    case1 : those of case 1 of the same length, scaled to the vehicle; None: it diverges
    count : evaluations of the search

    """

    request: Request
    scenario: dict[str, Any]
    motion: Motion
    used: np.ndarray
    predicted: Identified
    case1: Identified | None
    count: int


def planned(
    request: Request, lengths: Sequence[float], bounds: Callable[[float, float], Bounds], tick: Tick
) -> Excited:
    """The excitation of the first length in which the motion keeps its bounds.

    Parameters
    ----------
    request : what is asked for; length and bounds of the open loop are those below
    lengths : s
    bounds : of speed and rate that must be allowed, m/s and rad/s
    tick : as of `excite`, which also has what is raised, of the last length

    """
    drawn = _drawn(request)

    def attempt(duration: float) -> Excited:
        steps = round(duration / request.step)
        tried = replace(request, duration=round(steps * request.step, 9))
        if not request.closed:
            tried = replace(tried, bounds=bounds(*unexcited(tried, drawn)))
        return excite(tried, tick, drawn)

    for duration in lengths[:-1]:
        with suppress(FailedError):
            return attempt(duration)
    return attempt(lengths[-1])


def excite(
    request: Request, tick: Tick = lambda text, share: None, drawn: Drawn | None = None
) -> Excited:
    """Find an excitation.

    Parameters
    ----------
    request : what is asked for
    tick : told what is being done, and how much of it is done
    drawn : phases and vehicles; None: as the request draws them

    Raises
    ------
    InputError : nothing to drive, or nothing free
    FailedError : the motion leaves its bounds, whatever is driven

    """
    phases, few, many = drawn or _drawn(request)
    families = [Family.of(request, phase) for phase in phases]
    if not len(families[0].driven):
        found = ', '.join(f'{value:g}' for value in request.hold)
        expected = 'more than what holds the vehicle still, in some degree of freedom'
        raise InputError('--limit', '', expected, f'still with {found} N, N m')
    speeds = np.repeat([request.bounds.speed, request.bounds.rate], 3) / 3.0
    u = _unknowns(request, speeds, request.bounds.wrench / 3.0)  # units that all candidates share
    if not u.entries:
        raise InputError('--free', '', 'a coefficient that is free', 'none')

    def evaluated(family: Family, x: np.ndarray) -> np.ndarray:
        motion = motion_of(request, family.waves(x), *few)
        used = np.maximum(request.bounds.used(motion).max(axis=0), 1e-3)
        return np.concatenate([-_gained(request, u, motion)[None], np.log(RESERVE / used.T)])

    low, high = families[0].box
    least = np.repeat([[np.log(LEAST), 0.0]], len(families[0].driven), axis=1)
    middle = np.zeros_like(least)
    motion = motion_of(request, families[0].waves(least), *many)
    _check(request, request.bounds.used(motion)[:, 0])  # what leaves them undriven always does
    gained = []
    for k, family in enumerate(families):
        tick('phases', k / PHASES)
        gained.append(evaluated(family, within(request, family, middle, few, RESERVE))[0, 0])
    family, rounds, count = families[int(np.argmin(gained))], ROUNDS[request.closed], 0
    total = STARTS + (2 * len(low) + 1) * sum(n * gradients for n, gradients in rounds)

    def counted(x: np.ndarray) -> np.ndarray:
        nonlocal count
        count += len(x)
        tick('amplitudes', min(count / total, 1.0))
        return evaluated(family, x)

    search = Search(counted, low, high, ['ineq'] * len(WORDS), TOLERANCE, APART)
    starts = np.vstack([middle, sobol_points(low, high, STARTS, request.seed)[1:]])
    best = search.run(within(request, family, starts, few, RESERVE), rounds)[None]
    tick('checking', 0.0)
    wave = family.waves(within(request, family, best, many, 1.0))
    motion = motion_of(request, wave, *many)
    used = request.bounds.used(motion)[:, 0]
    _check(request, used)
    predicted = prediction(request, motion.commands[0, 0], motion.states[0, 0])
    data = scenario_of(request, wave.part(0))
    return Excited(request, data, motion, used, predicted, of_case1(request), PHASES + count)


def usual_step(vehicle: Vehicle, bounds: Bounds) -> float:
    """Step of commands and measurements in s, in which damping at the largest speed does little."""
    damped = np.linalg.solve(vehicle.M, vehicle.D(np.repeat([bounds.speed, bounds.rate], 3)))
    rate = np.abs(np.linalg.eigvals(damped)).max()
    return next((step for step in STEPS if step * rate < SMOOTH), STEPS[-1])


def unexcited(request: Request, drawn: Drawn) -> tuple[float, float]:
    """Speed and rate, m/s and rad/s, that vehicles around the prior need without excitation.

    With some to spare; zero where an open loop of them leaves tilt or room.
    """
    phases, _, many = drawn
    offset, bounds = Family.of(request, phases[0]).offset, request.bounds
    rest = Harmonics(offset[None], (np.zeros((1, 0, 3)),) * 6)
    used = bounds.used(motion_of(request, rest, *many)).max(axis=(0, 1))
    if used[3:].max() > 1.0:
        return 0.0, 0.0
    return float(FASTER * used[1] * bounds.speed), float(FASTER * used[2] * bounds.rate)


def within(
    request: Request, family: Family, x: np.ndarray, fleet: Fleet, most: float
) -> np.ndarray:
    """Points (B, 2 m) with all amplitudes of each made less until its motions use `most`."""
    m = len(family.driven)

    def moved(shift: np.ndarray) -> np.ndarray:
        less = np.maximum(x[:, :m] + shift[:, None], np.log(LEAST))
        return np.concatenate([less, x[:, m:]], axis=1)

    def fits(shift: np.ndarray) -> np.ndarray:
        motion = motion_of(request, family.waves(moved(shift)), *fleet)
        return request.bounds.used(motion).max(axis=(0, 2)) <= most

    low, high = np.full(len(x), np.log(LEAST)), np.zeros(len(x))
    low = np.where(fits(high), high, low)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        good = fits(middle)
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return moved(low)


def _unknowns(request: Request, speeds: np.ndarray, wrenches: np.ndarray) -> Unknowns:
    fixed = [*request.fixed, *(['lag', 'delay'] if request.clipped else [])]
    return unknowns(
        request.vehicle, request.free, fixed, speeds=np.maximum(speeds, 1e-3),
        wrenches=wrenches, lag=request.lag,
    )  # fmt: skip


def _drawn(request: Request) -> Drawn:
    """What chance decides, whatever length and bounds are."""
    rng = np.random.default_rng(request.seed)
    phases = rng.uniform(0.0, 2.0 * np.pi, (PHASES, 6, MOST))
    few, many = (_fleet(request, rng, count[request.closed]) for count in (DRAWS, CHECKED))
    return phases, (*few, request.every), (*many, 1)


def _fleet(request: Request, rng: np.random.Generator, count: int) -> tuple[Model, Errors]:
    """The prior and vehicles around it: of the open loop, and of the closed one."""
    vehicle, spread = request.vehicle, request.spread
    one = np.ones(6)
    u = unknowns(vehicle, ('M',), speeds=one, wrenches=one)
    theta = rng.standard_normal((count + 1, len(u.entries))) * [
        spread * (0.5 if entry.is_log else CORRELATED) / entry.unit for entry in u.entries
    ]  # a diagonal entry of M goes as the square of what theta moves
    off = rng.standard_normal((2, count + 1, 1, 6))
    couple = float(np.abs(vehicle.model.hydrostatics[1:]).max())
    size = np.array([LIGHT * float(vehicle.weight), couple, couple, couple])
    light = rng.standard_normal((count + 1, 4)) * spread * size
    theta[0], off[:, 0], light[0] = 0.0, 0.0, 0.0
    found = u.coefficients(theta)
    models = make_model(
        found.M, vehicle.D_linear * np.exp(spread * off[0]),
        vehicle.D_quadratic * np.exp(spread * off[1]), found.hydrostatics + light,
        None if vehicle.lift is None else np.broadcast_to(vehicle.lift, found.M.shape),
    )  # fmt: skip
    errors: Errors = [{}]
    for k in range(count):
        a, b = spread * (np.array([1.0, -1.0]) if k < 2 else rng.uniform(-1.0, 1.0, 2))
        a, b = (-a, -b) if k == 1 else (a, b)
        dM, dD = (a * vehicle.M).tolist(), (b * np.diag(vehicle.D_linear)).tolist()
        errors.append({'kind': 'model_error', 'dM': dM, 'dD': dD})
    return models, errors


def _gained(request: Request, u: Unknowns, motion: Motion) -> np.ndarray:
    """(B,) knowledge gained per coefficient by recordings of the prior's motions, nats."""
    commands, states = motion.commands[0], motion.states[0]
    finite = np.isfinite(states).all(axis=(1, 2)) & np.isfinite(commands).all(axis=(1, 2))
    states = np.where(finite[:, None, None], states, states[:, :1])
    commands = np.where(finite[:, None, None], commands, 0.0)
    n, length, gained = len(u.entries), _usual(request), []
    for pair in zip(commands, states, strict=True):
        some = segments(request, *pair, length)
        problem = OutputError(request.vehicle, some, request.step, request.noise)
        A, _, _ = problem.normal(u, np.zeros(n), np.zeros((len(some), 9))).eliminated()
        gained.append(np.linalg.slogdet(np.eye(n) + A)[1] / (2 * n))
    return np.where(finite, gained, 0.0)


def _usual(request: Request) -> float:
    """Length of segments before the instability is known, s."""
    return min(LONG, (request.duration - HISTORY) / FEWEST)


def segments(
    request: Request, commands: np.ndarray, states: np.ndarray, length: float
) -> list[Segment]:
    """Segments of what would be recorded, as `segments_of` has them, without noise.

    Parameters
    ----------
    request : step
    commands, states : (n, 6) and (n // every + 1, 13)
    length : s

    """
    every = len(commands) // (len(states) - 1)
    before = every * int(np.ceil(HISTORY / request.step / every))
    n = every * max(round(length / request.step / every), 2)
    found = []
    for first in range(before, len(commands) - n + 1, n):
        rows = states[first // every : (first + n) // every + 1, 3:]
        found.append(Segment(
            commands[first - before : first], commands[first : first + n],
            np.arange(every, n + 1.0, every), rows[1:, 4:], rows[1:, :4], rows[0],
            first * request.step,
        ))  # fmt: skip
    return found


def prediction(request: Request, commands: np.ndarray, states: np.ndarray) -> Identified:
    """What `auv identify` would say of a recording if the prior were the vehicle.

    Parameters
    ----------
    request : what is free, noise, step
    commands, states : (n, 6) and (n + 1, 13) of the recording

    """
    u = _unknowns(request, *(np.sqrt((a**2).mean(axis=0)) for a in (states[:, 7:], commands)))
    theta = np.zeros(len(u.entries))

    def problem(length: float) -> OutputError:
        some = segments(request, commands, states, length)
        return OutputError(request.vehicle, some, request.step, request.noise)

    final = problem(segment_length(problem(_usual(request)), u, theta))
    starts = np.zeros((len(final.segments), 9))
    rows = 9 * sum(len(one.at) for one in final.segments)
    information, _, _ = final.normal(u, theta, starts).eliminated()
    fit = Fit(u, theta, starts, 0.0, information, rows, max(BLOCKS, len(starts)))
    covariance = np.linalg.inv(information + np.eye(len(theta)))
    return Identified(request.vehicle, [], held_of([], HISTORY), final, fit, covariance, [], {}, ())


def of_case1(request: Request) -> Identified | None:
    """The same for case 1 of the paper, scaled to the vehicle, of the same length."""
    scaled = scaled_case1(request.given)
    data = {
        'name': scaled['name'], 'vehicle': scaled['vehicle'], 'setpoint': scaled['setpoint'],
        'controllers': {'gvc': request.loop}, 'actuators': {'lag': request.lag},
        'duration': request.duration, 'step': request.step,
    }  # fmt: skip
    commands, states = recorded(scenario_in_memory(request, data), 'gvc')
    if not np.isfinite(states).all():
        return None
    return prediction(request, commands, states)


def _check(request: Request, used: np.ndarray) -> None:
    """Raise FailedError where a vehicle leaves the bounds."""
    worst = used.max(axis=0)
    if np.all(worst <= 1.0):
        return
    wrench = request.bounds.wrench
    said = f'{request.vehicle.name}: the {"closed" if request.closed else "open"} loop'
    if request.clipped:
        said += f', in which nothing drives {join([DOFS[i] for i in np.flatnonzero(wrench == 0)])},'
    if worst.max() >= BEYOND:
        raise FailedError(f'{said} diverges: a smaller --step{" or --lag" * request.closed}')
    over = [0] if worst[0] > 1.0 else np.flatnonzero(worst > 1.0).tolist()  # it limits the rest
    wider, near = [WIDER[k] for k in over], bool(used[0].max() <= 1.0)
    ways = [f'a larger {join(wider)}'] * all(wider) + ['a smaller --spread'] * near
    ways += ['--closed-loop'] * (not request.closed)
    if over == [0] and np.all(np.abs(request.hold) <= wrench):  # it may be the loop that swings
        ways.append('a smaller --lag or --step')
    whose = 'a vehicle near the prior' if near else 'the vehicle, or one near it,'
    shares = join([f'{worst[k]:.3g} times the {WORDS[k]}' for k in over])
    raise FailedError(f'{said} leaves its bounds: {whose} takes {shares} that is allowed'
                      + f': {", ".join(ways)}' * bool(ways))  # fmt: skip
