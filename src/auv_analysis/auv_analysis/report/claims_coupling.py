"""Judges of the claims on energy, couplings and the decomposition: rows 9 to 13, 15, 16, 21."""

import numpy as np

from auv_analysis.metrics.energy import shares
from auv_analysis.metrics.summary import TRANSIENT
from auv_analysis.report import paper
from auv_analysis.report.claims_motion import ERRORS, FAR, P, Q, V
from auv_analysis.report.evidence import Evidence, Finding, Signals, grade, spell
from auv_analysis.report.quotes import Quotes, decimals, short
from auv_dynamics.vehicle import DOFS

WITHIN = 0.02  # of the paper's kinetic energy
POINTS = 1.0  # percentage points of a share
COMPONENTS = tuple(f'ξ{i}' for i in range(1, 7))


def kinetic_energy_mean(of: Evidence) -> Finding:
    """Row 9: total kinetic energy, a mean over a window that the paper does not print."""
    windows, quote = _windows(of.gvc), Quotes()
    text = '; '.join(
        f'{quote(f"kinetic energy, 0–{end:g} s", float(part.sum()), "J", decimals(2))} J '
        f'({_window(quote, end)})'
        for end, part in windows.items()
    )
    named = spell(*((0.0, end) for end in windows))
    if of.gvc.run.duration < paper.ENERGY_WINDOW:
        return Finding(text, 'not evaluated', quote.values, named)
    total = next(iter(windows.values())).sum()
    near = abs(total / paper.KINETIC_ENERGY - 1.0) <= WITHIN
    return Finding(text, 'partly' if near else 'not reproduced', quote.values, named)


def kinetic_energy_shares(of: Evidence) -> Finding:
    """Row 10: shares of the components."""
    windows = {end: shares(part) for end, part in _windows(of.gvc).items()}
    quote = Quotes()
    lines = []
    for end, part in windows.items():
        names = [f'share of {name}, 0–{end:g} s' for name in COMPONENTS]
        lines.append(f'{quote.listed(names, part, "%", decimals(2))} % ({_window(quote, end)})')
    named = spell(*((0.0, end) for end in windows))
    if of.gvc.run.duration < paper.ENERGY_WINDOW:
        return Finding('; '.join(lines), 'not evaluated', quote.values, named)
    near = [np.abs(part - paper.SHARES).max() <= POINTS for part in windows.values()]
    return Finding('; '.join(lines), grade(near), quote.values, named)


def energy_in_two(of: Evidence) -> Finding:
    """Row 16: energy mainly in xi_3 and xi_1."""
    part, quote = shares(of.gvc.part('energy').mean), Quotes()
    order = np.argsort(part)[::-1]
    first = quote('component with the largest share', int(order[0]) + 1, '', short)
    second = quote('component with the second share', int(order[1]) + 1, '', short)
    together = quote('their share', float(part[order[:2]].sum()), '%', decimals(2))
    text = f'ξ{first} and ξ{second}, together {together} %'
    verdict = grade([tuple(order[:2]) == (2, 0), bool(part[[0, 2]].sum() > 99.0)])
    return Finding(text, verdict, quote.values, _whole(of.gvc))


def sway_deformed(of: Evidence) -> Finding:
    """Row 11: delta_xi of sway."""
    peak, quote = of.gvc.peak('delta_xi'), Quotes()
    text = f'{quote("Δξ2", peak[V], "m/s", 2)} m/s'
    verdict = grade([peak[V] == max(peak[:3]) and round(peak[V], 2) == paper.SWAY_DEFORMATION])
    return Finding(text, verdict, quote.values, _whole(of.gvc))


def roll_deformed(of: Evidence) -> Finding:
    """Row 12: delta_xi of roll."""
    peak, rate = of.gvc.peak('delta_xi'), of.gvc.peak('nu')[P]
    quote = Quotes()
    text = (
        f'{quote("Δξ4", peak[P], "rad/s")} rad/s, where p itself reaches '
        f'{quote("p", rate, "rad/s", 2)} rad/s'
    )
    verdict = grade([peak[P] == max(peak[3:]) and peak[P] > rate])
    return Finding(text, verdict, quote.values, _whole(of.gvc))


def pitch_input(of: Evidence) -> Finding:
    """Row 13: delta_pi of pitch."""
    gvc, quote = of.gvc, Quotes()
    peak = gvc.peak('delta_pi')
    text = f'pitch {quote("Δπ5", peak[Q], "N m")} N m'
    if gvc.run.duration > TRANSIENT:
        late = quote('Δπ5 after the transient', gvc.late_peak('delta_pi')[Q], 'N m')
        text += f', {late} after {quote("transient", TRANSIENT, "s", short)} s'
    text += (
        f'; roll {quote("Δπ4", peak[3], "N m", 2)}, yaw {quote("Δπ6", peak[5], "N m", 2)} N m; '
        f'forces at most {quote("largest of Δπ1 to Δπ3", peak[:3].max(), "N", 2)} N'
    )
    return Finding(text, grade([_only_pitch(gvc)]), quote.values, _whole(gvc))


def pitch_sensitive(of: Evidence) -> Finding:
    """Row 15: whether pitch is coupled most, and follows the others and the gains most."""
    quote, parts, lines = Quotes(), [_only_pitch(of.gvc)], []
    for what, words in (('others', 'the other set-points'), ('gains', 'the gains')):
        six = {law: getattr(of.responses[law], what) for law in ('gvc', 'cl')}
        texts = ', '.join(_largest(quote, law, words, values) for law, values in six.items())
        lines.append(f'follows {words}: {texts}')
        parts += [bool(values[Q] == values.max()) for values in six.values()]
    peak = of.gvc.peak('delta_pi')
    coupled = (
        f'Δπ of pitch {quote("Δπ5", peak[Q], "N m")} N m, of any other axis at most '
        f'{quote("largest other Δπ", np.delete(peak, Q).max(), "N, N m", 2)}'
    )
    text = '; '.join([coupled, *lines])
    return Finding(text, grade(parts), quote.values, _whole(of.gvc))


def decomposition(of: Evidence) -> Finding:
    """Row 21: N."""
    quote = Quotes()
    text = quote.listed([f'N{i}' for i in range(1, 7)], of.N, 'kg, kg m2', 6)
    verdict = grade([np.array_equal(np.round(of.N, 1), paper.N)])
    return Finding(text, verdict, quote.values, 'no time in it')


def _only_pitch(gvc: Signals) -> bool:
    """Whether delta_pi of pitch is far above that of every other axis."""
    peak = gvc.peak('delta_pi')
    return bool(peak[Q] > FAR * np.delete(peak, Q).max())


def _largest(quote: Quotes, law: str, words: str, values: np.ndarray) -> str:
    """'gvc Δq 0.31 (Δp 0.35)': pitch's number and the largest of the others."""
    i = int(np.argmax(np.where(np.arange(6) == Q, -1.0, values)))
    name = f'RMS error of {{}} by {words}, {law}'
    return (
        f'{law} {ERRORS[Q]} {quote(name.format(DOFS[Q]), values[Q], "", 2)} '
        f'({ERRORS[i]} {quote(name.format(DOFS[i]), values[i], "", 2)})'
    )


def _windows(gvc: Signals) -> dict[float, np.ndarray]:
    """Mean energy by component (6,) over 0-10 s and over the whole run, by the window's end."""
    ends = dict.fromkeys([min(paper.ENERGY_WINDOW, gvc.run.duration), gvc.run.duration])
    return {end: gvc.part('energy', 0.0, end).mean for end in ends}


def _window(quote: Quotes, end: float) -> str:
    begin = quote('begin of the windows', 0.0, 's', short)
    return f'{begin}–{quote(f"end of 0–{end:g} s", end, "s", short)} s'


def _whole(gvc: Signals) -> str:
    return spell((0.0, gvc.run.duration))
