"""Health of a snapshot: its topics, its nodes, and what is wrong."""

import posixpath
from collections.abc import Sequence
from textwrap import wrap

from rich.table import Table
from rich.text import Text

from auv_analysis.watch.snapshot import NodeState, Snapshot, TopicState, Trouble
from auv_analysis.watch.text import count, fact, rate, seconds
from auv_dynamics.ros import interface

ANALYSIS = f'{posixpath.commonpath(interface.ANALYSIS_TOPICS)}/*'
BASIC = (interface.ODOM, interface.CMD_VEL, interface.WRENCH)  # shown though nobody publishes them
STYLES = {'ok': 'green', 'warning': 'yellow', 'error': 'bold red', 'stale': 'yellow'}
OWN = (interface.DIAGNOSTICS,)  # shown as nodes
SHOWN_FACTS = 2
NAME = 15  # columns, of the longest of our nodes


def topics_table(snapshot: Snapshot, rows: int | None = None, *, folded: bool = False) -> Table:
    """Table of the topics that are published; `rows` at most, `analysis/*` folded into one."""
    table = _table()
    table.add_column('topic', no_wrap=True)
    for name, width in (('msg/s', 6), ('age', 6), ('gaps', 4), ('dups', 4)):
        table.add_column(name, justify='right', no_wrap=True, min_width=width)
    shown = [
        topic for topic in snapshot.topics
        if (topic.publishers or topic.heard or topic.name in BASIC) and topic.name not in OWN
    ]  # fmt: skip
    if folded or (rows is not None and len(shown) > rows):
        shown = _folded(shown)
    left_out = 0 if rows is None else max(0, len(shown) - rows)
    if left_out:
        left_out += 1  # the line that says so takes one as well
    for topic in shown[: len(shown) - left_out]:
        table.add_row(*_topic_row(topic))
    if left_out:
        table.add_row(f'and {left_out} more', style='dim')
    return table


def _topic_row(topic: TopicState) -> list[Text]:
    if not topic.publishers:
        state = 'no publisher' if not topic.heard else 'ended'
        return [Text(topic.name, 'dim'), Text(state, 'dim')]
    return [
        Text(topic.name, 'bold red' if topic.refused else ''),
        Text(rate(topic.rate)),
        Text(seconds(topic.age)),
        Text(count(topic.gaps), 'yellow' if topic.gaps else ''),
        Text(count(topic.repeats), 'yellow' if topic.repeats else ''),
    ]


def _folded(topics: list[TopicState]) -> list[TopicState]:
    """The analysis topics as one line; they come together."""
    analysis = [topic for topic in topics if topic.name in interface.ANALYSIS_TOPICS]
    if len(analysis) < 2:
        return topics
    ages = [topic.age for topic in analysis if topic.age is not None]
    one = TopicState(
        ANALYSIS,
        publishers=max(topic.publishers for topic in analysis),
        rate=sum(topic.rate or 0.0 for topic in analysis),
        age=max(ages, default=None),
        heard=sum(topic.heard for topic in analysis),
        gaps=sum(topic.gaps or 0 for topic in analysis),
        repeats=sum(topic.repeats or 0 for topic in analysis),
        refused=sum(topic.refused for topic in analysis),
    )
    first = topics.index(analysis[0])
    rest = [topic for topic in topics if topic not in analysis]
    return [*rest[:first], one, *rest[first:]]


def nodes_table(snapshot: Snapshot, rows: int | None = None, *, facts: bool = True) -> Table:
    """Table of what the nodes say of themselves; `rows` at most, with or without their facts."""
    table = _table()
    table.add_column('node', no_wrap=True, min_width=NAME)
    table.add_column('health', no_wrap=True, overflow='ellipsis')
    for node in snapshot.nodes[:rows]:
        table.add_row(Text(node.name.removeprefix('/')), _health(node, facts=facts))
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


def troubles_lines(troubles: Sequence[Trouble], width: int, most: int | None = None) -> list[Text]:
    """What is wrong, the worst first, in lines of so many columns; `most` lines at most."""
    lines = []
    for trouble in troubles:
        seen = [f'{trouble.count} times'] if trouble.count > 1 else []
        seen += [f'{seconds(trouble.age)} ago'] if trouble.age >= 1.0 else []
        line = f'{", ".join([trouble.level, *seen])}: {trouble.text}'
        style = STYLES[trouble.level]
        lines += [Text(part, style) for part in wrap(line, width, subsequent_indent='  ')]
    if most is not None and len(lines) > most:
        lines[most - 1 :] = [Text(f'and more: {len(troubles)} in all', lines[0].style)]
    return lines


def _table() -> Table:
    return Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style='bold')
