"""The identification: from recordings and a prior to a model with its uncertainty."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from auv_analysis.output.text import join
from auv_analysis.studies.identify.identified import Identified
from auv_analysis.studies.identify.intervals import bootstrap, far_from_quadratic, profile
from auv_analysis.studies.identify.output_error import UNSEEN, Fit, OutputError
from auv_analysis.studies.identify.prediction import (
    BlackBox,
    Held,
    compare,
    held_of,
    persistence,
    predict,
)
from auv_analysis.studies.identify.record import Record, long_enough, segments_of
from auv_analysis.studies.identify.start import least_squares_start
from auv_analysis.studies.identify.unknowns import (
    DEFAULT,
    Entry,
    Unknowns,
    named,
    unknowns,
)
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_dynamics.vehicle.vehicle_file import is_semidefinite

SHORT, LONG = 1.25, 10.0  # s, of segments of the first fit, and at most
UNMEASURED = 5.0  # s, of the first fit where a velocity is not measured: each start guesses it
GROWTH = 10.0  # of a start's error, up to which a segment goes on
FEWEST = 4  # segments
FIRST = 240  # segments, evenly chosen, that are enough for the first fit
HISTORY = 0.6  # s of commands before a segment
PLAUSIBLE = 9.0  # more cost: a delay is not worth a thought
NEARBY = 30.0  # more cost: no better delay lies in that direction
MOVING = 2.0  # times the noise: a degree of freedom that moves less tells little
SEEN = 2.0  # deviations: a difference between fits that is no chance
TRUSTED = 0.3  # of the wide prior deviation, of what an axis would tell that nobody measured
GAINS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5)  # of the observer
AUTO = 'auto'
STILL = 5.0  # times the noise: a vehicle that moves less is at rest
Say = Callable[[str], None]


@dataclass(frozen=True)
class Settings:
    """Settings of an identification.

    Attributes
    ----------
    free, fixed : as of `unknowns`
    believed : name -> (value, standard deviation)
    segment : s, None: by the instability of the vehicle
    observer : gain by which the simulated state follows the measurements, from 0 to below 1; None:
        the one of `GAINS` with the least error of prediction
    bootstrap : number of recordings that are drawn from blocks of time; 0: none
    profile : names whose profile likelihood is taken; 'auto': where the cost is no parabola
    origin : of `believed`, named in errors

    """

    free: Sequence[str] = DEFAULT
    fixed: Sequence[str] = ()
    believed: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    segment: float | None = None
    observer: float | None = 0.0
    bootstrap: int = 0
    profile: Sequence[str] = ()
    origin: object = 'options'


def split(records: Sequence[Record], share: float) -> tuple[list[Record], list[Record]]:
    """Recordings before a moment and behind it, which leaves a share of their length.

    Raises
    ------
    InputError : less than a second before it

    """
    total = sum(record.end - record.start for record in records)
    left, first, last = total * (1.0 - share), [], []
    for record in records:
        first.append(record.part(record.start, record.start + left))
        last.append(record.part(record.start + left, record.end))
        left -= record.end - record.start
    first, last = long_enough(first), long_enough(last)
    if not first:
        expected = 'a share that leaves a second with nine samples and more to learn from'
        raise InputError('--holdout', '', expected, f'{share:g} of {total:.3g} s')
    return first, last


def identify(
    training: Sequence[Record],
    held: Sequence[Record],
    vehicle: Vehicle,
    settings: Settings | None = None,
    say: Say = lambda text: None,
) -> Identified:
    """Identify a model.

    Parameters
    ----------
    training, held : recordings with the same commands; those held out are predicted only
    vehicle : the prior
    settings : None: the usual ones
    say : told what is being done

    Raises
    ------
    InputError : recordings from which nothing can be learned

    """
    settings = settings or Settings()
    step = training[0].step
    noise = _noise(training)
    check_motion(training, noise)
    u = unknowns(
        vehicle, settings.free, settings.fixed,
        speeds=_speeds(training),
        wrenches=_rms([record.command for record in training]),
        believed=settings.believed, origin=settings.origin,
    )  # fmt: skip
    u = _trusting(u, ~np.isnan(noise[:6]))
    asked = named([n for n in settings.profile if n != AUTO], u.entries, '--profile', 'options')
    still = _still(training, noise, u)
    every, u = u, u.without([entry.name for entry in still])
    if not u.entries:
        raise InputError('--free', '', 'a coefficient that is free, beside the delay', 'none')
    say('least squares')
    theta, late, wrong = least_squares_start(training, u, vehicle.lift)
    if wrong:
        expected = 'a wrench that accelerates the vehicle its own way (axes FLU in place of FSD?)'
        raise InputError(training[0].name, 'wrench', expected, f'the opposite in {join(wrong)}')

    def problem(length: float, gain: float = 0.0, most: int | None = None) -> OutputError:
        segments = [s for record in training for s in segments_of(record, length, HISTORY)]
        if not segments:
            raise InputError(
                training[0].name, '--segment', f'at most {room:.3g} s', f'{length:g} s'
            )
        every = -(-len(segments) // most) if most else 1
        return OutputError(vehicle, segments[::every], step, noise, observer=gain)

    rooms = step * (np.sort([len(r.command) for r in training]) - int(np.ceil(HISTORY / step)))
    room, half = rooms[-1], np.searchsorted(np.cumsum(rooms), rooms.sum() / 2)
    longest = min(sum(r.end - r.start for r in training) / FEWEST, LONG, float(rooms[half]))
    if settings.segment:
        problem(settings.segment)  # refused before anything is fitted
    shortest = min(UNMEASURED if np.isnan(noise[:6]).any() else SHORT, longest)
    final, halves, tried = _search(problem, (u, theta, late), (shortest, longest), settings, say)
    whole = final.fit(tried[0].unknowns, tried[0].theta, tried[0].starts)
    beside = _between(tried) + _bias(whole, halves) + _of_still(final, whole, every)
    covariance = final.covariance(whole) + beside
    fit, zeros = _dissipative(final, whole, covariance)
    kept = [whole.unknowns.names.index(name) for name in fit.unknowns.names]
    covariance, beside = covariance[np.ix_(kept, kept)], beside[np.ix_(kept, kept)]
    draws = np.zeros((0, len(kept)))
    if settings.bootstrap:
        say(f'{settings.bootstrap} refits to blocks of time drawn anew')
        draws = bootstrap(final, fit, settings.bootstrap, beside)
    if AUTO in settings.profile:
        asked |= set(far_from_quadratic(final, fit, covariance))
    profiles, chosen = [], [name for name in fit.unknowns.names if name in asked]
    for k, name in enumerate(chosen, start=1):  # ten refits each
        say(f'profile likelihood {k} of {len(chosen)}: {name}')
        profiles.append(profile(final, fit, covariance, name))
    say('prediction of what was held out')
    moments = held_of(held, HISTORY)
    rows = compared(training, moments, vehicle, (fit.unknowns, fit.theta))
    return Identified(
        vehicle, training, moments, final, fit, covariance, rows, zeros, still, draws, profiles
    )


def _search(
    problem: Callable[..., OutputError],
    begun: tuple[Unknowns, np.ndarray, float],
    lengths: tuple[float, float],
    settings: Settings,
    say: Say,
) -> tuple[OutputError, OutputError, list[Fit]]:
    """Fit over segments as long as the vehicle's instability allows.

    Parameters
    ----------
    problem : segments of a length in s, with the gain of the observer, and at most so many
    begun : unknowns, where to begin, and lag and delay together, s
    lengths : s, of the first segments, and of all at most
    settings : of which segment and observer count
    say : told what is being done

    Returns
    -------
    problem, halves : the segments, and segments of half their length
    tried : fits with neighbouring delays, the best one first

    """
    (u, theta, late), (shortest, longest) = begun, lengths
    first = _with_best_delay(problem(shortest, most=FIRST), u, theta, late, NEARBY)[0]
    u, theta = first.unknowns, first.theta

    def suited(gain: float) -> float:
        return settings.segment or min(segment_length(problem(longest, gain), u, theta), longest)

    length, gain = suited(0.0), settings.observer
    if gain is None:
        gain = _best_observer(problem(length), u, theta)
    if gain:
        length = suited(gain)
    say(f'output error over segments of {length:.3g} s')
    final = problem(length, gain)
    late = float(u.coefficients(theta).lag + u.prior.delay)
    return final, problem(length / 2, gain), _with_best_delay(final, u, theta, late, PLAUSIBLE)


def compared(
    training: Sequence[Record],
    moments: Held,
    vehicle: Vehicle,
    model: tuple[Unknowns, np.ndarray] | None = None,
    lag: float = 0.0,
    delay: float = 0.0,
) -> list[dict[str, Any]]:
    """Rows of `compare`: the new model, where there is one, the vehicle as filed, the others.

    Parameters
    ----------
    training : what the black box learns from
    moments : what is predicted
    vehicle : whose errors the others' are compared with
    model : the new one
    lag, delay : of the actuators of the vehicle as filed, s

    """
    if not moments.count:
        return []
    errors = {'new': predict(moments, vehicle, *model)} if model else {}
    filed = predict(moments, vehicle, *as_filed(vehicle, lag, delay))
    errors |= {'prior' if model else vehicle.name: filed, 'persistence': persistence(moments)}
    errors['black box'] = BlackBox(training).predict(moments)
    return compare(errors, moments, vehicle.M)


def as_filed(vehicle: Vehicle, lag: float = 0.0, delay: float = 0.0) -> tuple[Unknowns, np.ndarray]:
    """A vehicle with nothing free, for its prediction."""
    one = np.ones(6)
    found = unknowns(vehicle, (), speeds=one, wrenches=one, lag=lag)
    return found.with_delay(delay), np.zeros(0)


def check_motion(records: Sequence[Record], noise: np.ndarray) -> None:
    """Refuse recordings of a vehicle at rest, or without a command."""
    name = records[0].name
    moved = np.sqrt([
        np.mean([np.nanvar(r.velocity[:, i]) for r in records if r.known[i]] or [0.0])
        for i in range(6)
    ])  # fmt: skip
    if np.all(moved < STILL * np.nan_to_num(noise[:6], nan=np.inf)):
        raise InputError(name, '', f'velocities that change by more than {STILL:g} times their '
                         'noise', 'a vehicle at rest')  # fmt: skip
    if all(np.ptp(record.command, axis=0).max() == 0.0 for record in records):
        raise InputError(name, 'wrench', 'a command that changes', 'a constant one')


def _noise(records: Sequence[Record]) -> np.ndarray:
    """(9,) as of `Record.noise`, of all recordings together."""
    found = _rms([record.noise()[None] for record in records])
    return np.where(found > 0.0, found, np.nan)


def _still(records: Sequence[Record], noise: np.ndarray, u: Unknowns) -> list[Entry]:
    """Unknowns of degrees of freedom that move by hardly more than the noise of their velocity.

    What moves them then is the noise itself, through the controller: fits to that are biased.
    """
    moved = _rms([nu - np.nan_to_num(nu).mean(axis=0) for nu in map(Record.evenly, records)])
    known = np.any([record.known for record in records], axis=0)
    still = known & (moved < MOVING * np.nan_to_num(noise[:6]))
    inertial = ('M', 'D_linear', 'D_quadratic')
    return [e for e in u.entries if e.group in inertial and all(still[i] for i in e.index)]


def _of_still(problem: OutputError, fit: Fit, every: Unknowns) -> np.ndarray:
    """(n, n) what theta is unsure by, as unknowns that were not searched keep their prior."""
    every = every.with_delay(float(fit.unknowns.prior.delay))
    names = fit.unknowns.names
    kept = [every.names.index(name) for name in names]
    rest = [k for k, name in enumerate(every.names) if name not in names]
    if not rest:
        return np.zeros((len(names), len(names)))
    theta = np.zeros(len(every.entries))
    theta[kept] = fit.theta
    S = problem.normal(every, theta, fit.starts).eliminated()[0]
    P, _ = every.precision(theta)
    moved = np.linalg.solve((S + P)[np.ix_(kept, kept)], S[np.ix_(kept, rest)])
    return moved @ np.linalg.inv(P[np.ix_(rest, rest)]) @ moved.T


def _speeds(records: Sequence[Record]) -> np.ndarray:
    """(6,) root mean squares of the velocities, a usual size where none was measured."""
    known = np.any([record.known for record in records], axis=0)
    moved = _rms([record.velocity for record in records])
    return np.where(known, np.maximum(moved, 1e-3), UNSEEN)


def _trusting(u: Unknowns, known: np.ndarray) -> Unknowns:
    """The same with less doubt in the prior of what an axis would tell that nobody measured.

    Its wide default would let a velocity that is not known take up what else the model is wrong in.
    """
    inertial = ('M', 'D_linear', 'D_quadratic')
    entries = (
        replace(e, unit=TRUSTED * e.unit)
        if e.group in inertial and not known[[*e.index]].all() else e
        for e in u.entries
    )  # fmt: skip
    return replace(u, entries=tuple(entries))


def _rms(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """Root mean square of what is known of each column, zero of none."""
    every = np.concatenate(arrays)
    count = np.isfinite(every).sum(axis=0)
    return np.sqrt(np.nansum(every**2, axis=0) / np.maximum(count, 1))


def _with_best_delay(
    problem: OutputError, u: Unknowns, theta: np.ndarray, late: float, nearby: float
) -> list[Fit]:
    """Fits with delays in whole steps, between which the cost has kinks; the best one first.

    Parameters
    ----------
    problem, u, theta : segments, unknowns and where to begin
    late : s, lag and delay together
    nearby : how much the cost may rise on the way to a better delay

    """
    names = u.names

    def attempt(steps: int, theta: np.ndarray, starts: np.ndarray | None = None) -> Fit:
        late = u.with_delay(steps * problem.step)
        return problem.fit(late, theta, starts, most=25, tolerance=1e-5)

    def with_lag(theta: np.ndarray, lag: float) -> np.ndarray:
        theta = theta.copy()
        if 'lag' in names:
            k = names.index('lag')
            theta[k] = np.log(max(lag, 0.005) / float(u.prior.lag)) / u.entries[k].unit
        return theta

    if not u.is_delay_free:
        lag = late - float(u.prior.delay)
        return [problem.fit(u, with_lag(theta, lag), most=25, tolerance=1e-5)]
    k = round(float(u.prior.delay) / problem.step)
    if not k:
        k = round(late / problem.step / (2 if 'lag' in names else 1))
    tried = {k: attempt(k, with_lag(theta, late - k * problem.step))}
    for way in (-1, 1):
        j = k
        while 0 <= j + way <= np.ceil(HISTORY / problem.step) and j + way not in tried:
            lag = float(u.coefficients(tried[j].theta).lag) - way * problem.step
            tried[j + way] = attempt(j + way, with_lag(tried[j].theta, lag), tried[j].starts)
            if tried[j + way].cost > tried[j].cost + nearby:
                break
            j += way
    return sorted(tried.values(), key=lambda fit: fit.cost)


def _best_observer(problem: OutputError, u: Unknowns, theta: np.ndarray) -> float:
    """The gain of the observer with the least error of prediction; 0 where none is clearly less."""
    begun = problem.fit(u, theta, most=10, tolerance=1e-4)
    costs = {gain: replace(problem, observer=gain).cost(u, begun.theta, begun.starts)
             for gain in GAINS}  # fmt: skip
    best = min(GAINS, key=lambda gain: costs[gain])
    return best if costs[best] < begun.cost - PLAUSIBLE else 0.0


def _between(tried: Sequence[Fit]) -> np.ndarray:
    """(n, n) what theta is unsure by, as the delay is: fits weighted by their likelihood."""
    weights = np.exp([(tried[0].cost - fit.cost) / 2 for fit in tried])
    apart = np.array([fit.theta - tried[0].theta for fit in tried])
    return np.einsum('f,fi,fj->ij', weights / weights.sum(), apart, apart)


def _bias(fit: Fit, halves: OutputError) -> np.ndarray:
    """(n, n) what the bias of a fit with free starts may be, squared; zero where none is seen.

    Where the motion is hardly more than what the noise makes the controller do, starts fitted to
    that noise bias the rest, by twice as much over segments of half the length (Dhaene and
    Jochmans, 2015).
    """
    other = halves.fit(fit.unknowns, fit.theta, most=15, tolerance=1e-5)
    moved = fit.theta - other.theta
    seen = np.abs(moved) > SEEN * np.sqrt(np.diag(halves.covariance(other)))
    return np.outer(moved, moved) if seen.any() else np.zeros((len(moved), len(moved)))


def segment_length(problem: OutputError, u: Unknowns, theta: np.ndarray) -> float:
    """Length of a segment, s: until an error of its start has grown tenfold."""
    grown = np.flatnonzero(problem.growth(u, theta) > GROWTH)
    steps = int(grown[0]) if len(grown) else len(problem.segments[0].command)
    return max(steps * problem.step, SHORT)


def _dissipative(
    problem: OutputError, fit: Fit, covariance: np.ndarray
) -> tuple[Fit, dict[Entry, float | None]]:
    """The fit without damping that feeds energy: what came out negative is held at zero.

    So are couplings with which linear damping is not positive semidefinite, free or not.

    Returns
    -------
    fit : without it
    zeros : what is held, with the upper end of its interval, by the covariance (n, n); of a
        coupling None

    """
    half = fit.quantile * np.sqrt(np.diag(covariance))
    values, entries = fit.unknowns.values(fit.theta), fit.unknowns.entries
    zeros: dict[Entry, float | None] = {
        entry: max(float(values[k] + half[k] * entry.unit), 0.0) for k, entry in enumerate(entries)
        if entry.group.startswith('D_') and len(set(entry.index)) == 1 and values[k] < 0.0
    }  # fmt: skip
    pair = () if zeros else feeding(fit.unknowns.coefficients(fit.theta).D_linear)
    if pair:
        one = np.ones(6)
        every = unknowns(problem.vehicle, ('D_linear.full',), speeds=one, wrenches=one).entries
        zeros = dict.fromkeys(e for e in every if set(e.index) == set(pair))
    if not zeros:
        return fit, {}
    changed: dict[str, np.ndarray] = {}
    for entry in zeros:
        held = changed.setdefault(entry.group, getattr(fit.unknowns.prior, entry.group).copy())
        held[entry.index] = 0.0
    names = [entry.name for entry in zeros]
    fewer = fit.unknowns.without(names, **changed)
    kept = [k for k, name in enumerate(fit.unknowns.names) if name not in names]
    fitted = problem.fit(fewer, fit.theta[kept], fit.starts)
    again, more = _dissipative(problem, fitted, covariance[np.ix_(kept, kept)])
    return again, {**zeros, **more}


def feeding(D: np.ndarray) -> tuple[int, ...]:
    """The pair whose coupling in D (6, 6), diagonal >= 0, feeds most energy; () where none does."""
    S = (D + D.T) / 2
    if is_semidefinite(S):
        return ()
    v = np.linalg.eigh(S)[1][:, 0]
    power = np.tril(S * np.outer(v, v), -1)
    return tuple(int(i) for i in np.unravel_index(np.argmin(power), power.shape))
