"""Actuators, anti-windup, sensors and their faults at samples (docs/model.md, docs/faults.md)."""

from __future__ import annotations

import csv
from functools import cache
from math import exp
from pathlib import Path
from typing import Any

import numpy as np
from reference_faults import AXES, Faults, weakened
from reference_vehicle import Array, rodrigues

NOISE_OF_ROUNDING = 1e-9  # of the sum of all |d|: what lies below is not cut
INTEGRALS = {'pid': 6}  # of the law's states; of the other laws all
ROOT = Path(__file__).resolve().parents[2]
CURVES = ROOT / 'src/auv_dynamics/auv_dynamics/vehicle/curves'  # measured data, no code


@cache
def t200(volts: int) -> tuple[Array, Array]:
    """Pulse widths and thrusts in N, sorted, of the table measured at so many volts."""
    lines = [line for line in (CURVES / f't200_{volts}v.csv').open() if line[0] != '#']
    rows = [(float(one['pwm_us']), float(one['thrust_kgf'])) for one in csv.DictReader(lines)]
    pulses, thrusts = np.array(rows).T
    return pulses, np.sort(thrusts) * 9.80665


@cache
def thrusts(rated: int, volts: float) -> tuple[Array, Array]:
    """Thrusts at the nominal voltage, sorted, and at another one for the same pulse widths."""
    _pulses, nominal = t200(rated)
    if volts <= 10 or volts >= 20:
        edge = 10 if volts <= 10 else 20
        given = t200(edge)[1] * (volts / edge) ** 2
    else:
        low = 2 * int(volts // 2)
        part = (volts - low) / 2
        given = (1 - part) * t200(low)[1] + part * (t200(low + 2)[1] if part else 0.0)
    turning = nominal != 0.0
    x, first = np.unique(np.append(nominal[turning], 0.0), return_index=True)
    return x, np.append(given[turning], 0.0)[first]


class Rotor:
    """One thruster's rotor: what comes of the thrusts asked for, once per sample."""

    def __init__(self, spec: dict[str, Any], entry: dict[str, Any], voltage: Any, h: float):
        self.band = np.broadcast_to(np.asarray(spec.get('dead_band', 0.0), float), 2)
        self.lag, self.h, self.voltage = spec.get('lag', 0.0), h, voltage
        self.omega, self.zeta = spec.get('omega'), spec.get('zeta', 1.0)
        self.entry, self.state = entry, np.zeros(2)
        if self.omega is not None:
            # the series of the exponential of the system and its constant input
            A = np.array([[0.0, 1.0, 0.0], [-1.0, -2 * self.zeta / self.omega, 1.0], [0, 0, 0]])
            A[1] *= self.omega**2
            term = self.transition = np.eye(3)
            for order in range(1, 40):
                term = A @ term * h / order
                self.transition = self.transition + term

    def at(self, u: float, volts: float) -> float:
        """Thrust at a voltage of the command that gives u at the nominal one."""
        known = self.entry['rotor']
        if 'curve' not in known:
            return u * (volts / known['voltage']) ** 2
        return float(np.interp(u, *thrusts(int(known['curve'][5:7]), volts)))

    def __call__(self, u: float, k: int) -> float:
        """Thrust of sample k."""
        if -self.band[0] < u < self.band[1]:
            u = 0.0
        if self.voltage is not None:
            first, last, time = (
                self.voltage if np.ndim(self.voltage) else (self.voltage,) * 2 + (1,)
            )
            way = min(k * self.h / time, 1.0)
            u = (1 - way) * self.at(u, first) + way * self.at(u, last)
        if not self.lag and self.omega is None:
            return u
        asked = np.sign(u) * np.sqrt(abs(u))
        if self.omega is None:
            self.state[0] += (1 - exp(-self.h / self.lag)) * (asked - self.state[0])
        else:
            self.state = (self.transition @ [*self.state, asked])[:2]
        return self.state[0] * abs(self.state[0])


def thruster_matrix(thrusters: list[dict[str, Any]]) -> tuple[Array, Array, Array]:
    """T (6, n) and the lowest and highest thrusts (n,), N."""
    columns, lowest, highest = [], [], []
    for one in thrusters:
        direction = np.asarray(one['direction'], dtype=float)
        direction = direction / np.linalg.norm(direction)
        lever = np.cross(np.asarray(one['position'], dtype=float), direction)
        columns.append(np.concatenate((direction, lever)))
        reverse, forward = np.broadcast_to(np.abs(np.asarray(one['limit'], dtype=float)), 2)
        lowest.append(-reverse)
        highest.append(forward)
    return np.array(columns).T, np.array(lowest), np.array(highest)


class Actuators:
    """Loss, delay, thrusters, limit, axes, lag and rate, in this order; call once per sample."""

    def __init__(
        self,
        spec: dict[str, Any],
        vehicle: dict[str, Any],
        h: float,
        faults: Faults | None = None,
    ):
        rotors = {'rotors', 'rotor_lag', 'dead_band', 'voltage'}
        unknown = set(spec) - {'limit', 'rate', 'lag', 'delay', 'thrusters', 'saturation'} - rotors
        if unknown:
            raise ValueError(f'actuators do not know {sorted(unknown)}')
        self.limit = np.broadcast_to(np.asarray(spec.get('limit', np.inf), dtype=float), 6)
        self.rate = h * np.broadcast_to(np.asarray(spec.get('rate', np.inf), dtype=float), 6)
        lag, delay = float(spec.get('lag', 0.0)), float(spec.get('delay', 0.0))
        self.factor = 1.0 - exp(-h / lag) if lag > 0.0 else 1.0
        steps = round(delay / h)
        if abs(steps * h - delay) > 1e-9:
            raise ValueError('the delay must be a whole number of steps')
        self.under_way = [np.zeros(6)] * steps
        self.applied = np.zeros(6)
        self.T: Array | None = None
        if spec.get('thrusters', False):
            if 'thrusters' not in vehicle:
                raise ValueError('thrusters: true needs a vehicle file with thrusters')
            self.T, self.lowest, self.highest = thruster_matrix(vehicle['thrusters'])
            self.T_plus = np.linalg.pinv(self.T)
            # a row that the rows before it span has no wrench of its own
            ranks = [np.linalg.matrix_rank(self.T[:i], tol=1e-9) for i in range(1, 7)]
            self.spanned = np.diff(ranks, prepend=0) == 0
            self.rotors = (
                self.make_rotors(spec, vehicle['thrusters'], h) if rotors & set(spec) else []
            )
        self.priority = spec.get('saturation') == 'priority'
        self.cuts = self.T is not None or bool(np.isfinite(self.limit).any())
        self.faults, self.k, self.heard_at, self.h = faults, -1, -1, h
        self.names = [one['name'] for one in vehicle.get('thrusters', [])]
        self.heard = np.zeros(6)

    @staticmethod
    def make_rotors(spec: dict[str, Any], entries: list[dict[str, Any]], h: float) -> list[Rotor]:
        """Those of the vehicle file, or ideal ones, with what the scenario says in their place."""
        made = []
        for one in entries:
            known = dict(one.get('rotor', {})) if spec.get('rotors') else {}
            if 'rotor_lag' in spec:
                known = {'dead_band': known.get('dead_band', 0.0), 'lag': spec['rotor_lag']}
            if 'dead_band' in spec:
                known['dead_band'] = spec['dead_band']
            made.append(Rotor(known, one, spec.get('voltage'), h))
        return made

    def thrusts(self, tau: Array) -> Array:
        """Thrusts that are asked for, within the limits."""
        if not self.priority:
            return self.within(self.T_plus @ tau)
        first = np.array([0, 0, 1, 1, 1, 1.0])
        kept, rest = self.T_plus @ (first * tau), self.T_plus @ ((1 - first) * tau)
        kept = self.within(kept / 0.99) * 0.99  # a hundredth of each limit is left
        share = 1.0
        for there, more, low, high in zip(kept, rest, self.lowest, self.highest, strict=True):
            if there + more > high:
                share = min(share, max(high - there, 0.0) / more)
            elif there + more < low:
                share = min(share, min(low - there, 0.0) / more)
        return kept + share * rest

    def within(self, u: Array) -> Array:
        """Thrusts scaled down together."""
        limit = np.where(u > 0.0, self.highest, self.lowest)
        return u / max(1.0, (u / limit).max())

    def receive(self, tau: Array) -> Array:
        """h_k: what arrives of tau_k."""
        lost = self.faults.now('wrench_loss', self.k)
        if not lost:
            self.heard, self.heard_at = tau.copy(), self.k
        silence = (self.k - self.heard_at) * self.h
        within = [
            one['timeout'] for one in self.faults.there('wrench_loss', self.k) if 'timeout' in one
        ]
        if lost and within and silence > min(within) + 1e-9:
            self.heard = np.zeros(6)
        return self.heard

    def let_through(self, tau: Array) -> Array:
        """c_k of what the delay lets through, with the faults of thrusters and axes."""
        at_thrusters = self.faults.there('thruster', self.k)
        at_axes = self.faults.there('actuator', self.k)
        if self.T is not None and (at_thrusters or self.rotors):
            u = self.thrusts(tau)
            for i, rotor in enumerate(self.rotors):
                u[i] = rotor(u[i], self.k)
            for i, name in enumerate(self.names):
                u[i] = weakened(u[i], [one for one in at_thrusters if one['thruster'] in (name, i)])
            c = np.clip(self.T @ u, -self.limit, self.limit)
        else:
            c = self.saturate(tau)
        c = [weakened(c[i], [o for o in at_axes if o['axis'] == AXES[i]]) for i in range(6)]
        return np.array(c)

    def saturate(self, tau: Array) -> Array:
        """What thrusters and limits let through of tau, at once."""
        if self.priority:
            tau = self.T @ self.thrusts(tau)
        elif self.T is not None:
            u = self.T_plus @ tau  # thrusts
            share = 1.0
            for thrust, low, high in zip(u, self.lowest, self.highest, strict=True):
                if thrust > high:
                    share = min(share, high / thrust)
                elif thrust < low:
                    share = min(share, low / thrust)
            tau = self.T @ (share * u)
        return np.clip(tau, -self.limit, self.limit)

    def demand(self, tau: Array) -> Array:
        """What tau asks of the actuators: the part that the thrusters span."""
        if self.T is None:
            return tau
        return np.where(self.spanned, tau, self.T @ (self.T_plus @ tau))

    def __call__(self, tau: Array) -> Array:
        """a_k of tau_k, N and N m."""
        self.k += 1
        self.under_way.append(tau if self.faults is None else self.receive(tau))
        command = self.under_way.pop(0)
        if self.faults is not None:
            c = self.let_through(command)
        elif self.T is not None and self.rotors:
            u = [
                rotor(u, self.k)
                for rotor, u in zip(self.rotors, self.thrusts(command), strict=True)
            ]
            c = np.clip(self.T @ u, -self.limit, self.limit)
        else:
            c = self.saturate(command)
        step = self.factor * (c - self.applied)
        self.applied = self.applied + np.clip(step, -self.rate, self.rate)
        return self.applied


def not_wound_up(
    answer, x: Array, tau: Array, x_dot: Array, actuators: Actuators, law: str
) -> Array:
    """x_dot without the integrals of cut axes that would push them further out."""
    wanted, had = actuators.demand(tau), actuators.saturate(tau)
    excess = wanted - had
    kept = x_dot.copy()
    for j in range(INTEGRALS.get(law, len(x))):
        axis = j % 6
        if abs(excess[axis]) <= NOISE_OF_ROUNDING * np.abs(wanted).sum():
            continue
        ahead = x.copy()
        ahead[j] += x_dot[j]
        change = actuators.demand(answer(ahead)[0])[axis] - wanted[axis]
        if excess[axis] * change > 0.0:
            kept[j] = 0.0
    return kept


class Sensors:
    """Noise on velocity and attitude, and lost samples; call once per sample."""

    def __init__(self, spec: dict[str, Any], seed: int, faults: Faults | None = None):
        unknown = set(spec) - {'velocity_noise', 'attitude_noise', 'drop_out'}
        if unknown:
            raise ValueError(f'sensors do not know {sorted(unknown)}')
        noise, loss = np.random.SeedSequence(seed).spawn(2)
        self.noise = np.random.Generator(np.random.PCG64(noise))
        self.loss = np.random.Generator(np.random.PCG64(loss))
        self.velocity = np.broadcast_to(np.asarray(spec.get('velocity_noise', 0.0), float), 6)
        self.attitude = np.broadcast_to(np.asarray(spec.get('attitude_noise', 0.0), float), 3)
        self.drop_out = float(spec.get('drop_out', 0.0))
        self.last: tuple[Array, Array, Array] | None = None
        self.faults, self.k, self.newest = faults, -1, 0
        self.made: list[tuple[Array, Array, Array]] = []

    def __call__(self, position: Array, R: Array, nu: Array) -> tuple[Array, Array, Array]:
        """Measured position, rotation body to NED, and velocity; both generators always turn."""
        normal, uniform = self.noise.standard_normal(9), self.loss.random()
        moved, turn, lost = self.velocity * normal[:6], self.attitude * normal[6:], False
        if self.faults is not None:
            self.k += 1
            lost = bool(self.faults.now('sensor_drop_out', self.k))
            for bias in self.faults.there('sensor_bias', self.k):
                moved = moved + bias.get('velocity', np.zeros(6))
                turn = turn + bias.get('attitude', np.zeros(3))
        if self.last is None or not (lost or uniform < self.drop_out):
            turned = R @ rodrigues(turn)  # q exp(noise / 2), as matrices
            self.last = position.copy(), turned, nu + moved
        return self.last if self.faults is None else self.arrived()

    def arrived(self) -> tuple[Array, Array, Array]:
        """z_k: the newest measurement that has come through the delay."""
        self.made.append(self.last)
        delay = sum(one['delay'] for one in self.faults.there('sensor_delay', self.k))
        self.newest = max(self.newest, self.k - round(delay / self.faults.h))
        return self.made[self.newest]
