"""The Lyapunov certificate in the report: a table of all runs, a figure of each that has one."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from auv_analysis.certificate import Certificate
from auv_analysis.lyapunov import certificate_of
from auv_analysis.report import plotting
from auv_analysis.report.text import MISSING, number
from auv_analysis.run import Run
from auv_analysis.summary import TRANSIENT
from auv_gvc_controller.model import control_model

IDENTITY, BOUND, MEASURED = '#56B4E9', '#D55E00', '#1a1a1a'
APART = 10.0  # ratio of a largest value to what else is to be seen, from which it is logarithmic
DECADES = 5  # of a symmetric logarithmic axis, from its linear part to its end
ROWS = (  # symbol or words, unit or '', key of summary.json, factor
    ('identity (26): largest residual', '% of max |(26)|', 'identity_residual', 100.0),
    ('identity (26): RMS residual', '% of the RMS of (26)', 'identity_residual_rms', 100.0),
    (
        'identity (26): largest after 2 s',
        '% of max |(26)| there',
        'identity_residual_after_2s',
        100.0,
    ),
    ('L increases by (26)', '% of the samples', 'share_of_time_increasing', 100.0),
    ('condition (27) holds', '% of the samples', 'share_condition_27', 100.0),
    ('bound (28) holds', '% of the samples', 'share_bound_28', 100.0),
    ('largest ρ of (28)', 'W', 'rho_max', 1.0),
    ('sup ‖s‖', 'm/s, rad/s', 'sup_s', 1.0),
    ('sup ‖z‖', 'm, rad', 'sup_z', 1.0),
    ('sup ‖w‖', 'N, N m', 'sup_w', 1.0),
    ('L at the start', 'J', 'L_first', 1.0),
    ('L at the end', 'J', 'L_last', 1.0),
)
OF_THE_IDENTITY = ('identity_residual', 'identity_residual_rms', 'identity_residual_after_2s')


def certificate_table(summaries: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Rows of the certificate's table, a column per run, and why it does not apply to some.

    Parameters
    ----------
    summaries : name -> `summarize(run)`

    Returns
    -------
    table : `applies` per run; `rows` of label, unit, cells (text, whether it is the residual of
        what is no identity there); `reasons` as mark, names, text; `sampled` names of runs under
        zero-order hold; `known` and `soft`: whether any cell is a number, and such a residual

    """
    entries = {name: summary['lyapunov'] for name, summary in summaries.items()}
    reasons: dict[str, list[str]] = {}
    for name, entry in entries.items():
        for reason in _parts(entry):
            reasons.setdefault(reason, []).append(name)
    marks = {reason: chr(ord('a') + i) for i, reason in enumerate(reasons)}
    rows = []
    for label, unit, key, factor in ROWS:
        cells = [_cell(entry, key, factor) for entry in entries.values()]
        rows.append({'label': label, 'unit': unit, 'cells': cells})
    return {
        'applies': [
            {
                'yes': entry['applicable'],
                'mark': ', '.join(sorted(marks[part] for part in _parts(entry))),
            }
            for entry in entries.values()
        ],
        'rows': rows,
        'reasons': [
            {'mark': marks[reason], 'names': names, 'text': reason}
            for reason, names in reasons.items()
        ],
        'sampled': [
            name
            for name, entry in entries.items()
            if entry.get('sampled') and entry.get('identity_residual') is not None
        ],
        'known': any(text != MISSING for row in rows for text, _ in row['cells']),
        'soft': any(soft for row in rows for _, soft in row['cells']),
    }


def _parts(entry: Mapping[str, Any]) -> list[str]:
    """Why a certificate does not apply, reason by reason."""
    return [] if entry['applicable'] else (entry['reason'] or 'not applicable').split('; ')


def is_drawn(summary: Mapping[str, Any]) -> bool:
    """Whether (26) is the derivative of L in a run, so that the two can be held together."""
    return summary['lyapunov'].get('share_of_time_increasing') is not None


def _cell(entry: Mapping[str, Any], key: str, factor: float) -> tuple[str, bool]:
    value = entry.get(key)
    soft = key in OF_THE_IDENTITY and entry.get('share_of_time_increasing') is None
    text = number(None if value is None else factor * value)
    return text, soft and value is not None


def certificate_figure(run: Run, summary: Mapping[str, Any]) -> tuple[Figure | None, str, str]:
    """L, and its measured derivative against (26) and (28). Returns figure, title and caption."""
    title = f'Certificate, {run.controller}'
    found = certificate_of(run, control_model(run.vehicle))
    if found is None or len(found.t) < 3 or not np.any(found.L > 0):
        return None, title, f'{title}: too little to draw.'
    split = run.duration > 2.0 * TRANSIENT
    figure = plotting.new_figure(4.6)
    mosaic: list[list[Any]] = [['L', 'L'], ['early', 'late']] if split else [['L'], ['early']]
    ratios = (1, 1.9) if split else (1,)
    panels = figure.subplot_mosaic(mosaic, height_ratios=(1, 1.25), width_ratios=ratios)
    _energy(panels['L'], found)
    partly = False
    early = found.t <= found.t[0] + TRANSIENT if split else np.ones(len(found.t), bool)
    plotting.letter(panels['L'], 0)
    for index, (name, inside) in enumerate((('early', early), ('late', ~early)), start=1):
        if name in panels:
            partly |= _rates(panels[name], found, inside, symmetric=name == 'early')
            plotting.letter(panels[name], index)
            panels[name].set_xlabel('$t$ (s)')
    panels['early'].set_ylabel(r'$\dot{L}$ (W)')
    _key(panels['late' if split else 'early'])
    return figure, title, _caption(run, summary['lyapunov'], title, split=split, partly=partly)


def _caption(
    run: Run, lyapunov: Mapping[str, Any], title: str, *, split: bool, partly: bool
) -> str:
    parts = [f'{title}: (a) L of (23) on a logarithmic axis; (b) its derivative, measured from L']
    parts[0] += ', against the identity (26) and the bound (28)'
    parts[0] += f', the first {TRANSIENT:g} s' if split else ''
    parts[0] += '; (c) the rest on a scale of its own.' if split else '.'
    if partly:
        parts += ['An axis with two dotted lines is linear between them and logarithmic beyond.']
    parts += ['Grey: where (26) is positive, so that L increases.']
    if run.hold == 'zoh':
        parts += ['The wrench is held between samples; (26) is that of the continuous law.']
    if not lyapunov['applicable']:
        parts += [f'The certificate does not apply here: {lyapunov["reason"]}.']
    return ' '.join(parts)


def _energy(axes: Axes, found: Certificate) -> None:
    seen = found.L > 0
    axes.plot(*plotting.decimate(found.t[seen], found.L[seen]), color=MEASURED)
    _increasing(axes, found, np.ones(len(found.t), bool))
    plotting.logarithmic(axes, 'y')
    ends = np.log10([found.L[seen].min(), found.L[seen].max()])
    axes.set_ylim(10.0 ** np.floor(ends[0]), 10.0 ** np.ceil(ends[1]))
    axes.set_xlim(found.t[0], found.t[-1])
    axes.set_ylabel('$L$ (J)')


def _rates(axes: Axes, found: Certificate, inside: np.ndarray, *, symmetric: bool) -> bool:
    """Lines of (28), (26), the measured derivative; whether the axis is partly logarithmic."""
    t = found.t[inside]
    axes.axhline(0.0, color=plotting.GREY, linewidth=0.6)
    for values, look in zip((found.bound, found.identity, found.L_dot), _looks(), strict=True):
        axes.plot(*plotting.decimate(t, values[inside]), **look)
    _increasing(axes, found, inside)
    axes.set_xlim(t[0], t[-1])
    largest = np.abs(found.identity[inside]).max()
    beyond = max(largest, np.abs(found.bound[inside]).max())
    if symmetric:  # to its last quarter, where it has died away
        last = np.abs(found.identity[inside][-max(len(t) // 4, 1) :]).max()
        linear = max(last, beyond * 10.0**-DECADES)
    else:  # the bound alone is large: what it bounds keeps the linear part
        linear = max(largest, beyond * 10.0**-DECADES)
    if beyond > 0 and beyond > APART * linear:
        plotting.symmetric(axes, linear)
        return True
    return False


def _increasing(axes: Axes, found: Certificate, inside: np.ndarray) -> None:
    """Grey bands where (26) is positive."""
    axes.fill_between(
        found.t[inside], 0.0, 1.0, where=found.identity[inside] > 0,
        transform=axes.get_xaxis_transform(), color='#ececec', linewidth=0, zorder=0.2,
    )  # fmt: skip


def _looks() -> tuple[dict[str, Any], ...]:
    return (
        {'color': BOUND, 'linestyle': (0, (4, 1.4)), 'linewidth': 1.1},
        {'color': IDENTITY, 'linestyle': '-', 'linewidth': 3.0},
        {'color': MEASURED, 'linestyle': '-', 'linewidth': 0.9},
    )


def _key(axes: Axes) -> None:
    handles = [Line2D([], [], **look) for look in reversed(_looks())]
    axes.legend(
        handles,
        ['measured', 'identity (26)', 'bound (28)'],
        loc='lower right',
        bbox_to_anchor=(1.0, 1.02),
        ncols=3,
        handlelength=2.4,
    )
