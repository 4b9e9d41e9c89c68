"""The registry of checks with those of the graph, and the verdict on a driver.

Graph checks: who publishes and subscribes what, and whether their QoS lets them hear it.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from itertools import groupby
from typing import Any, NamedTuple

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from auv_analysis.bag.step_topics import ODOMETRY as ODOM_TYPE
from auv_analysis.bag.step_topics import WRENCH as WRENCH_TYPE
from auv_analysis.driver import odometry_checks as messages
from auv_analysis.driver import response_checks as response
from auv_analysis.driver import twist_checks as twist
from auv_analysis.driver.evidence import (
    FAIL,
    NOT_CHECKED,
    PASS,
    CheckResult,
    DriverRecord,
    Endpoint,
    counts,
    judged,
    unchecked,
)
from auv_analysis.output.text import join
from auv_dynamics.files.nearest import nearest
from auv_dynamics.ros import interface
from auv_dynamics.ros.interface import ODOM, WRENCH
from auv_dynamics.vehicle import DOFS

NAMED = 3  # topics of a like name
DEPTH = 'depths are not told by discovery'


def odom_publisher(evidence: DriverRecord) -> CheckResult:
    """Publisher of odom."""
    graph = evidence.graph
    expected = f'one publisher of {graph.odom}, {ODOM_TYPE}'
    ends = graph.odom_publishers
    if not ends:
        found = f'nobody publishes {graph.odom} in {graph.place}'
        found += _instead(graph.odom, ODOM_TYPE, graph.elsewhere, graph.topics)
        advice = 'start the driver; name its topic with --namespace or --odom; see --domain-id'
        return judged(False, expected, found, advice, publishers=0)
    good = len(ends) == 1 and bool(graph.drivers)
    advice = f'publish {ODOM_TYPE}, which carries pose and twist together'
    if graph.drivers:
        advice = 'end all but one: the controller cannot tell whose odometry it hears'
    return judged(good, expected, _listed(ends), advice, publishers=len(ends))


def wrench_subscriber(evidence: DriverRecord) -> CheckResult:
    """Subscriber of wrench."""
    graph = evidence.graph
    expected = f'a subscriber of {graph.wrench}, {WRENCH_TYPE}'
    ends = graph.wrench_subscribers
    if graph.takers:
        found, driver = _listed(graph.takers), {end.node for end in graph.drivers}
        if driver and not driver & {end.node for end in graph.takers}:
            found += '; not the node that publishes odometry'
        return judged(True, expected, found, subscribers=len(ends))
    if ends:
        found = _listed(ends)
        advice = (
            f'subscribe {WRENCH_TYPE}: without its stamp a driver cannot tell an old '
            'command from a new one and obeys it for ever'
        )
    else:
        found = f'nobody subscribes {graph.wrench}'
        found += _instead(graph.wrench, WRENCH_TYPE, graph.listeners, graph.topics)
        advice = 'subscribe it in the driver; name its topic with --namespace or --wrench'
    return judged(False, expected, found, advice, subscribers=len(ends))


def wrench_publishers(evidence: DriverRecord) -> CheckResult:
    """Others that command."""
    graph, actuates = evidence.graph, evidence.settings.actuates
    ends, most = graph.wrench_publishers, 0 if actuates else 1
    who = 'nobody' if actuates else 'one controller at most'
    expected = f'{who} publishes {graph.wrench}, {WRENCH_TYPE}'
    good = len(ends) <= most and all(end.type == WRENCH_TYPE for end in ends)
    advice = 'end all but one: the vehicle would obey them in turn'
    if actuates:
        advice = 'end it, even if it is inactive: with --actuate nobody else may command'
    elif len(ends) <= most:
        advice = f'publish {WRENCH_TYPE}, which carries a stamp'
    return judged(good, expected, _listed(ends), advice, publishers=len(ends))


def clock(evidence: DriverRecord) -> CheckResult:
    """Simulated time."""
    ends, heard = evidence.graph.clock_publishers, len(evidence.log.clock_ns)
    name = interface.CLOCK
    if evidence.settings.sim_time:
        good = len(ends) == 1 and heard > 0
        expected = f'one publisher of {name}, since --use-sim-time was given'
        advice = f'leave --use-sim-time away, or start the one who publishes {name}'
    else:
        good, expected = not ends, f'nobody publishes {name}'
        advice = (
            'is this a simulation? give --use-sim-time here and use_sim_time to our nodes; '
            'else end who publishes it'
        )
    found = f'{_listed(ends)}; {heard} messages'
    return judged(good, expected, found, advice, publishers=len(ends))


def _listed(ends: Sequence[Endpoint]) -> str:
    return join([f'{end.node} ({end.type})' for end in ends]) or 'nobody'


def _instead(
    name: str, kind: str, there: Mapping[str, tuple[str, ...]], topics: Sequence[str]
) -> str:
    """Topics that may have been meant: those of the same type, else those of a like name."""
    if there:
        listed = join([f'{topic} of {join(nodes)}' for topic, nodes in sorted(there.items())])
        return f'; {kind} is on {listed}'
    near = nearest(name, [topic for topic in topics if topic != name], NAMED)
    return f'; nearest names: {join(near)}' if near else f'; {kind} is on no topic there'


def qos_controller(evidence: DriverRecord) -> CheckResult:
    """Quality of service from odom to the controller."""
    advice = 'publish with the default profile: reliable, volatile, keep last 10'
    expected = 'what a best-effort subscription of the controller can hear'
    return _matching(evidence, 'controller', expected, advice)


def qos_recorder(evidence: DriverRecord) -> CheckResult:
    """Quality of service from odom to the recorder."""
    override = f'qos_overrides.{evidence.graph.odom}.subscription.reliability: best_effort'
    advice = 'publish reliable, keep last 10 at least; else give the recorder '
    advice += f'{override}, which may then lose messages'
    expected = 'what a reliable subscription of the recorder can hear'
    return _matching(evidence, 'recorder', expected, advice)


def qos_wrench(evidence: DriverRecord) -> CheckResult:
    """Quality of service from wrench to the driver."""
    advice = 'subscribe volatile, without a deadline, keep last 1: only the newest counts'
    expected = 'what a reliable, volatile publisher of the controller can feed'
    return _matching(evidence, 'wrench', expected, advice)


def _matching(evidence: DriverRecord, key: str, expected: str, advice: str) -> CheckResult:
    graph = evidence.graph
    topic, ends = (graph.wrench, graph.takers) if key == 'wrench' else (graph.odom, graph.drivers)
    if not ends:
        return unchecked(expected, f'nobody is on {topic} with the right type')
    conflict = graph.conflicts.get(key, '')
    found = join([f'reliability {end.reliability}, durability {end.durability}' for end in ends])
    found = f'{found}: {conflict}' if conflict else f'{found}; {DEPTH}'
    return judged(not conflict, expected, found, advice)


GROUPS = {
    'endpoints': 'Who is there',
    'qos': 'Quality of service',
    'values': 'Frames and numbers',
    'time': 'Rate and stamps',
    'motion': 'Twist against pose',
    'response': 'Answer to a wrench',
}


def nothing(_: DriverRecord) -> str:
    """Need of what can always be judged."""
    return ''


def driver(evidence: DriverRecord) -> str:
    """Need of a single publisher of odometry: why it is not there, or an empty text."""
    if len(evidence.graph.odom_publishers) > 1:
        return 'several publish odometry: their messages cannot be told apart'
    return '' if evidence.graph.drivers else 'no odometry'


def odometry(evidence: DriverRecord) -> str:
    """Need of a message."""
    return driver(evidence) or ('' if len(evidence.log.arrived_ns) else messages.MUTE)


def motion(evidence: DriverRecord) -> str:
    """Need of messages that tell pose and twist."""
    few = 'too few messages with finite numbers and unit quaternions'
    return odometry(evidence) or ('' if evidence.has_motion else few)


def wrenches(evidence: DriverRecord) -> str:
    """Need of an excitation."""
    return '' if evidence.excitation else evidence.passive


class Check(NamedTuple):
    """A check.

    Attributes
    ----------
    id : its name
    group : of the report
    title : what it looks at
    needs : why the evidence does not suffice, or an empty text
    judge : the check itself

    """

    id: str
    group: str
    title: str
    needs: Callable[[DriverRecord], str]
    judge: Callable[[DriverRecord], CheckResult]

    def finding(self, evidence: DriverRecord) -> CheckResult:
        """What comes of it."""
        why = self.needs(evidence)
        found = unchecked(self.title, why) if why else self.judge(evidence)
        return replace(found, id=self.id)


def _checks(
    group: str, needs: Callable[[DriverRecord], str], *judges: Callable[..., CheckResult]
) -> Iterator[Check]:
    """Checks named and described by their functions; two of these once per degree of freedom."""
    for judge in judges:
        name, title = judge.__name__, (judge.__doc__ or '').removesuffix('.')
        if judge not in (twist.axis, response.response):
            yield Check(name, group, title, needs, judge)
            continue
        for dof in DOFS:
            yield Check(f'{name}_{dof}', group, f'{title}: {dof}', needs, partial(judge, dof))


CHECKS = {
    check.id: check
    for check in (
        *_checks('endpoints', nothing, odom_publisher, wrench_subscriber, wrench_publishers, clock),
        *_checks('qos', nothing, qos_controller, qos_recorder, qos_wrench),
        *_checks('values', odometry, messages.frames, messages.finite, messages.quaternion_norm),
        *_checks('values', odometry, messages.upright, messages.depth),
        *_checks('values', motion, messages.speeds, messages.jumps),
        *_checks('time', driver, messages.rate),
        *_checks('time', odometry, messages.gaps, messages.stamps, messages.age, messages.drift),
        *_checks('motion', motion, twist.twist_frame, twist.angular_frame, twist.axis),
        *_checks('motion', motion, twist.velocity_bias),
        *_checks('response', wrenches, response.actuation, response.response),
        *_checks('response', wrenches, response.response_delay, response.silence),
    )
}
PASSIVE = [id for id, check in CHECKS.items() if check.group != 'response']


def judge(evidence: DriverRecord, ids: Iterable[str] = CHECKS) -> list[CheckResult]:
    """Findings of some checks, by default of all."""
    return [CHECKS[id].finding(evidence) for id in ids]


STYLES = {PASS: 'green', FAIL: 'bold red', NOT_CHECKED: 'yellow'}
NEEDED = (  # to pass before a wrench may be sent
    *('odom_publisher', 'wrench_subscriber', 'wrench_publishers', 'qos_wrench', 'frames'),
    *('finite', 'quaternion_norm', 'rate', 'gaps', 'stamps'),
)


def failure_of(findings: Sequence[CheckResult]) -> str:
    """One line that names the checks that failed; empty where none did."""
    failed = [finding for finding in findings if finding.verdict == FAIL]
    if not failed:
        return ''
    first = failed[0]
    if first.id == 'odom_publisher' and not first.numbers['publishers']:
        return first.found
    names = join([finding.id for finding in failed])
    return f'{len(failed)} of {len(findings)} checks failed: {names}'


def refusal(findings: Sequence[CheckResult]) -> str:
    """Why no wrench may be sent after the passive checks, or an empty text."""
    against = [one.id for one in findings if one.id in NEEDED and one.verdict != PASS]
    return f'nothing was sent, since {join(against)} did not pass' if against else ''


def document_of(evidence: DriverRecord, findings: Sequence[CheckResult]) -> dict[str, Any]:
    """All that was found, ready for JSON."""
    graph, log = evidence.graph, evidence.log
    return {
        'place': graph.place,
        'topics': {ODOM: graph.odom, WRENCH: graph.wrench},
        'messages': len(log.arrived_ns),
        'seconds': log.seconds,
        'settings': asdict(evidence.settings),
        'counts': counts(findings),
        'checks': [finding.document() for finding in findings],
        'trials': [trial.document() for trial in evidence.answered],
        'command_to_response_delay': response.command_to_response_delay(evidence),
    }


def findings_table(findings: Sequence[CheckResult]) -> RenderableType:
    """Findings by group, and at the end how many there are of each verdict.

    What passed is a line; the rest comes with what was expected and with advice.
    """
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column(overflow='fold')
    for group, members in groupby(findings, key=lambda finding: CHECKS[finding.id].group):
        table.add_row(Text(GROUPS[group], 'bold'))
        for _, alike in groupby(members, key=_reason):
            first, *others = alike
            name = f'{1 + len(others)} checks' if others else first.id
            text = Text(first.found)
            if first.verdict == FAIL:
                text.append(f'\nexpected: {first.expected}', 'dim')
            if first.advice:
                text.append(f'\n{first.advice}', 'italic')
            table.add_row(Text(f'  {name}'), Text(first.verdict, STYLES[first.verdict]), text)
    total = Text('\n')
    for verdict, count in counts(findings).items():
        total.append(f'{count} {verdict}', STYLES[verdict] if count else 'dim').append('  ')
    return Group(table, total)


def _reason(finding: CheckResult) -> str:
    """What checks have in common that were not made and of which there is nothing else to say."""
    alone = finding.verdict != NOT_CHECKED or finding.advice
    return finding.id if alone else f' {finding.found}'
