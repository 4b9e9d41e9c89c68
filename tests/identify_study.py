"""How often the intervals of `auv identify` cover the truth: `make identify-study`.

Usage: identify_study.py [SEEDS] [VEHICLE ...]

First of trials whose only error is noise, then of such with a slow disturbance that the model
lacks, for intervals of several kinds.
"""

import os
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

import numpy as np
import yaml
from helpers.sea_trials import SWINGS, gauss_markov, skewed, trial, truth, wrong_prior

from auv_analysis.metrics.coupling import delta_pi, delta_xi
from auv_analysis.studies.identify.couplings import couplings, signals_of
from auv_analysis.studies.identify.identified import Identified
from auv_analysis.studies.identify.identify import Settings, identify, split
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_dynamics.vehicle.vehicle_file import load_vehicle
from auv_gvc_controller.laws.model import decompose, inverse_upper

SKEWED = 'skewed'
SHARE = 0.1  # of inertia times swing per s2: standard deviation of the disturbance
DRAWS = 60  # of the bootstrap


def vehicle_of(name: str, folder: Path) -> tuple[Vehicle, str]:
    """A vehicle, and the file that a scenario names."""
    if name != SKEWED:
        return load_vehicle(name), name
    vehicle = skewed()
    folder.mkdir(parents=True, exist_ok=True)
    data = {
        'format': 1, 'name': SKEWED, 'source': 'drawn',
        'rigid_body': {'mass': float(vehicle.weight) / 9.81,
                       'center_of_gravity': vehicle.r_G.tolist()},
        'inertia_matrix': vehicle.M.tolist(),
        'hydrostatics': {'volume': float(vehicle.buoyancy) / 9.81 / 1000.0,
                         'center_of_buoyancy': vehicle.r_B.tolist()},
        'damping': {'linear': vehicle.D_linear.tolist(),
                    'quadratic': vehicle.D_quadratic.tolist()},
        'environment': {'water_density': 1000.0, 'gravity': 9.81},
    }  # fmt: skip
    path = folder / 'skewed.yaml'
    path.write_text(yaml.safe_dump(data), encoding='utf-8')
    return load_vehicle(path), str(path)


def one(name: str, seed: int, folder: Path) -> tuple[list[bool], list[bool], float, float]:
    """Whether each interval of coefficients and of couplings covers; worst M; ratio at 5 s."""
    vehicle, file = vehicle_of(name, folder)
    record, _ = trial(folder, 'herman2018' if name == SKEWED else name, seed, vehicle=file)
    training, held = split([record], 0.25)
    found = identify(training, held, wrong_prior(vehicle, seed))
    true, covered, worst = truth(found.fit.unknowns, vehicle), [], 0.0
    for row in found.coefficients():
        if row['status'] == 'identified' and row['name'] in true:
            covered.append(row['low'] <= true[row['name']] <= row['high'])
        if row['name'].startswith('M.') and len(set(row['name'].split('.'))) == 2:
            worst = max(worst, abs(row['value'] / true[row['name']] - 1.0))
    nu, tau = signals_of(found)
    Upsilon, _ = decompose(vehicle.M)
    xi, pi = delta_xi(inverse_upper(Upsilon), nu), delta_pi(Upsilon, tau)
    both = [
        row[f'{key}_low'] <= np.sqrt((signal[:, i] ** 2).mean()) <= row[f'{key}_high']
        for i, row in enumerate(couplings(found)['deformation'])
        for key, signal in (('delta_xi', xi), ('delta_pi', pi))
    ]
    ratios = [r['ratio'] for r in found.predictions if r['predictor'] == 'prior']
    return covered, both, worst, ratios[-1]


def white(found: Identified, row: Mapping[str, Any]) -> tuple[float, float]:
    """The interval as if residuals were white noise."""
    u, fit = found.fit.unknowns, found.fit
    J = u.gradient(fit.theta)[u.names.index(row['name'])]
    P, _ = u.precision(fit.theta)
    half = 1.96 * float(np.sqrt(J @ np.linalg.solve(fit.information + P, J)))
    return row['value'] - half, row['value'] + half


def disturbed(name: str, seed: int, folder: Path) -> tuple[dict[str, list[bool]], float]:
    """Whether intervals of several kinds cover, under a disturbance, and the observer's gain."""
    vehicle, file = vehicle_of(name, folder)
    moves_like = 'herman2018' if name == SKEWED else name
    deviations = SHARE * np.diag(vehicle.M) * np.array(SWINGS[moves_like][0])
    record, _ = trial(folder, moves_like, seed, vehicle=file,
                      disturbance=gauss_markov(deviations, seed))  # fmt: skip
    training, held = split([record], 0.25)
    covered: dict[str, list[bool]] = {}
    for kind, gain in (('', 0.0), (' and observer', None)):
        settings = Settings(observer=gain, bootstrap=DRAWS)
        found = identify(training, held, wrong_prior(vehicle, seed), settings)
        true = truth(found.fit.unknowns, vehicle)
        for row in found.coefficients():
            if row['status'] == 'identified' and row['name'] in found.fit.unknowns.names:
                for said, (low, high) in {
                    'white': white(found, row),
                    'sandwich': (row['low'], row['high']),
                    'bootstrap': (row['bootstrap_low'], row['bootstrap_high']),
                }.items():
                    inside = covered.setdefault(said + kind, [])
                    inside.append(low <= true[row['name']] <= high)
    return covered, found.problem.observer


def main() -> None:
    """Print coverage by vehicle."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    names = sys.argv[2:] or [*SWINGS, SKEWED]
    print(f'{seeds} seeds each; prior without couplings, M off by 40 %, D by 2, g by 30 %')
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            begun = time.perf_counter()
            found = [one(name, seed, Path(folder)) for seed in range(seeds)]
            covered, both = ([value for f in found for value in f[k]] for k in (0, 1))
            print(
                f'{name}: 95 % intervals cover {100 * np.mean(covered):.1f} % of '
                f'{len(covered)} coefficients, {100 * np.mean(both):.1f} % of {len(both)} couplings'
                f' (delta_xi, delta_pi); diagonal of M within {100 * max(f[2] for f in found):.2g}'
                f' %; error of held-out prediction at most {max(f[3] for f in found):.2g} of the '
                f'prior; {(time.perf_counter() - begun) / seeds:.1f} s each',
                flush=True,
            )  # fmt: skip
        print(f'with a disturbance that the model lacks ({SHARE:g} of inertia times swing, 5 s)')
        for name in names:
            each = [disturbed(name, seed, Path(folder)) for seed in range(seeds)]
            told = [
                f'{kind} {100 * np.mean([value for c, _ in each for value in c[kind]]):.1f} %'
                for kind in each[0][0]
            ]
            gains = ', '.join(f'{gain:g}' for gain in sorted({gain for _, gain in each}))
            print(
                f'{name}: 95 % intervals cover by {", by ".join(told)}; gains {gains}', flush=True
            )


if __name__ == '__main__':
    main()
