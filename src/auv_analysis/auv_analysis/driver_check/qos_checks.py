"""Checks of the quality of service: whether the driver and our nodes would hear each other."""

from collections.abc import Sequence

from auv_analysis.driver_check.finding import Finding, judged, unchecked
from auv_analysis.driver_check.scene import Endpoint, Scene
from auv_analysis.output.text import join

DEPTH = 'depths are not told by discovery'
CONTROLLER = 'what a best-effort subscription of the controller can hear'
RECORDER = 'what a reliable subscription of the recorder can hear'
WRENCH = 'what a reliable, volatile publisher of the controller can feed'


def qos_findings(scene: Scene) -> list[Finding]:
    """Findings of a scene."""
    override = f'qos_overrides.{scene.odom}.subscription.reliability: best_effort'
    return [
        _judged('qos_controller', scene, 'controller', scene.drivers, CONTROLLER,
                'publish with the default profile: reliable, volatile, keep last 10'),
        _judged('qos_recorder', scene, 'recorder', scene.drivers, RECORDER,
                'publish reliable, keep last 10 at least; else give the recorder '
                f'{override}, which may then lose messages'),
        _judged('qos_wrench', scene, 'wrench', scene.takers, WRENCH,
                'subscribe volatile, without a deadline, keep last 1: only the newest counts'),
    ]  # fmt: skip


def _judged(
    id: str, scene: Scene, key: str, ends: Sequence[Endpoint], expected: str, advice: str
) -> Finding:
    if not ends:
        topic = scene.wrench if key == 'wrench' else scene.odom
        return unchecked(id, expected, f'nobody is on {topic} with the right type')
    conflict = scene.conflicts.get(key, '')
    found = join([end.policies for end in ends])
    found = f'{found}: {conflict}' if conflict else f'{found}; {DEPTH}'
    return judged(id, not conflict, expected, found, advice)
