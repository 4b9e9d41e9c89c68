"""Judges of the claims that compare the inputs and the pace of GVC and CL: rows 14, 17 to 20."""

import numpy as np

from auv_analysis.report.claims_motion import U, W
from auv_analysis.report.evidence import Evidence, Finding, grade, listed, seconds
from auv_analysis.report.sketching import NEAR_ZERO
from auv_analysis.report.text import number
from auv_analysis.summary import TRANSIENT

SLIGHTLY = 0.10  # relative difference of inputs that differ 'only slightly'
COMPARABLE = 0.05  # of efforts that are 'comparable'
ERRORS = ('Δu', 'Δv', 'Δw', 'Δp', 'Δq', 'Δr')


def inputs_similar(of: Evidence) -> Finding:
    """Row 14: inputs of both laws with the same gains."""
    gvc, cl = (run.peak('tau') for run in of.both)
    change = _rms_change(of)
    text = (
        f'peak τ_X {number(gvc[U])} against {number(cl[U])} N, '
        f'τ_Z {number(gvc[W])} against {number(cl[W])} N; '
        f'RMS after 2 s, CL relative to GVC: {_percent(change)} % (surge to yaw)'
    )
    if np.abs(change).max() > SLIGHTLY:
        return Finding(text, 'not reproduced')
    same_peak = np.abs(_change(gvc, cl)).max() <= SLIGHTLY
    return Finding(text, 'reproduced' if same_peak else 'partly')


def earlier(of: Evidence) -> Finding:
    """Row 17: time to the final errors."""
    times = [run.run.settled for run in of.both]
    text = ' against '.join(seconds(time, of.gvc.run.duration) for time in times)
    return Finding(f'{text} to {NEAR_ZERO:g}', grade([times[0] < times[1]]))


def oscillates(of: Evidence) -> Finding:
    """Row 18: total variation of the errors."""
    gvc, cl = (run.part('error').path for run in of.both)
    seen = np.maximum(*(run.peak('error') for run in of.both)) > NEAR_ZERO
    text = '; '.join(
        f'{ERRORS[i]} {number(cl[i], 2)} against {number(gvc[i], 2)}' for i in np.flatnonzero(seen)
    )
    return Finding(f'total variation, CL against GVC: {text}', grade(cl[seen] > gvc[seen]))


def efforts_comparable(of: Evidence) -> Finding:
    """Row 19: RMS of the inputs after 2 s, per axis."""
    change = _rms_change(of)
    near = np.abs(change) <= COMPARABLE
    gvc, cl = (run.late_rms('tau') for run in of.both)
    text = (
        f'RMS after 2 s, CL relative to GVC: {_percent(change)} % (surge to yaw); '
        f'GVC {listed(gvc)}, CL {listed(cl)} N, N m'
    )
    if near.all():
        return Finding(text, 'reproduced')
    return Finding(text, 'partly' if near.sum() >= 4 else 'not reproduced')


def larger_start(of: Evidence) -> Finding:
    """Row 20: inputs of the first instants."""
    gvc, cl = (run.peak('tau', 0.0, TRANSIENT)[[U, W]] for run in of.both)
    text = (
        f'τ_X {number(gvc[0])} against {number(cl[0])} N, '
        f'τ_Z {number(gvc[1])} against {number(cl[1])} N'
    )
    return Finding(text, grade(gvc > cl))


def _rms_change(of: Evidence) -> np.ndarray:
    """Relative change (6,) of the RMS input after 2 s from GVC to CL."""
    return _change(*(run.late_rms('tau') for run in of.both))


def _change(gvc: np.ndarray, cl: np.ndarray) -> np.ndarray:
    """(cl - gvc) / gvc; inf where only GVC is zero, 0 where both are."""
    return np.divide(cl - gvc, gvc, out=np.where(cl > 0, np.inf, 0.0), where=gvc > 0)


def _percent(change: np.ndarray) -> str:
    return ', '.join(f'{round(100 * x, 1) + 0.0:+.1f}'.replace('-', '−') for x in change)
