"""The topics by name and the numbers in their messages, without ROS.

Nodes and bag readers share it: the readers take any object with the fields of the message, be it
from rclpy or from a bag.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle import DOFS

NANOSECONDS = 10**9
DEPTH = 3000  # of step topics: above every recorder_window and horizon that is accepted
UNIT = 1e-3  # deviation of a quaternion's norm from 1 that is accepted
LARGEST = 1e30  # of numbers in a message: energies and their squares are still finite
NOT_FINITE = 'not finite: expected finite numbers'
PARENT = 'AUV_GVC_PARENT'  # variable with the process id of `auv run`: nodes do not outlive it
RECORDER = 'recorder_node'  # name of the recorder, in whatever namespace
CONTROLLER = 'controller_node'  # name of the controller, in whatever namespace
PLANT = 'plant_node'  # name of the plant, in whatever namespace
GAIN = 'gains.'  # what the names of its gains among its parameters begin with
LAW_FACT, GAINS_FACT = 'law', 'gains'  # what it says of itself on `/diagnostics`; gains in JSON
SETTINGS_FACT = 'changed'  # parameters by name, of those that are not as they were at its start
OBSERVER = 'auv_watch'  # name of a node that only looks on: nobody waits for it

ODOM = 'odom'
TWIST = 'twist'
CMD_VEL = 'cmd_vel'
CMD_ACCEL = 'cmd_accel'
WRENCH = 'wrench'
WRENCH_APPLIED = 'wrench_applied'
DISTURBANCE = 'disturbance'
DISTURBANCE_ESTIMATE = 'disturbance_estimate'
GROUND_TRUTH = 'ground_truth/odom'
KINETIC_ENERGY = 'analysis/kinetic_energy'
KINETIC_ENERGY_SHARES = 'analysis/kinetic_energy_shares'
DELTA_XI = 'analysis/delta_xi'
DELTA_PI = 'analysis/delta_pi'
LUMPED_ERROR = 'analysis/lumped_error'
PROGRESS = 'recorder/progress'
DIAGNOSTICS = '/diagnostics'
CLOCK = '/clock'
GLOBALS = (CLOCK, DIAGNOSTICS, '/tf', '/tf_static', '/robot_description')  # of all vehicles

ANALYSIS_TOPICS = (KINETIC_ENERGY, KINETIC_ENERGY_SHARES, DELTA_XI, DELTA_PI, LUMPED_ERROR)
STEP_TOPICS = (ODOM, TWIST, CMD_VEL, CMD_ACCEL, WRENCH, DISTURBANCE, DISTURBANCE_ESTIMATE)
OPTIONAL_STEP_TOPICS = (WRENCH_APPLIED, GROUND_TRUTH)  # with actuators, with sensors


@dataclass(frozen=True)
class Frames:
    """Frame ids: `odom` is NED, `base` forward-starboard-down."""

    odom: str = 'odom_ned'
    base: str = 'base_link_fsd'


ROS_FRAMES = Frames('odom', 'base_link')  # of REP-105: here `odom` is ENU, `base` FLU


class BadMessageError(ValueError):
    """A message that must not be used; its text names topic, expected and found."""


class TimeGrid(NamedTuple):
    """The steps of a run.

    Attributes
    ----------
    step : s
    step_ns : the same in ns
    duration : s, 0: no end
    last : number of the last step, None: no end

    """

    step: float
    step_ns: int
    duration: float
    last: int | None


def time_grid(step: float, duration: float, file: object) -> TimeGrid:
    """Steps of a whole number of ns, that fill a duration; InputError, which names `file`, else."""
    step_ns = round(step * NANOSECONDS)
    if step_ns < 1 or abs(step_ns - step * NANOSECONDS) > 1e-6 * max(1.0, step):
        raise InputError(file, 'step', 'a whole number of nanoseconds', f'{step!r} s')
    steps = duration / step
    last = round(steps) if duration else None
    if last is not None and abs(steps - last) > 1e-9 * steps:
        raise InputError(file, 'duration', f'a multiple of step ({step:g} s)', f'{duration!r} s')
    return TimeGrid(step, step_ns, duration, last)


def nanoseconds(time: Any) -> int:
    """Nanoseconds of a Time message."""
    return time.sec * NANOSECONDS + time.nanosec


def check_stamp(topic: str, sec: int, nanosec: int) -> int:
    """Return a stamp in ns; BadMessageError when it is none: negative, or beyond a second."""
    if sec < 0 or nanosec >= NANOSECONDS:
        found = f'{sec} s and {nanosec} ns'
        raise BadMessageError(f'{topic}: no stamp: expected 0 s or later, found {found}')
    return sec * NANOSECONDS + nanosec


def _six(linear: Any, angular: Any) -> tuple[float, ...]:
    return (linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)


def check_finite(topic: str, values: tuple[float, ...]) -> tuple[float, ...]:
    """Return the numbers of a message; BadMessageError when one is not finite, or absurd."""
    if not math.hypot(*values) <= LARGEST:  # NaN: false
        absurd = all(map(math.isfinite, values))
        expected = f'absurd: expected at most {LARGEST:g}' if absurd else NOT_FINITE
        raise BadMessageError(f'{topic}: {expected}, found {values}')
    return values


def check_state(topic: str, x: tuple[float, ...]) -> tuple[float, ...]:
    """Return a state (13 floats); BadMessageError: not finite, or no unit quaternion."""
    check_finite(topic, x)
    norm = math.hypot(*x[3:7])
    if abs(norm - 1.0) > UNIT:
        raise BadMessageError(
            f'{topic}: orientation: expected a unit quaternion, found norm {norm:g}'
        )
    return x


def _frame(topic: str, key: str, expected: str, found: str) -> None:
    if found != expected:
        raise BadMessageError(f'{topic}: {key}: expected {expected!r}, found {found!r}')


def _stamp(topic: str, message: Any) -> int:
    return check_stamp(topic, message.header.stamp.sec, message.header.stamp.nanosec)


def read_odometry(message: Any, frames: Frames, topic: str = ODOM) -> tuple[int, tuple[float, ...]]:
    """Stamp in ns and state (13 floats); BadMessageError when it must not be used."""
    _frame(topic, 'header.frame_id', frames.odom, message.header.frame_id)
    _frame(topic, 'child_frame_id', frames.base, message.child_frame_id)
    x = check_state(topic, state_of(message))
    return _stamp(topic, message), x


def state_of(message: Any) -> tuple[float, ...]:
    """State (13 floats) of an Odometry as it was sent: position, quaternion w x y z, twist."""
    p, q = message.pose.pose.position, message.pose.pose.orientation
    nu = _six(message.twist.twist.linear, message.twist.twist.angular)
    return (p.x, p.y, p.z, q.w, q.x, q.y, q.z, *nu)


def wrench_of(message: Any) -> tuple[float, ...]:
    """Six floats of a WrenchStamped as they were sent."""
    return _six(message.wrench.force, message.wrench.torque)


def _stamped(
    topic: str, message: Any, values: tuple[float, ...], frames: Frames
) -> tuple[int, tuple[float, ...]]:
    _frame(topic, 'header.frame_id', frames.base, message.header.frame_id)
    return _stamp(topic, message), check_finite(topic, values)


def read_twist(message: Any, frames: Frames, topic: str) -> tuple[int, tuple[float, ...]]:
    """Stamp in ns and six floats of a TwistStamped; BadMessageError when it must not be used."""
    return _stamped(topic, message, _six(message.twist.linear, message.twist.angular), frames)


def read_accel(message: Any, frames: Frames, topic: str) -> tuple[int, tuple[float, ...]]:
    """Stamp in ns and six floats of an AccelStamped; BadMessageError when it must not be used."""
    return _stamped(topic, message, _six(message.accel.linear, message.accel.angular), frames)


def read_wrench(message: Any, frames: Frames, topic: str) -> tuple[int, tuple[float, ...]]:
    """Stamp in ns and six floats of a WrenchStamped; BadMessageError when it must not be used."""
    return _stamped(topic, message, wrench_of(message), frames)


def read_joint_state(message: Any, frames: Frames, topic: str) -> tuple[int, tuple[float, ...]]:
    """Stamp in ns and `effort` of a JointState that has an entry per degree of freedom."""
    if tuple(message.name) != DOFS or len(message.effort) != len(DOFS):
        found = f'{list(message.name)} with {len(message.effort)} numbers'
        raise BadMessageError(f'{topic}: name: expected {list(DOFS)}, found {found}')
    return _stamped(topic, message, tuple(message.effort), frames)
