"""The ROS parameters of a replay, and what they ask for."""

import re
from dataclasses import dataclass

from rclpy.node import Node

from auv_analysis.replay.index import BagIndex, index_bag
from auv_analysis.replay.selection import REPLAY, Selection, Wish, select
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.ros.parameters import declare, refuse_unknown

NAMESPACE = re.compile(r'/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*/?|/', re.ASCII)


@dataclass(frozen=True)
class ReplayParameters:
    """What is to be played, and how.

    Attributes
    ----------
    index : of the bag
    selection : of its topics
    begin, end : first and last log time, ns
    rate : seconds of the bag per second, 0: as fast as possible
    loop, start_paused : begin again at the end; wait for `~/run` at the beginning
    skip_gaps : do not wait where nothing was recorded for more than a minute
    clock : publish the time of the bag
    foreign : publish commands also where a foreign node acts on them
    expected : recorded topic -> subscribers that are waited for
    answers : topic whose stamps answer the odometry, empty: nothing is waited for

    """

    index: BagIndex
    selection: Selection
    begin: int
    end: int
    rate: float
    loop: bool
    start_paused: bool
    skip_gaps: bool
    clock: bool
    foreign: bool
    expected: dict[str, int]
    answers: str

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """Where nothing is played for more than a minute: s of the bag before and behind it."""
        found = self.index.gaps(self.selection.names, self.begin, self.end)
        first = self.index.first
        return [((a - first) / NANOSECONDS, (b - first) / NANOSECONDS) for a, b in found]


def replay_parameters(node: Node) -> ReplayParameters:
    """Declare and check the parameters, look through the bag; InputError: something is wrong."""
    bag = declare(node, 'bag', str, '', 'folder or .mcap file')
    wish = _wish(node)
    start = declare(node, 'start', float, 0.0, 's from the beginning of the bag', at_least=0.0)
    duration = declare(node, 'duration', float, 0.0, 's of the bag, 0: to its end', at_least=0.0)
    rate = declare(
        node, 'rate', float, 1.0, 's of the bag per s, 0: as fast as possible without loss',
        at_least=0.0, writable=True,
    )  # fmt: skip
    loop = declare(node, 'loop', bool, False, 'begin again at the end')
    paused = declare(node, 'start_paused', bool, False, 'wait for ~/run')
    skips = declare(node, 'skip_gaps', bool, False, 'jump where nothing was recorded for a minute')
    clock = declare(node, 'clock', bool, True, 'publish /clock')
    foreign = declare(
        node, 'allow_commands_to_foreign', bool, False,
        'publish commands also where a node that is not ours acts on them',
    )  # fmt: skip
    text = 'topic=count, topics as recorded: nothing is published until so many have matched'
    listed = declare(node, 'expected_subscribers', list[str], None, text) or []
    text = 'topic of wrenches: the next odometry waits for the one with the stamp of the last'
    answers = declare(node, 'answers', str, '', text)
    refuse_unknown(node)
    name = node.get_name()
    if not bag:
        raise InputError(name, 'bag', 'a bag folder or an .mcap file', None)
    index = index_bag(bag)
    selection = select(index, wish, node.resolve_topic_name)
    span = (index.last - index.first) / NANOSECONDS
    if start > span:
        raise InputError(name, 'start', f'at most {span:g} s, the length of the bag', start)
    begin = index.first + round(start * NANOSECONDS)
    end = begin + round(duration * NANOSECONDS) if duration else index.last
    expected = _counts(name, listed, selection)
    return ReplayParameters(
        index, selection, begin, end, rate, loop, paused, skips, clock, foreign, expected, answers
    )  # fmt: skip


def _wish(node: Node) -> Wish:
    namespace = declare(node, 'namespace', str, REPLAY, 'before the recorded names')
    if not NAMESPACE.fullmatch(namespace):
        expected = 'a namespace such as replay or /auv1'
        raise InputError(node.get_name(), 'namespace', expected, namespace)
    original = declare(node, 'original_names', bool, False, 'no namespace: the recorded names')
    commands = declare(node, 'commands', bool, False, f'commands also outside of /{REPLAY}')
    everything = declare(
        node, 'all', bool, False, 'also analysis, diagnostics, progress and clock as recorded'
    )
    topics = declare(node, 'topics', list[str], None, 'recorded names or patterns, none: all')
    text = 'recorded names that are commands although neither name nor type shows it'
    more = declare(node, 'command_topics', list[str], None, text)
    return Wish(namespace, original, commands, everything, tuple(topics or ()), tuple(more or ()))


def _counts(node: str, listed: list[str], selection: Selection) -> dict[str, int]:
    counts = {}
    for entry in listed:
        topic, _, count = entry.partition('=')
        named = [name for name in (topic, f'/{topic}') if name in selection.names]
        if not (named and count.isdecimal()):
            expected = f'topic=count with a topic of {", ".join(selection.names)}'
            raise InputError(node, 'expected_subscribers', expected, entry)
        counts[named[0]] = int(count)
    return counts
