"""All checks of what was seen and heard without a word being said, in the order of the report."""

from auv_analysis.driver_check.catalogue import CHECKS
from auv_analysis.driver_check.endpoint_checks import endpoint_findings
from auv_analysis.driver_check.finding import Finding, judged, unchecked
from auv_analysis.driver_check.motion import motion_of
from auv_analysis.driver_check.qos_checks import qos_findings
from auv_analysis.driver_check.recording import Recording
from auv_analysis.driver_check.scene import Scene
from auv_analysis.driver_check.settings import Settings
from auv_analysis.driver_check.speed_checks import speed_findings
from auv_analysis.driver_check.time_checks import time_findings
from auv_analysis.driver_check.twist_checks import motion_findings
from auv_analysis.driver_check.value_checks import value_findings

HEARD = ('values', 'time', 'motion')  # groups that need odometry
SAID = 'response'  # the group that needs a wrench
MUTE = 'no odometry came, though it is announced'


def findings_of(scene: Scene, recording: Recording, settings: Settings) -> list[Finding]:
    """Findings of a driver that was only listened to.

    Parameters
    ----------
    scene : who was there
    recording : what was heard; odometry of a single publisher, else only the scene is judged
    settings : what is expected

    """
    seen = endpoint_findings(scene, settings, len(recording.clock_ns)) + qos_findings(scene)
    why = _silence(scene, recording)
    if why:
        listed = [id for id, check in CHECKS.items() if check.group in HEARD]
        found = {id: unchecked(id, CHECKS[id].title, why) for id in listed}
        if why == MUTE:
            advice = 'does the driver wait for something before it publishes?'
            found['rate'] = judged('rate', False, 'odometry', why, advice, messages=0)
        return [*seen, *found.values()]
    motion = motion_of(recording)
    return in_order(
        [
            *seen,
            *value_findings(recording, settings),
            *speed_findings(motion, settings),
            *time_findings(recording, settings),
            *motion_findings(motion),
        ]
    )


def without_wrench(why: str) -> list[Finding]:
    """Findings of the checks that need a wrench where none was sent."""
    listed = [id for id, check in CHECKS.items() if check.group == SAID]
    return [unchecked(id, CHECKS[id].title, why) for id in listed]


def in_order(findings: list[Finding]) -> list[Finding]:
    """Findings in the order of the catalogue."""
    order = {id: i for i, id in enumerate(CHECKS)}
    return sorted(findings, key=lambda finding: order[finding.id])


def _silence(scene: Scene, recording: Recording) -> str:
    """Why odometry cannot be judged, or an empty text."""
    if len(scene.odom_publishers) > 1:
        return 'several publish odometry: their messages cannot be told apart'
    if not scene.drivers:
        return 'no odometry'
    if not len(recording.arrived_ns):
        return MUTE
    return ''
