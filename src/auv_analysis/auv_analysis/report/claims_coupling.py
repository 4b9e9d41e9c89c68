"""Judges of the claims on energy, couplings and the decomposition: rows 9 to 13, 15, 16, 21."""

import numpy as np

from auv_analysis.energy import shares
from auv_analysis.report import paper
from auv_analysis.report.claims_motion import FAR, P, Q, V
from auv_analysis.report.evidence import Evidence, Finding, Signals, grade, listed
from auv_analysis.report.text import fixed, number
from auv_analysis.summary import TRANSIENT

WITHIN = 0.02  # of the paper's kinetic energy
POINTS = 1.0  # percentage points of a share


def kinetic_energy_mean(of: Evidence) -> Finding:
    """Row 9: total kinetic energy, a mean over a window that the paper does not print."""
    windows = _windows(of.gvc)
    text = '; '.join(f'{fixed(float(part.sum()), 2)} J ({name})' for name, part in windows.items())
    if of.gvc.run.duration < paper.ENERGY_WINDOW:
        return Finding(text, 'not evaluated')
    total = next(iter(windows.values())).sum()
    near = abs(total / paper.KINETIC_ENERGY - 1.0) <= WITHIN
    return Finding(text, 'partly' if near else 'not reproduced')


def kinetic_energy_shares(of: Evidence) -> Finding:
    """Row 10: shares of the components."""
    windows = {name: shares(part) for name, part in _windows(of.gvc).items()}
    lines = (f'{", ".join(fixed(x, 2) for x in part)} % ({name})' for name, part in windows.items())
    text = '; '.join(lines)
    if of.gvc.run.duration < paper.ENERGY_WINDOW:
        return Finding(text, 'not evaluated')
    near = [np.abs(part - paper.SHARES).max() <= POINTS for part in windows.values()]
    return Finding(text, grade(near))


def energy_in_two(of: Evidence) -> Finding:
    """Row 16: energy mainly in xi_3 and xi_1."""
    part = shares(of.gvc.part('energy').mean)
    order = np.argsort(part)[::-1]
    text = f'ξ{order[0] + 1} and ξ{order[1] + 1}, together {part[order[:2]].sum():.2f} %'
    return Finding(text, grade([tuple(order[:2]) == (2, 0), bool(part[[0, 2]].sum() > 99.0)]))


def sway_deformed(of: Evidence) -> Finding:
    """Row 11: delta_xi of sway."""
    peak = of.gvc.peak('delta_xi')
    text = f'{number(peak[V], 2)} m/s'
    return Finding(text, grade([peak[V] == max(peak[:3]) and round(peak[V], 2) == 0.01]))


def roll_deformed(of: Evidence) -> Finding:
    """Row 12: delta_xi of roll."""
    peak, rate = of.gvc.peak('delta_xi'), of.gvc.peak('nu')[P]
    text = f'{number(peak[P])} rad/s, where p itself reaches {number(rate, 2)} rad/s'
    return Finding(text, grade([peak[P] == max(peak[3:]) and peak[P] > rate]))


def pitch_input(of: Evidence) -> Finding:
    """Row 13: delta_pi of pitch."""
    gvc = of.gvc
    peak = gvc.peak('delta_pi')
    others = np.delete(peak, Q)
    text = f'pitch {number(peak[Q])} N m'
    if gvc.run.duration > TRANSIENT:
        text += f', {number(gvc.late_peak("delta_pi")[Q])} after 2 s'
    text += f'; roll {number(peak[3], 2)}, yaw {number(peak[5], 2)} N m; '
    text += f'forces at most {number(peak[:3].max(), 2)} N'
    return Finding(text, grade([peak[Q] > FAR * others.max()]))


def pitch_sensitive(of: Evidence) -> Finding:
    """Row 15: no verdict; what the change of gains from GVC to CL does to the errors."""
    gvc, cl = (run.part('error').rms for run in of.both)
    ratio = np.divide(cl, gvc, out=np.full(6, np.inf), where=gvc > 0)
    text = f'RMS error of CL over that of GVC, surge to yaw: {listed(ratio, 2)}'
    return Finding(text, 'not evaluated')


def decomposition(of: Evidence) -> Finding:
    """Row 21: N."""
    text = listed(of.N, 6)
    return Finding(text, grade([np.array_equal(np.round(of.N, 1), paper.N)]))


def _windows(gvc: Signals) -> dict[str, np.ndarray]:
    """Mean energy by component (6,) over 0-10 s and over the whole run, by window."""
    ends = dict.fromkeys([min(paper.ENERGY_WINDOW, gvc.run.duration), gvc.run.duration])
    return {f'0–{end:g} s': gvc.part('energy', 0.0, end).mean for end in ends}
