"""What of a bag is played under which names, and what counts as a command."""

from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import pytest

from auv_analysis.bag.metadata import Definition
from auv_analysis.bag.step_topics import ODOMETRY, TWIST, WRENCH
from auv_analysis.cli import replay
from auv_analysis.cli.main import parser
from auv_analysis.graph import domain
from auv_analysis.replay.played_bag import BagIndex
from auv_analysis.replay.selection import ReplaySettings, is_command, select
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.ros import interface

STRING = 'std_msgs/msg/String'
KINDS = {
    '/odom': ODOMETRY,
    '/twist': TWIST,
    '/cmd_vel': TWIST,
    '/cmd_accel': 'geometry_msgs/msg/AccelStamped',
    '/wrench': WRENCH,
    '/disturbance': WRENCH,
    '/disturbance_estimate': WRENCH,
    '/wrench_applied': WRENCH,
    '/ground_truth/odom': ODOMETRY,
    **{f'/{topic}': WRENCH for topic in interface.ANALYSIS_TOPICS},
    '/recorder/progress': 'std_msgs/msg/Header',
    '/diagnostics': 'diagnostic_msgs/msg/DiagnosticArray',
    '/clock': 'rosgraph_msgs/msg/Clock',
    '/remark': STRING,
}
DERIVED = {f'/{topic}' for topic in interface.ANALYSIS_TOPICS} | {
    '/recorder/progress', '/diagnostics', '/clock'
}  # fmt: skip
COMMANDS = {'/wrench', '/cmd_vel', '/cmd_accel'}


def index(kinds: dict[str, str] = KINDS, encoding: str = 'cdr') -> BagIndex:
    topics = {topic: Definition(topic, kind, encoding) for topic, kind in kinds.items()}
    return BagIndex(Path('bag'), topics=topics)


def resolved(name: str) -> str:
    return name if name.startswith('/') else f'/{name}'


def test_everything_but_what_is_derived_comes_under_replay() -> None:
    found = select(index(), ReplaySettings(), resolved)
    assert found.names == {t: f'replay{t}' for t in KINDS if t not in DERIVED}
    assert found.left_out.keys() == DERIVED
    assert not found.guarded


def test_all_is_all() -> None:
    found = select(index(), ReplaySettings(everything=True), resolved)
    assert found.names.keys() == KINDS.keys()


@pytest.mark.parametrize('names', [{'original_names': True}, {'namespace': '/auv1'}])
def test_outside_of_replay_commands_are_left_out(names: dict) -> None:
    root = '' if 'original_names' in names else '/auv1'
    found = select(index(), ReplaySettings(**names), resolved)
    assert found.names == {t: f'{root}{t}' for t in KINDS if t not in DERIVED | COMMANDS}
    assert found.left_out.keys() == DERIVED | COMMANDS
    told = select(index(), ReplaySettings(**names, commands=True), resolved)
    assert told.guarded == COMMANDS
    assert told.left_out.keys() == DERIVED


def test_a_command_that_nobody_sees_is_one_where_it_is_named() -> None:
    wish = ReplaySettings(original_names=True, command_topics=('/remark',))
    assert select(index(), wish, resolved).left_out.keys() == DERIVED | COMMANDS | {'/remark'}


def test_there_is_one_clock_whatever_is_asked_for() -> None:
    wish = ReplaySettings(original_names=True, everything=True, commands=True)
    found = select(index(), wish, resolved)
    assert found.left_out == {'/clock': 'the time of the replay stands there'}


def test_a_name_counts_after_remapping() -> None:
    remaps = {'replay/wrench': '/wrench', 'replay/cmd_vel': '/other/replay/cmd_vel'}
    found = select(index(), ReplaySettings(), lambda name: remaps.get(name, resolved(name)))
    assert found.left_out.keys() == DERIVED | {'/wrench'}


def test_patterns_choose_topics() -> None:
    found = select(
        index(), ReplaySettings(topics=('odom', '/dist*', 'analysis/delta_xi')), resolved
    )
    assert found.names.keys() == {
        '/odom', '/disturbance', '/disturbance_estimate', '/analysis/delta_xi'
    }  # fmt: skip
    assert found.remarks() == []


def test_a_vehicle_in_a_namespace_has_the_same_topics() -> None:
    spaced = {f'/auv1{topic}' if topic not in ('/clock', '/diagnostics') else topic: kind
              for topic, kind in KINDS.items()}  # fmt: skip
    found = select(index(spaced), ReplaySettings(original_names=True), resolved)
    left = {t if t in ('/clock', '/diagnostics') else f'/auv1{t}' for t in DERIVED | COMMANDS}
    assert found.left_out.keys() == left


@pytest.mark.parametrize(
    ('topic', 'kind', 'expected'),
    [
        ('/thruster_manager/input', WRENCH, True),
        ('/mavros/setpoint_velocity/cmd_vel_unstamped', 'geometry_msgs/msg/Twist', True),
        ('/mavros/rc/override', 'mavros_msgs/msg/OverrideRCIn', True),
        ('/auv1/thrusters/3/input', 'std_msgs/msg/Float64', True),
        ('/auv1/thruster12', 'std_msgs/msg/Float64', True),
        ('/cmd2/x', 'std_msgs/msg/Float64', True),
        ('/auv1/motor_3', 'std_msgs/msg/Float64', True),
        ('/pwm', 'std_msgs/msg/UInt16MultiArray', True),
        ('/motorway', STRING, False),
        ('/joy', 'sensor_msgs/msg/Joy', False),
        ('/auv1/odom', ODOMETRY, False),
        ('/auv1/disturbance', WRENCH, False),
        ('/auv1/wrench_applied', WRENCH, False),
        ('/thrust', STRING, True),
        ('/thrusting', STRING, False),
        ('/go', STRING, True),
    ],
)
def test_what_a_command_is(topic: str, kind: str, expected: bool) -> None:
    assert is_command(topic, kind, ['go']) == expected


@pytest.mark.parametrize(
    ('wish', 'bag', 'words'),
    [
        (ReplaySettings(topics=('sonar',)), index(), 'topics: expected one of .* found sonar'),
        (ReplaySettings(topics=('clock',), original_names=True), index(), 'the time of the replay'),
        (
            ReplaySettings(original_names=True),
            index({'/wrench': WRENCH}),
            '--commands publishes it',
        ),
        (ReplaySettings(), index({}), 'expected a topic that can be played'),
        (ReplaySettings(), index(encoding='ros1'), 'its messages are ros1, not cdr'),
        (ReplaySettings(), index({'/a-b': STRING}), 'not a name of a ROS topic'),
        (ReplaySettings(), index({'//a': STRING}), 'not a name of a ROS topic'),
    ],
)
def test_refuses_to_play_nothing(wish: ReplaySettings, bag: BagIndex, words: str) -> None:
    with pytest.raises(InputError, match=words):
        select(bag, wish, resolved)


@pytest.mark.parametrize(
    ('line', 'changed'),
    [
        ('--commands', {'commands': True}),
        ('--force-commands', {'commands': True, 'allow_commands_to_foreign': True}),
        ('--no-clock', {'clock': False}),
        ('--paused', {'start_paused': True}),
        ('--loop', {'loop': True}),
        ('--all', {'all': True}),
        ('--skip-gaps', {'skip_gaps': True}),
        ('--original-names', {'original_names': True}),
        ('--namespace x', {'namespace': 'x'}),
        ('--rate max', {'rate': 0.0}),
        ('--start 2 --duration 3', {'start': 2.0, 'duration': 3.0}),
        ('--topics a b', {'topics': ['a', 'b']}),
        ('--expect a=1 --answers b', {'expected_subscribers': ['a=1'], 'answers': 'b'}),
    ],
)
def test_an_option_of_the_command_is_its_parameter_alone(line: str, changed: dict) -> None:
    usual, asked = (
        replay._parameters(parser().parse_args(['replay', 'bag', *words]))
        for words in ((), line.split())
    )
    assert not any(usual[key] for key in ('commands', 'allow_commands_to_foreign'))
    assert asked == usual | changed
    assert asked.keys() == usual.keys()


def test_a_replay_is_as_fast_as_the_bag_from_its_begin_once() -> None:
    s = ReplaySettings()
    assert (s.rate, s.start, s.duration, s.loop, s.clock) == (1.0, 0.0, 0.0, False, True)
    assert (s.namespace, s.start_paused) == ('replay', False)


def test_a_replay_joins_the_domain_that_is_asked_for(monkeypatch) -> None:
    def join(asked: int) -> None:
        raise FailedError(f'joins {asked}')

    monkeypatch.setattr(domain, 'join_domain', join)
    options = parser(['replay']).parse_args(['replay', 'bag', '--domain-id', '7'])
    with pytest.raises(FailedError, match='joins 7'):
        replay.run(options)


def test_the_document_says_what_went_wrong() -> None:
    bag = BagIndex(Path('bag'), first=0, notes=['damaged'])
    chosen = SimpleNamespace(left_out={})
    plan = SimpleNamespace(index=bag, begin=0, end=1, selection=chosen, gaps=[])
    guard = SimpleNamespace(stopped='a pilot')
    heard = SimpleNamespace(silent=['/odom'])
    player = SimpleNamespace(
        names={}, published=Counter(), now_ns=0, loops=0, guard=guard, receivers=heard
    )
    keyboard = SimpleNamespace(ended=False)
    document = replay._document(SimpleNamespace(player=player, plan=plan), keyboard, 1.0)
    told = {'commands_stopped': 'a pilot', 'silent': ['/odom'], 'notes': ['damaged']}
    assert told.items() <= document.items()
