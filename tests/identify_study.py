"""How often the intervals of `auv identify` cover the truth: `make identify-study`.

Usage: identify_study.py [SEEDS] [VEHICLE ...]
"""

import os
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

import numpy as np
import yaml
from trials import SWINGS, skewed, trial, truth, wrong_prior

from auv_analysis.metrics.coupling import delta_pi, delta_xi
from auv_analysis.studies.identify.couplings import couplings, signals_of
from auv_analysis.studies.identify.identify import identify, split
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_dynamics.vehicle.vehicle_file import load_vehicle
from auv_gvc_controller.laws.model import decompose, inverse_upper

SKEWED = 'skewed'


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


if __name__ == '__main__':
    main()
