"""Criteria by which the 21 claims are judged, each from the evidence alone."""

import numpy as np

from auv_analysis.herman2018 import paper
from auv_analysis.herman2018.evidence import (
    Evidence,
    Judgement,
    Quotes,
    Verdict,
    decimals,
    grade,
    percent,
    settled,
    short,
    spell,
)
from auv_analysis.metrics.energy import shares
from auv_analysis.metrics.settling import TRANSIENT
from auv_analysis.report.digest import NEAR_ZERO, RunDigest, last_third
from auv_dynamics.vehicle import DOFS

U, V, W, P, Q, R = range(6)
FAR = 10.0  # times: what counts as much larger
ERRORS = ('Δu', 'Δv', 'Δw', 'Δp', 'Δq', 'Δr')
LUMPED = ('w_X', 'w_Y', 'w_Z', 'w_K', 'w_M', 'w_N')


def errors_vanish(of: Evidence, quote: Quotes) -> Judgement:
    """Row 1: GVC errors near zero after 2 s."""
    gvc = of.gvc
    late = gvc.part('error', TRANSIENT).peak
    within = quote('near zero', NEAR_ZERO, 'm/s, rad/s', short)
    when = settled(quote, 'gvc', gvc, 'after ')
    most = quote('largest error after the transient, gvc', late.max(), 'm/s, rad/s', 2)
    text = f'within {within}: {when}; at most {most} after {_transient(quote)} s'
    return Judgement(text, grade([late.max() <= NEAR_ZERO]), _late(of))


def linear_slow(of: Evidence, quote: Quotes) -> Judgement:
    """Row 2: du and dw of CL."""
    gvc, cl = (run.part('error', TRANSIENT).peak[[U, W]] for run in of.both)
    text = (
        f'after {_transient(quote)} s up to {quote.listed(_of("cl", ERRORS, U, W), cl, "m/s")} '
        f'm/s (GVC {quote.listed(_of("gvc", ERRORS, U, W), gvc, "m/s", 2)})'
    )
    verdict = grade((cl > NEAR_ZERO) & (cl > FAR * gvc))
    return Judgement(text, verdict, _late(of))


def pitch_slow(of: Evidence, quote: Quotes) -> Judgement:
    """Row 3: dq of CL."""
    cl = of.cl
    end = min(10.0, cl.duration)
    early = cl.part('error', TRANSIENT, end).peak[Q]
    late = cl.part('error', TRANSIENT).peak[Q]
    last = cl.part('error', last_third(cl)).peak[Q]
    begin = _transient(quote)
    text = (
        f'up to {quote("Δq, cl, at first", early, "rad/s", 2)} rad/s in '
        f'{begin}–{quote("end of the first look", end, "s", short)} s, '
        f'{quote("Δq, cl", late, "rad/s", 2)} in '
        f'{begin}–{quote("end of the run", cl.duration, "s", short)} s, '
        f'{quote("Δq, cl, in the last third", last, "rad/s", 2)} in the last third'
    )
    ends = (TRANSIENT, end), (TRANSIENT, cl.duration), (last_third(cl), cl.duration)
    return Judgement(text, grade([late > NEAR_ZERO, last > NEAR_ZERO]), spell(*ends))


def largest_errors(of: Evidence, quote: Quotes) -> Judgement:
    """Row 4: which errors of GVC are largest."""
    peak = of.gvc.part('error').peak
    names = _of('gvc', ERRORS)
    text = (
        f'peaks {quote.listed(names[:3], peak[:3], "m/s", 2)} m/s; '
        f'{quote.listed(names[3:], peak[3:], "rad/s", 2)} rad/s'
    )
    linear = min(peak[U], peak[W]) > FAR * peak[V]
    verdict = grade([linear, peak[Q] > max(peak[P], peak[R]), peak[P] > 0.01 * peak[Q]])
    return Judgement(text, verdict, _whole(of))


def lumped_fast(of: Evidence, quote: Quotes) -> Judgement:
    """Row 5: w of GVC becomes small and not zero."""
    gvc = of.gvc
    ratio = gvc.part('lumped_error', TRANSIENT).peak / gvc.part('lumped_error').peak
    end, F = gvc.part('lumped_error').last, gvc.part('F').peak
    left = quote('largest w after the transient, of its peak', 100 * ratio.max(), '%', decimals(1))
    text = (
        f'after {_transient(quote)} s at most {left} % of the peak; at '
        f'{quote("end of the run", gvc.duration, "s", short)} s '
        f'w_X {quote("w_X at the end", end[U], "N", 2)}, '
        f'w_Z {quote("w_Z at the end", end[W], "N", 2)} N'
    )
    ends = bool((np.abs(end) > 0.01 * F)[[U, W]].any())
    verdict = grade([ratio.max() < 1 / FAR, ends])
    return Judgement(text, verdict, f'{_late(of)}; at {gvc.duration:g} s')


def lumped_slow(of: Evidence, quote: Quotes) -> Judgement:
    """Row 6: w of CL stays large and moves on."""
    axes = [U, W, Q]
    gvc, cl = (run.part('lumped_error', TRANSIENT).peak[axes] for run in of.both)
    last = last_third(of.cl)
    span, F_span = (of.cl.part(name, last).span[axes] for name in ('lumped_error', 'F'))
    names = _of('cl', LUMPED, *axes)
    text = (
        f'after {_transient(quote)} s up to {quote.listed(names[:2], cl[:2], "N")} N, '
        f'{quote(names[2], cl[2], "N m")} N m '
        f'(GVC {quote.listed(_of("gvc", LUMPED, *axes), gvc, "N, N m", 2)}); range in the last '
        f'third {quote.listed([f"range of {name}" for name in names], span, "N, N m", 2)} '
        f'(F {quote.listed(["range of F_X", "range of F_Z", "range of F_M"], F_span, "N, N m", 2)})'
    )
    ends = (TRANSIENT, of.cl.duration), (last, of.cl.duration)
    verdict = grade([*(cl > FAR * gvc), *(span > 0.5 * F_span)])
    return Judgement(text, verdict, spell(*ends))


def lumped_first_phase(of: Evidence, quote: Quotes) -> Judgement:
    """Row 7: w of GVC in the first phase."""
    gvc = of.gvc
    first = gvc.part('lumped_error', 0.0, TRANSIENT).peak
    late = gvc.part('lumped_error', TRANSIENT).peak
    named = [U, W, Q, R]
    before, after = ([f'{LUMPED[i]} {when}' for i in named] for when in ('at first', 'later'))
    text = (
        f'peaks {quote.listed(before, first[named], "N, N m")} before, '
        f'{quote.listed(after, late[named], "N, N m", 2)} after {_transient(quote)} s'
    )
    larger = [min(first[U], first[W]) > first[V], min(first[Q], first[R]) > first[P]]
    verdict = grade([*(first[named] > FAR * late[named]), *larger])
    window = spell((0.0, TRANSIENT), (TRANSIENT, gvc.duration))
    return Judgement(text, verdict, window)


def disturbance_sizes(of: Evidence, quote: Quotes) -> Judgement:
    """Row 8: sizes of F."""
    F, one = of.gvc.part('F').peak, decimals(1)
    text = (
        f'peaks F_X {quote("F_X", F[U], "N", one)}, F_Z {quote("F_Z", F[W], "N", one)} N, '
        f'F_M {quote("F_M", F[Q], "N m", one)}, F_N {quote("F_N", F[R], "N m", one)} N m'
    )
    verdict = grade([F[W] == max(F[:3]), F[Q] == max(F[3:]), F[R] < F[Q]])
    return Judgement(text, verdict, _whole(of))


def _of(law: str, names: tuple[str, ...], *axes: int) -> list[str]:
    """Names of the values of some axes, or of all, under a law."""
    return [f'{names[i]}, {law}' for i in axes or range(6)]


def _transient(quote: Quotes) -> str:
    return quote('transient', TRANSIENT, 's', short)


def _late(of: Evidence) -> str:
    return spell((TRANSIENT, max(run.duration for run in of.runs.values())))


def _whole(of: Evidence) -> str:
    return spell((0.0, of.gvc.duration))


WITHIN = 0.02  # of the paper's kinetic energy
POINTS = 1.0  # percentage points of a share
COMPONENTS = tuple(f'ξ{i}' for i in range(1, 7))


def kinetic_energy_mean(of: Evidence, quote: Quotes) -> Judgement:
    """Row 9: total kinetic energy, a mean over a window that the paper does not print."""
    windows = _windows(of.gvc)
    text = '; '.join(
        f'{quote(f"kinetic energy, 0–{end:g} s", float(part.sum()), "J", decimals(2))} J '
        f'({_window(quote, end)})'
        for end, part in windows.items()
    )
    named = spell(*((0.0, end) for end in windows))
    if of.gvc.duration < paper.ENERGY_WINDOW:
        return Judgement(text, 'not evaluated', named)
    total = next(iter(windows.values())).sum()
    near = abs(total / paper.KINETIC_ENERGY - 1.0) <= WITHIN
    return Judgement(text, 'partly' if near else 'not reproduced', named)


def kinetic_energy_shares(of: Evidence, quote: Quotes) -> Judgement:
    """Row 10: shares of the components."""
    windows = {end: shares(part) for end, part in _windows(of.gvc).items()}
    lines = []
    for end, part in windows.items():
        names = [f'share of {name}, 0–{end:g} s' for name in COMPONENTS]
        lines.append(f'{quote.listed(names, part, "%", decimals(2))} % ({_window(quote, end)})')
    named = spell(*((0.0, end) for end in windows))
    if of.gvc.duration < paper.ENERGY_WINDOW:
        return Judgement('; '.join(lines), 'not evaluated', named)
    near = [np.abs(part - paper.SHARES).max() <= POINTS for part in windows.values()]
    return Judgement('; '.join(lines), grade(near), named)


def energy_in_two(of: Evidence, quote: Quotes) -> Judgement:
    """Row 16: energy mainly in xi_3 and xi_1."""
    part = shares(of.gvc.part('energy').mean)
    order = np.argsort(part)[::-1]
    first = quote('component with the largest share', int(order[0]) + 1, '', short)
    second = quote('component with the second share', int(order[1]) + 1, '', short)
    together = quote('their share', float(part[order[:2]].sum()), '%', decimals(2))
    text = f'ξ{first} and ξ{second}, together {together} %'
    verdict = grade([tuple(order[:2]) == (2, 0), bool(part[[0, 2]].sum() > 99.0)])
    return Judgement(text, verdict, _whole(of))


def sway_deformed(of: Evidence, quote: Quotes) -> Judgement:
    """Row 11: delta_xi of sway."""
    peak = of.gvc.part('delta_xi').peak
    text = f'{quote("Δξ2", peak[V], "m/s", 2)} m/s'
    verdict = grade([peak[V] == max(peak[:3]) and round(peak[V], 2) == paper.SWAY_DEFORMATION])
    return Judgement(text, verdict, _whole(of))


def roll_deformed(of: Evidence, quote: Quotes) -> Judgement:
    """Row 12: delta_xi of roll."""
    peak, rate = of.gvc.part('delta_xi').peak, of.gvc.part('nu').peak[P]
    text = (
        f'{quote("Δξ4", peak[P], "rad/s")} rad/s, where p itself reaches '
        f'{quote("p", rate, "rad/s", 2)} rad/s'
    )
    verdict = grade([peak[P] == max(peak[3:]) and peak[P] > rate])
    return Judgement(text, verdict, _whole(of))


def pitch_input(of: Evidence, quote: Quotes) -> Judgement:
    """Row 13: delta_pi of pitch."""
    gvc = of.gvc
    peak = gvc.part('delta_pi').peak
    text = f'pitch {quote("Δπ5", peak[Q], "N m")} N m'
    if gvc.duration > TRANSIENT:
        late = quote('Δπ5 after the transient', gvc.part('delta_pi', TRANSIENT).peak[Q], 'N m')
        text += f', {late} after {_transient(quote)} s'
    text += (
        f'; roll {quote("Δπ4", peak[3], "N m", 2)}, yaw {quote("Δπ6", peak[5], "N m", 2)} N m; '
        f'forces at most {quote("largest of Δπ1 to Δπ3", peak[:3].max(), "N", 2)} N'
    )
    return Judgement(text, grade([_only_pitch(gvc)]), _whole(of))


def pitch_sensitive(of: Evidence, quote: Quotes) -> Judgement:
    """Row 15: whether pitch is coupled most, and follows the others and the gains most."""
    parts, lines = [_only_pitch(of.gvc)], []
    for what, words in (('others', 'the other set-points'), ('gains', 'the gains')):
        six = {law: getattr(of.responses[law], what) for law in ('gvc', 'cl')}
        texts = ', '.join(_largest(quote, law, words, values) for law, values in six.items())
        lines.append(f'follows {words}: {texts}')
        parts += [bool(values[Q] == values.max()) for values in six.values()]
    peak = of.gvc.part('delta_pi').peak
    coupled = (
        f'Δπ of pitch {quote("Δπ5", peak[Q], "N m")} N m, of any other axis at most '
        f'{quote("largest other Δπ", np.delete(peak, Q).max(), "N, N m", 2)}'
    )
    text = '; '.join([coupled, *lines])
    return Judgement(text, grade(parts), _whole(of))


def decomposition(of: Evidence, quote: Quotes) -> Judgement:
    """Row 21: N."""
    text = quote.listed([f'N{i}' for i in range(1, 7)], of.N, 'kg, kg m2', 6)
    verdict = grade([np.array_equal(np.round(of.N, 1), paper.N)])
    return Judgement(text, verdict, 'no time in it')


def _only_pitch(gvc: RunDigest) -> bool:
    """Whether delta_pi of pitch is far above that of every other axis."""
    peak = gvc.part('delta_pi').peak
    return bool(peak[Q] > FAR * np.delete(peak, Q).max())


def _largest(quote: Quotes, law: str, words: str, values: np.ndarray) -> str:
    """'gvc Δq 0.31 (Δp 0.35)': pitch's number and the largest of the others."""
    i = max({*range(6)} - {Q}, key=lambda axis: float(values[axis]))
    name = f'RMS error of {{}} by {words}, {law}'
    return (
        f'{law} {ERRORS[Q]} {quote(name.format(DOFS[Q]), values[Q], "", 2)} '
        f'({ERRORS[i]} {quote(name.format(DOFS[i]), values[i], "", 2)})'
    )


def _windows(gvc: RunDigest) -> dict[float, np.ndarray]:
    """Mean energy by component (6,) over 0-10 s and over the whole run, by the window's end."""
    ends = dict.fromkeys([min(paper.ENERGY_WINDOW, gvc.duration), gvc.duration])
    return {end: gvc.part('energy', 0.0, end).mean for end in ends}


def _window(quote: Quotes, end: float) -> str:
    begin = quote('begin of the windows', 0.0, 's', short)
    return f'{begin}–{quote(f"end of 0–{end:g} s", end, "s", short)} s'


SLIGHTLY = 0.10  # relative difference of inputs that differ 'only slightly'
COMPARABLE = 0.05  # of efforts that are 'comparable'
INPUTS = ('τ_X', 'τ_Y', 'τ_Z', 'τ_K', 'τ_M', 'τ_N')


def inputs_similar(of: Evidence, quote: Quotes) -> Judgement:
    """Row 14: inputs of both laws with the same gains."""
    gvc, cl = (run.part('tau').peak for run in of.both)
    change = _rms_change(of)
    text = f'peak {_pairs(quote, gvc[[U, W]], cl[[U, W]])}; {_changes(quote, change)}'
    window = spell((0.0, of.gvc.duration), (TRANSIENT, of.gvc.duration))
    if np.abs(change).max() > SLIGHTLY:
        return Judgement(text, 'not reproduced', window)
    same_peak = np.abs(_change(gvc, cl)).max() <= SLIGHTLY
    return Judgement(text, 'reproduced' if same_peak else 'partly', window)


def earlier(of: Evidence, quote: Quotes) -> Judgement:
    """Row 17: time to the final errors."""
    times = [run.settled for run in of.both]
    both = zip(('gvc', 'cl'), of.both, strict=True)
    text = ' against '.join(settled(quote, law, run) for law, run in both)
    text += f' to {quote("near zero", NEAR_ZERO, "m/s, rad/s", short)}'
    return Judgement(text, grade([times[0] < times[1]]), _whole(of))


def oscillates(of: Evidence, quote: Quotes) -> Judgement:
    """Row 18: total variation of the errors."""
    gvc, cl = (run.part('error').path for run in of.both)
    seen = np.maximum(*(run.part('error').peak for run in of.both)) > NEAR_ZERO
    units = ('m/s',) * 3 + ('rad/s',) * 3
    text = '; '.join(
        f'{ERRORS[i]} {quote(f"path of {ERRORS[i]}, cl", cl[i], units[i], 2)} against '
        f'{quote(f"path of {ERRORS[i]}, gvc", gvc[i], units[i], 2)}'
        for i in np.flatnonzero(seen).tolist()
    )
    text = f'total variation, CL against GVC: {text}'
    return Judgement(text, grade(cl[seen] > gvc[seen]), _whole(of))


def efforts_comparable(of: Evidence, quote: Quotes) -> Judgement:
    """Row 19: RMS of the inputs after 2 s, per axis."""
    change = _rms_change(of)
    near = np.abs(change) <= COMPARABLE
    of_gvc, of_cl = (
        quote.listed([f'RMS of {name}, {law}' for name in INPUTS], rms, 'N, N m')
        for law, rms in zip(('gvc', 'cl'), _late_rms(of), strict=True)
    )
    text = f'{_changes(quote, change)}; GVC {of_gvc}, CL {of_cl} N, N m'
    verdict: Verdict = (
        'reproduced' if near.all() else 'partly' if near.sum() >= 4 else 'not reproduced'
    )
    return Judgement(text, verdict, spell((TRANSIENT, of.gvc.duration)))


def larger_start(of: Evidence, quote: Quotes) -> Judgement:
    """Row 20: inputs of the first instants."""
    gvc, cl = (run.part('tau', 0.0, TRANSIENT).peak[[U, W]] for run in of.both)
    text, window = _pairs(quote, gvc, cl), spell((0.0, min(TRANSIENT, of.gvc.duration)))
    return Judgement(text, grade(gvc > cl), window)


def _pairs(quote: Quotes, gvc: np.ndarray, cl: np.ndarray) -> str:
    """Peaks (2,) of surge and heave under both laws."""
    return ', '.join(
        f'{name} {quote(f"peak of {name}, gvc", a, "N")} against '
        f'{quote(f"peak of {name}, cl", b, "N")} N'
        for name, a, b in zip(('τ_X', 'τ_Z'), gvc, cl, strict=True)
    )


def _changes(quote: Quotes, change: np.ndarray) -> str:
    """Relative changes (6,) of the RMS inputs."""
    after = _transient(quote)
    names = [f'change of the RMS of {name}' for name in INPUTS]
    listed = quote.listed(names, 100 * change, '%', percent)
    return f'RMS after {after} s, CL relative to GVC: {listed} % (surge to yaw)'


def _rms_change(of: Evidence) -> np.ndarray:
    """Relative change (6,) of the RMS input after 2 s from GVC to CL."""
    return _change(*_late_rms(of))


def _late_rms(of: Evidence) -> list[np.ndarray]:
    return [run.part('tau', TRANSIENT).rms for run in of.both]


def _change(gvc: np.ndarray, cl: np.ndarray) -> np.ndarray:
    """(cl - gvc) / gvc; inf where only GVC is zero, 0 where both are."""
    return np.divide(cl - gvc, gvc, out=np.where(cl > 0, np.inf, 0.0), where=gvc > 0)
