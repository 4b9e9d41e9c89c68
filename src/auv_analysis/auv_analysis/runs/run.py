"""A run: the samples of a simulated or recorded closed loop, with what is known of it."""

import mmap
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np

from auv_analysis.scenario.fault_words import Mark
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    import pandas as pd

Hold = Literal['continuous', 'zoh']  # law in every stage of the integrator, or sampled and held
HOLDS = get_args(Hold)
FOREIGN = 'foreign_bag'  # source of a run that another system recorded
BLOCK = 8192  # samples that are worked on together: their arrays fit into a processor's cache


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class RunInfo(ABC):
    """Run metadata, beside the samples.

    Attributes
    ----------
    vehicle : what the controller knows
    scenario : name of the scenario
    controller, law : name of the controller and of its law
    gains : the law's gains as the scenario gives them
    step : control period, s
    source : 'simulate', 'bag' or 'foreign_bag'
    hold : 'continuous' or 'zoh': whether the wrench was held between the samples
    kinds : kinds of the disturbances, None where they are not known
    notes : what is worth saying about the run, one line each
    gaps : (last time before, first time behind) of each time without samples, s as in t
    faults : of the simulated vehicle
    unrecorded : signals of a `Run` that were there, and that nobody recorded
    acceleration : of a run with `unexplained`: how nu_dot was estimated, and its error

    """

    vehicle: Vehicle
    scenario: str
    controller: str
    law: str
    gains: dict[str, Any]
    step: float
    source: str
    hold: str = 'zoh'
    kinds: frozenset[str] | None = None
    notes: tuple[str, ...] = ()
    gaps: tuple[tuple[float, float], ...] = ()
    faults: tuple[Mark, ...] = ()
    unrecorded: frozenset[str] = frozenset()
    acceleration: dict[str, Any] | None = None

    @property
    @abstractmethod
    def extent(self) -> 'Extent':
        """Length of the run, and the optional signals that it has."""

    def __repr__(self) -> str:
        """Description of the run, in a line."""
        known = self.extent
        return (
            f'<{type(self).__name__} {self.scenario}, {self.controller}: law {self.law}, vehicle '
            f'{self.vehicle.name}, by {self.source} ({self.hold}), {known.samples} samples from '
            f'{known.start:g} to {known.end:g} s>'
        )

    @property
    def samples(self) -> int:
        """Number of samples, n + 1."""
        return self.extent.samples

    @property
    def start(self) -> float:
        """Time of the first sample, s."""
        return self.extent.start

    @property
    def duration(self) -> float:
        """Length of the run, s."""
        return self.extent.end - self.extent.start

    @property
    def valid_share(self) -> float:
        """Share of the run's length that has samples."""
        lost = sum(end - begin - self.step for begin, end in self.gaps)
        return 1.0 - lost / (self.duration + self.step)

    @property
    def sensing(self) -> bool:
        """Whether the law saw measurements in place of the true velocity."""
        return self.extent.sensing

    @property
    def acting(self) -> bool:
        """Whether actuators stand between the command and the wrench applied."""
        return self.extent.acting

    @property
    def knows_disturbance(self) -> bool:
        """Whether the lumped uncertainty F and the estimate f are known, and w = f - F."""
        return self.extent.knows_disturbance

    @property
    def knows_setpoint(self) -> bool:
        """Whether there is a set-point, and errors with it."""
        return self.extent.knows_setpoint

    @property
    def knows_wrench(self) -> bool:
        """Whether any component of the wrench was recorded."""
        return self.extent.knows_wrench

    @property
    def unknown(self) -> tuple[str, ...]:
        """Degrees of freedom whose velocity was not recorded."""
        return self.extent.unknown

    def facts(self) -> dict[str, Any]:
        """Name -> value of what every kind of run has, for building another one."""
        return {entry.name: getattr(self, entry.name) for entry in fields(RunInfo)}


class Extent(NamedTuple):
    """Length of a run and its optional signals: times in s."""

    samples: int
    start: float
    end: float
    sensing: bool
    acting: bool
    knows_disturbance: bool
    knows_setpoint: bool
    knows_wrench: bool
    unknown: tuple[str, ...]


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Run(RunInfo):
    """One closed loop from start to end, n + 1 samples.

    A component of eta, nu or tau that was not recorded is NaN throughout.

    Attributes
    ----------
    t : (n + 1,) s
    eta : (n + 1, 6) position in m (NED), ZYX Euler angles in rad, psi unwrapped
    nu : (n + 1, 6) body velocity, m/s and rad/s
    nu_d, nu_d_dot : (n + 1, 6) set-point and its derivative, NaN where they are not known
    tau : (n + 1, 6) commanded wrench, N and N m, body frame
    disturbance : (n + 1, 6) lumped uncertainty F of (1), or None where it is not known
    disturbance_estimate : (n + 1, 6) f of the law, NaN where a bag does not have it
    measured : (n + 1, 6) velocity that the law saw; None: the true one
    applied : (n + 1, 6) wrench that the actuators delivered; None: the command
    law_state : (n + 1, m) the law's integrals, None where they are not known
    unexplained, unexplained_error : (n + 1, 6) F of (1) as estimated from measurements, and its
        standard error; None: not estimated
    required_wrench, required_wrench_error : (n + 1, 6) M nu_dot + C nu + D nu + g as estimated, the
        wrench that the motion needs, and its standard error, where no wrench was recorded

    The other attributes are those of `RunInfo`.

    """

    t: np.ndarray
    eta: np.ndarray
    nu: np.ndarray
    nu_d: np.ndarray
    nu_d_dot: np.ndarray
    tau: np.ndarray
    disturbance: np.ndarray | None
    disturbance_estimate: np.ndarray
    measured: np.ndarray | None = None
    applied: np.ndarray | None = None
    law_state: np.ndarray | None = None
    unexplained: np.ndarray | None = None
    unexplained_error: np.ndarray | None = None
    required_wrench: np.ndarray | None = None
    required_wrench_error: np.ndarray | None = None

    def part(self, keep: Any) -> 'Run':
        """Run of the samples that an index, slice or mask of samples keeps."""
        kept: dict[str, Any] = {name: rows_of(a, keep) for name, a in self.arrays().items()}
        t = np.atleast_1d(kept['t'])
        gaps = tuple(gap for gap in self.gaps if len(t) and t[0] <= gap[0] and gap[1] <= t[-1])
        return replace(self, **kept, gaps=gaps)

    def blocks(self, rows: int = BLOCK) -> Iterator['Run']:
        """The run in parts of so many samples."""
        return (self.part(slice(i, i + rows)) for i in range(0, len(self.t), rows))

    def wide_blocks(self, margin: int, rows: int = BLOCK) -> Iterator[tuple['Run', slice]]:
        """The same parts with up to `margin` samples at either side, and where the part is."""
        for i in range(0, len(self.t), rows):
            first = max(i - margin, 0)
            wide = self.part(slice(first, i + rows + margin))
            yield wide, slice(i - first, min(i + rows, len(self.t)) - first)

    def arrays(self) -> dict[str, np.ndarray]:
        """Name -> values of the signals that are there, t included."""
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}

    def columns(self) -> dict[str, np.ndarray]:
        """Name -> samples (n + 1,): `t` in s, then `eta.surge` to `f.yaw`, those that are there.

        By group: eta in m and rad; nu, nu_d, measured in m/s and rad/s; nu_d_dot in m/s2 and
        rad/s2; tau, applied, F (`disturbance`), f (`disturbance_estimate`) in N and N m.
        """
        groups = {
            'eta': self.eta,
            'nu': self.nu,
            'measured': self.measured,
            'nu_d': self.nu_d,
            'nu_d_dot': self.nu_d_dot,
            'tau': self.tau,
            'applied': self.applied,
            'F': self.disturbance,
            'f': self.disturbance_estimate,
        }
        found = {'t': self.t}
        for name, values in groups.items():
            if values is not None:
                found |= {f'{name}.{dof}': values[:, i] for i, dof in enumerate(DOFS)}
        return found

    def to_pandas(self) -> 'pd.DataFrame':
        """The `columns` as a data frame, with `t` as its index; needs pandas."""
        import pandas as pd

        return pd.DataFrame(self.columns()).set_index('t')

    @property
    def extent(self) -> Extent:
        """Length and optional signals, from the arrays."""
        unknown = (dof for dof, x in zip(DOFS, self.nu[0], strict=True) if np.isnan(x))
        return Extent(
            len(self.t),
            float(self.t[0]),
            float(self.t[-1]),
            sensing=self.measured is not None,
            acting=self.applied is not None,
            knows_disturbance=self.disturbance is not None
            and not np.isnan(self.disturbance_estimate[0]).any(),
            knows_setpoint=not np.isnan(self.nu_d[0]).all(),
            knows_wrench=not np.isnan(self.tau[0]).all(),
            unknown=tuple(unknown),
        )

    @property
    def nu_measured(self) -> np.ndarray:
        """(n + 1, 6) velocity that the law saw, m/s and rad/s."""
        return self.nu if self.measured is None else self.measured

    @property
    def tau_applied(self) -> np.ndarray:
        """(n + 1, 6) wrench that the actuators delivered, N and N m."""
        return self.tau if self.applied is None else self.applied


def rows_of(values: np.ndarray, keep: Any) -> np.ndarray:
    """Rows of an array; of one that is mapped from a file a copy, so that its pages can go again.

    Parameters
    ----------
    values : (n, ...)
    keep : index, slice or mask of rows

    """
    base: Any = values
    while isinstance(base, np.ndarray):
        base = base.base
    if not isinstance(base, mmap.mmap):
        return values[keep]
    rows = np.array(values[keep])
    base.madvise(mmap.MADV_DONTNEED)
    return rows


class Windows:
    """Cuts in time.

    Parameters
    ----------
    times : s; a sample at one of them belongs to the part behind it

    Attributes
    ----------
    parts : number of parts, one more than there are cuts

    """

    def __init__(self, times: Iterable[float]):
        self._times = sorted(set(times))
        self.parts = len(self._times) + 1

    def split(self, t: np.ndarray) -> Iterator[tuple[int, slice]]:
        """Number of each part that some samples at rising times (n,) lie in, and which do."""
        edges = [0, *np.searchsorted(t, self._times).tolist(), len(t)]
        for i, (first, last) in enumerate(pairwise(edges)):
            if last > first:
                yield i, slice(first, last)

    def between(self, first: float | None = None, last: float | None = None) -> range:
        """Numbers of the parts from one cut up to another; None: from or to the end."""
        begin = 0 if first is None else self._times.index(first) + 1
        end = self.parts if last is None else self._times.index(last) + 1
        return range(begin, end)
