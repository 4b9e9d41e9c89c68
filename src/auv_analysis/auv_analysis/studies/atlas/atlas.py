"""Strength of inertial coupling between degrees of freedom, without units, vehicle by vehicle."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.metrics.coupling import structural_zeros
from auv_analysis.metrics.energy import NEGLIGIBLE
from auv_analysis.metrics.summary import summarize
from auv_analysis.output.progress import each
from auv_analysis.report.results import Results
from auv_analysis.scenario.scaling import scaled_case1
from auv_analysis.scenario.scenario import scenario_from
from auv_analysis.simulation.simulate import simulate
from auv_analysis.studies.compare.sources import numbered
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import read_yaml
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_dynamics.vehicle.vehicle_file import load_vehicle
from auv_gvc_controller.laws.model import decompose, inverse_upper


def inertial_correlation(M: np.ndarray) -> np.ndarray:
    """R_ij = M_ij / sqrt(M_ii M_jj): how much of the kinetic energy of two is their cross term.

    In a motion of i and j with equal energies 1/2 M_ii nu_i^2 = 1/2 M_jj nu_j^2, the cross term
    M_ij nu_i nu_j is R_ij times the sum of the two, and no motion of the two has a larger part.

    Parameters
    ----------
    M : (6, 6) symmetric positive definite

    Returns
    -------
    R : (6, 6) symmetric, 1 on its diagonal, within -1 and 1; no unit

    """
    root = np.sqrt(np.diagonal(M))
    return M / np.outer(root, root)


def velocity_shares(M: np.ndarray) -> np.ndarray:
    """Shares (6, 6) of the energy of a motion in j alone that the decomposition finds in xi_i.

    S = N^1/2 Upsilon^-1 D^-1/2 is upper triangular and S^T S = R, so that the squares of a column
    sum to 1: of 1/2 M_jj nu_j^2, 1/2 N_i xi_i^2 is the part S_ij^2. Beside the diagonal it is what
    deforms xi_i, (31) and (33), made unit-free by (30).

    Parameters
    ----------
    M : (6, 6) symmetric positive definite

    Returns
    -------
    shares : (6, 6) in 0..1, row i of column j; upper triangular, columns sum to 1

    """
    Upsilon, N = decompose(M)
    S = np.sqrt(N)[:, None] * inverse_upper(Upsilon) / np.sqrt(np.diagonal(M))
    return S**2


def input_shares(M: np.ndarray) -> np.ndarray:
    """Shares (6, 6) of the energy that an impulse in j alone leaves, that lie in xi_i.

    An impulse p leaves the energy 1/2 p^T M^-1 p, and with pi = Upsilon^T p that is the sum of
    1/2 pi_i^2 / N_i: of an impulse in j, Upsilon_ji^2 / (N_i (M^-1)_jj) is the part of i. Beside
    the diagonal it is what deforms pi_i, (32) and (34).

    Parameters
    ----------
    M : (6, 6) symmetric positive definite

    Returns
    -------
    shares : (6, 6) in 0..1, row i of column j; lower triangular, columns sum to 1

    """
    Upsilon, N = decompose(M)
    weights = Upsilon.T**2 / N[:, None]
    return weights / weights.sum(axis=0)


def coupling_strength(M: np.ndarray) -> float:
    """Largest size of all cross terms together, as a part of the energy without them.

    Over all motions, y^T (R - 1) y / y^T y lies between the extreme eigenvalues of R - 1; the
    larger magnitude of the two is returned. Zero where M is diagonal, at least max abs(R_ij).
    """
    values = np.linalg.eigvalsh(inertial_correlation(M))
    return float(max(values[-1] - 1.0, 1.0 - values[0]))


Pair = tuple[str, str]


@dataclass(frozen=True, eq=False)
class Chart:
    """Couplings of a vehicle by its inertia, and what they reach in case 1.

    Attributes
    ----------
    name, source : of the vehicle
    M, Upsilon, Upsilon_inv : (6, 6)
    N : (6,) kg, kg m2
    correlation : (6, 6) of `inertial_correlation`; what is rounding is zero
    velocity_shares, input_shares : (6, 6), in 0..1
    strength : of `coupling_strength`
    zeros : 'delta_xi' and 'delta_pi' -> degrees of freedom that vanish for every motion
    damped : pairs that damping or lift couples
    reached : of `reached`; empty where nobody has looked

    """

    name: str
    source: str
    M: np.ndarray
    Upsilon: np.ndarray
    Upsilon_inv: np.ndarray
    N: np.ndarray
    correlation: np.ndarray
    velocity_shares: np.ndarray
    input_shares: np.ndarray
    strength: float
    zeros: dict[str, list[str]]
    damped: list[Pair]
    reached: dict[str, Any] = field(default_factory=dict)

    @property
    def is_diagonal(self) -> bool:
        """Whether nothing is coupled by inertia: Upsilon = I."""
        return not self.pairs

    @property
    def pairs(self) -> list[Pair]:
        """Pairs that inertia couples, the strongest first."""
        found = [(i, j) for i, j in combinations(range(6), 2) if self.correlation[i, j] != 0.0]
        found.sort(key=lambda pair: -abs(self.correlation[pair]))
        return [(DOFS[i], DOFS[j]) for i, j in found]

    @property
    def largest(self) -> float:
        """Largest magnitude of the inertial correlation of two degrees of freedom."""
        return float(np.abs(np.triu(self.correlation, 1)).max())

    def as_dict(self) -> dict[str, Any]:
        """All of it, ready for JSON; shares in %."""
        arrays = ('M', 'N', 'Upsilon', 'Upsilon_inv', 'correlation')
        return {
            'source': self.source,
            'diagonal': self.is_diagonal,
            'strength_percent': 100 * self.strength,
            'largest_correlation_percent': 100 * self.largest,
            'pair_count': len(self.pairs),
            'pairs': [list(pair) for pair in self.pairs],
            **{key: getattr(self, key).tolist() for key in arrays},
            'velocity_shares_percent': (100 * self.velocity_shares).tolist(),
            'input_shares_percent': (100 * self.input_shares).tolist(),
            'structural_zeros': self.zeros,
            'damping_pairs': [list(pair) for pair in self.damped],
        }


def couplings_of(vehicle: Vehicle, name: str) -> Chart:
    """Couplings of a vehicle under a name."""
    Upsilon, N = decompose(vehicle.M)
    inverse = inverse_upper(Upsilon)
    correlation = _without_rounding(inertial_correlation(vehicle.M))
    diagonal = not np.triu(correlation, 1).any()
    return Chart(
        name=name,
        source=vehicle.source or '',
        M=vehicle.M,
        Upsilon=Upsilon,
        Upsilon_inv=inverse,
        N=N,
        correlation=correlation,
        velocity_shares=_without_rounding(velocity_shares(vehicle.M), NEGLIGIBLE**2),
        input_shares=_without_rounding(input_shares(vehicle.M), NEGLIGIBLE**2),
        strength=0.0 if diagonal else coupling_strength(vehicle.M),
        zeros=structural_zeros(Upsilon),
        damped=_damped(vehicle),
    )


def _without_rounding(A: np.ndarray, below: float = NEGLIGIBLE) -> np.ndarray:
    return np.where(np.abs(A) <= below, 0.0, A)


def _damped(vehicle: Vehicle) -> list[Pair]:
    size = np.abs(vehicle.D_linear) + np.abs(vehicle.D_quadratic)
    if vehicle.lift is not None:
        size += np.abs(vehicle.lift)
    both = size + size.T
    return [(DOFS[i], DOFS[j]) for i, j in combinations(range(6), 2) if both[i, j] > 0.0]


CONTROLLER = 'gvc'  # of case 1: the one whose deformations the paper draws


def reached(vehicle: str | Path) -> dict[str, Any]:
    """Largest deformations in case 1 scaled to a vehicle, under GVC.

    Parameters
    ----------
    vehicle : a vehicle file, or the bare name of a shipped one

    Returns
    -------
    found : ready for JSON
        failure : why there are no figures, '' where there are
        scenario : name
        delta_xi_max, delta_pi_max : (6,) m/s, rad/s and N, N m
        delta_xi_energy_percent : (6,) 1/2 N_i delta_xi_i^2 at that peak, of the mean kinetic energy
        kinetic_energy : mean, J

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    data, file = scaled_case1(vehicle), shipped('vehicles', vehicle)
    path = Path(f'{data["name"]}.yaml')
    scenario = scenario_from(data, read_yaml(file, 'vehicle'), path, file, {})
    try:
        summary = summarize(simulate(scenario, CONTROLLER))
    except ArithmeticError as error:
        return {'failure': str(error), 'scenario': scenario.name}
    coupling, mean = summary['coupling'], summary['kinetic_energy']['mean']
    size = np.array(coupling['delta_xi_max'])
    energy = 0.5 * np.array(summary['decomposition']['N']) * size**2
    return {
        'failure': '',
        'scenario': scenario.name,
        'delta_xi_max': coupling['delta_xi_max'],
        'delta_pi_max': coupling['delta_pi_max'],
        'delta_xi_energy_percent': (100 * energy / mean).tolist(),
        'kinetic_energy': mean,
    }


MATRICES = ('M', 'Upsilon', 'Upsilon_inv', 'correlation',
            'velocity_shares_percent', 'input_shares_percent')  # fmt: skip
WHOLE = ('diagonal', 'strength_percent', 'largest_correlation_percent')
PEAKS = ('delta_xi_max', 'delta_pi_max', 'delta_xi_energy_percent')


def charts(vehicles: Iterable[str]) -> list[Chart]:
    """Charts of vehicles, those that are coupled the most first.

    Parameters
    ----------
    vehicles : files, or bare names of shipped ones

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    vehicles = list(vehicles)
    loaded = [load_vehicle(vehicle) for vehicle in vehicles]
    names = numbered([vehicle.name for vehicle in loaded])
    known = [couplings_of(*pair) for pair in zip(loaded, names, strict=True)]
    pairs = each(zip(known, vehicles, strict=True), len(vehicles))
    found = [replace(chart, reached=reached(vehicle)) for chart, vehicle in pairs]
    return sorted(found, key=lambda chart: (-chart.strength, chart.name))


def results_of(found: Sequence[Chart]) -> Results:
    """The atlas: vehicle -> its numbers, and a table with a row per vehicle and ordered pair."""
    vehicles = {chart.name: chart.as_dict() | {'case1': chart.reached} for chart in found}
    results = Results('atlas', {'dofs': list(DOFS), 'vehicles': vehicles})
    rows = [row for name, entry in vehicles.items() for row in _rows(name, entry)]
    results.add('atlas', 'Couplings of ordered pairs of degrees of freedom', rows, {})
    return results


def _rows(name: str, entry: dict[str, Any]) -> Iterator[dict[str, Any]]:
    peaks = {f'case1_{key}': entry['case1'].get(key, [None] * 6) for key in PEAKS}
    for i, into in enumerate(DOFS):
        for j, of in enumerate(DOFS):
            row: dict[str, Any] = {'vehicle': name, 'in': into, 'of': of}
            row |= {key: entry[key][i][j] for key in MATRICES}
            row |= {key: values[i] if i == j else None for key, values in peaks.items()}
            yield row | {key: entry[key] for key in WHOLE}
