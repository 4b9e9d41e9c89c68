"""Gain, phase, delay and disk margins of a scenario's loops, and the gains that keep them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar, root

from auv_analysis.output.new_files import known
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.studies.linearize.linearize import (
    ATTITUDE,
    LawAt,
    holding_point,
    operating_point,
    plant_jacobian,
    plant_of,
)
from auv_analysis.studies.linearize.sampled_loop import (
    HeldInput,
    HeldPlant,
    LinearLaw,
    SampledLoop,
    behind_rotors,
)
from auv_dynamics.files.yaml_files import matrix6
from auv_dynamics.plant.rotors import asked_rotors
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.thrusters import Rotor
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_gvc_controller.laws import OPEN_LOOP
from auv_gvc_controller.laws.law import make_gains
from auv_gvc_controller.laws.model import ControlModel, control_model

LEAST_GAIN, LEAST_PHASE = 10 ** (6 / 20), np.radians(45.0)  # what is to be kept
POINTS, SLOWEST = 600, 1e-5  # of the grid: how many, and the first one relative to pi/h
# by which a pole may lie outside the unit circle: roll and pitch stay where they are, and three
# integrals of an axis that no thruster drives are a triple pole at 1, which rounding moves
NEUTRAL = 3e-6
CLOSED = 1e-9  # of 1 - S: below it an axis is not controlled at all
MEASURABLE = 1e-3  # a factor of the gain below it, or above its inverse, is no margin
FACTORS = 100.0 ** np.linspace(-1, 1, 35)  # of the present gain: tried for the largest
MOST_PERIODS = 100  # of a delay
STATIC = 1e-3  # of the first frequency, where the response is static; imaginary part that is none
SHARP, UNDAMPED = 0.1, 1e-6  # damping below which a pole is a resonance, and the least one
TINY = 1e-99  # what keeps log finite
AROUND = np.concatenate([-np.geomspace(10, 0.1, 12), np.geomspace(0.1, 10, 12)])


@dataclass(frozen=True)
class AxisMargins:
    """Margins of a loop that is opened at one axis, the others closed.

    Attributes
    ----------
    gain : factor of the loop gain at which the loop turns unstable; inf: none
    reduction : factor below 1 at which it does; 0: none
    phase : rad that it may lag or lead more; inf: none
    delay : s that the wrench of the axis may come later; inf: any
    crossover : rad/s at which the phase margin is met; NaN: none

    """

    gain: float = np.inf
    reduction: float = 0.0
    phase: float = np.inf
    delay: float = np.inf
    crossover: float = np.nan

    @property
    def to_spare(self) -> float:
        """Relative distance of the worst of them from 6 dB either way and 45 deg."""
        factor = min(self.gain, 1 / max(self.reduction, MEASURABLE))
        return float(min(factor / LEAST_GAIN, self.phase / LEAST_PHASE, 1 / MEASURABLE) - 1)

    @property
    def kept(self) -> bool:
        """Whether it has 6 dB either way and 45 deg."""
        return self.to_spare >= 0


def axis_margins(
    loop: SampledLoop, axis: int, omega: np.ndarray, S: np.ndarray, *, delays: bool = True
) -> AxisMargins:
    """Margins of one axis of a stable loop.

    From S_ii = 1/(1 + L_i) of the opened loop's gain L_i, which is finite where L_i is not: L_i is
    real where S_ii is, and crosses -1 once multiplied by S_ii/(S_ii - 1); abs(L_i) = 1 where the
    real part of S_ii is 1/2.

    Parameters
    ----------
    loop : SampledLoop
    axis : 0 to 5
    omega : (n,) rad/s, the last one pi/h
    S : (n,) S_ii there
    delays : whether the delay margin is looked for, which takes longest

    Skogestad & Postlethwaite 2005, section 2.4; Astrom & Murray 2021, section 10.3.

    """
    if np.abs(S - 1).max() < CLOSED:
        return AxisMargins()

    @cache  # ends of an interval, and what was found in it, are asked for several times
    def exact(at: float) -> complex:
        try:
            return complex(loop.sensitivity(np.array(at))[axis, axis])
        except np.linalg.LinAlgError:  # a pole of the opened loop: its gain is infinite
            return 0j

    real = [exact(at) for at in _zeros(lambda at: exact(at).imag, omega, S.imag)]
    ends = [s for s in (exact(STATIC * float(omega[0])), complex(S[-1]))
            if abs(s.imag) < STATIC * abs(s)]  # fmt: skip
    factors = [s.real / (s.real - 1) for s in (*real, *ends) if s.real != 1]
    ups = [factor for factor in factors if 1 < factor < 1 / MEASURABLE]
    downs = [factor for factor in factors if MEASURABLE < factor < 1]
    met = [(at, exact(at)) for at in _zeros(lambda at: exact(at).real - 0.5, omega, S.real - 0.5)]
    phases = [np.pi - 2 * np.arctan(2 * abs(s.imag)) for _, s in met]
    nearest = int(np.argmin(phases)) if phases else 0
    return AxisMargins(
        min(ups, default=np.inf),
        max(downs, default=0.0),
        min(phases, default=np.inf),
        min((_delay(loop, axis, *one) for one in met), default=np.inf) if delays else np.nan,
        met[nearest][0] if met else np.nan,
    )


def _zeros(exact: Callable[[float], float], omega: np.ndarray, values: np.ndarray) -> list[float]:
    """Where a function of rad/s changes its sign, values (n,) being those on the grid."""
    found = []
    for k in np.flatnonzero(values[:-1] * values[1:] < 0):
        low, high = float(omega[k]), float(omega[k + 1])
        if exact(low) * exact(high) < 0:  # else it is rounding about zero
            found.append(float(brentq(exact, low, high, xtol=1e-13 * high, rtol=1e-13)))
    return found


def _delay(loop: SampledLoop, axis: int, crossover: float, s: complex) -> float:
    """Further delay of an axis, s, that takes the loop to the border from one of its crossovers.

    The phase margin over the frequency is exact for whole periods, and the start for the others.
    """
    phase = (np.pi + np.angle(1 / s - 1)) % (2 * np.pi)
    start = np.array([crossover, phase / crossover])

    def missing(scaled: np.ndarray) -> list[float]:
        omega, extra = scaled * start
        value = loop.closing(omega, axis, max(extra, 0.0))
        return [value.real, value.imag]

    solved = root(missing, np.ones(2), tol=1e-12)
    return float(start[1] * (solved.x[1] if np.abs(missing(solved.x)).max() < 1e-8 else 1.0))


@dataclass(frozen=True, eq=False)
class ControlLoop:
    """A controller of a scenario in its loop about an operating point, its gain to be scaled.

    The turning of roll into pitch by a yaw rate is left out: it is as slow as that rate, and an
    attitude that no law of velocity pulls back says nothing of the margins.

    Attributes
    ----------
    scenario, controller : which loop; a current is left out
    delay : s from the sample to the wrench at the actuators, beside the hold; None: the scenario's
    lag : s, of the wrench; None: the scenario's. That of its rotors comes on top
    nu0, eta0 : (6,) the point as of `linearize`; None: at rest, level
    plant : what the wrench acts on
    turning : whether rotors follow late

    Raises
    ------
    ValueError : a delay or lag that is negative or too long, a wrong point
    ArithmeticError : the law holds nu0 in no state

    """

    scenario: Scenario
    controller: str
    delay: float | None = None
    lag: float | None = None
    nu0: Sequence[float] | np.ndarray | None = None
    eta0: Sequence[float] | np.ndarray | None = None
    plant: HeldPlant = field(init=False)
    turning: bool = field(init=False)
    _known: dict[bytes, np.ndarray] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        """Check the times, and sample the plant."""
        actuators, h = self.scenario.data.get('actuators', {}), self.scenario.step
        for name in ('delay', 'lag'):
            value = getattr(self, name)
            value = float(actuators.get(name, 0.0) if value is None else value)
            if value < 0 or (name == 'delay' and value > MOST_PERIODS * h):
                expected = f'0 to {MOST_PERIODS * h:g} s, {MOST_PERIODS} steps'
                raise ValueError(f'{name}: expected {expected}, found {value:g}')
            object.__setattr__(self, name, value)
        A, B = plant_jacobian(self._truth, *self._point)
        A[ATTITUDE, ATTITUDE] = 0.0
        thrusters = self._truth.thrusters if actuators.get('thrusters') else None
        if thrusters is not None:
            rotors = asked_rotors(actuators, thrusters)
            A, B = behind_rotors(A, B, rotors, thrusters.inverse, thrusters.matrix)
        object.__setattr__(self, 'turning', len(A) > 8)
        A, B = behind_rotors(A, B, (Rotor(lag=self.lag or 0.0),) * 6, np.eye(6), np.eye(6))
        object.__setattr__(self, 'plant', HeldPlant(A, B, h))

    @property
    def late(self) -> bool:
        """Whether a delay or a lag is known."""
        return bool(self.delay or self.lag or self.turning)

    @cached_property
    def _truth(self) -> Vehicle:
        return plant_of(self.scenario)

    @cached_property
    def _point(self) -> tuple[np.ndarray, np.ndarray]:
        return operating_point(self.eta0, 'eta0'), operating_point(self.nu0, 'nu0')

    @cached_property
    def omega(self) -> np.ndarray:
        """(n,) rad/s of the grid, up to half the sampling frequency."""
        return np.geomspace(SLOWEST, 1.0, POINTS) * np.pi / self.plant.period

    @cached_property
    def _held(self) -> HeldInput:
        return self.plant.input(self.delay or 0.0)

    @cached_property
    def _model(self) -> ControlModel:
        return control_model(self.scenario.vehicle)

    @property
    def gain(self) -> str:
        """Name of the gain of the velocity error, '' of a law that has none of the usual name."""
        given = self.scenario.gain_values(self.controller)
        return next((name for name in ('k_P', 'k_D') if name in given), '')

    def _law(self, scale: np.ndarray) -> LawAt:
        values = self.scenario.gain_values(self.controller)
        if self.gain:
            scaled = matrix6(values[self.gain]) * np.sqrt(np.outer(scale, scale))
            values = {**values, self.gain: scaled.tolist()}
        gains = make_gains(self.scenario.controller(self.controller)['law'], values)
        return LawAt(gains, self._model, self._point[0][5])

    def loop(self, scale: Sequence[float] | np.ndarray = (1.0,) * 6) -> SampledLoop:
        """The loop, the gain of the velocity error scaled per axis by (6,) `scale`.

        Off the diagonal it is scaled by the roots of both factors: it stays symmetric.
        """
        law = self._law(np.asarray(scale, float))
        held = holding_point(law, self._truth, *self._point)
        slope, _ = law.jacobian(held, 8 + law.states)
        parts = LinearLaw(slope[:6, :8], slope[:6, 8:], slope[6:, :8], slope[6:, 8:])
        return SampledLoop(self.plant, parts, self._held)

    def sensitivity(self, loop: SampledLoop) -> tuple[np.ndarray, np.ndarray]:
        """(n,) rad/s and S (n, 6, 6) there: on the grid, and around resonances."""
        opened = np.linalg.eigvals(self.plant.Phi)
        poles = np.log(np.concatenate([opened, loop.multipliers]).astype(complex) + TINY)
        poles = poles[(poles.imag > 0) & (np.abs(poles.real) < SHARP * poles.imag)]
        width = np.maximum(np.abs(poles.real), UNDAMPED * poles.imag)
        near = poles.imag[:, None] + width[:, None] * AROUND
        near = np.clip(near.ravel() / self.plant.period, self.omega[0], self.omega[-2])
        omega = np.concatenate([self.omega, near])
        order = np.argsort(omega)
        known = self._reached(loop)
        S = np.concatenate([loop.sensitivity(self.omega, known), loop.sensitivity(near)])
        return omega[order], S[order]

    def _reached(self, loop: SampledLoop) -> np.ndarray:
        """`reached` on the grid; a gain that is scaled seldom changes rates of the law's states."""
        rates = np.hstack([loop.law.rate_by_x, loop.law.rate_by_state]).tobytes()
        if rates not in self._known:
            self._known.clear()
            self._known[rates] = loop.reached(self.omega)
        return self._known[rates]

    def margins(self, loop: SampledLoop, *, delays: bool = True) -> tuple[AxisMargins, ...]:
        """Margins of the six axes; `delays`: with the delay margins, which take longest."""
        omega, S = self.sensitivity(loop)
        return tuple(axis_margins(loop, i, omega, S[:, i, i], delays=delays) for i in range(6))

    def disk_margin(self, loop: SampledLoop) -> float:
        """Alpha of the disk margin of all six axes at once, a lower bound; at most 2.

        Gains within (2 - alpha)/(2 + alpha) and its inverse, or phases within 2 atan(alpha/2), in
        every axis at the same time and independently, leave the loop stable: 1/alpha is the
        structured singular value of S - I/2 for diagonal uncertainty, bounded by the largest
        singular value after diagonal scaling, which makes it independent of units.

        Seiler, Packard & Gahinet 2020; scaling by Perron eigenvectors, Safonov 1982.
        """

        def size(omega: np.ndarray) -> np.ndarray:
            return _scaled_size(loop.sensitivity(omega) - np.eye(6) / 2)

        grid, S = self.sensitivity(loop)
        sizes = _scaled_size(S - np.eye(6) / 2)
        peak = int(np.argmax(sizes))
        around = grid[max(peak - 1, 0)], grid[min(peak + 1, len(sizes) - 1)]
        best = minimize_scalar(lambda omega: -size(np.array(omega)), bounds=around)
        return float(1 / max(sizes[peak], -best.fun))

    def largest(self, axis: int | None = None) -> float:
        """Largest factor of the velocity error's gain that keeps 6 dB and 45 deg; 0: none.

        Parameters
        ----------
        axis : whose gain is scaled, and whose loop has to keep them; None: all of them

        """
        chosen = list(range(6)) if axis is None else [axis]

        @cache
        def to_spare(factor: float) -> float:
            scale = np.ones(6)
            scale[chosen] = factor
            try:
                loop = self.loop(scale)
            except (ArithmeticError, ValueError):  # a gain that the law refuses, or cannot hold by
                return -1.0
            if not stable(loop):
                return -1.0
            omega, S = self.sensitivity(loop)
            found = (axis_margins(loop, i, omega, S[:, i, i], delays=False) for i in chosen)
            return min(one.to_spare for one in found)

        def border(factors: np.ndarray, *, good: bool) -> float | None:
            for near, far in pairwise(factors.tolist()):
                if (to_spare(far) >= 0) != good:
                    return float(brentq(to_spare, near, far, rtol=1e-6))
            return None

        present = len(FACTORS) // 2
        if to_spare(1.0) >= 0:
            return border(FACTORS[present:], good=True) or np.inf
        if below := border(FACTORS[present::-1], good=False):
            return below
        if to_spare(FACTORS[-1]) >= 0:
            return np.inf
        return border(FACTORS[: present - 1 : -1], good=False) or 0.0


def stable(loop: SampledLoop) -> bool:
    """Whether nothing grows; roll and pitch that a law neither pulls back nor pushes may stay."""
    return bool(np.abs(loop.multipliers).max() <= 1 + NEUTRAL)


def _scaled_size(M: np.ndarray) -> np.ndarray:
    """(...,) upper bound of the structured singular value of M (..., 6, 6), diagonal blocks."""
    size = np.abs(M)
    size = size + 1e-12 * size.max(axis=(-2, -1), keepdims=True)  # no zeros: one Perron eigenvector
    right, left = (_perron(matrix) for matrix in (size, np.swapaxes(size, -2, -1)))
    d = np.sqrt(left / right)
    bound = np.linalg.norm(d[..., :, None] * M / d[..., None, :], 2, axis=(-2, -1))
    return np.asarray(bound)


def _perron(matrix: np.ndarray) -> np.ndarray:
    values, vectors = np.linalg.eig(matrix)
    largest = np.argmax(values.real, axis=-1)
    return np.abs(np.take_along_axis(vectors, largest[..., None, None], -1)[..., 0])


def stability_margins(setting: ControlLoop) -> dict[str, Any]:
    """Margins of a loop, ready for JSON.

    Parameters
    ----------
    setting : ControlLoop

    Returns
    -------
    margins : `period`, `delay`, `lag` in s; `stable`; `kept`, 6 dB and 45 deg on every axis;
        `disk_margin` alpha; `gain`, the name of the velocity error's, and `together`, the
        largest factor of it on all axes at once that keeps them; `axes`, per axis `gain_margin` and
        `gain_reduction` as factors, `gain_margin_db`, `phase_margin` in degrees, `delay_margin`
        in s, `crossover` in rad/s, `value` and `largest` of the gain, scaled on this axis alone,
        `kept`. What has no bound is None, and all margins where the loop is unstable; the largest
        gain is 0 where no multiple between a hundredth and a hundred keeps them

    """
    loop = setting.loop()
    holds = stable(loop)
    found: Sequence[AxisMargins | None] = setting.margins(loop) if holds else (None,) * 6
    rows = [_row(setting, i, one) for i, one in enumerate(found)]
    return {
        'period': setting.plant.period,
        'delay': setting.delay,
        'lag': setting.lag,
        'stable': holds,
        'kept': all(row['kept'] for row in rows),
        'disk_margin': setting.disk_margin(loop) if holds else None,
        'gain': setting.gain,
        'together': known(setting.largest()) if setting.gain else None,
        'axes': rows,
    }


def _row(setting: ControlLoop, axis: int, found: AxisMargins | None) -> dict[str, Any]:
    row: dict[str, Any] = {'axis': DOFS[axis], 'kept': found is not None and found.kept}
    if found is not None:
        row |= {
            'gain_margin': known(found.gain),
            'gain_margin_db': known(20 * np.log10(found.gain)),
            'gain_reduction': found.reduction or None,
            'phase_margin': known(np.degrees(found.phase)),
            'delay_margin': known(found.delay),
            'crossover': known(found.crossover),
        }
    if setting.gain:
        given = setting.scenario.gain_values(setting.controller)[setting.gain]
        value = float(matrix6(given)[axis, axis])
        row |= {'value': value, 'largest': known(value * setting.largest(axis))}
    return row


def margin_notes(
    scenario: Scenario,
    controllers: Sequence[str],
    delay: float | None = None,
    *,
    driver: bool = False,
) -> list[str]:
    """Margins of controllers at rest and at the mean set-point, a line each; [] without a delay.

    Parameters
    ----------
    scenario : whose actuators have a delay or a lag, else there is nothing to say
    controllers : names of some of its own
    delay : s, in place of the scenario's
    driver : a vehicle takes the plant's place, whose delay is to be known

    Returns
    -------
    notes : 'note: ...' of a controller that keeps 6 dB and 45 deg on every axis, 'warning: ...' of
        one that does not

    """
    found = []
    for name in controllers:
        if scenario.controller(name)['law'] == OPEN_LOOP:
            continue
        try:
            at_rest = ControlLoop(scenario, name, delay)
            if at_rest.late:
                under_way = ControlLoop(scenario, name, delay, nu0=_mean_setpoint(scenario))
                found.append(_note([at_rest, under_way]))
            elif driver:
                text = 'no delay is known, and no margins; auv check-driver --actuate measures it'
                found.append(f'note: {scenario.path}: controllers.{name}: {text}')
        except Exception as error:  # a law of the user's own may raise anything
            found.append(f'note: {scenario.path}: controllers.{name}: no margins: {error}')
    return found


def _mean_setpoint(scenario: Scenario) -> np.ndarray:
    """(6,) of a thousand moments."""
    moments = np.linspace(0.0, scenario.duration, 1001)
    return np.asarray(scenario.setpoint.value(moments).mean(axis=0))


def _note(settings: Sequence[ControlLoop]) -> str:
    """One line of a controller, of the worst of its operating points."""
    first = settings[0]
    path = f'{first.scenario.path}: controllers.{first.controller}'
    late = f'with a loop delay of {first.delay:g} s and a lag of {first.lag:g} s'
    late += ' beside that of the rotors' * first.turning
    rows: list[tuple[int, AxisMargins]] = []
    for setting in settings:
        try:
            loop = setting.loop()
        except ArithmeticError as error:  # a velocity that the law cannot hold
            if setting is first:
                return f'note: {path}: no margins: {error}'
            continue
        if not stable(loop):
            return f'warning: {path}: unstable {late}; see auv linearize'
        rows += enumerate(setting.margins(loop, delays=False))
    factor, axis = min((min(m.gain, 1 / max(m.reduction, MEASURABLE)), i) for i, m in rows)
    by_gain = f'{20 * np.log10(factor):.3g} dB ({DOFS[axis]})'
    phase, axis = min((m.phase, i) for i, m in rows)
    by_phase = f'{np.degrees(phase):.3g} deg ({DOFS[axis]})'
    text = (
        f'{path}: gain margin {by_gain if factor < 1 / MEASURABLE else "without end"}, '
        f'phase margin {by_phase if np.isfinite(phase) else "without end"} {late}'
    )
    if all(one.kept for _, one in rows):
        return f'note: {text}'
    return f'warning: {text}: below 6 dB and 45 deg; see auv linearize'
