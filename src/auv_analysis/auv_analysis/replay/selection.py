"""Selection of what is replayed of a bag, and how, by ROS parameters."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any

from auv_analysis.bag.step_topics import WRENCH
from auv_analysis.replay.played_bag import BagIndex, index_bag
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import one_of
from auv_dynamics.ros import interface
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.ros.parameters import declare_settings
from auv_dynamics.ros.settings import setting
from auv_dynamics.ros.topics import is_name

REPLAY = 'replay'  # namespace in which nothing of a vehicle listens
DERIVED = (
    *interface.ANALYSIS_TOPICS, interface.DIAGNOSTICS, interface.PROGRESS, interface.CLOCK,
)  # fmt: skip
COMMANDS = (interface.WRENCH, interface.CMD_VEL, interface.CMD_ACCEL)
MEASURED = (interface.WRENCH_APPLIED, interface.DISTURBANCE, interface.DISTURBANCE_ESTIMATE)
FORCES = (WRENCH, WRENCH.removesuffix('Stamped'))
WORDS = re.compile(
    '(^|[/_])(cmd|commands?|setpoints?|wrench|thrusts?|thrusters?|actuators?|servos?|motors?|'
    'propellers?|pwm|escs?|override)[0-9]*([/_]|$)'
)
UNWANTED = 'not asked for'


@dataclass(frozen=True)
class ReplaySettings:
    """Settings of the replay node: what of a bag is played, and how."""

    bag: str = setting('', 'folder or .mcap file', needed='a bag folder or an .mcap file')
    namespace: str = setting(REPLAY, 'before the recorded names')
    original_names: bool = setting(False, 'no namespace: the recorded names')
    commands: bool = setting(False, f'commands also outside of /{REPLAY}')
    everything: bool = setting(
        False, 'also analysis, diagnostics, progress and clock as recorded', 'all'
    )
    topics: tuple[str, ...] = setting((), 'recorded names or patterns, none: all')
    command_topics: tuple[str, ...] = setting(
        (), 'recorded names that are commands although neither name nor type shows it'
    )
    start: float = setting(0.0, 's from the beginning of the bag', at_least=0.0)
    duration: float = setting(0.0, 's of the bag, 0: to its end', at_least=0.0)
    rate: float = setting(
        1.0, 's of the bag per s, 0: as fast as possible without loss', at_least=0.0, writable=True
    )
    loop: bool = setting(False, 'begin again at the end')
    start_paused: bool = setting(False, 'wait for ~/run')
    skip_gaps: bool = setting(False, 'jump where nothing was recorded for a minute')
    clock: bool = setting(True, 'publish /clock')
    allow_commands_to_foreign: bool = setting(
        False, 'publish commands also where a node that is not ours acts on them'
    )
    expected_subscribers: tuple[str, ...] = setting(
        (), 'topic=count, topics as recorded: nothing is published until so many have matched'
    )
    answers: str = setting(
        '', 'topic of wrenches: the next odometry waits for the one with the stamp of the last'
    )


@dataclass
class Selection:
    """What is played.

    Attributes
    ----------
    names : recorded name -> name under which it is published, with its namespace
    guarded : recorded names of commands that a vehicle may hear
    left_out : recorded name -> why it is not played

    """

    names: dict[str, str] = field(default_factory=dict)
    guarded: set[str] = field(default_factory=set)
    left_out: dict[str, str] = field(default_factory=dict)

    def reasons(self) -> list[str]:
        """Why topics are left out, each once; nothing of those that nobody asked for."""
        return [why for why in dict.fromkeys(self.left_out.values()) if why != UNWANTED]

    def remarks(self) -> list[str]:
        """Messages that are left out, a line per reason."""
        listed = {why: [t for t, w in self.left_out.items() if w == why] for why in self.reasons()}
        return [f'left out: {", ".join(topics)}: {why}' for why, topics in listed.items()]


def is_command(topic: str, kind: str, named: Iterable[str] = ()) -> bool:
    """Whether a vehicle may act on a topic: by its name, or because it carries a wrench.

    Parameters
    ----------
    topic, kind : recorded name and type
    named : recorded names of commands that neither shows

    """
    if any(_is(topic, name) for name in named):
        return True
    if any(_is(topic, name) for name in (*MEASURED, *interface.ANALYSIS_TOPICS)):
        return False
    ours = any(_is(topic, name) for name in COMMANDS)
    return ours or kind in FORCES or WORDS.search(topic.lower()) is not None


def select(index: BagIndex, wish: ReplaySettings, resolve: Callable[[str], str]) -> Selection:
    """Choose the topics of a bag.

    Parameters
    ----------
    index : of the bag
    wish : what is asked for
    resolve : full name of a topic, as the middleware remaps it

    Raises
    ------
    InputError : a topic is asked for that is not there, or nothing is left

    """
    for pattern in wish.topics:
        if not any(_is_like(topic, pattern) for topic in index.topics):
            expected = one_of(pattern, sorted(index.topics))
            raise InputError(index.bag, 'topics', expected, pattern)
    found = Selection()
    for topic in sorted(index.topics):
        name = _published(topic, wish)
        why = _against(topic, index, wish)
        if not why:
            full = resolve(name)
            why = _against_name(topic, index.topics[topic].kind, full, wish, found)
        if why:
            found.left_out[topic] = why
        else:
            found.names[topic] = name
    if not found.names:
        raise nothing_left(index, found)
    return found


def nothing_left(index: BagIndex, found: Selection) -> InputError:
    """Refusal of a bag of which nothing is played."""
    reasons = f'none: {"; ".join(found.reasons())}' if found.left_out else 'no topics'
    return InputError(index.bag, '', 'a topic that can be played', reasons)


def _published(topic: str, wish: ReplaySettings) -> str:
    absolute = f'/{topic.lstrip("/")}'
    if wish.original_names:
        return absolute
    return f'{wish.namespace.rstrip("/")}{absolute}'


def _against(topic: str, index: BagIndex, wish: ReplaySettings) -> str:
    """Why a topic is not played whatever its new name, or an empty text."""
    about = index.topics[topic]
    if wish.topics and not any(_is_like(topic, pattern) for pattern in wish.topics):
        return UNWANTED
    if not is_name(topic):
        return 'not a name of a ROS topic'
    if topic in index.clashes:
        return 'recorded with different types'
    if about.encoding != 'cdr':
        return f'its messages are {about.encoding or "in no encoding"}, not cdr'
    asked = wish.everything or any(_is(topic, f'/{name.lstrip("/")}') for name in wish.topics)
    if not asked and any(_is(topic, name) for name in DERIVED):
        return 'derived from the others; --all publishes it'
    return ''


def _against_name(topic: str, kind: str, full: str, wish: ReplaySettings, found: Selection) -> str:
    """Why a topic is not played under a name; notes whether a vehicle may hear its commands."""
    if full == interface.CLOCK:
        return 'the time of the replay stands there'
    if not is_command(topic, kind, wish.command_topics) or REPLAY in full.split('/'):
        return ''
    if not wish.commands:
        return f'a command outside of /{REPLAY}; --commands publishes it'
    found.guarded.add(topic)
    return ''


def _is(topic: str, name: str) -> bool:
    """Whether a topic has one of our names, in any namespace, or just this name."""
    if name.startswith('/'):
        return f'/{topic.lstrip("/")}' == name
    return f'/{topic}'.endswith(f'/{name}')


def _is_like(topic: str, pattern: str) -> bool:
    return fnmatchcase(f'/{topic.lstrip("/")}', f'/{pattern.lstrip("/")}')


@dataclass(frozen=True)
class ReplayPlan:
    """A bag, and what of it is played.

    Attributes
    ----------
    settings : how
    index : of the bag
    selection : of its topics
    begin, end : first and last log time, ns
    expected : recorded topic -> subscribers that are waited for

    """

    settings: ReplaySettings
    index: BagIndex
    selection: Selection
    begin: int
    end: int
    expected: dict[str, int]

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """Where nothing is played for more than a minute: s of the bag before and behind it."""
        found = self.index.gaps(self.selection.names, self.begin, self.end)
        first = self.index.first
        return [((a - first) / NANOSECONDS, (b - first) / NANOSECONDS) for a, b in found]


def make_plan(node: Any) -> ReplayPlan:
    """Declare and check the parameters, look through the bag; InputError: something is wrong."""
    name, p = node.get_name(), declare_settings(node, ReplaySettings)
    if p.namespace != '/' and not is_name(p.namespace.removesuffix('/')):
        raise InputError(name, 'namespace', 'a namespace such as replay or /auv1', p.namespace)
    index = index_bag(p.bag)
    selection = select(index, p, node.resolve_topic_name)
    span = (index.last - index.first) / NANOSECONDS
    if p.start > span:
        raise InputError(name, 'start', f'at most {span:g} s, the length of the bag', p.start)
    begin = index.first + round(p.start * NANOSECONDS)
    end = begin + round(p.duration * NANOSECONDS) if p.duration else index.last
    expected = _counts(name, p.expected_subscribers, selection)
    return ReplayPlan(p, index, selection, begin, end, expected)


def _counts(node: str, listed: Sequence[str], selection: Selection) -> dict[str, int]:
    counts = {}
    for entry in listed:
        topic, _, count = entry.partition('=')
        named = [name for name in (topic, f'/{topic}') if name in selection.names]
        if not (named and count.isdecimal()):
            expected = f'topic=count with a topic of {", ".join(selection.names)}'
            raise InputError(node, 'expected_subscribers', expected, entry)
        counts[named[0]] = int(count)
    return counts
