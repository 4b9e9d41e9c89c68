"""Judges of the claims that compare the inputs and the pace of GVC and CL: rows 14, 17 to 20."""

import numpy as np

from auv_analysis.metrics.summary import TRANSIENT
from auv_analysis.report.claims_motion import ERRORS, U, W
from auv_analysis.report.evidence import Evidence, Finding, Verdict, grade, settled, spell
from auv_analysis.report.quotes import Quotes, percent, short
from auv_analysis.report.sketching import NEAR_ZERO

SLIGHTLY = 0.10  # relative difference of inputs that differ 'only slightly'
COMPARABLE = 0.05  # of efforts that are 'comparable'
INPUTS = ('τ_X', 'τ_Y', 'τ_Z', 'τ_K', 'τ_M', 'τ_N')


def inputs_similar(of: Evidence) -> Finding:
    """Row 14: inputs of both laws with the same gains."""
    gvc, cl = (run.peak('tau') for run in of.both)
    change, quote = _rms_change(of), Quotes()
    text = f'peak {_pairs(quote, gvc[[U, W]], cl[[U, W]])}; {_changes(quote, change)}'
    window = spell((0.0, of.gvc.run.duration), (TRANSIENT, of.gvc.run.duration))
    if np.abs(change).max() > SLIGHTLY:
        return Finding(text, 'not reproduced', quote.values, window)
    same_peak = np.abs(_change(gvc, cl)).max() <= SLIGHTLY
    return Finding(text, 'reproduced' if same_peak else 'partly', quote.values, window)


def earlier(of: Evidence) -> Finding:
    """Row 17: time to the final errors."""
    times, quote = [run.run.settled for run in of.both], Quotes()
    both = zip(('gvc', 'cl'), of.both, strict=True)
    text = ' against '.join(settled(quote, law, run.run) for law, run in both)
    text += f' to {quote("near zero", NEAR_ZERO, "m/s, rad/s", short)}'
    window = spell((0.0, of.gvc.run.duration))
    return Finding(text, grade([times[0] < times[1]]), quote.values, window)


def oscillates(of: Evidence) -> Finding:
    """Row 18: total variation of the errors."""
    gvc, cl = (run.part('error').path for run in of.both)
    seen = np.maximum(*(run.peak('error') for run in of.both)) > NEAR_ZERO
    quote, unit = Quotes(), ('m/s', 'rad/s')
    text = '; '.join(
        f'{ERRORS[i]} {quote(f"path of {ERRORS[i]}, cl", cl[i], unit[i // 3], 2)} against '
        f'{quote(f"path of {ERRORS[i]}, gvc", gvc[i], unit[i // 3], 2)}'
        for i in np.flatnonzero(seen).tolist()
    )
    text = f'total variation, CL against GVC: {text}'
    window = spell((0.0, of.gvc.run.duration))
    return Finding(text, grade(cl[seen] > gvc[seen]), quote.values, window)


def efforts_comparable(of: Evidence) -> Finding:
    """Row 19: RMS of the inputs after 2 s, per axis."""
    change, quote = _rms_change(of), Quotes()
    near = np.abs(change) <= COMPARABLE
    of_gvc, of_cl = (
        quote.listed([f'RMS of {name}, {law}' for name in INPUTS], run.late_rms('tau'), 'N, N m')
        for law, run in zip(('gvc', 'cl'), of.both, strict=True)
    )
    text = f'{_changes(quote, change)}; GVC {of_gvc}, CL {of_cl} N, N m'
    verdict: Verdict = (
        'reproduced' if near.all() else 'partly' if near.sum() >= 4 else 'not reproduced'
    )
    return Finding(text, verdict, quote.values, spell((TRANSIENT, of.gvc.run.duration)))


def larger_start(of: Evidence) -> Finding:
    """Row 20: inputs of the first instants."""
    gvc, cl = (run.peak('tau', 0.0, TRANSIENT)[[U, W]] for run in of.both)
    quote = Quotes()
    text, window = _pairs(quote, gvc, cl), spell((0.0, min(TRANSIENT, of.gvc.run.duration)))
    return Finding(text, grade(gvc > cl), quote.values, window)


def _pairs(quote: Quotes, gvc: np.ndarray, cl: np.ndarray) -> str:
    """Peaks (2,) of surge and heave under both laws."""
    return ', '.join(
        f'{name} {quote(f"peak of {name}, gvc", a, "N")} against '
        f'{quote(f"peak of {name}, cl", b, "N")} N'
        for name, a, b in zip(('τ_X', 'τ_Z'), gvc, cl, strict=True)
    )


def _changes(quote: Quotes, change: np.ndarray) -> str:
    """Relative changes (6,) of the RMS inputs."""
    after = quote('transient', TRANSIENT, 's', short)
    names = [f'change of the RMS of {name}' for name in INPUTS]
    listed = quote.listed(names, 100 * change, '%', percent)
    return f'RMS after {after} s, CL relative to GVC: {listed} % (surge to yaw)'


def _rms_change(of: Evidence) -> np.ndarray:
    """Relative change (6,) of the RMS input after 2 s from GVC to CL."""
    return _change(*(run.late_rms('tau') for run in of.both))


def _change(gvc: np.ndarray, cl: np.ndarray) -> np.ndarray:
    """(cl - gvc) / gvc; inf where only GVC is zero, 0 where both are."""
    return np.divide(cl - gvc, gvc, out=np.where(cl > 0, np.inf, 0.0), where=gvc > 0)
