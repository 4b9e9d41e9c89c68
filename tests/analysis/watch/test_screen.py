"""The dashboard of a snapshot on terminals of several sizes and as text, and when it is shown."""

import io
import math
import sys
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import pytest
from rich.console import Console

from auv_analysis.cli import watch
from auv_analysis.cli.main import parser
from auv_analysis.watch import screen as module
from auv_analysis.watch.monitor import HEARD, GraphMonitor
from auv_analysis.watch.screen import (
    Display,
    Session,
    fact,
    fixed,
    screen,
    seconds,
    short,
    spark,
    stamp,
)
from auv_analysis.watch.snapshot import (
    Alert,
    Energy,
    Errors,
    NodeState,
    Snapshot,
    TopicState,
)  # fmt: skip
from auv_dynamics.files.errors import FailedError
from auv_dynamics.ros import interface
from auv_dynamics.vehicle import DOFS

FULL = Snapshot(
    domain=42,
    namespace='/auv1',
    vehicle='herman2018',
    motion=interface.ODOM,
    time=12.34,
    pace=9.87,
    recorded=12.3,
    nu=(1.1, 1.2, 1.3, 1.4, 1.5, 1.6),
    nu_d=(2.1, 2.2, 2.3, 2.4, 2.5, 2.6),
    tau=(-11479.0, 3.2, 333.3, 3.4, 3.5, 3.6),
    velocity_error=Errors(
        (4.1, 4.2, 4.3, 4.4, 4.5, 4.6), (5.1, 5.2, 5.3, 5.4, 5.5, 5.6),
        (6.1, 6.2, 6.3, 6.4, 6.5, 6.6), 10.0, ((1.0,) * 6, (2.0,) * 6),
    ),
    lumped_error=(7.1, 7.2, 7.3, 7.4, 7.5, 7.6),
    kinetic_energy=Energy(402.5, (1.0,) * 6, (50.0, 25.0, 12.5, 6.25, 6.25, 0.0)),
    delta_xi=(8.1, 8.2, 8.3, 8.4, 0.0, 0.0),
    delta_pi=(0.0, 9.2, 9.3, 9.4, 9.5, 9.6),
    structural_zeros={'delta_xi': ['pitch', 'yaw'], 'delta_pi': ['surge']},
    topics=(
        *(TopicState(name, 1, 2, 100.0, 0.25, 50, 50, 0, 0) for name in interface.STEP_TOPICS),
        *(TopicState(name, 1, 2, 10.0, 0.5, 5, 5, 0, 0) for name in interface.ANALYSIS_TOPICS),
        TopicState(interface.PROGRESS, 1, 2, 40.0, 0.0, 7, 7),
    ),
    nodes=(
        NodeState('/auv1/plant_node', 'ok', 'ok', 0.1, {'ready': 'True', 'step': '1234'}),
        NodeState('/auv1/controller_node', 'error', 'refused', 0.1, {'refused': '3'}),
        NodeState('/auv1/setpoint_node', 'stale', 'ok', 7.0, {'ready': 'False'}),
    ),
)  # fmt: skip
WRONG = tuple(Alert('error', f'trouble {i}', i, float(i)) for i in range(1, 10))


def lines(snapshot: Snapshot, width: int, height: int | None = None) -> list[str]:
    console = Console(file=io.StringIO(), width=width, height=height)
    console.print(screen(snapshot, width, height))
    return console.file.getvalue().splitlines()


def row(found: list[str], name: str) -> list[str]:
    return next(line.split() for line in found if line.split()[:1] == [name])


@pytest.mark.parametrize('size', [(80, 24), (120, 40), (200, 60), (80, 12), (60, 10)])
@pytest.mark.parametrize(
    'snapshot',
    [Snapshot(0), FULL, replace(FULL, alerts=WRONG), replace(FULL, nodes=FULL.nodes * 15)],
)
def test_a_terminal_is_never_too_small(snapshot: Snapshot, size: tuple[int, int]) -> None:
    found = lines(snapshot, *size)
    assert max(map(len, found)) <= size[0]
    if size[1] >= 24:
        assert len(found) <= size[1]


def test_numbers_stand_in_their_rows_and_columns() -> None:
    found = lines(FULL, 80, 24)
    surge, yaw = row(found, 'surge'), row(found, 'yaw')
    numbers = ['1.1000', '4.1000', '5.1000', '-11479', '7.100', '8.1000', 'zero', '50.0']
    assert surge[1:9] == numbers
    assert yaw[1:9] == ['1.6000', '4.6000', '5.6000', '3.600', '7.600', 'zero', '9.600', '0.0']
    for i, dof in enumerate(DOFS):
        assert row(found, dof)[8] == fixed(FULL.kinetic_energy.shares_percent[i], 1)
    head = found[1].split()
    assert head == ['nu', 'error', 'largest', 'tau', 'w', 'delta_xi', 'delta_pi', 'energy']


def test_a_wide_terminal_shows_more() -> None:
    found = lines(FULL, 120, 40)
    assert found[1].split()[:5] == ['nu', 'nu_d', 'error', 'largest', 'rms']
    surge = row(found, 'surge')
    assert surge[1:6] == ['1.1000', '2.1000', '4.1000', '5.1000', '6.1000']
    assert surge[-1] == '▅█'
    for name in interface.ANALYSIS_TOPICS:
        assert row(found, name)[1:] == ['10.0', '0.5', 's', '0', '0']


def test_bars_are_as_long_as_the_shares() -> None:
    found = lines(FULL, 80, 24)
    lengths = [len(''.join(row(found, dof)[9:])) for dof in DOFS]
    assert lengths == sorted(lengths, reverse=True)
    assert (lengths[0], lengths[-1]) == (5, 0)  # of nine columns


def test_heading_and_footnote_say_where_when_and_what() -> None:
    found = lines(FULL, 120, 40)
    for words in ('domain 42', '/auv1', 't = 12.34 s', '9.87 x real time', 'recorded to 12.30 s'):
        assert words in found[0]
    footnote = next(line for line in found if 'kinetic energy' in line)
    assert footnote.strip() == 'kinetic energy 402.5 J; largest error of 10 s'
    changed = replace(FULL, computed=True, motion=interface.GROUND_TRUTH)
    text = ' '.join(lines(changed, 160))
    for words in ('computed for herman2018', f'nu of {interface.GROUND_TRUTH}'):
        assert words in text
    assert 'energy, couplings: by analysis_node' in ' '.join(
        lines(replace(FULL, kinetic_energy=None), 160)
    )


def test_what_is_not_known_is_a_dash() -> None:
    found = lines(Snapshot(3), 80, 24)
    assert 'nobody publishes' in found[0]
    for dof in DOFS:
        assert set(row(found, dof)[1:]) == {'–'}
    nobody = replace(Snapshot(3), topics=(TopicState(interface.ODOM), TopicState(interface.TWIST)))
    found = lines(nobody, 80, 24)
    assert row(found, interface.ODOM)[1:3] == ['no', 'publisher']
    assert interface.TWIST not in ' '.join(found), 'not everybody publishes it'


def test_topics_and_nodes_are_listed_with_their_health() -> None:
    found = lines(FULL, 120)
    text = ' '.join(found)
    assert row(found, interface.ODOM)[1:5] == ['100', '0.2', 's', '0']
    assert any(line.split()[-2:] == ['node', 'health'] for line in found)
    assert row(found, interface.PROGRESS)[-2:] == ['–', '–']
    low = [line.split() for line in lines(FULL, 80, 12)]
    assert ['and', f'{len(FULL.topics)}', 'more', 'and', f'{len(FULL.nodes)}', 'more'] in low
    assert 'auv1/controller_node  error refused 3' in text
    assert 'auv1/plant_node       ok step 1234' in text
    assert 'stale for 7.0 s not ready' in text
    ended = replace(FULL, topics=(TopicState(interface.ODOM, heard=9), *FULL.topics[1:]))
    assert row(lines(ended, 120), interface.ODOM)[1] == 'ended'


def test_names_are_shown_as_they_are() -> None:
    odd = NodeState('camera: [front]', 'ok', 'ok', 0.0, {'[red]': '[b]'})
    text = ' '.join(lines(replace(FULL, nodes=(odd,)), 120))
    assert 'camera: [front]' in text
    assert '[red] [b]' in text


def test_troubles_are_lines_of_their_own_and_end_where_the_terminal_does() -> None:
    found = lines(replace(FULL, alerts=WRONG), 80, 24)
    assert 'error, 1.0 s ago: trouble 1' in [line.strip() for line in found]
    assert 'and more: 9 in all' in ' '.join(found)
    low = ' '.join(lines(replace(FULL, alerts=WRONG), 80, 8))
    assert 'trouble 1' in low
    assert 'trouble 2' not in low
    assert 'and more: 9 in all' in low
    assert '2 times, 2.0 s ago: trouble 2' in ' '.join(lines(replace(FULL, alerts=WRONG[1:3]), 80))
    everything = lines(replace(FULL, alerts=WRONG), 80)
    assert sum('trouble' in line for line in everything) == 9
    assert 'nothing wrong seen' in ' '.join(lines(FULL, 80, 24))
    long = Alert('error', 'x' * 30 + ' ' + 'y' * 30 + ' ' + 'z' * 30)
    assert 'zzz' in ' '.join(lines(replace(FULL, alerts=(long,)), 80, 24)), 'none is cut off'


def test_what_is_wrong_is_yellow_or_red_on_a_terminal() -> None:
    first, *others = FULL.topics
    topics = (replace(first, refused=1, gaps=77), *others)
    alerts = (*WRONG[:1], Alert('warning', 'doubt'))
    console = Console(file=io.StringIO(), width=120, force_terminal=True, color_system='standard')
    console.print(screen(replace(FULL, topics=topics, alerts=alerts), 120))
    text = console.file.getvalue()
    yellow, red, bold_red = '\x1b[33m', '\x1b[31m', '\x1b[1;31m'
    for words in (
        f'{yellow}warning: doubt',
        f'{yellow}  77',
        f'{yellow}stale',
        f'{yellow} not ready',
    ):
        assert words in text
    for words in (f'{bold_red}error, 1.0 s ago: trouble 1', f'{bold_red}{first.name}',
                  f'{bold_red}error\x1b[0m{red} refused 3'):  # fmt: skip
        assert words in text


def test_bars_and_dashes_are_marks_where_the_encoding_has_none(monkeypatch) -> None:
    out = io.TextIOWrapper(io.BytesIO(), encoding='latin-1')
    monkeypatch.setattr(sys, 'stdout', out)
    Display(stderr=False, single=True).end(FULL)
    assert 'surge' in out.buffer.getvalue().decode('latin-1')


def test_texts_of_numbers() -> None:
    assert [fixed(x) for x in (None, 0.12345, -0.00001, -1.5, 1234.5)] == [
        '–', '0.1235', '0.0000', '-1.5000', '1.2e+03'
    ]  # fmt: skip
    assert [short(x) for x in (0.0004, -0.0004, 12.345, 123.45, -11479.1, 2e6)] == [
        '0.000', '0.000', '12.35', '123.5', '-11479', '2.0e+06'
    ]  # fmt: skip
    assert [fixed(x) for x in (999.9, -1000.0)] == ['999.9000', '-1.0e+03']
    assert [short(x) for x in (9.5, 10.0, 99.5, 100.0, 999.5, 1000.0, 999_999.0, 1e6)] == [
        '9.500', '10.00', '99.50', '100.0', '999.5', '1000', '999999', '1.0e+06'
    ]  # fmt: skip
    assert [module.rate(x) for x in (None, 99.94, 99.96)] == ['–', '99.9', '100']
    assert [seconds(x) for x in (None, 0.04, 99.94, 250.0)] == ['–', '0.0 s', '99.9 s', '250 s']
    assert [stamp(x) for x in (12.345, 1_700_000_000.5)] == ['12.35 s', '22:13:20.5 UTC']
    assert [fact(x) for x in ('12345', '-3', '0.00012345', 'odom')] == [
        '12345', '-3', '0.000123', 'odom'
    ]  # fmt: skip
    assert spark([0.0, 0.0]) == '▁▁'
    assert spark([0.0, 1.0, 2.0])[::2] == '▁█'


@dataclass
class Graph:
    """A clock, a listener on a graph whose odometry begins at a time, and no keyboard."""

    begins: float = math.inf
    published: bool = False
    conflicts: tuple[str, ...] = ()
    others: list[str] = field(default_factory=list)
    now: float = 0.0
    ended: bool = False
    monitor: GraphMonitor = field(default_factory=lambda: GraphMonitor(7))

    def monotonic(self) -> float:
        return self.now

    def listen(self) -> None:
        there = {'publishers': self.published, 'conflicts': self.conflicts}
        ends = SimpleNamespace(subscribers=0, foreign='', **there)
        self.monitor.see(self.now, dict.fromkeys(HEARD, ends))
        if self.now >= self.begins:
            self.monitor.hear(self.now, interface.ODOM, None, round(self.now * 1e9), None)

    def elsewhere(self) -> list[str]:
        return self.others

    def wait(self, _: float) -> bytes:
        self.now += 1 / 16  # s, which add up without rounding
        return b''


def run(graph: Graph, monkeypatch: pytest.MonkeyPatch, **options: Any) -> Snapshot:
    """Run a session of `auv watch` in a pipe."""
    given = {'single': False, 'rate': None, 'limit': math.inf, 'once': False, **options}
    monkeypatch.setattr(module, 'time', graph)
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    display = Display(stderr=False, single=given['single'])
    session = Session(graph.monitor, graph, display, given['rate'])
    return session.run(graph, given['limit'], once=given['once'])


def test_once_is_when_rates_are_known(monkeypatch, capsys) -> None:
    found = run(Graph(begins=9.0), monkeypatch, once=True, single=True)
    assert found.seconds == 11.0
    said = capsys.readouterr()
    assert said.out.count('auv watch') == 1
    assert said.err.splitlines() == [
        'nobody publishes odom, cmd_vel or wrench on ROS_DOMAIN_ID=7, '
        'this machine only (ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST); waiting'
    ]


@pytest.mark.parametrize(('rate', 'shown'), [(None, 4), (4.0, 15)])
def test_in_a_pipe_every_look_that_shows_something_is_printed(
    monkeypatch, capsys, rate: float | None, shown: int
) -> None:
    found = run(Graph(begins=1.5), monkeypatch, limit=5.0, rate=rate)
    assert found.heard
    assert capsys.readouterr().out.count('auv watch') == shown


@pytest.mark.parametrize(
    ('there', 'words'),
    [
        ({}, '^nobody publishes odom, cmd_vel or wrench on .*: gave up after 2 s'),
        ({'published': True}, '^nothing comes of odom, cmd_vel or wrench on '),
        ({'others': ['/', '/auv7']}, 'but odometry in / or /auv7: see --namespace'),
    ],
)
def test_what_was_waited_for_in_vain_is_said(monkeypatch, there: dict, words: str) -> None:
    with pytest.raises(FailedError, match=words):
        run(Graph(**there), monkeypatch, limit=2.0, single=True)


def test_what_is_wrong_is_shown_while_it_waits(monkeypatch) -> None:
    graph, shown = Graph(conflicts=('incompatible QoS',)), []
    monkeypatch.setattr(module, 'time', graph)
    display = SimpleNamespace(live=True, show=shown.append)
    with pytest.raises(FailedError):
        Session(graph.monitor, graph, display, None).run(graph, 9.9, once=False)
    first, second, *_ = shown[-1].alerts
    assert first.text.endswith('; waiting')
    assert second.text == 'incompatible QoS'


def test_the_command_shows_what_it_is_asked_for(monkeypatch) -> None:
    asked = []

    def session(monitor: GraphMonitor, _: object, single: bool, rate: float | None) -> Any:
        asked.append((single, rate))
        return SimpleNamespace(run=lambda *_, once: monitor.snapshot(0.0))

    monkeypatch.setattr(module, 'Session', session)
    monkeypatch.setattr(module, 'Display', lambda *, stderr, single: nullcontext(single))
    monkeypatch.setattr('auv_analysis.output.keyboard.Keyboard', nullcontext)
    monkeypatch.setattr('auv_analysis.graph.supervisor.give_way', lambda: None)
    monkeypatch.setattr('auv_analysis.graph.domain.join_domain', lambda asked: asked)
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')  # as it would
    node = SimpleNamespace(Listener=lambda *_: SimpleNamespace(close=lambda: None))
    monkeypatch.setitem(sys.modules, 'auv_analysis.nodes.watch_node', node)
    for line in ('', '--rate 9', '--once', '--for 1'):
        watch.run(parser(['watch']).parse_args(['watch', '--domain-id', '7', *line.split()]))
    assert asked == [(False, None), (False, 9.0), (True, None), (True, None)]
