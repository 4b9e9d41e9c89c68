"""A check of a driver as a whole: its findings, as a document and in one line."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from auv_analysis.driver_check.answers import answers_of
from auv_analysis.driver_check.checks import findings_of, in_order, without_wrench
from auv_analysis.driver_check.finding import FAIL, Finding, counts
from auv_analysis.driver_check.plan import Plan
from auv_analysis.driver_check.procedure import Actuation
from auv_analysis.driver_check.recording import Recording
from auv_analysis.driver_check.scene import Scene
from auv_analysis.driver_check.settings import Settings
from auv_analysis.driver_check.trials import Answered
from auv_analysis.output.text import join
from auv_dynamics.ros.interface import ODOM, WRENCH
from auv_dynamics.vehicle.vehicle import Vehicle

DOCUMENT = 'check.json'


@dataclass(frozen=True)
class Commands:
    """What is going to be commanded, and by which model."""

    vehicle: Vehicle
    plan: Plan


@dataclass(frozen=True, eq=False)
class Result:
    """A driver that was looked at, listened to and, perhaps, commanded.

    Attributes
    ----------
    scene, recording, settings : what was looked at, and by what
    findings : of all checks, in the order of the catalogue
    actuation : what was sent; None: nothing
    answers : to the wrenches

    """

    scene: Scene
    recording: Recording
    settings: Settings
    findings: Sequence[Finding]
    actuation: Actuation | None = None
    answers: Sequence[Answered] = ()


def judged(
    scene: Scene,
    recording: Recording,
    settings: Settings,
    why: str,
    actuation: Actuation | None = None,
    commands: Commands | None = None,
) -> Result:
    """Judge a driver.

    Parameters
    ----------
    scene, recording, settings : what was looked at, and by what
    why : no wrench was sent
    actuation, commands : what was sent, and what was meant to be; None: nothing

    """
    findings = findings_of(scene, recording, settings)
    answers: Sequence[Answered] = ()
    if actuation is None or commands is None:
        findings += without_wrench(why)
    else:
        found, answers = answers_of(commands.vehicle, commands.plan, actuation, recording)
        findings += found
    return Result(scene, recording, settings, in_order(findings), actuation, answers)


def document_of(result: Result) -> dict[str, Any]:
    """All that was found, ready for JSON."""
    scene, recording = result.scene, result.recording
    return {
        'place': scene.place,
        'topics': {ODOM: scene.odom, WRENCH: scene.wrench},
        'messages': len(recording.arrived_ns),
        'seconds': recording.seconds,
        'settings': asdict(result.settings),
        'counts': counts(result.findings),
        'checks': [finding.document() for finding in result.findings],
        'trials': [answer.document() for answer in result.answers],
    }


def failure_of(findings: Sequence[Finding]) -> str:
    """One line that names the checks that failed; empty where none did."""
    failed = [finding for finding in findings if finding.verdict == FAIL]
    if not failed:
        return ''
    first = failed[0]
    if first.id == 'odom_publisher' and not first.numbers['publishers']:
        return first.found
    names = join([finding.id for finding in failed])
    return f'{len(failed)} of {len(findings)} checks failed: {names}'
