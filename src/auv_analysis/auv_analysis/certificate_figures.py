"""The certificate of a run in blocks, and the figures that are read off it."""

from collections.abc import Callable, Iterator

import numpy as np

from auv_analysis.certificate import LAWS, Certificate, certificate, sampled_integral, size
from auv_analysis.differences import NODES
from auv_analysis.run import BLOCK, AnyRun, Run
from auv_gvc_controller.laws import make_gains
from auv_gvc_controller.model import ControlModel

BOUND_TOLERANCE = 1e-6  # of max abs((26)): allows for truncation in the measured L_dot
TRANSIENT = 2.0 - 1e-9  # s, which the paper leaves out of its errors
MARGIN = NODES - 1  # samples about a block with which its derivatives are those of the whole run
KEPT = 1 << 16  # samples outside the bound, as far as one can say before the end
SHARES = ('share_of_time_increasing', 'share_condition_27', 'share_bound_28')
FIGURES = (
    'identity_residual', 'identity_residual_rms', 'identity_residual_after_2s', *SHARES,
    'sup_s', 'sup_z', 'sup_w', 'L_first', 'L_last', 'rho_max',
)  # fmt: skip


def integral_of(run: Run, start: np.ndarray | None = None) -> np.ndarray | None:
    """Z of (17) as the law has it, (n, 6) in m and rad; None where it is not known.

    A bag does not hold it: there it follows from what the law saw, unless anti-windup may have
    stopped it at the limits of actuators.

    Parameters
    ----------
    run : a run or a part of one
    start : (6,) z at the first sample of a part that is not the beginning

    """
    if run.law in LAWS and run.law_state is not None:
        return run.law_state[:, :6]
    if run.applied is not None or run.hold != 'zoh':
        return None
    return sampled_integral(run.t, run.nu_d - run.nu_measured, start)


def certificate_blocks(
    run: AnyRun, model: ControlModel, rows: int = BLOCK
) -> Iterator[Certificate]:
    """Certificate of each block of a run of one of the `LAWS` with known gains.

    Parameters
    ----------
    run : the run
    model : what the law knows of the vehicle
    rows : samples of a block

    Yields
    ------
    certificate : the same numbers that `certificate` gives for the whole run; NaN what follows
        from a z or F that is not known

    """
    gains = make_gains(run.law, run.gains)
    start = None
    for wide, inside in run.wide_blocks(MARGIN, rows):
        unknown = np.full(wide.nu.shape, np.nan)
        z = integral_of(wide, start)
        start = None if z is None else z[max(inside.stop - MARGIN, 0)]  # where the next one begins
        F, f = wide.disturbance, wide.disturbance_estimate
        z, F = unknown if z is None else z, unknown if F is None else F
        found = certificate(wide.t, wide.nu, wide.nu_d, z, F, f, run.law, gains, model)
        yield found.part(inside)


class CertificateFigures:
    """Figures of a certificate that comes in blocks.

    Parameters
    ----------
    start : time of the run's first sample, s
    largest : max abs((26)) of the whole run, where it is known beforehand

    Attributes
    ----------
    unsettled : whether `largest` must be known beforehand to count where the bound holds: before
        the last block it is not, and samples about which nothing can be said yet are kept, but
        not any number of them

    """

    def __init__(self, start: float, largest: float | None = None):
        self._late = start + TRANSIENT
        self._known, self.unsettled = largest, False
        self._count = self._increasing = self._condition = 0
        self._squares = np.zeros(2)  # of the residual and of (26)
        self._largest, self._late_largest = np.zeros(2), np.zeros(2)
        self._beyond = np.zeros((2, 0))  # L_dot and (28) where the bound may not hold
        self._broken = 0  # samples where it does not
        self._figures: dict[str, float] = {}

    def add(self, found: Certificate) -> None:
        """Take in the next block, of one sample at least."""
        pair = np.array([found.L_dot - found.identity, found.identity])
        self._count += len(found.t)
        self._squares += (pair**2).sum(axis=1)
        self._largest = np.maximum(self._largest, np.abs(pair).max(axis=1))
        late = np.abs(pair[:, found.t >= self._late]).max(axis=1, initial=0.0)
        self._late_largest = np.maximum(self._late_largest, late)
        self._increasing += int(np.count_nonzero(found.identity > 0))
        self._condition += int(np.count_nonzero(found.dissipation >= np.abs(found.drift)))
        self._compare(np.array([found.L_dot, found.bound]))
        peaks = {f'sup_{name}': size(getattr(found, name)).max() for name in ('s', 'z', 'w')}
        peaks['rho_max'] = found.rho.max()
        for name, peak in peaks.items():
            self._figures[name] = np.maximum(self._figures.get(name, peak), peak)
        self._figures.setdefault('L_first', found.L[0])
        self._figures['L_last'] = found.L[-1]

    def _compare(self, rates: np.ndarray) -> None:
        """Compare L_dot and (28), (2, n)."""
        if self._known is not None:
            self._broken += _outside(rates, self._known).shape[1]
        elif not self.unsettled and np.isfinite(self.largest):
            rates = np.concatenate([self._beyond, rates], axis=1)
            self._beyond = _outside(rates, self.largest)
            self.unsettled = self._beyond.shape[1] > KEPT
            self._broken = self._beyond.shape[1]

    @property
    def largest(self) -> float:
        """Largest magnitude of (26) so far, W."""
        return float(self._largest[1])

    def result(self) -> dict[str, float | None]:
        """Figures by name; those that are not finite, or do not exist, are None or left out."""
        figures = dict(self._figures)
        residual, largest = self._largest
        if np.isfinite(largest):
            counts = self._increasing, self._condition, self._count - self._broken
            figures |= {k: n / self._count for k, n in zip(SHARES, counts, strict=True)}
        if largest > 0:
            figures['identity_residual'] = residual / largest
            figures['identity_residual_rms'] = np.sqrt(self._squares[0] / self._squares[1])
        late_residual, late_largest = self._late_largest
        if late_largest > 0:
            figures['identity_residual_after_2s'] = late_residual / late_largest
        return {name: float(x) if np.isfinite(x) else None for name, x in figures.items()}


def as_figures(
    certificates: Callable[[], Iterator[Certificate]], start: float
) -> dict[str, float | None]:
    """Figures of a run.

    Parameters
    ----------
    certificates : goes through the certificates of its blocks, from the beginning
    start : time of its first sample, s

    """
    figures = CertificateFigures(start)
    for found in certificates():
        figures.add(found)
    if figures.unsettled:
        figures = CertificateFigures(start, figures.largest)
        for found in certificates():
            figures.add(found)
    return figures.result()


def _outside(rates: np.ndarray, largest: float) -> np.ndarray:
    """Those columns of L_dot and (28) between which the bound does not hold."""
    return rates[:, ~(rates[0] <= rates[1] + BOUND_TOLERANCE * largest)]
