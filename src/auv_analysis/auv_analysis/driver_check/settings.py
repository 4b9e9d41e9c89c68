"""What a driver is checked against: the defaults of the controller's parameters."""

from dataclasses import dataclass, field

from auv_dynamics.ros.interface import Frames
from auv_gvc_controller.control.settings import ControllerSettings


@dataclass(frozen=True)
class Settings:
    """What is expected of odometry.

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
