"""A snapshot as something that rich prints: on a terminal of any size, or into a pipe."""

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from auv_analysis.watch.motion_table import WIDE, motion_table
from auv_analysis.watch.panels import nodes_table, topics_table, troubles_lines
from auv_analysis.watch.sampling import LISTEN, PERIOD
from auv_analysis.watch.snapshot import Snapshot
from auv_analysis.watch.text import short, stamp
from auv_dynamics.ros import interface

ABOVE = 11  # lines of heading, motion, footnote and the head of the lists


def screen(snapshot: Snapshot, width: int, height: int | None = None) -> RenderableType:
    """Dashboard of a snapshot.

    Parameters
    ----------
    snapshot : what is known
    width : columns
    height : lines; None: as many as it takes

    """
    narrow = width < WIDE
    most = None if height is None else max(2, height // 6)
    health = troubles_lines(snapshot.troubles, width, most) or [nothing_wrong(snapshot)]
    rows = None if height is None else max(1, height - ABOVE - len(health))
    lists = Table.grid(padding=(0, 2, 0, 0), expand=True)
    lists.add_column(no_wrap=True)
    lists.add_column(no_wrap=True, ratio=1)
    lists.add_row(
        topics_table(snapshot, rows, folded=narrow), nodes_table(snapshot, rows, facts=not narrow)
    )
    return Group(
        heading(snapshot, width),
        motion_table(snapshot, width),
        _line(footnote(snapshot), width, 'dim'),
        *health,
        lists,
    )


def heading(snapshot: Snapshot, width: int) -> Text:
    """Where is listened, and how far the graph is."""
    facts = [f'domain {snapshot.domain}']
    if snapshot.namespace != '/':
        facts.append(snapshot.namespace)
    if snapshot.time is None:
        facts.append('waits for odometry' if snapshot.published else 'nobody publishes')
    else:
        facts.append(f't = {stamp(snapshot.time)}')
        if snapshot.pace is not None:
            facts.append(f'{snapshot.pace:.3g} x real time')
        if snapshot.recorded is not None:
            facts.append(f'recorded to {stamp(snapshot.recorded)}')
    return _line(f'auv watch  {"  ".join(facts)}'.ljust(width), width, 'bold reverse')


def nothing_wrong(snapshot: Snapshot) -> Text:
    """What stands where troubles would stand."""
    return Text('nothing wrong seen' if snapshot.heard else '', 'green')


def footnote(snapshot: Snapshot) -> str:
    """What the numbers are."""
    errors, parts = snapshot.velocity_error, []
    if snapshot.kinetic_energy is not None:
        parts.append(f'kinetic energy {short(snapshot.kinetic_energy.total)} J')
    if errors.largest is not None:
        parts.append(f'largest error of {errors.window:g} s')
    if snapshot.motion == interface.GROUND_TRUTH:
        parts.append(f'nu of {snapshot.motion}')
    if snapshot.computed:
        parts.append(f'computed for {snapshot.vehicle}')
    elif snapshot.time is not None and snapshot.kinetic_energy is None:
        parts.append('energy, couplings: by analysis_node, or with --vehicle')
    if snapshot.sampled:
        parts.append(f'listens {LISTEN:g} s of each {PERIOD:g} s')
    return '; '.join(parts)


def _line(text: str, width: int, style: str) -> Text:
    line = Text(text, style=style, no_wrap=True)
    line.truncate(width, overflow='ellipsis')
    return line
