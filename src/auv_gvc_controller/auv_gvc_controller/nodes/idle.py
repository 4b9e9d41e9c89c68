"""Why the controller follows no set-point, said to the person who meant to send some."""

import time
from typing import Any

from auv_dynamics.ros import topics
from auv_dynamics.ros.endpoints import why_silent
from auv_dynamics.ros.health import ERROR, OK, STALE, WARN, Health
from auv_dynamics.ros.interface import NANOSECONDS

LATE = 1.0  # s without a message, after which nobody is said to publish
NO_ODOMETRY, NO_SETPOINT = 'no odometry', 'no set-point'  # what the watchdog's texts begin with


class Idle:
    """Explains the watchdog of a controller by what has been heard.

    Parameters
    ----------
    node : the controller node
    derivative : whether each set-point needs its `cmd_accel`

    """

    def __init__(self, node: Any, derivative: bool):
        self._node, self._derivative = node, derivative
        self._heard: dict[str, tuple[int, float]] = {}  # topic -> newest stamp, steady s

    def hear(self, topic: topics.Topic, ns: int) -> None:
        """Note a set-point or its derivative."""
        self._heard[topic.name] = ns, time.monotonic()

    def health(self, watchdog: str, odometry_ns: int | None) -> Health:
        """Level and explanation of what the watchdog says.

        Parameters
        ----------
        watchdog : why the law is not in charge; empty while it is
        odometry_ns : stamp of the last odometry; None: there was none yet

        """
        if not watchdog and odometry_ns is None:
            watchdog = f'{NO_ODOMETRY} yet'
        if watchdog.startswith(NO_ODOMETRY):
            return STALE, _joined(watchdog, why_silent(self._node, topics.ODOM))
        if watchdog.startswith(NO_SETPOINT):
            return WARN, _joined(watchdog, self._no_setpoint(odometry_ns or 0))
        return (ERROR, watchdog) if watchdog else (OK, '')

    def _no_setpoint(self, odometry_ns: int) -> str:
        ns, at = self._heard.get(topics.CMD_VEL.name, (0, -LATE))
        if time.monotonic() - at > LATE:
            return why_silent(self._node, topics.CMD_VEL)
        _, derivative_at = self._heard.get(topics.CMD_ACCEL.name, (0, -LATE))
        if self._derivative and time.monotonic() - derivative_at > LATE:
            silent = why_silent(self._node, topics.CMD_ACCEL) or 'no cmd_accel of its stamp comes'
            return f'{silent}; setpoint_acceleration: topic waits for it'
        if abs(apart := (ns - odometry_ns) / NANOSECONDS) > LATE:
            found = 'stamp 0' if ns == 0 else f'stamps {abs(apart):.3g} s apart from those of odom'
            return f'cmd_vel: expected the time at which it is valid as stamp, found {found}'
        return ''


def _joined(watchdog: str, why: str) -> str:
    return f'{watchdog}: {why}' if why else watchdog
