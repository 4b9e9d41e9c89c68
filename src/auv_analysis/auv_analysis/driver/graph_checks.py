"""Graph checks: who publishes and subscribes what, and whether their QoS lets them hear it."""

from collections.abc import Mapping, Sequence

from auv_analysis.driver.evidence import Endpoint, Evidence, Finding, judged, unchecked
from auv_analysis.output.text import join
from auv_dynamics.files.nearest import nearest
from auv_dynamics.ros import interface

NAMED = 3  # topics of a like name
DEPTH = 'depths are not told by discovery'


def odom_publisher(evidence: Evidence) -> Finding:
    """Publisher of odom."""
    graph = evidence.graph
    expected = f'one publisher of {graph.odom}, {graph.odom_type}'
    ends = graph.odom_publishers
    if not ends:
        found = f'nobody publishes {graph.odom} in {graph.place}'
        found += _instead(graph.odom, graph.odom_type, graph.elsewhere, graph.topics)
        advice = 'start the driver; name its topic with --namespace or --odom; see --domain-id'
        return judged(False, expected, found, advice, publishers=0)
    good = len(ends) == 1 and bool(graph.drivers)
    advice = f'publish {graph.odom_type}, which carries pose and twist together'
    if graph.drivers:
        advice = 'end all but one: the controller cannot tell whose odometry it hears'
    return judged(good, expected, _listed(ends), advice, publishers=len(ends))


def wrench_subscriber(evidence: Evidence) -> Finding:
    """Subscriber of wrench."""
    graph = evidence.graph
    expected = f'a subscriber of {graph.wrench}, {graph.wrench_type}'
    ends = graph.wrench_subscribers
    if graph.takers:
        found, driver = _listed(graph.takers), {end.node for end in graph.drivers}
        if driver and not driver & {end.node for end in graph.takers}:
            found += '; not the node that publishes odometry'
        return judged(True, expected, found, subscribers=len(ends))
    if ends:
        found = _listed(ends)
        advice = (
            f'subscribe {graph.wrench_type}: without its stamp a driver cannot tell an old '
            'command from a new one and obeys it for ever'
        )
    else:
        found = f'nobody subscribes {graph.wrench}'
        found += _instead(graph.wrench, graph.wrench_type, graph.listeners, graph.topics)
        advice = 'subscribe it in the driver; name its topic with --namespace or --wrench'
    return judged(False, expected, found, advice, subscribers=len(ends))


def wrench_publishers(evidence: Evidence) -> Finding:
    """Others that command."""
    graph, actuates = evidence.graph, evidence.settings.actuates
    ends, most = graph.wrench_publishers, 0 if actuates else 1
    who = 'nobody' if actuates else 'one controller at most'
    expected = f'{who} publishes {graph.wrench}, {graph.wrench_type}'
    good = len(ends) <= most and all(end.type == graph.wrench_type for end in ends)
    advice = 'end all but one: the vehicle would obey them in turn'
    if actuates:
        advice = 'end it, even if it is inactive: with --actuate nobody else may command'
    elif len(ends) <= most:
        advice = f'publish {graph.wrench_type}, which carries a stamp'
    return judged(good, expected, _listed(ends), advice, publishers=len(ends))


def clock(evidence: Evidence) -> Finding:
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


def qos_controller(evidence: Evidence) -> Finding:
    """Quality of service from odom to the controller."""
    advice = 'publish with the default profile: reliable, volatile, keep last 10'
    expected = 'what a best-effort subscription of the controller can hear'
    return _matching(evidence, 'controller', expected, advice)


def qos_recorder(evidence: Evidence) -> Finding:
    """Quality of service from odom to the recorder."""
    override = f'qos_overrides.{evidence.graph.odom}.subscription.reliability: best_effort'
    advice = 'publish reliable, keep last 10 at least; else give the recorder '
    advice += f'{override}, which may then lose messages'
    expected = 'what a reliable subscription of the recorder can hear'
    return _matching(evidence, 'recorder', expected, advice)


def qos_wrench(evidence: Evidence) -> Finding:
    """Quality of service from wrench to the driver."""
    advice = 'subscribe volatile, without a deadline, keep last 1: only the newest counts'
    expected = 'what a reliable, volatile publisher of the controller can feed'
    return _matching(evidence, 'wrench', expected, advice)


def _matching(evidence: Evidence, key: str, expected: str, advice: str) -> Finding:
    graph = evidence.graph
    topic, ends = (graph.wrench, graph.takers) if key == 'wrench' else (graph.odom, graph.drivers)
    if not ends:
        return unchecked(expected, f'nobody is on {topic} with the right type')
    conflict = graph.conflicts.get(key, '')
    found = join([f'reliability {end.reliability}, durability {end.durability}' for end in ends])
    found = f'{found}: {conflict}' if conflict else f'{found}; {DEPTH}'
    return judged(not conflict, expected, found, advice)
