"""Registry of the checks, in the order of the report: what each needs, and what came of it.

A check is a function of the evidence that returns a finding; its name is the check's id and its
docstring the title. The passive checks need no wrench.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from auv_analysis.driver import graph_checks, message_checks, time_checks, twist_checks
from auv_analysis.driver import response_checks as response
from auv_analysis.driver.evidence import Evidence, Finding, unchecked
from auv_dynamics.vehicle import DOFS

GROUPS = {
    'endpoints': 'Who is there',
    'qos': 'Quality of service',
    'values': 'Frames and numbers',
    'time': 'Rate and stamps',
    'motion': 'Twist against pose',
    'response': 'Answer to a wrench',
}


def nothing(_: Evidence) -> str:
    """Need of what can always be judged."""
    return ''


def driver(evidence: Evidence) -> str:
    """Need of a single publisher of odometry: why it is not there, or an empty text."""
    if len(evidence.graph.odom_publishers) > 1:
        return 'several publish odometry: their messages cannot be told apart'
    return '' if evidence.graph.drivers else 'no odometry'


def odometry(evidence: Evidence) -> str:
    """Need of a message."""
    return driver(evidence) or ('' if len(evidence.log.arrived_ns) else time_checks.MUTE)


def motion(evidence: Evidence) -> str:
    """Need of messages that tell pose and twist."""
    few = 'too few messages with finite numbers and unit quaternions'
    return odometry(evidence) or ('' if evidence.has_motion else few)


def wrenches(evidence: Evidence) -> str:
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
    needs: Callable[[Evidence], str]
    judge: Callable[[Evidence], Finding]

    def finding(self, evidence: Evidence) -> Finding:
        """What comes of it."""
        why = self.needs(evidence)
        found = unchecked(self.title, why) if why else self.judge(evidence)
        return replace(found, id=self.id)


def _check(
    group: str, needs: Callable[[Evidence], str], judge: Callable[[Evidence], Finding]
) -> Check:
    return Check(judge.__name__, group, _title(judge), needs, judge)


def _per_dof(
    group: str, needs: Callable[[Evidence], str], judge: Callable[[str, Evidence], Finding]
) -> list[Check]:
    """A check for each degree of freedom."""
    name, title = judge.__name__, _title(judge)
    return [
        Check(f'{name}_{dof}', group, f'{title}: {dof}', needs, partial(judge, dof)) for dof in DOFS
    ]


def _title(judge: Callable[..., Finding]) -> str:
    return (judge.__doc__ or '').removesuffix('.')


CHECKS = {
    check.id: check
    for check in (
        _check('endpoints', nothing, graph_checks.odom_publisher),
        _check('endpoints', nothing, graph_checks.wrench_subscriber),
        _check('endpoints', nothing, graph_checks.wrench_publishers),
        _check('endpoints', nothing, graph_checks.clock),
        _check('qos', nothing, graph_checks.qos_controller),
        _check('qos', nothing, graph_checks.qos_recorder),
        _check('qos', nothing, graph_checks.qos_wrench),
        _check('values', odometry, message_checks.frames),
        _check('values', odometry, message_checks.finite),
        _check('values', odometry, message_checks.quaternion_norm),
        _check('values', odometry, message_checks.upright),
        _check('values', odometry, message_checks.depth),
        _check('values', motion, message_checks.speeds),
        _check('values', motion, message_checks.jumps),
        _check('time', driver, time_checks.rate),
        _check('time', odometry, time_checks.gaps),
        _check('time', odometry, time_checks.stamps),
        _check('time', odometry, time_checks.age),
        _check('time', odometry, time_checks.drift),
        _check('motion', motion, twist_checks.twist_frame),
        _check('motion', motion, twist_checks.angular_frame),
        *_per_dof('motion', motion, twist_checks.axis),
        _check('response', wrenches, response.actuation),
        *_per_dof('response', wrenches, response.response),
        _check('response', wrenches, response.response_delay),
        _check('response', wrenches, response.silence),
    )
}
PASSIVE = [id for id, check in CHECKS.items() if check.group != 'response']


def judge(evidence: Evidence, ids: Iterable[str] = CHECKS) -> list[Finding]:
    """Findings of some checks, by default of all."""
    return [CHECKS[id].finding(evidence) for id in ids]
