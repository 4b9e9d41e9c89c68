"""Evidence on a driver: who was there, what was heard and sent; and the finding of a check."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from auv_analysis.bag.step_topics import ODOMETRY, WRENCH
from auv_analysis.driver.excitation import Excitation, MeasuredTrial
from auv_analysis.driver.odometry_log import OdometryLog
from auv_analysis.metrics.local_polynomials import SMALLEST
from auv_analysis.metrics.pose_twist import (
    ANGULAR,
    LINEAR,
    PoseTwist,
    RatePair,
    TwistFit,
    compare_rates,
    fit_readings,
)
from auv_analysis.output.new_files import known
from auv_dynamics.ros.interface import NANOSECONDS, Frames
from auv_gvc_controller.control.settings import ControllerSettings

PASS, FAIL, NOT_CHECKED = 'pass', 'fail', 'not checked'
VERDICTS = (PASS, FAIL, NOT_CHECKED)
UNIT = 0.1  # deviation of the norm of a quaternion that still tells an attitude
Number = float | int | None


@dataclass(frozen=True)
class Settings:
    """Requirements on odometry: by default those of the controller's parameters.

    Attributes
    ----------
    frames : frame ids
    rate : Hz that is promised; None: enough for the watchdog
    sim_time : stamps are those of `/clock`
    actuates : a wrench is going to be sent
    timeout : s, `odometry_timeout` of the controller
    gap : s, its `limits.gap`
    speed, turning : m/s and rad/s, its `limits.speed` and `limits.rate`
    acceleration : m/s2 and rad/s2, its `limits.acceleration`

    """

    frames: Frames = field(default_factory=Frames)
    rate: float | None = None
    sim_time: bool = False
    actuates: bool = False
    timeout: float = ControllerSettings.odometry_timeout
    gap: float = ControllerSettings.limits_gap
    speed: float = ControllerSettings.limits_speed
    turning: float = ControllerSettings.limits_rate
    acceleration: float = ControllerSettings.limits_acceleration


@dataclass(frozen=True)
class Endpoint:
    """A publisher or a subscription.

    Attributes
    ----------
    node : its full name
    type : of the messages, such as nav_msgs/msg/Odometry
    reliability, durability : of its quality of service, in lower case

    """

    node: str
    type: str
    reliability: str = 'reliable'
    durability: str = 'volatile'


@dataclass(frozen=True)
class GraphSnapshot:
    """The endpoints of a driver and of whoever is beside it; observers are left out.

    Attributes
    ----------
    place : domain and namespace, in words
    odom, wrench : full names of the topics
    odom_publishers, wrench_publishers, wrench_subscribers, clock_publishers : of these topics
    conflicts : 'controller', 'recorder', 'wrench' -> why our end and the driver's do not match;
        empty where they do
    elsewhere : other topics of the odometry's type -> who publishes them
    listeners : other topics of the wrench's type -> who subscribes them
    topics : names of all topics

    """

    place: str
    odom: str
    wrench: str
    odom_publishers: tuple[Endpoint, ...] = ()
    wrench_publishers: tuple[Endpoint, ...] = ()
    wrench_subscribers: tuple[Endpoint, ...] = ()
    clock_publishers: tuple[Endpoint, ...] = ()
    conflicts: Mapping[str, str] = field(default_factory=dict)
    elsewhere: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    listeners: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    topics: tuple[str, ...] = ()

    @property
    def drivers(self) -> tuple[Endpoint, ...]:
        """Publishers of odometry that has its type."""
        return tuple(end for end in self.odom_publishers if end.type == ODOMETRY)

    @property
    def takers(self) -> tuple[Endpoint, ...]:
        """Subscriptions to the wrench that have its type."""
        return tuple(end for end in self.wrench_subscribers if end.type == WRENCH)


@dataclass(frozen=True, eq=False)
class DriverRecord:
    """All that a driver is judged by.

    Attributes
    ----------
    graph : who was there
    log : odometry that was heard, of a single publisher; else only the graph is judged
    settings : what is expected
    excitation : what was sent; None: nothing
    passive : why nothing was sent

    """

    graph: GraphSnapshot
    log: OdometryLog
    settings: Settings
    excitation: Excitation | None = None
    passive: str = ''

    @cached_property
    def _poses(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
        """States (n, 13) with an attitude, their rising times and arrivals in ns.

        And whether these times are those of publication. Of times with gaps, over which nothing can
        be told, the longest piece.
        """
        log = self.log
        norm = np.linalg.norm(log.x[:, 3:7], axis=1)
        good = log.finite & (np.abs(norm - 1.0) < UNIT)
        x, stamps, arrived = log.x[good], log.stamp_ns[good], log.arrived_ns[good]
        rise = bool((np.diff(stamps) > 0).all())
        ns = stamps if rise else log.published_ns[good]
        newer = np.flatnonzero(np.diff(np.maximum.accumulate(ns), prepend=-1) > 0)
        gaps = np.flatnonzero(np.diff(ns[newer]) > self.settings.gap * NANOSECONDS)
        longest = max(np.split(newer, gaps + 1), key=len)
        return x[longest], ns[longest], arrived[longest], not rise

    @property
    def has_motion(self) -> bool:
        """Whether enough messages tell pose and twist."""
        return len(self._poses[0]) >= SMALLEST

    @cached_property
    def motion(self) -> PoseTwist:
        """Pose and twist of the messages that tell them, where they are enough."""
        x, ns, _, by_publication = self._poses
        q = x[:, 3:7] / np.linalg.norm(x[:, 3:7], axis=1, keepdims=True)
        return PoseTwist((ns - ns[0]) / NANOSECONDS, x[:, :3], q, x[:, 7:], by_publication)

    @property
    def uncommanded(self) -> np.ndarray:
        """Mask (n,) of the samples of motion that arrived before the first wrench."""
        arrived, sent = self._poses[2], self.excitation.sent if self.excitation else ()
        began = next((ns for one in sent for ns, _ in one.steps), arrived[-1] + 1)
        return np.asarray(arrived < began)

    @cached_property
    def twist_fits(self) -> dict[str, TwistFit]:
        """Readings of 'linear' and 'angular' velocity against the motion."""
        halves = {'linear': LINEAR, 'angular': ANGULAR}
        return {half: fit_readings(self.motion, readings) for half, readings in halves.items()}

    @cached_property
    def rates(self) -> dict[str, RatePair]:
        """Rate of the pose beside the twist, both in body axes, 'linear' and 'angular'."""
        motion = self.motion
        return {
            'linear': compare_rates(motion.t, motion.travelled, motion.nu[:, :3]),
            'angular': compare_rates(motion.t, motion.turned, motion.nu[:, 3:]),
        }

    @property
    def sent(self) -> Excitation:
        """The excitation, where there was one."""
        if self.excitation is None:
            raise ValueError(self.passive)
        return self.excitation

    @cached_property
    def trials(self) -> list[MeasuredTrial]:
        """Reception of the wrenches that were sent."""
        return self.excitation.measured(self.log) if self.excitation else []

    @property
    def answered(self) -> list[MeasuredTrial]:
        """Trials that show a response: all but the one that ends in silence."""
        return [one for one in self.trials if not one.trial.silent]


@dataclass(frozen=True)
class CheckResult:
    """A finding on a driver: what was expected and what was found.

    Attributes
    ----------
    expected, found : a line each; that of a check that was not made says why
    verdict : 'pass', 'fail' or 'not checked'
    advice : a line: how to mend it, or how to have it checked; empty where it passed
    numbers : name with its unit -> what was measured
    id : of the check

    """

    expected: str
    found: str
    verdict: str
    advice: str = ''
    numbers: Mapping[str, Number] = field(default_factory=dict)
    id: str = ''

    def document(self) -> dict[str, Any]:
        """Ready for JSON: null for a number that is not finite."""
        return {'id': self.id, 'verdict': self.verdict, **known(asdict(self))}


def judged(
    good: bool, expected: str, found: str, advice: str = '', **numbers: Number
) -> CheckResult:
    """Finding that passes or fails; the advice is for the failure."""
    return CheckResult(expected, found, PASS if good else FAIL, '' if good else advice, numbers)


def unchecked(expected: str, why: str, advice: str = '', **numbers: Number) -> CheckResult:
    """Finding of a check that could not be made."""
    return CheckResult(expected, why, NOT_CHECKED, advice, numbers)


def counts(findings: Sequence[CheckResult]) -> dict[str, int]:
    """Number of findings by verdict."""
    return {verdict: sum(f.verdict == verdict for f in findings) for verdict in VERDICTS}
