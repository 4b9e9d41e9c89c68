"""Judges of the claims on velocity errors, lumped errors and the disturbance: rows 1 to 8."""

import numpy as np

from auv_analysis.report.evidence import Evidence, Finding, grade, listed, seconds
from auv_analysis.report.sketching import NEAR_ZERO
from auv_analysis.report.text import number
from auv_analysis.summary import TRANSIENT

U, V, W, P, Q, R = range(6)
FAR = 10.0  # times: what counts as much larger


def errors_vanish(of: Evidence) -> Finding:
    """Row 1: GVC errors near zero after 2 s."""
    gvc = of.gvc
    late = gvc.late_peak('error')
    when = seconds(gvc.run.settled, gvc.run.duration, 'after ')
    text = f'within {NEAR_ZERO:g}: {when}; at most {number(late.max(), 2)} after 2 s'
    return Finding(text, grade([late.max() <= NEAR_ZERO]))


def linear_slow(of: Evidence) -> Finding:
    """Row 2: du and dw of CL."""
    gvc, cl = (run.late_peak('error')[[U, W]] for run in of.both)
    text = f'after 2 s up to {listed(cl)} m/s (GVC {listed(gvc, 2)})'
    return Finding(text, grade((cl > NEAR_ZERO) & (cl > FAR * gvc)))


def pitch_slow(of: Evidence) -> Finding:
    """Row 3: dq of CL."""
    cl = of.cl
    end = min(10.0, cl.run.duration)
    early = cl.peak('error', TRANSIENT, end)[Q]
    late = cl.late_peak('error')[Q]
    last = cl.last_third('error').peak[Q]
    text = (
        f'up to {number(early, 2)} rad/s in 2–{end:g} s, {number(late, 2)} in '
        f'2–{cl.run.duration:g} s, {number(last, 2)} in the last third'
    )
    return Finding(text, grade([late > NEAR_ZERO, last > NEAR_ZERO]))


def largest_errors(of: Evidence) -> Finding:
    """Row 4: which errors of GVC are largest."""
    peak = of.gvc.peak('error')
    text = f'peaks {listed(peak[:3], 2)} m/s; {listed(peak[3:], 2)} rad/s'
    linear = min(peak[U], peak[W]) > FAR * peak[V]
    return Finding(text, grade([linear, peak[Q] > max(peak[P], peak[R]), peak[P] > 0.01 * peak[Q]]))


def lumped_fast(of: Evidence) -> Finding:
    """Row 5: w of GVC becomes small and not zero."""
    gvc = of.gvc
    ratio = gvc.late_peak('lumped_error') / gvc.peak('lumped_error')
    end, F = gvc.part('lumped_error').last, gvc.peak('F')
    text = (
        f'after 2 s at most {100 * ratio.max():.1f} % of the peak; at {gvc.run.duration:g} s '
        f'w_X {number(end[U], 2)}, w_Z {number(end[W], 2)} N'
    )
    ends = bool((np.abs(end) > 0.01 * F)[[U, W]].any())
    return Finding(text, grade([ratio.max() < 1 / FAR, ends]))


def lumped_slow(of: Evidence) -> Finding:
    """Row 6: w of CL stays large and moves on."""
    axes = [U, W, Q]
    gvc, cl = (run.late_peak('lumped_error')[axes] for run in of.both)
    span, F_span = (of.cl.last_third(name).span[axes] for name in ('lumped_error', 'F'))
    text = (
        f'after 2 s up to {listed(cl[:2])} N, {number(cl[2])} N m (GVC {listed(gvc, 2)}); '
        f'range in the last third {listed(span, 2)} (F {listed(F_span, 2)})'
    )
    return Finding(text, grade([*(cl > FAR * gvc), *(span > 0.5 * F_span)]))


def lumped_first_phase(of: Evidence) -> Finding:
    """Row 7: w of GVC in the first phase."""
    gvc = of.gvc
    first, late = gvc.peak('lumped_error', 0.0, TRANSIENT), gvc.late_peak('lumped_error')
    named = [U, W, Q, R]
    text = f'peaks {listed(first[named])} before, {listed(late[named], 2)} after 2 s'
    larger = [min(first[U], first[W]) > first[V], min(first[Q], first[R]) > first[P]]
    return Finding(text, grade([*(first[named] > FAR * late[named]), *larger]))


def disturbance_sizes(of: Evidence) -> Finding:
    """Row 8: sizes of F."""
    F = of.gvc.peak('F')
    text = f'peaks F_X {F[U]:.1f}, F_Z {F[W]:.1f} N, F_M {F[Q]:.1f}, F_N {F[R]:.1f} N m'
    return Finding(text, grade([F[W] == max(F[:3]), F[Q] == max(F[3:]), F[R] < F[Q]]))
