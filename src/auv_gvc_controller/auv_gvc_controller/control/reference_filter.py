"""Reference filter: a smooth nu_d with its derivative for set-points that jump."""

from dataclasses import dataclass

from auv_gvc_controller.control.odometry_guard import ZERO

Six = tuple[float, ...]


@dataclass(frozen=True)
class FilterSettings:
    """Of a second-order low-pass filter per axis, with limits.

    Attributes
    ----------
    omega : natural frequency, rad/s
    zeta : damping ratio; from 1 on nothing overshoots
    speed, rate : largest nu_d of a linear and an angular axis, m/s and rad/s
    acceleration, angular_acceleration : largest nu_d_dot, m/s2 and rad/s2

    """

    omega: float
    zeta: float
    speed: float
    rate: float
    acceleration: float
    angular_acceleration: float

    @property
    def steepest(self) -> Six:
        """(6,) largest nu_d_dot."""
        return (self.acceleration,) * 3 + (self.angular_acceleration,) * 3


class ReferenceFilter:
    """Second-order low-pass filter of the set-point r (Fossen 2021, section 12.1), per axis.

        nu_d_ddot + 2 zeta omega nu_d_dot + omega^2 nu_d = omega^2 r

    Implicit Euler steps: stable for every step of time, without overshoot where zeta >= 1, and
    nu_d advances by dt * nu_d_dot exactly, also where a limit holds.
    """

    def __init__(self, settings: FilterSettings):
        self._settings = settings
        self._fastest = (settings.speed,) * 3 + (settings.rate,) * 3
        self.start(ZERO)

    def start(self, nu: Six) -> None:
        """Begin at a velocity (6,), within the limits, without acceleration."""
        self._nu_d = tuple(
            clamped(value, most) for value, most in zip(nu, self._fastest, strict=True)
        )
        self._nu_d_dot: Six = ZERO

    def advance(self, dt: float, setpoint: Six) -> tuple[Six, Six]:
        """Follow a set-point.

        Parameters
        ----------
        dt : s since the last call, 0 or more
        setpoint : (6,) m/s and rad/s, body frame

        Returns
        -------
        nu_d, nu_d_dot : six floats each, within the limits

        """
        if dt > 0.0:
            gain = dt * self._settings.omega**2
            damping = 1.0 + 2.0 * self._settings.zeta * self._settings.omega * dt + dt * gain
            slopes, values = [], []
            for r, v, a, fastest, steepest in zip(
                setpoint, self._nu_d, self._nu_d_dot, self._fastest, self._settings.steepest,
                strict=True,
            ):  # fmt: skip
                wanted = (a + gain * (clamped(r, fastest) - v)) / damping
                reached = clamped(v + dt * clamped(wanted, steepest), fastest)
                slopes.append(clamped((reached - v) / dt, steepest))
                values.append(reached)
            self._nu_d, self._nu_d_dot = tuple(values), tuple(slopes)
        return self._nu_d, self._nu_d_dot


def clamped(value: float, most: float) -> float:
    """The number nearest to `value` in [-most, most]."""
    return min(max(value, -most), most)
