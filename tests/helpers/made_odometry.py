"""Odometry of a motion that is known, right or with one mistake, as a driver would send it."""

from dataclasses import replace
from functools import cache

import numpy as np

from auv_analysis.driver.checks import judge
from auv_analysis.driver.evidence import (
    CheckResult,
    DriverRecord,
    Endpoint,
    GraphSnapshot,
    Settings,
)
from auv_analysis.driver.odometry_log import OdometryLog
from auv_dynamics.ros.interface import Frames
from auv_dynamics.vehicle.frames import swap_state
from auv_dynamics.vehicle.kinematics import euler, quaternion, rotation

BEGAN = 1_700_000_000 * 10**9
ODOMETRY, WRENCH = 'nav_msgs/msg/Odometry', 'geometry_msgs/msg/WrenchStamped'
DRIVER = '/driver'


def motion(*size: float, **kind: float) -> np.ndarray:
    """States (n, 13) of `swinging`, to be changed."""
    return swinging(*size, **kind).copy()


@cache
def swinging(
    seconds: float = 10.0,
    rate: float = 50.0,
    heading: float = 0.7,
    speed: float = 1.0,
    noise: float = 0.0,
    seed: int = 0,
) -> np.ndarray:
    """States (n, 13) of smooth oscillations in all six degrees of freedom.

    Parameters
    ----------
    seconds, rate : how long, and samples per s
    heading : mean yaw, rad
    speed : 1: some 0.2 m/s and 0.15 rad/s
    noise : standard deviation in m, m/s, rad and rad/s

    """
    fine = 20  # steps between samples: the position is the integral of R nu
    dt = 1.0 / (rate * fine)
    t = np.arange(round(seconds * rate) * fine) * dt
    omega = np.array([0.9, 1.3, 0.7, 1.1, 0.8, 0.6])
    angle = np.array([0.1, 0.12, 0.25])  # roll, pitch, yaw
    phases = np.arange(6) * 1.1
    angles = speed * angle * np.sin(np.outer(t, omega[3:]) + phases[3:]) + [0.0, 0.0, heading]
    rates = speed * angle * omega[3:] * np.cos(np.outer(t, omega[3:]) + phases[3:])
    phi, theta, _ = angles.T
    p = rates[:, 0] - rates[:, 2] * np.sin(theta)
    q = rates[:, 1] * np.cos(phi) + rates[:, 2] * np.cos(theta) * np.sin(phi)
    r = rates[:, 2] * np.cos(theta) * np.cos(phi) - rates[:, 1] * np.sin(phi)
    v = speed * np.array([0.3, 0.2, 0.15]) * np.sin(np.outer(t, omega[:3]) + phases[:3])
    Q = quaternion(angles)
    earth = np.einsum('nij,nj->ni', rotation(Q), v)
    way = np.cumsum((earth[:-1] + earth[1:]) / 2 * dt, axis=0)
    position = np.concatenate([np.zeros((1, 3)), way]) + np.array([3.0, -2.0, 5.0])
    x = np.concatenate([position, Q, v, p[:, None], q[:, None], r[:, None]], axis=1)[::fine]
    if noise:
        draw = np.random.default_rng(seed).normal(0.0, noise, (len(x), 12))
        x[:, :3] += draw[:, :3]
        x[:, 3:7] = quaternion(euler(x[:, 3:7]) + draw[:, 3:6])
        x[:, 7:] += draw[:, 6:]
    return x


def odometry_log(x: np.ndarray, rate: float = 50.0, latency: float = 0.004) -> OdometryLog:
    """What is heard of a driver that publishes states (n, 13) at a steady rate."""
    stamp = BEGAN + np.round(np.arange(len(x)) * 1e9 / rate).astype(np.int64)
    arrived = stamp + round(latency * 1e9)
    frames = Frames()
    named = {(frames.odom, frames.base): len(x)}
    return OdometryLog(int(arrived[0]), int(arrived[-1]), arrived, stamp, stamp.copy(), x, named)


def healthy(**values: object) -> OdometryLog:
    """A log without a fault, some of its fields replaced."""
    return replace(odometry_log(motion(noise=1e-4)), **values)


def graph(**values: object) -> GraphSnapshot:
    """A driver and nobody else, some of the fields replaced."""
    right = GraphSnapshot(
        'ROS_DOMAIN_ID=7',
        '/odom',
        '/wrench',
        odom_publishers=(Endpoint(DRIVER, ODOMETRY),),
        wrench_subscribers=(Endpoint(DRIVER, WRENCH),),
    )
    return replace(right, **values)


def found_in(
    log: OdometryLog, *ids: str, seen: GraphSnapshot | None = None, **settings: object
) -> dict[str, CheckResult]:
    """Check -> what comes of it, of some checks of a driver that was listened to."""
    evidence = DriverRecord(seen or graph(), log, Settings(**settings), passive='not asked for')
    return {one.id: one for one in judge(evidence, ids)}


def turned_to_ros(x: np.ndarray) -> np.ndarray:
    """States in ENU and FLU."""
    return swap_state(x)
