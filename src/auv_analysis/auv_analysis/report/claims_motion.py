"""Judges of the claims on velocity errors, lumped errors and the disturbance: rows 1 to 8."""

import numpy as np

from auv_analysis.metrics.summary import TRANSIENT
from auv_analysis.report.evidence import Evidence, Finding, grade, settled, spell
from auv_analysis.report.quotes import Quotes, decimals, short
from auv_analysis.report.sketch import last_third
from auv_analysis.report.sketching import NEAR_ZERO

U, V, W, P, Q, R = range(6)
FAR = 10.0  # times: what counts as much larger
ERRORS = ('Δu', 'Δv', 'Δw', 'Δp', 'Δq', 'Δr')
LUMPED = ('w_X', 'w_Y', 'w_Z', 'w_K', 'w_M', 'w_N')


def errors_vanish(of: Evidence) -> Finding:
    """Row 1: GVC errors near zero after 2 s."""
    gvc, quote = of.gvc, Quotes()
    late = gvc.late_peak('error')
    within = quote('near zero', NEAR_ZERO, 'm/s, rad/s', short)
    when = settled(quote, 'gvc', gvc.run, 'after ')
    most = quote('largest error after the transient, gvc', late.max(), 'm/s, rad/s', 2)
    text = f'within {within}: {when}; at most {most} after {_transient(quote)} s'
    return Finding(text, grade([late.max() <= NEAR_ZERO]), quote.values, _late(of))


def linear_slow(of: Evidence) -> Finding:
    """Row 2: du and dw of CL."""
    gvc, cl = (run.late_peak('error')[[U, W]] for run in of.both)
    quote = Quotes()
    text = (
        f'after {_transient(quote)} s up to {quote.listed(_of("cl", ERRORS, U, W), cl, "m/s")} '
        f'm/s (GVC {quote.listed(_of("gvc", ERRORS, U, W), gvc, "m/s", 2)})'
    )
    verdict = grade((cl > NEAR_ZERO) & (cl > FAR * gvc))
    return Finding(text, verdict, quote.values, _late(of))


def pitch_slow(of: Evidence) -> Finding:
    """Row 3: dq of CL."""
    cl, quote = of.cl, Quotes()
    end = min(10.0, cl.run.duration)
    early = cl.peak('error', TRANSIENT, end)[Q]
    late = cl.late_peak('error')[Q]
    last = cl.last_third('error').peak[Q]
    begin = quote('transient', TRANSIENT, 's', short)
    text = (
        f'up to {quote("Δq, cl, at first", early, "rad/s", 2)} rad/s in '
        f'{begin}–{quote("end of the first look", end, "s", short)} s, '
        f'{quote("Δq, cl", late, "rad/s", 2)} in '
        f'{begin}–{quote("end of the run", cl.run.duration, "s", short)} s, '
        f'{quote("Δq, cl, in the last third", last, "rad/s", 2)} in the last third'
    )
    ends = (TRANSIENT, end), (TRANSIENT, cl.run.duration), (last_third(cl.run), cl.run.duration)
    return Finding(text, grade([late > NEAR_ZERO, last > NEAR_ZERO]), quote.values, spell(*ends))


def largest_errors(of: Evidence) -> Finding:
    """Row 4: which errors of GVC are largest."""
    peak, quote = of.gvc.peak('error'), Quotes()
    names = _of('gvc', ERRORS)
    text = (
        f'peaks {quote.listed(names[:3], peak[:3], "m/s", 2)} m/s; '
        f'{quote.listed(names[3:], peak[3:], "rad/s", 2)} rad/s'
    )
    linear = min(peak[U], peak[W]) > FAR * peak[V]
    verdict = grade([linear, peak[Q] > max(peak[P], peak[R]), peak[P] > 0.01 * peak[Q]])
    return Finding(text, verdict, quote.values, _whole(of))


def lumped_fast(of: Evidence) -> Finding:
    """Row 5: w of GVC becomes small and not zero."""
    gvc, quote = of.gvc, Quotes()
    ratio = gvc.late_peak('lumped_error') / gvc.peak('lumped_error')
    end, F = gvc.part('lumped_error').last, gvc.peak('F')
    left = quote('largest w after the transient, of its peak', 100 * ratio.max(), '%', decimals(1))
    text = (
        f'after {_transient(quote)} s at most {left} % of the peak; at '
        f'{quote("end of the run", gvc.run.duration, "s", short)} s '
        f'w_X {quote("w_X at the end", end[U], "N", 2)}, '
        f'w_Z {quote("w_Z at the end", end[W], "N", 2)} N'
    )
    ends = bool((np.abs(end) > 0.01 * F)[[U, W]].any())
    verdict = grade([ratio.max() < 1 / FAR, ends])
    return Finding(text, verdict, quote.values, f'{_late(of)}; at {gvc.run.duration:g} s')


def lumped_slow(of: Evidence) -> Finding:
    """Row 6: w of CL stays large and moves on."""
    axes, quote = [U, W, Q], Quotes()
    gvc, cl = (run.late_peak('lumped_error')[axes] for run in of.both)
    span, F_span = (of.cl.last_third(name).span[axes] for name in ('lumped_error', 'F'))
    names = _of('cl', LUMPED, *axes)
    text = (
        f'after {_transient(quote)} s up to {quote.listed(names[:2], cl[:2], "N")} N, '
        f'{quote(names[2], cl[2], "N m")} N m '
        f'(GVC {quote.listed(_of("gvc", LUMPED, *axes), gvc, "N, N m", 2)}); range in the last '
        f'third {quote.listed([f"range of {name}" for name in names], span, "N, N m", 2)} '
        f'(F {quote.listed(["range of F_X", "range of F_Z", "range of F_M"], F_span, "N, N m", 2)})'
    )
    ends = (TRANSIENT, of.cl.run.duration), (last_third(of.cl.run), of.cl.run.duration)
    verdict = grade([*(cl > FAR * gvc), *(span > 0.5 * F_span)])
    return Finding(text, verdict, quote.values, spell(*ends))


def lumped_first_phase(of: Evidence) -> Finding:
    """Row 7: w of GVC in the first phase."""
    gvc, quote = of.gvc, Quotes()
    first, late = gvc.peak('lumped_error', 0.0, TRANSIENT), gvc.late_peak('lumped_error')
    named = [U, W, Q, R]
    before, after = ([f'{LUMPED[i]} {when}' for i in named] for when in ('at first', 'later'))
    text = (
        f'peaks {quote.listed(before, first[named], "N, N m")} before, '
        f'{quote.listed(after, late[named], "N, N m", 2)} after {_transient(quote)} s'
    )
    larger = [min(first[U], first[W]) > first[V], min(first[Q], first[R]) > first[P]]
    verdict = grade([*(first[named] > FAR * late[named]), *larger])
    window = spell((0.0, TRANSIENT), (TRANSIENT, gvc.run.duration))
    return Finding(text, verdict, quote.values, window)


def disturbance_sizes(of: Evidence) -> Finding:
    """Row 8: sizes of F."""
    F, quote, one = of.gvc.peak('F'), Quotes(), decimals(1)
    text = (
        f'peaks F_X {quote("F_X", F[U], "N", one)}, F_Z {quote("F_Z", F[W], "N", one)} N, '
        f'F_M {quote("F_M", F[Q], "N m", one)}, F_N {quote("F_N", F[R], "N m", one)} N m'
    )
    verdict = grade([F[W] == max(F[:3]), F[Q] == max(F[3:]), F[R] < F[Q]])
    return Finding(text, verdict, quote.values, _whole(of))


def _of(law: str, names: tuple[str, ...], *axes: int) -> list[str]:
    """Names of the values of some axes, or of all, under a law."""
    return [f'{names[i]}, {law}' for i in axes or range(6)]


def _transient(quote: Quotes) -> str:
    return quote('transient', TRANSIENT, 's', short)


def _late(of: Evidence) -> str:
    return spell((TRANSIENT, max(run.run.duration for run in of.signals.values())))


def _whole(of: Evidence) -> str:
    return spell((0.0, of.gvc.run.duration))
