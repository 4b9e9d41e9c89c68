"""Errors, wrench, couplings and energy of a snapshot, a line per degree of freedom."""

from collections.abc import Callable

from rich.console import RenderableType
from rich.table import Table

from auv_analysis.output.progress import share_bar
from auv_analysis.watch.snapshot import Six, Snapshot
from auv_analysis.watch.text import MISSING, fixed, short, spark
from auv_dynamics.vehicle import DOFS

WIDE = 116  # columns from which set-points, rms and history are shown as well
HISTORY = 20  # half seconds
BAR = 9  # columns; more where there is room
VELOCITY, WRENCH = 'm,rad/s', 'N,N m'
Column = tuple[str, str, list[str]]


def motion_table(snapshot: Snapshot, width: int) -> Table:
    """Table of a snapshot for so many columns; what is not known is a dash."""
    wide = width >= WIDE
    table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False, header_style='bold')
    table.add_column('')
    columns = _columns(snapshot, wide=wide)
    for name, unit, _ in columns:
        table.add_column(f'{name}\n{unit}', justify='right', no_wrap=True, min_width=7)
    table.add_column('energy\n%', justify='right', no_wrap=True)
    table.add_column('', width=BAR, no_wrap=True)
    if wide:
        table.add_column('error, last 10 s', width=HISTORY, no_wrap=True)
    energy, history = snapshot.kinetic_energy, snapshot.velocity_error.history[-HISTORY:]
    for i, dof in enumerate(DOFS):
        share = energy.shares_percent[i] if energy else None
        row: list[RenderableType] = [dof, *(texts[i] for _, _, texts in columns)]
        row += [fixed(share, 1), '' if share is None else share_bar(share, BAR)]
        if wide:
            row.append(spark([largest[i] for largest in history]))
        table.add_row(*row)
    return table


def _columns(snapshot: Snapshot, *, wide: bool) -> list[Column]:
    errors, zeros = snapshot.velocity_error, snapshot.structural_zeros or {}
    found = [
        ('nu', VELOCITY, _texts(snapshot.nu, fixed)),
        ('nu_d', VELOCITY, _texts(snapshot.nu_d, fixed)),
        ('error', VELOCITY, _texts(errors.now, fixed)),
        ('largest', VELOCITY, _texts(errors.largest, fixed)),
        ('rms', VELOCITY, _texts(errors.rms, fixed)),
        ('tau', WRENCH, _texts(snapshot.tau, short)),
        ('w', WRENCH, _texts(snapshot.lumped_error, short)),
        ('delta_xi', VELOCITY, _coupling(snapshot.delta_xi, zeros.get('delta_xi', []), fixed)),
        ('delta_pi', WRENCH, _coupling(snapshot.delta_pi, zeros.get('delta_pi', []), short)),
    ]
    return [column for column in found if wide or column[0] not in ('nu_d', 'rms')]


def _texts(values: Six | None, form: Callable[[float], str]) -> list[str]:
    return [MISSING] * 6 if values is None else [form(value) for value in values]


def _coupling(values: Six | None, zeros: list[str], form: Callable[[float], str]) -> list[str]:
    """Couplings; those that vanish for this vehicle whatever it does are no measurement."""
    texts = _texts(values, form)
    return ['zero' if dof in zeros else text for dof, text in zip(DOFS, texts, strict=True)]
