"""The plan of a check: small wrenches along one axis at a time.

Their size follows from the vehicle's inertia, and from the dead band of its thrusters.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from auv_analysis.driver.response import FINER, STEPS, Wrench, predicted
from auv_analysis.output.text import join
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle

PULSE = 1.0  # s that a wrench acts one way, then the other
SHORT = 0.5  # s of it for a wrench that is large, since thrusters have a dead band
ABOVE = 1.2  # times the wrench at which the last thruster turns: what is sent then
LOADED = 0.05  # of a wrench: a thruster that gives less of it does not matter
REST = 0.5  # s of zero before and after
SETTLE = 2.0  # s of it before the first: a driver arms, and the noise at rest is measured
HELD, UNHEARD = 0.5, 2.0  # s of a wrench, then of silence, to see whether the driver lets go
LET_GO = 0.25  # s between two times at which a driver may let go
SWING = 4.0  # s of zero in which a vehicle swings back
ROUNDS = 4  # of making a wrench smaller: drag is not linear
FASTEST = 2.0 * FINER / STEPS  # 1/s of the damping: beyond it the steps of a prediction diverge
LEVEL = np.eye(13)[3]  # at rest, upright
CALM = ('surge', 'sway', 'yaw', 'heave', 'roll', 'pitch')  # those first that nothing restores
ZERO = (0.0,) * 6


@dataclass(frozen=True)
class Trial:
    """A wrench along one axis.

    Attributes
    ----------
    dof : its axis
    size : N or N m
    silent : whether it ends by silence, not by its opposite and zero
    rest, pulse : s of zero before it, and of each way
    dead_band : N or N m at which all its thrusters turn; 0: not known
    speed : m/s and rad/s that are not passed, by the model

    """

    dof: str
    size: float
    silent: bool = False
    rest: float = REST
    pulse: float = PULSE
    dead_band: float = 0.0
    speed: float = 0.0

    @property
    def axis(self) -> int:
        """Index of its axis."""
        return DOFS.index(self.dof)

    @property
    def tau(self) -> Wrench:
        """The wrench, N and N m."""
        return tuple(self.size if i == self.axis else 0.0 for i in range(6))

    @property
    def unit(self) -> str:
        """Of its size."""
        return 'N' if self.axis < 3 else 'N m'

    @property
    def turns(self) -> bool:
        """Whether its thrusters are out of their dead band, as far as that is known."""
        return self.size >= self.dead_band

    @property
    def speed_unit(self) -> str:
        """Of the velocity along its axis."""
        return 'm/s' if self.axis < 3 else 'rad/s'

    @property
    def parts(self) -> list[tuple[Wrench, float]]:
        """Wrenches one after the other, and for how many s each is sent."""
        if self.silent:
            return [(ZERO, self.rest), (self.tau, HELD)]
        back = tuple(-number for number in self.tau)
        return [(ZERO, self.rest), (self.tau, self.pulse), (back, self.pulse), (ZERO, REST)]

    @property
    def way(self) -> float:
        """For how many s the wrench may act one way."""
        return HELD + UNHEARD if self.silent else self.pulse

    @property
    def seconds(self) -> float:
        """Duration."""
        return sum(seconds for _, seconds in self.parts) + (UNHEARD if self.silent else 0.0)


@dataclass(frozen=True)
class Plan:
    """The wrenches that will be sent.

    Attributes
    ----------
    vehicle : the model that it is made for
    trials : one after the other, that with silence last
    skipped : degree of freedom -> why none is sent for it

    """

    vehicle: Vehicle
    trials: tuple[Trial, ...]
    skipped: Mapping[str, str]

    @property
    def speed(self) -> float:
        """Bound of every velocity by the model, m/s and rad/s."""
        return max(trial.speed for trial in self.trials)

    def lines(self) -> list[str]:
        """Announcement of the plan, for people."""
        seconds = sum(trial.seconds for trial in self.trials)
        moved = [f'{one.dof} ±{one.size:.3g} {one.unit}' for one in self.trials if not one.silent]
        last = self.trials[-1]
        return [
            f'THE VEHICLE WILL MOVE for {seconds:.0f} s: {join(moved)}, {PULSE:g} s or less each, '
            f'then {last.dof} {last.size:.3g} {last.unit} without a zero behind it',
            f'by the model at most {self.speed:g} m/s and rad/s; Ctrl-C sends zero and ends',
        ]


def plan_of(
    vehicle: Vehicle,
    dofs: Sequence[str],
    speed: float,
    force: float | None,
    torque: float | None,
    raised: float = 0.0,
) -> Plan:
    """Wrenches that move a vehicle a little.

    Parameters
    ----------
    vehicle : the model
    dofs : axes that are asked for; none: all
    speed : m/s and rad/s that no degree of freedom passes by the model
    force, torque : N and N m that none passes; none: only the speed limits them
    raised : m/s and rad/s in place of the speed, where thrusters would stay in their dead band

    Raises
    ------
    InputError : the model is too stiff to be predicted

    """
    damping = vehicle.D(np.full(6, max(speed, raised)))
    rate = np.abs(np.linalg.eigvals(np.linalg.solve(vehicle.M, damping))).max()
    if rate > FASTEST:
        expected = f'time constants of at least {1e3 / FASTEST:g} ms, so that it can be predicted'
        raise InputError(vehicle.name, 'damping', expected, f'{1e3 / rate:.2g} ms')
    lost = vehicle.thrusters.unactuated() if vehicle.thrusters is not None else {}
    asked = [dof for dof in DOFS if dof in (dofs or DOFS)]
    skipped = {dof: 'not asked for: --axis' for dof in DOFS if dof not in asked}
    skipped |= {dof: 'the thrusters of the vehicle file cannot' for dof in asked if dof in lost}
    moved = [dof for dof in asked if dof not in skipped]
    caps = (force, torque)

    def bounded(trial: Trial) -> Trial:
        cap, dead_band = caps[trial.axis // 3], _dead_band(vehicle, trial.axis)
        trial = replace(trial, dead_band=dead_band, speed=speed)
        most = _largest(vehicle, trial, speed)
        if most < ABOVE * dead_band and raised > speed:
            trial = replace(trial, pulse=SHORT)
            most = min(_largest(vehicle, trial, raised), ABOVE * dead_band)
        trial = replace(trial, size=most if cap is None else min(most, cap))
        return replace(trial, speed=max(speed, _fastest(vehicle, trial))) if dead_band else trial

    trials = [Trial(dof, 1.0) for dof in moved]
    if moved:
        trials[0] = replace(trials[0], rest=SETTLE)
        trials.append(Trial(min(moved, key=CALM.index), 1.0, silent=True))
    return Plan(vehicle, tuple(map(bounded, trials)), skipped)


def _dead_band(vehicle: Vehicle, axis: int) -> float:
    """N or N m along an axis at which all thrusters that it needs turn; 0 where none tells it."""
    thrusters = vehicle.thrusters
    if thrusters is None or not thrusters.rotors:
        return 0.0
    share = np.abs(thrusters.inverse[:, axis])
    needed = thrusters.matrix[axis] * thrusters.inverse[:, axis] > LOADED
    least = np.array([max(rotor.dead_band) for rotor in thrusters.rotors])
    return float((least[needed] / share[needed]).max(initial=0.0))


def _largest(vehicle: Vehicle, trial: Trial, speed: float) -> float:
    """N or N m that no velocity passes a speed with: by inertia alone, and by the whole model."""
    size = speed / (trial.way * float(np.abs(np.linalg.inv(vehicle.M)[:, trial.axis]).max()))
    for _ in range(ROUNDS):
        fastest = _fastest(vehicle, replace(trial, size=size))
        if fastest <= speed:
            break
        size *= speed / fastest
    return size


def _fastest(vehicle: Vehicle, trial: Trial) -> float:
    """Largest velocity of any degree of freedom by the model, m/s and rad/s.

    What rights the vehicle can swing it faster on the way back, or whenever the driver lets go.
    """
    seconds, back = trial.way, tuple(-number for number in trial.tau)
    pulses = [[(0.0, seconds, trial.tau), (seconds, 2 * seconds, back)]]
    if trial.silent:
        ends = np.arange(HELD, seconds + LET_GO / 2, LET_GO)
        pulses = [[(0.0, end, trial.tau)] for end in ends.tolist()]
    swings = ([*held, (held[-1][1], held[-1][1] + SWING, ZERO)] for held in pulses)
    return max(float(np.abs(predicted(vehicle, LEVEL, held).added).max()) for held in swings)
