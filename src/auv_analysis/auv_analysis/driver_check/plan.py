"""Which wrenches are sent to see the answer: small by the vehicle's inertia, an axis at a time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from auv_analysis.driver_check.prediction import predicted
from auv_analysis.output.text import join
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle

PULSE = 1.0  # s that a wrench acts one way, then the other
REST = 0.5  # s of zero before and after
HELD, UNHEARD = 0.5, 2.0  # s of a wrench, then of silence, to see whether the driver lets go
SPEED = 0.1  # m/s and rad/s that no wrench brings the vehicle beyond, by the model
ROUNDS = 4  # of making a wrench smaller: drag is not linear
LEVEL = np.eye(13)[3]  # at rest, upright
CALM = ('surge', 'sway', 'yaw', 'heave', 'roll', 'pitch')  # those first that nothing restores


@dataclass(frozen=True)
class Trial:
    """A wrench along one axis.

    Attributes
    ----------
    dof : its axis
    size : N or N m
    silent : whether it ends by silence, not by its opposite and zero

    """

    dof: str
    size: float
    silent: bool = False

    @property
    def axis(self) -> int:
        """Index of its axis."""
        return DOFS.index(self.dof)

    @property
    def tau(self) -> tuple[float, ...]:
        """The wrench, N and N m."""
        return tuple(self.size if i == self.axis else 0.0 for i in range(6))

    @property
    def unit(self) -> str:
        """Of its size."""
        return 'N' if self.axis < 3 else 'N m'


@dataclass(frozen=True)
class Plan:
    """What is going to be sent.

    Attributes
    ----------
    trials : one after the other, that with silence last
    skipped : degree of freedom -> why none is sent for it
    speed : m/s and rad/s that are not passed, by the model

    """

    trials: tuple[Trial, ...]
    skipped: Mapping[str, str]
    speed: float

    @property
    def seconds(self) -> float:
        """How long it takes."""
        each = {False: 2 * (PULSE + REST), True: HELD + UNHEARD + REST}
        return sum(each[trial.silent] for trial in self.trials)

    def lines(self) -> list[str]:
        """What is going to happen, for people."""
        moved = [f'{trial.dof} ±{trial.size:.3g} {trial.unit}' for trial in self.trials
                 if not trial.silent]  # fmt: skip
        last = self.trials[-1]
        return [
            f'THE VEHICLE WILL MOVE for {self.seconds:.0f} s: {join(moved)}, {PULSE:g} s each way, '
            f'then {last.dof} {last.size:.3g} {last.unit} without a zero behind it',
            f'by the model at most {self.speed:g} m/s and rad/s; Ctrl-C sends zero and ends',
        ]


def plan_of(
    vehicle: Vehicle, dofs: Sequence[str], speed: float, force: float | None, torque: float | None
) -> Plan:
    """Wrenches that move a vehicle a little.

    Parameters
    ----------
    vehicle : the model
    dofs : axes that are asked for; none: all
    speed : m/s and rad/s that no degree of freedom passes by the model
    force, torque : N and N m that none passes; none: only the speed limits them

    """
    lost = vehicle.thrusters.unactuated() if vehicle.thrusters is not None else {}
    asked = [dof for dof in DOFS if dof in (dofs or DOFS)]
    skipped = {dof: 'not asked for: --axis' for dof in DOFS if dof not in asked}
    skipped |= {dof: 'the thrusters of the vehicle file cannot' for dof in asked if dof in lost}
    moved = [dof for dof in asked if dof not in skipped]
    caps = (force, torque)

    def bounded(trial: Trial) -> Trial:
        most = _largest(vehicle, trial, speed)
        cap = caps[trial.axis // 3]
        return replace(trial, size=most if cap is None else min(most, cap))

    trials = [Trial(dof, 1.0) for dof in moved]
    if moved:
        trials.append(Trial(min(moved, key=CALM.index), 1.0, silent=True))
    return Plan(tuple(map(bounded, trials)), skipped, speed)


def _largest(vehicle: Vehicle, trial: Trial, speed: float) -> float:
    """N or N m that no velocity passes a speed with: by inertia alone, and by the whole model."""
    seconds = HELD + UNHEARD if trial.silent else PULSE
    size = speed / (seconds * float(np.abs(np.linalg.inv(vehicle.M)[:, trial.axis]).max()))
    for _ in range(ROUNDS):
        tau = replace(trial, size=size).tau
        back = tuple(-number for number in tau)
        held = [(0.0, seconds, tau)]
        if not trial.silent:  # what rights the vehicle can swing it faster on the way back
            held += [(seconds, 2 * seconds, back), (2 * seconds, 4 * seconds, (0.0,) * 6)]
        fastest = float(np.abs(predicted(vehicle, LEVEL, held).added).max())
        if fastest <= speed:
            break
        size *= speed / fastest
    return size
