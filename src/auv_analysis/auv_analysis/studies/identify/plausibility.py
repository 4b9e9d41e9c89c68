"""Plausibility of an estimate against the prior: signs that the recording or its reading is wrong.

A fit may be perfect and still mean something else: a wrench ten times too large makes every
coefficient ten times too large, and a recording in ENU and FLU taken for NED and FSD is that of a
mirrored vehicle under reversed gravity. Only the prior can tell.
"""

from collections.abc import Sequence

import numpy as np

from auv_analysis.bag.foreign_checks import misread_rates
from auv_analysis.output.text import join, number
from auv_analysis.studies.identify.identified import Identified
from auv_analysis.studies.identify.record import Record
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle import DOFS

SCALE = 2.0  # times: the common factor of all inertia
OTHER = 3.0  # times: one degree of freedom beside the others
MIRROR = np.diag([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])  # FLU <-> FSD
CLEARLY = 10.0  # times nearer to the prior
TRIM = 1e-3  # of the weight: what W - B and W r_G - B r_B are not known better than, N, N m
ASYMMETRIC = 0.02  # of the diagonal: what a mirror would change
ALONE = 0.9  # of the power of the command within one line of its spectrum
PERIODS = 4  # of the strongest frequency: in fewer, others are hardly lines apart
CLEARLY_OFF = 0.6  # of the angular velocity: more than a delay would explain


def check_rates(record: Record) -> None:
    """Refuse an angular velocity that is not the rate of the attitude.

    Raises
    ------
    InputError : naming the degrees of freedom

    """
    t = record.attitude_t
    if len(t) < 20:
        return
    rates = np.full((len(t), 3), np.nan)
    for i in np.flatnonzero(record.known[3:]):
        there = np.isfinite(record.velocity[:, 3 + i])
        rates[:, i] = np.interp(t, record.velocity_t[there], record.velocity[there, 3 + i])
    wrong = misread_rates(t - t[0], record.attitude, rates, CLEARLY_OFF)
    if wrong:
        expected = 'an angular velocity that is the rate of the attitude (frames? rad/s?)'
        raise InputError(record.name, 'angular velocity', expected, join(wrong))


def excitation(records: Sequence[Record]) -> list[str]:
    """Deficiencies of the commands, a sentence each."""
    share = min(
        max(map(_in_one_line, (record.command, np.nan_to_num(record.evenly()))))
        for record in records
    )  # of that which tells most: short stretches have few lines
    if share > ALONE:
        return [f'{100 * share:.0f} % of the power of the motion lie at one frequency: drag '
                'and inertia can hardly be told apart']  # fmt: skip
    return []


def too_short(found: Identified) -> list[str]:
    """Of which recordings the fit took no segment, in a sentence."""
    one, step = found.problem.segments[0], found.problem.step
    least = len(one.before) + len(one.command)
    rooms = [record.end - record.start for record in found.training if len(record.command) < least]
    if not rooms:
        return []
    return [f'{sum(rooms):.3g} s in {len(rooms)} of {len(found.training)} stretches are used for '
            f'the first guess only: each is shorter than {least * step:.3g} s, a segment with the '
            'commands before it']  # fmt: skip


def too_coarse(found: Identified) -> list[str]:
    """Whether damping acts faster than commands come, in a sentence."""
    nu = np.concatenate([np.nan_to_num(record.velocity) for record in found.training])
    D = found.vehicle.D(np.sqrt((nu**2).mean(axis=0)))
    time = 1.0 / max(np.abs(np.linalg.eigvals(np.linalg.solve(found.vehicle.M, D))).max(), 1e-9)
    step = found.problem.step
    if step < time:
        return []
    return [f'commands come every {number(step, 2)} s, and by the vehicle file damping stops a '
            f'motion within {number(time, 2)} s: record them more often']  # fmt: skip


def _in_one_line(signal: np.ndarray) -> float:
    """Share of the power of (n, 6) around the strongest frequency; 0 of too few periods of it."""
    total = (np.abs(np.fft.rfft(signal - signal.mean(axis=0), axis=0)) ** 2).sum(axis=1)
    peak = int(np.argmax(total))
    return float(total[peak - 2 : peak + 3].sum() / total.sum()) if peak >= PERIODS else 0.0


def contradictions(found: Identified) -> list[str]:
    """Why the result is no model of this vehicle, a sentence each; none: nothing contradicts."""
    useless = _useless(found)
    coarse = too_coarse(found) if useless else []  # then it is nothing else
    return [*_scale(found), *_mirrored(found), *(coarse or useless)]


def _scale(found: Identified) -> list[str]:
    rows = {row['name']: row for row in found.coefficients()}
    names = [f'M.{dof}.{dof}' for dof in DOFS]
    known = [n for n in names if n in rows and rows[n]['status'] == 'identified']
    if len(known) < 2:
        return []
    ratios = np.array([rows[name]['value'] / rows[name]['prior'] for name in known])
    common = float(np.exp(np.median(np.log(ratios))))
    apart = {
        name: float(ratio) for name, ratio in zip(known, ratios, strict=True)
        if not 1 / OTHER < ratio / common < OTHER
    }  # fmt: skip
    if not 1 / SCALE < common < SCALE and not apart:
        factor = f'{number(common, 2)} times' if common > 1 else f'1/{number(1 / common, 2)} of'
        return [
            f'all inertia comes out as {factor} that of the vehicle file: the wrench is '
            f'that much too {"large" if common > 1 else "small"}, or it is another vehicle'
        ]
    if apart:
        listed = join([f'{name} {number(ratio, 2)} times' for name, ratio in apart.items()])
        return [
            f'inertia does not fit the vehicle file ({listed} the prior): another vehicle, or '
            'a wrench in other axes'
        ]
    M_RB = found.vehicle.M_RB
    if M_RB is not None:
        s = np.sqrt(np.diag(M_RB))
        lowest = float(np.linalg.eigvalsh((found.found.M - M_RB) / np.outer(s, s))[0])
        if lowest < -0.5:
            return ['inertia comes out far below that of the rigid body alone: the wrench is too '
                    'small, or it is another vehicle']  # fmt: skip
    return []


def _mirrored(found: Identified) -> list[str]:
    """Whether the mirrored vehicle under reversed gravity is far nearer to the prior."""
    prior, new = found.vehicle, found.found
    s = np.sqrt(np.diag(prior.M))
    odd = (MIRROR @ prior.M @ MIRROR - prior.M) / np.outer(s, s)
    h = prior.model.hydrostatics
    least = TRIM * float(prior.weight)
    size, turned = np.array([least, max(np.abs(h[1:]).max(), least)]), -h[:2]
    if max(np.abs(odd).max(), np.abs((turned - h[:2]) / size).max()) < ASYMMETRIC:
        return []

    def distance(M: np.ndarray, g: np.ndarray) -> float:
        inertia = ((new.M - M) / np.outer(s, s))[odd != 0.0]
        return float((inertia**2).sum() + (((new.hydrostatics[:2] - g) / size) ** 2).sum())

    as_read, mirrored = distance(prior.M, h[:2]), distance(MIRROR @ prior.M @ MIRROR, turned)
    if mirrored * CLEARLY < as_read:
        return [
            'weight, trim and couplings come out with the signs of a mirrored vehicle: the '
            'recording is in ENU and FLU but was read as NED and FSD, or the other way round'
        ]
    return []


def _useless(found: Identified) -> list[str]:
    """Whether what was held out is predicted no better than by standing still."""
    rows = [r for r in found.predictions if r['predictor'] == 'persistence' and r['horizon'] >= 0.5]
    if rows and all(not row['ratio_low'] <= 1.0 for row in rows):
        return ['the model predicts what it has not seen worse than a velocity that stays as it '
                'is: axes or sign of the wrench, or another vehicle']  # fmt: skip
    return []
