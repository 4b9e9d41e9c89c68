"""Which recorded topics are played, under which names, and which of them are commands."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

from auv_analysis.bag.step_topics import WRENCH
from auv_analysis.replay.index import BagIndex
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import one_of
from auv_dynamics.ros import interface

REPLAY = 'replay'  # namespace in which nothing of a vehicle listens
DERIVED = (
    *interface.ANALYSIS_TOPICS, interface.DIAGNOSTICS, interface.PROGRESS, interface.CLOCK,
)  # fmt: skip
COMMANDS = (interface.WRENCH, interface.CMD_VEL, interface.CMD_ACCEL)
MEASURED = (interface.WRENCH_APPLIED, interface.DISTURBANCE, interface.DISTURBANCE_ESTIMATE)
FORCES = (WRENCH, WRENCH.removesuffix('Stamped'))
WORDS = re.compile(
    '(^|[/_])(cmd|commands?|setpoints?|wrench|thrust|thrusters?|actuators?|servo|override)([/_]|$)'
)
UNWANTED = 'not asked for'
NAME = re.compile(r'/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*', re.ASCII)


@dataclass(frozen=True)
class Wish:
    """What is asked for.

    Attributes
    ----------
    namespace : before the recorded names
    original_names : no namespace, the recorded names
    commands : also the commands, where a vehicle may listen
    everything : also what other nodes would derive anew: analysis, diagnostics, progress, clock
    topics : recorded names or patterns; empty: all
    command_topics : recorded names that are commands as well

    """

    namespace: str = REPLAY
    original_names: bool = False
    commands: bool = False
    everything: bool = False
    topics: tuple[str, ...] = ()
    command_topics: tuple[str, ...] = ()


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
        """What is left out, a line per reason."""
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


def select(index: BagIndex, wish: Wish, resolve: Callable[[str], str]) -> Selection:
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


def _published(topic: str, wish: Wish) -> str:
    absolute = f'/{topic.lstrip("/")}'
    if wish.original_names:
        return absolute
    return f'{wish.namespace.rstrip("/")}{absolute}'


def _against(topic: str, index: BagIndex, wish: Wish) -> str:
    """Why a topic is not played whatever its new name, or an empty text."""
    about = index.topics[topic]
    if wish.topics and not any(_is_like(topic, pattern) for pattern in wish.topics):
        return UNWANTED
    if not NAME.fullmatch(topic):
        return 'not a name of a ROS topic'
    if topic in index.clashes:
        return 'recorded with different types'
    if about.encoding != 'cdr':
        return f'its messages are {about.encoding or "in no encoding"}, not cdr'
    asked = wish.everything or any(_is(topic, f'/{name.lstrip("/")}') for name in wish.topics)
    if not asked and any(_is(topic, name) for name in DERIVED):
        return 'derived from the others; --all publishes it'
    return ''


def _against_name(topic: str, kind: str, full: str, wish: Wish, found: Selection) -> str:
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
