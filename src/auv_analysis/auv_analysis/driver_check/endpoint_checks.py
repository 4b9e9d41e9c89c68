"""Checks of who publishes and subscribes what."""

from collections.abc import Mapping, Sequence

from auv_analysis.driver_check.finding import Finding, judged
from auv_analysis.driver_check.scene import Endpoint, Scene
from auv_analysis.driver_check.settings import Settings
from auv_analysis.output.text import join
from auv_dynamics.files.nearest import nearest
from auv_dynamics.ros import interface

NAMED = 3  # topics of a like name


def endpoint_findings(scene: Scene, settings: Settings, clocks: int) -> list[Finding]:
    """Findings of a scene; `clocks` is how many messages of /clock were heard."""
    return [
        _odometry(scene),
        _wrench(scene),
        _commanders(scene, settings),
        _clock(scene, settings, clocks),
    ]


def _odometry(scene: Scene) -> Finding:
    expected = f'one publisher of {scene.odom}, {scene.odom_type}'
    ends = scene.odom_publishers
    if not ends:
        found = f'nobody publishes {scene.odom} in {scene.place}'
        found += _instead(scene.odom, scene.odom_type, scene.elsewhere, scene.topics)
        advice = 'start the driver; name its topic with --namespace or --odom; see --domain-id'
        return judged('odom_publisher', False, expected, found, advice, publishers=0)
    good = len(ends) == 1 and bool(scene.drivers)
    advice = f'publish {scene.odom_type}, which carries pose and twist together'
    if scene.drivers:
        advice = 'end all but one: the controller cannot tell whose odometry it hears'
    return judged('odom_publisher', good, expected, _listed(ends), advice, publishers=len(ends))


def _wrench(scene: Scene) -> Finding:
    expected = f'a subscriber of {scene.wrench}, {scene.wrench_type}'
    ends = scene.wrench_subscribers
    if scene.takers:
        found, driver = _listed(scene.takers), {end.node for end in scene.drivers}
        if driver and not driver & {end.node for end in scene.takers}:
            found += '; not the node that publishes odometry'
        return judged('wrench_subscriber', True, expected, found, '', subscribers=len(ends))
    if not ends:
        found = f'nobody subscribes {scene.wrench}'
        found += _instead(scene.wrench, scene.wrench_type, scene.listeners, scene.topics)
        advice = 'subscribe it in the driver; name its topic with --namespace or --wrench'
        return judged('wrench_subscriber', False, expected, found, advice, subscribers=0)
    advice = (
        f'subscribe {scene.wrench_type}: without its stamp a driver cannot tell an old command '
        'from a new one and obeys it for ever'
    )
    return judged('wrench_subscriber', False, expected, _listed(ends), advice,
                  subscribers=len(ends))  # fmt: skip


def _commanders(scene: Scene, settings: Settings) -> Finding:
    ends, most = scene.wrench_publishers, 0 if settings.actuates else 1
    expected = 'nobody' if settings.actuates else 'one controller at most'
    expected = f'{expected} publishes {scene.wrench}, {scene.wrench_type}'
    found = _listed(ends) if ends else 'nobody'
    good = len(ends) <= most and all(end.type == scene.wrench_type for end in ends)
    advice = 'end all but one: the vehicle would obey them in turn'
    if settings.actuates:
        advice = 'end it, even if it is inactive: with --actuate nobody else may command'
    elif len(ends) <= most:
        advice = f'publish {scene.wrench_type}, which carries a stamp'
    return judged('wrench_publishers', good, expected, found, advice, publishers=len(ends))


def _clock(scene: Scene, settings: Settings, clocks: int) -> Finding:
    ends = scene.clock_publishers
    found = f'{_listed(ends) if ends else "nobody"}; {clocks} messages'
    name = interface.CLOCK
    if settings.sim_time:
        expected = f'one publisher of {name}, since --use-sim-time was given'
        advice = f'leave --use-sim-time away, or start the one who publishes {name}'
        good = len(ends) == 1 and clocks > 0
        return judged('clock', good, expected, found, advice, publishers=len(ends))
    advice = 'is this a simulation? give --use-sim-time here and use_sim_time to our nodes; '
    advice += 'else end who publishes it'
    return judged('clock', not ends, f'nobody publishes {name}', found, advice,
                  publishers=len(ends))  # fmt: skip


def _listed(ends: Sequence[Endpoint]) -> str:
    return join([f'{end.node} ({end.type})' for end in ends])


def _instead(
    name: str, kind: str, there: Mapping[str, tuple[str, ...]], topics: Sequence[str]
) -> str:
    """Topics that may have been meant: those of the same type, else those of a like name."""
    if there:
        listed = join([f'{topic} of {join(nodes)}' for topic, nodes in sorted(there.items())])
        return f'; {kind} is on {listed}'
    near = nearest(name, [topic for topic in topics if topic != name], NAMED)
    return f'; nearest names: {join(near)}' if near else f'; {kind} is on no topic there'
