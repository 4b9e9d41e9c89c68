"""Couplings of an identified model with their intervals: models drawn from it, through metrics."""

from typing import Any

import numpy as np

from auv_analysis.metrics.coupling import delta_pi, delta_xi
from auv_analysis.studies.identify.identified import BAND, Identified
from auv_analysis.studies.identify.unknowns import inertia_unit
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.laws.model import decompose, inverse_upper

DRAWS = 400
SAMPLES = 2000  # of the recording


def couplings(found: Identified) -> dict[str, list[dict[str, Any]]]:
    """Rows of three tables.

    Returns
    -------
    inertia : per pair of degrees of freedom its entry of M with interval, that of the prior, the
        entry of Upsilon with interval, and whether it is 'real' (the interval of M excludes
        zero), 'uncertain' or, where the data do not know it, 'not known'
    deformation : per degree of freedom root mean squares of delta_xi and delta_pi, (33) and (34),
        and their largest magnitudes, `delta_xi_max` and `delta_pi_max`
    shares : per component its share in the mean kinetic energy, (12)

    """
    draws = found.draws(DRAWS)
    nu, tau = signals_of(found)
    known = {row['name'] for row in found.coefficients() if row['status'] == 'identified'}
    M = np.concatenate([found.vehicle.M[None], found.found.M[None], draws.M])
    Upsilon, N = decompose((M + M.swapaxes(1, 2)) / 2)
    inverse = inverse_upper(Upsilon)
    xi, pi = (
        np.stack([_sizes(f(A, x)) for A in of], axis=1)
        for f, of, x in ((delta_xi, inverse, nu), (delta_pi, Upsilon, tau))
    )
    energy = N * np.stack([((nu @ A.T) ** 2).mean(axis=0) for A in inverse])
    share = energy / energy.sum(axis=1, keepdims=True)
    inertia = []
    for i in range(6):
        for j in range(i):
            name = f'M.{DOFS[i]}.{DOFS[j]}'
            row: dict[str, Any] = {'pair': f'{DOFS[i]}, {DOFS[j]}', **_told('M', M[:, i, j]),
                   **_told('Upsilon', Upsilon[:, j, i])}  # fmt: skip
            real = row['M_low'] > 0 or row['M_high'] < 0
            row['verdict'] = (
                'not known' if name not in known
                else 'real' if real else 'uncertain'
            )  # fmt: skip
            row['unit'] = inertia_unit(i, j)
            inertia.append(row)
    apart = [_excludes_zero(A[2:]) for A in (inverse, Upsilon)]
    deformation: list[dict[str, Any]] = []
    for i, dof in enumerate(DOFS):
        deformation.append({'dof': dof})
        for name, sizes, of in (('delta_xi', xi, apart[0][i]), ('delta_pi', pi, apart[1][:, i])):
            for key, size in zip((name, f'{name}_max'), sizes[:, :, i], strict=True):
                deformation[i] |= _told(key, size, certain=bool(of.any()))
    shares = [{'dof': dof, **_told('N', N[:, i]), **_told('share', share[:, i])}
              for i, dof in enumerate(DOFS)]  # fmt: skip
    return {'inertia': inertia, 'deformation': deformation, 'shares': shares}


def _sizes(deformation: np.ndarray) -> np.ndarray:
    """(2, 6) root mean squares and largest magnitudes of (k, 6)."""
    return np.stack([np.sqrt((deformation**2).mean(axis=0)), np.abs(deformation).max(axis=0)])


def _excludes_zero(draws: np.ndarray) -> np.ndarray:
    """(6, 6) whether off the diagonal an entry of matrices (draws, 6, 6) is apart from zero."""
    low, high = np.quantile(draws, BAND, axis=0)
    return ((low > 0) | (high < 0)) & ~np.eye(6, dtype=bool)


def _told(name: str, values: np.ndarray, *, certain: bool = True) -> dict[str, float]:
    """Prior, value and interval of values: prior, estimate, draws.

    A size whose parts may all be zero, which is not `certain`, may be zero too.
    """
    low, high = np.quantile(values[2:], BAND)
    low = low if certain else 0.0
    found = {'prior': values[0], name: values[1], 'low': low, 'high': high}
    return {k if k == name else f'{name}_{k}': float(v) for k, v in found.items()}


def signals_of(found: Identified) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and command (k, 6) at the same moments of the recording, for the metrics."""
    nu, tau = [], []
    for record in found.training:
        every = max(len(record.command) * len(found.training) // SAMPLES, 1)
        nu.append(np.nan_to_num(record.states(record.middles[::every])[:, 4:]))
        tau.append(record.command[::every])
    return np.concatenate(nu), np.concatenate(tau)
