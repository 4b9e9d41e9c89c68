"""The dashboard of a snapshot: on a terminal of any size, or printed into a pipe."""

import io
import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import rich.live
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from auv_analysis.graph.domain import place_of
from auv_analysis.output.keyboard import Keyboard
from auv_analysis.output.progress import TextConsole, say, share_bar
from auv_analysis.watch.snapshot import Alert, NodeState, Six, Snapshot, TopicState
from auv_dynamics.files.errors import FailedError
from auv_dynamics.ros import interface
from auv_dynamics.vehicle import DOFS

if TYPE_CHECKING:
    from auv_analysis.watch.monitor import GraphMonitor

ABOVE = 11  # lines of heading, motion, footnote and the head of the lists
WIDE = 116  # columns from which set-points, rms and history are shown as well
HISTORY = 20  # half seconds
BAR = 9  # columns
NAME = 15  # columns, of the longest of our nodes
SHOWN_FACTS = 2
VELOCITY, WRENCH = 'm,rad/s', 'N,N m'
BASIC = (interface.ODOM, interface.CMD_VEL, interface.WRENCH)  # shown though nobody publishes them
STYLES = {'ok': 'green', 'warning': 'yellow', 'error': 'bold red', 'stale': 'yellow'}
MISSING = '–'
BLOCKS = ' ▁▂▃▄▅▆▇█'
LOOK = 0.05  # s between two looks at what has come
PATIENCE = 3.0  # s after which it is said what is waited for
SETTLED = 2.0  # s after the first message, when rates are known
ON_SCREEN, IN_PIPE = 4.0, 1.0  # refreshes per second where nothing is asked for
DATES = 1e9  # s: stamps from here on are of the wall clock


def screen(snapshot: Snapshot, width: int, height: int | None = None) -> RenderableType:
    """Dashboard of a snapshot.

    Parameters
    ----------
    snapshot : what is known
    width : columns
    height : lines; None: as many as it takes

    """
    most = None if height is None else max(2, height // 6)
    alerts = alert_lines(snapshot.alerts, width, most)
    if not alerts:
        alerts = [Text('nothing wrong seen' if snapshot.heard else '', 'green')]
    rows = None if height is None else max(1, height - ABOVE - len(alerts))
    lists = Table.grid(padding=(0, 2, 0, 0), expand=True)
    lists.add_column(no_wrap=True)
    lists.add_column(no_wrap=True, ratio=1)
    lists.add_row(topics_table(snapshot, rows), nodes_table(snapshot, rows, facts=width >= WIDE))
    return Group(
        _line(heading(snapshot).ljust(width), width, 'bold reverse'),
        motion_table(snapshot, width),
        _line(footnote(snapshot), width, 'dim'),
        *alerts,
        lists,
    )


def _line(text: str, width: int, style: str) -> Text:
    line = Text(text, style=style, no_wrap=True)
    line.truncate(width, overflow='ellipsis')
    return line


def _table(spacing: int) -> Table:
    return Table(box=None, padding=(0, spacing, 0, 0), pad_edge=False, header_style='bold')


def heading(snapshot: Snapshot) -> str:
    """Where is listened, and how far the graph is."""
    facts = ['auv watch', f'domain {snapshot.domain}']
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
    return '  '.join(facts)


def footnote(snapshot: Snapshot) -> str:
    """Legend of the numbers."""
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
    return '; '.join(parts)


def motion_table(snapshot: Snapshot, width: int) -> Table:
    """Errors, wrench, couplings and energy, a line per degree of freedom, for so many columns."""
    wide = width >= WIDE
    errors, zeros = snapshot.velocity_error, snapshot.structural_zeros or {}
    columns = {
        'nu': (VELOCITY, _texts(snapshot.nu, fixed)),
        'nu_d': (VELOCITY, _texts(snapshot.nu_d, fixed)),
        'error': (VELOCITY, _texts(errors.now, fixed)),
        'largest': (VELOCITY, _texts(errors.largest, fixed)),
        'rms': (VELOCITY, _texts(errors.rms, fixed)),
        'tau': (WRENCH, _texts(snapshot.tau, short)),
        'w': (WRENCH, _texts(snapshot.lumped_error, short)),
        'delta_xi': (VELOCITY, _texts(snapshot.delta_xi, fixed, zeros.get('delta_xi', ()))),
        'delta_pi': (WRENCH, _texts(snapshot.delta_pi, short, zeros.get('delta_pi', ()))),
    }
    if not wide:
        del columns['nu_d'], columns['rms']
    table = _table(1)
    table.add_column('')
    for name, (unit, _) in columns.items():
        table.add_column(f'{name}\n{unit}', justify='right', no_wrap=True, min_width=7)
    table.add_column('energy\n%', justify='right', no_wrap=True)
    table.add_column('', width=BAR, no_wrap=True)
    if wide:
        table.add_column('error, last 10 s', width=HISTORY, no_wrap=True)
    energy, history = snapshot.kinetic_energy, errors.history
    for i, dof in enumerate(DOFS):
        share = energy.shares_percent[i] if energy else None
        row: list[RenderableType] = [dof, *(texts[i] for _, texts in columns.values())]
        row += [fixed(share, 1), '' if share is None else share_bar(share, BAR)]
        if wide:
            row.append(spark([largest[i] for largest in history]))
        table.add_row(*row)
    return table


def _texts(
    values: Six | None, form: Callable[[float], str], zeros: Sequence[str] = ()
) -> list[str]:
    """Six numbers; couplings that vanish whatever the vehicle does, `zeros`, are no measurement."""
    texts = [MISSING] * 6 if values is None else [form(value) for value in values]
    return ['zero' if dof in zeros else text for dof, text in zip(DOFS, texts, strict=True)]


def topics_table(snapshot: Snapshot, rows: int | None = None) -> Table:
    """Table of the topics that are published; `rows` at most."""
    table = _table(2)
    table.add_column('topic', no_wrap=True)
    for name, width in (('msg/s', 6), ('age', 6), ('gaps', 4), ('dups', 4)):
        table.add_column(name, justify='right', no_wrap=True, min_width=width)
    shown = [
        topic
        for topic in snapshot.topics
        if (topic.publishers or topic.heard or topic.name in BASIC)
        and topic.name != interface.DIAGNOSTICS  # shown as nodes
    ]
    _add_rows(table, [_topic_row(topic) for topic in shown], rows)
    return table


def _add_rows(table: Table, found: Sequence[Sequence[Text]], rows: int | None) -> None:
    """Add what was found; of more than so many rows the last one says how many are left out."""
    left_out = len(found) - rows + 1 if rows is not None and len(found) > rows else 0
    for row in found[: len(found) - left_out]:
        table.add_row(*row)
    if left_out:
        table.add_row(f'and {left_out} more', style='dim')


def _topic_row(topic: TopicState) -> list[Text]:
    if not topic.publishers:
        state = 'no publisher' if not topic.heard else 'ended'
        return [Text(topic.name, 'dim'), Text(state, 'dim')]
    counts = (MISSING if value is None else str(value) for value in (topic.gaps, topic.repeats))
    return [
        Text(topic.name, 'bold red' if topic.refused else ''),
        Text(rate(topic.rate)),
        Text(seconds(topic.age)),
        *(Text(text, '' if text in ('0', MISSING) else 'yellow') for text in counts),
    ]


def nodes_table(snapshot: Snapshot, rows: int | None = None, *, facts: bool = True) -> Table:
    """Table of what the nodes say of themselves; `rows` at most, with or without their facts."""
    table = _table(2)
    table.add_column('node', no_wrap=True, min_width=NAME)
    table.add_column('health', no_wrap=True, overflow='ellipsis')
    found = [(Text(n.name.removeprefix('/')), _health(n, facts=facts)) for n in snapshot.nodes]
    _add_rows(table, found, rows)
    if not snapshot.nodes:
        table.add_row(Text(f'none on {interface.DIAGNOSTICS}', 'dim'))
    return table


def _health(node: NodeState, *, facts: bool) -> Text:
    text = Text().append(node.level, STYLES[node.level])
    if node.level == 'stale':
        text.append(f' for {seconds(node.age)}')
    if node.facts.get('ready') == 'False':
        text.append(' not ready', 'yellow')
    if node.facts.get('refused', '0') != '0':
        text.append(f' refused {node.facts["refused"]}', 'red')
    others = {key: value for key, value in node.facts.items() if key not in ('ready', 'refused')}
    for key, value in list(others.items())[: SHOWN_FACTS if facts else 0]:
        text.append(f' {key} {fact(value)}', 'dim')
    return text


def alert_lines(alerts: Sequence[Alert], width: int, most: int | None = None) -> list[Text]:
    """Problems, the worst first, wrapped to a width in columns; `most` lines at most."""
    lines = []
    for alert in alerts:
        seen = [f'{alert.count} times'] if alert.count > 1 else []
        seen += [f'{seconds(alert.age)} ago'] if alert.age >= 1.0 else []
        line = f'{", ".join([alert.level, *seen])}: {alert.text}'
        style = STYLES[alert.level]
        lines += [Text(part, style) for part in wrap(line, width, subsequent_indent='  ')]
    if most is not None and len(lines) > most:
        lines[most - 1 :] = [Text(f'and more: {len(alerts)} in all', lines[0].style)]
    return lines


def fixed(value: float | None, digits: int = 4) -> str:
    """Number with so many decimals; those that are very large in powers of ten."""
    if value is None:
        return MISSING
    return f'{value:z.{digits}f}' if abs(value) < 1000 else f'{value:.1e}'


def short(value: float) -> str:
    """Number in at most eight characters, with the decimals that its size leaves room for."""
    size = abs(value)
    if size >= 1e6:
        return f'{value:.1e}'
    digits = 0 if size >= 1000 else 1 if size >= 100 else 2 if size >= 10 else 3
    return f'{value:z.{digits}f}'


def seconds(value: float | None) -> str:
    """Age or time in s."""
    if value is None:
        return MISSING
    return f'{value:.1f} s' if value < 100 else f'{value:.0f} s'


def stamp(value: float) -> str:
    """Time of a message: s since the start of a simulation, else the time of day."""
    if value < DATES:
        return f'{value:.2f} s'
    return datetime.fromtimestamp(value, UTC).strftime('%H:%M:%S.%f')[:-5] + ' UTC'


def fact(value: str) -> str:
    """A node's own diagnostics; numbers with three digits."""
    try:
        return value if value.lstrip('-').isdecimal() else f'{float(value):.3g}'
    except ValueError:
        return value


def rate(value: float | None) -> str:
    """Messages per second."""
    if value is None:
        return MISSING
    return f'{value:.1f}' if value < 99.95 else f'{value:.0f}'


def spark(values: list[float]) -> str:
    """Values from 0 up as a row of blocks, the largest one full."""
    top = max(values, default=0.0)
    if top <= 0:
        return BLOCKS[1] * len(values)
    steps = len(BLOCKS) - 2
    return ''.join(BLOCKS[1 + round(steps * value / top)] for value in values)


class Display:
    """Shows snapshots: on the whole terminal while it is entered, or printed one after another.

    Parameters
    ----------
    stderr : whether standard output is for something else
    single : print the last snapshot only; else, without a terminal, each that holds something

    Attributes
    ----------
    live : whether the whole terminal is taken, which is as before afterwards

    """

    def __init__(self, *, stderr: bool, single: bool):
        stream = sys.stderr if stderr else sys.stdout
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors='replace')  # bars and dashes, where the encoding has none
        self._console = TextConsole(stderr=stderr, highlight=False)
        self._single = single
        self.live = self._console.is_terminal and not single
        self._live = rich.live.Live(console=self._console, screen=True, auto_refresh=False)

    def __enter__(self) -> 'Display':
        if self.live:
            self._live.start()
        return self

    def show(self, snapshot: Snapshot) -> None:
        """Show a snapshot."""
        if self.live:
            self._live.update(screen(snapshot, *self._console.size), refresh=True)
        elif snapshot.heard and not self._single:
            self._print(snapshot)
            self._console.print()

    def end(self, snapshot: Snapshot) -> None:
        """Show the last one, where it alone is wanted."""
        if self._single:
            self._print(snapshot)

    def _print(self, snapshot: Snapshot) -> None:
        self._console.print(screen(snapshot, self._console.width))

    def __exit__(self, *_: object) -> None:
        if self.live:
            self._live.stop()


class Session:
    """Listens and shows until there is a reason to end.

    Parameters
    ----------
    monitor : what is known of the graph
    listener : tells the monitor what comes in
    display : shows snapshots
    rate : refreshes per second; None: as many as suit the display

    """

    def __init__(
        self, monitor: 'GraphMonitor', listener: Any, display: Display, rate: float | None
    ):
        self._monitor, self._listener, self._display = monitor, listener, display
        self._period = 1.0 / (rate or (ON_SCREEN if display.live else IN_PIPE))
        self._said = False

    def run(self, keyboard: Keyboard, limit: float, *, once: bool) -> Snapshot:
        """Run for at most so many s; FailedError when nothing was heard in them."""
        begin = due = time.monotonic()
        settled = math.inf
        while True:
            self._listener.listen()
            now = time.monotonic()
            if self._monitor.moves and settled == math.inf:
                settled = now + SETTLED
            if now >= due:
                self._show(now, waits=PATIENCE < now - begin < limit)
                due = max(due + self._period, now)
            if keyboard.ended or (once and now >= settled):
                break
            if now - begin >= limit:
                snapshot = self._monitor.snapshot(now)
                if not snapshot.heard:
                    raise FailedError(f'{self._waits_for(snapshot)}: gave up after {limit:g} s')
                break
            keyboard.wait(LOOK)
        snapshot = self._monitor.snapshot(time.monotonic())
        self._display.end(snapshot)
        return snapshot

    def _show(self, now: float, *, waits: bool) -> None:
        snapshot = self._monitor.snapshot(now)
        if waits and not snapshot.heard:
            text = f'{self._waits_for(snapshot)}; waiting'
            snapshot = replace(snapshot, alerts=(Alert('warning', text), *snapshot.alerts))
            if not (self._said or self._display.live):
                say(text)
                self._said = True
        self._display.show(snapshot)

    def _waits_for(self, snapshot: Snapshot) -> str:
        what = 'nothing comes of' if snapshot.published else 'nobody publishes'
        names = f'{", ".join(BASIC[:-1])} or {BASIC[-1]}'
        text = f'{what} {names} on {place_of(snapshot.domain, snapshot.namespace)}'
        elsewhere = ' or '.join(self._listener.elsewhere())
        return f'{text}, but odometry in {elsewhere}: see --namespace' if elsewhere else text
