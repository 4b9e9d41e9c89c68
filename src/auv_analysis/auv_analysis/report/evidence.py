"""What the claims are judged by: the signals of a run and a few questions to them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from auv_analysis.coupling import delta_pi, delta_xi
from auv_analysis.energy import kinetic_energy
from auv_analysis.report.text import number
from auv_analysis.run import Run
from auv_analysis.summary import TRANSIENT
from auv_gvc_controller.model import ControlModel, control_model

Verdict = Literal['reproduced', 'partly', 'not reproduced', 'other case', 'not evaluated']
NEAR_ZERO = 0.005  # m/s, rad/s: what counts as a settled error
FOREVER = float('inf')


class Finding(NamedTuple):
    """Our value as text, and the verdict."""

    ours: str
    verdict: Verdict


@dataclass(frozen=True, eq=False)
class Signals:
    """The paper's signals of a run, (n + 1, 6) each, and its N (6,)."""

    run: Run

    @cached_property
    def error(self) -> np.ndarray:
        """nu_d - nu in m/s, rad/s."""
        return self.run.nu_d - self.run.nu

    @cached_property
    def w(self) -> np.ndarray:
        """Estimate minus F in N, N m; only asked for where F is known."""
        return self.run.disturbance_estimate - self.F

    @cached_property
    def F(self) -> np.ndarray:
        """Lumped uncertainty in N, N m; only asked for where it is known."""
        if self.run.disturbance is None:
            raise ValueError('the lumped uncertainty of this run is not known')
        return self.run.disturbance

    @cached_property
    def delta_xi(self) -> np.ndarray:
        """Xi - nu in m/s, rad/s; (33)."""
        return delta_xi(self._model.Upsilon_inv.reshape(6, 6), self.run.nu)

    @cached_property
    def delta_pi(self) -> np.ndarray:
        """Pi - tau in N, N m; (34)."""
        return delta_pi(self._model.Upsilon.reshape(6, 6), self.run.tau)

    @cached_property
    def energy(self) -> np.ndarray:
        """Kinetic energy by component, J; (30)."""
        model = self._model
        return kinetic_energy(model.Upsilon_inv.reshape(6, 6), model.N, self.run.nu)

    @cached_property
    def _model(self) -> ControlModel:
        return control_model(self.run.vehicle)

    def part(self, values: np.ndarray, first: float, last: float = FOREVER) -> np.ndarray:
        """Samples of [first, last], in s from the start."""
        t, half = self.run.t - self.run.t[0], 0.5 * self.run.step
        return values[(t >= first - half) & (t <= last + half)]

    def peak(self, values: np.ndarray, first: float = 0.0, last: float = FOREVER) -> np.ndarray:
        """Largest magnitudes (6,) of [first, last]."""
        return np.abs(self.part(values, first, last)).max(axis=0)

    def late_peak(self, values: np.ndarray) -> np.ndarray:
        """Largest magnitudes (6,) after the transient."""
        return self.peak(values, TRANSIENT)

    def late_rms(self, values: np.ndarray) -> np.ndarray:
        """Root mean squares (6,) after the transient."""
        return np.sqrt(np.mean(self.part(values, TRANSIENT) ** 2, axis=0))

    def last_third(self, values: np.ndarray) -> np.ndarray:
        """Samples of the last third of the run."""
        return self.part(values, 2.0 / 3.0 * self.run.duration)

    def settled(self) -> float:
        """Time, s from the start, of the last sample with an error above 0.005; inf: the end."""
        outside = np.flatnonzero(np.abs(self.error).max(axis=1) > NEAR_ZERO)
        if len(outside) == 0:
            return 0.0
        end = outside[-1] == len(self.run.t) - 1
        return FOREVER if end else float(self.run.t[outside[-1]] - self.run.t[0])


@dataclass(frozen=True)
class Evidence:
    """The runs with the paper's gains; a judge is only asked when those that it needs exist.

    Attributes
    ----------
    signals : law -> signals of its run
    N : (6,) of the decomposition, kg and kg m2

    """

    signals: Mapping[str, Signals]
    N: tuple[float, ...]

    @property
    def gvc(self) -> Signals:
        """Signals of the GVC run."""
        return self.signals['gvc']

    @property
    def cl(self) -> Signals:
        """Signals of the CL run."""
        return self.signals['cl']

    @property
    def both(self) -> tuple[Signals, Signals]:
        """GVC, then CL."""
        return self.gvc, self.cl


def grade(parts: Iterable[bool]) -> Verdict:
    """All parts of a claim, some of them, none."""
    parts = [bool(part) for part in parts]
    return 'reproduced' if all(parts) else 'partly' if any(parts) else 'not reproduced'


def listed(values: Iterable[float], digits: int = 3) -> str:
    """Numbers separated by commas."""
    return ', '.join(number(value, digits) for value in values)


def seconds(time: float, duration: float, word: str = '') -> str:
    """'1.68 s' with a word before it, or that it did not happen in the run."""
    return f'{word}{time:.2f} s' if time < FOREVER else f'not in {duration:g} s'
