"""What a closed loop leaves of its samples: a full log, here, or figures, see `reduction`."""

from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.kernel.compile import specialised
from auv_dynamics.kernel.six import Vector, fill_vector
from auv_dynamics.plant.plant import SIZE


class Sample(NamedTuple):
    """What is known at one sample: lanes or floats, six each but for the arrays.

    Attributes
    ----------
    x, measured, state : (13,) true and measured state, (m,) state of the law
    nu_d, tau, applied, f, F : set-point, command, applied wrench, adaptive term, lumped uncertainty

    """

    x: np.ndarray
    measured: np.ndarray
    state: np.ndarray
    nu_d: Vector
    tau: Vector
    applied: Vector
    f: Vector
    F: Vector


@specialised('record')
def fill_record(record: Any, k: int, sample: Sample) -> None:
    """Keep what `record` keeps of sample k."""
    type(record).fill_record(record, k, sample)


class Log(NamedTuple):
    """A full record, a row per sample.

    Attributes
    ----------
    x, measured : (n + 1, 13) true state and what the law saw of it
    state : (n + 1, m) of the law
    nu_d, tau, applied, f, F : (n + 1, 6) as in `Sample`

    """

    x: np.ndarray
    measured: np.ndarray
    state: np.ndarray
    nu_d: np.ndarray
    tau: np.ndarray
    applied: np.ndarray
    f: np.ndarray
    F: np.ndarray

    @staticmethod
    def fill_record(record: 'Log', k: int, sample: Sample) -> None:
        """Write row k."""
        for i in range(SIZE):
            record.x[k, i] = sample.x[i]
            record.measured[k, i] = sample.measured[i]
        for i in range(sample.state.shape[0]):
            record.state[k, i] = sample.state[i]
        fill_vector(record.nu_d[k], 0, sample.nu_d)
        fill_vector(record.tau[k], 0, sample.tau)
        fill_vector(record.applied[k], 0, sample.applied)
        fill_vector(record.f[k], 0, sample.f)
        fill_vector(record.F[k], 0, sample.F)

    @classmethod
    def empty(cls, n: int, states: int) -> 'Log':
        """Log of n + 1 samples of a law with so many states, all NaN."""
        widths = (SIZE, SIZE, states, 6, 6, 6, 6, 6)
        return cls(*(np.full((n + 1, width), np.nan) for width in widths))
